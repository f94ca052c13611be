//! Finds facets to drop from a mesh.

use std::collections::HashMap;

use lamp_brep::vector::distance;

use crate::topology::faults::is_finite;
use crate::topology::repair::Deed;
use crate::topology::rims::box_of;
use crate::topology::{CornerTable, Doubled};

/// Returns the facets to drop, in ascending order, each with the reason.
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
    // This decides nothing if no facet of the mesh has a neighbor.
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

/// Returns the repeated facets to drop, so that no edge with an even number of facets gets an odd
/// number.
///
/// Of an odd number of facets between three vertices, one stays. Of an even number, one or none
/// stays: as required by the edges on which all other facets are known, in groups connected by
/// edges. Where no edge decides, one stays if more facets face one way than the other, as in a
/// surface that the file contains twice. Facets back to back bound nothing, so none of them stays.
fn doubled(table: &CornerTable) -> Vec<u32> {
    let groups = groups(table);
    let edges = GroupEdges::new(table, &groups);
    let mut keeps: Vec<Option<bool>> =
        groups.iter().map(|group| (group.facets.len() % 2 == 1).then_some(true)).collect();
    for first in 0..groups.len() {
        if keeps[first].is_none() {
            edges.decide(first, &groups, &mut keeps);
        }
    }
    if edges.was_even && !edges.are_even(&keeps) {
        // Dropping facets in pairs leaves every edge as even as it was.
        for (keep, group) in keeps.iter_mut().zip(&groups) {
            *keep = Some(group.facets.len() % 2 == 1);
        }
    }
    let of_group = |(group, keep): (&FacetGroup, &Option<bool>)| {
        let kept = (*keep == Some(true)).then_some(group.kept);
        group.facets.iter().copied().filter(move |&facet| Some(facet) != kept).collect::<Vec<u32>>()
    };
    groups.iter().zip(&keeps).flat_map(of_group).collect()
}

/// All facets between the same three vertices.
struct FacetGroup {
    facets: Vec<u32>,
    /// The first of the facets that face the same way as most.
    kept: u32,
    /// Whether equal numbers of facets face each way.
    is_balanced: bool,
}

fn groups(table: &CornerTable) -> Vec<FacetGroup> {
    let mut doubled = Doubled::all(table);
    doubled.sort_unstable_by_key(|it| (it.of, it.facet));
    let group = |group: &[Doubled]| {
        let of = group[0].of;
        let turned = group.iter().find(|it| !it.is_same_way).map(|it| it.facet);
        let others = group.iter().filter(|it| !it.is_same_way).count();
        let same = 1 + group.len() - others;
        FacetGroup {
            facets: std::iter::once(of).chain(group.iter().map(|it| it.facet)).collect(),
            kept: turned.filter(|_| others > same).unwrap_or(of),
            is_balanced: others == same,
        }
    };
    doubled.chunk_by(|a, b| a.of == b.of).map(group).collect()
}

/// The edges of groups of facets.
struct GroupEdges {
    /// For each group, its edges.
    of_group: Vec<[u32; 3]>,
    /// For each edge, its groups, and whether it has an odd number of other facets.
    groups_at: HashMap<u32, (Vec<usize>, bool)>,
    /// Whether every edge of the mesh has an even number of facets.
    was_even: bool,
}

impl GroupEdges {
    fn new(table: &CornerTable, groups: &[FacetGroup]) -> Self {
        let facets_at: HashMap<Option<u32>, usize> =
            table.crowded().map(|corners| (table.edge(corners[0]), corners.len())).collect();
        let edges = |group: &FacetGroup| {
            let corner = 3 * group.facets[0];
            // Facets between three vertices have edges.
            [corner, corner + 1, corner + 2].map(|corner| table.edge(corner).unwrap_or(u32::MAX))
        };
        let of_group: Vec<[u32; 3]> = groups.iter().map(edges).collect();
        let mut groups_at: HashMap<u32, (Vec<usize>, bool)> = HashMap::new();
        for (number, edges) in of_group.iter().enumerate() {
            for &edge in edges {
                // An edge that is not crowded has only the group's two facets.
                let facets = facets_at.get(&Some(edge)).copied().unwrap_or(2);
                let start = || (Vec::new(), facets % 2 == 1);
                let (at, is_odd) = groups_at.entry(edge).or_insert_with(start);
                at.push(number);
                *is_odd ^= groups[number].facets.len() % 2 == 1;
            }
        }
        let was_even = facets_at.values().all(|facets| facets % 2 == 0)
            && !(0..table.corner_count()).any(|corner| table.is_rim(corner));
        Self { of_group, groups_at, was_even }
    }

    /// Returns true if all edges of groups have an even number of remaining facets.
    fn are_even(&self, keeps: &[Option<bool>]) -> bool {
        self.groups_at.values().all(|(at, is_odd)| {
            let kept = at.iter().filter(|&&group| keeps[group] == Some(true)).count();
            *is_odd == (kept % 2 == 1)
        })
    }

    /// Decides on a group, and on the groups connected to it by edges on which all other facets are
    /// known.
    fn decide(&self, first: usize, groups: &[FacetGroup], keeps: &mut [Option<bool>]) {
        // For each group, whether it stays if the first group does.
        let mut as_first = HashMap::from([(first, true)]);
        let (mut cluster, mut next) = (vec![first], 0);
        let (mut stay, mut go) = (0, 0);
        while let Some(&group) = cluster.get(next) {
            next += 1;
            for edge in self.of_group[group] {
                let (at, is_odd) = &self.groups_at[&edge];
                let open: Vec<usize> =
                    at.iter().copied().filter(|&group| keeps[group].is_none()).collect();
                let kept = at.iter().filter(|&&group| keeps[group] == Some(true)).count();
                let is_odd = is_odd ^ (kept % 2 == 1);
                match open[..] {
                    // It makes an odd number even, or an even one odd.
                    [_] if is_odd == as_first[&group] => stay += 1,
                    [_] => go += 1,
                    [a, b] => {
                        let other = if a == group { b } else { a };
                        let with_first = as_first[&group] ^ is_odd;
                        if as_first.insert(other, with_first).is_none() {
                            cluster.push(other);
                        }
                    }
                    _ => {}
                }
            }
        }
        let usual = as_first[&first] != groups[first].is_balanced;
        let first_stays = if stay == go { usual } else { stay > go };
        for group in cluster {
            keeps[group] = Some(as_first[&group] == first_stays);
        }
    }
}
