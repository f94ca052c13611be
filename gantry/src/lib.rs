//! From a build to a projector that scans.
//!
//! A display shows M mirrors across the scan and N along it; one mirror is one pixel of pitch p on
//! the resin. While the head moves at a speed v, the picture scrolls by one row every p / v, so a
//! point sees its pixel for N rows: t = N p / v.
//!
//! - A [`Job`] has, for each layer of a build, the speed that gives its exposure and the swaths in the
//!   order of the least way; [`BuildPages`] reads their images, and a [`JobFolder`] keeps it.
//! - [`Frames`] are what the mirrors show, row by row; [`FrameWriter`] and [`FrameReader`] put them into
//!   files. A [`MirrorArray`] has the light of each mirror, and makes up for what is uneven or dead.
//! - [`expose`] replays frames as a machine would and adds up the dose of every pixel. It shares no
//!   code with the frames but their form, so it is their referee.
//! - A [`BuildClock`] adds up how long a build takes on a machine, whether it scans or not.
//!
//! Source: the model is this project's own. 002 states that the exposure scans continuously (section
//! 3.4.2.1) with one source of fixed power (section 3.3.2).

mod bit_counts;
mod clock;
mod dose;
mod error;
mod frame_file;
mod frames;
mod job;
mod job_folder;
mod mirrors;
mod motion;
mod route;
mod source;
mod tilt;
mod tilted_dose;
mod tilted_window;
mod time;

pub use clock::{ExposureLimit, RowClock};
pub use dose::{Dark, Disturbance, LayerDose, SeamDose, SwathDose, WorstPixel, expose};
pub use error::GantryError;
pub use frame_file::{FrameFileError, FrameHeader, FrameReader, FrameWriter};
pub use frames::{Frame, Frames, SwathImage};
pub use job::{GrayBy, JOB_SCHEMA, Job, JobLayer, JobOptions, JobSeam, JobSums, JobSwath, JobTilt};
pub use job_folder::{JobFolder, seen_from};
pub use mirrors::{MirrorArray, MirrorError};
pub use motion::move_s;
pub use source::{BuildPages, SwathLayout};
pub use tilt::TiltedMirrors;
pub use time::{BuildClock, BuildTime, FieldTime, GivenTimes, SwathTime};
