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

mod join;

use std::ops::Range;

use lamp_stack::{Frame, GrayMask, Image, Layer, gray_runs};
use serde_json::json;
use thiserror::Error;

use crate::edit::{Place, frame_page};

pub use join::JoinSwathsError;

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
    /// number, how many there are, and the columns of the build that it exposes.
    ///
    /// # Panics
    /// As [`cut`](Self::cut) does.
    pub fn cut_layer(&self, layer: &Layer, swath: u32) -> Layer {
        let image = self.cut(&layer.image, swath);
        let Range { start, end } = self.columns(swath);
        let frame =
            Frame { left: start.into(), top: 0, width: self.mirrors, height: layer.image.height() };
        let mut info = layer.info.clone();
        frame_page(&mut info, frame, &Place::of(layer).framed(frame));
        let strip = json!({ "number": swath, "of": self.count(), "columns": [start, end] });
        info.other.insert("strip".to_owned(), strip);
        Layer { info, dpi: layer.dpi, image }
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

#[cfg(test)]
mod tests {
    use lamp_stack::{Dpi, Mask, PageInfo};
    use proptest::prelude::*;

    use super::*;

    fn image(width: u32, rows: &[Vec<(u32, u8)>], levels: bool) -> Image {
        let mut gray = GrayMask::new(width);
        for row in rows {
            let mut room = width;
            let runs = row.iter().map(|&(length, level)| {
                let part = length.min(room);
                room -= part;
                (part, if levels { level } else { 255 * (level & 1) })
            });
            gray.push_runs(runs).unwrap();
        }
        if levels {
            return Image::Gray(gray);
        }
        let transitions =
            |row: &[lamp_stack::LevelChange]| row.iter().map(|c| c.column).collect::<Vec<_>>();
        let mut mask = lamp_stack::MaskBuilder::new(width);
        gray.rows().for_each(|row| mask.push_row(&transitions(row)).unwrap());
        Image::Mask(mask.finish())
    }

    fn level(image: &Image, column: u32, row: u32) -> u8 {
        let gray = join::gray(image);
        let runs = gray_runs(gray.row(row), gray.width());
        runs.into_iter().find(|run| (run.0..run.1).contains(&column)).map_or(0, |run| run.2)
    }

    proptest! {
        #[test]
        fn swaths_add_up_to_the_layer(
            (mirrors, shared, width) in (1u32..40, 0u32..20, 1u32..120),
            rows in prop::collection::vec(prop::collection::vec((0u32..30, any::<u8>()), 0..9), 1..5),
            levels in any::<bool>(),
        ) {
            let overlap = shared.min((mirrors - 1) / 2);
            let swaths = Swaths::new(mirrors, overlap, width).unwrap();
            let layer = image(width, &rows, levels);
            let cut: Vec<Image> = (0..swaths.count()).map(|k| swaths.cut(&layer, k)).collect();
            prop_assert!(cut.iter().all(|swath| swath.width() == mirrors));
            for row in 0..layer.height() {
                for column in 0..width {
                    let mut sum = 0;
                    let mut of = 0;
                    for (k, swath) in (0..).zip(&cut) {
                        if swaths.columns(k).contains(&column) {
                            of += 1;
                            sum += u32::from(level(swath, column - swaths.columns(k).start, row));
                        }
                    }
                    prop_assert!((1..=2).contains(&of));
                    prop_assert_eq!(sum, u32::from(level(&layer, column, row)), "{} {}", column, row);
                }
            }
            prop_assert_eq!(swaths.join(&cut), Ok(join::gray(&layer)));
        }
    }

    #[test]
    fn ramps_rise_in_equal_steps_and_fall_alike() {
        let swaths = Swaths::new(10, 4, 22).unwrap();
        assert_eq!((swaths.count(), swaths.columns(1), swaths.columns(2)), (3, 6..16, 12..22));
        let white = Image::Mask(Mask::black(22, 1).inverted());
        let levels = |k| {
            let cut = swaths.cut(&white, k);
            (0..10).map(|column| level(&cut, column, 0)).collect::<Vec<_>>()
        };
        assert_eq!(levels(0), [255, 255, 255, 255, 255, 255, 204, 153, 102, 51]);
        assert_eq!(levels(1), [51, 102, 153, 204, 255, 255, 204, 153, 102, 51]);
        assert_eq!(levels(2), [51, 102, 153, 204, 255, 255, 255, 255, 255, 255]);
    }

    #[test]
    fn a_column_is_in_one_swath_or_two() {
        assert!(Swaths::new(10, 5, 22).is_err() && Swaths::new(0, 0, 22).is_err());
        assert!(Swaths::new(u32::MAX, u32::MAX, 1).is_err());
        let one = Swaths::new(30, 9, 22).unwrap();
        assert_eq!((one.count(), one.columns(0)), (1, 0..22));
    }

    #[test]
    fn a_page_says_where_its_swath_lies() {
        let info =
            PageInfo { origin_mm: Some([1.0, 5.0]), stray_rows: vec![0], ..PageInfo::default() };
        let image = Image::Mask(Mask::black(22, 1));
        let layer = Layer { info, dpi: Dpi::new(25.4), image };
        let swath = Swaths::new(10, 4, 22).unwrap().cut_layer(&layer, 2);
        assert_eq!(swath.info.origin_mm, Some([13.0, 5.0]));
        assert_eq!(swath.info.stray_rows, [0]);
        assert_eq!(swath.info.other["strip"], json!({ "number": 2, "of": 3, "columns": [12, 22] }));
    }
}
