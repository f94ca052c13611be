//! Flattens arcs and Bézier curves to chords.

use std::f64::consts::TAU;

use super::error::ContourFault;
use crate::prisms::MAX_CORNERS;

/// The greatest distance of chords from a curve: 10 nm.
pub(super) const TOLERANCE_MM: f64 = 1e-5;

/// A limit on the chords of a curve: a full circle of 8 m keeps the tolerance.
const MAX_CHORDS: f64 = (1 << 16) as f64;

/// Returns the number of chords of an arc that spans an angle in radians.
pub(super) fn chords_of_arc(
    radius: f64,
    angle: f64,
    tolerance: f64,
) -> Result<usize, ContourFault> {
    if !(radius.is_finite() && angle.is_finite()) {
        return Err(ContourFault::NotFinite);
    }
    // The sagitta of a chord is r (1 - cos(angle / 2)).
    let step = 2.0 * (1.0 - (tolerance / radius.abs()).min(1.0)).acos();
    let chords = (angle.abs() / step).ceil().max((angle.abs() / (TAU / 8.0)).ceil());
    match chords <= MAX_CHORDS {
        true => Ok(chords.max(1.0) as usize),
        false => Err(ContourFault::TooManyCorners(MAX_CHORDS as usize)),
    }
}

/// Refuses more corners than all polygons of a file may have.
pub(super) fn check(corners: usize) -> Result<(), ContourFault> {
    if corners > MAX_CORNERS { Err(ContourFault::TooManyCorners(MAX_CORNERS)) } else { Ok(()) }
}

/// Adds the points of a cubic Bézier curve after its first one.
pub(super) fn flatten_cubic(
    points: [[f64; 2]; 4],
    tolerance: f64,
    to: &mut Vec<[f64; 2]>,
) -> Result<(), ContourFault> {
    let second = |k: usize| {
        let bend = |axis: usize| points[k][axis] - 2.0 * points[k + 1][axis] + points[k + 2][axis];
        bend(0).hypot(bend(1))
    };
    // Wang's formula for degree 3: n (n - 1) / 8 = 3 / 4.
    let chords = (0.75 * second(0).max(second(1)) / tolerance).sqrt().ceil().max(1.0);
    if !chords.is_finite() {
        return Err(ContourFault::NotFinite);
    }
    if chords > MAX_CHORDS {
        return Err(ContourFault::TooManyCorners(MAX_CHORDS as usize));
    }
    let chords = chords as u32;
    for k in 1..chords {
        let t = f64::from(k) / f64::from(chords);
        let u = 1.0 - t;
        let weights = [u * u * u, 3.0 * u * u * t, 3.0 * u * t * t, t * t * t];
        to.push(std::array::from_fn(|axis| {
            (0..4).map(|k| weights[k] * points[k][axis]).sum::<f64>()
        }));
    }
    to.push(points[3]);
    check(to.len())
}
