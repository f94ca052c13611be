//! Combines images pixel by pixel, on their runs.

use crate::image::Image;
use crate::image::gray::GrayMask;
use crate::image::runs::{Change, Pixel, RunImage};
use crate::limits::MAX_RUNS;

/// An operation that combines two images pixel by pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {
    /// White where either image is white.
    Union,
    /// White where both images are white.
    Intersect,
    /// White where only the first image is white.
    Difference,
    /// White where exactly one image is white.
    Xor,
}

impl Op {
    /// Returns true if the combination of two pixels is white.
    pub fn is_white(self, a: bool, b: bool) -> bool {
        match self {
            Self::Union => a | b,
            Self::Intersect => a & b,
            Self::Difference => a & !b,
            Self::Xor => a != b,
        }
    }

    /// Returns the combination of two levels: their maximum for a union, their
    /// minimum for an intersection, the lower of `a` and `255 - b` for a
    /// difference, and `|a - b|` for an exclusive or. For the levels 0 and 255
    /// this agrees with [`is_white`](Self::is_white).
    pub fn level(self, a: u8, b: u8) -> u8 {
        match self {
            Self::Union => a.max(b),
            Self::Intersect => a.min(b),
            Self::Difference => a.min(255 - b),
            Self::Xor => a.abs_diff(b),
        }
    }

    /// Replaces `out` by the combination of two rows.
    pub fn rows<C: Change<Pixel: Combine>>(self, a: &[C], b: &[C], out: &mut Vec<C>) {
        match (a, b, self) {
            (row, [], Self::Union | Self::Difference | Self::Xor)
            | ([], row, Self::Union | Self::Xor) => {
                out.clear();
                out.extend_from_slice(row);
            }
            // An intersection with black is black, and so is black less something.
            ([], _, _) | (_, [], _) => out.clear(),
            _ => combine_rows([a, b], |[a, b]| Combine::combined(self, a, b), out),
        }
    }
}

crate::named!(Op {
    Union = "union",
    Intersect = "intersect",
    Difference = "difference",
    Xor = "xor",
});

/// A pixel's value that an [`Op`] can combine.
pub trait Combine: Pixel {
    /// Returns the combination of two pixels.
    fn combined(op: Op, a: Self, b: Self) -> Self;
}

impl Combine for bool {
    #[inline]
    fn combined(op: Op, a: bool, b: bool) -> bool {
        op.is_white(a, b)
    }
}

impl Combine for u8 {
    #[inline]
    fn combined(op: Op, a: u8, b: u8) -> u8 {
        op.level(a, b)
    }
}

/// Replaces `out` by the row whose pixels are `pixel` of the pixels of `rows`. `pixel` of
/// black pixels must be black.
#[inline]
pub fn combine_rows<C: Change, const N: usize>(
    rows: [&[C]; N],
    pixel: impl Fn([C::Pixel; N]) -> C::Pixel,
    out: &mut Vec<C>,
) {
    out.clear();
    let mut last = C::Pixel::default();
    walk_rows(rows, |column, pixels| {
        let next = pixel(pixels);
        if next != last {
            last = next;
            out.push(C::new(column, next));
        }
    });
}

/// Calls `each` at every column where any row changes, with the rows' pixels from there on.
#[inline]
pub(crate) fn walk_rows<C: Change, const N: usize>(
    mut rows: [&[C]; N],
    mut each: impl FnMut(u32, [C::Pixel; N]),
) {
    let mut pixels = [C::Pixel::default(); N];
    while let Some(column) = rows.iter().filter_map(|row| Some(row.first()?.column())).min() {
        for (row, pixel) in rows.iter_mut().zip(&mut pixels) {
            if let Some((change, rest)) = row.split_first()
                && change.column() == column
            {
                (*pixel, *row) = (change.after(*pixel), rest);
            }
        }
        each(column, pixels);
    }
}

