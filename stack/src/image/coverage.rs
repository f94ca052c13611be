//! Means of levels over boxes of pixels, from runs.

use std::num::NonZeroU32;
use std::ops::Range;

use crate::image::Image;
use crate::image::runs::Change;

/// Returns the mean levels of a region's boxes, row by row from the top.
///
/// A box is `side` x `side` pixels; those at the right and lower border of the region have fewer,
/// and their mean is of the pixels that they have. A white pixel has the level 255. Means are
/// rounded, halves up. The cost grows with the transitions in the region, whatever the side.
///
/// ```
/// use std::num::NonZeroU32;
/// use lamp_stack::{Image, Mask, mean_levels};
///
/// // `.##.#` and `#####`.
/// let image = Image::Mask(Mask::new(5, vec![0, 3, 4], vec![1, 3, 4, 0])?);
/// let two = NonZeroU32::new(2).unwrap();
/// let rows: Vec<_> = mean_levels(&image, 0..5, 0..2, two).collect();
/// assert_eq!(rows, [[191, 191, 255]]);
/// # Ok::<(), lamp_stack::RunError>(())
/// ```
///
/// # Panics
/// Panics if the region reaches beyond the image.
pub fn mean_levels(
    image: &Image,
    columns: Range<u32>,
    rows: Range<u32>,
    side: NonZeroU32,
) -> impl Iterator<Item = Vec<u8>> + use<'_> {
    assert!(rows.end <= image.height(), "the region is outside");
    let bands = rows.clone().step_by(side.get() as usize);
    let bands = bands.map(move |first| first..first.saturating_add(side.get()).min(rows.end));
    mean_levels_of_bands(image, columns, bands, side)
}

/// Returns the mean levels of boxes `side` columns wide, as [`mean_levels`] does, in bands of rows.
///
/// # Panics
/// Panics if the columns or a band reach beyond the image, or if a band is empty.
pub fn mean_levels_of_bands<B: Iterator<Item = Range<u32>>>(
    image: &Image,
    columns: Range<u32>,
    bands: B,
    side: NonZeroU32,
) -> impl Iterator<Item = Vec<u8>> + use<'_, B> {
    assert!(columns.end <= image.width(), "the region is outside");
    let mut sums = BoxSums::new(columns, side);
    bands.map(move |band| {
        for row in band.clone() {
            match image {
                Image::Mask(mask) => sums.add(mask.row(row), |white| 255 * i64::from(white)),
                Image::Gray(gray) => sums.add(gray.row(row), i64::from),
            }
        }
        sums.take_means(band.len())
    })
}

/// The sums of levels in the boxes of a band of rows.
struct BoxSums {
    columns: Range<u32>,
    side: NonZeroU32,
    /// The shift for a side that is a power of two.
    shift: Option<u32>,
    /// For each box, and one beyond: the level that ends in it times its columns until then, and
    /// the level that ends in it, which fills all boxes before it.
    ends: Vec<[i64; 2]>,
}

impl BoxSums {
    fn new(columns: Range<u32>, side: NonZeroU32) -> Self {
        let boxes = columns.len().div_ceil(side.get() as usize);
        let shift = side.is_power_of_two().then(|| side.trailing_zeros());
        Self { columns, side, shift, ends: vec![[0; 2]; boxes + 1] }
    }

    /// Adds a row, given the level of a pixel.
    fn add<C: Change>(&mut self, row: &[C], level: impl Fn(C::Pixel) -> i64) {
        let side = self.side.get();
        match self.shift {
            Some(shift) => self.add_by(row, level, |at| [at >> shift, at & (side - 1)]),
            None => self.add_by(row, level, |at| [at / side, at % side]),
        }
    }

