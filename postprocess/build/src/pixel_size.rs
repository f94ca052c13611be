//! Sizes of images.

use std::fmt;

use lamp_stack::Image;

/// A width and a height in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelSize {
    /// The number of columns.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
}

impl PixelSize {
    /// Returns the size of an image.
    pub fn of(image: &Image) -> Self {
        Self { width: image.width(), height: image.height() }
    }

    /// Returns the size with `by` pixels more on every side.
    pub(crate) fn grown(self, by: u32) -> Self {
        // Sides are at most 2^26 pixels, and so are reaches of moats: sums stay below 2^32.
        Self { width: self.width + 2 * by, height: self.height + 2 * by }
    }
}

impl fmt::Display for PixelSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} x {}", self.width, self.height)
    }
}
