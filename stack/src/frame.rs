//! Images cropped and padded, on runs.

use crate::gray::{GrayMask, LevelChange};
use crate::layer::Image;
use crate::mask::{Mask, MaskBuilder};

/// A part of an image's plane, which may reach beyond the image: what is
/// outside is black.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// The image's column that becomes the first.
    pub left: i64,
    /// The image's row that becomes the top one.
    pub top: i64,
    /// How many columns there are.
    pub width: u32,
    /// How many rows there are.
    pub height: u32,
}

impl Frame {
    /// The rows of an image of `height` that the frame shows, after how many
    /// black ones, and before how many.
    fn rows(&self, height: u32) -> (u32, std::ops::Range<u32>, u32) {
        let within = |row: i64| row.clamp(0, height.into()) as u32;
        let shown = within(self.top)..within(self.top.saturating_add(self.height.into()));
        let above = self.top.saturating_neg().clamp(0, self.height.into()) as u32;
        let above = if shown.is_empty() { self.height } else { above };
        let below = self.height - above - shown.len() as u32;
        (above, shown, below)
    }

    /// Whether it shows all of an image, and no more.
    fn is_whole(&self, width: u32, height: u32) -> bool {
        *self == Self { left: 0, top: 0, width, height }
    }
}

/// Adds to `out`, a row's transitions in an image of `into` columns, those of a
/// row of `width` columns whose first stands at `left` there; what lies outside
/// is cut off. The last transition in `out` must not be past `left`: one that
/// stands there goes, if the row begins white, and white goes on.
pub fn place_row(transitions: &[u32], width: u32, left: i64, into: u32, out: &mut Vec<u32>) {
    let (start, end) = (left.clamp(0, into.into()), left.saturating_add(width.into()));
    let hidden = transitions.partition_point(|&column| left.saturating_add(column.into()) <= start);
    let (hidden, shown) = transitions.split_at(hidden);
    if hidden.len() % 2 == 1 && start < end {
        toggle(start, into, out);
    }
    let last = shown.partition_point(|&column| left.saturating_add(column.into()) < into.into());
    out.extend(shown[..last].iter().map(|&column| (left + i64::from(column)) as u32));
    if transitions.len() % 2 == 1 && end > start {
        toggle(end, into, out);
    }
}

/// Changes a row's colour from a column on, which is past its others or the last.
fn toggle(column: i64, width: u32, row: &mut Vec<u32>) {
    if column >= width.into() {
        return;
    }
    let column = column as u32;
    if row.pop_if(|last| *last == column).is_none() {
        row.push(column);
    }
}

impl Mask {
    /// What a frame shows of the image: crops and pads it.
    pub fn framed(&self, frame: Frame) -> Self {
        if frame.is_whole(self.width(), self.height()) {
            return self.clone();
        }
        let (above, shown, below) = frame.rows(self.height());
        let mut mask = MaskBuilder::new(frame.width);
        mask.push_black(above);
        let mut row = Vec::new();
        for index in shown {
            row.clear();
            place_row(
                self.row(index),
                self.width(),
                frame.left.saturating_neg(),
                frame.width,
                &mut row,
            );
            mask.push_checked(&row);
        }
        mask.push_black(below);
        mask.finish()
    }
}

impl GrayMask {
    /// What a frame shows of the image: crops and pads it.
    pub fn framed(&self, frame: Frame) -> Self {
        if frame.is_whole(self.width(), self.height()) {
            return self.clone();
        }
        let (above, shown, below) = frame.rows(self.height());
        let mut gray = Self::new(frame.width);
        let blank = |gray: &mut Self, rows| {
            (0..rows).for_each(|_| gray.push_row(&[]).expect("a black row fits"));
        };
        blank(&mut gray, above);
        for index in shown {
            let row = framed_levels(self.row(index), self.width(), frame);
            gray.push_row(&row).expect("changes within the frame");
        }
        blank(&mut gray, below);
        gray
    }
}

