//! A slow, obvious twin of `lamp check`: voxels in plain arrays, filled by flood, written
//! from the definitions in `docs/check.md` alone.
//!
//! Nothing here knows of runs, union-find or streams. Distances are searched, bodies are
//! filled and painted over, and hulls are wrapped.

mod balance;
mod islands;
mod overhangs;
mod pockets;

use std::fmt;
use std::ops::Range;

pub(crate) use balance::tilts;
pub(crate) use islands::{islands, weak_joints};
pub(crate) use overhangs::{Overhang, overhangs, patches};
pub(crate) use pockets::{Kind, holes, narrow_pockets, pockets};

/// A block of voxels: layer after layer from the bottom, each row after row from the top.
#[derive(Clone)]
pub(crate) struct Block {
    /// Columns, rows and layers.
    pub(crate) size: [usize; 3],
    /// True where cured.
    pub(crate) white: Vec<bool>,
    /// The width and the height of a pixel in µm.
    pub(crate) pitch_um: [f64; 2],
    /// The thickness of each layer in µm.
    pub(crate) thickness_um: Vec<f64>,
}

impl fmt::Debug for Block {
    /// Draws the layers side by side, the lowest at the left.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [columns, rows, layers] = self.size;
        for row in 0..rows {
            let line = |layer| {
                let sign =
                    |column| if self.white[self.at([column, row, layer])] { '#' } else { '.' };
                (0..columns).map(sign).collect::<String>()
            };
            writeln!(f, "{}", (0..layers).map(line).collect::<Vec<_>>().join(" "))?;
        }
        write!(f, "{:?} um thick, {:?} um wide and high", self.thickness_um, self.pitch_um)
    }
}

/// Limits of the findings.
#[derive(Clone, Debug)]
pub(crate) struct Limits {
    /// The side in columns of the square that more than a speck holds, and the number of layers that
    /// it floats for.
    pub(crate) speck: (usize, usize),
    /// The side in pixels of the square that any other finding holds.
    pub(crate) rounding: usize,
    /// The least part of a component's area that must be supported.
    pub(crate) least_support: f64,
    /// How far an overhang may reach, in µm; `None` for the layer's thickness.
    pub(crate) max_overhang_um: Option<f64>,
    /// The width of a drain in µm, if narrow drains are reported.
    pub(crate) drain_um: Option<f64>,
}

/// Columns and rows, half-open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Frame {
    pub(crate) columns: Range<usize>,
    pub(crate) rows: Range<usize>,
}

impl Frame {
    /// Returns the least frame that holds all of some voxels.
    fn around(block: &Block, voxels: &[usize]) -> Frame {
        let places = || voxels.iter().map(|&voxel| block.place(voxel));
        let span = |axis: usize| {
            let along = || places().map(|place| place[axis]);
            along().min().unwrap()..along().max().unwrap() + 1
        };
        Frame { columns: span(0), rows: span(1) }
    }
}

impl Block {
    /// Returns the column, row and layer of a voxel.
    pub(crate) fn place(&self, voxel: usize) -> [usize; 3] {
        let [columns, rows, _] = self.size;
        [voxel % columns, voxel / columns % rows, voxel / columns / rows]
    }

    /// Returns the index of the voxel in a column, row and layer.
    pub(crate) fn at(&self, [column, row, layer]: [usize; 3]) -> usize {
        let [columns, rows, _] = self.size;
        (layer * rows + row) * columns + column
    }

    /// Returns the voxels of a layer.
    fn layer(&self, layer: usize) -> Range<usize> {
        let area = self.size[0] * self.size[1];
        layer * area..(layer + 1) * area
    }

    /// Returns the voxel straight below one that is not in the bottom layer.
    fn below(&self, voxel: usize) -> usize {
        voxel - self.size[0] * self.size[1]
    }

    /// Returns the voxels that share a side with this one.
    fn neighbours(&self, voxel: usize) -> Vec<usize> {
        let place = self.place(voxel);
        let mut found = Vec::new();
        for axis in 0..3 {
            let mut beside = place;
            if place[axis] > 0 {
                beside[axis] = place[axis] - 1;
                found.push(self.at(beside));
            }
            if place[axis] + 1 < self.size[axis] {
                beside[axis] = place[axis] + 1;
                found.push(self.at(beside));
            }
        }
        found
    }

