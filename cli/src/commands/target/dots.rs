//! `lamp target dots`: writes dots all over a display.

use std::path::PathBuf;

use clap::Args;
use lamp_grayscale::target::dots;
use lamp_pipeline::documents::document;
use lamp_planning::projector::Projector;
use lamp_stack::{Layer, PageInfo, StackInfo};

use super::pitch_of;
use crate::args::options::{Common, Output};
use crate::exit::Exit;
use crate::streams::{progress, write_layers};

/// Write dots all over a display, to calibrate a projector's light
///
/// Show the image, and take a picture of its light for lamp calibrate projector. Square dots stand in
/// rows and columns, in the upper left quarter twice as wide, so that the image differs however it is
/// turned or mirrored.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp target dots --projector mine.toml -o dots.tif
  lamp target dots --projector mine.toml --dot 20 --period 100 -o dots.tif
  lamp calibrate projector camera.png --shown dots.tif --projector mine.toml -o mine.toml")]
pub(super) struct DotsArgs {
    /// Projector: a built-in projector's name (see lamp projector list) or a file
    #[arg(long, value_name = "PROJECTOR")]
    projector: PathBuf,

    /// Side of a dot, in mirrors: several times as far as light spreads
    #[arg(long, value_name = "PIXELS", default_value = "10")]
    dot: u32,

    /// Mirrors from dot to dot: three times the side or more
    #[arg(long, value_name = "PIXELS", default_value = "40")]
    period: u32,

    #[command(flatten)]
    output: Output,
}

pub(super) fn run(args: &DotsArgs, common: &Common) -> Result<(), Exit> {
    let projector: Projector = document(&args.projector)?;
    let image = dots([projector.display.columns, projector.display.rows], args.dot, args.period)?;
    let (name, dot, period) = (&projector.name, args.dot, args.period);
    let stack = StackInfo {
        part: "dots".to_owned(),
        commands: vec![format!("target dots --projector {name} --dot {dot} --period {period}")],
        layers: Some(1),
        ..StackInfo::default()
    };
    let info = PageInfo { stack: Some(stack), ..PageInfo::default() };
    let layer = Layer { info, pitch: Some(pitch_of(&projector)?), image: image.into() };
    let progress = progress("target", common, &args.output);
    write_layers(std::iter::once(Ok(layer)), &args.output, &progress)
}
