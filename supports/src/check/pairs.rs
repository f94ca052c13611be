//! Compares the islands of images with the minima of the mesh that they were sliced from.

use std::ops::RangeInclusive;

use lamp_slicing::PLANE_TOLERANCE;
use lamp_slicing::topology::{CornerTable, Minimum, MinimumKind, minima};

use super::findings::{Findings, Island, Region};

/// Where images and mesh disagree about islands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Disagreements {
    /// Minima deeper than a layer without an island, the lowest first.
    pub minima: Vec<LoneMinimum>,
    /// The islands that begin at no minimum, in the order of the findings.
    pub islands: Vec<Island>,
}

/// A minimum of a mesh, along z, with solid above.
#[derive(Clone, Debug, PartialEq)]
pub struct IslandMinimum {
    /// Its first vertex, in millimeters.
    pub point_mm: [f64; 3],
    /// How high the surface rises from it until it meets a lower minimum's, in millimeters.
    pub depth_mm: f64,
    /// Least and greatest x, and least and greatest y, of its vertices in millimeters.
    pub box_mm: [[f64; 2]; 2],
}

impl IslandMinimum {
    /// Finds the island minima of a mesh, the lowest first.
    pub fn of_mesh(table: &CornerTable) -> Vec<Self> {
        let mut found = minima(table, [0.0, 0.0, 1.0]);
        found.retain(|minimum| minimum.kind == MinimumKind::Island);
        let of_minimum = |minimum: &Minimum| {
            let mut box_mm = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
            for &vertex in &minimum.region {
                let point = table.points()[vertex as usize];
                for (side, place) in box_mm.iter_mut().zip(point) {
                    *side = [side[0].min(place), side[1].max(place)];
                }
            }
            Self { point_mm: minimum.point, depth_mm: minimum.depth_mm, box_mm }
        };
        found.iter().map(of_minimum).collect()
    }
}

/// A minimum of the mesh where the images begin no island.
#[derive(Clone, Debug, PartialEq)]
pub struct LoneMinimum {
    /// The first layer that is cut above it.
    pub layer: u32,
    /// Its first vertex, in millimeters.
    pub point_mm: [f64; 3],
    /// How high the surface rises from it until it meets another minimum's, in millimeters.
    pub depth_mm: f64,
    /// The pixel that holds the point, as column and row.
    pub pixel: [u32; 2],
}

impl Findings {
    /// Compares the islands with the minima of the mesh, the lowest first, given how far up in each
    /// layer it was cut: 0 at the bottom, 1 at the top.
    ///
    /// A minimum may first show in a later layer, where it has grown as large as a pixel, and
    /// somewhat to the side. The list of minima may hold some inside other bodies. It is empty if
    /// layers have no known height, thickness, resolution or place.
    pub fn compare_minima(&self, minima: &[IslandMinimum], cut: f64) -> Disagreements {
        let Some(grid) = Grid::new(self, cut) else { return Disagreements::default() };
        let places: Vec<MinimumPlace<'_>> =
            minima.iter().filter_map(|minimum| grid.place(minimum)).collect();
        let mut islands: Vec<&Island> = self.islands.list.iter().chain(&self.specks.list).collect();
        islands.sort_by_key(|island| island.layer);
        let is_lone = |place: &&MinimumPlace<'_>| {
            let first = islands.partition_point(|island| island.layer < *place.layers.start());
            let shown = islands[first..].iter().take_while(|it| place.layers.contains(&it.layer));
            place.is_deep && !shown.into_iter().any(|island| place.begins(island))
        };
        // Minima are in the order of heights, so no later place begins in a lower layer.
        let begins_nowhere = |island: &&Island| {
            !places
                .iter()
                .take_while(|place| *place.layers.start() <= island.layer)
                .any(|place| place.layers.contains(&island.layer) && place.begins(island))
        };
        let lone = places.iter().filter(is_lone);
        Disagreements {
            minima: lone.map(|place| place.lone(&grid)).collect(),
            islands: self.islands.list.iter().filter(begins_nowhere).cloned().collect(),
        }
    }
}

