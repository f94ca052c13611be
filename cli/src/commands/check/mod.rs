//! `lamp check`: finds what would float away, be trapped or bend as a stack is built.

mod pictures;
mod report;

use std::collections::BTreeSet;
use std::num::{NonZeroU8, NonZeroU32};
use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::{Args, FromArgMatches};
use lamp_machine::{Machine, Recoating};
use lamp_slicer::SliceError;
use lamp_slicer::topology::CornerTable;
use lamp_stack::{Layer, Length, MemorySize, Page};
use lamp_supports::{
    CheckError, CheckOptions, Disagreements, FindingGroup, FindingRecord, Findings, IslandMinimum,
    LoneMinimum,
};
use serde::Serialize;

use crate::args::options::{Common, one_of_described, parse_distance, parse_layers, parse_memory};
use crate::args::slicing::SlicingArgs;
use crate::exit::Exit;
use crate::kept_stack::KeptStack;
use crate::output::endings::parse_report;
use crate::streams::{check_beside, failed_at, in_range, input_name, is_stream, new_folder, print};
use crate::terminal::progress::{Progress, printable};
use crate::terminal::stack_notes::doubts;
use lamp_pipeline::documents::{canonical_word, document, is_file};
use lamp_pipeline::solid::at_part;
use lamp_pipeline::words::{list, optional, path, text, words_of};
use lamp_pipeline::{SliceSettings, SlicedPart, check_slicing};

pub(super) use pictures::draw;
use pictures::write_pictures;
use report::write_report;

