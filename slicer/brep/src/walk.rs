//! From facet to facet.

use crate::kernel::Tessellation;
use crate::placed::Placed;
use crate::vector::{Vec3, add, distance, dot, scale, sub};

/// How far from its facet a point may be, in the distances that facets may lie from
/// surfaces.
const NEAR: f64 = 2.0;
/// So many facets are passed on the way from one to another.
const MOST_FACETS: usize = 256;

/// The facets around each point.
#[derive(Debug, Default)]
pub(crate) struct Around {
    facets: Vec<u32>,
    /// Where those of each point begin.
    starts: Vec<u32>,
}

impl Around {
    pub(crate) fn new(mesh: &Tessellation) -> Self {
        let mut starts = vec![0; mesh.points.len() + 2];
        let corners = || mesh.facets.iter().flat_map(|facet| facet.corners);
        corners().for_each(|corner| starts[corner as usize + 2] += 1);
        for point in 2..starts.len() {
            starts[point] += starts[point - 1];
        }
        let mut facets = vec![0; 3 * mesh.facets.len()];
        for (k, corner) in corners().enumerate() {
            let next: &mut u32 = &mut starts[corner as usize + 1];
            facets[*next as usize] = (k / 3) as u32;
            *next += 1;
        }
        Self { facets, starts }
    }

    fn of(&self, point: u32) -> &[u32] {
        let point = point as usize;
        &self.facets[self.starts[point] as usize..self.starts[point + 1] as usize]
    }
}

impl Placed {
    /// The facet below a point of a surface, on the way there from another.
    pub(crate) fn facet_below(&self, facet: u32, point: Vec3) -> Option<u32> {
        let away = |facet: u32| (self.distance_to(facet, point), facet);
        let mut nearest = away(facet);
        for _ in 0..MOST_FACETS {
            let corners = self.facet(nearest.1).corners.into_iter();
            let around = corners.flat_map(|corner| self.around().of(corner));
            let next = around
                .map(|&facet| away(facet))
                .fold(nearest, |a, b| if b.0 < a.0 { b } else { a });
            if next.0 >= nearest.0 {
                break;
            }
            nearest = next;
        }
        (nearest.0 < NEAR * self.tolerance_mm()).then_some(nearest.1)
    }

    /// Whether a point is as near to a facet as surfaces are.
    pub(crate) fn is_below(&self, facet: u32, point: Vec3) -> bool {
        self.distance_to(facet, point) < NEAR * self.tolerance_mm()
    }

    /// How far a point is from a facet.
    fn distance_to(&self, facet: u32, point: Vec3) -> f64 {
        let [s, t] = self.chart(facet).parts(point);
        let [a, b, c] = self.corners(facet);
        if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
            let foot = add(a, add(scale(sub(b, a), s), scale(sub(c, a), t)));
            return distance(foot, point);
        }
        let to_side = |(p, q): (Vec3, Vec3)| {
            let (way, to) = (sub(q, p), sub(point, p));
            let part = (dot(to, way) / dot(way, way).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            distance(add(p, scale(way, part)), point)
        };
        [(a, b), (b, c), (c, a)].map(to_side).into_iter().fold(f64::INFINITY, f64::min)
    }
}
