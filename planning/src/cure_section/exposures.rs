//! The resin that a stack's layers cure along a section.

use std::ops::Range;

use lamp_grayscale::exposure::MeasuredDoses;
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::{Dose, ExposureTime, FadingLight, GrayLevel, Resin};
use lamp_grayscale::{CuredLine, LineRun, SolidHeights, SummedLine};
use lamp_stack::{Image, Layer, Length};

use super::error::CureSectionError;
use super::line::SectionLine;
use crate::light::{LayerTime, Light};
use crate::section::DoseSection;

/// How exposures cure.
#[derive(Clone, Copy, Debug)]
pub enum CureRule {
    /// Each layer by itself, to the depth that its gray level reaches.
    Alone,
    /// Together, where the sum of doses is at least the critical dose; light goes straight down.
    Straight(FadingLight),
    /// The same with light that spreads sideways.
    Spread(Light),
    /// The same, but only whole layers, by the dose at one height of each.
    Voxels(Light),
}

impl CureRule {
    /// Returns the doses at which the material's numbers that the rule uses were measured.
    pub fn measured_doses(&self, material: &Material) -> MeasuredDoses {
        match self {
            Self::Alone | Self::Straight(_) => MeasuredDoses::of_depths(material),
            Self::Spread(_) | Self::Voxels(_) => MeasuredDoses::of_working_curve(material),
        }
    }

    /// Returns the rule in words.
    pub fn text(&self) -> &'static str {
        match self {
            Self::Alone => "each layer alone",
            Self::Straight(_) => "doses added up straight down",
            Self::Spread(_) => "doses added up, with spread",
            Self::Voxels(_) => "doses added up layer by layer",
        }
    }
}

/// The resin that a stack cures along a section, twice: with every pixel that is not black exposed
/// in full, and by gray levels.
#[derive(Debug)]
pub struct CureSection<'a> {
    resin: &'a Resin,
    rule: CureRule,
    course: SectionLine,
    cured: CuredResin,
    has_gray: bool,
    heights_um: Range<f64>,
}

/// The cured resin of an exposure: in full, and by gray levels.
#[derive(Debug)]
enum CuredResin {
    Alone { depths: Option<(ExposureTime, Vec<Length>)>, lines: [CuredLine; 2] },
    Summed([SummedLine; 2]),
    Spread(Box<(Light, [DoseSection; 2])>),
}

impl<'a> CureSection<'a> {
    /// Starts without a layer.
    pub fn new(resin: &'a Resin, rule: CureRule, course: SectionLine) -> Self {
        let cured = match rule {
            CureRule::Alone => CuredResin::Alone { depths: None, lines: Default::default() },
            CureRule::Straight(fading) => {
                let line = SummedLine::new(fading, course.pixels);
                CuredResin::Summed([line.clone(), line])
            }
            CureRule::Spread(light) | CureRule::Voxels(light) => {
                let section = DoseSection::new(light, course.line, course.pitch);
                CuredResin::Spread(Box::new((light, [section.clone(), section])))
            }
        };
        Self { resin, rule, course, cured, has_gray: false, heights_um: f64::MAX..f64::MIN }
    }

    /// Returns how exposures cure.
    pub fn rule(&self) -> CureRule {
        self.rule
    }

    /// Returns the line of pixels.
    pub fn course(&self) -> &SectionLine {
        &self.course
    }

    /// Returns the heights from the bottom of the lowest layer to the top of the highest.
    pub fn heights_um(&self) -> Range<f64> {
        self.heights_um.clone()
    }

