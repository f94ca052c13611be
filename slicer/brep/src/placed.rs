//! Surfaces where they stand on the machine.

use std::sync::{Arc, OnceLock};

use crate::kernel::{Facet, Jet, Kernel, Tessellation};
use crate::vector::{Vec3, cross, dot, length, scale, sub, unit};
use crate::walk::Around;

/// A model's surfaces and facets in a place: scaled, turned and moved.
pub struct Placed {
    kernel: Arc<dyn Kernel>,
    mesh: Arc<Tessellation>,
    /// x, y and z of the place in millimetres, by x, y, z of the model and one.
    rows: [[f64; 4]; 3],
    tolerance_mm: f64,
    around: OnceLock<Around>,
    /// Of each face, whether it is flat.
    is_flat: Vec<bool>,
}

impl std::fmt::Debug for Placed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Placed").field("rows", &self.rows).finish_non_exhaustive()
    }
}

impl Placed {
    /// Puts a model into a place: `rows` give x, y and z there, in millimetres, by
    /// x, y and z of the model in millimetres and one.
    pub fn new(kernel: Arc<dyn Kernel>, mesh: Arc<Tessellation>, rows: [[f64; 4]; 3]) -> Self {
        let stretch = |axis: usize| length([rows[0][axis], rows[1][axis], rows[2][axis]]);
        let tolerance_mm = mesh.chord_mm * (0..3).map(stretch).fold(0.0, f64::max);
        let faces = kernel.bodies().iter().map(|body| body.faces.end).max().unwrap_or(0);
        let is_flat = (0..faces).map(|face| kernel.face(face).kind == "plane").collect();
        Self { kernel, mesh, rows, tolerance_mm, around: OnceLock::new(), is_flat }
    }

    /// How far facets may lie from their surfaces, in millimetres.
    pub fn tolerance_mm(&self) -> f64 {
        self.tolerance_mm
    }

    /// The facets, in the model's place.
    pub fn mesh(&self) -> &Tessellation {
        &self.mesh
    }

    /// Whether a facet's surface is flat, and the facet therefore exact.
    pub fn is_flat(&self, facet: u32) -> bool {
        self.is_flat[self.facet(facet).face as usize]
    }

    pub(crate) fn facet(&self, number: u32) -> &Facet {
        &self.mesh.facets[number as usize]
    }

    /// A facet's corners.
    pub fn corners(&self, number: u32) -> [Vec3; 3] {
        self.mesh.corners(self.facet(number)).map(|corner| self.at(corner))
    }

    /// Where a point of the model stands.
    pub(crate) fn at(&self, point: Vec3) -> Vec3 {
        let moved = self.turned(point);
        [0, 1, 2].map(|k| moved[k] + self.rows[k][3])
    }

    fn turned(&self, direction: Vec3) -> Vec3 {
        self.rows.map(|[x, y, z, _]| x * direction[0] + y * direction[1] + z * direction[2])
    }

    /// The facets around each point; a look at every facet the first time.
    pub(crate) fn around(&self) -> &Around {
        self.around.get_or_init(|| Around::new(&self.mesh))
    }

    /// Evaluates a face's surface at many parameters at once.
    pub(crate) fn evaluate(&self, face: u32, uv: &[[f64; 2]], jets: &mut [Jet]) {
        self.kernel.evaluate(face, uv, jets);
        for jet in jets {
            *jet =
                Jet { point: self.at(jet.point), du: self.turned(jet.du), dv: self.turned(jet.dv) };
        }
    }

    /// How far a facet's parameters reach along u and v.
    pub(crate) fn uv_size(&self, facet: u32) -> [f64; 2] {
        let [p, q, r] = self.facet(facet).uv;
        [0, 1].map(|k| p[k].max(q[k]).max(r[k]) - p[k].min(q[k]).min(r[k]))
    }

    /// A facet's surface at parameters, and by so much further along u, and along v.
    pub(crate) fn jets(&self, facet: u32, [u, v]: [f64; 2], by: [f64; 2]) -> [Jet; 3] {
        let mut jets = [Jet::default(); 3];
        let places = [[u, v], [u + by[0], v], [u, v + by[1]]];
        self.evaluate(self.facet(facet).face, &places, &mut jets);
        jets
    }

    /// A facet, to find the parameters of its points.
    pub fn chart(&self, facet: u32) -> Chart {
        Chart::new(&self.corners(facet), self.facet(facet).uv)
    }

    /// The surface's normal as the facet has it, with length 1, if both have one.
    pub(crate) fn normal(&self, facet: u32, jet: &Jet) -> Option<Vec3> {
        let (across, flat) = (unit(cross(jet.du, jet.dv))?, self.outwards(facet)?);
        Some(scale(across, dot(across, flat).signum()))
    }

    /// Out of the body across a facet, with length 1, if the facet has an area.
    pub(crate) fn outwards(&self, facet: u32) -> Option<Vec3> {
        let [a, b, c] = self.corners(facet);
        unit(cross(sub(b, a), sub(c, a)))
    }
}

/// The way from places on a facet to parameters, as straight between its corners.
#[derive(Clone, Copy, Debug)]
pub struct Chart {
    corner: Vec3,
    /// What of a way along the facet is along its first side, and along its last.
    shares: [Vec3; 2],
    uv: [[f64; 2]; 3],
}

impl Chart {
    fn new([a, b, c]: &[Vec3; 3], uv: [[f64; 2]; 3]) -> Self {
        let (e, f) = (sub(*b, *a), sub(*c, *a));
        let (ee, ef, ff) = (dot(e, e), dot(e, f), dot(f, f));
        let det = ee * ff - ef * ef;
        // A facet without area is as good as its first corner.
        let per = if det > 0.0 { 1.0 / det } else { 0.0 };
        let share = |a: Vec3, aa: f64, b: Vec3| scale(sub(scale(a, aa), scale(b, ef)), per);
        Self { corner: *a, shares: [share(e, ff, f), share(f, ee, e)], uv }
    }

    /// How much of the second and of the third corner a point has that lies on the
    /// facet, or straight above it.
    pub(crate) fn parts(&self, point: Vec3) -> [f64; 2] {
        let way = sub(point, self.corner);
        self.shares.map(|share| dot(way, share))
    }

    /// The parameters of a point.
    pub fn uv_at(&self, point: [f64; 3]) -> [f64; 2] {
        let [s, t] = self.parts(point);
        let [p, q, r] = self.uv;
        [0, 1].map(|k| p[k] + s * (q[k] - p[k]) + t * (r[k] - p[k]))
    }
}
