//! Points of surfaces of which two coordinates are known.

use crate::kernel::Jet;
use crate::placed::Placed;

/// Newton steps; two or three are the rule.
const MOST_STEPS: usize = 12;
/// How near to what is known a point must come, in millimetres.
const NEAR_MM: f64 = 1e-10;
/// And how near is enough where rounding allows no more.
const ENOUGH_MM: f64 = 1e-7;

/// Parameters and what is there; nothing if nothing was found.
pub(crate) type Found = Option<([f64; 2], Jet)>;

/// A point to be found.
#[derive(Clone, Copy)]
pub(crate) struct Wanted {
    /// The parameters to start from.
    pub(crate) uv: [f64; 2],
    /// The known coordinates, in millimetres.
    pub(crate) known_mm: [f64; 2],
}

/// Finds points on a face's surface of which two coordinates are known, `axes`, by
/// Newton's method; all together, each in its own number of steps.
pub(crate) fn solved(
    placed: &Placed,
    face: u32,
    axes: [usize; 2],
    wanted: &[Wanted],
) -> Vec<Found> {
    let mut found: Vec<Found> = vec![None; wanted.len()];
    let mut open: Vec<usize> = (0..wanted.len()).collect();
    let mut at: Vec<[f64; 2]> = wanted.iter().map(|wanted| wanted.uv).collect();
    let mut jets = vec![Jet::default(); at.len()];
    for steps in 1..=MOST_STEPS {
        if open.is_empty() {
            break;
        }
        jets.truncate(at.len());
        placed.evaluate(face, &at, &mut jets);
        let near_mm = if steps < MOST_STEPS { NEAR_MM } else { ENOUGH_MM };
        let mut kept = 0;
        for i in 0..open.len() {
            let (k, uv) = (open[i], at[i]);
            match step(wanted[k].known_mm, axes, &jets[i], uv, near_mm) {
                Step::There => found[k] = Some((uv, jets[i])),
                Step::Lost => {}
                Step::On(next) => {
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

enum Step {
    There,
    On([f64; 2]),
    Lost,
}

fn step(known: [f64; 2], [a, b]: [usize; 2], jet: &Jet, [u, v]: [f64; 2], near_mm: f64) -> Step {
    let (e, f) = (known[0] - jet.point[a], known[1] - jet.point[b]);
    if e.abs() < near_mm && f.abs() < near_mm {
        return Step::There;
    }
    let ([au, bu], [av, bv]) = ([jet.du[a], jet.du[b]], [jet.dv[a], jet.dv[b]]);
    let det = au * bv - av * bu;
    let next = [u + (e * bv - f * av) / det, v + (f * au - e * bu) / det];
    if next.iter().all(|t| t.is_finite()) { Step::On(next) } else { Step::Lost }
}