/// How pixels and layers lie in the part's coordinates.
struct Grid {
    origin_mm: [f64; 2],
    pitch_mm: [f64; 2],
    size: [u32; 2],
    /// The heights at which the layers are cut.
    cuts_mm: Vec<f64>,
    thickness_mm: Vec<f64>,
}

impl Grid {
    fn new(findings: &Findings, cut: f64) -> Option<Self> {
        let layers = findings.layers.iter();
        let heights = layers.map(|layer| Some([layer.z_um?, layer.thickness_um?]));
        let heights: Vec<[f64; 2]> = heights.collect::<Option<_>>()?;
        Some(Self {
            origin_mm: findings.origin_mm?,
            pitch_mm: findings.pitch?.mm(),
            size: findings.size,
            cuts_mm: heights.iter().map(|[z, thickness]| (z + cut * thickness) / 1000.0).collect(),
            thickness_mm: heights.iter().map(|[_, thickness]| thickness / 1000.0).collect(),
        })
    }

    /// Returns the first layer that is cut above a height. A height within the tolerance of a plane
    /// counts as lying on it, as in slicing.
    fn layer_above(&self, z_mm: f64) -> usize {
        self.cuts_mm.partition_point(|&cut| cut <= z_mm + PLANE_TOLERANCE.mm())
    }

    fn column(&self, x_mm: f64) -> f64 {
        (x_mm - self.origin_mm[0]) / self.pitch_mm[0]
    }

    fn row(&self, y_mm: f64) -> f64 {
        (self.origin_mm[1] - y_mm) / self.pitch_mm[1]
    }

    /// Returns where a minimum shows; none if it stands on the platform or above the layers.
    fn place<'a>(&self, minimum: &'a IslandMinimum) -> Option<MinimumPlace<'a>> {
        let z_mm = minimum.point_mm[2];
        let layer = self.layer_above(z_mm);
        let &thickness_mm = self.thickness_mm.get(layer).filter(|_| layer > 0)?;
        // It may show a layer later than it begins, once it is as large as a pixel.
        let last = self.layer_above(z_mm + minimum.depth_mm).max(layer + 1);
        let [x, [least_y, most_y]] = minimum.box_mm;
        let sides = [x.map(|x| self.column(x)), [most_y, least_y].map(|y| self.row(y))];
        Some(MinimumPlace {
            minimum,
            // A curved surface reaches below its facets.
            layers: layer as u32 - 1..=last as u32,
            first: layer as u32,
            // Files round heights, so a depth of one layer may pass it by a hair.
            is_deep: minimum.depth_mm > thickness_mm + PLANE_TOLERANCE.mm(),
            sides,
            drift: 2.0 * thickness_mm / self.pitch_mm[0].min(self.pitch_mm[1]),
        })
    }
}

/// Where a minimum shows in the images.
struct MinimumPlace<'a> {
    minimum: &'a IslandMinimum,
    /// The layers that may begin its island.
    layers: RangeInclusive<u32>,
    first: u32,
    is_deep: bool,
    /// Least and greatest column and row.
    sides: [[f64; 2]; 2],
    /// How far the island may be aside for each layer that it begins later, in pixels.
    drift: f64,
}

impl MinimumPlace<'_> {
    /// Returns whether an island of one of the layers begins here.
    fn begins(&self, island: &Island) -> bool {
        let later = f64::from((island.layer + 1).saturating_sub(self.first));
        let aside = 2.0 + later * self.drift;
        let Region { columns, rows } = &island.region;
        [columns, rows].into_iter().zip(self.sides).all(|(range, [least, greatest])| {
            f64::from(range.start) <= greatest + aside && f64::from(range.end) >= least - aside
        })
    }

    fn lone(&self, grid: &Grid) -> LoneMinimum {
        let [x, y, _] = self.minimum.point_mm;
        // A minimum may lie outside the images.
        let pixel = |at: f64, size: u32| (at.max(0.0) as u32).min(size.saturating_sub(1));
        LoneMinimum {
            layer: self.first,
            point_mm: self.minimum.point_mm,
            depth_mm: self.minimum.depth_mm,
            pixel: [pixel(grid.column(x), grid.size[0]), pixel(grid.row(y), grid.size[1])],
        }
    }
}
