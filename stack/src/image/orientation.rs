//! Rotates and mirrors images, on their runs.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use thiserror::Error;

use crate::image::Image;
use crate::image::combine::walk_rows;
use crate::image::runs::{Change, RunImage};
use crate::limits::MAX_RUNS;

/// One of the eight isometries of an image: mirrored left to right or not, then
/// rotated anticlockwise by right angles, as seen with row 0 on top.
///
/// ```text
///   0      90    180    270   0m     90m   180m   270m
///   #..    .#    ###    ##    ..#    ##    ###    #.
///   ###    .#    ..#    #.    ###    .#    #..    #.
///          ##           #.           .#           ##
/// ```
///
/// ```
/// use lamp_stack::{Mask, Orientation};
///
/// let mask = Mask::new(3, vec![0, 2, 3], vec![0, 1, 0]).unwrap();
/// let orientation: Orientation = "90m".parse().unwrap();
/// let turned = mask.oriented(orientation).unwrap();
/// assert_eq!((turned.width(), turned.height()), (2, 3));
/// assert_eq!(turned.oriented(orientation.inverse()), Some(mask));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Orientation {
    /// The number of right angles, 0 to 3.
    quarters: u8,
    mirrored: bool,
}

/// An error in the text of an [`Orientation`].
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{0}` is not a turn: write 0, 90, 180 or 270, and m after it to mirror first")]
pub struct OrientationError(String);

impl Orientation {
    /// All eight orientations: the four rotations, then the same mirrored.
    pub const ALL: [Self; 8] = {
        let mut all = [Self { quarters: 0, mirrored: false }; 8];
        let mut k = 0;
        while k < 8 {
            all[k] = Self { quarters: k as u8 % 4, mirrored: k >= 4 };
            k += 1;
        }
        all
    };

    /// Creates the orientation that mirrors left to right if `mirrored`, then rotates
    /// anticlockwise by `quarters` right angles.
    pub fn new(quarters: u32, mirrored: bool) -> Self {
        Self { quarters: (quarters % 4) as u8, mirrored }
    }

    /// Returns the orientation that turns an image with this TIFF orientation tag (1 to 8)
    /// upright, or `None` for other values.
    ///
    /// Source: TIFF 6.0, section 8, Orientation.
    pub(crate) fn of_tiff_tag(tag: u64) -> Option<Self> {
        let ways = ["0", "0m", "180", "180m", "90m", "270", "270m", "90"];
        ways.get(usize::try_from(tag).ok()?.checked_sub(1)?)?.parse().ok()
    }

    /// Returns the number of right angles, 0 to 3, of the anticlockwise rotation.
    pub fn quarters(self) -> u32 {
        self.quarters.into()
    }

    /// Returns true if an image is mirrored left to right before the rotation.
    pub fn is_mirrored(self) -> bool {
        self.mirrored
    }

    /// Returns true if rows become columns.
    pub fn is_across(self) -> bool {
        self.quarters % 2 == 1
    }

    /// Returns the orientation that undoes this one.
    pub fn inverse(self) -> Self {
        // A reflection is its own inverse.
        let quarters = if self.mirrored { self.quarters } else { (4 - self.quarters) % 4 };
        Self { quarters, ..self }
    }

    /// Returns the oriented width and height of an image of this size.
    pub fn size(self, width: u32, height: u32) -> (u32, u32) {
        if self.is_across() { (height, width) } else { (width, height) }
    }

    /// Returns the column and row that a pixel of the oriented image has in the image, which is
    /// `size` pixels wide and high.
    ///
    /// # Panics
    /// Panics if the oriented image has no such pixel.
    pub fn unturned(self, [column, row]: [u32; 2], size: [u32; 2]) -> [u32; 2] {
        let (width, height) = self.size(size[0], size[1]);
        assert!(column < width && row < height, "the pixel is outside the image");
        let (columns, rows) = self.reversed();
        let column = if columns { width - 1 - column } else { column };
        let row = if rows { height - 1 - row } else { row };
        if self.is_across() { [row, column] } else { [column, row] }
    }

    /// Returns whether to reverse the columns and the rows, after exchanging rows and columns if
    /// the orientation [`is_across`](Self::is_across).
    fn reversed(self) -> (bool, bool) {
        // By 90° anticlockwise: rows and columns exchanged, rows reversed; by 270°, columns.
        let (columns, rows) = (self.quarters >= 2, matches!(self.quarters, 1 | 2));
        if self.mirrored { (!rows, columns) } else { (columns, rows) }
    }
}

impl fmt::Display for Orientation {
    /// Formats as `0`, `90`, `180` or `270`, followed by `m` if mirrored.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", u32::from(self.quarters) * 90, if self.mirrored { "m" } else { "" })
    }
}

impl FromStr for Orientation {
    type Err = OrientationError;

    /// Parses the format of [`Display`](fmt::Display).
    fn from_str(text: &str) -> Result<Self, OrientationError> {
        let known = Self::ALL.into_iter().find(|known| known.to_string() == text.trim());
        known.ok_or_else(|| OrientationError(text.to_owned()))
    }
}

impl<C: Change> RunImage<C> {
    /// Returns the image in another orientation, or `None` if it would have more than
    /// [`MAX_RUNS`]. The cost grows with the edges along rows and columns.
    pub fn oriented(&self, orientation: Orientation) -> Option<Self> {
        let mut image = if orientation.is_across() { self.transposed()? } else { self.clone() };
        let (columns, rows) = orientation.reversed();
        if columns {
            image = image.with_columns_reversed();
        }
        Some(if rows { image.with_rows_reversed() } else { image })
    }

    /// Returns the image with its last row first.
    fn with_rows_reversed(&self) -> Self {
        let mut image = Self::without_rows(self.width());
        image.reserve(self.height() as usize, self.change_count());
        for row in (0..self.height()).rev() {
            image.push(self.row(row));
        }
        image
    }

    /// Returns the image with its last column first.
    fn with_columns_reversed(&self) -> Self {
        let width = self.width();
        let mut image = Self::without_rows(width);
        image.reserve(self.height() as usize, self.change_count());
        let mut reversed = Vec::new();
        for row in self.rows() {
            reversed.clear();
            let last = C::last_pixel(row);
            if last != C::Pixel::default() {
                reversed.push(C::new(0, last));
            }
            // A change at column 0 would move to the width, outside the row.
            let first = usize::from(row.first().is_some_and(|change| change.column() == 0));
            reversed.extend((first..row.len()).rev().map(|i| {
                // From right to left, a change restores the value before it.
                C::new(width - row[i].column(), C::last_pixel(&row[..i]))
            }));
            image.push(&reversed);
        }
        image
    }

    /// Returns the image with rows and columns exchanged, or `None` if it would have more than
    /// [`MAX_RUNS`]. Each column gets a change wherever two adjacent rows differ.
    fn transposed(&self) -> Option<Self> {
        let black = C::Pixel::default();
        let (offsets, changes) = by_column(self.width(), C::new(0, black), |each| {
            let mut above: &[C] = &[];
            for (row, index) in self.rows().zip(0..) {
                stretches_that_differ(above, row, self.width(), |stretch, pixel| {
                    each(stretch, C::new(index, pixel));
                });
                above = row;
            }
        })?;
        Some(Self::from_arrays(self.height(), offsets, changes).expect("rows come in order"))
    }
}

impl Image {
    /// Returns the image in another orientation, or `None` if it would have more than
    /// [`MAX_RUNS`]. The cost grows with the edges along rows and columns.
    pub fn oriented(&self, orientation: Orientation) -> Option<Self> {
        Some(match self {
            Self::Mask(mask) => Self::Mask(mask.oriented(orientation)?),
            Self::Gray(gray) => Self::Gray(gray.oriented(orientation)?),
        })
    }
}

/// Calls `each` with every range of columns where two rows differ, and the second row's
/// value there.
fn stretches_that_differ<C: Change>(
    above: &[C],
    row: &[C],
    width: u32,
    mut each: impl FnMut(Range<u32>, C::Pixel),
) {
    let (mut start, mut pixels) = (0, [C::Pixel::default(); 2]);
    let mut end = |column, next| {
        if pixels[0] != pixels[1] {
            each(start..column, pixels[1]);
        }
        (start, pixels) = (column, next);
    };
    walk_rows([above, row], &mut end);
    // Ends a stretch that reaches the width.
    end(width, [C::Pixel::default(); 2]);
}

/// Sorts by column the values that `visit` reports for ranges of columns. Returns the start
/// of each column's values (and a last entry, the end) and the values, or `None` if there
/// are more than [`MAX_RUNS`]. `visit` is called several times and must report the same each
/// time: comparing rows again is cheaper than storing the ranges.
fn by_column<T: Copy>(
    width: u32,
    blank: T,
    visit: impl Fn(&mut dyn FnMut(Range<u32>, T)),
) -> Option<(Vec<u32>, Vec<T>)> {
    let mut total = 0u64;
    visit(&mut |stretch, _| total += u64::from(stretch.end - stretch.start));
    if total > MAX_RUNS as u64 {
        return None;
    }
    // First, the difference between the counts of each column and the one before it.
    let mut starts = vec![0u32; width as usize + 1];
    visit(&mut |stretch, _| {
        // u32::MAX is -1: counts wrap, and their sums are right again.
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
    // Each column's start has become its end, which is the start of the next column.
    starts.copy_within(..width as usize, 1);
    starts[0] = 0;
    Some((starts, values))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Mask;
    use crate::testing::{arbitrary_gray, arbitrary_mask, mask_of};

    fn drawn(mask: &Mask) -> Vec<String> {
        let pixel = |column, row| if mask.is_white(column, row) { '#' } else { '.' };
        let row = |row| (0..mask.width()).map(|column| pixel(column, row)).collect();
        (0..mask.height()).map(row).collect()
    }

    #[test]
    fn images_lie_as_drawn() {
        let mask = mask_of(3, [&[0, 1][..], &[0]]);
        let ways = [
            ("0", vec!["#..", "###"]),
            ("90", vec![".#", ".#", "##"]),
            ("180", vec!["###", "..#"]),
            ("270", vec!["##", "#.", "#."]),
            ("0m", vec!["..#", "###"]),
            ("90m", vec!["##", ".#", ".#"]),
            ("180m", vec!["###", "#.."]),
            ("270m", vec!["#.", "#.", "##"]),
        ];
        for (way, picture) in ways {
            assert_eq!(drawn(&mask.oriented(way.parse().unwrap()).unwrap()), picture, "{way}");
        }
    }

    #[test]
    fn orientations_are_written_as_they_are_read() {
        for orientation in Orientation::ALL {
            assert_eq!(orientation.to_string().parse(), Ok(orientation));
            let Orientation { quarters, mirrored } = orientation;
            assert_eq!(Orientation::new(u32::from(quarters) + 4, mirrored), orientation);
        }
        for wrong in ["", "m", "45", "-90", "90 m", "m90", "360"] {
            assert!(wrong.parse::<Orientation>().is_err(), "{wrong}");
        }
    }

    /// Returns the source of a point of an oriented image by the definition, with x to the
    /// right and y up from the middle, in half pixels.
    fn source(orientation: Orientation, (mut x, mut y): (i64, i64)) -> (i64, i64) {
        for _ in 0..orientation.quarters() {
            (x, y) = (y, -x);
        }
        (if orientation.is_mirrored() { -x } else { x }, y)
    }

    fn check(image: &Image) {
        let [width, height] = [image.width(), image.height()].map(i64::from);
        for orientation in Orientation::ALL {
            let turned = image.oriented(orientation).unwrap();
            let size = orientation.size(image.width(), image.height());
            assert_eq!((turned.width(), turned.height()), size);
            assert_eq!(turned.oriented(orientation.inverse()).unwrap(), *image);
            for (row, column) in (0..size.1).flat_map(|y| (0..size.0).map(move |x| (y, x))) {
                let x = 2 * i64::from(column) + 1 - i64::from(size.0);
                let y = i64::from(size.1) - 2 * i64::from(row) - 1;
                let (x, y) = source(orientation, (x, y));
                let expected = image.level(((x + width) / 2) as u32, ((height - y) / 2) as u32);
                assert_eq!(turned.level(column, row), expected, "{orientation} {column} {row}");
            }
        }
    }

    /// Returns the place of an upright image's pixel in an image of `width` and `height` stored
    /// with an orientation tag, following TIFF 6.0, section 8.
    fn stored_at(tag: u64, x: u32, y: u32, width: u32, height: u32) -> (u32, u32) {
        match tag {
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

    #[test]
    fn tiff_s_tags_are_undone() {
        let image = Image::Mask(mask_of(3, [&[0, 1][..], &[0]]));
        for tag in 1..=8 {
            let upright = image.oriented(Orientation::of_tiff_tag(tag).unwrap()).unwrap();
            for (x, y) in
                (0..upright.width()).flat_map(|x| (0..upright.height()).map(move |y| (x, y)))
            {
                let (column, row) = stored_at(tag, x, y, 3, 2);
                assert_eq!(upright.level(x, y), image.level(column, row), "tag {tag}");
            }
        }
        assert_eq!([0, 9, u64::MAX].map(Orientation::of_tiff_tag), [None; 3]);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn every_pixel_comes_from_its_place(mask in arbitrary_mask(), gray in arbitrary_gray()) {
            prop_assume!(mask.width() < 3000);
            check(&Image::Mask(mask));
            check(&Image::Gray(gray));
        }
    }

    #[test]
    fn an_image_that_transposed_has_too_many_runs_is_refused() {
        let wide = mask_of(1 << 26, [&[0][..], &[], &[0], &[]]);
        assert_eq!(wide.transposed(), None);
    }
}
