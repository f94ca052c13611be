//! Whole parts through the slicer: against closed forms, against a slow
//! obvious twin, and against the rules that the layers keep.

mod closed;
mod closed_forms;
mod common;
mod contours;
mod coverage;
mod even_rows;
mod fill;
mod flat_faces;
mod formats;
mod gerber;
mod gray;
mod layers;
mod pitch;
mod placement;
mod referee;
mod same_bytes;
mod side;
mod stl;
mod ties;
mod trace;
