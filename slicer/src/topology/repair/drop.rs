//! Finds facets that a mesh is better without.

use std::collections::HashMap;

use lamp_brep::vector::distance;

use crate::topology::faults::is_finite;
use crate::topology::repair::Deed;
use crate::topology::rims::box_of;
use crate::topology::{CornerTable, Doubled};

/// Returns the facets to drop, in rising order, each with the reason.
pub(super) fn dropped(table: &CornerTable, close: f64) -> Vec<(u32, Deed)> {
    let facets = || 0..table.facet_count() as u32;
    let idle = facets().filter(|&facet| table.is_idle(facet));
    let mut dropped: HashMap<u32, Deed> = idle
        .map(|facet| match is_finite(table, facet) {
            true => (facet, Deed::DroppedCollapsed),
            false => (facet, Deed::DroppedNotFinite),
        })
        .collect();
    let doubled = doubled(table).into_iter();
    doubled.for_each(|facet| _ = dropped.entry(facet).or_insert(Deed::DroppedDoubled));
    let is_alone = |facet: &u32| (3 * facet..3 * facet + 3).all(|corner| table.is_rim(corner));
    // In a soup in which no facet has a neighbour, that says nothing.
    if (0..table.corner_count()).any(|corner| table.opposite(corner).is_some()) {
        for facet in facets().filter(is_alone) {
            let [low, high] = box_of(table.facet(facet));
            if distance(low, high) <= close {
                dropped.insert(facet, Deed::DroppedAlone);
            }
        }
    }
    let mut dropped: Vec<_> = dropped.into_iter().collect();
    dropped.sort_unstable();
    dropped
}

/// Returns facets that repeat others. Copies that face the same way come first; if there are none,
/// two facets back to back go together if all their edges have an even number of facets, and one of
/// them otherwise.
fn doubled(table: &CornerTable) -> Vec<u32> {
    let mut doubled = Doubled::all(table);
    doubled.sort_unstable_by_key(|it| (it.of, it.facet));
    let mut copies = Vec::new();
    for group in doubled.chunk_by(|a, b| a.of == b.of) {
        let same = group.iter().filter(|it| it.is_same_way);
        let other = group.iter().filter(|it| !it.is_same_way).skip(1);
        copies.extend(same.chain(other).map(|it| it.facet));
    }
    if !copies.is_empty() {
        return copies;
    }
    let on_edge = |corner: u32| table.edge(corner);
    let crowded: HashMap<Option<u32>, usize> =
        table.crowded().map(|corners| (on_edge(corners[0]), corners.len())).collect();
    let is_even = |corner: u32| {
        let facets = crowded.get(&on_edge(corner)).copied();
        facets.unwrap_or(2).is_multiple_of(2)
    };
    let goes = |it: &Doubled| {
        let both = (3 * it.of..3 * it.of + 3).all(is_even);
        [Some(it.facet), both.then_some(it.of)].into_iter().flatten()
    };
    doubled.iter().flat_map(goes).collect()
}
