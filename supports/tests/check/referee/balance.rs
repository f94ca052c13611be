//! Centers of gravity outside the hull of white on the platform.

use super::islands::Growth;
use super::{Block, Frame};

/// A body whose center of gravity is not above its base as it grows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tilt {
    /// The frame of all that the body, when done, has in layer 0.
    pub(crate) base: Frame,
    /// The first layer in which it, or what it later joins, leans.
    pub(crate) layer: usize,
    /// How far the center of gravity ever is from the base, in µm.
    pub(crate) farthest_um: f64,
}

/// Returns the bodies that lean, in the order of their first pixels.
pub(crate) fn tilts(block: &Block) -> Vec<Tilt> {
    let mut growth = Growth::new(block);
    // For each birth, the first layer in which it leans, and the farthest.
    let mut leans: Vec<Option<(usize, f64)>> = Vec::new();
    let mut weights: Vec<Weight> = Vec::new();
    for layer in 0..block.size[2] {
        growth.grow(layer);
        leans.resize(growth.births.len(), None);
        weights.resize(growth.births.len(), Weight::default());
        for voxel in block.layer(layer) {
            if let Some(name) = growth.names[voxel] {
                weights[name] = weights[name].with(Weight::of(block, voxel));
            }
        }
        for (body, lean) in leans.iter_mut().enumerate() {
            if growth.stands(body) && growth.is_eldest(body) {
                let off_um = off_base(&growth, &weights, body);
                // Less is what rounding leaves of zero.
                if off_um > 1e-6 {
                    let (first, farthest_um) = lean.unwrap_or((layer, 0.0));
                    *lean = Some((first, off_um.max(farthest_um)));
                }
            }
        }
    }
    let standing =
        (0..leans.len()).filter(|&birth| growth.stands(birth) && growth.is_eldest(birth));
    let tilt = |body: usize| {
        let joined = (0..leans.len()).filter(|&birth| growth.name(birth) == body);
        let leans: Vec<(usize, f64)> = joined.filter_map(|birth| leans[birth]).collect();
        let base: Vec<usize> =
            block.layer(0).filter(|&voxel| growth.names[voxel] == Some(body)).collect();
        Some(Tilt {
            base: Frame::around(block, &base),
            layer: leans.iter().map(|lean| lean.0).min()?,
            farthest_um: leans.iter().map(|lean| lean.1).fold(0.0, f64::max),
        })
    };
    standing.filter_map(tilt).collect()
}

/// The sum of some voxels' thicknesses, and those times their columns and rows.
#[derive(Clone, Copy, Default)]
struct Weight([f64; 3]);

impl Weight {
    fn of(block: &Block, voxel: usize) -> Self {
        let [column, row, layer] = block.place(voxel);
        Self([1.0, column as f64 + 0.5, row as f64 + 0.5].map(|at| at * block.thickness_um[layer]))
    }

    fn with(self, other: Self) -> Self {
        Self([0, 1, 2].map(|k| self.0[k] + other.0[k]))
    }
}

/// Returns the distance of a body's center of gravity from its base, in µm; zero within it.
/// Weights are the weights that births had while they were the eldest of their bodies.
fn off_base(growth: &Growth, weights: &[Weight], body: usize) -> f64 {
    let block = growth.block;
    let its = (0..weights.len()).filter(|&birth| growth.name(birth) == body);
    let Weight([mass, x, y]) =
        its.map(|birth| weights[birth]).fold(Weight::default(), Weight::with);
    let base = block.layer(0).filter(|&voxel| growth.names[voxel] == Some(body));
    let [wide, high] = block.pitch_um;
    let corners: Vec<[f64; 2]> = base
        .flat_map(|voxel| {
            let [column, row, _] = block.place(voxel);
            (0..4).map(move |i| [(column + i % 2) as f64 * wide, (row + i / 2) as f64 * high])
        })
        .collect();
    outside(&hull(&corners), [x / mass * wide, y / mass * high])
}

/// Returns the corners of the convex hull, by wrapping: each is followed by the one that has
/// all others on one side.
fn hull(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let start = points.iter().copied().reduce(|a, b| if b < a { b } else { a }).unwrap();
    let mut hull = vec![start];
    loop {
        let from = hull[hull.len() - 1];
        let mut next = from;
        for &point in points {
            let turn = cross(from, next, point);
            if next == from || turn < 0.0 || (turn == 0.0 && apart(from, point) > apart(from, next))
            {
                next = point;
            }
        }
        if next == start {
            return hull;
        }
        hull.push(next);
    }
}

/// Returns the distance of a point from a hull, or zero within it.
fn outside(hull: &[[f64; 2]], point: [f64; 2]) -> f64 {
    let sides = || (0..hull.len()).map(|i| (hull[i], hull[(i + 1) % hull.len()]));
    if sides().all(|(a, b)| cross(a, b, point) >= 0.0) {
        return 0.0;
    }
    sides().map(|(a, b)| from_side(a, b, point)).fold(f64::INFINITY, f64::min)
}

fn from_side(a: [f64; 2], b: [f64; 2], point: [f64; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let there = (point[0] - a[0]) * along[0] + (point[1] - a[1]) * along[1];
    let part = (there / apart(a, b).powi(2)).clamp(0.0, 1.0);
    apart(point, [a[0] + part * along[0], a[1] + part * along[1]])
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Returns a positive number if `c` lies on the side of the line from `a` to `b` that hulls
/// have inside.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}
