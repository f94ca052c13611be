//! Centres of gravity beside the hull of what stands on the platform.

use super::islands::Growth;
use super::{Block, Frame};

/// A body whose centre of gravity is not above its base as it grows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tilt {
    /// The frame of all that the body, when done, has in layer 0.
    pub(crate) base: Frame,
    /// The first layer in which it, or what it later joins, leans.
    pub(crate) layer: usize,
    /// How far the centre of gravity ever is from the base, in µm.
    pub(crate) farthest_um: f64,
}

/// Returns the bodies that lean, in the order of their first pixels.
pub(crate) fn tilts(block: &Block) -> Vec<Tilt> {
    let mut growth = Growth::new(block);
    // For each birth, the first layer in which it leans, and the farthest.
    let mut leans: Vec<Option<(usize, f64)>> = Vec::new();
    for layer in 0..block.size[2] {
        growth.grow(layer);
        leans.resize(growth.births.len(), None);
        for body in 0..growth.births.len() {
            if growth.stands(body) && growth.is_eldest(body) {
                let off_um = off_base(&growth, body) * block.pitch_um;
                // Less is what rounding leaves of zero.
                if off_um > 1e-6 {
                    let (first, farthest_um) = leans[body].unwrap_or((layer, 0.0));
                    leans[body] = Some((first, off_um.max(farthest_um)));
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

/// Returns how far a body's centre of gravity is outside of its base, in pixels; zero
/// within it.
fn off_base(growth: &Growth, body: usize) -> f64 {
    let block = growth.block;
    let its = (0..block.white.len()).filter(|&voxel| growth.names[voxel] == Some(body));
    let (mut mass, mut moment, mut corners) = (0.0, [0.0; 2], Vec::new());
    for voxel in its {
        let [column, row, layer] = block.place(voxel);
        let weight = block.thickness_um[layer];
        mass += weight;
        moment[0] += weight * (column as f64 + 0.5);
        moment[1] += weight * (row as f64 + 0.5);
        if layer == 0 {
            let corner = |i: usize| [(column + i % 2) as f64, (row + i / 2) as f64];
            corners.extend((0..4).map(corner));
        }
    }
    outside(&hull(&corners), moment.map(|m| m / mass))
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
