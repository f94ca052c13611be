//! `lamp calibrate projector`: finds the spread and the flat field of a projector's light in a picture of it.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use lamp_pipeline::documents::document;
use lamp_pipeline::glass::CameraSettings;
use lamp_planning::projector::Projector;
use lamp_stack::Length;

use super::estimate_table::EstimateTable;
use crate::args::options::{Common, parse_thickness};
use crate::exit::Exit;
use crate::output::endings::{PNG, check_ending, parse_toml};
use crate::output::json_report::ReportTo;
use crate::streams::{check_beside, input_name, is_stream, write_file};
use crate::terminal::progress::Progress;

/// Find how a projector's light spreads, and how bright each mirror is, in a picture of its light
///
/// Show an image, such as the dots of lamp target dots, and take a picture of its light in the plane of
/// the glass: straight on, with black around it, below the camera's brightest level, with at least one
/// pixel a mirror. Levels must be in proportion to the light, as in a raw picture. The place, turn and
/// size of the display in the picture are found, too. The projector gets the spread, and with --pixel the
/// pitch; --flat-field writes the light of each mirror for lamp plan column-cure.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp target dots --projector mine.toml -o dots.tif
  lamp calibrate projector camera.png --shown dots.tif --projector mine.toml -o mine.toml
  lamp calibrate projector camera.png --shown dots.tif --projector mine.toml --pixel 3.45um \\
      -o mine.toml --flat-field light.png")]
pub(super) struct ProjectorArgs {
    /// Picture of the light: a PNG of gray levels, of 16 bits or 8
    #[arg(value_name = "PICTURE.png")]
    picture: PathBuf,

    /// Image that the display showed: a stack of one page with a pixel for each mirror
    #[arg(long, value_name = "STACK")]
    shown: PathBuf,

    /// Projector to add the light to: a built-in projector's name (see lamp projector list) or a file
    #[arg(long, value_name = "PROJECTOR")]
    projector: PathBuf,

    /// Side of a pixel of the picture on the glass; it gives the pitch of mirrors
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness)]
    pixel: Option<Length>,

    /// Projector file to write
    #[arg(short, long, value_name = "OUT", value_parser = parse_toml)]
    output: Option<PathBuf>,

    /// Name of the projector [default: the name of --projector]
    #[arg(long, value_name = "NAME", requires = "output")]
    name: Option<String>,

    /// Picture of each mirror's light to write, relative to the brightest: a PNG of the display's size
    #[arg(long, value_name = "FILE.png")]
    flat_field: Option<PathBuf>,

    #[command(flatten)]
    report: ReportTo,
}

pub(super) fn run(args: &ProjectorArgs, common: &Common) -> Result<(), Exit> {
    args.check()?;
    let projector: Projector = document(&args.projector)?;
    let settings = CameraSettings {
        picture: args.picture.clone(),
        shown: args.shown.clone(),
        pixel: args.pixel,
    };
    let fit = settings.fit(&projector)?;
    let name = args.picture.file_name().unwrap_or_default().to_string_lossy();
    let source = format!("calibrated from {name}");
    let written = args.output.as_deref().map(|output| -> Result<_, Exit> {
        let mut projector = fit.projector(&projector, &source);
        if let Some(name) = &args.name {
            projector.name.clone_from(name);
        }
        let text = projector.to_toml().with_context(|| output.display().to_string())?;
        Ok((output, text.into_bytes()))
    });
    let flat_field = fit.flat_field();
    let light = args.flat_field.as_deref().map(|path| -> Result<_, Exit> {
        Ok((path, flat_field.to_png().with_context(|| path.display().to_string())?))
    });
    let progress = Progress::new("calibrate", common, true);
    fit.doubts
        .iter()
        .for_each(|doubt| progress.warn(&format!("{}: {doubt}", args.picture.display())));
    // The picture first: where it cannot be written, no projector is left.
    for (path, bytes) in light.transpose()?.into_iter().chain(written.transpose()?) {
        write_file(path, |out| out.write_all(&bytes))?;
        progress.wrote(path, &[]);
    }
    let mut fitted = EstimateTable::of_pixels(input_name(&args.picture), "projector", fit.pixels);
    fitted.r2("R^2", fit.r2);
    fitted.number("RMS misfit", "% of white", 100.0 * fit.misfit);
    fitted.heads();
    fitted.estimate("sigma", &fit.sigma);
    if let Some(pitch) = &fit.pitch {
        fitted.estimate("pitch", pitch);
    }
    fitted.numbers("turned", "degrees", fit.turned_deg);
    fitted.number("pixels across a mirror", "1", fit.pixels_a_mirror);
    fitted.number("dark", "% of white", 100.0 * fit.dark);
    let darkest = flat_field.levels.iter().copied().min().unwrap_or_default();
    fitted.number(
        "darkest mirror",
        "% of brightest",
        100.0 * f64::from(darkest) / f64::from(u16::MAX),
    );
    if fit.is_mirrored {
        fitted.line("the picture is mirrored, as from below", &[]);
    }
    fitted.write(&args.report)
}

impl ProjectorArgs {
    /// Checks, before the work, that the outputs can be written.
    fn check(&self) -> Result<(), Exit> {
        self.flat_field.as_deref().map_or(Ok(()), |path| check_ending(path, &PNG))?;
        // The outputs end differently, so none is written over another.
        let files = || self.output.iter().chain(&self.flat_field);
        if files().any(|file| is_stream(file)) {
            return Err(Exit::usage("the table goes to standard output: name a file"));
        }
        for output in files().chain(self.report.path()) {
            // The projector may be written over the one that it was made from.
            let is_projector = self.output.as_ref() == Some(output);
            let base = Some(&self.projector).filter(|_| !is_projector);
            let inputs = [&self.picture, &self.shown].into_iter().chain(base);
            check_beside(output, Path::new("-"), inputs)?;
        }
        Ok(())
    }
}
