//! A vertical section of what is cured, as a table of areas and as a picture.

use std::io::{self, Write};

use lamp_grayscale::PixelLine;
use lamp_planning::cure_section::ShownSection;
use lamp_stack::write_rgb_png;

use super::painter::SectionScene;
use crate::PlotError;
use crate::picture::PictureScale;

/// A section's pictures side by side, and its areas as a table.
pub struct SectionPicture(
    /// The section.
    pub ShownSection,
);

/// Pictures wider or higher than this cannot be looked at.
const MAX_PICTURE_SIDE: f64 = 50_000.0;

impl SectionPicture {
    /// The areas, as a table.
    pub fn text(&self, material: &str) -> String {
        let Self(shown) = self;
        let line = match shown.course.line {
            PixelLine::Row(row) => format!("row {row}"),
            PixelLine::Column(column) => format!("column {column}"),
        };
        let [low, high] = [shown.heights_um.start, shown.heights_um.end].map(|um| um / 1000.0);
        let (plane, rule) = (shown.course.plane(), shown.rule.text());
        let mut text = format!(
            "{plane} ({line}), z {low:.3} to {high:.3} mm, cured as {material}, {rule}; mm2:\n"
        );
        if shown.part.is_some() {
            text += &format!(
                "{:<8}{:>12}{:>12}{:>12}{:>12}\n",
                "", "part", "cured", "overshoot", "missing"
            );
        }
        for areas in shown.areas() {
            let (name, cured) = (areas.name, areas.cured_mm2);
            text += &match areas.beside_part {
                Some(beside) => format!(
                    "{name:<8}{:>12.4}{cured:>12.4}{:>12.4}{:>12.4}\n",
                    beside.part_mm2, beside.overshoot_mm2, beside.missing_mm2
                ),
                None => format!("{name:<8}cured {cured:.4}\n"),
            };
        }
        text
    }

    fn scene(&self) -> SectionScene<'_> {
        let Self(shown) = self;
        SectionScene {
            pixels: shown.pixels.clone(),
            heights_um: shown.heights_um.clone(),
            pitch_um: shown.course.along().pitch().um(),
            cured: shown.cured.iter().map(|(_, cured)| &cured[..]).collect(),
            part: shown.part.as_deref(),
        }
    }

    /// Draws the pictures.
    ///
    /// # Errors
    /// Returns the errors of `out`.
    pub fn write_png(&self, scale: PictureScale, out: impl Write) -> io::Result<()> {
        let scene = self.scene();
        let size = [scene.whole_width(scale), scene.size(scale)[1]].map(|side| side as u32);
        write_rgb_png(out, size[0], size[1], scene.rows(scale))
    }

    /// Checks that a picture can be looked at.
    ///
    /// # Errors
    /// Returns an error if it would be too large.
    pub fn check_size(&self, scale: PictureScale) -> Result<(), PlotError> {
        let size = self.scene().size(scale);
        let is_large = size.iter().any(|&side| side as f64 > MAX_PICTURE_SIDE);
        if is_large { Err(PlotError::TooLarge(size)) } else { Ok(()) }
    }
}
