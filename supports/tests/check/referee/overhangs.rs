//! Overhangs: for each pixel, the nearest white of the layer below is searched ring by ring.

use std::collections::BTreeMap;
use std::ops::Range;

use super::{Block, Frame, Limits};

/// Pixels of one layer that lie too far from the white below them and touch.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Patch {
    pub(crate) layer: usize,
    pub(crate) area: usize,
    /// The distance of the pixel that is farthest from the white below, in µm.
    pub(crate) reach_um: f64,
    pub(crate) frame: Frame,
    pub(crate) is_speck: bool,
}

/// Patches of layers that follow each other, specks left out.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Overhang {
    pub(crate) layers: Range<usize>,
    pub(crate) area: usize,
    pub(crate) reach_um: f64,
    /// The first layer with that reach.
    pub(crate) reach_layer: usize,
    pub(crate) frame: Frame,
}

/// Returns all patches, in the order of layers and first pixels.
pub(crate) fn patches(block: &Block, limits: &Limits) -> Vec<Patch> {
    let mut found = Vec::new();
    for layer in 1..block.size[2] {
        let limit = most_um(block, limits, layer);
        let mut reach_um: BTreeMap<usize, f64> = BTreeMap::new();
        for component in block.components(layer) {
            let supported = component.iter().any(|&voxel| block.white[block.below(voxel)]);
            for voxel in component.into_iter().filter(|_| supported) {
                let reach = distance_um(block, voxel);
                if reach > limit {
                    reach_um.insert(voxel, reach);
                }
            }
        }
        for patch in block.bodies(block.layer(layer), |voxel| reach_um.contains_key(&voxel)) {
            found.push(Patch {
                layer,
                area: patch.len(),
                reach_um: patch.iter().map(|voxel| reach_um[voxel]).fold(0.0, f64::max),
                frame: Frame::around(block, &patch),
                is_speck: !block.hold_square(&patch, limits.rounding),
            });
        }
    }
    found
}

/// Returns how far white of a layer may be from the white below.
fn most_um(block: &Block, limits: &Limits, layer: usize) -> f64 {
    limits.max_overhang_um.unwrap_or(block.thickness_um[layer])
}

/// Returns the distance from a pixel's center to the center of the nearest white one in the layer
/// below, which must have one.
fn distance_um(block: &Block, voxel: usize) -> f64 {
    let [column, row, layer] = block.place(voxel).map(|at| at as isize);
    let [wide, high] = block.pitch_um;
    let mut least = f64::INFINITY;
    let mut ring = 0_isize;
    // Pixels of a ring are at least as far as its number of shorter sides.
    while ring as f64 * wide.min(high) < least {
        for (across, down) in (-ring..=ring).flat_map(|a| (-ring..=ring).map(move |d| (a, d))) {
            if across.abs().max(down.abs()) == ring
                && is_white(block, [column + across, row + down, layer - 1])
            {
                least = least.min((across as f64 * wide).hypot(down as f64 * high));
            }
        }
        ring += 1;
    }
    least
}

fn is_white(block: &Block, place: [isize; 3]) -> bool {
    let inside = (0..3).all(|axis| (0..block.size[axis] as isize).contains(&place[axis]));
    inside && block.white[block.at(place.map(|at| at as usize))]
}

/// Returns overhangs in the order of their first patches.
pub(crate) fn overhangs(block: &Block, limits: &Limits) -> Vec<Overhang> {
    let patches: Vec<Patch> =
        patches(block, limits).into_iter().filter(|patch| !patch.is_speck).collect();
    // Every patch takes the least number among those it is linked to, until none changes.
    let mut numbers: Vec<usize> = (0..patches.len()).collect();
    loop {
        let mut changed = false;
        for (i, upper) in patches.iter().enumerate() {
            for (j, lower) in patches.iter().enumerate() {
                if continues(block, limits, lower, upper) && numbers[i] != numbers[j] {
                    let least = numbers[i].min(numbers[j]);
                    (numbers[i], numbers[j], changed) = (least, least, true);
                }
            }
        }
        if !changed {
            break;
        }
    }
    let gathered = (0..patches.len()).map(|number| {
        patches.iter().zip(&numbers).filter(move |(_, of)| **of == number).map(|(patch, _)| patch)
    });
    gathered.filter_map(|patches| joined(&patches.collect::<Vec<_>>())).collect()
}

/// Returns true if a patch lies in the layer above another's, next to it.
fn continues(block: &Block, limits: &Limits, lower: &Patch, upper: &Patch) -> bool {
    if upper.layer != lower.layer + 1 {
        return false;
    }
    let most = most_um(block, limits, upper.layer);
    let meets = |a: &Range<usize>, b: &Range<usize>, side_um: f64| {
        let grown = (most / side_um).ceil() as usize + 1;
        a.start < b.end + grown && b.start < a.end + grown
    };
    let [wide, high] = block.pitch_um;
    meets(&lower.frame.columns, &upper.frame.columns, wide)
        && meets(&lower.frame.rows, &upper.frame.rows, high)
}

fn joined(patches: &[&Patch]) -> Option<Overhang> {
    let first = patches.first()?;
    let hull = |side: fn(&Frame) -> &Range<usize>| {
        let sides = || patches.iter().map(|patch| side(&patch.frame));
        sides().map(|s| s.start).min().unwrap()..sides().map(|s| s.end).max().unwrap()
    };
    let reach_um = patches.iter().map(|patch| patch.reach_um).fold(0.0, f64::max);
    Some(Overhang {
        layers: first.layer..patches.last()?.layer + 1,
        area: patches.iter().map(|patch| patch.area).sum(),
        reach_um,
        reach_layer: patches.iter().find(|patch| patch.reach_um == reach_um)?.layer,
        frame: Frame { columns: hull(|frame| &frame.columns), rows: hull(|frame| &frame.rows) },
    })
}
