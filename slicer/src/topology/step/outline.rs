//! Finds the loops around a face, and the vertices that the loops do not need.

use lamp_brep::vector::{Vec3, cross, dot, sub};

use super::flat_faces::FlatFaces;
use crate::topology::CornerTable;
use crate::topology::faults::is_flat_between;

/// Returns the loops of vertices around facets of one face, with the face to the left as seen from
/// outside; `None` if a vertex is on them twice, so that they touch.
pub(super) fn outlines(
    table: &CornerTable,
    facets: &[u32],
    faces: &FlatFaces,
) -> Option<Vec<Vec<u32>>> {
    if let [facet] = facets {
        return Some(vec![table.facet_vertices(*facet).to_vec()]);
    }
    let corners = facets.iter().flat_map(|&facet| 3 * facet..3 * facet + 3);
    let sides = corners.filter(|&corner| faces.is_side(table, corner));
    let mut ways: Vec<[u32; 2]> = sides.map(|corner| table.edge_ends(corner)).collect();
    ways.sort_unstable();
    // Two ways lead on from a vertex where loops touch.
    if ways.windows(2).any(|pair| pair[0][0] == pair[1][0]) {
        return None;
    }
    let mut is_done = vec![false; ways.len()];
    let mut outlines = Vec::new();
    for start in 0..ways.len() {
        let mut outline = Vec::new();
        let mut way = start;
        while !is_done[way] {
            is_done[way] = true;
            outline.push(ways[way][0]);
            way = ways.binary_search_by_key(&ways[way][1], |way| way[0]).ok()?;
        }
        if !outline.is_empty() {
            outlines.push(outline);
        }
    }
    outlines.iter().all(|outline| outline.len() > 2).then_some(outlines)
}

/// Puts the outer loop first.
pub(super) fn outer_first(table: &CornerTable, normal: Vec3, outlines: &mut [Vec<u32>]) {
    if outlines.len() > 1 {
        let area = |outline: &Vec<u32>| {
            let point = |vertex: u32| table.points()[vertex as usize];
            let first = point(outline[0]);
            let sides = outline.windows(2).map(|side| [0, 1].map(|k| sub(point(side[k]), first)));
            sides.map(|[a, b]| dot(normal, cross(a, b))).sum::<f64>()
        };
        // Holes run clockwise, so their areas are below zero.
        outlines.sort_by_cached_key(|outline| std::cmp::Reverse(ordered(area(outline))));
    }
}

/// Returns bits in the order of numbers.
fn ordered(number: f64) -> i64 {
    let bits = number.to_bits() as i64;
    // As in `f64::total_cmp`: the bits of negative numbers fall as the numbers rise.
    bits ^ ((bits >> 63) as u64 >> 1) as i64
}

/// The vertices of loops, and which of them are on a straight side of two faces.
#[derive(Debug)]
pub(super) struct Dropped {
    /// For each vertex, the number of faces that meet there, up to three; zero within a face.
    faces_at: Vec<u8>,
    is_dropped: Vec<bool>,
}

impl Dropped {
    pub(super) fn new(table: &CornerTable, faces: &FlatFaces) -> Self {
        let vertices = table.points().len();
        let mut this = Self { faces_at: vec![0; vertices], is_dropped: vec![false; vertices] };
        for corner in (0..table.corner_count()).filter(|&corner| faces.is_side(table, corner)) {
            let count = &mut this.faces_at[table.edge_ends(corner)[0] as usize];
            *count = (*count + 1).min(3);
        }
        for face in (0..faces.count()).filter(|&face| faces.facets(face).len() > 1) {
            for outline in outlines(table, faces.facets(face), faces).unwrap_or_default() {
                this.drop_from(table, &outline);
            }
        }
        this
    }

    /// Drops the vertices of a loop where only two faces meet, in a straight line. The other face
    /// drops them too: it has the same sides in reverse.
    fn drop_from(&mut self, table: &CornerTable, outline: &[u32]) {
        let count = outline.len();
        for k in 0..count {
            let [before, vertex, after] = [k + count - 1, k, k + 1].map(|k| outline[k % count]);
            let [a, p, b] = [before, vertex, after].map(|vertex| table.points()[vertex as usize]);
            let (way, on) = (sub(p, a), sub(b, p));
            let is_straight = is_flat_between([a, p, b]) && dot(way, on) > 0.0;
            if self.faces_at[vertex as usize] == 2 && is_straight {
                self.is_dropped[vertex as usize] = true;
            }
        }
    }

    /// Returns true if a vertex is on loops and was not dropped from them.
    pub(super) fn is_used(&self, vertex: u32) -> bool {
        self.faces_at[vertex as usize] > 0 && !self.is_dropped[vertex as usize]
    }

    /// Returns a loop without the dropped vertices.
    pub(super) fn without(&self, outline: &[u32]) -> Vec<u32> {
        outline.iter().copied().filter(|&vertex| self.is_used(vertex)).collect()
    }
}
