//! Images in square tiles, most of which have one value, for example the dose away from all edges.

use std::ops::Range;

/// How an image is divided into tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TileGrid {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// The side of a tile; tiles at the right and at the bottom may reach beyond the image.
    pub(crate) side: usize,
}

/// A rectangle of pixels, which may reach beyond the image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PixelRectangle {
    pub(crate) columns: Range<isize>,
    pub(crate) rows: Range<isize>,
}

impl PixelRectangle {
    pub(crate) fn width(&self) -> usize {
        self.columns.len()
    }

    pub(crate) fn height(&self) -> usize {
        self.rows.len()
    }

    /// Returns the rectangle with a border around it.
    pub(crate) fn grown(&self, by: usize) -> Self {
        let by = by as isize;
        let grown = |range: &Range<isize>| range.start - by..range.end + by;
        Self { columns: grown(&self.columns), rows: grown(&self.rows) }
    }

    /// Returns the intersection of both rectangles.
    pub(crate) fn within(&self, other: &Self) -> Self {
        let common = |a: &Range<isize>, b: &Range<isize>| {
            let start = a.start.max(b.start);
            start..a.end.min(b.end).max(start)
        };
        Self {
            columns: common(&self.columns, &other.columns),
            rows: common(&self.rows, &other.rows),
        }
    }
}

impl TileGrid {
    pub(crate) fn across(&self) -> usize {
        self.width.div_ceil(self.side)
    }

    pub(crate) fn down(&self) -> usize {
        self.height.div_ceil(self.side)
    }

    pub(crate) fn tile_count(&self) -> usize {
        self.across() * self.down()
    }

    pub(crate) fn image(&self) -> PixelRectangle {
        PixelRectangle { columns: 0..self.width as isize, rows: 0..self.height as isize }
    }

    /// Returns the pixels of a tile that are in the image.
    pub(crate) fn tile(&self, tile: usize) -> PixelRectangle {
        let (row, column) = (tile / self.across() * self.side, tile % self.across() * self.side);
        let side = |from: usize| from as isize..(from + self.side) as isize;
        PixelRectangle { columns: side(column), rows: side(row) }.within(&self.image())
    }

    /// Returns the tiles that a rectangle meets.
    pub(crate) fn met(&self, rect: &PixelRectangle) -> impl Iterator<Item = usize> + use<> {
        let inside = rect.within(&self.image());
        let tiles = |range: Range<isize>| {
            range.start as usize / self.side..(range.end as usize).div_ceil(self.side)
        };
        let (rows, columns) = (tiles(inside.rows.clone()), tiles(inside.columns.clone()));
        let across = self.across();
        let is_empty = inside.rows.is_empty() || inside.columns.is_empty();
        let rows = if is_empty { 0..0 } else { rows };
        rows.flat_map(move |row| columns.clone().map(move |column| row * across + column))
    }
}

/// The values of a tile.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Tile<V> {
    Flat(V),
    /// The values row by row, each row `side` long, even if the tile reaches beyond the image.
    Dense(Box<[V]>),
}

/// An image in tiles.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tiled<V> {
    pub(crate) grid: TileGrid,
    pub(crate) tiles: Vec<Tile<V>>,
}

impl<V: Copy + PartialEq> Tiled<V> {
    pub(crate) fn flat(grid: TileGrid, value: V) -> Self {
        Self { grid, tiles: vec![Tile::Flat(value); grid.tile_count()] }
    }

    /// Returns the number of tiles that have several values.
    pub(crate) fn dense_count(&self) -> u64 {
        self.tiles.iter().filter(|tile| matches!(tile, Tile::Dense(_))).count() as u64
    }

    /// Creates an image from rows, which `row` writes one after the other.
    pub(crate) fn of_rows<E>(
        grid: TileGrid,
        outside: V,
        mut row: impl FnMut(usize, &mut [V]) -> Result<(), E>,
    ) -> Result<Self, E> {
        let stride = grid.across() * grid.side;
        let mut tiles = Vec::with_capacity(grid.tile_count());
        let mut band = vec![outside; stride * grid.side];
        for top in (0..grid.height).step_by(grid.side) {
            band.fill(outside);
            let rows = grid.side.min(grid.height - top);
            for (number, values) in band.chunks_exact_mut(stride).take(rows).enumerate() {
                row(top + number, &mut values[..grid.width])?;
            }
            for column in (0..stride).step_by(grid.side) {
                let inside = grid.side.min(grid.width - column);
                let first = band[column];
                let lines = || band.chunks_exact(stride).map(|line| &line[column..]);
                let is_flat =
                    lines().take(rows).all(|line| line[..inside].iter().all(|&v| v == first));
                tiles.push(if is_flat {
                    Tile::Flat(first)
                } else {
                    Tile::Dense(lines().flat_map(|line| &line[..grid.side]).copied().collect())
                });
            }
        }
        Ok(Self { grid, tiles })
    }