/// Find what would be swept away, trapped or bent as a stack is built
///
/// An island is white that rests on nothing: the recoating blade sweeps it away. Each gets a line,
/// as do weak joints, pockets that hold resin, overhangs, bodies off balance, white at the border
/// and empty layers; the worst come first. A part is sliced on the way, by the options of `slice`;
/// its mesh then says where islands must be, too. Effects of rounding to pixels, and islands that
/// never hold a square of --speck pixels, are only in the report.
#[derive(Args, Clone, Serialize)]
#[command(after_help = "\
Examples:
  lamp check build.tif
  lamp check blade.stl --rotate x:180 --evidence pictures/
  slice blade.stl | fix | lamp check --strict
  lamp check night/*.tif --only islands,pockets --report check.json

Exit status: 0 if the work is done, whatever was found; 3 with --strict if something was.")]
#[serde(rename_all = "kebab-case")]
pub(crate) struct CheckArgs {
    /// Stacks (TIFF or picture files, folders of pages, - for standard input) or parts, each
    /// checked on its own
    #[arg(value_name = "STACK|PART", default_value = "-")]
    #[serde(skip)]
    inputs: Vec<PathBuf>,

    /// Kinds of findings to report
    #[arg(long, value_name = "KINDS", value_delimiter = ',')]
    #[arg(value_parser = one_of_described::<FindingGroup>(&[
        "White that rests on nothing",
        "White that rests on little",
        "Black without a way out",
        "White far from the white below",
        "Centres of gravity off their base",
        "Stray rows, white at the border, empty layers",
    ]))]
    #[serde(with = "list")]
    only: Vec<FindingGroup>,

    /// Side of the square that a finding must hold, in pixels
    #[arg(long, value_name = "PIXELS", default_value = "3")]
    #[serde(with = "text")]
    speck: NonZeroU32,

    /// Share of white that must rest on white
    #[arg(long, value_name = "SHARE", default_value = "25%", value_parser = parse_percent)]
    #[serde(with = "text")]
    least_support: f64,

    /// How far white may reach beyond the white below [default: as far as a layer is thick: 45
    /// degrees]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance)]
    #[serde(with = "optional")]
    max_overhang: Option<Length>,

    /// How wide a way out must be to drain a pocket: narrower ways are found, too, by placing a ball
    /// of this size everywhere; takes several times longer [default: a pixel and a layer]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance)]
    #[serde(with = "optional")]
    drain: Option<Length>,

    /// Level from which a gray pixel is white
    #[arg(long, value_name = "LEVEL", default_value = "1")]
    #[serde(with = "text")]
    threshold: NonZeroU8,

    /// Machine whose blade drags on what floats: alpha, beta or a file (see lamp machine)
    ///
    /// Its defaults hold where no other resolution, thickness or margin is given
    #[arg(long, value_name = "M", default_value = "alpha")]
    #[serde(with = "path")]
    machine: PathBuf,

    /// Write all findings as JSON
    #[arg(long, value_name = "FILE.json", value_parser = parse_report)]
    #[serde(skip)]
    report: Option<PathBuf>,

    /// Write pictures of the worst findings into a new folder: findings in red, other white without
    /// white below in yellow, the layer below in gray
    #[arg(long, value_name = "DIR")]
    #[serde(skip)]
    evidence: Option<PathBuf>,

    /// Replace a folder of pictures that an earlier run wrote
    #[arg(long)]
    #[serde(skip)]
    force: bool,

    /// End with status 3 if there are findings, or if pages of a folder may be missing
    #[arg(long)]
    #[serde(skip)]
    strict: bool,

    /// Use only these layers: A..B is A to B - 1; A.. and ..B are open-ended. The first of them
    /// stands on the platform
    #[arg(long, value_name = "A..B", value_parser = parse_layers)]
    #[serde(skip)]
    layers: Option<Range<u32>>,

    /// Memory for the table of crossings of a part
    #[arg(long, value_name = "BYTES", value_parser = parse_memory)]
    #[serde(skip)]
    memory: Option<u64>,

    #[command(flatten)]
    #[serde(skip)]
    slicing: SlicingArgs,
}

pub(crate) fn run(args: &CheckArgs, common: &Common) -> Result<(), Exit> {
    for beside in [&args.report, &args.evidence].into_iter().flatten() {
        check_beside(beside, Path::new("-"), &args.inputs)?;
    }
    if args.inputs.iter().filter(|input| is_stream(input)).count() > 1 {
        return Err(Exit::usage("standard input can be read only once: give - once"));
    }
    let machine: Machine = document(&args.machine)?;
    let slicing = SliceSettings::try_from(&args.slicing)?;
    check_slicing(&slicing, &args.inputs, Some(&machine))?;
    let evidence = args.evidence.as_deref().map(|folder| new_folder(folder, args.force));
    let evidence = evidence.transpose()?;
    let checked = args.inputs.iter().map(|path| {
        let checked = args.checked(path, &machine, common)?;
        print(&printed(&checked.name, &checked.findings, &checked.records, common.verbose))?;
        Ok(checked)
    });
    let mut checked = checked.collect::<Result<Vec<_>, Exit>>()?;
    if let Some(path) = &args.report {
        write_report(&checked, machine.recoating.as_ref(), path)?;
    }
    if let Some(folder) = evidence {
        write_pictures(&mut checked, args, common, folder)?;
    }
    let found: usize = checked.iter().map(CheckedInput::found).sum();
    let found = match found {
        0 => doubts(),
        1 => Some("1 finding".to_owned()),
        found => Some(format!("{found} findings")),
    };
    found.filter(|_| args.strict).map_or(Ok(()), |found| Err(Exit::Findings(found)))
}

/// Returns the findings of `lamp check` with its usual options, and its words on each. The blade is
/// the blade of `machine`, or the usual one.
fn found_by_default<T: MemorySize + Send>(
    layers: impl Iterator<Item = Result<T, Exit>>,
    decode: impl Fn(T) -> Result<Layer, Exit> + Sync,
    machine: Option<&Machine>,
) -> Result<(Findings, Vec<FindingRecord>), Exit> {
    let command = CheckArgs::augment_args(clap::Command::new("check").no_binary_name(true));
    let matches = command.get_matches_from([""; 0]);
    let args = CheckArgs::from_arg_matches(&matches).expect("no option is required");
    let findings = lamp_supports::check(layers, decode, &args.options())?;
    let usual = document(&args.machine)?;
    let records = args.records(&findings, &Disagreements::default(), machine.unwrap_or(&usual));
    Ok((findings, records))
}

/// Finds in layers what [`found_by_default`] does.
pub(super) fn found(
    layers: impl Iterator<Item = Result<Layer, Exit>>,
    machine: Option<&Machine>,
) -> Result<(Findings, Vec<FindingRecord>), Exit> {
    found_by_default(layers, Ok, machine)
}

/// Returns what `lamp check` finds in the pages of a stack without further options.
pub(super) fn found_in_pages(
    pages: impl Iterator<Item = Result<Page, Exit>>,
    done: impl Fn() + Sync,
) -> Result<Vec<FindingRecord>, Exit> {
    let decode = |page: Page| {
        let layer = page.decode()?;
        done();
        Ok::<_, Exit>(layer)
    };
    found_by_default(pages, decode, None).map(|(_, records)| records)
}

/// Returns the shear stress of a blade on what it passes, for the greatest viscosity, in pascals.
pub(super) fn greatest_shear_pa(recoating: Option<&Recoating>) -> Option<f64> {
    recoating.map(|recoating| recoating.shear_pa()[1])
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
        let findings = self.check(&mut input, common)?;
        let disagreements = self.disagreements(&mut input, &minima, &findings, common)?;
        let records = self.records(&findings, &disagreements, machine);
        Ok(CheckedInput { name: input_name(path), input, findings, records })
    }

    /// Returns the file that the machine is from, if it is not built in.
    pub(crate) fn input_file(&self) -> Option<&PathBuf> {
        Some(&self.machine).filter(|path| is_file::<Machine>(path))
    }

    /// Returns the machine, to be changed.
    pub(crate) fn machine_mut(&mut self) -> &mut PathBuf {
        &mut self.machine
    }

    /// Returns what there is in a stack, the worst first.
    pub(crate) fn found_in(&self, stack: &Path) -> Result<Vec<FindingRecord>, Exit> {
        Ok(self.checked(stack, &document(&self.machine)?, &Common::quiet())?.records)
    }

    /// Returns the records of findings that are asked for.
    fn records(
        &self,
        findings: &Findings,
        disagreements: &Disagreements,
        machine: &Machine,
    ) -> Vec<FindingRecord> {
        let shear_pa = greatest_shear_pa(machine.recoating.as_ref());
        let mut records = lamp_supports::records(findings, disagreements, shear_pa);
        records.retain(|record| self.tells(record.group()));
        records
    }

    /// Returns the options that matter to findings as one text.
    pub(crate) fn canonical(&self) -> String {
        let machine = canonical_word::<Machine>(&self.machine).into();
        format!("check{}", words_of(&Self { machine, ..self.clone() }))
    }

    fn options(&self) -> CheckOptions {
        CheckOptions {
            threshold: self.threshold,
            speck: self.speck,
            least_support: self.least_support,
            max_overhang: self.max_overhang,
            drain: self.drain,
        }
    }

    /// Checks a stack, or the layers of a part.
    fn check(&self, input: &mut Input, common: &Common) -> Result<Findings, Exit> {
        let progress = Progress::new("check", common, true);
        let options = self.options();
        let found = match input {
            Input::Stack(stack) => {
                let name = input_name(&stack.path);
                let pages = stack.pages(self.evidence.is_some())?;
                let pages = in_range(pages, Page::info, stack.path.clone(), self.layers.clone());
                let decode = |(page, _): (Page, _)| {
                    let layer = page.decode().map_err(|error| failed_at(name.clone(), error));
                    progress.layer_done();
                    layer
                };
                lamp_supports::check(pages, decode, &options).map_err(|error: Exit| {
                    // Errors of pages have their place.
                    match error.cause::<CheckError>() {
                        Some(_) => error.at(name.clone()),
                        None => error,
                    }
                })
            }
            Input::Part(part) => {
                let layers = self.slices(part, &progress)?;
                let decode = |layer| {
                    progress.layer_done();
                    Ok(layer)
                };
                lamp_supports::check(layers, decode, &options)
            }
        };
        progress.done();
        found
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
        if !self.tells(FindingGroup::Islands) || part.model.is_cut() {
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
        if !self.tells(FindingGroup::Islands) {
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

    /// Returns whether findings of a group are printed.
    fn tells(&self, group: FindingGroup) -> bool {
        self.only.is_empty() || self.only.contains(&group)
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
    findings: Findings,
    records: Vec<FindingRecord>,
}

impl CheckedInput {
    /// Returns the number of findings that count.
    fn found(&self) -> usize {
        self.records.iter().filter(|record| !record.is_note()).count()
    }
}

/// How far from a minimum its first pixels may be.
const NEAR: u32 = 2;

/// The most lines of a kind that are printed, unless all are asked for.
const MOST_LINES: usize = 20;

/// Returns the lines to print for an input.
fn printed(name: &str, findings: &Findings, records: &[FindingRecord], all: bool) -> String {
    let layers = match findings.layers.len() {
        1 => "1 layer".to_owned(),
        layers => format!("{layers} layers"),
    };
    let specks = match findings.specks.count() {
        0 => String::new(),
        1 => ", 1 speck".to_owned(),
        specks => format!(", {specks} specks"),
    };
    let found = match records.iter().filter(|record| !record.is_note()).count() {
        0 => "no findings".to_owned(),
        1 => "1 finding".to_owned(),
        found => format!("{found} findings"),
    };
    let mut text = format!("{}: {layers}, {found}{specks}\n", printable(name));
    for of_kind in records.chunk_by(|a, b| a.name() == b.name()) {
        let shown = if all { of_kind.len() } else { of_kind.len().min(MOST_LINES) };
        for record in &of_kind[..shown] {
            text += &format!("  {}: {record}\n", record.name());
        }
        if shown < of_kind.len() {
            let left = of_kind.len() - shown;
            text += &format!(
                "  {}: {left} more (--verbose or --report lists them)\n",
                of_kind[0].name()
            );
        }
    }
    text
}

/// Parses a share: `25%` or `0.25`.
fn parse_percent(text: &str) -> Result<f64, String> {
    let (number, unit) = match text.strip_suffix('%') {
        Some(percent) => (percent, 100.0),
        None => (text, 1.0),
    };
    match number.trim().parse::<f64>() {
        Ok(number) if (0.0..=unit).contains(&number) => Ok(number / unit),
        _ => Err(format!("`{text}` is not a share: write 25% or 0.25")),
    }
}
