//! `lamp learn`: corrects the times of layers, or bitmaps, after every print.

mod begin;
mod glass;
mod plot;
mod report;

use std::fs;
use std::num::NonZeroU8;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, ValueEnum};
use lamp_pipeline::glass::job_kind;
use lamp_pipeline::memory;
use lamp_planning::learn::{Job, Law, Method, PrintMeasurements, learn};
use lamp_planning::speed::{Platform, Speed};
use lamp_planning::{PlanFolder, SampleHeight};
use lamp_stack::Length;

use crate::args::lamp_option::LampOption;
use crate::args::options::{Common, one_of_described, parse_memory, parse_thickness};
use crate::args::planning_options::{SAMPLE_HEIGHTS, parse_margin};
use crate::args::platform_options::{DEFAULT_SPEEDS, parse_change, parse_speeds};
use crate::catalogue::read_text;
use crate::exit::Exit;
use crate::output::endings::parse_table;
use crate::output::json_report::ReportTo;
use crate::streams::{check_beside, input_name, is_stream, print, read_beside, write_file};
use crate::terminal::progress::Progress;
use lamp_plots as plots;
use report::{lines_of, write_report};

/// Measurements are read whole.
const MAX_TABLE: u64 = 64 << 20;

/// Correct layer times or bitmaps after every print, from measurements
///
/// A job is a folder that keeps a stack, its material, and the times and measurements of all
/// prints. Begin a job with a stack that has exposure times, print it, and give your measurements:
/// the heights of downward faces, or the wrongly cured pixels of each layer. The command finds the
/// state of light and resin that all prints show, plans the times again for that state, and writes
/// them for the next print. Sizes of named places are measurements, too.
///
/// A job can also begin with the folder of lamp plan column-cure or lamp plan ecpl. Its measurements
/// are heights on the glass, as a table or as a height map, and the next print is another such folder.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp learn job/ --start timed.tif --material mine.toml
  lamp learn job/ --measured heights.csv -o next.csv
  lamp learn job/ --measured areas.csv --measured places.toml -o next.csv
  lamp learn job/ --measured areas.csv --law single --gain 6e-6 --plot learn.svg -o next.csv
  lamp learn job/ --start plan/ --material mine.toml --projector zhao
  lamp learn job/ --measured map.png --pixel 10um --full 500um -o next/")]
pub(crate) struct LearnArgs {
    /// Folder of the job
    #[arg(value_name = "JOB")]
    job: PathBuf,

    /// Begin the job with this stack, whose pages state the exposures of print 0, or with the folder
    /// of a plan of column-cure or ecpl
    #[arg(long, value_name = "STACK|PLAN", conflicts_with = "measured")]
    start: Option<PathBuf>,

    #[command(flatten)]
    kept: KeptOptions,

    /// Measurements of a print: x_mm, y_mm, z_mm, measured_mm and sd_um, or layer, over_px and
    /// under_px, or a TOML file of places that states what is measured. Twice for a table and places of
    /// the same print. Of a part on a glass also a PNG height map
    #[arg(long, value_name = "FILE", requires = "output")]
    measured: Vec<PathBuf>,

    /// Side of a measured height map's pixels on the glass
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness)]
    #[arg(requires_all = ["full", "measured"])]
    pixel: Option<Length>,

    /// Height of a measured height map's full white
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness)]
    #[arg(requires_all = ["pixel", "measured"])]
    full: Option<Length>,

    /// The print that was measured: 0 is the first [default: the last]
    #[arg(long, value_name = "N", requires = "measured")]
    print: Option<usize>,

    /// Change the times by a law of wrong pixels, without a plan
    #[arg(long, value_enum, requires = "measured")]
    law: Option<LawName>,

    /// Gain of a law, in seconds per pixel [default: 6e-6]
    #[arg(long, value_name = "S/PX", value_parser = parse_gain, requires = "law")]
    gain: Option<f64>,

    /// Write the layers' times for the next print, or the folder of its bitmaps
    #[arg(short, long, value_name = "NEXT", requires = "measured")]
    output: Option<PathBuf>,

    #[command(flatten)]
    report: ReportTo,

    /// Plot the errors and the times of all prints: a file that ends in .svg or .png, or in .csv for a
    /// table
    #[arg(long, value_name = "FILE", requires = "measured")]
    plot: Option<PathBuf>,

    /// Memory to work in, in addition to the layers' edges [default: a quarter of available memory]
    #[arg(long, value_name = "BYTES", value_parser = parse_memory)]
    memory: Option<u64>,
}

