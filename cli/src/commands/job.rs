//! `lamp job`: the work of a machine that scans, for a build.

use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::Args;
use lamp_gantry::{
    BuildClock, BuildPages, GantryError, GrayBy, Job, JobFolder, JobOptions, JobSeam, MirrorArray,
    seen_from,
};
use lamp_machine::{LightTable, Machine, Scan};
use lamp_pipeline::documents::{document_and_text, folder_of, without_digest};
use lamp_pipeline::heights::time_text;

use crate::args::options::{Common, TimeArgs, one_of_described, parse_layers};
use crate::exit::Exit;
use crate::output::json_report::{print_answer, schemas};
use crate::streams::{input_name, is_stream, new_folder, print};
use crate::terminal::progress::say;

/// Plan the scan of a build: speeds, swaths and times of each layer
///
/// A machine with [scan] in its file moves a display of mirrors over the resin. For each layer, the
/// job has the speed and the row clock (rows per second) that give the layer's exposure, and the
/// swaths that contain white, in the order that takes the head the least time. Black swaths are
/// left out, and so are the rows above the first and below the last white row of a swath. An
/// exposure that the machine cannot give is refused, with the layer and the limit.
///
/// The folder gets job.json, layers.csv and swaths.csv, and a copy of the machine's file.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp job build.tif --machine mine.toml -o job/
  lamp job strips/ --machine mine.toml -o job/
  lamp job build.tif --machine mine.toml --seam time --gray-by time -o job/
  lamp frames job/ --layer 812 --swath 3 -o swath.frames
  lamp expose job/ --layers 812")]
pub(crate) struct JobArgs {
    /// Build: a stack, or a folder of strips
    #[arg(value_name = "BUILD")]
    build: PathBuf,

    #[command(flatten)]
    scan: ScanArgs,

    /// Plan only these layers: A..B is A to B - 1; A.. and ..B are open-ended
    #[arg(long, value_name = "A..B", value_parser = parse_layers)]
    layers: Option<Range<u32>>,

    /// Folder to write the job to
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// Replace a folder that an earlier run wrote, once the new one is complete
    #[arg(long, alias = "overwrite")]
    force: bool,

    /// Print the job's totals as JSON, as docs/json.md describes it
    #[arg(long)]
    json: bool,
}

/// How a machine scans a build.
#[derive(Args, Clone, Debug)]
pub(super) struct ScanArgs {
    /// Machine: a file with [scan]
    #[arg(long, value_name = "MACHINE")]
    machine: Option<PathBuf>,

    /// Exposure of the columns that a swath and the next share [default: comb, or as the strips
    /// were cut]
    #[arg(long)]
    #[arg(value_parser = one_of_described::<JobSeam>(&[
        "Each pixel belongs to one swath: each row changes over at its own column",
        "Strips of tile --seam gray, whose levels fall as the next strip's rise",
        "Each swath exposes a pixel with only its share of the rows of mirrors that pass over it",
    ]))]
    seam: Option<JobSeam>,

    /// How gray levels are exposed
    #[arg(long, value_name = "HOW", default_value_t)]
    #[arg(value_parser = one_of_described::<GrayBy>(&[
        "The build is dithered; gray layers are refused",
        "No dots: a gray pixel is on for a share of the rows of mirrors that pass over it, in \
         proportion to its level",
    ]))]
    gray_by: GrayBy,
}

/// Reads the light across the mirrors of a machine, whose file is at `path`.
pub(super) fn mirrors_of(
    path: &Path,
    scan: &Scan,
) -> Result<(Option<LightTable>, MirrorArray), Exit> {
    let folder = folder_of::<Machine>(path);
    // A word of a record has a digest behind the name.
    let (path, _) = without_digest(path);
    let light = scan.light.as_ref().map(|light| {
        light.read(&folder, scan.mirrors()).map_err(|error| {
            Exit::Failed(error.into()).at(folder.join(&light.file).display().to_string())
        })
    });
    let light = light.transpose()?;
    let mirrors = MirrorArray::of(scan, light.as_ref())
        .map_err(|error| Exit::from(error).at(path.display().to_string()))?;
    Ok((light, mirrors))
}

/// Starts the clock of a build on a machine, whose file is at `path`.
pub(crate) fn build_clock(
    path: Option<&Path>,
    machine: Option<&Machine>,
    times: TimeArgs,
) -> Result<BuildClock, Exit> {
    let scan = machine.and_then(|machine| machine.scan.as_ref());
    let mirrors = path.zip(scan).map(|(path, scan)| mirrors_of(path, scan)).transpose()?;
    Ok(BuildClock::new(machine, mirrors.map(|(_, mirrors)| mirrors)).with_times(times.into()))
}

/// A machine that scans, as its file has it.
pub(super) struct Scanner {
    machine: Machine,
    text: String,
    light: Option<LightTable>,
    pub(super) mirrors: MirrorArray,
}

