//! Jobs of plans on a glass: bitmaps, corrected after every print by the heights of its part.

use std::path::Path;

use anyhow::{Context, anyhow};
use lamp_grayscale::material::Material;
use lamp_pipeline::documents::document;
use lamp_pipeline::glass::{
    ColumnCureSettings, EcplSettings, GlassJob, GlassKind, GlassLesson, GlassSettings, plan_kind,
};
use lamp_pipeline::heights::{significant, time_text};
use lamp_planning::learn::{GlassNumber, JobFile, PrintMeasurements};
use lamp_planning::projector::Projector;
use lamp_planning::target::MapScale;
use lamp_stack::{Destination, Format, write_stack};
use serde::Serialize;

use super::plot::plots_of_glass;
use super::report::{MISFIT, PrintLine, StateLine, UnseparatedLine, WORSE, state_line};
use super::{LearnArgs, read_measured};
use crate::exit::Exit;
use crate::output::json_report::{JsonReport, schemas};
use crate::output::plan_folder::{plan_folder, write_plan};
use crate::streams::{extension, input_name, new_folder, print, write_file};
use crate::terminal::progress::Progress;
use lamp_plots as plots;

/// Begins a job with a plan's folder.
pub(super) fn begin(
    args: &LearnArgs,
    plan: &Path,
    material: &Path,
    progress: &Progress,
) -> Result<(), Exit> {
    let folder = &args.job;
    let kept = &args.kept;
    let Some(projector) = &kept.projector else {
        return Err(Exit::usage(
            "a plan of bitmaps needs its projector, too: give --projector PROJECTOR",
        ));
    };
    if kept.is_of_stacks() {
        return Err(Exit::usage(
            "--lamp-intensity, --wanted, --dose-at, --dose-margin, --speed and --max-change are for \
             stacks: a plan of bitmaps has its own settings",
        ));
    }
    if folder.join(JobFile::NAME).exists() {
        let folder = folder.display();
        return Err(Exit::Failed(anyhow!(
            "{folder} has a job already: leave out --start, or name another folder"
        )));
    }
    match plan_kind(plan)? {
        GlassKind::ColumnCure => {
            begin_of::<ColumnCureSettings>(folder, plan, projector, material, progress)
        }
        GlassKind::Ecpl => begin_of::<EcplSettings>(folder, plan, projector, material, progress),
    }
}

fn begin_of<S: GlassSettings>(
    folder: &Path,
    plan: &Path,
    projector: &Path,
    material: &Path,
    progress: &Progress,
) -> Result<(), Exit> {
    let (projector, material): (Projector, Material) = (document(projector)?, document(material)?);
    let new = new_folder(folder, false)?;
    for (name, bytes) in GlassJob::<S>::begun(plan, &projector, &material)? {
        new.add(&name, |out| out.write_all(&bytes))
            .with_context(|| folder.display().to_string())?;
    }
    // Opened before it has its name, so that no job is begun whose files contradict each other.
    GlassJob::<S>::open(new.path())?;
    new.persist().map_err(|error| Exit::Failed(error.into()).at(folder.display().to_string()))?;
    progress.say(&format!(
        "{} is begun: print 0 has the bitmaps of {}",
        folder.display(),
        input_name(plan)
    ));
    Ok(())
}

/// Learns from the heights of a print.
pub(super) fn run(
    kind: GlassKind,
    args: &LearnArgs,
    measured: &Path,
    output: &Path,
    progress: &Progress,
) -> Result<(), Exit> {
    match kind {
        GlassKind::ColumnCure => run_of::<ColumnCureSettings>(args, measured, output, progress),
        GlassKind::Ecpl => run_of::<EcplSettings>(args, measured, output, progress),
    }
}

