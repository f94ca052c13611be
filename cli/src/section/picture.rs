//! Draws what is cured along a vertical section.

use std::io::{self, Write};
use std::ops::Range;

use anyhow::anyhow;
use lamp_grayscale::{PixelLine, SolidHeights, excess};
use lamp_stack::{Length, write_rgb_png};

use super::exposures::Exposures;
use super::line::SectionLine;
use crate::picture::PictureScale;

/// A section's pictures side by side: each a name and what is cured.
pub(crate) struct SectionPicture {
    course: SectionLine,
    pixels: Range<u32>,
    heights_um: Range<f64>,
    cured: Vec<(&'static str, Vec<SolidHeights>)>,
    part: Option<Vec<SolidHeights>>,
}

/// Black pixels between two pictures.
const GAP: usize = 8;
/// Pictures wider or higher than this cannot be looked at.
const MAX_PICTURE_SIDE: f64 = 50_000.0;

const EMPTY: [u8; 3] = [24, 26, 30];
const CURED: [u8; 3] = [200, 204, 208];
const OVERSHOOT: [u8; 3] = [226, 72, 52];
const MISSING: [u8; 3] = [52, 130, 226];
const OUTLINE: [u8; 3] = [255, 205, 60];

impl SectionPicture {
    /// The pictures of what was cured, between the first layer's bottom and the
    /// last one's top. `along_mm` is the stretch shown, all where `None`.
    pub(crate) fn new(
        exposures: &Exposures<'_>,
        part: Option<Vec<SolidHeights>>,
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
            pixels,
            heights_um: heights_um.clone(),
            cured: cured.collect(),
            part: part.map(clipped),
        })
    }

    /// An area in mm², from lengths at every pixel.
    fn area_mm2(&self, length_at: impl Fn(usize) -> Length) -> f64 {
        let pixels = self.pixels.start as usize..self.pixels.end as usize;
        pixels.map(|pixel| length_at(pixel).mm()).sum::<f64>() * self.course.dpi.pitch().mm()
    }

    /// The areas, as a table.
    pub(crate) fn text(&self, material: &str) -> String {
        let line = match self.course.line {
            PixelLine::Row(row) => format!("row {row}"),
            PixelLine::Column(column) => format!("column {column}"),
        };
        let [low, high] = [self.heights_um.start, self.heights_um.end].map(|um| um / 1000.0);
        let plane = self.course.plane();
        let mut text =
            format!("{plane} ({line}), z {low:.3} to {high:.3} mm, cured as {material}; mm2:\n");
        let Some(part) = &self.part else {
            for (name, cured) in &self.cured {
                let area = self.area_mm2(|pixel| excess(&cured[pixel], &[]));
                text += &format!("{name:<8}cured {area:.4}\n");
            }
            return text;
        };
        let whole = self.area_mm2(|pixel| excess(&part[pixel], &[]));
        text += &format!("{:<8}{:>12}{:>12}{:>12}\n", "", "part", "overshoot", "missing");
        for (name, cured) in &self.cured {
            let over = self.area_mm2(|pixel| excess(&cured[pixel], &part[pixel]));
            let under = self.area_mm2(|pixel| excess(&part[pixel], &cured[pixel]));
            text += &format!("{name:<8}{whole:>12.4}{over:>12.4}{under:>12.4}\n");
        }
        text
    }

    /// Draws the pictures.
    pub(crate) fn write_png(&self, scale: PictureScale, out: impl Write) -> io::Result<()> {
        let [width, height] = self.size(scale);
        let all = width * self.cured.len() + GAP * (self.cured.len() - 1);
        let rows = (0..height).map(|row| {
            let panel = |(_, cured): &(_, Vec<SolidHeights>)| self.row(row, cured, scale, width);
            let panels: Vec<_> = self.cured.iter().map(panel).collect();
            panels.join(&[0; 3 * GAP][..])
        });
        write_rgb_png(out, all as u32, height as u32, rows)
    }

    /// Checks that a picture can be looked at.
    pub(crate) fn check_size(&self, scale: PictureScale) -> anyhow::Result<()> {
        let [width, height] = self.size(scale);
        if width.max(height) as f64 > MAX_PICTURE_SIDE {
            return Err(anyhow!(
                "the picture would be {width} x {height} pixels: choose a smaller --scale, or less with --along and --layers"
            ));
        }
        Ok(())
    }

    /// The width and height of one picture, at least a pixel.
    fn size(&self, scale: PictureScale) -> [usize; 2] {
        let pitch_um = self.course.dpi.pitch().um();
        let height = (self.heights_um.end - self.heights_um.start) / pitch_um;
        [self.pixels.len() as f64, height]
            .map(|pixels| (pixels * factor(scale)).ceil().max(1.0) as usize)
    }

    /// A row of a picture, from the top: what is at its pixels' centres.
    fn row(
        &self,
        row: usize,
        cured: &[SolidHeights],
        scale: PictureScale,
        width: usize,
    ) -> Vec<u8> {
        let step_um = self.course.dpi.pitch().um() / factor(scale);
        let z_at = |row: usize| self.heights_um.end - (row as f64 + 0.5) * step_um;
        let pixel_at = |column: usize| {
            let along = (column as f64 + 0.5) / factor(scale);
            (self.pixels.start + along as u32).min(self.pixels.end - 1) as usize
        };
        let z_um = z_at(row);
        let mut rgb = Vec::with_capacity(3 * width);
        for column in 0..width {
            let pixel = pixel_at(column);
            let is_cured = holds(&cured[pixel], z_um);
            let colour = match &self.part {
                None => {
                    if is_cured {
                        CURED
                    } else {
                        EMPTY
                    }
                }
                Some(part) => {
                    let is_part = holds(&part[pixel], z_um);
                    let left = &part[pixel_at(column.saturating_sub(1))];
                    // What lies outside the picture makes no edge.
                    let below_um = z_at(row + 1).max(self.heights_um.start);
                    let edge =
                        is_part != holds(left, z_um) || is_part != holds(&part[pixel], below_um);
                    match (edge, is_cured, is_part) {
                        (true, ..) => OUTLINE,
                        (_, true, true) => CURED,
                        (_, true, false) => OVERSHOOT,
                        (_, false, true) => MISSING,
                        (_, false, false) => EMPTY,
                    }
                }
            };
            rgb.extend(colour);
        }
        rgb
    }
}

fn factor(scale: PictureScale) -> f64 {
    match scale {
        PictureScale::Up(up) => f64::from(up),
        PictureScale::Down(down) => 1.0 / f64::from(down),
    }
}

fn holds(solid: &[[f64; 2]], z_um: f64) -> bool {
    solid.iter().any(|[from, to]| (*from..*to).contains(&z_um))
}

/// Returns the stretches between two heights.
fn clip(solid: &[[f64; 2]], heights_um: &Range<f64>) -> SolidHeights {
    let cut = |&[from, to]: &[f64; 2]| [from.max(heights_um.start), to.min(heights_um.end)];
    solid.iter().map(cut).filter(|[from, to]| from < to).collect()
}