/// The options that a job begins with, and keeps.
#[derive(Args, Clone, Debug)]
struct KeptOptions {
    /// Resin: a built-in material's name (see lamp material list) or a file
    #[arg(long, value_name = "MATERIAL", requires = "start")]
    material: Option<PathBuf>,

    /// Projector of a plan of column-cure or ecpl: a built-in projector's name (see lamp projector
    /// list) or a file
    #[arg(long, value_name = "PROJECTOR", requires = "start")]
    projector: Option<PathBuf>,

    #[command(flatten)]
    lamp: LampOption,

    /// Lowest gray level that counts as part of the wanted solid [default: 128]
    #[arg(long, value_name = "LEVEL", requires = "start")]
    wanted: Option<NonZeroU8>,

    /// Height in its layer at which a voxel's dose is computed [default: top]
    #[arg(long, value_name = "HEIGHT", requires = "start")]
    #[arg(value_parser = one_of_described::<SampleHeight>(&SAMPLE_HEIGHTS))]
    dose_at: Option<SampleHeight>,

    /// Margin to the critical dose: plans keep voxels this far from it [default: 5%]
    #[arg(long, value_name = "SHARE", requires = "start", value_parser = parse_margin)]
    dose_margin: Option<f64>,

    /// Slowest and fastest speed of the platform [default: 5um/s..2mm/s]
    #[arg(long, value_name = "A..B", requires = "start", value_parser = parse_speeds)]
    speed: Option<(Speed, Speed)>,

    /// Greatest difference in speed between neighboring layers, such as 20%
    #[arg(long, value_name = "SHARE", requires = "start", value_parser = parse_change)]
    max_change: Option<f64>,
}

impl KeptOptions {
    /// Returns true if an option is given that only stacks have.
    fn is_of_stacks(&self) -> bool {
        self.lamp.light().is_some()
            || self.wanted.is_some()
            || self.dose_at.is_some()
            || self.dose_margin.is_some()
            || self.speed.is_some()
            || self.max_change.is_some()
    }

    fn platform(&self) -> Platform {
        let (slowest, fastest) = self.speed.unwrap_or(DEFAULT_SPEEDS);
        Platform { slowest, fastest, max_change: self.max_change }
    }
}

/// Laws of learning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LawName {
    /// Each layer from its own error
    Single,
    /// Each layer from the errors around and below it
    Multi,
}

impl LearnArgs {
    fn method(&self) -> Method {
        let gain = self.gain.unwrap_or(Law::GAIN);
        match self.law {
            None => Method::State,
            Some(LawName::Single) => Method::Law(Law::Single { gain }),
            Some(LawName::Multi) => Method::Law(Law::multi(gain)),
        }
    }
}

pub(crate) fn run(args: &LearnArgs, common: &Common) -> Result<(), Exit> {
    let progress = Progress::new("learn", common, true);
    if args.report.path().is_some() && args.measured.is_empty() {
        return Err(Exit::usage("--report and --json are of a print that was --measured"));
    }
    if let Some(stack) = &args.start {
        let Some(material) = &args.kept.material else {
            return Err(Exit::usage("--start needs the resin: give --material MATERIAL"));
        };
        // A folder of pages is a stack, too.
        if stack.join(PlanFolder::BITMAPS).exists() {
            return glass::begin(args, stack, material, &progress);
        }
        if args.kept.projector.is_some() {
            return Err(Exit::usage(format!(
                "--projector is for the folder of a plan on a glass, and {} has no bitmaps.tif",
                input_name(stack)
            )));
        }
        return begin::begin(&args.job, stack, material, &args.kept, &progress);
    }
    let ([_, ..], Some(output)) = (&args.measured[..], &args.output) else {
        return Err(Exit::usage(
            "begin a job with --start STACK --material M, or give what was --measured",
        ));
    };
    if let Some(kind) = job_kind(&args.job) {
        let [measured] = &args.measured[..] else {
            return Err(Exit::usage("give --measured once: a plan on a glass has heights alone"));
        };
        return glass::run(kind, args, measured, output, &progress);
    }
    if args.pixel.is_some() {
        return Err(Exit::usage(
            "--pixel and --full are for jobs of bitmaps on a glass: leave them out",
        ));
    }
    parse_table(&output.to_string_lossy()).map_err(Exit::usage)?;
    if is_stream(output) {
        return Err(Exit::usage("name a file for the next profile, such as -o next.csv"));
    }
    args.check_outputs()?;
    let memory = args.memory.unwrap_or_else(|| memory::available() / 4);
    let mut job = open(&args.job, &progress)?;
    let (measured, text, name) = args.read_all_measured()?;
    let last = job.prints.len() - 1;
    // A run that was cut off is called again with the same table: it must not count as one more
    // print.
    let may_be_again = args.print.is_none_or(|print| print + 1 == last);
    let again = if may_be_again { job.take_back(&text) } else { None };
    let print_number = again.map_or_else(|| job.print_to_learn_from(args.print), Ok)?;
    if let Some(earlier) = job.print_measured_as(&text) {
        progress.say(&format!(
            "warning: print {print_number} has the same measurements as print {earlier}, to the letter"
        ));
    }
    let learned = learn(&job, print_number, &measured, args.method(), memory)
        .map_err(|error| Exit::from(error).at(name))?;
    match again {
        Some(print) => {
            job.check_again(print, &learned)?;
            progress.say(&format!("print {print} was used already: this is the same again"));
        }
        None => {
            for (file, text) in job.files_to_keep(print_number, &text, &learned) {
                write_file(&file, |out| out.write_all(text.as_bytes()))?;
            }
        }
    }
    // After the job's own files: a print from a profile that the job lacks could not be learned
    // from.
    write_file(output, |out| out.write_all(job.profile(&learned.times).as_bytes()))?;
    // Read again, so that report and plot show the job as it is on the disk.
    let job = open(&args.job, &progress)?;
    if let Some(path) = args.report.path() {
        write_report(&job, print_number, &learned, path)?;
    }
    if let Some(path) = &args.plot {
        let bytes = plots::drawn(&plot::plots_of(&job), path)?;
        write_file(path, |out| out.write_all(&bytes))?;
    }
    match args.report.is_printed() {
        true => Ok(()),
        false => print(&lines_of(&job, print_number, &learned)),
    }
}

