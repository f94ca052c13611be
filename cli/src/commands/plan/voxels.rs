//! `lamp plan voxels`: chooses the gray level of each pixel.

use std::path::PathBuf;

use clap::Args;
use lamp_batch::LayersOf;
use lamp_grayscale::exposure::MeasuredDoses;
use lamp_grayscale::resin::ExposureTime;
use lamp_pipeline::memory;
use lamp_planning::voxels::{Options, Outcome, Sources, VoxelObjective, VoxelPlanError, plan};
use lamp_stack::Layer;

use super::layer_map::{LayerMap, MapOptions};
use super::voxels_plot::plots_of;
use super::voxels_report::{PlannedVoxels, lines_of, write_report};
use crate::args::options::{Common, InputArgs, Output, one_of_described, parse_memory};
use crate::args::planning_options::{PlannedResin, PlanningOptions};
use crate::exit::Exit;
use crate::output::json_report::ReportTo;
use crate::streams::{
    check_beside, check_not_input, input_name, progress, read_layers, unless_found, write_file,
    write_layers,
};
use crate::terminal::progress::Progress;
use crate::terminal::stack_notes::doubts;
use lamp_plots as plots;

/// Choose the gray level of each pixel from the doses of all layers together
///
/// Light that cures a layer also cures below it and to its sides. From a stack of the wanted part,
/// 1-bit or gray, this writes gray pages that cure as few voxels wrongly as possible, and prints a
/// bound on their distance from the best plan. Pages must state thickness and resolution.
#[derive(Args, Clone)]
#[command(after_help = "\
Examples:
  lamp plan voxels part.tif --material mine.toml -o planned.tif
  lamp plan voxels part.tif --material mine.toml --sources grow:3px --plot plan.svg -o planned.tif
  slice part.stl --material mine.toml | lamp plan voxels --material mine.toml | dither > dots.tif
  lamp plan voxels part.tif --material zsg-amber --expose 373ms --objective boundary \\
      --sources shell:1px --min-level 40 --report plan.json -o planned.tif")]
pub(crate) struct VoxelsArgs {
    #[command(flatten)]
    pub(crate) input: InputArgs,

    #[command(flatten)]
    pub(crate) planning: PlanningOptions,

    /// Quantity that the plan minimizes
    #[arg(long, default_value = "wrong", value_parser = one_of_described::<VoxelObjective>(&[
        "How far doses are on the wrong side of the critical dose",
        "The dose next to the part, while everything that white light cures stays cured",
    ]))]
    objective: VoxelObjective,

    /// Pixels to choose light for: the part's (lit), the part's and 3 around it (grow:3px), or only
    /// 1 along its outlines, while others stay white (shell:1px)
    #[arg(long, value_name = "WHICH", default_value = "lit", value_parser = parse_sources)]
    sources: Sources,

    /// Lowest level of a pixel that is not black, for screens whose dark grays cure nothing
    #[arg(long, value_name = "LEVEL", default_value = "0")]
    min_level: u8,

    /// Keep this many pixels along the part's outlines white, for example wall:3px
    #[arg(long, value_name = "WALL", value_parser = parse_wall)]
    keep_white: Option<u32>,

    /// Also count this many voxels around the images, for example 0px [default: as far as light
    /// spreads]
    #[arg(long, value_name = "PIXELS", value_parser = parse_around)]
    around: Option<u32>,

    /// Exposure time of all pages, in place of their own
    #[arg(long, value_name = "TIME", value_parser = parse_exposure)]
    pub(crate) expose: Option<ExposureTime>,

    #[command(flatten)]
    report: ReportTo,

    /// Plot wrong voxels by layer, doses, counts at 5% less and more light, and the course of the
    /// search: a file that ends in .svg or .png, or in .csv for a table
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,

    /// Memory to work in. With less memory, fewer layers are planned at a time, which takes longer
    /// and changes gray levels slightly [default: a quarter of available memory, or as much as
    /// helps]
    #[arg(long, value_name = "BYTES", value_parser = parse_memory)]
    pub(crate) memory: Option<u64>,

    #[command(flatten)]
    map: MapOptions,

    /// Fail (status 3) and write no stack if white light cannot cure all wanted voxels, or if pages of
    /// a folder may be missing
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    output: Output,
}

/// Returns why a plan that cures nothing is of no use.
fn nothing_cured(outcome: &Outcome) -> Option<&'static str> {
    let has_targets = outcome.layers.iter().any(|layer| layer.targets > 0);
    outcome.cures_nothing().then_some(if has_targets {
        "the plan cures no wanted voxel: expose longer, or keep the voxels that white light cures by \
         --objective boundary"
    } else {
        "the plan cures no wanted voxel, and neither does white light: expose longer"
    })
}

