//! Pockets: resin fills the black of the layers so far, and what can run off does, voxel by voxel.

use std::ops::Range;

use super::{Block, Frame, Limits, on_frame};

/// What becomes of resin in a pocket.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    /// It stays forever.
    Trap,
    /// It stays until the part is turned.
    Cup,
    /// It stays as long as the part is on the platform.
    Sealed,
}

/// Black that resin cannot run out of.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pocket {
    pub(crate) kind: Kind,
    pub(crate) layers: Range<usize>,
    /// The voxels in it.
    pub(crate) pixels: usize,
    pub(crate) mm3: f64,
    /// The largest of its areas in one layer.
    pub(crate) largest_area: usize,
    pub(crate) frame: Frame,
    /// True if it holds a square in no layer.
    pub(crate) is_speck: bool,
}

/// Resin in the black of the lowest layers.
struct Resin<'a> {
    block: &'a Block,
    /// Whether it runs off through the lowest layer, as where there is no platform.
    open_below: bool,
    layers: usize,
    wet: Vec<bool>,
}

impl<'a> Resin<'a> {
    fn new(block: &'a Block, open_below: bool) -> Self {
        Self { block, open_below, layers: 0, wet: vec![false; block.white.len()] }
    }

    /// Fills the next layer, so that resin stands as high as it, and lets all of them drain.
    fn fill(&mut self) {
        let layer = self.block.layer(self.layers);
        self.layers += 1;
        layer.clone().for_each(|voxel| self.wet[voxel] = !self.block.white[voxel]);
        let runs_off = |&voxel: &usize| {
            on_frame(self.block, voxel)
                || (self.open_below && self.layers == 1)
                || (self.layers > 1 && self.is_dry(self.block.below(voxel)))
        };
        let first = layer.filter(|&voxel| self.wet[voxel]).filter(runs_off).collect();
        self.drain(first);
    }

    /// Opens the highest layer.
    fn uncover(&mut self) {
        let highest = self.block.layer(self.layers - 1);
        self.drain(highest.filter(|&voxel| self.wet[voxel]).collect());
    }

    fn is_dry(&self, voxel: usize) -> bool {
        !self.block.white[voxel] && !self.wet[voxel]
    }

    /// Takes the resin from some voxels. All that touches a dry one runs off through it.
    fn drain(&mut self, mut dry: Vec<usize>) {
        dry.iter().for_each(|&voxel| self.wet[voxel] = false);
        while let Some(voxel) = dry.pop() {
            for beside in self.block.neighbours(voxel) {
                if self.wet[beside] {
                    self.wet[beside] = false;
                    dry.push(beside);
                }
            }
        }
    }
}

/// Returns the pockets, in the order of kinds and first voxels.
pub(crate) fn pockets(block: &Block, limits: &Limits) -> Vec<Pocket> {
    let (mut off, mut on) = (Resin::new(block, true), Resin::new(block, false));
    // All that was ever left wet: what runs dry is not filled again.
    let mut cupped = vec![false; block.white.len()];
    for layer in 0..block.size[2] {
        off.fill();
        on.fill();
        block.layer(layer).for_each(|voxel| cupped[voxel] = off.wet[voxel]);
    }
    off.uncover();
    on.uncover();
    let kinds: [(Kind, &dyn Fn(usize) -> bool); 3] = [
        (Kind::Trap, &|voxel| off.wet[voxel]),
        (Kind::Cup, &|voxel| cupped[voxel] && !off.wet[voxel]),
        (Kind::Sealed, &|voxel| on.wet[voxel] && !cupped[voxel]),
    ];
    let of_kind = |(kind, chosen): (Kind, &dyn Fn(usize) -> bool)| {
        let bodies = block.bodies(0..block.white.len(), chosen).into_iter();
        bodies.map(|body| pocket(block, limits, kind, &body)).collect::<Vec<_>>()
    };
    kinds.into_iter().flat_map(of_kind).collect()
}

/// Returns the voxels, by body, of holes: from the lowest layer to the frame or the highest layer.
pub(crate) fn holes(block: &Block) -> Vec<Vec<usize>> {
    let is_open =
        |&voxel: &usize| on_frame(block, voxel) || block.place(voxel)[2] + 1 == block.size[2];
    let bodies = block.bodies(0..block.white.len(), |voxel| !block.white[voxel]).into_iter();
    bodies.filter(|body| block.place(body[0])[2] == 0 && body.iter().any(is_open)).collect()
}

/// Returns the pockets that exist when black nearer than half of `drain_um` to white is taken away,
/// except pockets within a pocket.
pub(crate) fn narrow_pockets(block: &Block, limits: &Limits, drain_um: f64) -> Vec<Pocket> {
    let already = enclosed(block, |voxel| !block.white[voxel]).concat();
    let wide: Vec<bool> = (0..block.white.len())
        .map(|voxel| !block.white[voxel] && distance_um(block, voxel) >= drain_um / 2.0)
        .collect();
    let bodies = enclosed(block, |voxel| wide[voxel]);
    let narrow = bodies.iter().filter(|body| !already.contains(&body[0]));
    narrow.map(|body| pocket(block, limits, Kind::Trap, body)).collect()
}

/// Returns the bodies of chosen voxels that reach neither the frame nor the lowest or highest layer.
fn enclosed(block: &Block, chosen: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let is_outer = |&voxel: &usize| {
        let layer = block.place(voxel)[2];
        on_frame(block, voxel) || layer == 0 || layer + 1 == block.size[2]
    };
    let bodies = block.bodies(0..block.white.len(), chosen).into_iter();
    bodies.filter(|body| !body.iter().any(is_outer)).collect()
}

fn pocket(block: &Block, limits: &Limits, kind: Kind, body: &[usize]) -> Pocket {
    let layer_of = |voxel: &usize| block.place(*voxel)[2];
    let layers = layer_of(&body[0])..layer_of(body.last().unwrap()) + 1;
    let areas: Vec<usize> = layers
        .clone()
        .map(|layer| body.iter().filter(|voxel| layer_of(voxel) == layer).count())
        .collect();
    Pocket {
        kind,
        pixels: body.len(),
        mm3: layers.clone().zip(&areas).map(|(layer, &area)| block.mm3(layer, area)).sum(),
        largest_area: areas.into_iter().max().unwrap(),
        frame: Frame::around(block, body),
        is_speck: !block.hold_square(body, limits.rounding),
        layers,
    }
}

/// Returns the distance from a voxel's center to the center of the nearest white one.
fn distance_um(block: &Block, voxel: usize) -> f64 {
    let centre = |voxel: usize| {
        let [column, row, layer] = block.place(voxel);
        let below: f64 = block.thickness_um[..layer].iter().sum();
        let z = below + block.thickness_um[layer] / 2.0;
        [column as f64 * block.pitch_um[0], row as f64 * block.pitch_um[1], z]
    };
    let from = centre(voxel);
    let white = (0..block.white.len()).filter(|&other| block.white[other]).map(centre);
    let squares = white.map(|to| (0..3).map(|axis| (to[axis] - from[axis]).powi(2)).sum::<f64>());
    squares.fold(f64::INFINITY, f64::min).sqrt()
}
