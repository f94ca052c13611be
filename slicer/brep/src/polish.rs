//! Crossings of facets moved onto the exact surfaces.

use crate::kernel::Jet;
use crate::placed::Placed;

/// Where a facet crosses a plane and a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Crossing {
    /// The facet, among those of the tessellation.
    pub facet: u32,
    /// The place on the facet, as parameters of its surface.
    pub uv: [f64; 2],
    /// Where the crossing is, in millimetres: what polishing makes exact.
    pub x_mm: f64,
    /// The row, in millimetres.
    pub y_mm: f64,
    /// The plane, in millimetres.
    pub z_mm: f64,
    /// Whether the contour enters the part here, along x, as the facets go round.
    pub enters: bool,
    /// What polishing did to it.
    pub fate: Fate,
}

/// What polishing did to a crossing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fate {
    /// Nothing yet.
    #[default]
    OnFacet,
    /// It lies on its surface now.
    Moved,
    /// Kept, because no point was found: the row only touches the surface, or passes
    /// it by.
    Diverged,
    /// Kept, because the point found belongs to another facet, or to the other side of
    /// the part.
    Left,
    /// Kept, because the point found is further away than the tolerance.
    Far,
}

/// Newton steps; two or three are the rule.
const MOST_STEPS: usize = 12;
/// How near to the row and the plane a point must come, in millimetres.
const NEAR_MM: f64 = 1e-10;
/// And how near is enough where rounding allows no more.
const ENOUGH_MM: f64 = 1e-7;
/// How far a crossing may move across the surface, in the distances that facets may
/// lie from it: the normal is another where it comes from.
const FAR: f64 = 2.0;
/// A surface that goes along the row as much as this faces either side.
const LEVEL: f64 = 1e-6;
/// How far beyond its facet a point may lie, in facets.
const BEYOND: f64 = 1.0;

/// Solves y(u, v) = row and z(u, v) = plane on the exact surfaces by Newton's
/// method from the facets' parameters, and moves the crossings to x(u, v).
///
/// A crossing keeps its place on the facet where that diverges, leaves the
/// surroundings of the facet, or moves it further across the surface than twice
/// as far as facets may lie from it. (Along a row that grazes the surface the same error is a longer
/// way.) Its fate says so. Crossings are neither added nor taken away, so rows
/// balance as before.
///
/// # Panics
/// Where a crossing's facet does not exist.
pub fn polish(placed: &Placed, crossings: &mut [Crossing]) {
    let face = |k: &usize| placed.facet(crossings[*k].facet).face;
    let mut order: Vec<usize> = (0..crossings.len()).collect();
    if !order.is_sorted_by_key(face) {
        order.sort_by_key(face);
    }
    let batches: Vec<&[usize]> = order.chunk_by(|a, b| face(a) == face(b)).collect();
    for batch in batches {
        for (k, found) in solved(placed, batch, crossings) {
            let crossing = &mut crossings[k];
            crossing.fate = fate(placed, crossing, found);
            if let (Fate::Moved, Some((uv, jet))) = (crossing.fate, found) {
                (crossing.uv, crossing.x_mm) = (uv, jet.point[0]);
            }
        }
    }
}

fn fate(placed: &Placed, crossing: &Crossing, found: Found) -> Fate {
    let Some((uv, jet)) = found else { return Fate::Diverged };
    // At a pole the surface has no normal.
    let outwards = placed.normal(crossing.facet, &jet).map_or(0.0, |normal| normal[0]);
    let is_other_side = outwards.abs() > LEVEL && (outwards < 0.0) != crossing.enters;
    if is_other_side || !is_near(&placed.facet(crossing.facet).uv, uv) {
        Fate::Left
    } else if (jet.point[0] - crossing.x_mm).abs() * outwards.abs() > FAR * placed.tolerance_mm() {
        Fate::Far
    } else {
        Fate::Moved
    }
}

type Found = Option<([f64; 2], Jet)>;

/// Solves the crossings of one face together; each in its own number of steps.
pub(crate) fn solved(
    placed: &Placed,
    batch: &[usize],
    crossings: &[Crossing],
) -> Vec<(usize, Found)> {
    let face = placed.facet(crossings[batch[0]].facet).face;
    let mut found = Vec::with_capacity(batch.len());
    let mut open = batch.to_vec();
    let mut at: Vec<[f64; 2]> = open.iter().map(|&k| crossings[k].uv).collect();
    let mut jets = vec![Jet::default(); at.len()];
    for steps in 1..=MOST_STEPS {
        if open.is_empty() {
            break;
        }
        jets.truncate(at.len());
        placed.evaluate(face, &at, &mut jets);
        let mut kept = 0;
        for i in 0..open.len() {
            let (k, uv) = (open[i], at[i]);
            let near_mm = if steps < MOST_STEPS { NEAR_MM } else { ENOUGH_MM };
            match step(&crossings[k], &jets[i], uv, near_mm) {
                Step::There => found.push((k, Some((uv, jets[i])))),
                Step::Lost => found.push((k, None)),
                Step::On(next) => {
                    (open[kept], at[kept]) = (k, next);
                    kept += 1;
                }
            }
        }
        open.truncate(kept);
        at.truncate(kept);
    }
    found.extend(open.into_iter().map(|k| (k, None)));
    found
}

enum Step {
    There,
    On([f64; 2]),
    Lost,
}

fn step(crossing: &Crossing, jet: &Jet, [u, v]: [f64; 2], near_mm: f64) -> Step {
    let [_, y, z] = jet.point;
    let (e, f) = (crossing.y_mm - y, crossing.z_mm - z);
    if e.abs() < near_mm && f.abs() < near_mm {
        return Step::There;
    }
    let ([_, yu, zu], [_, yv, zv]) = (jet.du, jet.dv);
    let det = yu * zv - yv * zu;
    let next = [u + (e * zv - f * yv) / det, v + (f * yu - e * zu) / det];
    if next.iter().all(|t| t.is_finite()) { Step::On(next) } else { Step::Lost }
}

/// Whether parameters lie on a facet or near it.
fn is_near([p, q, r]: &[[f64; 2]; 3], uv: [f64; 2]) -> bool {
    let double = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let whole = double(*p, *q, *r);
    let parts = [double(uv, *q, *r), double(*p, uv, *r), double(*p, *q, uv)];
    parts.iter().all(|part| part / whole >= -BEYOND)
}
