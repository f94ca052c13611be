//! The solid to slice: its files, units, placement and fill rule.

use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use lamp_slicer::brep::Prepared;
use lamp_slicer::{FacetIndex, Fill, OpenOptions, Part, Placement, SliceError, Units};
use lamp_stack::{Dpi, Length};
use serde::{Deserialize, Serialize};

use crate::exit::Exit;
use crate::options::one_of;
use crate::placement::PlacementOptions;
use crate::recorded::text;
use crate::step_options::{BrepOptions, boxes_overlap, notes};
use crate::streams::{input_name, is_stream};

/// Options that decide the solid to slice.
#[derive(Args, Clone, Default, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub(crate) struct PartOptions {
    /// Unit of an STL's coordinates; a STEP file states its own
    #[arg(long, value_parser = one_of::<Units>(), default_value_t)]
    #[serde(with = "text")]
    pub(crate) units: Units,

    /// Rule for what is inside: between odd and even crossings, or wherever contours wind around
    /// (for bodies that overlap)
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

impl PartOptions {
    pub(crate) fn placement(&self) -> Placement {
        self.placement.placement()
    }

    /// Returns an index of the part's facets by height.
    pub(crate) fn body(&self, model: Part) -> Result<FacetIndex, SliceError> {
        FacetIndex::new(model, &self.placement(), self.units)
    }

    /// Opens all files of a part.
    pub(crate) fn open(&self, paths: &[PathBuf], reading: &Reading<'_>) -> Result<Part, Exit> {
        if paths.iter().filter(|path| is_stream(path)).count() > 1 {
            return Err(Exit::usage("standard input can be read only once: give - for one part"));
        }
        let open = |path: &PathBuf| {
            self.open_one(path, reading).map_err(|error| error.at(input_name(path)))
        };
        Ok(Part::joined(paths.iter().map(open).collect::<Result<_, _>>()?))
    }

    fn open_one(&self, path: &Path, reading: &Reading<'_>) -> Result<Part, Exit> {
        let tolerance = self.brep.tolerance(reading.dpi);
        let options = OpenOptions {
            allow_gaps: reading.may_be_open,
            ..self.brep.reader.for_opening(tolerance)
        };
        let model = match is_stream(path) {
            true => Part::from_stream("stdin", io::stdin().lock(), &options)?,
            false => Part::open(path, &options)?,
        };
        for prepared in model.prepared() {
            self.check_step(prepared, tolerance, reading)?;
        }
        Ok(model)
    }

    /// Refuses units for a STEP file, and passes notes about it on.
    fn check_step(
        &self,
        prepared: &Prepared,
        tolerance: Length,
        reading: &Reading<'_>,
    ) -> Result<(), Exit> {
        if self.units == Units::Inches {
            let why = "a STEP file states its own unit: leave out --units";
            return Err(Exit::usage(why));
        }
        if tolerance.um() > reading.dpi.pitch().um() {
            (reading.say)(&format!(
                "--tolerance {tolerance} is more than a pixel: pixels may be wrong where faces \
                 meet or run along rows"
            ));
        }
        if self.fill == Fill::EvenOdd && boxes_overlap(prepared) {
            (reading.say)(
                "the bounding boxes of bodies overlap: where the bodies overlap, too, they \
                 cancel out, or unite with --fill nonzero",
            );
        }
        notes(prepared).iter().for_each(|note| (reading.say)(note));
        Ok(())
    }
}

/// The purpose that files are read for.
pub(crate) struct Reading<'a> {
    /// The resolution of the images.
    pub(crate) dpi: Dpi,
    /// Whether bodies of STEP files may have gaps.
    pub(crate) may_be_open: bool,
    /// Takes notes about STEP files.
    pub(crate) say: &'a dyn Fn(&str),
}

/// Puts the name of the faulty facet's file, or of all files, before a message.
pub(crate) fn at_part(error: Exit, paths: &[PathBuf]) -> Exit {
    let place = match error.cause() {
        Some(&SliceError::NotFinite { file, .. }) => input_name(&paths[file]),
        _ => name_of_all(paths),
    };
    error.at(place)
}

/// Returns one name for all files of a part, for messages.
pub(crate) fn name_of_all(paths: &[PathBuf]) -> String {
    match paths {
        [path] => input_name(path),
        paths => format!("{} and {} more", input_name(&paths[0]), paths.len() - 1),
    }
}
