//! Learns from prints: the times of the next from what the last one cured (004 chapter 3).
//!
//! - [`Law`] turns the wrong voxels of each layer into changes of its time.
//! - [`Response`] is what a change of times does to the wrong voxels, by the model.
//! - [`convergence`] tells whether a law's changes shrink the errors of the next prints.
//! - [`LogDoses`] learns from measured heights.

mod convergence;
mod heights;
mod law;
mod least_squares;
mod response;

pub use convergence::{Convergence, convergence, largest_safe_gain};
pub use heights::{Height, HeightError, LogDoses, face_at, heights_of};
pub use law::{Law, ModelLaw, MultiLaw, SHORTEST, errors_of};
pub use response::Response;

#[cfg(test)]
mod prints;
