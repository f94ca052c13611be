//! `lamp calibrate`: the files and options that both kinds of calibration share.

mod composition;
mod depth;
mod estimate_table;
mod gamma;
mod kinetics;
mod lamp;
mod projector;
mod scan;
mod spread;
mod width;

use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::{Args, Subcommand};
use lamp_grayscale::calibrate::CsvTable;
use lamp_grayscale::material::{Given, Material, MaterialError, SpreadNumbers};
use lamp_grayscale::resin::Intensity;
use lamp_pipeline::documents::document;
use lamp_stack::CatalogueError;

use crate::args::options::{Common, parse_light};
use crate::catalogue::read_text;
use crate::exit::Exit;
use crate::output::endings::parse_toml;
use crate::output::json_report::ReportTo;
use crate::streams::{check_beside, input_name, is_stream, write_file};
use crate::terminal::progress::Progress;
use estimate_table::EstimateTable;
use lamp_plots::{self as plots, Plot, drawn};

/// Fit a resin's parameters to measurements, or a projector's to a picture of its light
///
/// It prints each parameter with its 95% confidence interval, writes the parameters to a material or a
/// projector's file, and plots the fit of a resin with the measured points.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp calibrate depth depths.csv -o mine.toml --plot depths.svg
  lamp calibrate width widths.csv --material mine.toml -o mine.toml --plot widths.png")]
pub(crate) struct CalibrateArgs {
    #[command(subcommand)]
    what: Calibration,
}

#[derive(Subcommand)]
enum Calibration {
    Depth(depth::DepthArgs),
    Width(width::WidthArgs),
    Lamp(lamp::LampArgs),
    Scan(scan::ScanArgs),
    Spread(spread::SpreadArgs),
    Gamma(gamma::GammaArgs),
    Kinetics(kinetics::KineticsArgs),
    Composition(composition::CompositionArgs),
    Projector(projector::ProjectorArgs),
}

pub(crate) fn run(args: &CalibrateArgs, common: &Common) -> Result<(), Exit> {
    match &args.what {
        Calibration::Depth(args) => depth::run(args, common),
        Calibration::Width(args) => width::run(args, common),
        Calibration::Lamp(args) => lamp::run(args, common),
        Calibration::Scan(args) => scan::run(args, common),
        Calibration::Spread(args) => spread::run(args, common),
        Calibration::Gamma(args) => gamma::run(args, common),
        Calibration::Kinetics(args) => kinetics::run(args, common),
        Calibration::Composition(args) => composition::run(args, common),
        Calibration::Projector(args) => projector::run(args, common),
    }
}

/// The files that both kinds of calibration read and write.
#[derive(Args)]
struct CalibrationFiles {
    /// Measurements: a CSV file, or - for standard input
    #[arg(value_name = "DATA")]
    data: PathBuf,

    /// Intensity of full white, which turns exposure_ms into doses; the material file records it
    /// [default: the material's]
    #[arg(long, value_name = "INTENSITY", value_parser = parse_light)]
    intensity: Option<Intensity>,

    /// Material to add the parameters to: a file or a built-in material's name
    #[arg(long, value_name = "MATERIAL")]
    material: Option<PathBuf>,

    /// Material file to write
    #[arg(short, long, value_name = "OUT", value_parser = parse_toml)]
    output: Option<PathBuf>,

    /// Name of the material [default: the name of --material, or of the file]
    #[arg(long, value_name = "NAME", requires = "output")]
    name: Option<String>,

    /// Plot points and curves: a file that ends in .svg or .png, or in .csv for a
    /// table
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,

    #[command(flatten)]
    report: ReportTo,
}

/// Measurements are some thousands of rows.
const MAX_TABLE_BYTES: u64 = 16 << 20;

impl CalibrationFiles {
    /// Checks, before the work, that the outputs can be written.
    fn check(&self) -> Result<(), Exit> {
        if is_stream(&self.data) && io::stdin().is_terminal() {
            return Err(Exit::usage("no measurements to read: name a file, or pipe one in"));
        }
        if let Some(output) = &self.output {
            if is_stream(output) {
                return Err(Exit::usage("the table goes to standard output: name a file with -o"));
            }
            check_beside(output, Path::new("-"), [&self.data])?;
        }
        if let Some(report) = self.report.path() {
            if self.output.iter().chain(&self.plot).any(|other| other == report) {
                let report = report.display();
                return Err(Exit::usage(format!("{report}: another output is written there")));
            }
            check_beside(report, Path::new("-"), self.material.iter().chain([&self.data]))?;
        }
        let Some(plot) = &self.plot else { return Ok(()) };
        plots::check_name(plot)?;
        if self.output.as_ref() == Some(plot) {
            return Err(Exit::usage(format!("{}: the material is written there", plot.display())));
        }
        check_beside(plot, Path::new("-"), self.material.iter().chain([&self.data]))
    }

