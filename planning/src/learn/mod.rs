//! Learns from prints: plans the next print by the measurements of all earlier ones (004 chapter 3).
//!
//! - [`LightState`] is how far light and resin are from their material, as all prints show it.
//! - [`Law`] turns the wrong voxels of each layer into changes of its time.
//! - [`Response`] is the model's effect of a change of times on the wrong voxels.
//! - [`convergence`] checks whether a law's changes shrink the errors of the next prints.
//! - A [`GlassModel`] finds such a state from the heights that bitmaps cure on a glass: of [`Columns`] by
//!   doses, of [`Rings`] by the kinetics of resin and oxygen.
//! - A [`Job`] keeps a stack and all its prints in a folder; [`learn`] turns the
//!   [`PrintMeasurements`] of the last print into the times of the next.

mod columns;
mod convergence;
mod error;
mod glass;
mod glass_state;
mod heights;
mod job;
mod law;
mod measured;
mod place;
mod response;
mod rings;
mod state;
mod step;

pub use columns::{ColumnLight, Columns, GlassChange};
pub use convergence::{Convergence, convergence, largest_safe_gain};
pub use error::{JobError, JobFileError, LearnError, MeasuredError};
pub use glass::{GlassFit, GlassModel};
pub use glass_state::{GlassNumber, GlassState};
pub use heights::{FaceError, face_at, height_of};
pub use job::{
    Job, JobFile, JobPrint, digest_of_stack, measured_name, print_to_learn_from, profile_name,
    requested_print, sealed_text, take_back,
};
pub use law::{Law, MultiLaw, SHORTEST, errors_of};
pub(crate) use measured::sd_of_place;
pub use measured::{AreaRow, HeightRow, PrintError, PrintMeasurements};
pub use place::PlaceError;
pub(crate) use place::PlacePixels;
pub use response::Response;
pub use rings::{RingChange, Rings};
pub use state::{Factor, LightState, Unseparated};
pub use step::{Learned, Lesson, Method, StateLesson, learn};

#[cfg(test)]
mod prints;
