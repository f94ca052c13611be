//! Learns from prints: corrects the times of the next print by the result of the last (004 chapter
//! 3).
//!
//! - [`Law`] turns the wrong voxels of each layer into changes of its time.
//! - [`Response`] is the model's effect of a change of times on the wrong voxels.
//! - [`convergence`] checks whether a law's changes shrink the errors of the next prints.
//! - [`LogDoses`] learns from measured heights.
//! - A [`Job`] keeps a stack and all its prints in a folder; [`learn`] turns the
//!   [`PrintMeasurements`] of the last print into the times of the next.

mod convergence;
mod error;
mod heights;
mod job;
mod law;
mod least_squares;
mod measured;
mod response;
mod step;

pub use convergence::{Convergence, convergence, largest_safe_gain};
pub use error::{JobError, JobFileError, LearnError, MeasuredError};
pub use heights::{FaceError, Height, LogDoses, face_at, heights_of};
pub use job::{Job, JobFile, JobPrint, digest_of_stack, profile_name};
pub use law::{Law, ModelLaw, MultiLaw, SHORTEST, errors_of};
pub use measured::{AreaRow, HeightRow, PrintMeasurements};
pub use response::Response;
pub use step::{Learned, learn};

#[cfg(test)]
mod prints;
