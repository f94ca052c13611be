//! Finds points of surfaces with two known coordinates by Newton's method.

use lamp_brep::Jet;

use super::placed::PlacedSurfaces;

/// The greatest number of steps; two or three are usual.
const MAX_STEPS: usize = 12;
/// The greatest distance of a found point from the known coordinates, in millimeters.
const NEAR_MM: f64 = 1e-10;
/// The distance accepted after the last step, in millimeters: rounding may allow no better.
const NEAR_AT_LAST_MM: f64 = 1e-7;

/// A point to find on a surface.
#[derive(Clone, Copy)]
pub(super) struct WantedPoint {
    /// The parameters to start from.
    pub(super) uv: [f64; 2],
    /// The known coordinates, in millimeters.
    pub(super) known_mm: [f64; 2],
}

/// Finds points on a face's surface with known coordinates along `axes`. Returns their
/// parameters and jets, or `None` where Newton's method diverges.
///
/// All points take each step together, because kernels evaluate many points at once at lower cost.
pub(super) fn solve(
    surfaces: &PlacedSurfaces,
    face: u32,
    axes: [usize; 2],
    wanted: &[WantedPoint],
) -> Vec<Option<([f64; 2], Jet)>> {
    let mut found = vec![None; wanted.len()];
    let mut open: Vec<usize> = (0..wanted.len()).collect();
    let mut at: Vec<[f64; 2]> = wanted.iter().map(|wanted| wanted.uv).collect();
    let mut jets = vec![Jet::default(); at.len()];
    for steps in 1..=MAX_STEPS {
        if open.is_empty() {
            break;
        }
        jets.truncate(at.len());
        surfaces.evaluate(face, &at, &mut jets);
        let near_mm = if steps < MAX_STEPS { NEAR_MM } else { NEAR_AT_LAST_MM };
        let mut kept = 0;
        for i in 0..open.len() {
            let (k, uv) = (open[i], at[i]);
            match step(wanted[k].known_mm, axes, &jets[i], uv, near_mm) {
                NewtonStep::Found => found[k] = Some((uv, jets[i])),
                NewtonStep::Lost => {}
                NewtonStep::Next(next) => {
                    // Open points move to the front, so that the next call evaluates no others.
                    (open[kept], at[kept]) = (k, next);
                    kept += 1;
                }
            }
        }
        open.truncate(kept);
        at.truncate(kept);
    }
    found
}

enum NewtonStep {
    Found,
    Next([f64; 2]),
    Lost,
}

fn step(
    known: [f64; 2],
    [a, b]: [usize; 2],
    jet: &Jet,
    [u, v]: [f64; 2],
    near_mm: f64,
) -> NewtonStep {
    let (e, f) = (known[0] - jet.point[a], known[1] - jet.point[b]);
    if e.abs() < near_mm && f.abs() < near_mm {
        return NewtonStep::Found;
    }
    let ([au, bu], [av, bv]) = ([jet.du[a], jet.du[b]], [jet.dv[a], jet.dv[b]]);
    let det = au * bv - av * bu;
    // Cramer's rule. A zero determinant gives no finite step.
    let next = [u + (e * bv - f * av) / det, v + (f * au - e * bu) / det];
    if next.iter().all(|t| t.is_finite()) { NewtonStep::Next(next) } else { NewtonStep::Lost }
}
