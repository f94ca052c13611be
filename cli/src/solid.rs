//! The solid that is sliced: its files, and what is inside.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use lamp_slicer::{Body, Fill, Model, Placement, SliceError, Units};

use crate::placement::PlacementOptions;
use crate::stop::Stop;
use crate::streams::{input_name, is_stream};

/// What decides the solid that is sliced.
#[derive(Args, Clone)]
pub(crate) struct SolidOptions {
    /// What the numbers of the STL mean
    #[arg(long, value_enum, default_value_t)]
    units: UnitsArg,

    /// What is inside: between odd and even crossings, or wherever contours wind around (for
    /// bodies that overlap)
    #[arg(long, value_enum, default_value_t)]
    fill: FillArg,

    #[command(flatten)]
    placement: PlacementOptions,
}

impl SolidOptions {
    pub(crate) fn fill(&self) -> Fill {
        match self.fill {
            FillArg::EvenOdd => Fill::EvenOdd,
            FillArg::NonZero => Fill::NonZero,
        }
    }

    pub(crate) fn units(&self) -> Units {
        match self.units {
            UnitsArg::Mm => Units::Millimetres,
            UnitsArg::Inch => Units::Inches,
        }
    }

    pub(crate) fn placement(&self) -> Placement {
        self.placement.placement()
    }

    /// The part in memory.
    pub(crate) fn body(&self, model: Model) -> Result<Body, SliceError> {
        Body::new(model, &self.placement(), self.units())
    }

    /// What people write for the rule of what is inside.
    pub(crate) fn fill_name(&self) -> String {
        value_name(&self.fill)
    }

    /// The options as the stack remembers them.
    pub(crate) fn command_line(&self) -> String {
        let placement = self.placement.command_line();
        format!(" --units {} --fill {}{placement}", value_name(&self.units), self.fill_name())
    }
}

#[derive(Clone, Copy, Default, ValueEnum)]
enum UnitsArg {
    #[default]
    Mm,
    Inch,
}

#[derive(Clone, Copy, Default, ValueEnum)]
enum FillArg {
    #[default]
    EvenOdd,
    #[value(name = "nonzero", alias = "non-zero")]
    NonZero,
}

/// What people write for a value.
pub(crate) fn value_name(value: &impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

/// Opens all files of a part.
pub(crate) fn open_models(paths: &[PathBuf]) -> Result<Model, Stop> {
    if paths.iter().filter(|path| is_stream(path)).count() > 1 {
        return Err(Stop::usage("standard input can be read only once: give - for one part"));
    }
    let open = |path: &PathBuf| open_model(path).map_err(|e| Stop::from(e).at(input_name(path)));
    Ok(Model::joined(paths.iter().map(open).collect::<Result<_, _>>()?))
}

/// Puts before a message the file whose facet it is about, or all files.
pub(crate) fn at_part(stop: Stop, paths: &[PathBuf]) -> Stop {
    let place = match stop.cause() {
        Some(&SliceError::NotFinite { file, .. }) => input_name(&paths[file]),
        _ => name_of_all(paths),
    };
    stop.at(place)
}

fn open_model(path: &Path) -> Result<Model, SliceError> {
    if is_stream(path) {
        Model::from_stream("stdin", std::io::stdin().lock())
    } else {
        Model::open(path)
    }
}

/// What people call the files of a part together.
pub(crate) fn name_of_all(paths: &[PathBuf]) -> String {
    match paths {
        [path] => input_name(path),
        paths => format!("{} and {} more", input_name(&paths[0]), paths.len() - 1),
    }
}
