//! Finds the minima of a mesh in a direction, where islands and pits begin.

mod region;
mod sweep;

use lamp_brep::vector::dot;
use lamp_stack::Grouped;

use crate::topology::{CornerTable, facet_of, next, previous};
use region::{level_regions, section_area};
use sweep::depths;

/// The feature that begins at a minimum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MinimumKind {
    /// Solid is above: built upward, an island begins, or the part itself.
    Island,
    /// Solid is below: the minimum is the floor of a pit.
    Pit,
}

/// A point or a level region of a mesh with no lower neighbor.
#[derive(Clone, Debug, PartialEq)]
pub struct Minimum {
    /// Its height along the direction, in millimeters from the origin.
    pub height_mm: f64,
    /// Its first vertex's point.
    pub point: [f64; 3],
    /// Its vertices, all at one height and joined by edges, in ascending order.
    pub region: Vec<u32>,
    /// The feature that begins there. If the facets around do not decide, as in an open or flat
    /// mesh, it is an island.
    pub kind: MinimumKind,
    /// The rise of the surface from the minimum to its meeting with the surface of a lower minimum,
    /// or else to its top, in millimeters.
    ///
    /// Of two minima at the same height, the one with the first vertex counts as lower. Surfaces
    /// meet by edges: bodies that only overlap, and shells within one another, do not meet.
    pub depth_mm: f64,
}

/// Finds the minima of a mesh along a unit vector that points up, the lowest first.
///
/// Vertices joined by an edge at exactly equal heights are one region. Facets that are idle or
/// turned over, boundary edges and crowded edges change the findings near them, and nothing else.
///
/// ```
/// use lamp_slicing::topology::{CornerTable, MinimumKind, minima};
/// use lamp_slicing::{Part, Placement, Units};
///
/// // A tetrahedron on its tip.
/// let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0], [-1.0, -1.0, 2.0f32]];
/// let part = Part::from_facets("tip", vec![[o, y, x], [o, z, y], [o, x, z], [x, y, z]]);
/// let table = CornerTable::of_part(&part, &Placement::default(), Units::Millimetres)?;
/// let found = minima(&table, [0.0, 0.0, 1.0]);
/// assert_eq!((found.len(), found[0].kind, found[0].depth_mm), (1, MinimumKind::Island, 2.0));
/// # Ok::<(), lamp_slicing::SliceError>(())
/// ```
pub fn minima(table: &CornerTable, up: [f64; 3]) -> Vec<Minimum> {
    let relief = Relief::new(table);
    relief.minima(up, &relief.heights(up), f64::INFINITY)
}

/// A mesh for finding minima in several directions.
#[derive(Clone, Debug)]
pub struct Relief<'a> {
    table: &'a CornerTable,
    /// The corners at each vertex, without the corners of idle facets.
    corners: Grouped<u32>,
    has_idle: bool,
}

impl<'a> Relief<'a> {
    /// Prepares a mesh. It takes 12 bytes per facet and 4 bytes per vertex.
    pub fn new(table: &'a CornerTable) -> Self {
        let corners = || {
            let corners = 0..table.corner_count();
            let busy = corners.filter(|&corner| !table.is_idle(facet_of(corner)));
            busy.map(|corner| (table.vertex(corner) as usize, corner))
        };
        let corners = Grouped::new(table.points().len(), corners);
        Self { table, has_idle: corners.items().len() < table.corner_count() as usize, corners }
    }

    /// Returns the heights of all vertices along a unit vector that points up.
    pub fn heights(&self, up: [f64; 3]) -> Vec<f64> {
        self.table.points().iter().map(|&point| dot(up, point)).collect()
    }

    /// Finds the minima as [`minima`](fn@minima) does, with the [`heights`](Self::heights) along
    /// `up`. Depths are followed up to `deepest_mm`, and greater depths are cut off there: then the
    /// work is little more than a look at each facet.
    ///
    /// # Panics
    /// Panics if there are fewer heights than vertices.
    pub fn minima(&self, up: [f64; 3], heights: &[f64], deepest_mm: f64) -> Vec<Minimum> {
        let field = HeightField { relief: self, heights };
        let regions = level_regions(&field);
        let depths = depths(&field, &regions, deepest_mm);
        let minimum = |(region, depth_mm): (Vec<u32>, f64)| Minimum {
            height_mm: heights[region[0] as usize],
            point: self.table.points()[region[0] as usize],
            kind: match section_area(&field, &region, up) < 0.0 {
                true => MinimumKind::Pit,
                false => MinimumKind::Island,
            },
            region,
            depth_mm,
        };
        regions.into_iter().zip(depths).map(minimum).collect()
    }
}

/// The heights of a mesh's vertices.
struct HeightField<'a> {
    relief: &'a Relief<'a>,
    heights: &'a [f64],
}

impl HeightField<'_> {
    fn height(&self, vertex: u32) -> f64 {
        self.heights[vertex as usize]
    }

    /// Returns the corners at a vertex.
    fn corners(&self, vertex: u32) -> &[u32] {
        self.relief.corners.group(vertex as usize)
    }

    /// Returns the neighbors of a vertex, most of them twice.
    fn beside(&self, vertex: u32) -> impl Iterator<Item = u32> {
        let table = self.relief.table;
        let ends = |&corner: &u32| [next(corner), previous(corner)].map(|c| table.vertex(c));
        self.corners(vertex).iter().flat_map(ends)
    }
}

#[cfg(test)]
mod tests;