impl ScanArgs {
    /// Returns whether none of the options is given.
    pub(super) fn is_default(&self) -> bool {
        self.machine.is_none() && self.seam.is_none() && self.gray_by == GrayBy::default()
    }

    fn scanner(&self) -> Result<Scanner, Exit> {
        let Some(path) = &self.machine else {
            return Err(Exit::usage("--machine is missing: give a machine's file with [scan]"));
        };
        let (machine, text) = document_and_text::<Machine>(path)?;
        let Some(scan) = &machine.scan else {
            return Err(GantryError::NoScan { machine: machine.name }.into());
        };
        let (light, mirrors) = mirrors_of(path, scan)?;
        Ok(Scanner { machine, text, light, mirrors })
    }

    /// Plans layers of a build. `name` is the build's in the job.
    pub(super) fn plan(
        &self,
        build: &Path,
        name: String,
        layers: Range<u32>,
    ) -> Result<(Job, BuildPages, Scanner), Exit> {
        check_file(build)?;
        let scanner = self.scanner()?;
        let at = |error: GantryError| Exit::from(error).at(input_name(build));
        let pages = BuildPages::open(build).map_err(at)?;
        let options = JobOptions { seam: self.seam, gray: self.gray_by, layers };
        let job = Job::plan(&pages, name, &scanner.machine, &scanner.mirrors, &options);
        Ok((job.map_err(at)?, pages, scanner))
    }
}

/// Refuses standard input: a job names its build.
fn check_file(build: &Path) -> Result<(), Exit> {
    match is_stream(build) {
        true => Err(Exit::usage("a job names its build: give the build's file or folder")),
        false => Ok(()),
    }
}

schemas! {
    "lamp-job-sums-1": lamp_gantry::JobSums;
    "lamp-job-1": lamp_gantry::Job;
}

pub(crate) fn run(args: &JobArgs, common: &Common) -> Result<(), Exit> {
    check_file(&args.build)?;
    let folder = new_folder(&args.output, args.force)?;
    let name = seen_from(folder.path(), &args.build)
        .map_err(|error| Exit::Failed(error.into()).at(input_name(&args.build)))?;
    let name = name.into_os_string().into_string().map_err(|name| {
        Exit::usage(format!("{}: a job names its build, and this name is no text", name.display()))
    })?;
    let layers = args.layers.clone().unwrap_or(0..u32::MAX);
    let (job, _, scanner) = args.scan.plan(&args.build, name, layers)?;
    JobFolder::write(folder, &job, &scanner.text, scanner.light.as_ref())
        .map_err(|error| Exit::from(error).at(args.output.display().to_string()))?;
    if args.json {
        return print_answer("lamp-job-sums-1", &job.sums);
    }
    if !common.quiet && !args.json {
        say(&format!("job: {}: written", args.output.display()));
    }
    if common.quiet {
        return Ok(());
    }
    print(&text(&job, &scanner))
}

fn text(job: &Job, scanner: &Scanner) -> String {
    let sums = &job.sums;
    let ends = |of: fn(&lamp_gantry::JobLayer) -> f64| {
        let all = job.layers.iter().map(of);
        let [least, most] = [all.clone().fold(f64::INFINITY, f64::min), all.fold(0.0, f64::max)];
        if most - least < 0.005 {
            format!("{least:.2}")
        } else {
            format!("{least:.2} to {most:.2}")
        }
    };
    let mut text = format!(
        "layers:     {}\nexposure:   {} ms\nspeed:      {} mm/s, {} rows/s\n\
         swaths:     {} ({} black ones are left out), {} frames\n\
         time:       {}: {} scanning, {} between swaths, {} between layers\n",
        sums.layers,
        ends(|layer| layer.exposure_ms),
        ends(|layer| layer.speed_mm_per_s),
        ends(|layer| layer.row_clock_hz),
        sums.swaths,
        sums.empty_swaths,
        sums.frames,
        time_text(sums.seconds),
        time_text(sums.scan_s),
        time_text(sums.steps_s),
        time_text(sums.between_s),
    );
    if !scanner.mirrors.is_even() {
        text += &format!(
            "light:      white is within {:.2} % of its exposure: half a row of {:.1}\n",
            50.0 / job.full_rows,
            job.full_rows
        );
    }
    if let (Some(tilt), Some(mirrors)) = (job.tilt, job.layout().tilt) {
        text += &format!(
            "tilt:       {} degrees: mirrors of {:.2} um pass every {:.2} um, and white is even beyond \
             {} pixels from an edge\n",
            tilt.degrees,
            tilt.mirror_pitch_um,
            mirrors.address_px() * job.pitch_um,
            mirrors.edge_px(),
        );
    }
    if scanner.machine.recoat_s().is_none() {
        text += "recoating is not in it: write recoat_s into [times] of the machine's file\n";
    }
    text
}
