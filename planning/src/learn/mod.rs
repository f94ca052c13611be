//! Learns from prints: the times of the next from what the last one cured (004 chapter 3).
//!
//! - [`Law`] turns the wrong voxels of each layer into changes of its time.
//! - [`Response`] is what a change of times does to the wrong voxels, by the model.
//! - [`convergence`] tells whether a law's changes shrink the errors of the next prints.
//! - [`LogDoses`] learns from measured heights.
//! - A [`Job`] keeps a stack and all its prints in a folder; [`learn`] turns what was
//!   [`PrintMeasurements`] on the last into the times of the next.

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
