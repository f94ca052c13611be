//! The corner table: vertices, opposite corners and edges as flat arrays.

use std::ops::Range;

use crate::topology::edges::MeshEdges;

/// Represents no corner or no edge in arrays.
pub(crate) const NONE: u32 = u32::MAX;

/// Returns the next corner of a corner's facet, counterclockwise seen from outside.
#[inline]
pub const fn next(corner: u32) -> u32 {
    if corner % 3 == 2 { corner - 2 } else { corner + 1 }
}

/// Returns the previous corner of a corner's facet.
#[inline]
pub const fn previous(corner: u32) -> u32 {
    if corner.is_multiple_of(3) { corner + 2 } else { corner - 1 }
}

/// Returns the facet of a corner.
#[inline]
pub const fn facet_of(corner: u32) -> u32 {
    corner / 3
}

/// A mesh as its corners: the vertex of each corner, its opposite corner, and the edge between them
/// (002 section 2.3.2.1, figure 19).
///
/// The edge opposite to a corner joins the other two corners of its facet; so each corner also
/// represents an edge of its facet.
///
/// - Two facets alone on an edge are neighbors, whichever way they face.
/// - Three or more facets are neighbors in pairs if they face each other alternately around the
///   edge. The two facets of a pair have solid between them. Otherwise none of the facets has a
///   neighbor there. Either way, such edges are [crowded](Self::crowded) (non-manifold).
/// - Facets with two corners at one vertex, or with a coordinate that is not finite, are
///   [idle](Self::is_idle): they do not count at edges.
///
/// It takes 36 bytes per facet and 24 bytes per vertex.
#[derive(Clone, Debug)]
pub struct CornerTable {
    points: Vec<[f64; 3]>,
    vertices: Vec<u32>,
    edges: MeshEdges,
    body_ends: Vec<u32>,
}

impl CornerTable {
    /// Creates the table of facets of one body: `vertices` are the vertices of all corners, as
    /// indices of points in millimeters.
    ///
    /// # Panics
    /// Panics if a vertex is not among the points, the number of corners is not three per facet, or
    /// there are 2^32 - 1 corners.
    pub fn new(points: Vec<[f64; 3]>, vertices: Vec<u32>) -> Self {
        // With too many facets, `of_bodies` panics.
        let facets = u32::try_from(vertices.len() / 3).unwrap_or(NONE);
        Self::of_bodies(points, vertices, vec![facets])
    }

    /// Creates the table of several bodies, each given by the end of its facets.
    pub(crate) fn of_bodies(
        points: Vec<[f64; 3]>,
        vertices: Vec<u32>,
        body_ends: Vec<u32>,
    ) -> Self {
        // No corner's number may equal `NONE`.
        assert!(vertices.len().is_multiple_of(3) && vertices.len() < NONE as usize);
        let edges = MeshEdges::of(&points, &vertices);
        Self { points, vertices, edges, body_ends }
    }

    /// Returns the points, the vertices of all corners, and the ends of bodies.
    pub(crate) fn into_parts(self) -> (Vec<[f64; 3]>, Vec<u32>, Vec<u32>) {
        (self.points, self.vertices, self.body_ends)
    }

    /// Returns the table with each coordinate changed. The number of vertices stays.
    pub(crate) fn with_points(mut self, changed: impl Fn(f64) -> f64) -> Self {
        self.points.as_flattened_mut().iter_mut().for_each(|c| *c = changed(*c));
        self
    }

    /// Returns the number of facets.
    pub fn facet_count(&self) -> usize {
        self.vertices.len() / 3
    }

    /// Returns the number of corners, three for each facet.
    pub fn corner_count(&self) -> u32 {
        self.vertices.len() as u32
    }

    /// Returns the number of edges. Each edge counts once, regardless of its number of facets.
    pub fn edge_count(&self) -> usize {
        self.edges.count as usize
    }

    /// Returns the points of the vertices, in millimeters.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// Returns the facets of each body of the part's files. Two bodies never share a vertex.
    pub fn bodies(&self) -> impl Iterator<Item = Range<u32>> {
        let starts = std::iter::once(0).chain(self.body_ends.iter().copied());
        starts.zip(&self.body_ends).map(|(start, &end)| start..end)
    }

