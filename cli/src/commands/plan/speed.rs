//! `lamp plan speed`: chooses the time of each layer.

use std::path::PathBuf;

use clap::Args;
use lamp_batch::LayersOf;
use lamp_grayscale::exposure::MeasuredDoses;
use lamp_pipeline::memory;
use lamp_planning::speed::{
    PartError, PartPages, SpeedOptions, SpeedPlan, SpeedPlanError, TimedPart, plan, recorded_ms,
    times_table,
};
use lamp_planning::voxels::DOSE_MARGIN;
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
    check_beside, check_not_input, input_name, layers_of, layers_of_input, progress, unless_found,
    write_file, write_layers,
};
use crate::terminal::progress::Progress;
use lamp_plots as plots;

/// Choose the time of each layer, and so the speed of the platform
///
/// Light that cures a layer also cures below it and to its sides. The images do not change; each
/// layer gets the time that cures the fewest voxels wrongly, within the limits of the platform. A
/// bound on the best plan is printed. Pages must state thickness and resolution.
#[derive(Args, Clone)]
#[command(after_help = "\
Examples:
  lamp plan speed part.tif --material mine.toml -o timed.tif --profile speed.csv
  lamp plan speed part.tif --material pegda-sudan --max-change 20% --plot plan.svg -o timed.tif
  slice part.stl | lamp plan speed --material mine.toml --profile speed.csv | tile > build.tif")]
pub(crate) struct SpeedArgs {
    #[command(flatten)]
    pub(crate) input: InputArgs,

    #[command(flatten)]
    pub(crate) planning: PlanningOptions,

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
    pub(crate) memory: Option<u64>,

    /// Fail (status 3) and write no stack if the plan cures no voxel of the part
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    output: Output,
}

pub(super) fn run(args: &SpeedArgs, common: &Common) -> Result<(), Exit> {
    args.check_outputs()?;
    let progress = progress("plan", common, &args.output);
    args.plan(&progress, |layers, plan| {
        let layers =
            unless_found(layers, || args.finding(plan).filter(|_| args.strict).map(Exit::Findings));
        write_layers(layers, &args.output, &progress)
    })
}

impl SpeedArgs {
    /// Plans the stack, gives the layers with their times to `write`, and reports what they cure.
    ///
    /// # Errors
    /// Returns the first error of the stack, the plan or `write`.
    pub(crate) fn plan(
        &self,
        progress: &Progress,
        write: impl FnOnce(&mut LayersOf<'_, Exit>, &SpeedPlan) -> Result<(), Exit>,
    ) -> Result<(), Exit> {
        let PlannedResin { material, light, doubt, words } = self.planning.resin()?;
        let options = SpeedOptions {
            light,
            platform: self.platform.platform(),
            margin: self.planning.dose_margin.unwrap_or(DOSE_MARGIN),
            gap: self.planning.search_gap,
            memory: self.memory.unwrap_or_else(|| memory::available() / 4),
        };
        let mut stack = KeptStack::new(&self.input.stack);
        let name = input_name(&self.input.stack);
        let part = self.part(&mut stack, progress)?;
        let plan =
            plan(&part, &options).map_err(|error: SpeedPlanError| Exit::from(error).at(name))?;
        let planned = PlannedTimes { material: &material.name, part: &part, plan: &plan };
        let written = write(&mut self.timed(&mut stack, &plan, self.command(&words))?, &plan);
        // After a finding, report and plots still show the plan.
        if !matches!(written, Ok(()) | Err(Exit::Findings(_))) {
            return written;
        }
        let doses = MeasuredDoses::of_working_curve(&material);
        if let Some(light) = material.light().map_err(anyhow::Error::new)? {
            plan.times.iter().for_each(|&time| doses.see(light * time));
        }
        let doubts = doubt.into_iter().chain(doses.doubt("layers"));
        for line in lines_of(&planned).into_iter().chain(doubts) {
            progress.say(&line);
        }
        if let Some(path) = &self.profile {
            write_file(path, |out| out.write_all(times_table(&part, &plan.times).as_bytes()))?;
        }
        if let Some(path) = self.report.path() {
            write_report(&planned, options.margin, path)?;
        }
        if let Some(path) = &self.plot {
            let bytes = plots::drawn(&plots_of(&planned), path)?;
            write_file(path, |out| out.write_all(&bytes))?;
        }
        if let Some(doubt) = self.finding(&plan).filter(|_| !self.strict) {
            progress.warn(&doubt);
        }
        written
    }

    /// Returns why the plan is of no use, if it is.
    fn finding(&self, plan: &SpeedPlan) -> Option<String> {
        plan.after.cures_nothing().then(|| {
            format!(
                "{}: the plan cures no voxel of the part: even the slowest platform gives too little \
                 light; allow a slower --speed",
                input_name(&self.input.stack)
            )
        })
    }

    /// Returns the options that matter to bytes as one text; the digest of a material's file is not
    /// in it.
    pub(crate) fn canonical(&self) -> String {
        let memory = self.memory.map(|memory| format!(" --memory {memory}"));
        self.command(&self.planning.recorded_words()) + &memory.unwrap_or_default()
    }

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

    /// Returns the layers with their times.
    fn timed(
        &self,
        stack: &mut KeptStack,
        plan: &SpeedPlan,
        command: String,
    ) -> Result<impl Iterator<Item = Result<Layer, Exit>>, Exit> {
        // Read twice: a plan needs all layers, and their images may not fit in memory together.
        let layers = layers_of(stack.pages(false)?, &self.input.stack, self.input.layers.clone());
        // Times count from the light.
        let timed = layers.zip(plan.times.iter().rev()).map(move |(layer, time)| {
            let mut layer: Layer = layer?;
            layer.info.exposure_ms = Some(recorded_ms(*time));
            if let Some(stack) = &mut layer.info.stack {
                stack.commands.push(command.clone());
            }
            Ok(layer)
        });
        Ok(timed)
    }

    /// The command, as pages record it.
    fn command(&self, resin: &str) -> String {
        let PlanningOptions { wanted, dose_margin, search_gap, dose_at, .. } = &self.planning;
        format!(
            "lamp plan speed {resin} --wanted {wanted} --dose-margin {}% --search-gap {}% --dose-at {dose_at}{}",
            100.0 * dose_margin.unwrap_or(DOSE_MARGIN),
            100.0 * search_gap,
            self.platform.words()
        )
    }
}
