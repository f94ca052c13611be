//! The solid that is sliced: its files, and what is inside.

use std::fs::File;
use std::io::{self, Cursor, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use lamp_slicer::{FacetIndex, Fill, Model, Placement, SliceError, Units};
use lamp_stack::Dpi;
use serde::{Deserialize, Serialize};

use crate::brep::{BrepOptions, boxes_overlap, bytes_of, is_step, part_of};
use crate::options::one_of;
use crate::placement::PlacementOptions;
use crate::recorded::text;
use crate::stop::Stop;
use crate::streams::{input_name, is_stream};

/// What decides the solid that is sliced.
#[derive(Args, Clone, Default, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub(crate) struct SolidOptions {
    /// What the numbers of an STL mean; a STEP file says so itself
    #[arg(long, value_parser = one_of::<Units>(), default_value_t)]
    #[serde(with = "text")]
    pub(crate) units: Units,

    /// What is inside: between odd and even crossings, or wherever contours wind around (for
    /// bodies that overlap)
    #[arg(long, value_parser = one_of::<Fill>(), default_value_t)]
    #[serde(with = "text")]
    pub(crate) fill: Fill,

    #[command(flatten)]
    #[serde(flatten)]
    placement: PlacementOptions,

    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) brep: BrepOptions,
}

impl SolidOptions {
    pub(crate) fn placement(&self) -> Placement {
        self.placement.placement()
    }

    /// The part in memory.
    pub(crate) fn body(&self, model: Model) -> Result<FacetIndex, SliceError> {
        FacetIndex::new(model, &self.placement(), self.units)
    }

    /// Opens all files of a part.
    pub(crate) fn open(&self, paths: &[PathBuf], reading: &Reading<'_>) -> Result<Model, Stop> {
        if paths.iter().filter(|path| is_stream(path)).count() > 1 {
            return Err(Stop::usage("standard input can be read only once: give - for one part"));
        }
        let open =
            |path: &PathBuf| self.open_one(path, reading).map_err(|stop| stop.at(input_name(path)));
        Ok(Model::joined(paths.iter().map(open).collect::<Result<_, _>>()?))
    }

    fn open_one(&self, path: &Path, reading: &Reading<'_>) -> Result<Model, Stop> {
        let failed = |error: io::Error| Stop::from(SliceError::from(error));
        if is_stream(path) {
            let mut start = Vec::new();
            let mut stdin = io::stdin().lock();
            stdin.by_ref().take(START_BYTES).read_to_end(&mut start).map_err(failed)?;
            let is_step = is_step(&start);
            let mut stream = Cursor::new(start).chain(stdin);
            if !is_step {
                return Ok(Model::from_stream("stdin", stream)?);
            }
            let mut bytes = Vec::new();
            stream.read_to_end(&mut bytes).map_err(failed)?;
            return self.step(&bytes.into(), "stdin", reading);
        }
        let mut start = Vec::new();
        let file = File::open(path).map_err(failed)?;
        // What is no file is for the slicer to refuse.
        let read = file.take(START_BYTES).read_to_end(&mut start);
        if read.is_err() || !is_step(&start) {
            return Ok(Model::open(path)?);
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        self.step(&bytes_of(path)?, &name, reading)
    }

    fn step(&self, bytes: &Arc<[u8]>, name: &str, reading: &Reading<'_>) -> Result<Model, Stop> {
        if self.units == Units::Inches {
            let why = "a STEP file says itself what its numbers mean: leave --units away";
            return Err(Stop::usage(why));
        }
        let tolerance = self.brep.tolerance(reading.dpi);
        let pitch = reading.dpi.pitch();
        if tolerance.um() > pitch.um() {
            (reading.say)(&format!(
                "--tolerance {tolerance} is more than a pixel: pixels may be wrong where faces \
                 meet, and where they go along rows"
            ));
        }
        let prepared = self.brep.reader.read(bytes, tolerance)?;
        let may_overlap = self.fill == Fill::EvenOdd && boxes_overlap(&prepared);
        if may_overlap {
            (reading.say)(
                "the boxes of bodies overlap: where the bodies do, too, they cut each other out, \
                 or unite with --fill nonzero",
            );
        }
        part_of(prepared, name, bytes, reading.may_be_open, reading.say)
    }
}

/// What files are read for.
pub(crate) struct Reading<'a> {
    /// The resolution of the images.
    pub(crate) dpi: Dpi,
    /// Whether bodies of STEP files may have gaps.
    pub(crate) may_be_open: bool,
    /// Who is told what was found in STEP files.
    pub(crate) say: &'a dyn Fn(&str),
}

/// Enough to tell a STEP file by.
pub(crate) const START_BYTES: u64 = 256;

/// Puts before a message the file whose facet it is about, or all files.
pub(crate) fn at_part(stop: Stop, paths: &[PathBuf]) -> Stop {
    let place = match stop.cause() {
        Some(&SliceError::NotFinite { file, .. }) => input_name(&paths[file]),
        _ => name_of_all(paths),
    };
    stop.at(place)
}

/// What people call the files of a part together.
pub(crate) fn name_of_all(paths: &[PathBuf]) -> String {
    match paths {
        [path] => input_name(path),
        paths => format!("{} and {} more", input_name(&paths[0]), paths.len() - 1),
    }
}