fn run_of<S: GlassSettings>(
    args: &LearnArgs,
    measured: &Path,
    output: &Path,
    progress: &Progress,
) -> Result<(), Exit> {
    if args.law.is_some() {
        return Err(Exit::usage("--law is for jobs of stacks: leave it out"));
    }
    args.check_outputs()?;
    let mut job = GlassJob::<S>::open(&args.job)?;
    let next = plan_folder(output, false)?;
    let name = input_name(measured);
    let (measured, text) = read(args, &job, measured)?;
    let last = job.prints.len() - 1;
    let may_be_again = args.print.is_none_or(|print| print + 1 == last);
    let again = if may_be_again { job.take_back(&text) } else { None };
    let number = again.map_or_else(|| job.print_to_learn_from(args.print), Ok)?;
    let lesson =
        job.learn(number, &measured, progress).map_err(|error| Exit::from(error).at(name))?;
    match again {
        Some(print) => {
            job.check_again(print, &lesson)?;
            progress.say(&format!("print {print} was used already: this is the same again"));
        }
        None => keep(&job, number, &text, &lesson)?,
    }
    write_plan(next, &lesson.next)?;
    progress.wrote(output, &[]);
    // Read again, so that the report shows the job as it is on the disk.
    let job = GlassJob::<S>::open(&args.job)?;
    if let Some(path) = args.report.path() {
        write_report(&job, number, &lesson, path)?;
    }
    if let Some(path) = &args.plot {
        let bytes = plots::drawn(&plots_of_glass(&job), path)?;
        write_file(path, |out| out.write_all(&bytes))?;
    }
    match args.report.is_printed() {
        true => Ok(()),
        false => print(&lines_of(&job, number, &lesson)),
    }
}

/// Keeps the measurements of a print and the next plan in the job.
fn keep<S: GlassSettings>(
    job: &GlassJob<S>,
    print: usize,
    text: &str,
    lesson: &GlassLesson,
) -> Result<(), Exit> {
    let bitmaps = job.bitmaps_file(print + 1);
    let named = |error| Exit::from(error).at(bitmaps.display().to_string());
    write_stack(lesson.next.pages().layers(), Destination::File(bitmaps.clone()), Format::Big)
        .map_err(named)?;
    for (file, text) in job.files_to_keep(print, text, lesson)? {
        write_file(&file, |out| out.write_all(text.as_bytes()))?;
    }
    Ok(())
}

/// Reads the heights of a print: a table, or a PNG with its scale.
fn read<S: GlassSettings>(
    args: &LearnArgs,
    job: &GlassJob<S>,
    path: &Path,
) -> Result<(PrintMeasurements, String), Exit> {
    match (args.pixel.zip(args.full), extension(path).as_str()) {
        (Some((pixel, full)), "png") => {
            let map = job.measured_map(path, MapScale { pixel, full })?;
            let text = map.to_text();
            Ok((map, text))
        }
        (None, "png") => Err(Exit::usage(
            "a height map needs its scale: give --pixel, and --full for the height of white",
        )),
        (Some(_), _) => Err(Exit::usage("--pixel and --full are for a height map as a PNG")),
        (None, _) => read_measured(path),
    }
}

/// Returns the error of each print that was measured, in micrometers.
fn errors_um<S: GlassSettings>(job: &GlassJob<S>) -> impl Iterator<Item = f64> {
    let measured = job.prints.iter().filter_map(|print| print.measured.as_ref());
    measured.map(|(measured, _)| measured.error().number())
}

