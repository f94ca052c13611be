//! What is cured along a vertical section, as areas and as a picture.

use std::io::{self, Write};
use std::ops::Range;

use anyhow::anyhow;
use lamp_grayscale::{OutlinePiece, PixelLine, SolidHeights, excess, shared_height};
use lamp_stack::{Length, write_rgb_png};

use super::exposures::Exposures;
use super::line::SectionLine;
use super::painter::Scene;
use crate::picture::PictureScale;

/// A section's pictures side by side: each a name and what is cured.
pub(crate) struct SectionPicture {
    course: SectionLine,
    rule: &'static str,
    pixels: Range<u32>,
    heights_um: Range<f64>,
    cured: Vec<(&'static str, Vec<SolidHeights>)>,
    part: Option<Vec<Vec<OutlinePiece>>>,
}

/// Pictures wider or higher than this cannot be looked at.
const MAX_PICTURE_SIDE: f64 = 50_000.0;

impl SectionPicture {
    /// The pictures of what was cured, between the first layer's bottom and the
    /// last one's top. `along_mm` is the stretch shown, all where `None`.
    pub(crate) fn new(
        exposures: &Exposures<'_>,
        part: Option<Vec<Vec<OutlinePiece>>>,
        along_mm: Option<&Range<f64>>,
    ) -> anyhow::Result<Self> {
        let Exposures { course, heights_um, .. } = exposures;
        let pixels = along_mm.map_or(0..course.pixels, |along| course.within(along));
        if pixels.is_empty() {
            return Err(anyhow!("no pixel of the section lies in this stretch"));
        }
        let clipped = |solids: Vec<SolidHeights>| -> Vec<SolidHeights> {
            solids.iter().map(|solid| clip(solid, heights_um)).collect()
        };
        let cured = exposures.cured().into_iter().map(|(name, solids)| (name, clipped(solids)));
        Ok(Self {
            course: *course,
            rule: exposures.rule.text(),
            pixels,
            heights_um: heights_um.clone(),
            cured: cured.collect(),
            part,
        })
    }

    /// An area in mm², from mean heights over every pixel.
    fn area_mm2(&self, height_at: impl Fn(usize) -> Length) -> f64 {
        let pixels = self.pixels.start as usize..self.pixels.end as usize;
        pixels.map(|pixel| height_at(pixel).mm()).sum::<f64>() * self.course.dpi.pitch().mm()
    }

    /// The areas, as a table.
    pub(crate) fn text(&self, material: &str) -> String {
        let line = match self.course.line {
            PixelLine::Row(row) => format!("row {row}"),
            PixelLine::Column(column) => format!("column {column}"),
        };
        let [low, high] = [self.heights_um.start, self.heights_um.end].map(|um| um / 1000.0);
        let (plane, rule) = (self.course.plane(), self.rule);
        let mut text = format!(
            "{plane} ({line}), z {low:.3} to {high:.3} mm, cured as {material}, {rule}; mm2:\n"
        );
        let area = |cured: &[SolidHeights]| self.area_mm2(|pixel| excess(&cured[pixel], &[]));
        let Some(part) = &self.part else {
            for (name, cured) in &self.cured {
                text += &format!("{name:<8}cured {:.4}\n", area(cured));
            }
            return text;
        };
        let shown = [[self.heights_um.start, self.heights_um.end]];
        let whole = self.area_mm2(|pixel| shared_height(&shown, &part[pixel]));
        text += &format!(
            "{:<8}{:>12}{:>12}{:>12}{:>12}\n",
            "", "part", "cured", "overshoot", "missing"
        );
        let centres = ("pixels", self.centres(part));
        for (name, cured) in self.cured.iter().chain([&centres]) {
            let shared = self.area_mm2(|pixel| shared_height(&cured[pixel], &part[pixel]));
            let cured = area(cured);
            // Rounding may leave less than nothing.
            let [over, under] = [cured, whole].map(|area| (area - shared).max(0.0));
            text += &format!("{name:<8}{whole:>12.4}{cured:>12.4}{over:>12.4}{under:>12.4}\n");
        }
        text
    }

    /// Returns the heights of the part at each pixel's centre: what pixels would cure if each cured
    /// just the part below and above its centre.
    fn centres(&self, part: &[Vec<OutlinePiece>]) -> Vec<SolidHeights> {
        let shown = |[from, to]: [f64; 2]| {
            let heights = [from.max(self.heights_um.start), to.min(self.heights_um.end)];
            (heights[0] < heights[1]).then_some(heights)
        };
        let centre = |pixel: &Vec<OutlinePiece>| {
            pixel.iter().filter_map(|piece| piece.at(0.5).and_then(shown)).collect()
        };
        part.iter().map(centre).collect()
    }

    fn scene(&self) -> Scene<'_> {
        Scene {
            pixels: self.pixels.clone(),
            heights_um: self.heights_um.clone(),
            pitch_um: self.course.dpi.pitch().um(),
            cured: self.cured.iter().map(|(_, cured)| &cured[..]).collect(),
            part: self.part.as_deref(),
        }
    }

    /// Draws the pictures.
    pub(crate) fn write_png(&self, scale: PictureScale, out: impl Write) -> io::Result<()> {
        let scene = self.scene();
        let size = [scene.whole_width(scale), scene.size(scale)[1]].map(|side| side as u32);
        write_rgb_png(out, size[0], size[1], scene.rows(scale))
    }

    /// Checks that a picture can be looked at.
    pub(crate) fn check_size(&self, scale: PictureScale) -> anyhow::Result<()> {
        let [width, height] = self.scene().size(scale);
        if width.max(height) as f64 > MAX_PICTURE_SIDE {
            return Err(anyhow!(
                "the picture would be {width} x {height} pixels: choose a smaller --scale, or less with --along and --layers"
            ));
        }
        Ok(())
    }
}

/// Returns the stretches between two heights.
fn clip(solid: &[[f64; 2]], heights_um: &Range<f64>) -> SolidHeights {
    let cut = |&[from, to]: &[f64; 2]| [from.max(heights_um.start), to.min(heights_um.end)];
    solid.iter().map(cut).filter(|[from, to]| from < to).collect()
}
