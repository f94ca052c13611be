//! Holds the points of a face, and its corners in the parameters of its surface.

use crate::vector::Vec3;

/// A corner in a face's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FaceNode {
    pub(super) uv: [f64; 2],
    /// The point's index. A point has several corners along a seam or at a pole.
    pub(super) point: u32,
}

/// The points of a face: the shared points of its edges, and its own points.
pub(super) struct FacePoints<'a> {
    pub(super) shared: &'a [Vec3],
    pub(super) own: Vec<Vec3>,
}

impl FacePoints<'_> {
    pub(super) fn get(&self, point: u32) -> Vec3 {
        let point = point as usize;
        self.shared.get(point).copied().unwrap_or_else(|| self.own[point - self.shared.len()])
    }

    pub(super) fn push(&mut self, point: Vec3) -> u32 {
        self.own.push(point);
        (self.shared.len() + self.own.len() - 1) as u32
    }
}

/// A loop of a face, as points.
pub(super) enum PointRing {
    Point(u32),
    /// `None` if its edges do not follow each other.
    Points(Option<Vec<u32>>),
}

/// The greatest number of cells of all faces, with one to three facets each.
pub(super) const MAX_CELLS: f64 = 1e6;
