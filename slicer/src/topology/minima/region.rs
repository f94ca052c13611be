//! Finds level regions with no lower neighbors, and the features that begin there.

use lamp_brep::vector::{Vec3, along, cross, dot, sub};

use super::HeightField;
use crate::topology::{next, previous};

/// Finds the regions that are minima, by ascending height, and at equal heights by first vertex.
/// The vertices of each region are in ascending order.
pub(super) fn level_regions(field: &HeightField<'_>) -> Vec<Vec<u32>> {
    let has_lower = has_lower(field);
    let mut is_seen = vec![false; field.heights.len()];
    let mut regions = Vec::new();
    for vertex in 0..field.heights.len() as u32 {
        let is_start = !has_lower[vertex as usize] && !is_seen[vertex as usize];
        if is_start && !field.corners(vertex).is_empty() {
            let mut region = level_with(vertex, field, &mut is_seen);
            if !region.iter().any(|&vertex| has_lower[vertex as usize]) {
                region.sort_unstable();
                regions.push(region);
            }
        }
    }
    regions.sort_by(|a, b| {
        field.height(a[0]).total_cmp(&field.height(b[0])).then_with(|| a[0].cmp(&b[0]))
    });
    regions
}

/// Returns, for each vertex, whether an edge leads down from it.
fn has_lower(field: &HeightField<'_>) -> Vec<bool> {
    let table = field.relief.table;
    let mut has_lower = vec![false; field.heights.len()];
    let has_idle = field.relief.has_idle;
    let facets = 0..table.facet_count() as u32;
    for facet in facets.filter(|&facet| !has_idle || !table.is_idle(facet)) {
        let vertices = table.facet_vertices(facet);
        let heights = vertices.map(|vertex| field.height(vertex));
        let lowest = heights[0].min(heights[1]).min(heights[2]);
        for (vertex, height) in vertices.into_iter().zip(heights) {
            // Always written, because no processor can predict which corner is the lowest.
            has_lower[vertex as usize] |= height > lowest;
        }
    }
    has_lower
}

/// Returns the vertices connected to a vertex by level edges.
fn level_with(vertex: u32, field: &HeightField<'_>, is_seen: &mut [bool]) -> Vec<u32> {
    let height = field.height(vertex);
    let mut region = vec![vertex];
    is_seen[vertex as usize] = true;
    let mut done = 0;
    while let Some(&vertex) = region.get(done) {
        done += 1;
        for beside in field.beside(vertex) {
            if field.height(beside) == height && !is_seen[beside as usize] {
                is_seen[beside as usize] = true;
                region.push(beside);
            }
        }
    }
    region
}

/// Returns the area of the section just above a minimum, seen from above: positive around solid,
/// negative around a pit. Sections have solid to their left.
///
/// The plane is halfway up to the next vertex next to the region, where the section is a closed
/// polygon, so that no limit is needed.
pub(super) fn section_area(field: &HeightField<'_>, region: &[u32], up: Vec3) -> f64 {
    let table = field.relief.table;
    let height = field.height(region[0]);
    let rises = region.iter().flat_map(|&vertex| field.beside(vertex));
    let rises = rises.map(|vertex| field.height(vertex) - height).filter(|&rise| rise > 0.0);
    let plane = rises.fold(f64::INFINITY, f64::min) / 2.0;
    let origin = table.points()[region[0] as usize];
    let rise = |corner: u32| field.height(table.vertex(corner)) - height;
    let crossing = |a: u32, b: u32| {
        let [low, high] = if rise(a) < rise(b) { [a, b] } else { [b, a] };
        let way = sub(table.point(high), table.point(low));
        along(sub(table.point(low), origin), way, plane / rise(high))
    };
    let mut twice = 0.0;
    for &corner in region.iter().flat_map(|&vertex| field.corners(vertex)) {
        let (after, before) = (next(corner), previous(corner));
        let is_low = [after, before].map(|corner| rise(corner) == 0.0);
        // A facet with two corners in the region is found at both corners, and counts at the first
        // one.
        let segment = match is_low {
            [false, false] => [crossing(corner, before), crossing(corner, after)],
            // The facet on a region's edge is cut at its other two sides.
            [true, false] => [crossing(before, corner), crossing(before, after)],
            _ => continue,
        };
        twice += dot(up, cross(segment[0], segment[1]));
    }
    twice / 2.0
}