/// What a frame shows of a gray row of `width` columns.
fn framed_levels(changes: &[LevelChange], width: u32, frame: Frame) -> Vec<LevelChange> {
    let end = LevelChange { column: width, level: 0 };
    let mut row: Vec<LevelChange> = Vec::new();
    for change in changes.iter().chain([&end]) {
        let column = i64::from(change.column).saturating_sub(frame.left).max(0);
        if column >= frame.width.into() {
            break;
        }
        let column = column as u32;
        row.pop_if(|last| last.column == column);
        if row.last().map_or(0, |last| last.level) != change.level {
            row.push(LevelChange { column, level: change.level });
        }
    }
    row
}

impl Image {
    /// What a frame shows of the image: crops and pads it.
    pub fn framed(&self, frame: Frame) -> Self {
        match self {
            Self::Mask(mask) => Self::Mask(mask.framed(frame)),
            Self::Gray(gray) => Self::Gray(gray.framed(frame)),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{arbitrary_gray, arbitrary_mask, level};

    fn arbitrary_frame() -> impl Strategy<Value = Frame> {
        (-40i64..90, -20i64..30, 0u32..120, 0u32..40).prop_map(|(left, top, width, height)| Frame {
            left,
            top,
            width,
            height,
        })
    }

    fn check(image: &Image, frame: Frame) {
        let framed = image.framed(frame);
        assert_eq!((framed.width(), framed.height()), (frame.width, frame.height));
        for (row, y) in (0..frame.height).zip(frame.top..) {
            for (column, x) in (0..frame.width).zip(frame.left..) {
                let outside =
                    x < 0 || x >= image.width().into() || y < 0 || y >= image.height().into();
                let expected = if outside { 0 } else { level(image, x as u32, y as u32) };
                assert_eq!(level(&framed, column, row), expected, "{frame:?} {column} {row}");
            }
        }
    }

    proptest! {
        #[test]
        fn every_pixel_is_the_image_s_or_black(
            mask in arbitrary_mask(), gray in arbitrary_gray(), frame in arbitrary_frame(),
        ) {
            check(&Image::Mask(mask), frame);
            check(&Image::Gray(gray), frame);
        }

        #[test]
        fn padding_is_undone_by_cropping(mask in arbitrary_mask(), gray in arbitrary_gray()) {
            for image in [Image::Mask(mask), Image::Gray(gray)] {
                let (width, height) = (image.width(), image.height());
                let wide = image.framed(Frame { left: -3, top: -2, width: width + 5, height: height + 9 });
                prop_assert_eq!(wide.framed(Frame { left: 3, top: 2, width, height }), image);
            }
        }

        #[test]
        fn rows_side_by_side_are_one_row(
            a in prop::collection::btree_set(0u32..16, 0..9),
            b in prop::collection::btree_set(0u32..16, 0..9),
            (gap, into) in (0i64..3, 20u32..40),
        ) {
            let [a, b] = [a, b].map(|row| row.into_iter().collect::<Vec<_>>());
            let mut row = Vec::new();
            place_row(&a, 16, 0, into, &mut row);
            place_row(&b, 16, 16 + gap, into, &mut row);
            prop_assert!(row.is_sorted_by(|a, b| a < b) && row.last() < Some(&into));
            let white = |row: &[u32], column: i64| row.iter().filter(|&&t| i64::from(t) <= column).count() % 2 == 1;
            for column in 0..into.into() {
                let second = column - 16 - gap;
                let expected = (column < 16 && white(&a, column))
                    || ((0..16).contains(&second) && white(&b, second));
                prop_assert_eq!(white(&row, column), expected);
            }
        }
    }

    #[test]
    fn frames_far_away_are_black() {
        let mask = Mask::new(8, vec![0, 1], vec![2]).unwrap();
        for far in [i64::MIN, i64::MIN + 9, -9, 9, i64::MAX] {
            for (left, top) in [(far, 0), (0, far), (far, far)] {
                let framed = mask.framed(Frame { left, top, width: 8, height: 3 });
                assert_eq!(framed, Mask::black(8, 3), "{left} {top}");
            }
        }
    }
}
