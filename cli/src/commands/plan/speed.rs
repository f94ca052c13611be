//! `lamp plan speed`: chooses the time of each layer.

use std::path::PathBuf;

use clap::Args;
use lamp_grayscale::exposure::MeasuredDoses;
use lamp_pipeline::memory;
use lamp_planning::speed::{
    PartError, PartPages, SpeedOptions, SpeedPlanError, TimedPart, plan, recorded_ms, times_table,
};
use lamp_stack::Layer;

use super::speed_plot::plots_of;
use super::speed_report::{PlannedTimes, lines_of, write_report};
use crate::args::options::{Common, InputArgs, Output, parse_memory};
use crate::args::planning_options::{PlannedResin, PlanningOptions};
use crate::args::platform_options::PlatformOptions;
use crate::exit::Exit;
use crate::kept_stack::KeptStack;
use crate::output::endings::parse_table;
use crate::output::json_report::ReportTo;
use crate::streams::{
    check_beside, check_not_input, input_name, layers_of, layers_of_input, progress, write_file,
    write_layers,
};
use crate::terminal::progress::Progress;
use lamp_plots as plots;

/// Choose the time of each layer, and so the speed of the platform
///
/// Light that cures a layer also cures below it and to its sides. The images do not change; each
/// layer gets the time that cures the fewest voxels wrongly, within the limits of the platform. A
/// bound on the best plan is printed. Pages must state thickness and resolution.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp plan speed part.tif --material mine.toml -o timed.tif --profile speed.csv
  lamp plan speed part.tif --material pegda-sudan --max-change 20% --plot plan.svg -o timed.tif
  slice part.stl | lamp plan speed --material mine.toml --profile speed.csv | tile > build.tif")]
pub(super) struct SpeedArgs {
    #[command(flatten)]
    input: InputArgs,

    #[command(flatten)]
    planning: PlanningOptions,

    #[command(flatten)]
    platform: PlatformOptions,

    /// Write the height, thickness, exposure time and platform speed of each layer
    #[arg(long, value_name = "FILE.csv", value_parser = parse_table)]
    profile: Option<PathBuf>,

    #[command(flatten)]
    report: ReportTo,

    /// Plot wrong voxels and times by layer, doses, counts at 5% less and more light, and the
    /// course of the search: a file that ends in .svg or .png, or in .csv for a table
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,

    /// Memory to work in, in addition to the layers' edges; with less memory, the search sees fewer
    /// pixels [default: a quarter of available memory, or as much as helps]
    #[arg(long, value_name = "BYTES", value_parser = parse_memory)]
    memory: Option<u64>,

    #[command(flatten)]
    output: Output,
}

pub(super) fn run(args: &SpeedArgs, common: &Common) -> Result<(), Exit> {
    args.check_outputs()?;
    let PlannedResin { material, light, doubt, words } = args.planning.resin()?;
    let options = SpeedOptions {
        light,
        platform: args.platform.platform(),
        margin: args.planning.dose_margin,
        gap: args.planning.search_gap,
        memory: args.memory.unwrap_or_else(|| memory::available() / 4),
    };
    let progress = progress("plan", common, &args.output);
    let mut stack = KeptStack::new(&args.input.stack);
    let name = input_name(&args.input.stack);
    let part = args.part(&mut stack, &progress)?;
    let plan = plan(&part, &options).map_err(|error: SpeedPlanError| Exit::from(error).at(name))?;
    let planned = PlannedTimes { material: &material.name, part: &part, plan: &plan };
    args.write(&mut stack, &planned, &args.command(&words), &progress)?;
    let doses = MeasuredDoses::of_working_curve(&material);
    if let Some(light) = material.light().map_err(anyhow::Error::new)? {
        plan.times.iter().for_each(|&time| doses.see(light * time));
    }
    let doubts = doubt.into_iter().chain(doses.doubt("layers"));
    for line in lines_of(&planned).into_iter().chain(doubts) {
        progress.say(&line);
    }
    if let Some(path) = &args.profile {
        write_file(path, |out| out.write_all(times_table(&part, &plan.times).as_bytes()))?;
    }
    if let Some(path) = args.report.path() {
        write_report(&planned, args.planning.dose_margin, path)?;
    }
    if let Some(path) = &args.plot {
        let bytes = plots::drawn(&plots_of(&planned), path)?;
        write_file(path, |out| out.write_all(&bytes))?;
    }
    Ok(())
}

impl SpeedArgs {
    fn check_outputs(&self) -> Result<(), Exit> {
        if let Some(plot) = &self.plot {
            plots::check_name(plot)?;
        }
        self.report.check_output(&self.output.output)?;
        let beside: Vec<_> =
            self.profile.iter().chain(self.report.path()).chain(&self.plot).collect();
        for (number, path) in beside.iter().enumerate() {
            let inputs = [&self.input.stack, &self.planning.material].into_iter();
            let others = inputs.chain(beside[..number].iter().copied());
            check_beside(path, &self.output.output, others)?;
        }
        check_not_input(&self.output.output, [&self.planning.material])
    }

    fn part(&self, stack: &mut KeptStack, progress: &Progress) -> Result<TimedPart, Exit> {
        let name = || input_name(&self.input.stack);
        let mut pages = PartPages::new(self.planning.wanted.get());
        for layer in layers_of_input(stack.pages(true)?, &self.input, progress) {
            pages.push(layer?).map_err(|error: PartError| Exit::from(error).at(name()))?;
        }
        pages.finish().map_err(|error| Exit::from(error).at(name()))
    }

    fn write(
        &self,
        stack: &mut KeptStack,
        planned: &PlannedTimes<'_>,
        command: &str,
        progress: &Progress,
    ) -> Result<(), Exit> {
        // Read twice: a plan needs all layers, and their images may not fit in memory together.
        let layers = layers_of(stack.pages(false)?, &self.input.stack, self.input.layers.clone());
        // Times count from the light.
        let timed = layers.zip(planned.plan.times.iter().rev()).map(|(layer, time)| {
            let mut layer: Layer = layer?;
            layer.info.exposure_ms = Some(recorded_ms(*time));
            if let Some(stack) = &mut layer.info.stack {
                stack.commands.push(command.to_owned());
            }
            Ok(layer)
        });
        write_layers(timed, &self.output, progress)
    }

    /// The command, as pages record it.
    fn command(&self, resin: &str) -> String {
        let PlanningOptions { wanted, dose_margin, search_gap, dose_at, .. } = &self.planning;
        format!(
            "lamp plan speed {resin} --wanted {wanted} --dose-margin {}% --search-gap {}% --dose-at {dose_at}{}",
            100.0 * dose_margin,
            100.0 * search_gap,
            self.platform.words()
        )
    }
}