    /// Returns the vertex of a corner, an index of [`points`](Self::points): V of 002.
    #[inline]
    pub fn vertex(&self, corner: u32) -> u32 {
        self.vertices[corner as usize]
    }

    /// Returns the place of a corner, in millimeters.
    #[inline]
    pub fn point(&self, corner: u32) -> [f64; 3] {
        self.points[self.vertex(corner) as usize]
    }

    /// Returns the three points of a facet, in millimeters.
    #[inline]
    pub fn facet(&self, facet: u32) -> [[f64; 3]; 3] {
        [3 * facet, 3 * facet + 1, 3 * facet + 2].map(|corner| self.point(corner))
    }

    /// Returns the three vertices of a facet.
    #[inline]
    pub fn facet_vertices(&self, facet: u32) -> [u32; 3] {
        [3 * facet, 3 * facet + 1, 3 * facet + 2].map(|corner| self.vertex(corner))
    }

    /// Returns the corner on the other side of the edge opposite to a corner: O of 002. Returns
    /// `None` at the boundary of an open mesh.
    #[inline]
    pub fn opposite(&self, corner: u32) -> Option<u32> {
        Some(self.edges.opposites[corner as usize]).filter(|&opposite| opposite != NONE)
    }

    /// Returns the corner opposite to the previous corner: the corner of the facet on the left.
    #[inline]
    pub fn left(&self, corner: u32) -> Option<u32> {
        self.opposite(previous(corner))
    }

    /// Returns the corner opposite to the next corner: the corner of the facet on the right.
    #[inline]
    pub fn right(&self, corner: u32) -> Option<u32> {
        self.opposite(next(corner))
    }

    /// Returns the edge opposite to a corner, below [`edge_count`](Self::edge_count): E of 002.
    /// Returns `None` for an idle facet.
    #[inline]
    pub fn edge(&self, corner: u32) -> Option<u32> {
        Some(self.edges.numbers[corner as usize]).filter(|&edge| edge != NONE)
    }

    /// Returns the vertices that the edge opposite to a corner joins, in the order in which the
    /// corner's facet runs through them.
    #[inline]
    pub fn edge_ends(&self, corner: u32) -> [u32; 2] {
        [self.vertex(next(corner)), self.vertex(previous(corner))]
    }

    /// Returns true if a facet and its neighbor opposite to a corner run along their edge in the
    /// same direction, so that one of them is turned over.
    #[inline]
    pub fn disagrees(&self, corner: u32) -> bool {
        self.opposite(corner).is_some_and(|other| self.edge_ends(corner) == self.edge_ends(other))
    }

    /// Returns true if a facet has two corners at one vertex, or a coordinate that is not finite.
    #[inline]
    pub fn is_idle(&self, facet: u32) -> bool {
        // No corner of an idle facet has an edge, so one is enough to look at.
        self.edges.numbers[3 * facet as usize] == NONE
    }

    /// Returns true if the edge opposite to a corner is a boundary edge, with only one facet.
    #[inline]
    pub fn is_rim(&self, corner: u32) -> bool {
        self.edges.opposites[corner as usize] == NONE
            && self.edges.numbers[corner as usize] != NONE
            && !self.edges.is_crowded(corner)
    }

    /// Returns the crowded edges, with three or more facets: for each, the corners opposite to it,
    /// one per facet.
    pub fn crowded(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        self.edges.crowded.iter().map(|corners| &corners[..])
    }

