//! A simulated machine: prints a job as a machine and a resin do that differ from the job's
//! material, and measures the print as a person does.
//!
//! - [`Truth`] says how they differ, and [`TrueField`] has a picture of the machine's light.
//! - [`SimulatedPrint`] counts the wrong pixels of a print, measures heights on it, and gives its
//!   body as cured layers.
//! - [`GlassPrint`] measures the heights that bitmaps cure on a glass.

mod error;
mod faces;
mod field;
mod glass;
mod print;
mod truth;

pub use error::{PrintSimError, TruthError};
pub use field::{FieldKind, TrueField};
pub use glass::GlassPrint;
pub use print::{CuredBody, SimulatedHeights, SimulatedPrint};
pub use truth::{Change, TrueNumber, Truth};
