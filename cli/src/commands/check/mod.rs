//! `lamp check`: finds what would float away, be trapped or bend as a stack is built.

mod pictures;
mod report;

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::Args;
use lamp_machine::Machine;
use lamp_slicing::SliceError;
use lamp_slicing::topology::CornerTable;
use lamp_stack::{Layer, Page, one_line};
use lamp_supports::{
    AcceptedFindings, CheckError, Disagreements, Feature, FindingGroup, Findings, IslandMinimum,
    LoneMinimum,
};

use crate::args::options::{Common, parse_layers, parse_memory};
use crate::args::parsed::Parsed;
use crate::args::slicing::SlicingArgs;
use crate::args::stages::CheckStageArgs;
use crate::exit::Exit;
use crate::kept_stack::KeptStack;
use crate::output::json_report::ReportTo;
use crate::output::numbers::number_of;
use crate::streams::{check_beside, failed_at, in_range, input_name, is_stream, new_folder, print};
use crate::terminal::progress::{Progress, printable};
use crate::terminal::stack_notes::doubts;
use lamp_pipeline::build_copies::{BuildCopies, Inseparable};
use lamp_pipeline::check::{CheckSettings, Found, known};
use lamp_pipeline::exposure::ExposureSettings;
use lamp_pipeline::solid::at_part;
use lamp_pipeline::{SliceSettings, SlicedPart, StackLight, check_slicing};

use pictures::write_pictures;
use report::write_report;

