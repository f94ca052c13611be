//! Images turned and mirrored, on runs.

use std::ops::Range;

use crate::gray::{GrayMask, LevelChange};
use crate::layer::Image;
use crate::mask::{MOST_RUNS, Mask, MaskBuilder};

/// Turns an image that is stored as TIFF's orientation tag says (1 to 8), so
/// that its first row is the top and its first column the left; `None` where
/// the upright image has more runs than any may have.
///
/// Source: TIFF 6.0, section 8, Orientation.
pub(crate) fn upright(image: Image, orientation: u8) -> Option<Image> {
    let flips = Flips {
        across: orientation >= 5,
        columns: matches!(orientation, 2 | 3 | 6 | 7),
        rows: matches!(orientation, 3 | 4 | 7 | 8),
    };
    if flips == Flips::default() {
        return Some(image);
    }
    Some(match image {
        Image::Mask(mask) => Image::Mask(flips.of_mask(&mask)?),
        Image::Gray(gray) => Image::Gray(flips.of_gray(&gray)?),
    })
}

/// What is done to an image, one after the other.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Flips {
    /// Whether rows and columns are exchanged.
    pub(crate) across: bool,
    /// Whether the last column becomes the first.
    pub(crate) columns: bool,
    /// Whether the last row becomes the first.
    pub(crate) rows: bool,
}

impl Flips {
    /// `None` where that has more runs than any image may have.
    pub(crate) fn of_mask(self, mask: &Mask) -> Option<Mask> {
        let mut mask = if self.across { mask.transposed()? } else { mask.clone() };
        if self.columns {
            mask = mask.with_columns_reversed();
        }
        Some(if self.rows { mask.with_rows_reversed() } else { mask })
    }

    /// `None` where that has more runs than any image may have.
    pub(crate) fn of_gray(self, gray: &GrayMask) -> Option<GrayMask> {
        let mut gray = if self.across { gray.transposed()? } else { gray.clone() };
        if self.columns {
            gray = gray.with_columns_reversed();
        }
        Some(if self.rows { gray.with_rows_reversed() } else { gray })
    }
}

impl Mask {
    /// The image with its last row first.
    pub(crate) fn with_rows_reversed(&self) -> Self {
        let mut mask = MaskBuilder::new(self.width());
        mask.reserve(self.height() as usize, self.transition_count());
        for row in (0..self.height()).rev() {
            mask.push_checked(self.row(row));
        }
        mask.finish()
    }

    /// The image with its last column first.
    pub(crate) fn with_columns_reversed(&self) -> Self {
        let width = self.width();
        let mut mask = MaskBuilder::new(width);
        mask.reserve(self.height() as usize, self.transition_count());
        let mut reversed = Vec::new();
        for row in self.rows() {
            reversed.clear();
            // A row that ends white starts white when reversed, and the other
            // way round.
            if row.len() % 2 == 1 {
                reversed.push(0);
            }
            let starts_white = row.first() == Some(&0);
            let inner = &row[usize::from(starts_white)..];
            reversed.extend(inner.iter().rev().map(|&column| width - column));
            mask.push_checked(&reversed);
        }
        mask.finish()
    }

    /// The image with rows and columns exchanged; `None` where that has more
    /// runs than any image may have. It costs the edges along rows.
    pub(crate) fn transposed(&self) -> Option<Self> {
        let (offsets, transitions) = by_column(self.width(), 0, |each| {
            let mut above: &[u32] = &[];
            for (row, index) in self.rows().zip(0..) {
                stretches_that_differ(above, row, self.width(), |stretch| each(stretch, index));
                above = row;
            }
        })?;
        Some(Self::new(self.height(), offsets, transitions).expect("rows come in order"))
    }
}

impl GrayMask {
    /// The image with its last row first.
    pub(crate) fn with_rows_reversed(&self) -> Self {
        let rows: Vec<_> = self.rows().collect();
        let mut gray = Self::new(self.width());
        for row in rows.into_iter().rev() {
            gray.push_row(row).expect("it was a row of an image as wide");
        }
        gray
    }

    /// The image with its last column first.
    pub(crate) fn with_columns_reversed(&self) -> Self {
        let width = self.width();
        let mut gray = Self::new(width);
        for row in self.rows() {
            let mut runs = Vec::new();
            let mut end = width;
            for &LevelChange { column, level } in row.iter().rev() {
                runs.push((end - column, level));
                end = column;
            }
            gray.push_runs(runs).expect("a row reversed is as long");
        }
        gray
    }

    /// The image with rows and columns exchanged; `None` where that has more
    /// runs than any image may have. It costs the edges along rows.
    pub(crate) fn transposed(&self) -> Option<Self> {
        let blank = LevelChange { column: 0, level: 0 };
        let (offsets, changes) = by_column(self.width(), blank, |each| {
            let mut above: &[LevelChange] = &[];
            for (row, index) in self.rows().zip(0..) {
                levels_that_differ(above, row, self.width(), |stretch, level| {
                    each(stretch, LevelChange { column: index, level });
                });
                above = row;
            }
        })?;
        let rows = offsets.windows(2).map(|ends| &changes[ends[0] as usize..ends[1] as usize]);
        let mut gray = Self::new(self.height());
        for row in rows {
            gray.push_row(row).expect("rows come in order");
        }
        Some(gray)
    }
}

