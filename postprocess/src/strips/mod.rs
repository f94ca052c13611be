//! Build layers cut into the swaths that a scanning projector exposes.
//!
//! ```text
//!   columns of the build   0        W-v   W      2(W-v)
//!   swath 0                ##########\\\\\\
//!   swath 1                         //////####\\\\\\
//!   swath 2                                   //////##########
//! ```
//!
//! A swath is as many columns wide as the projector has mirrors across its way,
//! and shares some with the next, so that a seam shows no edge. There the one's
//! dose falls as the other's rises, and both are the layer's.

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

pub use join_swaths::JoinSwathsError;
pub use read::{is_strips, join_strips};
pub use strips_error::StripsError;
pub use write::StripWriter;

/// How build layers are cut into swaths, from the left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Swaths {
    mirrors: u32,
    overlap: u32,
    width: u32,
}

/// Why a layer cannot be cut into swaths.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SwathsError {
    /// A column would be in three swaths, or none.
    #[error(
        "swaths of {mirrors} mirrors cannot share {overlap} of them: they share less than half"
    )]
    Overlap {
        /// How wide a swath is.
        mirrors: u32,
        /// What it shares with the next.
        overlap: u32,
    },
}

impl Swaths {
    /// Swaths of so many mirrors, of which each shares `overlap` with the next,
    /// for layers of `width` columns.
    ///
    /// # Errors
    /// Where they would share half or more.
    pub fn new(mirrors: u32, overlap: u32, width: u32) -> Result<Self, SwathsError> {
        if u64::from(overlap) * 2 < u64::from(mirrors) {
            Ok(Self { mirrors, overlap, width })
        } else {
            Err(SwathsError::Overlap { mirrors, overlap })
        }
    }

    /// How many swaths there are: at least one.
    pub fn count(&self) -> u32 {
        1 + self.width.saturating_sub(self.mirrors).div_ceil(self.step())
    }

    /// The columns of a layer that a swath exposes. The last may have mirrors
    /// beyond them, which stay black.
    pub fn columns(&self, swath: u32) -> Range<u32> {
        let start = u64::from(swath) * u64::from(self.step());
        let within = |column: u64| column.min(self.width.into()) as u32;
        within(start)..within(start + u64::from(self.mirrors))
    }

    /// How far the first column of a swath is from that of the next.
    fn step(&self) -> u32 {
        self.mirrors - self.overlap
    }

    /// The image of a swath: as wide as there are mirrors. Where it shares columns
    /// its levels are parts of the layer's, which add up to them exactly.
    ///
    /// # Panics
    /// If the image is not as wide as the layers, or there is no such swath.
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

    /// A layer's swath, with a page that says where it lies: `strip` has its
    /// number, how many there are, the columns of the build that it exposes, and how
    /// many bits the build's pixels have.
    ///
    /// # Panics
    /// As [`cut`](Self::cut) does.
    pub fn cut_layer(&self, layer: &Layer, swath: u32) -> Layer {
        let image = match *layer.image {
            // One swath is the layer itself: nothing is to be encoded again.
            Image::Mask(_) if self.mirrors == self.width => layer.image.clone(),
            _ => self.cut(&layer.image, swath).into(),
        };
        let Range { start, end } = self.columns(swath);
        let mut info = layer.info.clone();
        // The first lies where the build does.
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

    /// What a swath's first page says of how it was made.
    fn command(&self, swath: u32) -> String {
        let Self { mirrors, overlap, .. } = self;
        format!("strip {swath} --mirrors {mirrors} --overlap {overlap}")
    }

    /// What a swath exposes of what lies there.
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

/// What the second of two swaths exposes of a level in a column that they share,
/// counted from the first such: it rises in equal steps. The first exposes the
/// rest.
fn second_share(level: u8, column: u32, overlap: u32) -> u8 {
    let (steps, all) = (u64::from(column) + 1, u64::from(overlap) + 1);
    // Rounded to the nearest level.
    ((2 * u64::from(level) * steps + all) / (2 * all)) as u8
}
