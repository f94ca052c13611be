//! `lamp print-sim`: prints a job on a simulated machine, and measures the print.

mod glass;

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use lamp_grayscale::material::Material;
use lamp_pipeline::documents::{document, is_file, own_file};
use lamp_pipeline::glass::{field_picture, job_kind};
use lamp_pipeline::heights::significant;
use lamp_pipeline::memory;
use lamp_planning::cure_section::Places;
use lamp_planning::learn::{PrintError, PrintMeasurements};
use lamp_planning::print_sim::{PrintSimError, SimulatedPrint, TrueField, Truth};
use lamp_stack::Length;
use serde::Serialize;

use crate::args::options::{Common, Output, parse_count};
use crate::catalogue::read_text;
use crate::commands::cure::read_places;
use crate::commands::learn::{check_outside_job, open};
use crate::exit::Exit;
use crate::output::endings::{parse_measured, parse_table, parse_toml};
use crate::output::json_report::{print_answer, schemas};
use crate::output::numbers::{grouped, number_of};
use crate::streams::{
    check_beside, check_not_input, input_name, is_stream, print, write_file, write_layers,
};
use crate::terminal::progress::Progress;

/// Truths are texts of a few lines.
const MAX_TRUTH: u64 = 1 << 20;
/// The noise of heights that are measured without --noise.
const HEIGHT_NOISE: Length = Length::from_um(20.0);
/// The most places: lamp learn compares each with all others.
const MOST_PLACES: usize = 10_000;

/// Print a job on a simulated machine, and measure the print
///
/// The machine prints the last print of a job of lamp learn with a truth of its own: light and
/// resin that differ from the job's material. Its measurements are the table that lamp learn
/// --measured reads: the wrong pixels of each layer, with --heights the heights of faces that
/// look down, or with --places the sizes of named places. So the whole loop of printing and learning runs without a machine.
///
/// A job of column cure or ecpl is measured by the heights of columns on the glass: of all, or with
/// --heights of that many random ones.
///
/// A truth is a TOML file. Each key is a change, such as "+25%", or a value: penetration-depth,
/// critical-dose, light, spread; for ecpl oxygen and critical-conversion instead of critical-dose;
/// drift is the change of the light from print to print. Left out keys are as in the job's material,
/// or as in another one that the key material names. The key flat-field names a picture (PNG) of the
/// light of a wide white field, layer-picture a camera's picture of the light of a layer.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp print-sim job/ --truth plant.toml --noise 2% -o measured.csv
  lamp print-sim job/ --truth plant.toml --heights 1000 --noise 2um -o heights.csv
  lamp print-sim job/ --places places.toml --noise 5um -o measured.toml
  lamp print-sim job/ --body printed.tif -o measured.csv
  lamp print-sim columns/ --truth plant.toml --noise 1um -o heights.csv")]
pub(crate) struct PrintSimArgs {
    /// Folder of the job
    #[arg(value_name = "JOB")]
    job: PathBuf,

    /// How light and resin differ from the job's material [default: not at all]
    #[arg(long, value_name = "FILE.toml")]
    truth: Option<PathBuf>,

    /// The print to simulate: 0 is the first [default: the last]
    #[arg(long, value_name = "N")]
    print: Option<usize>,

    /// Measure heights at this many random places of faces that look down, instead of wrong pixels;
    /// on a glass at this many random columns, instead of all
    #[arg(long, value_name = "N", value_parser = parse_places)]
    heights: Option<usize>,

    /// Measure the sizes of named places instead, a TOML file as lamp cure --places reads it: the
    /// output is such a file
    #[arg(long, value_name = "PLACES.toml", conflicts_with = "heights")]
    places: Option<PathBuf>,

    /// Standard deviation of the measurements: of counts a share of each, such as 2%, of heights and
    /// lengths of places a length, such as 2um [default: 0% of counts, 20um of heights and lengths,
    /// 2% of volumes, 1um of columns]
    #[arg(long, value_name = "NOISE", value_parser = parse_noise)]
    noise: Option<Noise>,

    /// Random seed of noise and places: the same seed gives a print the same table
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,

