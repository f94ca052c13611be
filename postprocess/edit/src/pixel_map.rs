//! From the part's coordinates to pixels.

use lamp_build::ImageBounds;
use lamp_stack::{Dpi, Length, Pitch};

use super::edit_error::EditError;

/// Maps points in millimeters to pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelMap {
    origin_mm: [f64; 2],
    pitch: Pitch,
}

impl PixelMap {
    /// Returns the map from points of the part to an image's pixels.
    ///
    /// # Errors
    /// Returns an error if the resolution is not known.
    pub(super) fn of(image: &ImageBounds) -> Result<Self, EditError> {
        let pitch = image.pitch.ok_or(EditError::NoResolution)?;
        Ok(Self { origin_mm: image.origin_mm, pitch })
    }

    /// Returns a point in pixels. Pixel centers are whole numbers, as in slicing: columns
    /// from the first coordinate on have their centers at or right of the point, rows from
    /// the second on at or below it.
    pub(super) fn to_pixels(self, [x_mm, y_mm]: [f64; 2]) -> [f64; 2] {
        let pixels = |axis: Dpi, mm: f64| {
            let [pixels, of_mm] = axis.pixels_in_mm();
            mm * pixels / of_mm - 0.5
        };
        let [x0, y1] = self.origin_mm;
        [pixels(self.pitch.x, x_mm - x0), pixels(self.pitch.y, y1 - y_mm)]
    }

    /// Returns a length along x and along y in pixels.
    pub(super) fn length(self, length: Length) -> [f64; 2] {
        self.pitch.pixels(length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_on_a_centre_is_a_whole_number() {
        let grid = PixelMap { origin_mm: [1.0, 5.0], pitch: Pitch::of_dpi(25.4).unwrap() };
        assert_eq!(grid.to_pixels([3.5, 4.5]), [2.0, 0.0]);
    }
}
