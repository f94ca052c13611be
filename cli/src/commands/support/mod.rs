//! `lamp support`: ties floating islands to the part below them.

mod hints;
mod json;
mod plan_file;
mod report;
mod solid;
mod vents;

use std::path::PathBuf;

use anyhow::{Context, anyhow};
use clap::Args;
use lamp_edit::{Edits, edit};
use lamp_machine::Machine;
use lamp_pipeline::RecordedSlicing;
use lamp_pipeline::documents::document;
use lamp_pipeline::part_file::{PartFile, paths};
use lamp_pipeline::solid::name_of_all;
use lamp_pipeline::support::SupportSettings;
use lamp_stack::{CompensateRecord, Length, Page, PageHeader, PageInfo, StrutSection};
use lamp_supports::{
    CheckError, Findings, Support, SupportError, SupportFoot, SupportOptions, SupportPlan, Surface,
    flood_supports, padded, plan_braces, plan_supports, room_for,
};
use serde_json::Value;

use crate::args::options::{Common, Output, parse_thickness};
use crate::args::parsed::Parsed;
use crate::args::solid::part_file;
use crate::args::stages::SupportStageArgs;
use crate::exit::Exit;
use crate::kept_stack::KeptStack;
use crate::output::endings::parse_toml;
use crate::output::json_report::ReportTo;
use crate::streams::Layers;
use crate::streams::{
    check_beside, check_not_input, failed_at, input_name, is_stream, layers_of, progress,
    write_file, write_layers,
};
use crate::terminal::progress::Progress;
use crate::terminal::stack_notes::doubts;
use hints::hints;
use plan_file::plan_text;
use report::SupportReport;

/// Connect floating islands to the part or the platform by the shortest supports
///
/// Supports stay in the mold and become features of the casting, so look at each before you build.
/// The command tries directions over a cone below the middle of an island. It takes the shortest
/// support that can be built and meets the part where it is smooth, even and away from creases.
/// Wide islands get as many as --least-support asks. Islands without such a support are left, and
/// reported. With --to platform, islands get pillars from the platform, with thin tips, to be cut off
/// after the build. The plan is a list of edits: delete or exchange supports in it, and apply it with
/// lamp edit.
#[derive(Args, Clone)]
#[command(after_help = "\
Examples:
  lamp support blade.tif --part blade.stl -o supported.tif
  lamp support blade.tif --part blade.stl --plan supports.toml --stl supports.stl -o supported.tif
  lamp edit blade.tif supports.toml -o supported.tif
  lamp support blade.tif --part blade.stl --max-tilt 60deg --strict -o supported.tif
  lamp support clip.tif --part clip.stl --to platform -o supported.tif
  lamp support cup.tif --vent 2mm --plan vents.toml

Exit status: 0 if the work is done; 3 with --strict if islands are left or rest on too little, if
undersides of --overhangs are left, if there are stray rows, or if --vent leaves a pocket.")]
pub(crate) struct SupportArgs {
    /// The stack to read: a TIFF or picture file, a folder of pages, or - for standard input
    #[arg(value_name = "STACK", default_value = "-")]
    pub(crate) stack: PathBuf,

    /// The part that the stack was sliced from; repeat it for several parts, in the same order as
    /// to slice
    #[arg(
        long,
        value_name = "PART",
        required_unless_present = "vent",
        value_parser = part_file()
    )]
    pub(crate) part: Vec<PartFile>,

    /// Plan holes of this diameter that drain cups and traps, and no supports: --plan gets them, and
    /// no stack is written
    #[arg(
        long,
        value_name = "DIAMETER",
        requires = "plan",
        conflicts_with_all = ["part", "stl", "report", "json", "output", "avoid"],
        value_parser = parse_thickness,
        hide_short_help = true
    )]
    vent: Option<Length>,

    /// Write the supports as a list of edits, with alternatives, for you to change
    #[arg(long, value_name = "FILE.toml", value_parser = parse_toml)]
    plan: Option<PathBuf>,

    /// Write the supports as an STL
    #[arg(long, value_name = "FILE.stl", value_parser = solid::parse_stl)]
    stl: Option<PathBuf>,

    #[command(flatten)]
    report: ReportTo,

    /// Stop with status 3 if islands are left or rest on too little, if there are stray rows, or if
    /// pages of a folder may be missing: no stack is written, and the next stage of a pipe fails, too
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    settings: Parsed<SupportStageArgs, SupportSettings>,

    /// Machine whose blade drags on floating features: alpha, beta or a file (see lamp machine)
    #[arg(long, value_name = "MACHINE", default_value = "alpha")]
    pub(crate) machine: PathBuf,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(args: &SupportArgs, common: &Common) -> Result<(), Exit> {
    args.check_files()?;
    let mut stack = KeptStack::new(&args.stack);
    if let Some(diameter) = args.vent {
        // No stage follows: no stack is written.
        let progress = Progress::new("support", common, true);
        return vents::propose(args, diameter, &mut stack, &progress);
    }
    let progress = progress("support", common, &args.output);
    let layers = args.layers(&mut stack, &progress)?;
    write_layers(layers, &args.output, &progress)
}

