//! Views of a whole stack from above, from the front and from the right.

use std::ops::Range;

use lamp_stack::{Image, PageInfo};

use crate::picture::Picture;

/// The longer side of a view, in pixels.
const SIDE: u32 = 480;
/// The gray of the farthest pixels; the nearest are white.
const FARTHEST: f64 = 70.0;

/// Divides images of one size into square cells, as the views show them.
#[derive(Clone, Copy, Debug)]
pub struct ViewGrid {
    size_px: [u32; 2],
    /// Columns of the image to a cell, and rows.
    cell_px: [f64; 2],
    cells: [usize; 2],
}

impl ViewGrid {
    /// A grid for images of a width and a height, whose pixels are `aspect` widths high.
    pub fn new(size_px: [u32; 2], aspect: f64) -> Self {
        let [width, height] = size_px.map(f64::from);
        let across = (width.max(height * aspect) / f64::from(SIDE)).max(1.0);
        let cell_px = [across, (across / aspect).max(f64::MIN_POSITIVE)];
        let cells = [0, 1].map(|axis| (f64::from(size_px[axis]) / cell_px[axis]).ceil() as usize);
        Self { size_px, cell_px, cells }
    }

    /// Returns the cells that a layer exposes, row by row from the top; `None` if its image has
    /// another size.
    pub fn exposed(&self, image: &Image) -> Option<Vec<bool>> {
        if self.size_px != [image.width(), image.height()] {
            return None;
        }
        let [wide, _] = self.cells;
        let mut exposed = vec![false; wide * self.cells[1]];
        for row in 0..image.height() {
            let cells = &mut exposed[self.cell(1, row) * wide..][..wide];
            for (start, end, _) in image.runs(row) {
                cells[self.cell(0, start)..=self.cell(0, end - 1)].fill(true);
            }
        }
        Some(exposed)
    }

    fn cell(&self, axis: usize, pixel: u32) -> usize {
        ((f64::from(pixel) / self.cell_px[axis]) as usize).min(self.cells[axis] - 1)
    }
}

/// Views of a stack, the brighter the nearer. Layers are added from the bottom.
#[derive(Debug)]
pub struct StackViews {
    grid: ViewGrid,
    /// The side of a cell; `None` if the resolution is not known.
    cell_um: Option<f64>,
    /// Of each cell, the number of layers up to the highest that exposes it.
    above: Vec<usize>,
    /// Of each layer and column of cells, the rows up to the nearest; of each layer and row, the
    /// columns up to the nearest.
    beside: [Vec<Vec<usize>>; 2],
    /// The height at the bottom and the top of each layer.
    heights_um: Vec<Range<f64>>,
}

impl StackViews {
    /// Begins the views of a stack, whose columns are `pitch_um` wide.
    pub fn new(grid: ViewGrid, pitch_um: Option<f64>) -> Self {
        let cell_um = pitch_um.map(|pitch| pitch * grid.cell_px[0]);
        let above = vec![0; grid.cells[0] * grid.cells[1]];
        Self { grid, cell_um, above, beside: [Vec::new(), Vec::new()], heights_um: Vec::new() }
    }

    /// Adds a layer, by the cells that it exposes.
    pub fn add(&mut self, info: &PageInfo, exposed: &[bool]) {
        let [wide, high] = self.grid.cells;
        let number = self.heights_um.len() + 1;
        let (mut front, mut right) = (vec![0; wide], vec![0; high]);
        for (row, cells) in exposed.chunks_exact(wide).enumerate() {
            for (column, _) in cells.iter().enumerate().filter(|(_, exposed)| **exposed) {
                self.above[row * wide + column] = number;
                // The last row is the nearest to the front, and the last column to the right.
                (front[column], right[row]) = (row + 1, column + 1);
            }
        }
        self.beside[0].push(front);
        self.beside[1].push(right);
        let last = self.heights_um.last().map_or(0.0, |heights| heights.end);
        // Without a height, a layer is as high as a cell.
        let thickness = info.thickness_um.or(self.cell_um).unwrap_or(1.0);
        let bottom = info.z_um.filter(|z_um| *z_um >= last).unwrap_or(last);
        self.heights_um.push(bottom..bottom + thickness);
    }