    /// Exposes a layer, and returns the dose of its white. Layers come from the bottom up.
    ///
    /// # Errors
    /// Returns an error if the layer does not state its height and thickness, if neither the layer
    /// nor the resin states a time, or if the section misses its image.
    pub fn add(&mut self, layer: &Layer) -> Result<Dose, CureSectionError> {
        let (bottom, LayerTime { thickness, time }) = self.exposure(layer)?;
        let (line, image) = (self.course.line, &layer.image);
        let top = Length::from_um(bottom.um() + thickness.um());
        match &mut self.cured {
            CuredResin::Alone { depths, lines: [in_full, by_levels] } => {
                if depths.as_ref().is_none_or(|(of, _)| *of != time) {
                    let depth = |level| self.resin.depth(GrayLevel::from_u8(level), time);
                    *depths = Some((time, (0..=255u8).map(depth).collect()));
                }
                let depths = &depths.as_ref().expect("they were just made").1;
                let (runs, pixels) = (line.runs(image), line.len(image));
                in_full.expose_runs(&runs, pixels, top, |_| depths[255]);
                by_levels.expose_runs(&runs, pixels, top, |level| depths[usize::from(level)]);
            }
            CuredResin::Summed([in_full, by_levels]) => {
                let end = self.course.pixels;
                // A later page may be larger.
                let within = |(from, to, level): LineRun| (from.min(end), to.min(end), level);
                let runs: Vec<LineRun> = line.runs(image).into_iter().map(within).collect();
                in_full.expose(whitened(&runs), bottom, thickness, time);
                by_levels.expose(runs, bottom, thickness, time);
            }
            CuredResin::Spread(spread) => {
                let exposed = LayerTime { thickness, time };
                let (light, [in_full, by_levels]) = &mut **spread;
                in_full.expose(image, bottom, exposed, |_| 1.0);
                by_levels.expose(image, bottom, exposed, |level| light.of_level(level));
            }
        }
        self.has_gray |= matches!(&**image, Image::Gray(_));
        self.heights_um.start = self.heights_um.start.min(bottom.um());
        self.heights_um.end = self.heights_um.end.max(top.um());
        Ok(self.resin.light() * time)
    }

    /// Returns the height of a layer's bottom, its thickness and its time. Without a time, white
    /// cures just the layer.
    fn exposure(&self, layer: &Layer) -> Result<(Length, LayerTime), CureSectionError> {
        let name = || layer.info.name();
        let of_page = layer.info.z().zip(layer.info.thickness_um.map(Length::from_um));
        let (bottom, thickness) = of_page.ok_or_else(|| CureSectionError::NoHeight(name()))?;
        let wrong = |number: f64| !(number > 0.0 && number.is_finite());
        if wrong(thickness.um()) || layer.info.exposure_ms.is_some_and(wrong) {
            return Err(CureSectionError::NotPositive(name()));
        }
        if !self.course.line.crosses(&layer.image) {
            return Err(CureSectionError::TooSmall(name()));
        }
        let time = match layer.info.exposure_ms {
            Some(ms) => ExposureTime::from_ms(ms),
            None => self
                .resin
                .exposure_time(thickness, 1.0)
                .map_err(|problem| CureSectionError::NoExposure { layer: name(), problem })?,
        };
        Ok((bottom, LayerTime { thickness, time }))
    }

    /// Returns the cured heights at each pixel, with a name: in full, and by gray levels if there
    /// are any.
    pub fn cured(&self) -> Vec<(&'static str, Vec<SolidHeights>)> {
        let of = |k: usize| match &self.cured {
            CuredResin::Alone { lines, .. } => lines[k].pixels().to_vec(),
            CuredResin::Summed(lines) => lines[k].cured(self.heights_um.start),
            CuredResin::Spread(spread) => match self.rule {
                CureRule::Voxels(_) => spread.1[k].cured(),
                _ => spread.1[k].cured_by_height(),
            },
        };
        let names: &[_] = if self.has_gray { &["white", "gray"] } else { &["white"] };
        names.iter().enumerate().map(|(k, &name)| (name, of(k))).collect()
    }
}

/// Returns the runs at full white, neighbors joined.
fn whitened(runs: &[LineRun]) -> Vec<LineRun> {
    let touching = |a: &LineRun, b: &LineRun| a.1 == b.0;
    let white = |runs: &[LineRun]| (runs[0].0, runs[runs.len() - 1].1, 255);
    runs.chunk_by(touching).map(white).collect()
}
