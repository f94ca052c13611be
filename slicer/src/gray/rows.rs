//! Defines the pixels of a shaded row: gray levels, or the depths of the part.

use std::iter;

use lamp_stack::{DepthLevels, GrayMask, Image, LevelChange, Mask};

use super::row_lists::RowLists;

/// Rows that get the depth of the part below each pixel.
pub(crate) trait ShadedRows {
    /// The value of a pixel.
    /// A row begins with the default.
    type Pixel: Copy + PartialEq + Default;
    /// A column from which on pixels have another value.
    type Change;

    /// Whether the rows look down from pixels outside the section, to where the part begins below,
    /// and not from pixels inside, to where it ends.
    const LOOKS_FROM_OUTSIDE: bool = false;
    /// A pixel from which the rows do not look down.
    const OTHER: Self::Pixel;
    /// A pixel below which nothing changes down to any depth that matters.
    const DEEP: Self::Pixel;

    /// Returns the pixel for the depth below it at which the part ends or begins, in micrometers.
    fn of_depth(&self, depth_um: f64) -> Self::Pixel;

    fn change(column: u32, pixel: Self::Pixel) -> Self::Change;

    /// Returns the rows; changes are added to them from the left.
    fn rows_mut(&mut self) -> &mut RowLists<Self::Change>;
}

/// Gray levels, each of which alone cures its depth.
pub(crate) struct LevelRows<'a> {
    levels: &'a DepthLevels,
    width: u32,
    rows: RowLists<LevelChange>,
}

impl<'a> LevelRows<'a> {
    pub(crate) fn new(levels: &'a DepthLevels, width: u32) -> Self {
        Self { levels, width, rows: RowLists::default() }
    }

    pub(crate) fn finish(self) -> Image {
        finished(self.width, self.rows)
    }
}

impl ShadedRows for LevelRows<'_> {
    type Pixel = u8;
    type Change = LevelChange;

    const OTHER: u8 = 0;
    const DEEP: u8 = 255;

    #[inline]
    fn of_depth(&self, depth_um: f64) -> u8 {
        self.levels.level(lamp_stack::Length::from_um(depth_um))
    }

    #[inline]
    fn change(column: u32, level: u8) -> LevelChange {
        LevelChange { column, level }
    }

    #[inline]
    fn rows_mut(&mut self) -> &mut RowLists<LevelChange> {
        &mut self.rows
    }
}

/// Returns an image: 1-bit if no pixel is gray.
pub(crate) fn finished(width: u32, rows: RowLists<LevelChange>) -> Image {
    let (row_offsets, changes) = rows.into_arrays();
    let rises = "levels change at increasing columns";
    if changes.iter().any(|change| change.level % 255 != 0) {
        return Image::Gray(GrayMask::from_changes(width, row_offsets, changes).expect(rises));
    }
    let transitions = changes.iter().map(|change| change.column).collect();
    Image::Mask(Mask::new(width, row_offsets, transitions).expect(rises))
}

/// White pixels on one side of the part: those inside it all the way through the layer, or, if
/// `OUTSIDE`, those inside it anywhere in the layer.
pub(crate) struct SideRows<const OUTSIDE: bool> {
    width: u32,
    /// The depth from which on a face counts as lying at the layer's bottom.
    bottom_um: f64,
    /// The columns at which the color changes.
    rows: RowLists<u32>,
}

impl<const OUTSIDE: bool> SideRows<OUTSIDE> {
    pub(crate) fn new(width: u32, bottom_um: f64) -> Self {
        Self { width, bottom_um, rows: RowLists::default() }
    }

    pub(crate) fn finish(self) -> Mask {
        let (row_offsets, columns) = self.rows.into_arrays();
        Mask::new(self.width, row_offsets, columns).expect("colors change at increasing columns")
    }
}

impl<const OUTSIDE: bool> ShadedRows for SideRows<OUTSIDE> {
    /// Whether it is white.
    type Pixel = bool;
    type Change = u32;

    const LOOKS_FROM_OUTSIDE: bool = OUTSIDE;
    const OTHER: bool = OUTSIDE;
    const DEEP: bool = !OUTSIDE;

    #[inline]
    fn of_depth(&self, depth_um: f64) -> bool {
        (depth_um < self.bottom_um) == OUTSIDE
    }

    #[inline]
    fn change(column: u32, _is_white: bool) -> u32 {
        column
    }

    #[inline]
    fn rows_mut(&mut self) -> &mut RowLists<u32> {
        &mut self.rows
    }
}