/// Returns the pixels of `3px`, which are some.
fn parse_pixels(text: &str) -> Option<u32> {
    text.strip_suffix("px")?.trim_end().parse().ok().filter(|pixels| (1..=1_000).contains(pixels))
}

fn parse_sources(text: &str) -> Result<Sources, String> {
    let pixels = |text: &str| {
        let wrong = || format!("`{text}` is not a number of pixels: write 1px to 1000px");
        parse_pixels(text).ok_or_else(wrong)
    };
    match text.split_once(':') {
        None if text == "lit" => Ok(Sources::Lit),
        Some(("grow", by)) => pixels(by).map(Sources::Grow),
        Some(("shell", by)) => pixels(by).map(Sources::Shell),
        _ => Err(format!("`{text}` is not one of lit, grow:3px, shell:1px")),
    }
}

fn parse_wall(text: &str) -> Result<u32, String> {
    let pixels = text.strip_prefix("wall:").and_then(parse_pixels);
    pixels.ok_or_else(|| format!("`{text}` is not a wall: write wall:3px"))
}

fn parse_around(text: &str) -> Result<u32, String> {
    let none = (text == "0px").then_some(0);
    let wrong = || format!("`{text}` is not a number of pixels: write 0px to 1000px");
    none.or_else(|| parse_pixels(text)).ok_or_else(wrong)
}

