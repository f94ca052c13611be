//! `lamp target screens`: writes screens of squares of several sizes.

use clap::Args;
use lamp_grayscale::resin::{ExposureTime, GrayLevel};
use lamp_grayscale::target::screens;
use lamp_stack::{Dpi, Length};

use super::{parse_gap, whole_pixels, write_gray};
use crate::args::options::{Common, Output};
use crate::exit::Exit;

/// Write a gray tile, and screens of it with squares of several sizes
///
/// The cured films show the largest squares with which a screen cures evenly. The first tile is
/// gray, for lamp dither to turn into dots; the other tiles are black and white.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp target screens -o screens.tif
  lamp target screens --gray-level 25% --expose 600ms | dither > screens.tif")]
pub(super) struct ScreensArgs {
    /// Resolution in dots per inch
    #[arg(long, default_value = "1500")]
    dpi: Dpi,

    /// Gray level of all tiles, to the nearest 64th on the screens; 50% is a checkerboard
    #[arg(long, value_name = "PERCENT", default_value = "50%", value_parser = parse_level)]
    gray_level: GrayLevel,

    /// Sides of the screens' squares, in pixels; 1, 5, 10 and 15 are 17, 85, 170 and 255 um at 1500
    /// dpi
    #[arg(long, value_name = "PIXELS,...", value_delimiter = ',', default_value = "1,5,10,15")]
    squares: Vec<u32>,

    /// Side of a tile, in pixels; a multiple of eight times each square gives exactly the gray
    /// level
    #[arg(long, value_name = "PIXELS", default_value_t = 720)]
    tile: u32,

    /// Distance between tiles
    #[arg(long, value_name = "LENGTH", default_value = "1mm", value_parser = parse_gap)]
    gap: Length,

    /// Exposure time
    #[arg(long, value_name = "TIME")]
    expose: Option<ExposureTime>,

    #[command(flatten)]
    output: Output,
}

pub(super) fn run(args: &ScreensArgs, common: &Common) -> Result<(), Exit> {
    let gap = whole_pixels(args.gap, args.dpi);
    let image = screens(args.gray_level, args.tile, gap, &args.squares)?;
    write_gray(image, "screens", args.command(), (args.dpi, args.expose), &args.output, common)
}

impl ScreensArgs {
    fn command(&self) -> String {
        let squares: Vec<String> = self.squares.iter().map(u32::to_string).collect();
        let Self { dpi, tile, gray_level, gap, .. } = self;
        let (squares, percent) = (squares.join(","), 100.0 * gray_level.get());
        format!(
            "target screens --dpi {dpi} --gray-level {percent}% --squares {squares} --tile {tile} --gap {gap}"
        )
    }
}

/// Parses a gray level in per cent.
pub(super) fn parse_level(text: &str) -> Result<GrayLevel, String> {
    let percent =
        text.trim().strip_suffix('%').and_then(|number| number.trim().parse::<f64>().ok());
    percent.and_then(|percent| GrayLevel::new(percent / 100.0)).ok_or_else(|| {
        format!("`{text}` is not a gray level: write 0% (black) to 100% (white), such as 50%")
    })
}
