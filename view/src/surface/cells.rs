//! Divides a stack into cells.

use std::borrow::Borrow;
use std::num::NonZeroU32;

use lamp_stack::{Layer, Length, MemorySize, PageHeader, map_in_order};

use super::nets::Nets;
use super::planes::{OpenPlanes, plane_of};
use super::scale::StackScale;
use super::{StackSurface, SurfaceError, SurfaceUnit};

/// The most cells along the longest side.
pub const MAX_CELLS: u32 = 1024;

/// The fineness of a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceOptions {
    /// About how many cells there are along the longest side, at most [`MAX_CELLS`]. A cell is a
    /// whole number of pixels wide.
    pub cells: NonZeroU32,
    /// The most layers read in each cell, evenly spread; `None` reads all.
    pub layers_a_cell: Option<NonZeroU32>,
    /// How many triangles the surface may have.
    pub max_triangles: usize,
}

impl Default for SurfaceOptions {
    /// The viewer's surface.
    fn default() -> Self {
        let number = |number| NonZeroU32::new(number).expect("it is not zero");
        Self { cells: number(256), layers_a_cell: Some(number(2)), max_triangles: 4_000_000 }
    }
}

/// A stack as cubic cells.
#[derive(Debug)]
pub struct CellGrid {
    scale: StackScale,
    /// The width and height of the largest image.
    size: [u32; 2],
    /// The width of a cell, in pixels.
    side: NonZeroU32,
    /// The number of cells along x, y and z.
    counts: [u32; 3],
    shares: Vec<CellContribution>,
    max_triangles: usize,
}

/// A layer's contribution to cells.
#[derive(Clone, Debug)]
struct CellContribution {
    position: usize,
    index: u32,
    /// The memory that the layer takes, roughly.
    bytes: usize,
    /// The lowest plane of cells that the layer reaches into.
    first: u32,
    /// The layer's share in the height of that plane, and of those above it.
    weights: Vec<f32>,
}

impl MemorySize for CellContribution {
    fn bytes(&self) -> usize {
        self.bytes
    }
}

impl CellGrid {
    /// Divides a stack into cells by what its pages say.
    ///
    /// # Errors
    /// Returns an error if layers do not lie above each other.
    ///
    /// # Panics
    /// Panics if there are no pages.
    pub fn new(pages: &[PageHeader], options: &SurfaceOptions) -> Result<Self, SurfaceError> {
        let size = [0, 1].map(|axis| pages.iter().map(|page| page.size[axis]).max().unwrap_or(0));
        let scale = StackScale::of(pages, size[1])?;
        let [bottom, _] = scale.heights[0];
        let [_, top] = scale.heights[pages.len() - 1];
        let height = (top - bottom) / scale.short_side();
        let longest = size.map(f64::from).into_iter().fold(height, f64::max);
        let cells = options.cells.get().min(MAX_CELLS);
        let side = (longest / f64::from(cells)).round().max(1.0) as u32;
        let side = NonZeroU32::new(side).expect("it is at least one");
        // Rounding must not add a plane.
        let planes = (height / f64::from(side.get()) - 1e-6).ceil().max(1.0) as u32;
        let [columns, rows] = size.map(|pixels| pixels.div_ceil(side.get()).max(1));
        let mut grid = Self {
            scale,
            size,
            side,
            counts: [columns, rows, planes],
            shares: Vec::new(),
            max_triangles: options.max_triangles,
        };
        grid.share_out(pages, options.layers_a_cell);
        Ok(grid)
    }

    /// Returns the shortest side of a cell, if the stack states its resolution.
    pub fn cell(&self) -> Option<Length> {
        let side = Length::from_mm(self.scale.short_side() * f64::from(self.side.get()));
        (self.scale.unit == SurfaceUnit::Millimetres).then_some(side)
    }

    /// Returns the number of layers that the surface reads.
    pub fn layers(&self) -> usize {
        self.shares.len()
    }

