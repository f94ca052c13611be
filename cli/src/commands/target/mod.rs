//! `lamp target`: the kinds of test images.

mod screens;
mod squares;

use clap::{Args, Subcommand};
use lamp_grayscale::target::TargetError;
use lamp_stack::{Dpi, Length};

use crate::args::options::{Common, parse_distance};
use crate::exit::Exit;

/// Write test images to expose, measure and calibrate with
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp target squares --doses 60..600mJ/cm2 --material lamp-suspension -o targets/
  lamp target screens -o screens.tif")]
pub(crate) struct TargetArgs {
    #[command(subcommand)]
    what: Target,
}

#[derive(Subcommand)]
enum Target {
    Squares(squares::SquaresArgs),
    Screens(screens::ScreensArgs),
}

pub(crate) fn run(args: &TargetArgs, common: &Common) -> Result<(), Exit> {
    match &args.what {
        Target::Squares(args) => squares::run(args, common),
        Target::Screens(args) => screens::run(args, common),
    }
}

/// A length in whole pixels, to the nearest.
fn whole_pixels(length: Length, dpi: Dpi) -> u32 {
    length.pixels(dpi).round() as u32
}

/// Parses how far squares stand apart, which is some way.
fn parse_gap(text: &str) -> Result<Length, String> {
    let gap = parse_distance(text)?;
    if gap.um() == 0.0 { Err("the gap must be above zero".to_owned()) } else { Ok(gap) }
}

/// Impossible targets come from options.
impl From<TargetError> for Exit {
    fn from(error: TargetError) -> Self {
        Self::wrong_options(error)
    }
}