/// Returns the print with the least error, among all prints that were measured as the last one was.
fn best_of<S: GlassSettings>(job: &GlassJob<S>) -> Option<(usize, f64)> {
    let measured: Vec<_> = job
        .prints
        .iter()
        .enumerate()
        .filter_map(|(number, print)| Some((number, &print.measured.as_ref()?.0)))
        .collect();
    let (_, last) = *measured.last()?;
    let alike = measured.into_iter().filter(|(_, other)| other.is_comparable(last));
    let errors = alike.map(|(number, measured)| (number, measured.error().number()));
    errors.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The lines that are printed.
fn lines_of<S: GlassSettings>(job: &GlassJob<S>, number: usize, lesson: &GlassLesson) -> String {
    let um = |error: f64| format!("{} um", significant(error));
    let errors: Vec<_> = errors_um(job).map(um).collect();
    let prints = match number {
        0 => "error of print 0".to_owned(),
        _ => format!("errors of prints 0 to {number}"),
    };
    let mut text = format!("{prints} (RMS of heights): {}\n", errors.join(", "));
    if let Some((best, least)) = best_of(job) {
        text += &format!("best print so far: {best}, {}\n", um(least));
        let last = errors_um(job).last().filter(|last| *last > WORSE * least);
        if let Some(last) = last {
            let last = um(last);
            text += &format!("warning: print {number} is worse than print {best}: {last}\n");
        }
    }
    let state = &lesson.fit.state;
    for ((number, after), (_, before)) in state.factors().zip(lesson.before.factors()) {
        text += &state_line(number.name(), after, before);
    }
    if state.factors().any(|(number, _)| number == GlassNumber::Dose) {
        text += "the dose is light over critical dose: heights show only their ratio\n";
    }
    for pair in state.unseparated() {
        let [one, other] = pair.names;
        text += &format!("the measurements do not separate the {one} from the {other}\n");
    }
    text += &format!("the heights scatter by {} about this state\n", um(lesson.noise_um));
    if is_unexplained(lesson) {
        text += &format!(
            "warning: no state explains the measurements: they are {} standard deviations off\n",
            significant(lesson.fit.misfit)
        );
    }
    let [mean, low, high] = lesson.expected_um.map(significant);
    let next = number + 1;
    text += &format!("print {next} is expected to have an error of {mean} um ({low} to {high})\n");
    let is_better = |best: &(usize, f64)| lesson.expected_um[0] > WORSE * best.1;
    if let Some((best, least)) = best_of(job).filter(is_better) {
        let least = um(least);
        text += &format!("warning: print {best} was better, {least}: print it again\n");
    }
    let seconds = job.prints.get(next).map_or(0.0, |print| print.seconds);
    text + &format!("print {next}: {} of exposures\n", time_text(seconds))
}

/// Returns true if the measurements state how exact they are, and no state comes near them.
fn is_unexplained(lesson: &GlassLesson) -> bool {
    // Maps do not state it: their noise is what the residuals show.
    lesson.fit.misfit > MISFIT && lesson.noise_um / lesson.fit.misfit > GlassLesson::MAP_SD_UM
}

/// Bitmaps learned from prints, by `lamp learn --report` of a plan on a glass.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct LearnColumnsHead<'a> {
    /// Name of the part.
    part: &'a str,
    /// Name of the material.
    material: &'a str,
    /// Name of the projector.
    projector: &'a str,
    /// Number of the measured print.
    print: usize,
    /// Number of the print with the least error so far, of those measured in the same way.
    best_print: Option<usize>,
    /// Standard deviation of the heights about the state, in micrometers.
    noise_um: f64,
    /// Mean error that the next print is expected to have, measured in the same way: root mean
    /// square of heights, in micrometers.
    expected_um: f64,
    /// Ends of the interval of 95 % of the states for this error, in micrometers.
    expected_interval_um: [f64; 2],
    /// Sum of the exposure times of the next print, in seconds.
    exposure_s: f64,
}

schemas! {
    "lamp-learn-columns-1": LearnColumnsHead<'_>,
        "state": [StateLine],
        "unseparated": [UnseparatedLine],
        "prints": [PrintLine];
}

/// Writes the report.
fn write_report<S: GlassSettings>(
    job: &GlassJob<S>,
    number: usize,
    lesson: &GlassLesson,
    path: &Path,
) -> Result<(), Exit> {
    let [mean, low, high] = lesson.expected_um;
    let head = LearnColumnsHead {
        part: job.part(),
        material: &job.material.name,
        projector: &job.projector.name,
        print: number,
        best_print: best_of(job).map(|best| best.0),
        noise_um: lesson.noise_um,
        expected_um: mean,
        expected_interval_um: [low, high],
        exposure_s: job.prints.get(number + 1).map_or(0.0, |print| print.seconds),
    };
    let prints = job.prints.iter().enumerate().map(|(number, print)| {
        let error = print.measured.as_ref().map(|(measured, _)| measured.error());
        PrintLine::new(number, print.seconds, error)
    });
    let states = lesson.fit.state.factors().zip(lesson.before.factors());
    let states =
        states.map(|((number, after), (_, before))| StateLine::new(number.name(), after, before));
    JsonReport::of_schema("lamp-learn-columns-1", &head)
        .list("state", states)
        .list("unseparated", UnseparatedLine::all(lesson.fit.state.unseparated()))
        .list("prints", prints)
        .write(path)
}
