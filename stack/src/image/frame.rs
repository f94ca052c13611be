//! Crops and pads images, on their runs.

use crate::image::Image;
use crate::image::runs::{Change, RunImage};

/// The rectangle that an image is cropped or padded to. Pixels beyond the image are black.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// The image's column that becomes the first.
    pub left: i64,
    /// The image's row that becomes the top one.
    pub top: i64,
    /// The width in pixels.
    pub width: u32,
    /// The height in pixels.
    pub height: u32,
}

impl Frame {
    /// Returns the number of black rows above an image of `height`, the image's rows inside the
    /// frame, and the number of black rows below.
    fn rows(&self, height: u32) -> (u32, std::ops::Range<u32>, u32) {
        let within = |row: i64| row.clamp(0, height.into()) as u32;
        // A frame may lie anywhere in 64 bits, so sums saturate.
        let shown = within(self.top)..within(self.top.saturating_add(self.height.into()));
        let above = self.top.saturating_neg().clamp(0, self.height.into()) as u32;
        // Without a row of the image, all rows are black, and counted once.
        let above = if shown.is_empty() { self.height } else { above };
        let below = self.height - above - shown.len() as u32;
        (above, shown, below)
    }

    /// Returns true if the frame equals an image of this size.
    pub fn is_whole(&self, width: u32, height: u32) -> bool {
        *self == Self { left: 0, top: 0, width, height }
    }
}

/// Appends a row of `width` columns to `out`, a row of `into` columns, at column `left`.
/// Pixels outside are cut off.
///
/// `out` must not change after `left`. A change at `left` is removed if both rows have the
/// same value there.
pub fn place_row<C: Change>(changes: &[C], width: u32, left: i64, into: u32, out: &mut Vec<C>) {
    let (start, end) = (left.clamp(0, into.into()), left.saturating_add(width.into()));
    let place = |change: C| left.saturating_add(change.column().into());
    let (hidden, shown) = changes.split_at(changes.partition_point(|&c| place(c) <= start));
    let black = C::Pixel::default();
    let (first, last) = (C::last_pixel(hidden), C::last_pixel(changes));
    if first != black && start < end {
        change_to(first, start, into, out);
    }
    let visible = shown.partition_point(|&change| place(change) < into.into());
    // The columns of visible changes fit in 32 bits.
    let right = left as u32;
    let moved = |&change: &C| change.moved(change.column().wrapping_add(right));
    out.extend(shown[..visible].iter().map(moved));
    if last != black && end > start {
        change_to(black, end, into, out);
    }
}

/// Sets a row's value from a column on, which must not be before the row's last change.
fn change_to<C: Change>(pixel: C::Pixel, column: i64, width: u32, row: &mut Vec<C>) {
    if column >= width.into() {
        return;
    }
    let column = column as u32;
    row.pop_if(|last| last.column() == column);
    if C::last_pixel(row) != pixel {
        row.push(C::new(column, pixel));
    }
}

impl<C: Change> RunImage<C> {
    /// Crops and pads the image to a frame.
    pub fn framed(&self, frame: Frame) -> Self {
        if frame.is_whole(self.width(), self.height()) {
            return self.clone();
        }
        let (above, shown, below) = frame.rows(self.height());
        let mut image = Self::without_rows(frame.width);
        image.push_black_rows(above);
        let (left, mut row) = (frame.left.saturating_neg(), Vec::new());
        for index in shown {
            row.clear();
            place_row(self.row(index), self.width(), left, frame.width, &mut row);
            image.push(&row);
        }
        image.push_black_rows(below);
        image
    }
}

impl Image {
    /// Crops and pads the image to a frame.
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
    use crate::Mask;
    use crate::testing::{arbitrary_gray, arbitrary_mask};

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
                let expected = if outside { 0 } else { image.level(x as u32, y as u32) };
                assert_eq!(framed.level(column, row), expected, "{frame:?} {column} {row}");
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