    /// Computes the share of each layer in the planes of cells.
    fn share_out(&mut self, pages: &[PageHeader], at_most: Option<NonZeroU32>) {
        let cell = self.scale.short_side() * f64::from(self.side.get());
        let heights = &self.scale.heights;
        let start = heights[0][0];
        // Layers and planes both go up, so one pass over the layers finds all pairs.
        let mut lowest = 0;
        for plane in 0..self.counts[2] {
            let [from, to] = [plane, plane + 1].map(|k| start + f64::from(k) * cell);
            lowest += heights[lowest..].iter().take_while(|[_, top]| *top <= from).count();
            let within = heights[lowest..].iter().take_while(|[bottom, _]| *bottom < to);
            let weight = |[bottom, top]: &[f64; 2]| (top.min(to) - bottom.max(from)) / cell;
            let weights: Vec<f64> = within.map(weight).collect();
            for (above, weight) in thinned(&weights, at_most) {
                let position = lowest + above;
                match self.shares.last_mut() {
                    // A layer at the border of planes adds to both, and is read once.
                    Some(share) if share.position == position => share.weights.push(weight),
                    _ => self.shares.push(CellContribution::new(
                        position,
                        &pages[position],
                        plane,
                        weight,
                    )),
                }
            }
        }
    }

    /// Makes the surface, given how to read a layer by its position in the stack. Layers are read
    /// on all threads of the current pool; an error of one ends the work.
    ///
    /// # Errors
    /// Returns the error of a layer, or an error if there is no surface, or too much of it.
    pub fn surface<L, E>(
        &self,
        read: impl Fn(usize) -> Result<L, E> + Sync,
    ) -> Result<StackSurface, E>
    where
        L: Borrow<Layer>,
        E: From<SurfaceError> + Send,
    {
        let [columns, rows, _] = self.counts;
        let mut planes = OpenPlanes::new(columns as usize * rows as usize);
        let mut nets = Nets::new([columns, rows], self.max_triangles);
        let plane = |share: CellContribution| {
            let layer = read(share.position)?;
            let image = &layer.borrow().image;
            if image.width() > self.size[0] || image.height() > self.size[1] {
                return Err(E::from(SurfaceError::Grown { layer: share.index }));
            }
            let plane = plane_of(image, self.side, [columns, rows]);
            Ok((share, plane))
        };
        for found in map_in_order(self.shares.iter().cloned().map(Ok), plane) {
            let (share, plane) = found?;
            planes.finish_below(share.first, |levels| nets.push(levels))?;
            planes.add(share.first, &share.weights, &plane);
        }
        planes.finish_below(self.counts[2], |levels| nets.push(levels))?;
        let surface = nets.finish(|place| self.place(place), self.scale.unit)?;
        match surface.triangles.is_empty() {
            true => Err(SurfaceError::Nothing { cell: self.cell() }.into()),
            false => Ok(surface),
        }
    }

    /// Returns part coordinates of a place given in cells from the top left corner of the first
    /// layer.
    fn place(&self, [x, y, z]: [f64; 3]) -> [f32; 3] {
        let [pitch_x, pitch_y] = self.scale.pitch;
        let [width, depth, height] = [pitch_x, pitch_y, self.scale.short_side()]
            .map(|pitch| pitch * f64::from(self.side.get()));
        let [left, back] = self.scale.corner;
        let [bottom, _] = self.scale.heights[0];
        [left + x * width, back - y * depth, bottom + z * height].map(|place| place as f32)
    }
}

impl CellContribution {
    fn new(position: usize, page: &PageHeader, first: u32, weight: f32) -> Self {
        // As in `ViewedStack::expected_bytes`: four bytes a transition, whose code takes a
        // quarter of a byte.
        let bytes = 16 * page.data_bytes as usize + 4 * page.size[1] as usize;
        Self { position, index: page.info.index, bytes, first, weights: vec![weight] }
    }
}

/// Returns the weights of layers in a cell with their places, at most so many of them, evenly
/// spread, which then represent all.
fn thinned(
    weights: &[f64],
    at_most: Option<NonZeroU32>,
) -> impl Iterator<Item = (usize, f32)> + use<'_> {
    let count = weights.len();
    let kept = at_most.map_or(count, |most| count.min(most.get() as usize));
    let shared = weights.iter().sum::<f64>() / kept as f64;
    (0..kept).map(move |k| {
        // The middle of each of `kept` equal pieces.
        let place = (2 * k + 1) * count / (2 * kept);
        (place, if kept == count { weights[place] } else { shared } as f32)
    })
}