    /// Write the printed body as a TIFF stack, too: the layers as cured
    #[arg(long, value_name = "BODY.tif")]
    body: Option<PathBuf>,

    /// Where to write the measurements: a file, or - for standard output
    #[arg(short, long, value_name = "MEASURED", default_value = "-", value_parser = parse_measured)]
    output: PathBuf,

    /// Print the true light and the print's errors as JSON, as docs/json.md describes it
    #[arg(long)]
    json: bool,
}

/// How far measurements are off.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Noise {
    /// A share of each count.
    Share(f64),
    /// A length, for heights.
    Length(Length),
}

/// A simulated print, by `lamp print-sim ... --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PrintSimAnswer<'a> {
    /// Number of the print, from 0.
    print: usize,
    /// Name of the material that the truth changes.
    material: &'a str,
    /// True penetration depth, in micrometers.
    penetration_depth_um: f64,
    /// True critical dose, in mJ/cm2.
    critical_dose_mj_per_cm2: f64,
    /// True light of full white in this print, in mW/cm2.
    intensity_mw_per_cm2: f64,
    /// True standard deviations of the spread of light along rows and columns, in micrometers.
    spread_um: [f64; 2],
    /// Seed of noise and places.
    seed: u64,
    /// Pixels of all layers that are cured outside the part, exactly.
    over_px: u64,
    /// Pixels of the part in all layers that are not cured, exactly.
    under_px: u64,
    /// Measured wrong pixels of all layers, with noise, or null with heights or places.
    measured_px: Option<f64>,
    /// Root mean square by which measured heights or sizes of places are off, in micrometers (a volume
    /// counts as the side of its cube), or null without them.
    rms_um: Option<f64>,
    /// Number of heights or places, or null without them.
    places: Option<usize>,
    /// Places that have no height since nothing is cured there, or null without heights.
    uncured_places: Option<usize>,
}