    /// Returns the sets of voxels in a range that satisfy `chosen` and touch by their sides,
    /// in the order of their first voxels. The voxels of each are sorted.
    fn bodies(&self, range: Range<usize>, chosen: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
        let mut seen = vec![false; self.white.len()];
        let mut found = Vec::new();
        for start in range.clone() {
            if seen[start] || !chosen(start) {
                continue;
            }
            seen[start] = true;
            let mut body = vec![start];
            let mut next = 0;
            while next < body.len() {
                for voxel in self.neighbours(body[next]) {
                    if range.contains(&voxel) && !seen[voxel] && chosen(voxel) {
                        seen[voxel] = true;
                        body.push(voxel);
                    }
                }
                next += 1;
            }
            body.sort_unstable();
            found.push(body);
        }
        found
    }

    /// Returns the white bodies of a layer by itself.
    fn components(&self, layer: usize) -> Vec<Vec<usize>> {
        self.bodies(self.layer(layer), |voxel| self.white[voxel])
    }

    /// Returns the length in µm of a number of columns, half a column less.
    pub(crate) fn just_below(&self, columns: usize) -> f64 {
        (columns as f64 - 0.5) * self.pitch_um[0]
    }

    /// Returns the columns and rows of a speck's square: the least number that is as wide and high.
    fn speck_sides(&self, limits: &Limits) -> [usize; 2] {
        let side = limits.speck.0;
        // Of no length, a pixel is as wide and high; of others, two are.
        let least = side.min(2);
        let length_um = if side == 1 { 0.0 } else { self.just_below(side) };
        self.pitch_um.map(|pitch_um| {
            (least..).find(|&pixels| pixels as f64 * pitch_um >= length_um * (1.0 - 1e-9)).unwrap()
        })
    }

    /// Returns true if some voxels, sorted, hold a full square of a layer's pixels.
    fn hold_square(&self, voxels: &[usize], side: usize) -> bool {
        self.hold_rectangle(voxels, [side; 2])
    }

    /// Returns true if some voxels, sorted, hold a full rectangle of columns and rows of a layer.
    fn hold_rectangle(&self, voxels: &[usize], [wide, high]: [usize; 2]) -> bool {
        let holds = |place: [usize; 3]| {
            place[0] < self.size[0]
                && place[1] < self.size[1]
                && voxels.binary_search(&self.at(place)).is_ok()
        };
        voxels.iter().any(|&voxel| {
            let [column, row, layer] = self.place(voxel);
            let mut pixels = (0..wide * high).map(|i| [column + i % wide, row + i / wide, layer]);
            pixels.all(holds)
        })
    }

    /// Returns the mean of the centers of some pixels: column and row.
    fn centroid(&self, voxels: &[usize]) -> [f64; 2] {
        [0, 1].map(|axis| {
            let sum: f64 = voxels.iter().map(|&voxel| self.place(voxel)[axis] as f64 + 0.5).sum();
            sum / voxels.len() as f64
        })
    }

    /// Returns the volume in mm³ of some pixels of a layer.
    fn mm3(&self, layer: usize, pixels: usize) -> f64 {
        pixels as f64 * self.pitch_um[0] * self.pitch_um[1] * self.thickness_um[layer] * 1e-9
    }
}

/// Returns the runs of layers without white.
pub(crate) fn empty_layers(block: &Block) -> Vec<Range<usize>> {
    let is_empty = |layer: &usize| block.layer(*layer).all(|voxel| !block.white[voxel]);
    runs((0..block.size[2]).filter(is_empty))
}

/// Returns the runs of layers with white in the first or last column or row.
pub(crate) fn border_layers(block: &Block) -> Vec<Range<usize>> {
    let at_border = |layer: &usize| {
        block.layer(*layer).any(|voxel| block.white[voxel] && on_frame(block, voxel))
    };
    runs((0..block.size[2]).filter(at_border))
}

/// Returns true if a voxel lies in the first or last column or row.
fn on_frame(block: &Block, voxel: usize) -> bool {
    let place = block.place(voxel);
    [0, 1].iter().any(|&axis| place[axis] == 0 || place[axis] + 1 == block.size[axis])
}

fn runs(layers: impl Iterator<Item = usize>) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for layer in layers {
        match runs.last_mut() {
            Some(run) if run.end == layer => run.end += 1,
            _ => runs.push(layer..layer + 1),
        }
    }
    runs
}
