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
//! columns with the next swath, so that no seam shows: there the dose of one falls as that of the
//! other rises, and their sum is the layer's.

mod index;
mod join_swaths;
mod read;
mod strips_error;
#[cfg(test)]
mod strips_tests;
mod write;

use std::ops::Range;

use lamp_stack::{Frame, GrayMask, Image, Layer, gray_runs};
use serde_json::json;
use thiserror::Error;

use crate::edit::{ImageBounds, frame_page};

use index::INDEX;

pub use index::IndexError;
pub use join_swaths::JoinSwathsError;
pub use read::{StripDifference, is_strips, join_strips};
pub use strips_error::StripsError;
pub use write::StripWriter;

/// The swaths that build layers are cut into, from the left.
///
/// ```
/// use lamp_postprocess::Swaths;
/// use lamp_stack::{Image, Mask};
///
/// let swaths = Swaths::new(10, 4, 22)?;
/// assert_eq!((swaths.count(), swaths.columns(1)), (3, 6..16));
///
/// let layer = Image::Mask(Mask::black(22, 5).inverted());
/// let cut: Vec<Image> = (0..3).map(|swath| swaths.cut(&layer, swath)).collect();
/// assert_eq!(swaths.join(&cut)?, layer.to_gray().into_owned());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Swaths {
    mirrors: u32,
    overlap: u32,
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
    /// next, of layers of `width` columns.
    ///
    /// # Errors
    /// Returns an error if they share half of their columns or more.
    pub fn new(mirrors: u32, overlap: u32, width: u32) -> Result<Self, SwathsError> {
        if u64::from(overlap) * 2 < u64::from(mirrors) {
            Ok(Self { mirrors, overlap, width })
        } else {
            Err(SwathsError::Overlap { mirrors, overlap })
        }
    }

    /// Returns the number of swaths: at least one.
    pub fn count(&self) -> u32 {
        1 + self.width.saturating_sub(self.mirrors).div_ceil(self.step())
    }

    /// Returns the columns of a layer that a swath exposes. The last may have mirrors beyond them,
    /// which stay black.
    pub fn columns(&self, swath: u32) -> Range<u32> {
        let start = u64::from(swath) * u64::from(self.step());
        let within = |column: u64| column.min(self.width.into()) as u32;
        within(start)..within(start + u64::from(self.mirrors))
    }

    /// Returns the distance from the first column of a swath to that of the next.
    fn step(&self) -> u32 {
        self.mirrors - self.overlap
    }

    /// Returns the image of a swath, as wide as there are mirrors. In shared columns the levels of
    /// the two swaths add up to the layer's exactly.
    ///
    /// # Panics
    /// Panics if the image is not as wide as the layers, or there is no such swath.
    pub fn cut(&self, image: &Image, swath: u32) -> Image {
        assert_eq!(image.width(), self.width);
        assert!(swath < self.count());
        let columns = self.columns(swath);
        let (left, height) = (i64::from(columns.start), image.height());
        let cut = image.framed(Frame { left, top: 0, width: self.mirrors, height });
        match cut {
            Image::Mask(mask) if self.overlap == 0 || self.count() == 1 => Image::Mask(mask),
            Image::Mask(mask) => Image::Gray(self.ramped(&GrayMask::from(&mask), swath)),
            Image::Gray(gray) => Image::Gray(self.ramped(&gray, swath)),
        }
    }

    /// Returns a layer's swath. Its page says under `strip` its number, the number of swaths, the
    /// columns of the build that it exposes, and the bits of the build's pixels.
    ///
    /// # Panics
    /// Panics if [`cut`](Self::cut) does.
    pub fn cut_layer(&self, layer: &Layer, swath: u32) -> Layer {
        let image = match *layer.image {
            // One swath is the layer itself: nothing is to be encoded again.
            Image::Mask(_) if self.mirrors == self.width => layer.image.clone(),
            _ => self.cut(&layer.image, swath).into(),
        };
        let Range { start, end } = self.columns(swath);
        let mut info = layer.info.clone();
        // The first swath's image lies where the build's does.
        if start > 0 {
            let height = layer.image.height();
            let frame = Frame { left: start.into(), top: 0, width: self.mirrors, height };
            frame_page(&mut info, frame, &ImageBounds::of(layer).framed(frame));
        }
        let bits = if matches!(*layer.image, Image::Mask(_)) { 1 } else { 8 };
        let strip =
            json!({ "number": swath, "of": self.count(), "columns": [start, end], "bits": bits });
        info.other.insert("strip".to_owned(), strip);
        if let Some(stack) = &mut info.stack {
            stack.commands.push(self.command(swath));
        }
        Layer { info, dpi: layer.dpi, image }
    }

    /// Returns the command that a swath's first page records.
    fn command(&self, swath: u32) -> String {
        let Self { mirrors, overlap, .. } = self;
        format!("strip {swath} --mirrors {mirrors} --overlap {overlap}")
    }

    /// Returns what a swath exposes of an image of its columns.
    fn ramped(&self, image: &GrayMask, swath: u32) -> GrayMask {
        let overlap = self.overlap;
        let rises = if swath == 0 { 0 } else { overlap };
        let falls = if swath + 1 == self.count() { self.mirrors } else { self.mirrors - overlap };
        let mut out = GrayMask::new(self.mirrors);
        let mut runs = Vec::new();
        for changes in image.rows() {
            runs.clear();
            let mut last = 0;
            for (start, end, level) in gray_runs(changes, self.mirrors) {
                runs.push((start - last, 0));
                runs.extend((start..end.min(rises)).map(|c| (1, second_share(level, c, overlap))));
                let plain = start.max(rises)..end.min(falls);
                runs.push((plain.len() as u32, level));
                let fall = |c| (1, level - second_share(level, c - falls, overlap));
                runs.extend((start.max(falls)..end).map(fall));
                last = end;
            }
            out.push_runs(runs.iter().copied()).expect("runs as wide as the swath");
        }
        out
    }
}

/// Returns what the second of two swaths exposes of a level in a shared column, counted from the
/// first shared one: it rises in equal steps. The first swath exposes the rest.
fn second_share(level: u8, column: u32, overlap: u32) -> u8 {
    let (steps, all) = (u64::from(column) + 1, u64::from(overlap) + 1);
    // Rounded to the nearest level.
    ((2 * u64::from(level) * steps + all) / (2 * all)) as u8
}
