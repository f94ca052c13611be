//! Build layers cut into the swaths that a scanning projector exposes.
//!
//! ```text
//!   columns of the build   0        W-v   W      2(W-v)
//!   swath 0                ##########\\\\\\
//!   swath 1                         //////####\\\\\\
//!   swath 2                                   //////##########
//! ```
//!
//! A swath is as wide as the projector has mirrors across its path, in columns. It shares some
//! columns with the next swath, so that no seam shows: there the dose of one falls as the dose of
//! the other rises, and their sum is the layer's dose. [`Seam`] gives the amounts.

mod cut;
mod form;
mod index;
mod join_swaths;
mod ramps;
mod read;
mod seam;
mod strips_error;
#[cfg(test)]
mod strips_tests;
mod write;

use std::ops::Range;

use lamp_stack::{Frame, Image, Layer, LayerImage, PageInfo, StripRecord};
use thiserror::Error;

use crate::image_bounds::ImageBounds;
use crate::page_frame::frame_page;

use index::INDEX;

/// The first word of the command that a strip's first page records.
const COMMAND: &str = "strip";

pub use form::{StripFile, StripForm, strip_files};
pub use index::IndexError;
pub use join_swaths::JoinSwathsError;
pub use read::{StripDifference, check_number, is_strips, join_strips};
pub use seam::Seam;
pub use strips_error::StripsError;
pub use write::StripWriter;

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
    mirrors: u32,
    overlap: u32,
    seam: Seam,
    width: u32,
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
    fn step(&self) -> u32 {
        self.mirrors - self.overlap
    }

    /// Returns some of a layer's swaths. Their pages say under `strip` the swath's number, the
    /// number of swaths, the columns of the build that it exposes, and the bits of the build's
    /// pixels.
    ///
    /// # Panics
    /// Panics if [`cut`](Self::cut) does.
    pub fn cut_layer<'a>(
        &self,
        layer: &'a Layer,
        swaths: Range<u32>,
    ) -> impl Iterator<Item = Layer> + use<'a> {
        let this = *self;
        let images: Box<dyn Iterator<Item = LayerImage> + 'a> = match *layer.image {
            // One swath is the layer itself: nothing is to be encoded again.
            Image::Mask(_) if self.mirrors == self.width => {
                Box::new(std::iter::once(layer.image.clone()))
            }
            _ => {
                let cut = self.cut(&layer.image, layer.info.index, swaths.clone());
                Box::new(cut.map(LayerImage::from))
            }
        };
        let page =
            move |(image, swath)| Layer { info: this.page(layer, swath), dpi: layer.dpi, image };
        images.zip(swaths).map(page)
    }

    /// Returns the page of a layer's swath.
    fn page(&self, layer: &Layer, swath: u32) -> PageInfo {
        let Range { start, end } = self.columns(swath);
        let mut info = layer.info.clone();
        // The first swath's image lies where the build's does.
        if start > 0 {
            let height = layer.image.height();
            let frame = Frame { left: start.into(), top: 0, width: self.mirrors, height };
            let bounds = ImageBounds::of(&info, layer.dpi, [layer.image.width(), height]);
            frame_page(&mut info, frame, &bounds.framed(frame));
        }
        let bits = if matches!(*layer.image, Image::Mask(_)) { 1 } else { 8 };
        let columns = [start, end];
        info.set_record(&StripRecord { number: swath, of: self.count(), columns, bits });
        if let Some(stack) = &mut info.stack {
            stack.commands.push(self.command(swath));
        }
        info
    }

    /// Returns the command that a swath's first page records.
    fn command(&self, swath: u32) -> String {
        let Self { mirrors, overlap, seam, .. } = self;
        let command = format!("{COMMAND} {swath} --mirrors {mirrors} --overlap {overlap}");
        // Swaths that share nothing have no seam.
        if *overlap > 0 { format!("{command} --seam {seam}") } else { command }
    }
}
