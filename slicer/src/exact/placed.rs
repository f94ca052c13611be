//! Places the exact surfaces of a B-rep part on the machine.

use std::fmt;
use std::sync::{Arc, OnceLock};

use lamp_brep::vector::{Vec3, cross, dot, length, scale, sub, unit};
use lamp_brep::{BrepFacet, Jet, KernelModel, Tessellation};
use lamp_stack::Grouped;

use super::critical::CriticalPoints;
use super::curved_edge::CurvedEdges;
use super::rims::Rims;
use crate::facet::{PlacedFacet, Units, rounded};
use crate::placement::Placement;
use crate::transform::Transform;

/// A model's surfaces and facets, scaled, rotated and moved into place.
pub struct PlacedSurfaces {
    kernel: Arc<dyn KernelModel>,
    mesh: Arc<Tessellation>,
    /// The affine map from model to machine coordinates, both in millimeters: one row per
    /// axis.
    rows: [[f64; 4]; 3],
    tolerance_mm: f64,
    /// The number of its first body among all bodies of the part.
    first_body: u32,
    /// Whether each face is flat.
    is_flat: Vec<bool>,
    facets_by_point: OnceLock<Grouped<u32>>,
    pub(super) critical_points: OnceLock<CriticalPoints>,
    pub(super) curved_edges: OnceLock<CurvedEdges>,
    pub(super) rims: OnceLock<Rims>,
}

impl fmt::Debug for PlacedSurfaces {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PlacedSurfaces").field("rows", &self.rows).finish_non_exhaustive()
    }
}

impl PlacedSurfaces {
    /// Places a model with the affine map `rows` from model to machine coordinates, in
    /// millimeters.
    pub fn new(kernel: Arc<dyn KernelModel>, mesh: Arc<Tessellation>, rows: [[f64; 4]; 3]) -> Self {
        // The longest column is the greatest stretch if axes stay at right angles.
        let stretch = |axis: usize| length([rows[0][axis], rows[1][axis], rows[2][axis]]);
        let tolerance_mm = mesh.chord_mm * (0..3).map(stretch).fold(0.0, f64::max);
        let faces = kernel.bodies().iter().map(|body| body.faces.end).max().unwrap_or(0);
        let is_flat = (0..faces).map(|face| kernel.face(face).kind == "plane").collect();
        Self {
            kernel,
            mesh,
            rows,
            tolerance_mm,
            first_body: 0,
            is_flat,
            facets_by_point: OnceLock::new(),
            critical_points: OnceLock::new(),
            curved_edges: OnceLock::new(),
            rims: OnceLock::new(),
        }
    }

    /// Numbers the bodies from a given number on, instead of 0.
    pub(crate) fn numbered_from(self, first_body: u32) -> Self {
        Self { first_body, ..self }
    }

    /// Returns the number of the first body.
    pub(crate) fn first_body(&self) -> usize {
        self.first_body as usize
    }

    /// Returns the number of a facet's body.
    pub(crate) fn body_of(&self, facet: u32) -> u32 {
        let face = self.facet(facet).face;
        let before = self.kernel.bodies().partition_point(|body| body.faces.end <= face);
        self.first_body + before as u32
    }

    /// Returns the greatest distance of facets from their surfaces, in millimeters.
    pub fn tolerance_mm(&self) -> f64 {
        self.tolerance_mm
    }

    /// Returns the facets in model coordinates.
    pub fn mesh(&self) -> &Tessellation {
        &self.mesh
    }

    /// Returns whether a facet's surface is flat, so that the facet itself is exact.
    pub(crate) fn is_flat(&self, facet: u32) -> bool {
        self.is_flat[self.facet(facet).face as usize]
    }

    pub(crate) fn facet(&self, number: u32) -> &BrepFacet {
        &self.mesh.facets[number as usize]
    }

    /// Returns the corners of a placed facet.
    pub(crate) fn corners(&self, number: u32) -> [Vec3; 3] {
        self.mesh.corners(self.facet(number)).map(|corner| self.at(corner))
    }

    /// Returns a facet in place as the slicer cuts it, with its corners rounded.
    pub(super) fn placed_facet(&self, number: u32) -> PlacedFacet {
        let transform = Transform::new(&Placement::of_rows(self.rows), Units::Millimetres);
        transform.placed(&rounded(self.mesh.corners(self.facet(number))))
    }

    fn at(&self, point: Vec3) -> Vec3 {
        let moved = self.turned(point);
        [0, 1, 2].map(|k| moved[k] + self.rows[k][3])
    }

    fn turned(&self, direction: Vec3) -> Vec3 {
        self.rows.map(|[x, y, z, _]| x * direction[0] + y * direction[1] + z * direction[2])
    }

