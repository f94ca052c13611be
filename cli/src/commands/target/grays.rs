//! `lamp target grays`: writes squares of several gray levels.

use clap::Args;
use lamp_grayscale::resin::{ExposureTime, GrayLevel};
use lamp_grayscale::target::gray_squares;
use lamp_stack::{Dpi, Length};

use super::screens::parse_level;
use super::{parse_gap, whole_pixels, write_gray};
use crate::args::options::{Common, Output};
use crate::exit::Exit;

/// Write squares of several gray levels, to calibrate the spread of light and gamma
///
/// The squares stand side by side in one image. Measure from the side how deep each cures, or photograph
/// their light in the vat, and write the places into a table for lamp calibrate spread.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp target grays -o grays.tif
  lamp target grays --dpi 2268 --square 300um --expose 4s -o grays.tif
  lamp calibrate spread profiles.csv")]
pub(super) struct GraysArgs {
    /// Resolution in dots per inch
    #[arg(long, default_value = "1500")]
    dpi: Dpi,

    /// Gray levels of the squares, from the left
    #[arg(long, value_name = "PERCENT,...", value_delimiter = ',', value_parser = parse_lit_level)]
    #[arg(default_value = "100%,75%,50%,25%")]
    levels: Vec<GrayLevel>,

    /// Side of the squares, to the nearest pixel: several times as wide as light spreads
    #[arg(long, value_name = "LENGTH", default_value = "1mm", value_parser = parse_gap)]
    square: Length,

    /// Distance between squares
    #[arg(long, value_name = "LENGTH", default_value = "1mm", value_parser = parse_gap)]
    gap: Length,

    /// Exposure time
    #[arg(long, value_name = "TIME")]
    expose: Option<ExposureTime>,

    #[command(flatten)]
    output: Output,
}

pub(super) fn run(args: &GraysArgs, common: &Common) -> Result<(), Exit> {
    let [side, gap] = [args.square, args.gap].map(|length| whole_pixels(length, args.dpi));
    let image = gray_squares(&args.levels, side, gap)?;
    write_gray(image, "gray squares", args.command(), (args.dpi, args.expose), &args.output, common)
}

impl GraysArgs {
    fn command(&self) -> String {
        let levels = self.levels.iter().map(|level| format!("{}%", 100.0 * level.get()));
        let levels = levels.collect::<Vec<_>>().join(",");
        let Self { dpi, square, gap, .. } = self;
        format!("target grays --dpi {dpi} --levels {levels} --square {square} --gap {gap}")
    }
}

/// Parses a gray level in per cent, above black: black squares show nothing.
fn parse_lit_level(text: &str) -> Result<GrayLevel, String> {
    let level = parse_level(text)?;
    if level.get() > 0.0 { Ok(level) } else { Err("it must be above 0%".to_owned()) }
}