/// The depth of the part below each pixel of a layer, in micrometers from the layer's top: zero
/// outside, infinite where it is deeper than light reaches.
#[derive(Debug)]
pub(crate) struct DepthRows {
    width: u32,
    /// The columns at which the depth changes, and the new depths.
    changes: RowLists<(u32, f32)>,
}

impl DepthRows {
    pub(crate) fn new(width: u32) -> Self {
        Self { width, changes: RowLists::default() }
    }

    pub(crate) fn width(&self) -> u32 {
        self.width
    }

    pub(crate) fn height(&self) -> u32 {
        self.changes.len()
    }

    /// Returns the pieces of equal depth in a row that are part, as the first column, the column
    /// after the last, and the depth.
    #[inline]
    pub(crate) fn parts(&self, row: u32) -> impl Iterator<Item = (u32, u32, f64)> {
        let changes = self.changes.row(row);
        (0..changes.len()).filter_map(|k| {
            let (start, depth) = changes[k];
            let end = changes.get(k + 1).map_or(self.width, |&(end, _)| end);
            (depth > 0.0).then_some((start, end, depth.into()))
        })
    }

    /// Returns the pieces of equal depth of some columns of a row, as [`parts`](Self::parts) does,
    /// including pieces outside. `read` is the number of changes at or before the columns requested
    /// so far; these must come from the left.
    #[inline]
    pub(crate) fn pieces_from(
        &self,
        row: u32,
        read: &mut usize,
        start: u32,
        end: u32,
    ) -> impl Iterator<Item = (u32, u32, f64)> {
        let changes = self.changes.row(row);
        while changes.get(*read).is_some_and(|&(column, _)| column <= start) {
            *read += 1;
        }
        let depth = read.checked_sub(1).map_or(0.0, |last| changes[last].1);
        let (mut next, mut here) = (changes[*read..].iter(), Some((start, depth)));
        iter::from_fn(move || {
            let (from, depth) = here?;
            here = next.next().copied().filter(|&(column, _)| column < end);
            Some((from, here.map_or(end, |(column, _)| column), f64::from(depth)))
        })
    }

    /// Returns the depth at a pixel.
    pub(crate) fn at(&self, row: u32, column: u32) -> f64 {
        let changes = self.changes.row(row);
        let before = changes.partition_point(|&(start, _)| start <= column);
        before.checked_sub(1).map_or(0.0, |last| changes[last].1.into())
    }
}

impl ShadedRows for DepthRows {
    type Pixel = f32;
    type Change = (u32, f32);

    const OTHER: f32 = 0.0;
    // Infinite, so that any comparison with a depth treats it as deeper.
    const DEEP: f32 = f32::INFINITY;

    #[inline]
    fn of_depth(&self, depth_um: f64) -> f32 {
        // A facet that counts as on the plane may be slightly above the layer's top.
        depth_um.max(0.0) as f32
    }

    #[inline]
    fn change(column: u32, depth_um: f32) -> (u32, f32) {
        (column, depth_um)
    }

    #[inline]
    fn rows_mut(&mut self) -> &mut RowLists<(u32, f32)> {
        &mut self.changes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_pieces_of_one_depth() {
        let mut rows = DepthRows::new(20);
        rows.changes.end_row();
        let changes = [(0, 5.0), (4, f32::INFINITY), (9, 7.0), (10, 0.0), (15, 3.0)];
        rows.changes.items_mut().extend(changes);
        rows.changes.end_row();
        assert_eq!(rows.parts(0).count(), 0);
        let deep = f64::INFINITY;
        let all = [(0, 4, 5.0), (4, 9, deep), (9, 10, 7.0), (10, 15, 0.0), (15, 20, 3.0)];
        let parts = all.iter().copied().filter(|(.., depth)| *depth > 0.0);
        assert_eq!(rows.parts(1).collect::<Vec<_>>(), parts.collect::<Vec<_>>());
        for start in 0..20 {
            for end in start + 1..=20 {
                let within =
                    all.iter().map(|&(from, to, depth)| (from.max(start), to.min(end), depth));
                let within: Vec<_> = within.filter(|(from, to, _)| from < to).collect();
                for mut read in [0, 1] {
                    let pieces = rows.pieces_from(1, &mut read, start, end);
                    assert_eq!(pieces.collect::<Vec<_>>(), within);
                }
            }
        }
        assert_eq!([3, 4, 12, 19].map(|column| rows.at(1, column)), [5.0, deep, 0.0, 3.0]);
    }
}