/// Gives each stretch of columns where two rows of a mask differ.
fn stretches_that_differ(above: &[u32], row: &[u32], width: u32, mut each: impl FnMut(Range<u32>)) {
    let (mut i, mut j) = (0, 0);
    let mut start = None;
    loop {
        let (a, b) = (above.get(i), row.get(j));
        let Some(&column) = a.into_iter().chain(b).min() else { break };
        i += usize::from(a == Some(&column));
        j += usize::from(b == Some(&column));
        if a != b {
            match start.take() {
                None => start = Some(column),
                Some(start) => each(start..column),
            }
        }
    }
    if let Some(start) = start {
        each(start..width);
    }
}

/// Gives each stretch of columns where two rows of a gray mask differ, and the
/// second row's level there.
fn levels_that_differ(
    above: &[LevelChange],
    row: &[LevelChange],
    width: u32,
    mut each: impl FnMut(Range<u32>, u8),
) {
    let (mut i, mut j) = (0, 0);
    let (mut start, mut level_above, mut level) = (0, 0, 0);
    while start < width {
        let (a, b) = (above.get(i), row.get(j));
        let column = a.into_iter().chain(b).map(|change| change.column).min().unwrap_or(width);
        if level_above != level && start < column {
            each(start..column, level);
        }
        if let Some(change) = a.filter(|change| change.column == column) {
            level_above = change.level;
            i += 1;
        }
        if let Some(change) = b.filter(|change| change.column == column) {
            level = change.level;
            j += 1;
        }
        start = column;
    }
}

/// Gathers values that `visit` gives for stretches of columns, by column: where
/// each column's values start (and one entry more), and the values. `visit` is
/// called several times and must give the same each time. `None` where the
/// values are more than the runs that an image may have.
fn by_column<T: Copy>(
    width: u32,
    blank: T,
    visit: impl Fn(&mut dyn FnMut(Range<u32>, T)),
) -> Option<(Vec<u32>, Vec<T>)> {
    let mut total = 0u64;
    visit(&mut |stretch, _| total += u64::from(stretch.end - stretch.start));
    if total > MOST_RUNS as u64 {
        return None;
    }
    // At each column, how many values more than the column before it has.
    let mut starts = vec![0u32; width as usize + 1];
    visit(&mut |stretch, _| {
        for (column, step) in [(stretch.start, 1), (stretch.end, u32::MAX)] {
            let more = &mut starts[column as usize];
            *more = more.wrapping_add(step);
        }
    });
    let (mut start, mut count) = (0u32, 0u32);
    for column in &mut starts {
        count = count.wrapping_add(*column);
        *column = start;
        start += count;
    }
    let mut values = vec![blank; total as usize];
    visit(&mut |stretch, value| {
        for next in &mut starts[stretch.start as usize..stretch.end as usize] {
            values[*next as usize] = value;
            *next += 1;
        }
    });
    // Each column's start has become its end, which is the next one's start.
    starts.copy_within(..width as usize, 1);
    starts[0] = 0;
    Some((starts, values))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{arbitrary_gray, arbitrary_mask, level};

    /// Where the pixel of an upright image stands in an image of `width` and
    /// `height` that is stored with an orientation, as TIFF 6.0 words it.
    fn stored_at(orientation: u8, x: u32, y: u32, width: u32, height: u32) -> (u32, u32) {
        match orientation {
            1 => (x, y),
            2 => (width - 1 - x, y),
            3 => (width - 1 - x, height - 1 - y),
            4 => (x, height - 1 - y),
            5 => (y, x),
            6 => (y, height - 1 - x),
            7 => (width - 1 - y, height - 1 - x),
            8 => (width - 1 - y, x),
            _ => unreachable!(),
        }
    }

    fn check(image: &Image) {
        let (width, height) = (image.width(), image.height());
        for orientation in 1..=8 {
            let turned = upright(image.clone(), orientation).unwrap();
            let expected = if orientation < 5 { (width, height) } else { (height, width) };
            assert_eq!((turned.width(), turned.height()), expected);
            for y in 0..turned.height() {
                for x in 0..turned.width() {
                    let (column, row) = stored_at(orientation, x, y, width, height);
                    assert_eq!(
                        level(&turned, x, y),
                        level(image, column, row),
                        "orientation {orientation}, column {x}, row {y}"
                    );
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn every_pixel_of_a_mask_comes_from_its_place(mask in arbitrary_mask()) {
            prop_assume!(mask.width() < 3000);
            check(&Image::Mask(mask));
        }

        #[test]
        fn every_pixel_of_a_gray_mask_comes_from_its_place(gray in arbitrary_gray()) {
            check(&Image::Gray(gray));
        }

        #[test]
        fn transposing_twice_changes_nothing(mask in arbitrary_mask(), gray in arbitrary_gray()) {
            prop_assert_eq!(mask.transposed().unwrap().transposed().unwrap(), mask);
            prop_assert_eq!(gray.transposed().unwrap().transposed().unwrap(), gray);
        }
    }

    #[test]
    fn an_image_that_transposed_has_too_many_runs_is_refused() {
        let mut mask = MaskBuilder::new(1 << 26);
        for row in 0..4 {
            mask.push_checked(if row % 2 == 0 { &[0] } else { &[] });
        }
        assert_eq!(mask.finish().transposed(), None);
    }
}
