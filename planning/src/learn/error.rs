//! Why nothing can be learned from a print.

use std::io;
use std::path::PathBuf;

use lamp_grayscale::calibrate::{DataError, TableError};
use lamp_grayscale::material::MaterialError;
use lamp_stack::CatalogueError;
use thiserror::Error;

use super::heights::FaceError;
use super::place::PlaceError;
use crate::column::NoHeights;
use crate::cure_section::{PlaceSize, PlacesError};
use crate::ecpl::RingPlanError;
use crate::resin_light::NoLight;
use crate::speed::{PartError, PlatformError, SpeedPlanError};

/// Why a text is not a table of measurements of a print.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum MeasuredError {
    /// It is not a table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A column or a cell is wrong.
    #[error(transparent)]
    Data(#[from] DataError),
    /// It has only a header.
    #[error("there are no measurements below the header")]
    Empty,
    /// It is not a file of places.
    #[error(transparent)]
    Places(#[from] PlacesError),
    /// The table beside places has places itself.
    #[error("csv: places are no table")]
    PlacesTwice,
    /// No place was measured.
    #[error("no place states a `measured` size")]
    NoPlaceMeasured,
    /// A place was measured, but its wanted size is unknown.
    #[error("the place {0} is measured, but states no `wanted` size: prints are compared by both")]
    NoWanted(String),
    /// The standard deviation of a place's size is impossible.
    #[error("the place {name}: a standard deviation of {sd} is impossible")]
    PlaceDeviation {
        /// The place's name.
        name: String,
        /// The standard deviation.
        sd: PlaceSize,
    },
    /// A standard deviation is below what can be measured.
    #[error(
        "line {line}, column sd_um: {sd_um} um is finer than any measurement: write {least} or more"
    )]
    Deviation {
        /// The line, from 1.
        line: usize,
        /// The standard deviation.
        sd_um: f64,
        /// The least that is possible.
        least: f64,
    },
    /// A place is listed twice.
    #[error("line {line}: this place was measured in line {first}, too")]
    SamePlace {
        /// The line, from 1.
        line: usize,
        /// The line of its first entry.
        first: usize,
    },
    /// A layer's number is not one.
    #[error("line {line}, column layer: {layer} is not a layer")]
    NotALayer {
        /// The line, from 1.
        line: usize,
        /// The number.
        layer: f64,
    },
    /// A count is below zero.
    #[error("line {line}: a number of wrong pixels must be 0 or more")]
    Negative {
        /// The line, from 1.
        line: usize,
    },
    /// A layer is listed twice.
    #[error("line {line}: layer {layer} is also in line {first}")]
    SameLayer {
        /// The line, from 1.
        line: usize,
        /// The layer.
        layer: u32,
        /// The line of its first entry.
        first: usize,
    },
}