    /// The stack from above, the first row at the top.
    pub fn above(&self) -> Picture<'_> {
        let [wide, high] = self.grid.cells;
        let count = self.heights_um.len();
        let row = move |cells: &[usize]| cells.iter().map(|&near| shade(near, count)).collect();
        Picture::from_rows(wide as u32, high as u32, self.above.chunks_exact(wide).map(row))
    }

    /// The stack from the front, where the last row of images is.
    pub fn front(&self) -> Picture<'_> {
        self.side(0, false)
    }

    /// The stack from the right, the last row of images at the left.
    pub fn right(&self) -> Picture<'_> {
        self.side(1, true)
    }

    fn side(&self, axis: usize, is_reversed: bool) -> Picture<'_> {
        let [wide, far] = [self.grid.cells[axis], self.grid.cells[1 - axis]];
        let cell_um = self.cell_um.unwrap_or(1.0);
        let bottom_um = self.heights_um.first().map_or(0.0, |heights| heights.start);
        let top_um = self.heights_um.last().map_or(0.0, |heights| heights.end);
        let high = ((top_um - bottom_um) / cell_um).ceil().clamp(1.0, f64::from(4 * SIDE)) as usize;
        let step_um = (top_um - bottom_um) / high as f64;
        let rows = (0..high).map(move |row| {
            let z = |edge: usize| top_um - edge as f64 * step_um;
            let (low, top) = (z(row + 1), z(row));
            // All layers that share the row: a thin one must show.
            let begin = self.heights_um.partition_point(|heights| heights.end <= low);
            let end = self.heights_um.partition_point(|heights| heights.start < top);
            let mut nearest = vec![0; wide];
            for layer in self.beside[axis].get(begin..end).unwrap_or_default() {
                nearest.iter_mut().zip(layer).for_each(|(all, &one)| *all = one.max(*all));
            }
            if is_reversed {
                nearest.reverse();
            }
            nearest.into_iter().map(|near| shade(near, far)).collect()
        });
        Picture::from_rows(wide as u32, high as u32, rows)
    }
}

/// Returns the gray of a distance: black for nothing, white for the nearest.
fn shade(near: usize, most: usize) -> u8 {
    match near {
        0 => 0,
        near => (FARTHEST + (255.0 - FARTHEST) * near as f64 / most.max(1) as f64).round() as u8,
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Mask;

    use super::*;

    /// Stairs of three steps that rise to the right, in images of 6 x 4 pixels: a row is free at the
    /// front.
    fn stairs() -> StackViews {
        let grid = ViewGrid::new([6, 4], 1.0);
        let mut views = StackViews::new(grid, Some(100.0));
        for index in 0..3u32 {
            let row = [2 * index, 6];
            let transitions: Vec<u32> = (0..3).flat_map(|_| row).filter(|&at| at < 6).collect();
            let each = transitions.len() as u32 / 3;
            let ends = (0..=3).map(|row| row * each).chain([3 * each]).collect();
            let image: Image = Mask::new(6, ends, transitions).unwrap().into();
            let info = PageInfo {
                index,
                z_um: Some(100.0 * f64::from(index)),
                thickness_um: Some(100.0),
                ..PageInfo::default()
            };
            views.add(&info, &grid.exposed(&image).unwrap());
        }
        views
    }

    fn rows(picture: Picture<'_>) -> Vec<Vec<u8>> {
        picture.into_rows().collect()
    }

    #[test]
    fn stairs_are_seen_from_three_sides() {
        let views = stairs();
        let [low, middle] = [1, 2].map(|near| shade(near, 3));
        let steps = vec![low, low, middle, middle, 255, 255];
        assert_eq!(rows(views.above()), [steps.clone(), steps.clone(), steps, vec![0; 6]]);
        // A row is free in front of them.
        let near = shade(3, 4);
        let front: Vec<Vec<u8>> = (0..3)
            .map(|row| (0..6).map(|column| if column >= 4 - 2 * row { near } else { 0 }).collect())
            .collect();
        assert_eq!(rows(views.front()), front);
        assert_eq!(rows(views.right()), vec![vec![0, 255, 255, 255]; 3]);
    }

    #[test]
    fn a_view_has_a_pixel_for_many_and_every_pixel_shows() {
        let grid = ViewGrid::new([10_000, 5_000], 2.0);
        assert_eq!(grid.cells, [480, 480]);
        let mut ends = vec![0; 5_001];
        ends[5_000] = 2;
        let image: Image = Mask::new(10_000, ends, vec![9_998, 9_999]).unwrap().into();
        let exposed = grid.exposed(&image).unwrap();
        let shown: Vec<_> = (0..exposed.len()).filter(|&cell| exposed[cell]).collect();
        assert_eq!(shown, [480 * 480 - 1]);
        let other: Image = Mask::new(3, vec![0, 0], Vec::new()).unwrap().into();
        assert!(grid.exposed(&other).is_none());
    }

    #[test]
    fn thin_layers_share_a_row_and_thick_ones_take_several() {
        let grid = ViewGrid::new([2, 2], 1.0);
        let mut views = StackViews::new(grid, Some(100.0));
        for (index, um) in (0..).zip([10.0, 10.0, 10.0, 300.0]) {
            let info = PageInfo { index, thickness_um: Some(um), ..PageInfo::default() };
            views.add(&info, &[index == 1, false, index == 3, false]);
        }
        // 330 um are four cells.
        assert_eq!(
            rows(views.front()),
            vec![vec![255, 0]; 3].into_iter().chain([vec![255, 0]]).collect::<Vec<_>>()
        );
        assert_eq!(rows(views.right())[3], [255 - 92, 255 - 92]);
        let empty = StackViews::new(grid, None);
        assert_eq!(rows(empty.front()), [[0, 0]]);
    }
}
