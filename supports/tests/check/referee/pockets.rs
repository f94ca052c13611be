//! Pockets: the black of all layers is filled from every voxel that was not yet reached.

use std::ops::Range;

use super::{Block, Frame, Limits, on_frame};

/// Where resin in a pocket could get out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    /// Nowhere.
    Trap,
    /// At the top only.
    Cup,
    /// At the bottom only, where the platform is.
    Sealed,
}

/// Black without a way to the frame.
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

/// Returns the pockets in the order of their first voxels.
pub(crate) fn pockets(block: &Block, limits: &Limits) -> Vec<Pocket> {
    let bodies = enclosed(block, |voxel| !block.white[voxel]);
    bodies.iter().map(|body| pocket(block, limits, body)).collect()
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
    narrow.map(|body| pocket(block, limits, body)).collect()
}

/// Returns the bodies of chosen voxels that do not reach the frame.
fn enclosed(block: &Block, chosen: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let bodies = block.bodies(0..block.white.len(), chosen).into_iter();
    bodies.filter(|body| !body.iter().any(|&voxel| on_frame(block, voxel))).collect()
}

fn pocket(block: &Block, limits: &Limits, body: &[usize]) -> Pocket {
    let layer_of = |voxel: &usize| block.place(*voxel)[2];
    let layers = layer_of(&body[0])..layer_of(body.last().unwrap()) + 1;
    let areas: Vec<usize> = layers
        .clone()
        .map(|layer| body.iter().filter(|voxel| layer_of(voxel) == layer).count())
        .collect();
    let kind = match (layers.start, layers.end) {
        (0, _) => Kind::Sealed,
        (_, end) if end == block.size[2] => Kind::Cup,
        _ => Kind::Trap,
    };
    Pocket {
        kind,
        pixels: body.len(),
        mm3: layers.clone().zip(&areas).map(|(layer, &area)| block.mm3(layer, area)).sum(),
        largest_area: areas.into_iter().max().unwrap(),
        frame: Frame::around(block, body),
        is_speck: !block.hold_square(body, limits.speck),
        layers,
    }
}

/// Returns the distance from a voxel's center to the center of the nearest white one.
fn distance_um(block: &Block, voxel: usize) -> f64 {
    let centre = |voxel: usize| {
        let [column, row, layer] = block.place(voxel);
        let below: f64 = block.thickness_um[..layer].iter().sum();
        let z = below + block.thickness_um[layer] / 2.0;
        [column as f64 * block.pitch_um, row as f64 * block.pitch_um, z]
    };
    let from = centre(voxel);
    let white = (0..block.white.len()).filter(|&other| block.white[other]).map(centre);
    let squares = white.map(|to| (0..3).map(|axis| (to[axis] - from[axis]).powi(2)).sum::<f64>());
    squares.fold(f64::INFINITY, f64::min).sqrt()
}