schemas! { "lamp-print-sim-1": PrintSimAnswer<'_>; }

/// The measurements of a print.
struct Measured {
    table: PrintMeasurements,
    /// The places that have no height.
    uncured: Option<usize>,
}

pub(crate) fn run(args: &PrintSimArgs, common: &Common) -> Result<(), Exit> {
    args.check_outputs()?;
    let progress = Progress::new("print-sim", common, true);
    let (truth, truth_name) = match &args.truth {
        Some(path) => (read_truth(path)?, input_name(path)),
        None => (Truth::default(), input_name(&args.job)),
    };
    let material = truth.material.as_deref().map(|word| document(&args.beside_truth(word)));
    let material: Option<Material> = material.transpose()?;
    let failed = |error: PrintSimError| Exit::Failed(error.into());
    let field = truth.field_file().map_err(|error| failed(error).at(truth_name.clone()))?;
    let field = field.map(|(kind, word)| (kind, args.truth_folder().join(word)));
    if let Some((_, file)) = &field {
        for output in std::iter::once(&args.output).chain(&args.body) {
            check_not_input(output, [file])?;
        }
    }
    if let Some(kind) = job_kind(&args.job) {
        let field = field.as_ref().map(|(_, file)| file.as_path());
        return glass::run(kind, args, &truth, truth_name, material, field, &progress);
    }
    let read = |(kind, file): (_, PathBuf)| -> Result<_, Exit> {
        Ok(TrueField { kind, picture: field_picture(&file)? })
    };
    let field = field.map(read).transpose()?;
    args.check_noise()?;
    let places = args.places.as_deref().map(read_places).transpose()?;
    let job = open(&args.job, &progress)?;
    let number = job.print_of(args.print)?;
    let material = material.unwrap_or_else(|| job.material.clone());
    let memory = memory::available() / 4;
    let simulated = SimulatedPrint::new(&job, number, &material, &truth, field.as_ref(), memory)
        .map_err(|error| failed(error).at(truth_name))?;
    let at_job = |error: PrintSimError| failed(error).at(input_name(&args.job));
    let measured = args.measure(&simulated, places.as_ref()).map_err(at_job)?;
    if let Some(body) = &args.body {
        let layers = simulated.body(format!("print-sim --print {number}")).map_err(at_job)?;
        write_layers(layers.into_iter().map(Ok), &body_output(body), &progress)?;
    }
    let table = measured.table.to_text();
    match is_stream(&args.output) {
        true => print(&table)?,
        false => write_file(&args.output, |out| out.write_all(table.as_bytes()))?,
    }
    progress.wrote(&args.output, &facts(number, &measured));
    if args.json {
        let answer = answer(args, number, &material, &simulated, &measured);
        return print_answer("lamp-print-sim-1", &answer);
    }
    Ok(())
}

impl PrintSimArgs {
    /// Checks the options, and the names of outputs, before the work.
    fn check_outputs(&self) -> Result<(), Exit> {
        if self.json && is_stream(&self.output) {
            return Err(Exit::usage(
                "standard output cannot take both the table and its JSON: name a file with -o",
            ));
        }
        let name = self.output.to_string_lossy();
        match self.places {
            Some(_) => parse_toml(&name),
            None => parse_table(&name),
        }
        .map_err(Exit::usage)?;
        let inputs = || self.truth.iter().chain(&self.places);
        let outputs = std::iter::once(&self.output).chain(&self.body);
        for output in outputs.filter(|output| !is_stream(output)) {
            check_outside_job(&self.job, output)?;
            check_not_input(output, inputs())?;
        }
        let Some(body) = &self.body else {
            return check_beside(&self.output, Path::new("-"), inputs());
        };
        let is_tiff = |end: &std::ffi::OsStr| {
            ["tif", "tiff"].iter().any(|tiff| end.eq_ignore_ascii_case(tiff))
        };
        if !body.extension().is_some_and(is_tiff) {
            return Err(Exit::usage("name a TIFF file for the body, such as --body printed.tif"));
        }
        check_beside(&self.output, body, inputs())
    }

    /// Checks that the noise is of the kind that is measured.
    fn check_noise(&self) -> Result<(), Exit> {
        match (self.noise, self.heights.is_some() || self.places.is_some()) {
            (Some(Noise::Length(_)), false) => Err(Exit::usage(
                "the --noise of counts of pixels is a share, such as 2%; a length is for \
                     --heights and --places",
            )),
            (Some(Noise::Share(_)), true) => Err(Exit::usage(
                "the --noise of heights and places is a length, such as 2um; a share is for counts \
                     of pixels",
            )),
            _ => Ok(()),
        }
    }

    /// Returns where the truth's material is: a name as it is, a file beside the truth's.
    fn beside_truth(&self, word: &str) -> PathBuf {
        let path = Path::new(word);
        match is_file::<Material>(path) && own_file::<Material>(path).is_none() {
            true => self.truth_folder().join(path),
            false => path.to_owned(),
        }
    }

    fn truth_folder(&self) -> &Path {
        self.truth.as_deref().and_then(Path::parent).unwrap_or(Path::new(""))
    }

    fn measure(
        &self,
        print: &SimulatedPrint<'_>,
        places: Option<&Places>,
    ) -> Result<Measured, PrintSimError> {
        let length = match self.noise {
            Some(Noise::Length(length)) => Some(length),
            _ => None,
        };
        if let Some(places) = places {
            let table = print.sizes(places, length, self.seed)?;
            return Ok(Measured { table, uncured: None });
        }
        let Some(places) = self.heights else {
            let noise = match self.noise {
                Some(Noise::Share(share)) => share,
                _ => 0.0,
            };
            return Ok(Measured { table: print.areas(noise, self.seed), uncured: None });
        };
        let heights = print.heights(places, length.unwrap_or(HEIGHT_NOISE), self.seed)?;
        Ok(Measured { table: heights.measured, uncured: Some(heights.uncured) })
    }
}

/// Returns the output of the body.
fn body_output(body: &Path) -> Output {
    let (classic, packbits, force) = (false, false, false);
    Output { output: body.to_owned(), format: None, classic, packbits, force }
}

/// Returns the facts of the line that is printed.
fn facts(print: usize, measured: &Measured) -> Vec<String> {
    let error = match (measured.table.error(), &measured.table) {
        (PrintError::Micrometers(um), PrintMeasurements::Heights(rows)) => {
            let places = number_of(rows.len() as u64, "place");
            format!("heights at {places} are {} um off (RMS)", significant(um))
        }
        (PrintError::Micrometers(um), PrintMeasurements::Places { places, .. }) => {
            let places = number_of(places.all().len() as u64, "place");
            format!("{places} are {} um off (RMS)", significant(um))
        }
        (error, _) => format!("{} wrong pixels", grouped(error.number() as u64)),
    };
    let uncured = measured.uncured.filter(|uncured| *uncured > 0);
    let uncured = uncured.map(|uncured| format!("{} uncured", number_of(uncured as u64, "place")));
    [format!("print {print}"), error].into_iter().chain(uncured).collect()
}

fn answer<'a>(
    args: &PrintSimArgs,
    number: usize,
    material: &'a Material,
    print: &SimulatedPrint<'_>,
    measured: &Measured,
) -> PrintSimAnswer<'a> {
    let (light, wrong) = (print.light(), print.tally().wrong());
    let (measured_px, rms_um, places) = match (measured.table.error(), &measured.table) {
        (PrintError::Pixels(wrong), _) => (Some(wrong), None, None),
        (PrintError::Micrometers(um), PrintMeasurements::Heights(rows)) => {
            (None, Some(um), Some(rows.len()))
        }
        (PrintError::Micrometers(um), PrintMeasurements::Places { places, .. }) => {
            (None, Some(um), Some(places.all().len()))
        }
        (PrintError::Micrometers(um), _) => (None, Some(um), None),
    };
    PrintSimAnswer {
        print: number,
        material: &material.name,
        penetration_depth_um: light.penetration_depth.um(),
        critical_dose_mj_per_cm2: light.critical_dose.mj_per_cm2(),
        intensity_mw_per_cm2: light.intensity.mw_per_cm2(),
        spread_um: light.spread.map(Length::um),
        seed: args.seed,
        over_px: wrong.over,
        under_px: wrong.under,
        measured_px,
        rms_um,
        places,
        uncured_places: measured.uncured,
    }
}

