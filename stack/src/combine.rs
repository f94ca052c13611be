//! Images out of others of their size, pixel by pixel, on runs.

use crate::gray::{GrayMask, LevelChange};
use crate::layer::Image;
use crate::limits::MAX_RUNS;
use crate::mask::{Mask, MaskBuilder};

/// What becomes of two images, pixel by pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {
    /// White where either is.
    Union,
    /// White where both are.
    Intersect,
    /// White where the first is and the second is not.
    Difference,
    /// White where one is and the other is not.
    Xor,
}

impl Op {
    /// Whether the pixel is white that two make.
    pub fn is_white(self, a: bool, b: bool) -> bool {
        match self {
            Self::Union => a | b,
            Self::Intersect => a & b,
            Self::Difference => a & !b,
            Self::Xor => a != b,
        }
    }

    /// The level that two levels make: the higher or the lower one, the lower of
    /// the first and what the second leaves to 255, or how far they are apart.
    /// Of 0 and 255 it makes what [`is_white`](Self::is_white) says.
    pub fn level(self, a: u8, b: u8) -> u8 {
        match self {
            Self::Union => a.max(b),
            Self::Intersect => a.min(b),
            Self::Difference => a.min(255 - b),
            Self::Xor => a.abs_diff(b),
        }
    }

    /// Makes `out` the row that two rows' transitions make.
    pub fn rows(self, a: &[u32], b: &[u32], out: &mut Vec<u32>) {
        match (a, b, self) {
            (row, [], Self::Union | Self::Difference | Self::Xor)
            | ([], row, Self::Union | Self::Xor) => {
                out.clear();
                out.extend_from_slice(row);
            }
            ([], _, _) | (_, [], _) => out.clear(),
            _ => combine_rows([a, b], |[a, b]| self.is_white(a, b), out),
        }
    }
}

crate::named!(Op {
    Union = "union",
    Intersect = "intersect",
    Difference = "difference",
    Xor = "xor",
});

/// Makes `out` the row whose every pixel is what `colour` makes of the pixels
/// of `rows` there. `colour` must leave black what is black in all.
pub fn combine_rows<const N: usize>(
    mut rows: [&[u32]; N],
    colour: impl Fn([bool; N]) -> bool,
    out: &mut Vec<u32>,
) {
    out.clear();
    let mut colours = [false; N];
    let mut white = false;
    while let Some(column) = rows.iter().filter_map(|row| row.first().copied()).min() {
        for (row, colour) in rows.iter_mut().zip(&mut colours) {
            if row.first() == Some(&column) {
                *row = &row[1..];
                *colour = !*colour;
            }
        }
        if white != colour(colours) {
            white = !white;
            out.push(column);
        }
    }
}

/// Makes `out` the row whose every pixel has the level that `level` makes of
/// those of `rows` there. `level` must leave black what is black in all.
pub fn combine_levels<const N: usize>(
    mut rows: [&[LevelChange]; N],
    level: impl Fn([u8; N]) -> u8,
    out: &mut Vec<LevelChange>,
) {
    out.clear();
    let mut levels = [0; N];
    let mut last = 0;
    while let Some(column) = rows.iter().filter_map(|row| Some(row.first()?.column)).min() {
        for (row, level) in rows.iter_mut().zip(&mut levels) {
            if let Some((change, rest)) = row.split_first().filter(|(c, _)| c.column == column) {
                (*level, *row) = (change.level, rest);
            }
        }
        let next = level(levels);
        if std::mem::replace(&mut last, next) != next {
            out.push(LevelChange { column, level: next });
        }
    }
}

impl Mask {
    /// What an operation makes of this image and another of its size; `None`
    /// where that has more runs than any image may have.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn combined(&self, op: Op, other: &Self) -> Option<Self> {
        assert_eq!((self.width(), self.height()), (other.width(), other.height()));
        let mut mask = MaskBuilder::new(self.width());
        mask.reserve(self.height() as usize, self.transition_count());
        let mut row = Vec::new();
        for (a, b) in self.rows().zip(other.rows()) {
            op.rows(a, b, &mut row);
            if mask.transition_count() + row.len() > MAX_RUNS {
                return None;
            }
            mask.push_checked(&row);
        }
        Some(mask.finish())
    }
}

impl GrayMask {
    /// What an operation makes of this image and another of its size, by
    /// [`Op::level`]; `None` where that has more runs than any image may have.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn combined(&self, op: Op, other: &Self) -> Option<Self> {
        assert_eq!((self.width(), self.height()), (other.width(), other.height()));
        let mut gray = Self::new(self.width());
        let mut row = Vec::new();
        for (a, b) in self.rows().zip(other.rows()) {
            combine_levels([a, b], |[a, b]| op.level(a, b), &mut row);
            if gray.change_count() + row.len() > MAX_RUNS {
                return None;
            }
            gray.push_row(&row).expect("both rows are of images as wide");
        }
        Some(gray)
    }
}

impl Image {
    /// What an operation makes of this image and another of its size: a mask of
    /// two masks, else a gray image. `None` where that has more runs than any
    /// image may have.
    ///
    /// # Panics
    /// If the sizes differ.
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
    use crate::testing::{arbitrary_gray, arbitrary_mask, level};

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
                    let [a, b, made] = [&a, &b, &made].map(|image| level(image, column, row));
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