impl SupportArgs {
    /// Plans supports, writes what stands beside the stack, and returns the layers with supports,
    /// as `lamp edit` draws their plan.
    pub(crate) fn layers(
        &self,
        stack: &mut KeptStack,
        progress: &Progress,
    ) -> Result<Layers<'static>, Exit> {
        let machine: Machine = document(&self.machine)?;
        let first = first_page(stack)?;
        let name = input_name(&self.stack);
        let surface = self.surface(&first.info, &name, progress)?;
        // Room for pillars that lean outwards.
        let options = self.settings.options();
        let reach = first.pitch.map_or([0.0; 2], |pitch| pitch.pixels(options.reach_outside()));
        let room = reach[0].max(reach[1]).ceil().min(MOST_ROOM) as u32;
        let found = self.check(stack, room, progress)?;
        let of_stack = |error: Exit| match error.cause::<SupportError>() {
            Some(_) => error.at(name.clone()),
            None => error,
        };
        let mut plan = |found: &Findings, options: &SupportOptions| {
            self.plans(stack, found, &surface, options, room).map_err(of_stack)
        };
        let supports = plan(&found, &options)?;
        let hints = hints(&supports, &found, &options, plan)?;
        let outside =
            room_for(supports.rods(), &found, room).map_err(|error| of_stack(Exit::from(error)))?;
        let part = first.info.stack.map(|stack| stack.part).unwrap_or_default();
        let plan = plan_text(&part, &supports, outside, &found);
        self.write_beside(&plan, &supports)?;
        let least_support = self.settings.least_support;
        let recoating = machine.recoating.as_ref();
        let report = SupportReport::new(&supports, &found, recoating, least_support, &hints);
        if let Some(path) = self.report.path() {
            report.write(&part, path)?;
        }
        report.tell(progress);
        let troubles = report.troubles();
        if self.strict && !troubles.is_empty() {
            return Err(Exit::Findings(troubles.join("; ")));
        }
        troubles.iter().for_each(|trouble| progress.warn(trouble));
        if let Some(doubts) = doubts().filter(|_| self.strict) {
            return Err(Exit::Findings(doubts));
        }
        let layers = layers_of(stack.pages(true)?, &self.stack, None);
        Ok(match supports.supports().next() {
            None => Box::new(layers),
            Some(_) => {
                let edited = edit(layers, Edits::from_toml(&plan)?, vec![], vec![], |_, _| {});
                Box::new(edited.map(|layer| Ok(layer?.decode()?)))
            }
        })
    }

    /// Plans the supports and their braces, and checks in the images that they hold.
    fn plans(
        &self,
        stack: &mut KeptStack,
        found: &Findings,
        surface: &Surface,
        options: &SupportOptions,
        room: u32,
    ) -> Result<SupportPlan, Exit> {
        let mut layers = || -> Result<_, Exit> {
            let layers = layers_of(stack.pages(true)?, &self.stack, None);
            Ok(layers.map(move |layer| layer.map(|layer| padded(layer, room))))
        };
        let mut plan = plan_supports(layers()?, found, surface, options)?;
        if plan.supports().any(Support::is_pillar) {
            plan_braces(layers()?, found, &mut plan, options)?;
        }
        if plan.supports().next().is_some() {
            flood_supports(layers()?, found, &mut plan, options)?;
        }
        Ok(plan)
    }

    /// Returns the options that matter to bytes as one text. The machine only decides forces.
    pub(crate) fn canonical(&self) -> String {
        self.settings.canonical()
    }

    fn check_files(&self) -> Result<(), Exit> {
        let inputs = || paths(&self.part).chain([&self.stack]);
        if inputs().filter(|path| is_stream(path)).count() > 1 {
            return Err(Exit::usage("only one input can be standard input"));
        }
        let SupportSettings { to, radius, pillar, spacing, .. } = *self.settings;
        let wide = match to {
            SupportFoot::Part => Length::from_um(2.0 * radius.um()),
            SupportFoot::Platform | SupportFoot::Both => pillar,
        };
        if self.settings.overhangs.is_some() && spacing.um() < wide.um() {
            return Err(Exit::usage(format!(
                "--spacing {spacing}: supports are {wide} wide, so they would touch: write at least that"
            )));
        }
        let SupportSettings { strut_section, thickness_ratio, flow, .. } = &*self.settings;
        if *strut_section == StrutSection::Round && (thickness_ratio.is_some() || flow.is_some()) {
            return Err(Exit::usage(
                "--flow and --thickness-ratio are of --strut-section ellipse or aerofoil: write one of them",
            ));
        }
        if *strut_section != StrutSection::Round && to == SupportFoot::Platform {
            return Err(Exit::usage(
                "--strut-section is of supports to the part: pillars are round, as they are cut off",
            ));
        }
        check_not_input(&self.output.output, paths(&self.part))?;
        if self.vent.is_none() {
            self.report.check_output(&self.output.output)?;
        }
        for beside in self.plan.iter().chain(&self.stl).chain(self.report.path()) {
            check_beside(beside, &self.output.output, inputs())?;
        }
        Ok(())
    }

    /// Opens the part, where it lay when it was sliced. `first` is the stack's first page.
    fn surface(&self, first: &PageInfo, name: &str, progress: &Progress) -> Result<Surface, Exit> {
        let sliced = RecordedSlicing::of(first.stack.as_ref()).with_context(|| {
            format!("{name} does not record how its part was sliced: slice it with lamp")
        })?;
        if let Some(why) = moved(first) {
            return Err(Exit::Failed(anyhow!(
                "{name} {why}, so its position differs from its part: support it before that"
            )));
        }
        let keep_marks = self.settings.avoided_names().next().is_some();
        let part = sliced.open(&self.part, name, keep_marks, progress)?;
        let solid = &sliced.settings.solid;
        let of_part = |error: Exit| error.at(name_of_all(&self.part));
        let facets = solid.body(part.clone()).map_err(|error| of_part(error.into()))?;
        let mut avoided = Vec::new();
        for name in self.settings.avoided_names() {
            let surface = solid.surface(&part, name).map_err(|error| of_part(error.into()))?;
            avoided.extend(surface);
        }
        Ok(Surface::new(facets).avoiding(avoided))
    }

    /// Finds the islands, with some pixels of black around the images.
    fn check(
        &self,
        stack: &mut KeptStack,
        room: u32,
        progress: &Progress,
    ) -> Result<Findings, Exit> {
        let options = self.settings.check_options();
        let name = input_name(&self.stack);
        let failed = |error| failed_at(name.clone(), error);
        let pages = stack.pages(true)?.map(|page| page.map_err(failed));
        let decode = |page: Page| page.decode().map(|layer| padded(layer, room)).map_err(failed);
        let found = lamp_supports::check(pages, decode, &options);
        progress.done();
        found.map_err(|error| match error.cause::<CheckError>() {
            Some(_) => error.at(name.clone()),
            None => error,
        })
    }

    /// Writes the plan and the STL.
    fn write_beside(&self, plan: &str, supports: &SupportPlan) -> Result<(), Exit> {
        if let Some(path) = &self.plan {
            write_file(path, |out| out.write_all(plan.as_bytes()))?;
        }
        if let Some(path) = &self.stl {
            write_file(path, |out| solid::prisms(supports.rods()).write_stl(out))?;
        }
        Ok(())
    }
}