    /// Copies a rectangle, row by row into lines of `stride`; `outside` is the value beyond the
    /// image.
    pub(crate) fn copy(&self, rect: &PixelRectangle, outside: V, stride: usize, out: &mut [V]) {
        out.fill(outside);
        for tile in self.grid.met(rect) {
            let own = self.grid.tile(tile);
            let common = own.within(rect);
            let (from, to) = (own.columns.start, rect.columns.start);
            let columns = |start: isize| {
                let offset = |column: isize| (column - start) as usize;
                offset(common.columns.start)..offset(common.columns.end)
            };
            for row in common.rows.clone() {
                let line = &mut out[(row - rect.rows.start) as usize * stride..][columns(to)];
                match &self.tiles[tile] {
                    Tile::Flat(value) => line.fill(*value),
                    Tile::Dense(values) => {
                        let row = (row - own.rows.start) as usize * self.grid.side;
                        line.copy_from_slice(&values[row..][columns(from)]);
                    }
                }
            }
        }
    }

    /// Returns the value of all pixels of a rectangle, if they have one; `outside` is the value
    /// beyond the image.
    pub(crate) fn value_in(&self, rect: &PixelRectangle, outside: V) -> Option<V> {
        let beyond = rect.within(&self.grid.image()) != *rect;
        let mut value = beyond.then_some(outside);
        let mut is_one = |other: V| *value.get_or_insert(other) == other;
        for tile in self.grid.met(rect) {
            let own = self.grid.tile(tile);
            let common = own.within(rect);
            let same = match &self.tiles[tile] {
                Tile::Flat(value) => is_one(*value),
                Tile::Dense(values) => common.rows.clone().all(|row| {
                    let line = (row - own.rows.start) as usize * self.grid.side;
                    let columns = (common.columns.start - own.columns.start) as usize
                        ..(common.columns.end - own.columns.start) as usize;
                    values[line..][columns].iter().all(|&value| is_one(value))
                }),
            };
            if !same {
                return None;
            }
        }
        value
    }

    /// Calls `each` with the value and length of each stretch of a row within a tile, from the
    /// left.
    pub(crate) fn runs_of_row(&self, row: usize, mut each: impl FnMut(V, usize)) {
        let first = row / self.grid.side * self.grid.across();
        for tile in first..first + self.grid.across() {
            let own = self.grid.tile(tile);
            match &self.tiles[tile] {
                Tile::Flat(value) => each(*value, own.width()),
                Tile::Dense(values) => {
                    let line = (row - own.rows.start as usize) * self.grid.side;
                    let line = &values[line..line + own.width()];
                    line.chunk_by(PartialEq::eq).for_each(|run| each(run[0], run.len()));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: TileGrid = TileGrid { width: 20, height: 11, side: 8 };

    fn value(row: isize, column: isize) -> u8 {
        match (row, column) {
            (0..11, 0..20) if row >= 8 || column < 8 => 7,
            (0..11, 0..20) => (row * 20 + column) as u8,
            _ => 99,
        }
    }

    fn image() -> Tiled<u8> {
        Tiled::of_rows::<()>(GRID, 0, |row, values| {
            let columns = values.iter_mut().enumerate();
            columns.for_each(|(column, v)| *v = value(row as isize, column as isize));
            Ok(())
        })
        .unwrap()
    }

    #[test]
    fn tiles_of_one_value_are_flat_and_rectangles_are_as_they_were() {
        let image = image();
        let flat = image.tiles.iter().filter(|tile| **tile == Tile::Flat(7)).count();
        assert_eq!(flat, 4);
        for (columns, rows) in [(0..20, 0..11), (-3..23, -5..14), (5..17, 6..9), (30..40, 0..3)] {
            let rect = PixelRectangle { columns, rows };
            let mut out = vec![0; 40 * rect.height()];
            image.copy(&rect, 99, 40, &mut out);
            for row in rect.rows.clone() {
                for column in rect.columns.clone() {
                    let line = (row - rect.rows.start) as usize * 40;
                    let place = line + (column - rect.columns.start) as usize;
                    assert_eq!(out[place], value(row, column));
                }
            }
        }
    }

    #[test]
    fn a_rectangle_of_one_value_tells_it() {
        let image = image();
        let of = |columns, rows| image.value_in(&PixelRectangle { columns, rows }, 99);
        assert_eq!(of(0..20, 8..11), Some(7));
        assert_eq!(of(1..8, 0..11), Some(7));
        assert_eq!(of(1..9, 0..11), None);
        assert_eq!(of(-1..8, 0..11), None);
        assert_eq!(of(-9..-1, 0..11), Some(99));
        assert_eq!(of(9..10, 3..4), Some(69));
    }

    #[test]
    fn rows_are_told_in_runs() {
        let mut runs = Vec::new();
        image().runs_of_row(9, |value, length| runs.push((value, length)));
        assert_eq!(runs, [(7, 8), (7, 8), (7, 4)]);
    }
}
