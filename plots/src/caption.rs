//! Writes captions as gray levels.

use plotters::prelude::*;

use crate::{FAMILY, PlotError, with_font};

/// The height of a caption in pixels.
pub const CAPTION_HEIGHT: u32 = 24;
const FONT_HEIGHT: u32 = 18;

/// Returns the rows of a text in white on a background level, as wide as the text needs.
///
/// # Errors
/// Returns an error if the text cannot be drawn.
pub fn caption(text: &str, background: u8) -> Result<Vec<Vec<u8>>, PlotError> {
    with_font();
    let style = (FAMILY, FONT_HEIGHT).into_font().color(&WHITE);
    let ((left, top), (right, bottom)) =
        style.font.layout_box(text).map_err(|error| PlotError::Drawing(error.to_string()))?;
    let (width, height) = ((right - left) as u32 + 1, (bottom - top) as u32);
    let mut pixels = vec![background; 3 * (width * CAPTION_HEIGHT) as usize];
    let area = BitMapBackend::with_buffer(&mut pixels, (width, CAPTION_HEIGHT)).into_drawing_area();
    let down = CAPTION_HEIGHT.saturating_sub(height) / 2;
    // Letters may begin left of their origin, or above the line.
    area.draw_text(text, &style, (-left, down as i32 - top))
        .map_err(|error| PlotError::Drawing(error.to_string()))?;
    drop(area);
    // White on gray: red, green and blue are equal.
    let levels: Vec<u8> = pixels.chunks(3).map(|pixel| pixel[0]).collect();
    Ok(levels.chunks(width as usize).map(<[u8]>::to_vec).collect())
}