    /// The material to add to, with the light given.
    fn base(&self) -> Result<Option<Material>, Exit> {
        Ok(self.material.as_deref().map(document).transpose()?)
    }

    /// The light that makes doses of times.
    fn light(&self, base: Option<&Material>) -> Result<Option<Intensity>, Exit> {
        match (self.intensity, base) {
            (None, Some(base)) => Ok(base.light().map_err(anyhow::Error::new)?),
            (given, _) => Ok(given),
        }
    }

    fn table(&self) -> Result<CsvTable, Exit> {
        let read = || -> anyhow::Result<CsvTable> {
            Ok(CsvTable::parse(&read_text(
                &self.data,
                MAX_TABLE_BYTES,
                "a table of measurements",
            )?)?)
        };
        Ok(read().with_context(|| self.place())?)
    }

    /// Where errors of the measurements are.
    fn place(&self) -> String {
        input_name(&self.data)
    }

    /// The measurements' name without its folder, which is nobody else's.
    fn source_name(&self) -> String {
        match self.data.file_name() {
            Some(name) if !is_stream(&self.data) => name.to_string_lossy().into_owned(),
            _ => self.place(),
        }
    }

    /// Returns the source line of a parameter fitted to `points` points.
    fn source(&self, points: usize) -> String {
        format!("calibrated from {}, {points} points", self.source_name())
    }

    /// Returns how a material of this base gets a spread of light. Its intensity stays the light of a wide
    /// field.
    fn spread_setter(
        &self,
        base: Option<&Material>,
        spread: SpreadNumbers,
    ) -> Result<impl FnOnce(&mut Material) + use<>, Exit> {
        let field = base.map(Material::light).transpose().map_err(anyhow::Error::new)?.flatten();
        Ok(move |material: &mut Material| {
            if material.spread.as_ref().is_some_and(|spread| spread.pixel.is_some())
                && let (Some(value), Some(given)) = (field, &material.intensity)
            {
                let source = format!("{}, as of a wide field", given.source);
                material.intensity = Some(Given { value, plus_minus: None, source });
            }
            material.spread = Some(spread);
        })
    }

    /// Writes what was asked for, and prints the table or its answer. Nothing is written unless
    /// all of it can be made.
    fn finish(
        &self,
        base: Option<Material>,
        add: impl FnOnce(&mut Material),
        plots: &[Plot],
        fitted: &EstimateTable,
        common: &Common,
    ) -> Result<(), Exit> {
        let progress = Progress::new("calibrate", common, true);
        let draw = |path| drawn(plots, path).map(|bytes| (path, bytes));
        let plot = self.plot.as_deref().map(draw).transpose()?;
        let material = self.output.as_deref().map(|output| -> Result<_, Exit> {
            let mut material = base.unwrap_or_else(|| self.new_material(output));
            if let Some(name) = &self.name {
                material.name.clone_from(name);
            }
            if let Some(value) = self.intensity {
                let source = format!("given with {}", self.source_name());
                material.intensity = Some(Given { value, plus_minus: None, source });
                if let Some(spread) = &mut material.spread {
                    // The given intensity is of a wide field, and no longer of a pixel.
                    spread.pixel = None;
                }
            }
            add(&mut material);
            let text = material.to_toml().map_err(|error| self.no_material(output, error))?;
            Ok((output, text.into_bytes()))
        });
        // The plot first: where it cannot be written, no material is left.
        for (path, bytes) in plot.into_iter().chain(material.transpose()?) {
            write_file(path, |out| out.write_all(&bytes))?;
            progress.wrote(path, &[]);
        }
        fitted.write(&self.report)
    }

    fn new_material(&self, output: &Path) -> Material {
        let stem = output.file_stem().unwrap_or_default().to_string_lossy();
        Material {
            name: stem.into_owned(),
            description: format!("Calibrated from {}", self.source_name()),
            ..Material::default()
        }
    }

    fn no_material(&self, output: &Path, error: CatalogueError<MaterialError>) -> Exit {
        match error {
            CatalogueError::Name { .. } => {
                Exit::usage(format!("{error}; give the material a --name"))
            }
            error => Exit::Failed(anyhow!(error).context(output.display().to_string())),
        }
    }
}