fn parse_exposure(text: &str) -> Result<ExposureTime, String> {
    match text.parse::<ExposureTime>() {
        Ok(time) if time.ms() > 0.0 => Ok(time),
        Ok(_) => Err("an exposure takes some time".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

pub(super) fn run(args: &VoxelsArgs, common: &Common) -> Result<(), Exit> {
    args.check_outputs()?;
    let progress = progress("plan", common, &args.output);
    args.plan(&progress, |layers, outcome| {
        // The bar of the plan has counted its layers to its end.
        let writing = Progress::new("plan", common, true);
        writing.expect(outcome.layers.len() as u64);
        let layers = unless_found(layers, || args.finding(outcome));
        write_layers(layers, &args.output, &writing)
    })
}

/// Passes a part's layers on, and shows them to a map.
fn seen_by(
    map: &mut LayerMap<'_>,
    mut layers: impl Iterator<Item = Result<Layer, Exit>>,
) -> impl Iterator<Item = Result<Layer, Exit>> {
    std::iter::from_fn(move || match layers.next() {
        Some(layer) => Some(layer.and_then(|layer| map.before(&layer).map(|()| layer))),
        // Only the end shows that a layer is missing.
        None => map.check().err().map(Err),
    })
}

impl VoxelsArgs {
    /// Plans the stack, gives the planned layers to `write`, and reports what they cure.
    ///
    /// # Errors
    /// Returns the first error of the stack, the plan or `write`.
    pub(crate) fn plan(
        &self,
        progress: &Progress,
        write: impl FnOnce(&mut LayersOf<'_, Exit>, &Outcome) -> Result<(), Exit>,
    ) -> Result<(), Exit> {
        let PlannedResin { material, light, doubt, words } = self.planning.resin()?;
        let command = self.command(&words);
        let layers = read_layers(&self.input, progress)?;
        let mut map = LayerMap::new(&self.map, light, self.planning.wanted.get());
        let doses = MeasuredDoses::of_working_curve(&material);
        let wide_field = material.light().map_err(anyhow::Error::new)?;
        let layers = layers.map(|layer| {
            let layer = self.prepared(layer?, &command);
            let time = layer.info.exposure_ms.map(ExposureTime::from_ms);
            wide_field.zip(time).into_iter().for_each(|(light, time)| doses.see(light * time));
            Ok(layer)
        });
        let mut settled = 0;
        let planned = plan(seen_by(&mut map, layers), &light, &self.options(), |layers| {
            // A plan reports the number of all settled layers, and the bar counts one by one.
            (settled..layers).for_each(|_| progress.layer_done());
            settled = layers;
        });
        let mut planned = planned.map_err(|error: Exit| self.at_input(error))?;
        progress.done();
        let outcome = planned.outcome();
        let layers = planned.by_ref().map(|layer| layer.map_err(Exit::from));
        let mut layers = layers.inspect(|layer| layer.iter().for_each(|layer| map.after(layer)));
        let written = write(&mut layers, &outcome);
        // After a finding, report and plots still show the plan.
        if !matches!(written, Ok(()) | Err(Exit::Findings(_))) {
            return written;
        }
        // It borrows the plan, whose bound is complete now.
        drop(layers);
        let planned = PlannedVoxels {
            material: &material.name,
            objective: self.objective,
            margin: self.options().margin(),
            outcome: &planned.outcome(),
        };
        let doubts = doubt.into_iter().chain(doses.doubt("layers"));
        for line in lines_of(&planned).into_iter().chain(doubts) {
            progress.say(&line);
        }
        if let Some(path) = self.report.path() {
            write_report(&planned, path)?;
        }
        if let Some(path) = &self.plot {
            let bytes = plots::drawn(&plots_of(&planned), path)?;
            write_file(path, |out| out.write_all(&bytes))?;
        }
        if let Some((path, bytes)) = map.drawn()? {
            write_file(path, |out| out.write_all(&bytes))?;
        }
        if let Some(why) = nothing_cured(planned.outcome).filter(|_| !self.strict) {
            progress.warn(&format!("{}: {why}", input_name(&self.input.stack)));
        }
        written
    }

    /// Returns the options that matter to bytes as one text; the digest of a material's file is not
    /// in it.
    pub(crate) fn canonical(&self) -> String {
        let mut text = self.command(&self.planning.recorded_words());
        if let Some(time) = self.expose {
            text += &format!(" --expose {time}");
        }
        if let Some(memory) = self.memory {
            text += &format!(" --memory {memory}");
        }
        text
    }

    fn check_outputs(&self) -> Result<(), Exit> {
        self.plot.as_deref().map_or(Ok(()), plots::check_name)?;
        self.map.map.as_deref().map_or(Ok(()), plots::check_picture_name)?;
        self.report.check_output(&self.output.output)?;
        let beside = || self.report.path().into_iter().chain(&self.plot).chain(&self.map.map);
        for (number, path) in beside().enumerate() {
            let inputs = [&self.input.stack, &self.planning.material];
            check_beside(path, &self.output.output, inputs)?;
            if beside().take(number).any(|other| other == path) {
                return Err(Exit::usage(format!("{}: named twice", path.display())));
            }
        }
        check_not_input(&self.output.output, [&self.planning.material])
    }

    fn options(&self) -> Options {
        Options {
            wanted: self.planning.wanted,
            objective: self.objective,
            margin: self.planning.dose_margin,
            sources: self.sources,
            min_level: self.min_level,
            keep_wall: self.keep_white.unwrap_or(0),
            gap: self.planning.search_gap,
            around: self.around,
            memory: Some(self.memory.unwrap_or_else(|| memory::available() / 4)),
            ..Options::default()
        }
    }

    /// The command, as pages record it.
    fn command(&self, resin: &str) -> String {
        let PlanningOptions { wanted, search_gap, dose_at, .. } = &self.planning;
        let mut command = format!(
            "lamp plan voxels {resin} --objective {} --wanted {wanted} --dose-margin {}% --search-gap {}% --dose-at {dose_at}",
            self.objective,
            100.0 * self.options().margin(),
            100.0 * search_gap
        );
        match self.sources {
            Sources::Lit => {}
            Sources::Grow(by) => command += &format!(" --sources grow:{by}px"),
            Sources::Shell(by) => command += &format!(" --sources shell:{by}px"),
        }
        if self.min_level > 0 {
            command += &format!(" --min-level {}", self.min_level);
        }
        if let Some(wall) = self.keep_white {
            command += &format!(" --keep-white wall:{wall}px");
        }
        if let Some(around) = self.around {
            command += &format!(" --around {around}px");
        }
        command
    }

    /// Gives a page the exposure of the options, if there is one, and records the command.
    fn prepared(&self, mut layer: Layer, command: &str) -> Layer {
        let given = self.expose.map(ExposureTime::ms);
        layer.info.exposure_ms = given.or(layer.info.exposure_ms);
        if let Some(stack) = &mut layer.info.stack {
            stack.commands.push(command.to_owned());
        }
        layer
    }

    /// Names the input in errors about its layers.
    fn at_input(&self, error: Exit) -> Exit {
        let is_of_layers = error.cause::<VoxelPlanError>().is_some();
        if is_of_layers { error.at(input_name(&self.input.stack)) } else { error }
    }

    /// Returns what `--strict` finds.
    fn finding(&self, outcome: &Outcome) -> Option<Exit> {
        let name = || input_name(&self.input.stack);
        let found = match outcome.uncurable() {
            0 => nothing_cured(outcome).map(|why| format!("{}: {why}", name())).or_else(doubts),
            uncurable => {
                Some(format!("{}: white light cannot cure {uncurable} wanted voxels", name()))
            }
        };
        found.filter(|_| self.strict).map(Exit::Findings)
    }
}