impl<C: Change<Pixel: Combine>> RunImage<C> {
    /// Combines the image with another of its size by [`Op::is_white`] or [`Op::level`]. Returns
    /// `None` if the result has more than [`MAX_RUNS`].
    ///
    /// # Panics
    /// Panics if the sizes differ.
    pub fn combined(&self, op: Op, other: &Self) -> Option<Self> {
        assert_eq!((self.width(), self.height()), (other.width(), other.height()));
        let mut image = Self::without_rows(self.width());
        image.reserve(self.height() as usize, self.change_count());
        let mut row = Vec::new();
        for (a, b) in self.rows().zip(other.rows()) {
            op.rows(a, b, &mut row);
            if image.change_count() + row.len() > MAX_RUNS {
                return None;
            }
            image.push(&row);
        }
        Some(image)
    }
}

impl Image {
    /// Combines the image with another of its size: two masks to a mask, otherwise to a gray
    /// mask. Returns `None` if the result has more than [`MAX_RUNS`].
    ///
    /// # Panics
    /// Panics if the sizes differ.
    pub fn combined(&self, op: Op, other: &Self) -> Option<Self> {
        Some(match (self, other) {
            (Self::Mask(a), Self::Mask(b)) => Self::Mask(a.combined(op, b)?),
            (Self::Mask(a), Self::Gray(b)) => Self::Gray(GrayMask::from(a).combined(op, b)?),
            (Self::Gray(a), Self::Mask(b)) => Self::Gray(a.combined(op, &GrayMask::from(b))?),
            (Self::Gray(a), Self::Gray(b)) => Self::Gray(a.combined(op, b)?),
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{arbitrary_gray, arbitrary_mask};

    /// As many rows and columns as both have, from the top left.
    fn common(a: &Image, b: &Image) -> crate::Frame {
        let (width, height) = (a.width().min(b.width()), a.height().min(b.height()));
        crate::Frame { left: 0, top: 0, width, height }
    }

    fn check(a: &Image, b: &Image) {
        let frame = common(a, b);
        let [a, b] = [a, b].map(|image| image.framed(frame));
        for op in Op::ALL {
            let made = a.combined(op, &b).unwrap();
            assert_eq!((made.width(), made.height()), (frame.width, frame.height));
            for row in 0..frame.height {
                for column in 0..frame.width {
                    let [a, b, made] = [&a, &b, &made].map(|image| image.level(column, row));
                    assert_eq!(made, op.level(a, b), "{op} at column {column}, row {row}");
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn every_pixel_is_what_its_two_make_it(
            masks in [arbitrary_mask(), arbitrary_mask()],
            grays in [arbitrary_gray(), arbitrary_gray()],
        ) {
            let [a, b] = masks.map(Image::Mask);
            let [c, d] = grays.map(Image::Gray);
            check(&a, &b);
            check(&c, &d);
            check(&a, &d);
            check(&c, &b);
        }

        #[test]
        fn every_pixel_of_a_row_is_what_its_rows_make_it(
            rows in prop::array::uniform3(prop::collection::btree_set(0u32..40, 0..12)),
        ) {
            let rows = rows.map(|row| row.into_iter().collect::<Vec<_>>());
            let mut most = Vec::new();
            combine_rows(rows.each_ref().map(Vec::as_slice), |[a, b, c]| a & b | b & c | a & c, &mut most);
            prop_assert!(most.is_sorted_by(|a, b| a < b));
            let white = |row: &[u32], column| row.iter().filter(|&&t| t <= column).count() % 2 == 1;
            for column in 0..40 {
                let votes = rows.iter().filter(|row| white(row, column)).count();
                prop_assert_eq!(white(&most, column), votes > 1);
            }
        }
    }

    #[test]
    fn levels_of_black_and_white_are_colours() {
        for op in Op::ALL {
            assert_eq!(op.to_string().parse(), Ok(op));
            for (a, b) in [(false, false), (false, true), (true, false), (true, true)] {
                let [x, y, made] = [a, b, op.is_white(a, b)].map(|white| 255 * u8::from(white));
                assert_eq!(op.level(x, y), made);
            }
        }
        assert_eq!("plus".parse::<Op>().unwrap_err().name, "plus");
    }
}