    /// Adds a row, given how a column divides into box and rest.
    ///
    /// A run from a to b with a level is the level up to b less the level up to a: each change
    /// adds what the level falls by, up to its column.
    #[inline]
    fn add_by<C: Change>(
        &mut self,
        row: &[C],
        level: impl Fn(C::Pixel) -> i64,
        divide: impl Fn(u32) -> [u32; 2],
    ) {
        let Range { start, end } = self.columns;
        let before = row.partition_point(|change| change.column() <= start);
        let mut pixel = C::last_pixel(&row[..before]);
        let mut fall = |at: u32, by: i64| {
            let [index, rest] = divide(at);
            let [part, whole] = &mut self.ends[index as usize];
            *part += by * i64::from(rest);
            *whole += by;
        };
        for change in row[before..].iter().take_while(|change| change.column() < end) {
            let next = change.after(pixel);
            fall(change.column() - start, level(pixel) - level(next));
            pixel = next;
        }
        // A run that goes on behind the region ends at its border here.
        if pixel != C::Pixel::default() {
            fall(end - start, level(pixel));
        }
    }

    /// Returns the means of the rows added, and starts again.
    fn take_means(&mut self, rows: usize) -> Vec<u8> {
        let boxes = self.ends.len() - 1;
        let side = u64::from(self.side.get());
        let width = self.columns.len() as u64;
        let mut means = vec![0; boxes];
        // Runs that end at the region's border may end in the box beyond the last.
        let [_, mut after] = std::mem::take(&mut self.ends[boxes]);
        // From the right, because a level that ends in a box fills all boxes before it.
        for index in (0..boxes).rev() {
            let [part, whole] = std::mem::take(&mut self.ends[index]);
            let columns = side.min(width - index as u64 * side);
            // Single changes may count below zero, but their sum is a sum of levels.
            let sum = (part + columns as i64 * after) as u64;
            let pixels = columns * rows as u64;
            means[index] = ((2 * sum + pixels) / (2 * pixels)) as u8;
            after += whole;
        }
        means
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::MAX_SIDE;
    use crate::testing::{arbitrary_gray, arbitrary_mask, mask_of};

    /// The same, pixel by pixel.
    fn slow(image: &Image, columns: Range<u32>, rows: Range<u32>, side: u32) -> Vec<Vec<u8>> {
        let within = |first: u32, end: u32| first..(first + side).min(end);
        let mean = |top, left| {
            let pixels = within(top, rows.end)
                .flat_map(|row| within(left, columns.end).map(move |column| (column, row)));
            let levels: Vec<u64> =
                pixels.map(|(column, row)| image.level(column, row).into()).collect();
            (levels.iter().sum::<u64>() as f64 / levels.len() as f64 + 0.5).floor() as u8
        };
        let of_row =
            |top| columns.clone().step_by(side as usize).map(|left| mean(top, left)).collect();
        rows.clone().step_by(side as usize).map(of_row).collect()
    }

    proptest! {
        #[test]
        fn means_are_those_of_pixels(
            image in prop_oneof![arbitrary_mask().prop_map(Image::Mask), arbitrary_gray().prop_map(Image::Gray)],
            cut in [0.0..1.0f64, 0.0..1.0, 0.0..1.0, 0.0..1.0],
            side in prop_oneof![1u32..12, 1u32..3000],
        ) {
            let range = |size: u32, a: f64, b: f64| {
                let [a, b] = [a.min(b), a.max(b)].map(|at| (at * f64::from(size + 1)) as u32);
                a..b
            };
            let columns = range(image.width(), cut[0], cut[1]);
            let rows = range(image.height(), cut[2], cut[3]);
            let side_of = NonZeroU32::new(side).unwrap();
            let means: Vec<_> = mean_levels(&image, columns.clone(), rows.clone(), side_of).collect();
            prop_assert_eq!(means, slow(&image, columns, rows, side));
        }
    }

    #[test]
    fn the_largest_box_does_not_overflow() {
        let image = Image::Mask(mask_of(MAX_SIDE, [&[0][..], &[]]));
        let side = NonZeroU32::new(1 << 31).unwrap();
        let rows: Vec<_> = mean_levels(&image, 0..MAX_SIDE, 0..2, side).collect();
        assert_eq!(rows, [[128]]);
    }
}