/// Opens a job.
pub(super) fn open(folder: &Path, progress: &Progress) -> Result<Job, Exit> {
    let job = Job::open(folder, read_beside);
    progress.done();
    job
}

/// Refuses an output in the folder of a job, whose files are sealed.
pub(super) fn check_outside_job(job: &Path, output: &Path) -> Result<(), Exit> {
    let folder = output.parent().map(|folder| if folder == "" { Path::new(".") } else { folder });
    let folder = folder.and_then(|folder| fs::canonicalize(folder).ok());
    let job = fs::canonicalize(job).ok();
    if job.is_some() && folder == job {
        let name = output.display();
        return Err(Exit::usage(format!("{name} is in the job's folder: name another file")));
    }
    Ok(())
}

/// Reads what was measured, and its text.
fn read_measured(path: &Path) -> Result<(PrintMeasurements, String), Exit> {
    let read = || -> anyhow::Result<_> {
        let text = read_text(path, MAX_TABLE, "a table of measurements")?;
        Ok((PrintMeasurements::parse(&text)?, text))
    };
    Ok(read().with_context(|| input_name(path))?)
}

impl LearnArgs {
    /// Reads all that was measured, its text, and its name for messages.
    fn read_all_measured(&self) -> Result<(PrintMeasurements, String, String), Exit> {
        let (one, other) = match &self.measured[..] {
            [one] => {
                let (measured, text) = read_measured(one)?;
                return Ok((measured, text, input_name(one)));
            }
            [one, other] => (one, other),
            _ => return Err(Exit::usage("give --measured once, or twice with a file of places")),
        };
        if is_stream(one) && is_stream(other) {
            return Err(Exit::usage("standard input has one of both: name a file for the other"));
        }
        let [first, second] = [read_measured(one)?, read_measured(other)?];
        let names = format!("{} and {}", input_name(one), input_name(other));
        let Some(text) = PrintMeasurements::joined([&first.1, &second.1]) else {
            return Err(Exit::usage(format!(
                "{names}: of two files, one is a table and the other has places"
            )));
        };
        let measured = PrintMeasurements::parse(&text);
        Ok((measured.with_context(|| names.clone())?, text, names))
    }

    fn check_outputs(&self) -> Result<(), Exit> {
        if let Some(plot) = &self.plot {
            plots::check_name(plot)?;
        }
        let files: Vec<_> =
            self.output.iter().chain(self.report.path()).chain(&self.plot).collect();
        for (number, path) in files.iter().enumerate() {
            check_outside_job(&self.job, path)?;
            let others = self.measured.iter().chain(files[..number].iter().copied());
            check_beside(path, Path::new("-"), others)?;
        }
        Ok(())
    }
}

fn parse_gain(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(gain) if gain > 0.0 && gain < 1e3 => Ok(gain),
        _ => Err(format!("`{text}` is not a gain in seconds a pixel: write 6e-6")),
    }
}
