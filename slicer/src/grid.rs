//! Defines the grid of a layer's pixels in part coordinates.

use lamp_stack::{Dpi, Pitch};

use crate::error::SliceError;

/// The greatest width and height of a layer in pixels. It is below the limit for other images,
/// because all rows of a slab take memory, including rows without crossings.
pub(crate) const MAX_SIDE: u32 = lamp_stack::MAX_SIDE / 4;

/// The pixels of a layer in part coordinates.
///
/// ```text
///   (x0, y1) +---+---+---+--> column, x
///            | . | . | . |
///            +---+---+---+        the centre of pixel (c, r) is
///            | . | . | . |        x0 + (c + 1/2) px, y1 - (r + 1/2) py
///            +---+---+---+        with the pitch px, py = 25.4 mm / dpi
///            v  row, -y
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelGrid {
    /// The top left corner (x0, y1) in part coordinates, in millimeters.
    pub origin_mm: [f64; 2],
    /// The distances between the centers of pixels along x and y.
    pub pitch: Pitch,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl PixelGrid {
    /// Creates the grid around a box (x, y), with `margin` pixels on every side. On the
    /// right its width is rounded up to a multiple of 32, and at least one column stays
    /// black, since a row that ends white is a stray row. The origin is moved outward
    /// to a whole nanometer, so that six decimals state it exactly.
    ///
    /// ```
    /// use lamp_slicing::PixelGrid;
    /// use lamp_stack::Pitch;
    ///
    /// let dpi = Pitch::of_dpi(254.0).unwrap(); // 0.1 mm pixels
    /// let grid = PixelGrid::around([0.0, 0.0], [3.0, 1.0], 1, dpi)?;
    /// assert_eq!((grid.width, grid.height), (32, 12));
    /// assert_eq!(grid.origin_mm, [-0.1, 1.1]);
    /// # Ok::<(), lamp_slicing::SliceError>(())
    /// ```
    ///
    /// # Errors
    /// Returns an error if a side would exceed 2^24 pixels.
    ///
    /// Source: 002 section 2.2.2 (equations 1 and 2; width in 32 bits).
    pub fn around(
        min_mm: [f64; 2],
        max_mm: [f64; 2],
        margin: u32,
        pitch: Pitch,
    ) -> Result<Self, SliceError> {
        let margin_mm = pitch.mm().map(|mm| f64::from(margin) * mm);
        let x0 = ((min_mm[0] - margin_mm[0]) * 1e6).floor() / 1e6;
        let y1 = ((max_mm[1] + margin_mm[1]) * 1e6).ceil() / 1e6;
        let columns = to_pixels(pitch.x, max_mm[0] - x0).ceil() + f64::from(margin.max(1));
        let width = (columns / 32.0).ceil() * 32.0;
        let height = (to_pixels(pitch.y, y1 - min_mm[1]).ceil() + f64::from(margin)).max(1.0);
        Self::at([x0, y1], width, height, pitch)
    }

    /// Creates the grid whose top left corner is at `origin_mm`.
    ///
    /// # Errors
    /// Returns an error if a side is not between 1 and 2^24 pixels.
    pub fn at(
        origin_mm: [f64; 2],
        width: f64,
        height: f64,
        pitch: Pitch,
    ) -> Result<Self, SliceError> {
        // No range contains `NaN`.
        let allowed = 1.0..=f64::from(MAX_SIDE);
        if !allowed.contains(&width) || !allowed.contains(&height) {
            return Err(SliceError::TooLarge { width, height });
        }
        Ok(Self { origin_mm, pitch, width: width as u32, height: height as u32 })
    }

    /// Returns true if a box is inside the grid and leaves the grid's last column black.
    pub(crate) fn holds(&self, min_mm: [f64; 2], max_mm: [f64; 2]) -> bool {
        // In pixels, the grid's edges lie half a pixel outside its centers.
        let [left, bottom] = self.to_pixels(min_mm[0], min_mm[1]);
        let [right, top] = self.to_pixels(max_mm[0], max_mm[1]);
        left >= -0.5
            && top >= -0.5
            && right <= f64::from(self.width - 1)
            && bottom <= f64::from(self.height) - 0.5
    }

    /// Returns true if all of the last column is right of a point.
    pub(crate) fn leaves_last_column(&self, max_mm: [f64; 2]) -> bool {
        self.to_pixels(max_mm[0], max_mm[1])[0] + 0.5 <= f64::from(self.width - 1)
    }

    /// Returns a point in pixels: its column is at most c exactly if it is left of or on the center
    /// of column c, and its row is at most r exactly if it is above or on the center of row r.
    ///
    /// A point on a center gives whole numbers, because the only division is by a whole number.
    #[inline]
    pub fn to_pixels(&self, x_mm: f64, y_mm: f64) -> [f64; 2] {
        [
            to_pixels(self.pitch.x, x_mm - self.origin_mm[0]) - 0.5,
            to_pixels(self.pitch.y, self.origin_mm[1] - y_mm) - 0.5,
        ]
    }

    /// Returns a point in millimeters, given in pixels: the inverse of
    /// [`to_pixels`](Self::to_pixels).
    pub fn to_mm(&self, column: f64, row: f64) -> [f64; 2] {
        let to_mm = |axis: Dpi, pixels: f64| {
            let [pixels_of, mm] = axis.pixels_in_mm();
            pixels * mm / pixels_of
        };
        [
            self.origin_mm[0] + to_mm(self.pitch.x, column + 0.5),
            self.origin_mm[1] - to_mm(self.pitch.y, row + 0.5),
        ]
    }
}

#[inline]
fn to_pixels(axis: Dpi, mm: f64) -> f64 {
    let [pixels, of_mm] = axis.pixels_in_mm();
    mm * pixels / of_mm
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_is_the_box_and_its_margin() {
        let dpi = Pitch::of_dpi(1500.0).unwrap();
        let grid = PixelGrid::around([-1.0, 0.0], [75.0, 77.2], 1, dpi).unwrap();
        assert_eq!(grid.origin_mm, [-1.016934, 77.216934]);
        // 76 mm are 4488.2 pixels and 77.2 mm 4559.1; then the margins.
        assert_eq!((grid.width, grid.height), (4512, 4562));
        let none = PixelGrid::around([0.0, 0.0], [25.4, 25.4], 0, dpi).unwrap();
        assert_eq!((none.origin_mm, none.width, none.height), ([0.0, 25.4], 1504, 1500));
    }

    #[test]
    fn centres_are_whole_numbers() {
        // 203.2 dpi is a pitch of 1/8 mm, which floating point represents exactly.
        let grid = PixelGrid::at([-3.0, 5.0], 64.0, 64.0, Pitch::of_dpi(203.2).unwrap()).unwrap();
        for c in 0..64u32 {
            let centre = (f64::from(c) + 0.5) * 0.125;
            assert_eq!(grid.to_pixels(-3.0 + centre, 5.0 - centre), [f64::from(c); 2]);
            let [column, row] = [f64::from(c), f64::from(63 - c)];
            assert_eq!(grid.to_mm(column, row), [-3.0 + centre, centre - 3.0]);
        }
    }

    #[test]
    fn too_many_pixels_are_refused() {
        let dpi = Pitch::of_dpi(1500.0).unwrap();
        assert!(PixelGrid::around([0.0, 0.0], [1e6, 1.0], 1, dpi).is_err());
        assert!(PixelGrid::at([0.0, 0.0], f64::NAN, 1.0, dpi).is_err());
    }
}
