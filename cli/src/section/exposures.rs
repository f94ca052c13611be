//! What a stack's layers cure along a section.

use std::ops::Range;

use anyhow::{Context, anyhow};
use lamp_grayscale::resin::{ExposureTime, GrayLevel, Resin};
use lamp_grayscale::{CuredLine, SolidHeights};
use lamp_planning::{DoseSection, LayerTime, Light};
use lamp_stack::{Image, Layer, Length};

use super::line::SectionLine;

/// The exposures of a stack along a section: every pixel that is not black in full, and by gray
/// levels.
pub(crate) struct Exposures<'a> {
    resin: &'a Resin,
    pub(crate) course: SectionLine,
    cured: Cured,
    has_gray: bool,
    pub(super) heights_um: Range<f64>,
}

/// What exposures cure.
enum Cured {
    /// Each alone, as deep as its gray level reaches.
    Alone { depths: Option<(ExposureTime, Vec<Length>)>, in_full: CuredLine, by_levels: CuredLine },
    /// Together, where their doses add up to the critical one.
    Added(Box<Added>),
}

struct Added {
    light: Light,
    in_full: DoseSection,
    by_levels: DoseSection,
}

impl<'a> Exposures<'a> {
    /// Exposures of which each cures by itself.
    pub(crate) fn alone(resin: &'a Resin, course: SectionLine) -> Self {
        let [in_full, by_levels] = [CuredLine::default(), CuredLine::default()];
        Self::new(resin, course, Cured::Alone { depths: None, in_full, by_levels })
    }

    /// Exposures whose doses add up.
    pub(crate) fn added(resin: &'a Resin, light: Light, course: SectionLine) -> Self {
        let section = || DoseSection::new(light, course.line, course.dpi);
        let added = Added { light, in_full: section(), by_levels: section() };
        Self::new(resin, course, Cured::Added(Box::new(added)))
    }

    fn new(resin: &'a Resin, course: SectionLine, cured: Cured) -> Self {
        Self { resin, course, cured, has_gray: false, heights_um: f64::MAX..f64::MIN }
    }

    /// Exposes a layer. They come from the bottom up.
    pub(crate) fn add(&mut self, layer: &Layer) -> anyhow::Result<()> {
        let (bottom, LayerTime { thickness, time }) = self.exposure(layer)?;
        let (line, image) = (self.course.line, &layer.image);
        let top = Length::from_um(bottom.um() + thickness.um());
        match &mut self.cured {
            Cured::Alone { depths, in_full, by_levels } => {
                if depths.as_ref().is_none_or(|(of, _)| *of != time) {
                    let depth = |level| self.resin.depth(GrayLevel::from_u8(level), time);
                    *depths = Some((time, (0..=255u8).map(depth).collect()));
                }
                let depths = &depths.as_ref().expect("they were just made").1;
                in_full.expose(line, image, top, |_| depths[255]);
                by_levels.expose(line, image, top, |level| depths[usize::from(level)]);
            }
            Cured::Added(added) => {
                let exposed = LayerTime { thickness, time };
                let Added { light, in_full, by_levels } = &mut **added;
                in_full.expose(image, bottom, exposed, |_| 1.0);
                by_levels.expose(image, bottom, exposed, |level| light.of_level(level));
            }
        }
        self.has_gray |= matches!(&**image, Image::Gray(_));
        self.heights_um.start = self.heights_um.start.min(bottom.um());
        self.heights_um.end = self.heights_um.end.max(top.um());
        Ok(())
    }

    /// The height of a layer's bottom, its thickness and its time. Without a time, white cures
    /// just the layer.
    fn exposure(&self, layer: &Layer) -> anyhow::Result<(Length, LayerTime)> {
        let name = || layer.info.name();
        let of_page = layer.info.z().zip(layer.info.thickness_um.map(Length::from_um));
        let (bottom, thickness) = of_page
            .with_context(|| format!("{} does not state its height and thickness", name()))?;
        let wrong = |number: f64| !(number > 0.0 && number.is_finite());
        if wrong(thickness.um()) || layer.info.exposure_ms.is_some_and(wrong) {
            return Err(anyhow!(
                "{} states a thickness or an exposure that is not above zero",
                name()
            ));
        }
        if !self.course.line.crosses(&layer.image) {
            return Err(anyhow!("{} is smaller than the first", name()));
        }
        let time = match layer.info.exposure_ms {
            Some(ms) => ExposureTime::from_ms(ms),
            None => self
                .resin
                .exposure_time(thickness, 1.0)
                .with_context(|| format!("{} states no exposure", name()))?,
        };
        Ok((bottom, LayerTime { thickness, time }))
    }

    /// What is cured at each pixel, with a name: in full, and by gray levels if there are any.
    pub(super) fn cured(&self) -> Vec<(&'static str, Vec<SolidHeights>)> {
        let (in_full, by_levels) = match &self.cured {
            Cured::Alone { in_full, by_levels, .. } => {
                (in_full.pixels().to_vec(), by_levels.pixels().to_vec())
            }
            Cured::Added(added) => (added.in_full.cured(), added.by_levels.cured()),
        };
        let mut cured = vec![("white", in_full)];
        if self.has_gray {
            cured.push(("gray", by_levels));
        }
        cured
    }
}