    /// Returns the facets around each point. The first call examines every facet.
    pub(super) fn facets_by_point(&self) -> &Grouped<u32> {
        self.facets_by_point.get_or_init(|| facets_by_point(&self.mesh))
    }

    /// Returns the surfaces turned so that z lies along the rows, x across, and y points up.
    pub(super) fn turned_up(&self) -> Self {
        let [x, y, z] = self.rows;
        Self::new(self.kernel.clone(), self.mesh.clone(), [z, x, y])
    }

    /// Evaluates a face's surface in place at many parameters at once.
    pub(super) fn evaluate(&self, face: u32, uv: &[[f64; 2]], jets: &mut [Jet]) {
        self.kernel.evaluate(face, uv, jets);
        for jet in jets {
            *jet =
                Jet { point: self.at(jet.point), du: self.turned(jet.du), dv: self.turned(jet.dv) };
        }
    }

    /// Returns the widths of a facet's parameters along u and v.
    pub(super) fn uv_size(&self, facet: u32) -> [f64; 2] {
        let [p, q, r] = self.facet(facet).uv;
        [0, 1].map(|k| p[k].max(q[k]).max(r[k]) - p[k].min(q[k]).min(r[k]))
    }

    /// Evaluates a facet's surface at parameters, and slightly farther along u and along v, for
    /// second derivatives by differences.
    pub(super) fn jets(&self, facet: u32, [u, v]: [f64; 2], by: [f64; 2]) -> [Jet; 3] {
        let mut jets = [Jet::default(); 3];
        let at = [[u, v], [u + by[0], v], [u, v + by[1]]];
        self.evaluate(self.facet(facet).face, &at, &mut jets);
        jets
    }

    /// Returns the map from a facet's points to parameters of its surface.
    pub fn chart(&self, facet: u32) -> Chart {
        Chart::new(&self.corners(facet), self.facet(facet).uv)
    }

    /// Returns the surface's unit normal on the facet's outer side, or `None` at a pole or
    /// on a facet without area.
    pub(super) fn normal(&self, facet: u32, jet: &Jet) -> Option<Vec3> {
        let (across, flat) = (unit(cross(jet.du, jet.dv))?, self.facet_normal(facet)?);
        // du × dv may point into the part. The facet's corners show the outside.
        Some(scale(across, dot(across, flat).signum()))
    }

    /// Returns a facet's outward unit normal, or `None` if it has no area.
    pub(super) fn facet_normal(&self, facet: u32) -> Option<Vec3> {
        let [a, b, c] = self.corners(facet);
        unit(cross(sub(b, a), sub(c, a)))
    }
}

/// A linear map from points of a facet to parameters of its surface.
#[derive(Clone, Copy, Debug)]
pub struct Chart {
    corner: Vec3,
    /// Dotted with the vector from the corner, these give the shares of the facet's first
    /// and last side.
    shares: [Vec3; 2],
    uv: [[f64; 2]; 3],
}

impl Chart {
    fn new([a, b, c]: &[Vec3; 3], uv: [[f64; 2]; 3]) -> Self {
        let (e, f) = (sub(*b, *a), sub(*c, *a));
        let (ee, ef, ff) = (dot(e, e), dot(e, f), dot(f, f));
        let det = ee * ff - ef * ef;
        // All points of a facet without area get the parameters of its first corner.
        let per = if det > 0.0 { 1.0 / det } else { 0.0 };
        // The dual basis of both sides: 1 along its own side, 0 along the other.
        let share = |a: Vec3, aa: f64, b: Vec3| scale(sub(scale(a, aa), scale(b, ef)), per);
        Self { corner: *a, shares: [share(e, ff, f), share(f, ee, e)], uv }
    }

    /// Returns a point's barycentric coordinates for the second and third corner, projected
    /// onto the facet's plane.
    pub(super) fn shares_of(&self, point: Vec3) -> [f64; 2] {
        let way = sub(point, self.corner);
        self.shares.map(|share| dot(way, share))
    }

    /// Returns the parameters of a point.
    pub fn uv_at(&self, point: [f64; 3]) -> [f64; 2] {
        let [s, t] = self.shares_of(point);
        let [p, q, r] = self.uv;
        [0, 1].map(|k| p[k] + s * (q[k] - p[k]) + t * (r[k] - p[k]))
    }
}

/// Groups the facets of a tessellation by their corner points.
fn facets_by_point(mesh: &Tessellation) -> Grouped<u32> {
    let facets = || (0..).zip(&mesh.facets);
    Grouped::new(mesh.points.len(), || {
        facets().flat_map(|(k, facet)| facet.corners.map(|point| (point as usize, k)))
    })
}
