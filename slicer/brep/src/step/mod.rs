//! Reads STEP files (ISO 10303-21; application protocols AP203, AP214 and AP242).

mod assembly;
mod contents;
mod entities;
mod error;
mod free_face;
mod place;
mod product;
mod read_curve;
mod read_pcurve;
mod read_placement;
mod read_spline;
mod read_surface;
mod shapes;
mod styles;
mod token;
mod topology;
mod units;

use std::sync::Arc;

pub use error::StepError;

use crate::color::Color;
use crate::error::BrepError;
use crate::heal::heal;
use crate::kernel::{Body, BrepFinding, FaceInfo, Jet, KernelModel, Tessellation};
use crate::loops::reverse_contrary;
use crate::model::BrepModel;
use crate::notice::Notice;
use crate::prepare::OpenedModel;
use crate::tessellate;

/// Checks the syntax of a STEP file, but not the meaning of its entities.
///
/// # Errors
/// Returns an error that names the invalid byte or entity.
pub fn check_syntax(bytes: &[u8]) -> Result<(), StepError> {
    entities::Entities::read(bytes).map(drop)
}

/// Reads a file's bytes for [`prepare`](crate::prepare).
///
/// # Errors
/// Returns an error if [`StepModel::read_healed`] does.
pub fn read_step(bytes: &[u8], heal_mm: f64) -> Result<OpenedModel, BrepError> {
    let model = StepModel::read_healed(bytes, heal_mm)?;
    Ok(OpenedModel { is_changed: model.is_healed(), kernel: Arc::new(model) })
}

/// A STEP file in memory, read in pure Rust.
#[derive(Debug)]
pub struct StepModel {
    model: BrepModel,
    /// A finding for each face with joined edges.
    healed: Vec<BrepFinding>,
    /// A finding for each face with reversed loops.
    reversed: Vec<BrepFinding>,
}

impl StepModel {
    /// Reads a file's bytes without healing.
    ///
    /// # Errors
    /// Returns an error if they are not STEP or contain something unsupported.
    pub fn read(bytes: &[u8]) -> Result<Self, BrepError> {
        Self::read_healed(bytes, 0.0)
    }

    /// Reads a file's bytes, and joins unshared edges that run within `heal_mm` of each
    /// other. The tessellation's findings list them.
    ///
    /// # Errors
    /// Returns an error if they are not STEP or contain something unsupported.
    pub fn read_healed(bytes: &[u8], heal_mm: f64) -> Result<Self, BrepError> {
        let mut model = topology::model(&entities::Entities::read(bytes)?)?;
        let healed = if heal_mm > 0.0 { heal(&mut model, heal_mm) } else { Vec::new() };
        // After healing, more loops share edges that show their directions.
        let reversed = reverse_contrary(&mut model);
        Ok(Self { model, healed, reversed })
    }

    /// Returns the model, which tests damage.
    #[cfg(test)]
    pub(crate) fn model_mut(&mut self) -> &mut BrepModel {
        &mut self.model
    }

    /// Returns whether anything was joined.
    pub fn is_healed(&self) -> bool {
        !self.healed.is_empty()
    }
}

impl KernelModel for StepModel {
    fn bodies(&self) -> &[Body] {
        &self.model.bodies
    }

    fn face(&self, face: u32) -> FaceInfo {
        let face = &self.model.faces[face as usize];
        FaceInfo {
            kind: face.surface.kind(),
            entity: face.entity,
            is_closed: face.surface.is_closed(),
            control_box_mm: face.surface.control_box(),
        }
    }

    fn color(&self, face: u32) -> Option<Color> {
        self.model.faces[face as usize].color
    }

    fn unit(&self) -> &str {
        &self.model.unit
    }

    fn uncertainty_mm(&self) -> Option<f64> {
        self.model.uncertainty_mm
    }

    fn notices(&self) -> &[Notice] {
        &self.model.notices
    }

    fn free_edges(&self) -> usize {
        self.model.free_edges().len()
    }

    fn longest_mm(&self) -> f64 {
        let places = || self.model.vertices.iter();
        let side = |k: usize| {
            let ends = places().fold([f64::MAX, f64::MIN], |[a, b], p| [a.min(p[k]), b.max(p[k])]);
            ends[1] - ends[0]
        };
        // Without vertices, sides are below zero.
        (0..3).map(side).fold(0.0, f64::max)
    }

    fn tessellate(&self, chord_mm: f64) -> Result<Tessellation, BrepError> {
        let mut mesh = tessellate::model(&self.model, chord_mm)?;
        mesh.findings.extend_from_slice(&self.healed);
        mesh.findings.extend_from_slice(&self.reversed);
        Ok(mesh)
    }

    fn evaluate(&self, face: u32, uv: &[[f64; 2]], jets: &mut [Jet]) {
        assert_eq!(uv.len(), jets.len(), "as many jets as parameters");
        self.model.faces[face as usize].surface.evaluate(uv, jets);
    }
}
