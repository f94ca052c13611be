//! Errors of jobs, frames and their proof.

use std::io;
use std::path::PathBuf;

use lamp_build::{FieldsError, SwathsError};
use lamp_machine::MachineLimit;
use lamp_stack::{NotSquare, StackError};
use thiserror::Error;

use crate::clock::ExposureLimit;
use crate::mirrors::MirrorError;

/// Why there is no job of a build, or why it cannot be shown.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum GantryError {
    /// A page cannot be read.
    #[error(transparent)]
    Stack(#[from] StackError),
    /// A folder of strips cannot be read.
    #[error(transparent)]
    Strips(#[from] FieldsError),
    /// There are no such swaths.
    #[error(transparent)]
    Swaths(#[from] SwathsError),
    /// The machine does not build such layers.
    #[error(transparent)]
    Machine(#[from] MachineLimit),
    /// Mirrors have no light.
    #[error(transparent)]
    Mirrors(#[from] MirrorError),
    /// A file cannot be read or written.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// Pages are not of one build.
    #[error("its pages have several sizes or resolutions, or its strips have other layers")]
    UnlikePages,
    /// The size of pixels is unknown.
    #[error("its pages state no resolution, so no speed follows from their exposures")]
    NoResolution,
    /// Pixels are not square.
    #[error(transparent)]
    NotSquare(#[from] NotSquare),
    /// The machine's file says nothing of a scan.
    #[error("the machine {machine} has no [scan]: add it to its file (docs/gantry.md)")]
    NoScan {
        /// The machine's name.
        machine: String,
    },
    /// Strips were cut for other mirrors.
    #[error(
        "its strips have {strips:?} mirrors and shared columns, and the machine {machine} has \
         {scan:?}: cut the build for this machine (tile --strips)"
    )]
    OtherStrips {
        /// The mirrors and the shared columns of the strips.
        strips: [u32; 2],
        /// The machine's name.
        machine: String,
        /// The machine's mirrors across, and shared columns.
        scan: [u32; 2],
    },
    /// The build was cut for a projector that steps.
    #[error(
        "its fields are for a projector that steps, and a job plans a scan: put the build together \
         first (lamp join)"
    )]
    Fields,
    /// Strips have seams already.
    #[error("its strips were cut with a {0} seam: give the build for another seam")]
    CutSeam(&'static str),
    /// A seam of gray levels is only in strips.
    #[error("a gray seam is for strips (tile --seam gray): a job cuts a build with comb or time")]
    GraySeam,
    /// Strips are cut along the scan, and the swaths of a tilted display are slanted.
    #[error("a tilted display scans slanted swaths: give the build before tile --strips cut it")]
    TiltedStrips,
    /// Tilted mirrors show no shares in time.
    #[error(
        "a tilted display shows neither gray nor seams in time: use --seam comb, and dither the build"
    )]
    TiltedShares,
    /// The mirrors of a tilted display are far from the build's pixels.
    #[error(
        "scan: tilt: mirror_pitch: mirrors of {mirror_um} um do not show pixels of {pixel_um} um: they \
         must be at most 1000 times as large"
    )]
    MirrorPitch {
        /// The distance of mirrors.
        mirror_um: f64,
        /// The distance of pixels.
        pixel_um: f64,
    },
    /// A layer states no exposure.
    #[error(
        "{layer} states no exposure: slice with --material or --exposure-table, or add expose_s to [times] of the machine {machine}"
    )]
    NoExposure {
        /// The layer's name.
        layer: String,
        /// The machine's name.
        machine: String,
    },
    /// The machine cannot give an exposure.
    #[error("{layer}: {limit}")]
    Exposure {
        /// The layer's name.
        layer: String,
        /// The limit of the machine.
        limit: ExposureLimit,
    },
    /// A layer has gray levels, and nothing shows them.
    #[error(
        "{layer} has gray levels: make dots of them with dither, or show them with --gray-by time"
    )]
    Gray {
        /// The layer's name.
        layer: String,
    },
    /// No layer is in the range.
    #[error(
        "no layer is in this range: the build begins with layer {first} and ends with layer {last}"
    )]
    NoLayers {
        /// The first layer's index.
        first: u32,
        /// The last layer's index.
        last: u32,
    },
    /// A job's file is no job.
    #[error("{}: {problem}", path.display())]
    Job {
        /// The file.
        path: PathBuf,
        /// The problem, as a sentence.
        problem: String,
    },
    /// The build cannot be opened.
    #[error("{}, the build of the job: {error}", path.display())]
    Build {
        /// The build.
        path: PathBuf,
        /// Why.
        error: Box<GantryError>,
    },
    /// The build is not the job's.
    #[error("{}: this is not the build that the job was made for: its digest differs", path.display())]
    OtherBuild {
        /// The build.
        path: PathBuf,
    },
}