/// Why a file of a job cannot be used.
// No sources: messages that contain them come before their text.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum JobFileError {
    /// It cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is too long for such a file.
    #[error("more than {mib} MiB is not {what}")]
    TooLong {
        /// The largest size of such files.
        mib: u64,
        /// The words for such a file.
        what: &'static str,
    },
    /// It is not text.
    #[error("byte {0} is not UTF-8 text")]
    NotText(usize),
    /// It was changed after it was written.
    #[error("{0} differs from the file that lamp learn wrote: bring it back, or begin another job")]
    Changed(String),
    /// It is missing.
    #[error("the file is missing: bring it back, or begin another job")]
    Missing,
    /// It is not TOML with the keys of a job.
    #[error(transparent)]
    Toml(#[from] toml::de::Error),
    /// It is not the stack of the job.
    #[error("this stack differs from the stack of the job: begin another job")]
    OtherStack,
    /// It is not the material of the job.
    #[error("this resin differs from the resin of the job: begin another job")]
    OtherResin,
    /// It is not a material.
    #[error(transparent)]
    Material(#[from] CatalogueError<MaterialError>),
    /// It is not a table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A column or a cell is wrong.
    #[error(transparent)]
    Data(#[from] DataError),
    /// It is not a table of measurements.
    #[error(transparent)]
    PrintMeasurements(#[from] MeasuredError),
    /// Its rows belong to other layers.
    #[error("its layers differ from the layers of the job's stack")]
    OtherLayers,
    /// A time is not above zero.
    #[error("exposure_ms must be above zero")]
    NoTime,
    /// The pages of the stack are impossible.
    #[error(transparent)]
    Part(#[from] PartError),
}

/// Why a job cannot be opened or continued.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum JobError {
    /// The folder holds no job.
    #[error("{}: there is no job", .0.display())]
    NoJob(PathBuf),
    /// A file cannot be used.
    // No source: this message contains the problem's text.
    #[error("{}: {problem}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// Why.
        problem: JobFileError,
    },
    /// The material states no light for plans.
    #[error(transparent)]
    Light(#[from] NoLight),
    /// The stack has no layers to time.
    #[error(transparent)]
    Part(#[from] PartError),
    /// There is no first print.
    #[error("{}: there is no {name}: begin the job again", folder.display())]
    NoPrint {
        /// The job.
        folder: PathBuf,
        /// The file of the first print's times.
        name: String,
    },
    /// The measured print is later than the last one.
    #[error(
        "{}: print {print} was never planned, and so not printed: the last is {last}",
        folder.display()
    )]
    NotPlanned {
        /// The job.
        folder: PathBuf,
        /// The print.
        print: usize,
        /// The last print.
        last: usize,
    },
    /// The measured print is earlier than the last one.
    #[error("{}: print {print} was used already: print {last} is the last", folder.display())]
    LearntFrom {
        /// The job.
        folder: PathBuf,
        /// The print.
        print: usize,
        /// The last print.
        last: usize,
    },
    /// The same measurements were used before with other options.
    #[error(
        "{}: the measurements of print {print} were used before, with other options: {name} \
         exists; measure print {} next",
        folder.display(),
        print + 1
    )]
    OtherOptions {
        /// The job.
        folder: PathBuf,
        /// The print.
        print: usize,
        /// The file of the next print's times.
        name: String,
    },
}

/// Why nothing can be learned from the measurements.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum LearnError {
    /// The stack has no such layer.
    #[error("line {line}: there is no layer {layer}: the stack has layers {first} to {last}")]
    NoLayer {
        /// The line of the table, from 1.
        line: usize,
        /// The layer.
        layer: u32,
        /// The lowest layer.
        first: u32,
        /// The highest layer.
        last: u32,
    },
    /// A layer cannot have so many wrong pixels.
    #[error(
        "line {line}, column {column}: {count} pixels are more than the {most} that there can be"
    )]
    TooMany {
        /// The line of the table, from 1.
        line: usize,
        /// The column.
        column: &'static str,
        /// The pixels that were given.
        count: f64,
        /// The most that there can be.
        most: f64,
    },
    /// A law is for wrong pixels.
    #[error("heights and places teach the state of light and resin: --law is for wrong pixels")]
    LawOfHeights,
    /// The stack's pages do not state their position on the part.
    #[error("the stack's pages do not state their position on the part")]
    NoPosition,
    /// A named place has no size.
    // No source: this message contains the problem's text.
    #[error("the place {name}: {problem}")]
    Place {
        /// Its name.
        name: String,
        /// Why not.
        problem: PlaceError,
    },
    /// A place is outside the images.
    #[error("line {line}, z {z_mm} mm: the place {}, {} mm is outside the images", place_mm[0], place_mm[1])]
    Outside {
        /// The line of the table, from 1.
        line: usize,
        /// The height of the face.
        z_mm: f64,
        /// The place, in part coordinates.
        place_mm: [f64; 2],
    },
    /// A measured face is not on the part, or was not cured.
    #[error("line {line}, z {z_mm} mm: {problem}")]
    Face {
        /// The line of the table, from 1.
        line: usize,
        /// The height of the face.
        z_mm: f64,
        /// The problem with the face.
        problem: FaceError,
    },
    /// The model cannot expose the part.
    #[error(transparent)]
    Part(#[from] PartError),
    /// The platform's numbers are impossible.
    #[error(transparent)]
    Platform(#[from] PlatformError),
    /// There is no plan for the corrected doses.
    #[error(transparent)]
    Plan(#[from] SpeedPlanError),
    /// The material does not state how deep a dose cures.
    #[error(transparent)]
    Curve(#[from] NoHeights),
    /// The kinetics cannot be computed.
    #[error(transparent)]
    Rings(#[from] RingPlanError),
}