/// Find features that would be swept away, trap resin or bend as a stack is built
///
/// An island is a white area that rests on nothing: the recoating blade sweeps it away. Each island
/// gets a line, as do weak joints, pockets that hold resin, overhangs, features narrower than design
/// rules allow, unbalanced bodies, white at the border and empty layers; the worst come first. Bonds
/// between layers and slots that close are judged by the resin: the stack's, or --material. A part
/// is sliced first, with the options of `slice`; its mesh also shows where islands must be. Only the
/// report lists effects of rounding to pixels, and islands that are neither as wide as --speck nor
/// float for --speck-layers.
#[derive(Args, Clone)]
#[command(after_help = "\
Examples:
  lamp check build.tif
  lamp check blade.stl --rotate x:180 --evidence pictures/
  slice blade.stl | fix | lamp check --strict
  lamp check night/*.tif --only islands,pockets --report check.json
  lamp check blade.tif --accept check.json --strict
  lamp check blade.tif --material lamp-suspension --rules mine.toml

Exit status: 0 if the work is done, even with findings; 3 with --strict if there are any.")]
pub(crate) struct CheckArgs {
    /// Stacks (TIFF or picture files, folders of pages, - for standard input) or parts; each is
    /// checked separately
    #[arg(value_name = "STACK|PART", default_value = "-")]
    inputs: Vec<PathBuf>,

    #[command(flatten)]
    pub(crate) settings: Parsed<CheckStageArgs, CheckSettings>,

    #[command(flatten)]
    report: ReportTo,

    /// Write pictures of the worst findings to a new folder, with the whole layer and a side view:
    /// findings in red, other white that rests on nothing white in yellow, the layer below in gray
    #[arg(long, value_name = "DIR")]
    evidence: Option<PathBuf>,

    /// Leave out findings that are in this report of an earlier check: the same kind at the same
    /// place, to within a millimeter
    #[arg(long, value_name = "FILE.json")]
    accept: Option<PathBuf>,

    /// Replace a folder of pictures that an earlier run wrote
    #[arg(long, alias = "overwrite")]
    force: bool,

    /// End with status 3 if there are findings, or if pages of a folder may be missing
    #[arg(long)]
    strict: bool,

    /// Use only these layers: A..B is A to B - 1; A.. and ..B are open-ended. The first of these
    /// layers is on the platform
    #[arg(long, value_name = "A..B", value_parser = parse_layers)]
    layers: Option<Range<u32>>,

    /// Memory for the table of crossings of a part
    #[arg(long, value_name = "BYTES", value_parser = parse_memory)]
    memory: Option<u64>,

    #[command(flatten)]
    slicing: SlicingArgs,
}

pub(crate) fn run(args: &CheckArgs, common: &Common) -> Result<(), Exit> {
    for beside in args.report.path().into_iter().chain(&args.evidence) {
        check_beside(beside, Path::new("-"), &args.inputs)?;
    }
    if args.inputs.iter().filter(|input| is_stream(input)).count() > 1 {
        return Err(Exit::usage("standard input can be read only once: give - once"));
    }
    let machine: Machine = args.settings.machine()?;
    let mut slicing = SliceSettings::try_from(&args.slicing)?;
    // Of stacks, the resin is the one whose light design rules judge.
    if matches!(slicing.exposure, ExposureSettings::Material { .. }) {
        slicing.exposure = ExposureSettings::None {};
    }
    check_slicing(&slicing, &args.inputs, Some(&machine))?;
    let evidence = args.evidence.as_deref().map(|folder| new_folder(folder, args.force));
    let evidence = evidence.transpose()?;
    let accepted = args.accept.as_deref().map(read_accepted).transpose()?;
    let checked = args.inputs.iter().map(|path| {
        let mut checked = args.checked(path, &machine, common)?;
        if let Some(accepted) = &accepted {
            checked.found.accept(accepted);
        }
        if !args.report.is_printed() {
            print(&printed(&checked.name, &checked.found, common.verbose))?;
        }
        Ok(checked)
    });
    let mut checked = checked.collect::<Result<Vec<_>, Exit>>()?;
    if let Some(path) = args.report.path() {
        write_report(&checked, machine.recoating.as_ref(), path)?;
    }
    if let Some(folder) = evidence {
        write_pictures(&mut checked, args, common, folder)?;
    }
    let found: usize = checked.iter().map(|checked| checked.found.count()).sum();
    let found = match found {
        0 => doubts(),
        found => Some(number_of(found as u64, "finding")),
    };
    found.filter(|_| args.strict).map_or(Ok(()), |found| Err(Exit::Findings(found)))
}

/// Reads the findings of an earlier report.
fn read_accepted(path: &Path) -> Result<AcceptedFindings, Exit> {
    let name = input_name(path);
    let text = std::fs::read_to_string(path).with_context(|| name.clone())?;
    AcceptedFindings::from_json(&text).map_err(|error| {
        let problem =
            format!("this is no report of lamp check --report: {}", one_line(&error.to_string()));
        Exit::Failed(anyhow!(problem)).at(name)
    })
}

impl CheckArgs {
    /// Finds what there is in an input.
    fn checked(
        &self,
        path: &Path,
        machine: &Machine,
        common: &Common,
    ) -> Result<CheckedInput, Exit> {
        let slicing = SliceSettings::try_from(&self.slicing)?;
        let mut input = Input::open(path, &slicing, common)?;
        // The mesh is out of memory before the layers come.
        let minima = self.minima(&input)?;
        let progress = Progress::new("check", common, true);
        let name = input_name(path);
        let found = match &mut input {
            Input::Stack(stack) => {
                let path = stack.path.clone();
                let mut pages = stack.pages(self.evidence.is_some())?.peekable();
                let first = pages.peek().and_then(|page| page.as_ref().ok());
                let from = self.layers.as_ref().map_or(0, |layers| layers.start);
                let build = BuildCopies::of_page(first, from);
                let folders = [path.parent().unwrap_or(Path::new("")), Path::new("")];
                let light = match &slicing.exposure {
                    ExposureSettings::None {} => {
                        StackLight::of_stack(first.map(Page::info), &folders)
                    }
                    settings => StackLight::of_settings(settings)?,
                };
                let pages = in_range(pages, Page::info, path, self.layers.clone());
                let decode = |(page, _): (Page, _)| {
                    let layer = page.decode().map_err(|error| failed_at(name.clone(), error));
                    progress.layer_done();
                    layer
                };
                let found = self.settings.find(build, light, pages, decode, Some(machine));
                found.map_err(|error: Exit| {
                    // Errors of pages have their place.
                    match error.cause::<CheckError>() {
                        Some(_) => error.at(name.clone()),
                        None => error,
                    }
                })?
            }
            Input::Part(part) => {
                let layers = self.slices(part, &progress)?;
                let decode = |layer| {
                    progress.layer_done();
                    Ok::<_, Exit>(layer)
                };
                let (light, resin) = known(StackLight::of_settings(&part.settings.exposure)?);
                let options = self.settings.options(light)?;
                let findings = lamp_supports::check(layers, decode, &options)?;
                let disagreements = self.disagreements(&mut input, &minima, &findings, common)?;
                let build = Err(Inseparable::NoBuild);
                self.settings.found(findings, &disagreements, Vec::new(), build, resin, machine)
            }
        };
        progress.done();
        Ok(CheckedInput { name, input, found })
    }

    /// Slices a part.
    fn slices(
        &self,
        part: &SlicedPart,
        progress: &Progress,
    ) -> Result<impl Iterator<Item = Result<Layer, Exit>> + use<>, Exit> {
        let slices = part.layers(self.layers.clone(), self.memory, progress)?;
        progress.expect(slices.count);
        Ok(slices.layers.map(|layer| Ok(layer?)))
    }

    /// Returns the minima of a part's mesh, if islands are reported.
    fn minima(&self, input: &Input) -> Result<Vec<IslandMinimum>, Exit> {
        let Input::Part(part) = input else { return Ok(Vec::new()) };
        if !self.settings.reports(FindingGroup::Islands) || part.model.is_cut() {
            return Ok(Vec::new());
        }
        let solid = &part.settings.solid;
        let table = CornerTable::of_part(&part.model, &solid.placement(), solid.units);
        let at_file = |error: SliceError| at_part(error.into(), std::slice::from_ref(&part.file));
        Ok(IslandMinimum::of_mesh(&table.map_err(at_file)?))
    }

    /// Compares the islands in the layers of a part with the minima of its mesh.
    fn disagreements(
        &self,
        input: &mut Input,
        minima: &[IslandMinimum],
        findings: &Findings,
        common: &Common,
    ) -> Result<Disagreements, Exit> {
        // The mesh of a part that is cut by others is not its surface.
        let cut = match input {
            Input::Part(part) if !part.model.is_cut() => part.settings.cut(),
            _ => return Ok(Disagreements::default()),
        };
        if !self.settings.reports(FindingGroup::Islands) {
            return Ok(Disagreements::default());
        }
        let mut found = findings.compare_minima(minima, cut);
        if found.minima.is_empty() {
            return Ok(found);
        }
        // Where there is white, it rests on white: the body is joined to others from the start.
        let layers: BTreeSet<u32> = found.minima.iter().map(|minimum| minimum.layer).collect();
        let mut joined = BTreeSet::new();
        let is_wanted = |layer| layers.contains(&layer);
        self.for_each_layer(input, common, is_wanted, |layer, _, mask| {
            let here = found.minima.iter().filter(|minimum| minimum.layer == layer);
            let is_white = |minimum: &&LoneMinimum| {
                let [columns, rows] = minimum.pixel.map(|at| at.saturating_sub(NEAR)..=at + NEAR);
                rows.into_iter().any(|row| columns.clone().any(|column| mask.is_white(column, row)))
            };
            joined.extend(here.filter(is_white).map(|minimum| (layer, minimum.pixel)));
            Ok(())
        })?;
        found.minima.retain(|minimum| !joined.contains(&(minimum.layer, minimum.pixel)));
        Ok(found)
    }
}

/// The input to check.
enum Input {
    Stack(KeptStack),
    Part(Box<SlicedPart>),
}

impl Input {
    /// Distinguishes a stack from a part by its first bytes, and opens a part.
    fn open(path: &Path, slicing: &SliceSettings, common: &Common) -> Result<Self, Exit> {
        let progress = Progress::new("check", common, true);
        let part = SlicedPart::open(path, slicing, &progress)?;
        Ok(match part {
            Some(part) => Self::Part(Box::new(part)),
            None => Self::Stack(KeptStack::new(path)),
        })
    }
}

/// An input and what was found in it.
struct CheckedInput {
    name: String,
    input: Input,
    found: Found,
}

/// How far from a minimum its first pixels may be.
const NEAR: u32 = 2;

/// The most lines of a kind that are printed, unless all are asked for.
const MOST_LINES: usize = 20;

/// Returns the lines to print for an input.
fn printed(name: &str, found: &Found, all: bool) -> String {
    let layers = number_of(found.findings.layers.len() as u64, "layer");
    let specks = match found.findings.specks.count() {
        0 => String::new(),
        specks => format!(", {}", number_of(specks, "speck")),
    };
    let count = match found.count() {
        0 => "no findings".to_owned(),
        count => number_of(count as u64, "finding"),
    };
    let accepted = match found.accepted {
        0 => String::new(),
        accepted => format!(", {accepted} accepted"),
    };
    let mut text = format!("{}: {layers}, {count}{specks}{accepted}\n", printable(name));
    text.extend(found.whole_build().map(|note| format!("  note: {note}\n")));
    let name_of = |feature: &Feature| found.records[feature.finding].name();
    for of_kind in found.features.chunk_by(|a, b| name_of(a) == name_of(b)) {
        let name = name_of(&of_kind[0]);
        let shown = if all { of_kind.len() } else { of_kind.len().min(MOST_LINES) };
        for feature in &of_kind[..shown] {
            text += &format!("  {name}: {}\n", found.text(feature));
            for &at in feature.with.iter().chain(&feature.alike).filter(|_| all) {
                let record = &found.records[at];
                text += &format!("    {}: {record}\n", record.name());
            }
        }
        if shown < of_kind.len() {
            let left = of_kind.len() - shown;
            text += &format!("  {name}: {left} more (--verbose or --report lists them)\n");
        }
    }
    text.extend(found.unchecked_rules().into_iter().map(|note| format!("  note: {note}\n")));
    text
}
