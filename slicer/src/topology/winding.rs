//! Counts how often the facets of a solid wind around a place.

use std::f64::consts::TAU;

use lamp_brep::vector::{Vec3, add, cross, dot, length, scale, sub, unit};
use rayon::prelude::*;

use crate::topology::CornerTable;

/// The greatest number of facets examined, for all places together.
const MOST_FACETS: usize = 200_000_000;

/// Returns the first of some facets next to which its solid is wound around twice, or turned inside
/// out, and the place. `off_mm` is the distance between the examined place and the facet, and
/// `solid` gives the facets of the same solid.
///
/// Facets may be exactly on each other's edges here: no place is on a facet's border.
pub(crate) fn wound_twice(
    table: &CornerTable,
    facets: &[u32],
    off_mm: f64,
    solid: impl Fn(u32, u32) -> bool + Sync,
) -> Option<(u32, Vec3)> {
    let count = table.facet_count();
    let most = (MOST_FACETS / count.max(1)).max(1);
    // Each place takes a pass over all facets.
    let some: Vec<u32> =
        facets.iter().copied().step_by(facets.len().div_ceil(most).max(1)).collect();
    let beside = |facet: u32| -> Option<Vec3> {
        let [a, b, c] = table.facet(facet);
        let middle = scale(add(add(a, b), c), 1.0 / 3.0);
        let normal = unit(cross(sub(b, a), sub(c, a)))?;
        let is_wrong = |place: &Vec3| {
            let others =
                (0..count as u32).filter(|&other| !table.is_idle(other) && solid(facet, other));
            let turns = others.map(|other| angle(table.facet(other), *place)).sum::<f64>() / TAU;
            // A whole sphere is 4π, two turns. Half a winding is far more than rounding.
            !(-0.5..=1.5).contains(&(turns / 2.0))
        };
        let places = [-off_mm, off_mm].map(|off| add(middle, scale(normal, off)));
        places.into_iter().find(is_wrong)
    };
    let found = some.into_par_iter().filter_map(|facet| beside(facet).map(|at| (facet, at)));
    // The least facet, so that threads have no effect.
    found.min_by_key(|(facet, _)| *facet)
}

/// Returns the solid angle of a facet seen from a place, positive from behind (A. Van Oosterom and
/// J. Strackee, *The solid angle of a plane triangle*, 1983).
fn angle(facet: [Vec3; 3], place: Vec3) -> f64 {
    let [a, b, c] = facet.map(|corner| sub(corner, place));
    let [la, lb, lc] = [a, b, c].map(length);
    let above = dot(a, cross(b, c));
    let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    2.0 * above.atan2(below)
}
