//! Crossings of facets moved onto the exact surfaces.

use crate::kernel::Jet;
use crate::placed::Placed;
use crate::solve::{Found, Wanted, solved};

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
    by_face(
        placed,
        crossings,
        |crossing| crossing.facet,
        |face, crossings| {
            let wanted = |crossing: &&mut Crossing| Wanted {
                uv: crossing.uv,
                known_mm: [crossing.y_mm, crossing.z_mm],
            };
            let wanted: Vec<Wanted> = crossings.iter().map(wanted).collect();
            for (crossing, found) in crossings.iter_mut().zip(solved(placed, face, [1, 2], &wanted))
            {
                crossing.fate = fate(placed, crossing, found);
                if let (Fate::Moved, Some((uv, jet))) = (crossing.fate, found) {
                    (crossing.uv, crossing.x_mm) = (uv, jet.point[0]);
                }
            }
        },
    );
}

/// Gives the items on each face together.
fn by_face<T>(
    placed: &Placed,
    items: &mut [T],
    facet: impl Fn(&T) -> u32,
    mut each: impl FnMut(u32, &mut [&mut T]),
) {
    let face = |item: &&mut T| placed.facet(facet(item)).face;
    let mut items: Vec<&mut T> = items.iter_mut().collect();
    if !items.is_sorted_by_key(face) {
        items.sort_by_key(face);
    }
    for items in items.chunk_by_mut(|a, b| face(a) == face(b)) {
        each(face(&items[0]), items);
    }
}

fn fate(placed: &Placed, crossing: &Crossing, found: Found) -> Fate {
    let Some((uv, jet)) = found else { return Fate::Diverged };
    let by_mm = jet.point[0] - crossing.x_mm;
    fate_of(placed, crossing.facet, uv, &jet, 0, by_mm, !crossing.enters)
}

/// What becomes of a point of a facet that is found to be `by_mm` further along an
/// axis, where the part should be before or behind it.
fn fate_of(
    placed: &Placed,
    facet: u32,
    uv: [f64; 2],
    jet: &Jet,
    axis: usize,
    by_mm: f64,
    is_before: bool,
) -> Fate {
    // At a pole the surface has no normal.
    let outwards = placed.normal(facet, jet).map_or(0.0, |normal| normal[axis]);
    let is_other_side = outwards.abs() > LEVEL && (outwards > 0.0) != is_before;
    // At a pole facets are so narrow that a crossing may pass several.
    let is_there = || {
        let below = placed.facet_below(facet, jet.point);
        below.is_some_and(|below| placed.facet(below).face == placed.facet(facet).face)
    };
    if is_other_side || !(is_near(&placed.facet(facet).uv, uv) || is_there()) {
        Fate::Left
    } else if by_mm.abs() * outwards.abs() > FAR * placed.tolerance_mm() {
        Fate::Far
    } else {
        Fate::Moved
    }
}

/// A place on a facet, seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// The facet, among those of the tessellation.
    pub facet: u32,
    /// The place on the facet, as parameters of its surface.
    pub uv: [f64; 2],
    /// The place, in millimetres, of which z is made exact.
    pub at_mm: [f64; 3],
    /// Whether the part is below the facet.
    pub is_above: bool,
}

/// Solves x(u, v) and y(u, v) on the exact surfaces as [`polish`] does, and moves the
/// places to z(u, v); those without a point keep theirs on the facet.
///
/// # Panics
/// Where a place's facet does not exist.
pub fn polish_heights(placed: &Placed, probes: &mut [Probe]) {
    by_face(
        placed,
        probes,
        |probe| probe.facet,
        |face, probes| {
            let wanted = |probe: &&mut Probe| Wanted {
                uv: probe.uv,
                known_mm: [probe.at_mm[0], probe.at_mm[1]],
            };
            let wanted: Vec<Wanted> = probes.iter().map(wanted).collect();
            for (probe, found) in probes.iter_mut().zip(solved(placed, face, [0, 1], &wanted)) {
                let Some((uv, jet)) = found else { continue };
                let by_mm = jet.point[2] - probe.at_mm[2];
                let fate = fate_of(placed, probe.facet, uv, &jet, 2, by_mm, probe.is_above);
                if fate == Fate::Moved {
                    (probe.uv, probe.at_mm[2]) = (uv, jet.point[2]);
                }
            }
        },
    );
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
