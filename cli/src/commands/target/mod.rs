//! `lamp target`: the kinds of test images.

mod dots;
mod grays;
mod lines;
mod scan;
mod screens;
mod squares;

use std::path::Path;

use clap::{Args, Subcommand};
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::{ExposureTime, Intensity};
use lamp_grayscale::target::{TargetError, TargetExposure};
use lamp_pipeline::documents::document;
use lamp_planning::projector::Projector;
use lamp_stack::{Dpi, GrayMask, Layer, Length, PageInfo, Pitch, StackInfo};

use crate::args::options::{Common, Output, parse_distance};
use crate::exit::Exit;
use crate::streams::{progress, write_layers};
use squares::Doses;

/// Write test images to expose, measure and calibrate with
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp target squares --doses 60..600mJ/cm2 --material lamp-suspension -o targets/
  lamp target scan --doses 150,300mJ/cm2 --material lamp-suspension -o lines/
  lamp target screens -o screens.tif
  lamp target grays -o grays.tif
  lamp target lines --projector jariwala -o lines/
  lamp target dots --projector jariwala -o dots.tif")]
pub(crate) struct TargetArgs {
    #[command(subcommand)]
    what: Target,
}

#[derive(Subcommand)]
enum Target {
    Squares(squares::SquaresArgs),
    Scan(scan::ScanArgs),
    Screens(screens::ScreensArgs),
    Grays(grays::GraysArgs),
    Lines(lines::LinesArgs),
    Dots(dots::DotsArgs),
}

pub(crate) fn run(args: &TargetArgs, common: &Common) -> Result<(), Exit> {
    match &args.what {
        Target::Squares(args) => squares::run(args, common),
        Target::Scan(args) => scan::run(args, common),
        Target::Screens(args) => screens::run(args, common),
        Target::Grays(args) => grays::run(args, common),
        Target::Lines(args) => lines::run(args, common),
        Target::Dots(args) => dots::run(args, common),
    }
}

/// Returns the pages of a target's stack, one for each dose, at a light and a pitch. The pages of
/// squares have the side of these.
fn pages(
    part: String,
    command: String,
    doses: &Doses,
    exposures: Vec<TargetExposure>,
    (light, pitch): (Intensity, Pitch),
    feature_px: Option<u32>,
) -> impl Iterator<Item = Result<Layer, Exit>> + use<> {
    let layers = Some(exposures.len() as u32);
    let mut stack =
        Some(StackInfo { part, commands: vec![command], layers, ..StackInfo::default() });
    let doses: Vec<f64> = doses.0.iter().map(|dose| dose.mj_per_cm2()).collect();
    (0..).zip(exposures.into_iter().zip(doses)).map(move |(index, (exposure, dose))| {
        let mut info = PageInfo {
            index,
            exposure_ms: Some((exposure.dose / light).ms()),
            stack: stack.take(),
            ..PageInfo::default()
        };
        // The first tile that is white has its whole dose after this page.
        if let Some(feature) = feature_px {
            info.other.insert("feature_px".to_owned(), feature.into());
        }
        info.other.insert("dose_mj_per_cm2".to_owned(), dose.into());
        Ok(Layer { info, pitch: Some(pitch), image: exposure.image.into() })
    })
}

/// Returns the pitch of images with a pixel for each mirror.
fn pitch_of(projector: &Projector) -> Result<Pitch, Exit> {
    let um = projector.pitch.value.um();
    Pitch::of_dpi((25_400.0 / um * 1e4).round() / 1e4)
        .ok_or_else(|| Exit::usage(format!("images have no resolution for mirrors {um} um apart")))
}

/// Writes a stack of one gray image.
fn write_gray(
    image: GrayMask,
    part: &str,
    command: String,
    (dpi, expose): (Dpi, Option<ExposureTime>),
    output: &Output,
    common: &Common,
) -> Result<(), Exit> {
    let stack = StackInfo {
        part: part.to_owned(),
        commands: vec![command],
        layers: Some(1),
        ..StackInfo::default()
    };
    let info = PageInfo {
        exposure_ms: expose.map(ExposureTime::ms),
        stack: Some(stack),
        ..PageInfo::default()
    };
    let layer = Layer { info, pitch: Some(dpi.into()), image: image.into() };
    let progress = progress("target", common, output);
    write_layers(std::iter::once(Ok(layer)), output, &progress)
}

/// A length in whole pixels, to the nearest.
fn whole_pixels(length: Length, dpi: Dpi) -> u32 {
    length.pixels(dpi).round() as u32
}

/// Sorts lengths in pixels and refuses one that stands twice.
fn sorted(option: &str, pixels: &[u32]) -> Result<Vec<u32>, Exit> {
    let mut sorted = pixels.to_vec();
    sorted.sort_unstable();
    match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(twice) => Err(Exit::usage(format!("{option}: {} is given twice", twice[0]))),
        None => Ok(sorted),
    }
}

/// Returns the light of full white, given or of a material. One of the two is there.
fn full_white(given: Option<Intensity>, material: Option<&Path>) -> Result<Intensity, Exit> {
    let Some(path) = material else {
        return Ok(given.expect("one of the two is required"));
    };
    let material: Material = document(path)?;
    let name = path.display();
    material.light().map_err(anyhow::Error::new)?.ok_or_else(|| {
        Exit::usage(format!("{name} states no intensity of full white: give --intensity"))
    })
}

fn counted(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}

/// Parses how far squares stand apart, which is some way.
fn parse_gap(text: &str) -> Result<Length, String> {
    let gap = parse_distance(text)?;
    if gap.um() == 0.0 { Err("it must be above zero".to_owned()) } else { Ok(gap) }
}

/// Impossible targets come from options.
impl From<TargetError> for Exit {
    fn from(error: TargetError) -> Self {
        Self::wrong_options(error)
    }
}
