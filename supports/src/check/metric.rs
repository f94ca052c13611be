//! Lengths within layers whose pixels may be higher or lower than wide.

use lamp_stack::Pitch;

/// The shape of pixels, by which lengths within a layer are measured in widths of a pixel. Of square
/// pixels these are pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Metric {
    /// The height of a pixel in widths.
    height: f64,
}

impl Metric {
    /// Returns the metric of a pitch; pixels without one count as square.
    pub(crate) fn of(pitch: Option<Pitch>) -> Self {
        Self { height: pitch.map_or(1.0, Pitch::aspect) }
    }

    /// Returns the square of the distance of two pixels, given their columns and rows between.
    #[inline]
    pub(crate) fn squared(self, columns: u32, rows: u32) -> f64 {
        self.place([columns, rows].map(f64::from)).map(|side| side * side).iter().sum()
    }

    /// Returns a column and a row in widths.
    #[inline]
    pub(crate) fn place(self, [column, row]: [f64; 2]) -> [f64; 2] {
        [column, row * self.height]
    }

    /// Returns a length in columns and in rows.
    pub(crate) fn pixels(self, length: f64) -> [f64; 2] {
        [length, length / self.height]
    }

    /// Returns the longer side of a pixel.
    pub(crate) fn longer_side(self) -> f64 {
        self.height.max(1.0)
    }

    /// Returns the shorter side of a pixel.
    pub(crate) fn shorter_side(self) -> f64 {
        self.height.min(1.0)
    }

    /// Returns the area of a pixel.
    pub(crate) fn pixel_area(self) -> f64 {
        self.height
    }
}
