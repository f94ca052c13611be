//! Reads B-rep models (STEP) and tessellates them into closed facets on exact surfaces.
//!
//! A [`KernelModel`] holds a model and evaluates its surfaces. Its facets share the points of
//! their edges, so they close. [`check`] validates them: a body with faults must not be
//! sliced.
//!
//! [`StepModel`] is the kernel in pure Rust. [`prepare`] reads and validates a file, and
//! heals it if needed.
//!
//! The crate `lamp-brep-occt` has a kernel on OpenCASCADE.
//!
//! ```
//! use lamp_brep::{Jet, KernelModel, StepModel, check};
//! use lamp_fixtures::{StepSample, StepUnit, step};
//!
//! // A sphere of radius 15 mm that stands on z = 0, in inches.
//! let model = StepModel::read(step(StepSample::Sphere, StepUnit::Inch).as_bytes())?;
//! assert_eq!((model.unit(), model.face(0).kind), ("inch", "sphere"));
//!
//! let mesh = model.tessellate(0.1)?;
//! let report = &check(&model, &mesh)[0];
//! assert!(report.faults.is_empty() && report.volume_mm3 < 14_137.0);
//!
//! // A facet is up to a tenth of a millimetre off the sphere. Its surface is exact.
//! let facet = mesh.facets[100];
//! let mut jets = [Jet::default(); 3];
//! model.evaluate(facet.face, &facet.uv, &mut jets);
//! for Jet { point: [x, y, z], .. } in jets {
//!     let radius_mm = (x * x + y * y + (z - 15.0).powi(2)).sqrt();
//!     assert!((radius_mm - 15.0).abs() < 1e-9);
//! }
//! # Ok::<(), lamp_brep::BrepError>(())
//! ```

#![forbid(unsafe_code)]

mod body_report;
mod color;
mod compare;
mod error;
mod geometry;
mod heal;
mod kernel;
mod loops;
mod measure;
mod model;
mod nest;
mod notice;
mod orient;
mod prepare;
mod rays;
mod step;
mod tessellate;
mod validate;
pub mod vector;
mod volume;

pub use body_report::{BodyFault, BodyReport};
pub use color::Color;
pub use compare::{BodyMeasure, BodyPair, Comparison, KernelDifference, MeasurePair, NamedBody};
pub use error::BrepError;
pub use kernel::{
    Body, BrepFacet, BrepFinding, FaceFault, FaceInfo, Jet, KernelModel, Tessellation,
};
pub use notice::{Matter, Notice};
pub use prepare::{OpenedModel, PreparationAttempt, Prepared, ReadFn, prepare};
pub use step::{StepError, StepModel, check_syntax, read_step};
pub use tessellate::MAX_FACETS;
pub use validate::check;
