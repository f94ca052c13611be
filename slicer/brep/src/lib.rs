//! B-rep models to closed facets that know their exact surfaces.
//!
//! A [`Kernel`] is a model as slicing needs it: bodies, their faces as facets that
//! are joined along their edges, and the exact surfaces below. [`check`] says
//! whether the facets of a body are what the file means; what does not pass is not
//! to be sliced. [`polish`] moves crossings of facets onto the surfaces.
//!
//! [`StepModel`] is the kernel that reads STEP in pure Rust. It has to decide little
//! by itself: the facets close because faces share the points of their edges, and
//! loops say on which side of them a face lies.
//!
//! ```
//! use lamp_brep::{Crossing, Kernel, StepModel, check, polish};
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
//! let facet = 100;
//! let [a, b, c] = mesh.corners(&mesh.facets[facet as usize]);
//! let [x_mm, y_mm, z_mm] = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
//! let uv = mesh.uv_at(&mesh.facets[facet as usize], [x_mm, y_mm, z_mm]);
//! let mut crossings = [Crossing { facet, uv, x_mm, y_mm, z_mm }];
//! assert_eq!(polish(&model, &mesh, 0.1, &mut crossings).moved, 1);
//! let x_mm = crossings[0].x_mm;
//! let radius_mm = (x_mm * x_mm + y_mm * y_mm + (z_mm - 15.0).powi(2)).sqrt();
//! assert!((radius_mm - 15.0).abs() < 1e-9);
//! # Ok::<(), lamp_brep::BrepError>(())
//! ```

mod error;
mod gate;
mod geometry;
mod kernel;
mod model;
mod polish;
mod step;
mod tessellate;
mod vector;

pub use error::BrepError;
pub use gate::{BodyFault, BodyReport, check};
pub use kernel::{Body, FaceInfo, Facet, Fault, Finding, Jet, Kernel, Tessellation};
pub use polish::{Crossing, Polished, polish};
pub use step::{StepError, StepModel};
