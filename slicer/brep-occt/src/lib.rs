//! STEP files read by OpenCASCADE, as a second kernel for B-rep models, and IGES files.
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

use std::ffi::CString;
use std::io::Write;
use std::sync::Arc;

use lamp_brep::{
    Body, BrepError, FaceInfo, Jet, KernelModel, MAX_FACETS, Matter, Notice, OpenedModel,
    Tessellation, check_syntax,
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
    notices: Vec<Notice>,
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
        Ok(Self::new(calls::Model::read(bytes, heal_mm).map_err(library_error)?))
    }

    /// Reads the bytes of an IGES file. Loose faces are sewn within the resolution that the file states,
    /// at most 0.1 mm, or within `heal_mm` if that is more. Closed shells are bodies; open ones, and faces
    /// that meet no other, are bodies with gaps. Curves, points and drawings are left out.
    ///
    /// # Errors
    /// Returns an error if they are not IGES, if a face cannot be read, or if they hold no face.
    pub fn read_iges(bytes: &[u8], heal_mm: f64) -> Result<Self, BrepError> {
        check_end(bytes)?;
        // OpenCASCADE reads IGES by the name of a file alone.
        let file = tempfile::NamedTempFile::new().and_then(|mut file| {
            file.write_all(bytes)?;
            Ok(file)
        });
        let file = file.map_err(|error| library_error(error.to_string()))?;
        let path = c_path(file.path())?;
        Ok(Self::new(calls::Model::read_iges(&path, heal_mm).map_err(library_error)?))
    }

    fn new(inner: calls::Model) -> Self {
        let all = inner.faces();
        let body = |(number, name): (u32, String)| {
            let start = all.partition_point(|face| face.body < number) as u32;
            let end = all.partition_point(|face| face.body <= number) as u32;
            Body { name, faces: start..end }
        };
        let bodies = (0..).zip(inner.names()).map(body).collect();
        let unit = inner.unit();
        let ranges = all.iter().map(|face| face.range).collect();
        let curves = inner.curves();
        let notice = |&entity| Notice { entity, count: curves.len(), matter: Matter::Wire };
        let notices = curves.first().map(notice).into_iter().collect();
        Self { inner, faces: all.iter().map(info).collect(), ranges, bodies, unit, notices }
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

/// Reads the bytes of an IGES file for [`prepare`](lamp_brep::prepare).
///
/// # Errors
/// Returns an error if [`OcctModel::read_iges`] does.
pub fn read_iges(bytes: &[u8], heal_mm: f64) -> Result<OpenedModel, BrepError> {
    let model = OcctModel::read_iges(bytes, heal_mm)?;
    Ok(OpenedModel { kernel: Arc::new(model), is_changed: heal_mm > 0.0 })
}

/// Checks that a file ends with the section that ends IGES files, whose line has its letter in column 73.
/// OpenCASCADE reads a file that was cut off before it as if it were whole.
fn check_end(bytes: &[u8]) -> Result<(), BrepError> {
    let lines = bytes.trim_ascii_end().rsplit(|byte| matches!(byte, b'\n' | b'\r'));
    match lines.into_iter().next().and_then(|line| line.get(72)) {
        Some(b'T' | b't') => Ok(()),
        _ => Err(BrepError::IgesEnd),
    }
}

/// Returns a path as OpenCASCADE takes it.
fn c_path(path: &std::path::Path) -> Result<CString, BrepError> {
    CString::new(path.as_os_str().as_encoded_bytes())
        .map_err(|error| library_error(error.to_string()))
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

    fn notices(&self) -> &[Notice] {
        &self.notices
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
