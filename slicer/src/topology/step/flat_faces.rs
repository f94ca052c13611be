//! Joins facets in one plane into faces.

use lamp_brep::vector::{Vec3, cross, dot, length, scale, sub};
use lamp_stack::Grouped;

use crate::topology::{CornerTable, facet_of};

/// The greatest distance of vertices from a face's plane, as a share of the part's size.
const FLAT: f64 = 1e-9;

/// No face yet.
const NONE: u32 = u32::MAX;

/// Facets by the flat face that contains them.
#[derive(Debug)]
pub(super) struct FlatFaces {
    of_facet: Vec<u32>,
    count: u32,
    facets: Grouped<u32>,
}

/// The plane of a facet.
struct Plane {
    point: Vec3,
    /// Of length 1.
    normal: Vec3,
}

impl FlatFaces {
    /// Finds the faces. The largest facets determine the planes, because their planes are known
    /// best: each takes all facets connected to it within its own plane.
    pub(super) fn new(table: &CornerTable) -> Self {
        let count = table.facet_count() as u32;
        // 32 bits are enough to sort by, and halve the memory.
        let areas: Vec<f32> =
            (0..count).map(|facet| length(twice_area(table, facet)) as f32).collect();
        let mut by_area: Vec<u32> = (0..count).collect();
        by_area.sort_unstable_by(|&a, &b| {
            areas[b as usize].total_cmp(&areas[a as usize]).then_with(|| a.cmp(&b))
        });
        drop(areas);
        let tolerance = FLAT * size(table);
        let mut of_facet = vec![NONE; count as usize];
        let mut waiting = Vec::new();
        let mut face = 0;
        for seed in by_area {
            if of_facet[seed as usize] == NONE {
                of_facet[seed as usize] = face;
                waiting.push(seed);
                grow(table, &Plane::of(table, seed), tolerance, &mut waiting, &mut of_facet);
                face += 1;
            }
        }
        Self::numbered(of_facet)
    }

    /// Numbers the faces by their first facets.
    fn numbered(mut of_facet: Vec<u32>) -> Self {
        let mut numbers = vec![NONE; of_facet.len()];
        let mut count = 0;
        for face in &mut of_facet {
            let number = &mut numbers[*face as usize];
            if *number == NONE {
                *number = count;
                count += 1;
            }
            *face = *number;
        }
        drop(numbers);
        let by_face = || (0..).zip(&of_facet).map(|(facet, &face)| (face as usize, facet));
        Self { facets: Grouped::new(count as usize, by_face), count, of_facet }
    }

    /// Makes each facet of bad faces a separate face. `is_bad` judges a face by its facets.
    pub(super) fn split_where(&mut self, is_bad: impl Fn(&Self, &[u32]) -> bool) {
        let mut count = self.count();
        let mut of_facet = self.of_facet.clone();
        for face in 0..self.count() {
            let facets = self.facets(face);
            if facets.len() > 1 && is_bad(self, facets) {
                for &facet in &facets[1..] {
                    of_facet[facet as usize] = count;
                    count += 1;
                }
            }
        }
        if count > self.count() {
            *self = Self::numbered(of_facet);
        }
    }

    pub(super) fn count(&self) -> u32 {
        self.count
    }

    /// Returns the facets of a face, in rising order.
    pub(super) fn facets(&self, face: u32) -> &[u32] {
        self.facets.group(face as usize)
    }

    /// Returns true if the edge opposite to a corner is between two faces.
    pub(super) fn is_side(&self, table: &CornerTable, corner: u32) -> bool {
        let face = |corner: u32| self.of_facet[facet_of(corner) as usize];
        table.opposite(corner).is_none_or(|across| face(across) != face(corner))
    }
}

impl Plane {
    fn of(table: &CornerTable, facet: u32) -> Self {
        let twice_area = twice_area(table, facet);
        // `check_solid` has refused facets without area.
        let normal = scale(twice_area, 1.0 / length(twice_area));
        Self { point: table.point(3 * facet), normal }
    }

    /// Returns true if a facet is in the plane, and faces the same way.
    fn holds(&self, table: &CornerTable, facet: u32, tolerance: f64) -> bool {
        let is_in = |point: Vec3| dot(sub(point, self.point), self.normal).abs() <= tolerance;
        table.facet(facet).into_iter().all(is_in)
            && dot(twice_area(table, facet), self.normal) > 0.0
    }
}

/// Adds all facets in a plane that the waiting facets lead to.
fn grow(
    table: &CornerTable,
    plane: &Plane,
    tolerance: f64,
    waiting: &mut Vec<u32>,
    of_facet: &mut [u32],
) {
    while let Some(facet) = waiting.pop() {
        for corner in 3 * facet..3 * facet + 3 {
            let Some(across) = table.opposite(corner).map(facet_of) else { continue };
            if of_facet[across as usize] == NONE && plane.holds(table, across, tolerance) {
                of_facet[across as usize] = of_facet[facet as usize];
                waiting.push(across);
            }
        }
    }
}

/// Returns the outward normal of a facet, twice as long as its area.
fn twice_area(table: &CornerTable, facet: u32) -> Vec3 {
    let [a, b, c] = table.facet(facet);
    cross(sub(b, a), sub(c, a))
}

/// Returns the longest side of the part's box.
fn size(table: &CornerTable) -> f64 {
    let extent = |axis: usize| {
        let along = table.points().iter().map(|point| point[axis]);
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    };
    [0, 1, 2].map(extent).into_iter().fold(0.0, f64::max)
}
