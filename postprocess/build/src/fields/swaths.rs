//! The swaths that the columns, or the rows, of a layer are divided into.

use std::ops::Range;

use thiserror::Error;

use super::Seam;

/// The swaths that build layers are cut into, from the left.
///
/// ```
/// use lamp_build::Swaths;
/// use lamp_stack::{Image, Mask};
///
/// let swaths = Swaths::new(10, 4, 22)?;
/// assert_eq!((swaths.count(), swaths.columns(1)), (3, 6..16));
///
/// let layer = Image::Mask(Mask::black(22, 5).inverted());
/// let index = 0;
/// let cut: Vec<Image> = swaths.cut(&layer, index, 0..3).collect();
/// assert_eq!(swaths.join(&cut)?, layer.to_gray().into_owned());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Swaths {
    pub(super) mirrors: u32,
    pub(super) overlap: u32,
    pub(super) seam: Seam,
    pub(super) width: u32,
}

/// An error in cutting layers into swaths.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SwathsError {
    /// Swaths share half of their columns or more, so a column would be in three of them.
    #[error(
        "swaths of {mirrors} mirrors cannot share {overlap} of them: they share less than half"
    )]
    Overlap {
        /// The width of a swath in pixels.
        mirrors: u32,
        /// The columns that it shares with the next.
        overlap: u32,
    },
}

impl Swaths {
    /// Returns the swaths of `mirrors` columns, each of which shares `overlap` columns with the
    /// next by a [comb](Seam::Comb), of layers of `width` columns.
    ///
    /// # Errors
    /// Returns an error if they share half of their columns or more.
    pub fn new(mirrors: u32, overlap: u32, width: u32) -> Result<Self, SwathsError> {
        // In u64, as a command may ask for any u32.
        if u64::from(overlap) * 2 < u64::from(mirrors) {
            Ok(Self { mirrors, overlap, seam: Seam::default(), width })
        } else {
            Err(SwathsError::Overlap { mirrors, overlap })
        }
    }

    /// Returns the same swaths with another seam.
    #[must_use]
    pub fn with_seam(self, seam: Seam) -> Self {
        Self { seam, ..self }
    }

    /// Returns the number of swaths: at least one.
    pub fn count(&self) -> u32 {
        // The first swath covers its mirrors, each further one adds a step.
        1 + self.width.saturating_sub(self.mirrors).div_ceil(self.step())
    }

    /// Returns the columns of a layer that a swath exposes. The last may have mirrors beyond them,
    /// which stay black.
    pub fn columns(&self, swath: u32) -> Range<u32> {
        // The mirrors of the last swath may reach beyond the greatest u32.
        let start = u64::from(swath) * u64::from(self.step());
        let within = |column: u64| column.min(self.width.into()) as u32;
        within(start)..within(start + u64::from(self.mirrors))
    }

    /// Returns the distance from the first column of a swath to the first column of the next.
    pub(super) fn step(&self) -> u32 {
        self.mirrors - self.overlap
    }

    /// Returns whether levels are divided, so that masks become gray.
    pub(super) fn makes_gray(&self) -> bool {
        // Without shared columns no level is divided, and a mask stays a mask.
        self.seam == Seam::Gray && self.overlap > 0 && self.count() > 1
    }
}
