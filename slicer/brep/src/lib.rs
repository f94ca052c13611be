//! B-rep models to closed facets that know their exact surfaces.
//!
//! A [`Kernel`] is a model as slicing needs it: bodies, their faces as facets that
//! are joined along their edges, and the exact surfaces below. [`check`] says
//! whether the facets of a body are what the file means; what does not pass is not
//! to be sliced. [`polish`] moves crossings of facets onto the surfaces.
//!
//! [`StepModel`] is the kernel that reads STEP in pure Rust. It has to decide little
//! by itself: the facets close because faces share the points of their edges, and
//! loops say on which side of them a face lies. [`prepare`] opens, heals and checks a
//! file in as many ways as it takes.
//!
//! With the feature `occt`, `OcctModel` is the kernel that has OpenCASCADE read the
//! file and make the facets.
//!
//! ```
//! use std::sync::Arc;
//!
//! use lamp_brep::{Crossing, Fate, Kernel, Placed, StepModel, check, polish};
//! use lamp_fixtures::{StepPart, StepUnit, step};
//!
//! // A sphere of radius 15 mm that stands on z = 0, in inches.
//! let model = StepModel::read(step(StepPart::Sphere, StepUnit::Inch).as_bytes())?;
//! assert_eq!((model.unit(), model.face(0).kind), ("inch", "sphere"));
//!
//! let mesh = model.tessellate(0.1)?;
//! let report = &check(&model, &mesh)[0];
//! assert!(report.faults.is_empty() && report.volume_mm3 < 14_137.0);
//!
//! // A facet is off by up to a tenth of a millimetre; its crossing need not be.
//! let rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
//! let placed = Placed::new(Arc::new(model), Arc::new(mesh), rows);
//! let [a, b, c] = placed.mesh().corners(&placed.mesh().facets[100]);
//! let [x_mm, y_mm, z_mm] = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
//! let uv = placed.chart(100).uv_at([x_mm, y_mm, z_mm]);
//! let (enters, fate) = (x_mm < 0.0, Fate::OnFacet);
//! let mut crossings = [Crossing { facet: 100, uv, x_mm, y_mm, z_mm, enters, fate }];
//! polish(&placed, &mut crossings);
//! let Crossing { x_mm, fate, .. } = crossings[0];
//! let radius_mm = (x_mm * x_mm + y_mm * y_mm + (z_mm - 15.0).powi(2)).sqrt();
//! assert!(fate == Fate::Moved && (radius_mm - 15.0).abs() < 1e-9);
//! # Ok::<(), lamp_brep::BrepError>(())
//! ```

mod error;
mod extent;
mod gate;
mod geometry;
mod heal;
mod kernel;
mod model;
#[cfg(feature = "occt")]
mod occt;
mod orient;
mod placed;
mod polish;
mod prepare;
mod saddle;
mod solve;
mod step;
mod tessellate;
mod turn;
mod vector;
mod walk;

pub use error::BrepError;
pub use gate::{BodyFault, BodyReport, check};
pub use kernel::{Body, FaceInfo, Facet, Fault, Finding, Jet, Kernel, Tessellation};
#[cfg(feature = "occt")]
pub use occt::OcctModel;
pub use placed::{Chart, Placed};
pub use polish::{Crossing, Fate, Probe, polish, polish_heights};
pub use prepare::{KernelName, Prepared, Try, prepare};
pub use saddle::Saddle;
pub use step::{StepError, StepModel};
pub use turn::{Meets, Turn, Turns};