/// The most black around the images in pixels, where options ask for more than any machine has.
const MOST_ROOM: f64 = 20_000.0;

/// Returns what the first page says.
fn first_page(stack: &mut KeptStack) -> Result<PageHeader, Exit> {
    let page = stack.pages(true)?.next();
    let page = page.unwrap_or(Err(lamp_stack::StackError::NoLayers));
    Ok(page.map_err(|error| failed_at(input_name(&stack.path), error))?.header())
}

/// Returns what was done to a stack so that it no longer lies as its part did when it was sliced.
fn moved(first: &PageInfo) -> Option<&'static str> {
    if first.record().is_some_and(|page: CompensateRecord| page.shrinkage.is_some()) {
        return Some("was enlarged for shrinkage");
    }
    let stack = first.stack.as_ref()?;
    let commands = &stack.commands;
    if stack.is_build() || commands.iter().any(|command| command.starts_with("tile ")) {
        return Some("is a build");
    }
    let edits = commands.iter().filter_map(|command| command.strip_prefix("edit "));
    let edits = edits.filter_map(|list| serde_json::from_str::<Vec<Value>>(list).ok()).flatten();
    let turns = |edit: &Value| ["rotate", "mirror"].iter().any(|key| edit.get(key).is_some());
    let mut turned = edits.filter(turns);
    turned.next().map(|_| "was turned by lamp edit")
}

#[cfg(test)]
mod tests {
    use lamp_stack::StackInfo;

    use super::*;

    #[test]
    fn stacks_that_moved_are_told() {
        let of = |commands: &[&str]| {
            let commands = commands.iter().map(ToString::to_string).collect();
            let stack = StackInfo { commands, ..StackInfo::default() };
            moved(&PageInfo { stack: Some(stack), ..PageInfo::default() })
        };
        assert_eq!(of(&["slice a.stl", "edit [{\"pad\":{\"left\":\"1mm\"}}]"]), None);
        assert_eq!(of(&["slice a.stl", "edit [{\"rotate\":90}]"]), Some("was turned by lamp edit"));
        assert_eq!(of(&["slice a.stl", "tile --copies 2"]), Some("is a build"));
    }
}