    /// Returns the size of the arrays in bytes.
    pub fn bytes(&self) -> usize {
        // Three coordinates a point; vertex, opposite corner and edge for each corner.
        24 * self.points.len() + 4 * (self.vertices.len() * 3 + self.body_ends.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topology::testing::table_of;

    /// 002, figure 19 (c): V, O and E of each corner; 99 where it prints `--`.
    const FIGURE_19: [[u32; 3]; 36] = [
        [0, 4, 0],
        [1, 16, 6],
        [2, 25, 7],
        [1, 8, 1],
        [9, 0, 0],
        [2, 34, 13],
        [2, 99, 15],
        [9, 11, 2],
        [10, 3, 1],
        [2, 99, 16],
        [10, 13, 3],
        [3, 7, 2],
        [3, 17, 4],
        [4, 10, 3],
        [2, 99, 17],
        [2, 20, 5],
        [4, 1, 6],
        [0, 12, 4],
        [0, 99, 18],
        [4, 22, 19],
        [5, 15, 5],
        [5, 26, 8],
        [6, 19, 19],
        [0, 99, 20],
        [0, 29, 9],
        [6, 2, 5],
        [1, 21, 8],
        [1, 99, 10],
        [6, 31, 11],
        [7, 24, 9],
        [7, 35, 12],
        [8, 28, 11],
        [1, 99, 21],
        [1, 99, 14],
        [8, 5, 13],
        [9, 30, 12],
    ];

    #[test]
    fn figure_19_of_002() {
        let vertices = FIGURE_19.map(|[vertex, _, _]| vertex).to_vec();
        let table = CornerTable::new(vec![[0.0; 3]; 11], vertices);
        let mut names = [None; 22];
        for (corner, [vertex, opposite, mut edge]) in (0..).zip(FIGURE_19) {
            assert_eq!(table.vertex(corner), vertex);
            assert_eq!(table.opposite(corner).unwrap_or(99), opposite, "corner {corner}");
            assert_eq!(table.is_rim(corner), opposite == 99);
            // Its opposite corner 2 has 7, so it has 7, too.
            if corner == 25 {
                assert_eq!(edge, 5);
                edge = 7;
            }
            let name = &mut names[table.edge(corner).unwrap() as usize];
            assert_eq!(*name.get_or_insert(edge), edge, "corner {corner}");
        }
        names.sort_unstable();
        assert_eq!(table.edge_count(), 22);
        assert!(names.into_iter().eq((0..22).map(Some)));
    }

    #[test]
    fn corners_go_around_their_facet() {
        for facet in [0, 1, 7] {
            let [a, b, c] = [3 * facet, 3 * facet + 1, 3 * facet + 2];
            assert_eq!([a, b, c].map(next), [b, c, a]);
            assert_eq!([a, b, c].map(previous), [c, a, b]);
            assert_eq!([a, b, c].map(facet_of), [facet; 3]);
        }
    }

    #[test]
    fn every_way_across_leads_back() {
        let table = table_of(&lamp_fixtures::torus(10.0, 3.0, 2_000).facets);
        assert_eq!(2 * table.edge_count(), table.corner_count() as usize);
        for corner in 0..table.corner_count() {
            let across = table.opposite(corner).unwrap();
            assert_eq!(table.opposite(across), Some(corner));
            assert_eq!(table.edge(across), table.edge(corner));
            let [from, to] = table.edge_ends(corner);
            assert_eq!(table.edge_ends(across), [to, from]);
            assert_eq!(table.left(next(corner)), Some(across));
            assert_eq!(table.right(previous(corner)), Some(across));
        }
    }

    #[test]
    fn a_facet_turned_over_still_has_its_neighbours() {
        let mut facets = lamp_fixtures::sphere(5.0, 200).facets;
        facets[17].swap(1, 2);
        let table = table_of(&facets);
        let disagreeing = (0..table.corner_count()).filter(|&corner| table.disagrees(corner));
        assert_eq!(disagreeing.filter(|&corner| facet_of(corner) == 17).count(), 3);
        assert!((0..table.corner_count()).all(|corner| table.opposite(corner).is_some()));
    }

    #[test]
    fn idle_facets_are_on_no_edge() {
        let mut facets = lamp_fixtures::sphere(5.0, 200).facets;
        let closed = table_of(&facets).edge_count();
        let [a, b, _] = facets[0];
        facets.push([a, b, a]);
        facets.push([a, b, [f32::NAN, 0.0, 0.0]]);
        facets.push([a, a, a]);
        let count = facets.len() as u32;
        let table = table_of(&facets);
        assert_eq!(table.edge_count(), closed);
        assert!((0..count).all(|facet| table.is_idle(facet) == (facet >= count - 3)));
        assert!((0..3 * count).all(|corner| !table.is_rim(corner)));
    }
}
