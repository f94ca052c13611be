//! STEP files read by OpenCASCADE, as a second kernel for B-rep models.
//!
//! Without the feature `occt` the crate is empty; with it, OpenCASCADE must be installed.
//! `OcctModel` supports more surfaces and curves than `lamp_brep::StepModel`, and repairs
//! more. OpenCASCADE can crash on a broken file: read untrusted files in a separate
//! process.

#![cfg(feature = "occt")]

mod calls;
mod count;
mod join;
mod refine;

use std::sync::Arc;

use lamp_brep::{
    Body, BrepError, FaceInfo, Jet, KernelModel, MAX_FACETS, OpenedModel, Tessellation,
    check_syntax,
};

/// A STEP file in memory, read by OpenCASCADE.
///
/// Reading repairs small errors of the file. Edges are projected onto their surfaces within
/// 10 nm, whatever accuracy the file claims. Solids are bodies, and so are shells outside
/// solids; faces outside shells are left out. A face that was merged into another may have
/// lost its entity's number.
pub struct OcctModel {
    inner: calls::Model,
    faces: Vec<FaceInfo>,
    /// The parameter ranges of each face.
    ranges: Vec<[[f64; 2]; 2]>,
    bodies: Vec<Body>,
    unit: String,
}

impl OcctModel {
    /// Reads a file's bytes.
    ///
    /// # Errors
    /// Returns an error if they are not STEP, or contain no solid.
    pub fn read(bytes: &[u8]) -> Result<Self, BrepError> {
        Self::of(bytes, 0.0)
    }

    /// Reads a file's bytes and repairs its bodies: edges and vertices may move, and gaps
    /// are closed, by up to a tolerance in millimeters.
    ///
    /// # Errors
    /// Returns an error as [`Self::read`] does, or if the tolerance is not a positive
    /// length.
    pub fn read_healed(bytes: &[u8], heal_mm: f64) -> Result<Self, BrepError> {
        if heal_mm > 0.0 && heal_mm.is_finite() {
            Self::of(bytes, heal_mm)
        } else {
            Err(BrepError::Heal { heal_mm })
        }
    }

    fn of(bytes: &[u8], heal_mm: f64) -> Result<Self, BrepError> {
        // OpenCASCADE continues after invalid text, so the syntax is checked first.
        check_syntax(bytes)?;
        let inner = calls::Model::read(bytes, heal_mm).map_err(library_error)?;
        let all = inner.faces();
        let body = |(number, name): (u32, String)| {
            let start = all.partition_point(|face| face.body < number) as u32;
            let end = all.partition_point(|face| face.body <= number) as u32;
            Body { name, faces: start..end }
        };
        let bodies = (0..).zip(inner.names()).map(body).collect();
        let unit = inner.unit();
        let ranges = all.iter().map(|face| face.range).collect();
        Ok(Self { inner, faces: all.iter().map(info).collect(), ranges, bodies, unit })
    }
}

impl std::fmt::Debug for OcctModel {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("OcctModel").field("bodies", &self.bodies).finish_non_exhaustive()
    }
}

fn library_error(message: String) -> BrepError {
    BrepError::Library { library: "OpenCASCADE", message }
}

/// Reads a file's bytes for [`prepare`](lamp_brep::prepare).
///
/// # Errors
/// Returns an error if [`OcctModel::read_healed`] does.
pub fn read(bytes: &[u8], heal_mm: f64) -> Result<OpenedModel, BrepError> {
    let is_changed = heal_mm > 0.0;
    let model =
        if is_changed { OcctModel::read_healed(bytes, heal_mm)? } else { OcctModel::read(bytes)? };
    Ok(OpenedModel { kernel: Arc::new(model), is_changed })
}

fn info(face: &calls::Face) -> FaceInfo {
    // The order of GeomAbs_SurfaceType.
    const KINDS: [&str; 10] = [
        "plane",
        "cylinder",
        "cone",
        "sphere",
        "torus",
        "Bezier",
        "B-spline",
        "revolution",
        "extrusion",
        "offset",
    ];
    FaceInfo {
        kind: KINDS.get(face.kind as usize).copied().unwrap_or("other"),
        entity: face.entity,
        // OpenCASCADE has determined the sides.
        is_closed: false,
        control_box_mm: (face.has_box != 0).then_some(face.box_mm),
    }
}

impl KernelModel for OcctModel {
    fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    fn face(&self, face: u32) -> FaceInfo {
        self.faces[face as usize].clone()
    }

    fn unit(&self) -> &str {
        &self.unit
    }

    fn tessellate(&self, chord_mm: f64) -> Result<Tessellation, BrepError> {
        if !(chord_mm > 0.0 && chord_mm.is_finite()) {
            return Err(BrepError::Chord { chord_mm });
        }
        // OpenCASCADE would practically never finish.
        if count::facets(self, &self.ranges, chord_mm)? > MAX_FACETS as f64 {
            return Err(BrepError::TooMany { most: MAX_FACETS });
        }
        let parallel = rayon::current_num_threads() > 1;
        let mesh = self.inner.mesh(chord_mm, parallel);
        let mesh = mesh.map_err(library_error)?;
        join::joined(self, &mesh, chord_mm)
    }

    fn evaluate(&self, face: u32, uv: &[[f64; 2]], jets: &mut [Jet]) {
        self.inner.evaluate(face as usize, uv, jets);
    }
}