fn read_truth(path: &Path) -> Result<Truth, Exit> {
    let read =
        || -> anyhow::Result<_> { Ok(Truth::parse(&read_text(path, MAX_TRUTH, "a truth")?)?) };
    Ok(read().with_context(|| input_name(path))?)
}

fn parse_places(text: &str) -> Result<usize, String> {
    match parse_count(text)? {
        places @ 1..=MOST_PLACES => Ok(places),
        _ => Err(format!("`{text}` is not a number of places from 1 to {MOST_PLACES}")),
    }
}

fn parse_noise(text: &str) -> Result<Noise, String> {
    let wrong =
        || format!("`{text}` is no noise: write a share, such as 2%, or a length, such as 2um");
    if let Some(percent) = text.strip_suffix('%') {
        let percent: f64 = percent.trim().parse().map_err(|_| wrong())?;
        return match (0.0..=100.0).contains(&percent) {
            true => Ok(Noise::Share(percent / 100.0)),
            false => Err(wrong()),
        };
    }
    match text.parse::<Length>() {
        Ok(length) if length.um() > 0.0 && length.um() <= 1e6 => Ok(Noise::Length(length)),
        _ => Err(wrong()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_a_share_or_a_length() {
        assert_eq!(parse_noise("2%"), Ok(Noise::Share(0.02)));
        assert_eq!(parse_noise("0%"), Ok(Noise::Share(0.0)));
        assert_eq!(parse_noise("2um"), Ok(Noise::Length(Length::from_um(2.0))));
        for wrong in ["", "2", "-1%", "nan%", "0um", "-2um", "2mJ/cm2", "9m"] {
            assert!(parse_noise(wrong).is_err(), "{wrong}");
        }
        assert!(parse_places("0").is_err() && parse_places("11k").is_err());
        assert_eq!(parse_places("10k"), Ok(10_000));
    }
}
