//! `lamp info`: describes stacks.

use std::path::PathBuf;

use anyhow::anyhow;
use clap::Args;
use lamp_build::is_fields;
use lamp_stack::{
    Compression, NumberRange, Page, PageHeader, PageInfo, Pages, StackInfo, StackTotals,
    map_in_order,
};
use serde::Serialize;

use super::info_fields::print_fields;
use crate::args::options::InputArgs;
use crate::exit::Exit;
use crate::output::json_report::{print_answer, schemas};
use crate::output::numbers::{grouped, volume_in_words};
use crate::output::stack_facts::{StackFacts, compression_name};
use crate::streams::{failed_at, in_range, input_name, open_pages, print};

/// Describe a stack: pages, size, resolution, heights, area, exposure, checks
///
/// Only the directories and texts of pages are read, not their images: this takes a moment for a
/// file of any size. Area and volume are the numbers stated on the pages. lamp verify also decodes
/// the images. For a folder of strips or fields, it describes each and the totals.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp info build.tif
  lamp info *.tif
  lamp info build.tif --json | jq .exposure_s
  slice blade.stl | lamp info --runs")]
pub(crate) struct InfoArgs {
    #[command(flatten)]
    input: InputArgs,

    /// More stacks
    #[arg(value_name = "STACK", hide = true)]
    more: Vec<PathBuf>,

    /// Also decode the images, and count their transitions
    #[arg(long)]
    runs: bool,

    /// Print a JSON object for each stack, on a line (docs/json.md)
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &InfoArgs) -> Result<(), Exit> {
    describe(&args.input, args)?;
    for stack in &args.more {
        if !args.json {
            print("\n")?;
        }
        describe(&InputArgs { stack: stack.clone(), ..args.input.clone() }, args)?;
    }
    Ok(())
}

fn describe(input: &InputArgs, args: &InfoArgs) -> Result<(), Exit> {
    if is_fields(&input.stack) {
        if args.runs || input.layers.is_some() {
            return Err(Exit::usage(
                "--runs and --layers are for one stack: name the file of a strip or field, or make \
                 one stack of all with lamp join",
            ));
        }
        return print_fields(&input.stack, args.json);
    }
    let pages = open_pages(&input.stack)?;
    let facts = if args.runs {
        runs_of(pages, input)?
    } else {
        let headers =
            in_range(pages.headers(), header_info, input.stack.clone(), input.layers.clone());
        Facts::sum(headers.map(|page| Ok((with_stack(page?), None))))?
    };
    let name = || input_name(&input.stack);
    let facts =
        facts.ok_or_else(|| Exit::Failed(anyhow!("{}: there is no layer in it", name())))?;
    if args.json {
        return print_answer("lamp-info-1", &facts.json(&name()));
    }
    // The first page has named the part of standard input.
    print(&facts.text(&input_name(&input.stack)))
}

fn header_info(header: &PageHeader) -> &PageInfo {
    &header.info
}

/// Gives the first page in a range the metadata of the stack.
fn with_stack((mut header, stack): (PageHeader, Option<StackInfo>)) -> PageHeader {
    header.info.stack = stack;
    header
}

/// Sums up the pages and the transitions of their images.
fn runs_of(pages: Pages, input: &InputArgs) -> Result<Option<Facts>, Exit> {
    let path = input.stack.clone();
    let pages = in_range(pages, Page::info, path.clone(), input.layers.clone());
    Facts::sum(map_in_order(pages, move |(page, stack): (Page, _)| {
        let header = with_stack((page.header(), stack));
        let layer = page.decode().map_err(|error| failed_at(input_name(&path), error))?;
        Ok((header, Some(layer.image.change_count() as u64)))
    }))
}

/// Description of a stack, by `lamp info STACK --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Info<'a> {
    /// Name of the stack, as given.
    input: &'a str,
    #[serde(flatten)]
    stack: StackFacts<'a>,
    /// Number of transitions between colors in all rows, if `--runs` counts them.
    transitions: Option<u64>,
}

schemas! { "lamp-info-1": Info<'_>; }

/// The facts of a stack.
struct Facts {
    totals: StackTotals,
    /// The number of transitions, if they were counted.
    runs: Option<u64>,
}

impl Facts {
    fn sum(
        pages: impl Iterator<Item = Result<(PageHeader, Option<u64>), Exit>>,
    ) -> Result<Option<Self>, Exit> {
        let mut facts: Option<Self> = None;
        for page in pages {
            let (header, runs) = page?;
            match &mut facts {
                None => facts = Some(Self { totals: StackTotals::of(&header), runs }),
                Some(facts) => {
                    facts.totals.add(&header);
                    // Unknown stays unknown: a sum of some layers would look like all.
                    facts.runs = facts.runs.zip(runs).map(|(sum, runs)| sum + runs);
                }
            }
        }
        Ok(facts)
    }

    fn json<'a>(&'a self, input: &'a str) -> Info<'a> {
        Info { input, stack: StackFacts::new(&self.totals), transitions: self.runs }
    }

    fn text(&self, name: &str) -> String {
        let lines = lines(&self.totals, name, self.runs).into_iter();
        lines.map(|(key, value)| format!("{:<12}{value}\n", format!("{key}:"))).collect()
    }
}

/// Returns what is known of a stack of a name, and of its transitions if they were counted: a word
/// and a text for each line.
pub(super) fn lines(
    totals: &StackTotals,
    name: &str,
    runs: Option<u64>,
) -> Vec<(&'static str, String)> {
    let info = &totals.first.info;
    let mut lines = vec![("stack", name.to_owned())];
    if let Some(stack) = &info.stack {
        lines.extend(stack_lines(stack));
    }
    lines.push(("layers", layers_text(totals)));
    let [width, height] = totals.first.size;
    let others = if totals.one_size { "" } else { " on the first page; others differ" };
    lines.push((
        "size",
        format!("{} x {} pixels{others}", grouped(width.into()), grouped(height.into())),
    ));
    lines.push(("resolution", resolution_text(&totals.first)));
    if let (Some(bottom), Some(top)) = (info.z(), totals.top_mm()) {
        lines.push(("z", format!("{:.3} to {top:.3} mm", bottom.mm())));
    }
    lines.extend(totals.thickness_um.map(|range| ("thickness", range_text(range, "um"))));
    if let Some(exposure) = totals.exposure_ms {
        let (text, seconds) = (range_text(exposure, "ms"), exposure.sum / 1000.0);
        lines.push(("exposure", format!("{text}, {seconds:.1} s in all")));
    }
    lines.extend(area_text(totals).map(|text| ("exposed", text)));
    lines.extend(runs.map(|runs| ("runs", format!("{} transitions", grouped(runs)))));
    let names: Vec<_> = totals.compressions.iter().map(|each| compression_name(*each)).collect();
    lines.push(("data", format!("{} bytes, {}", grouped(totals.data_bytes), names.join(" and "))));
    let stray = match totals.stray_rows {
        0 => "none known".to_owned(),
        rows => format!("{} in {} layers", grouped(rows), grouped(totals.stray_layers)),
    };
    lines.push(("stray rows", stray));
    lines.push(("checks", checks_text(totals, runs).to_owned()));
    // Names come from files: they must not steer the terminal.
    let plain = |text: String| text.replace(char::is_control, "?");
    lines.into_iter().map(|(key, value)| (key, plain(value))).collect()
}

fn layers_text(totals: &StackTotals) -> String {
    let gray = match totals.gray_pages {
        0 => String::new(),
        // Only their images say which of them are.
        _ if totals.compressions.contains(&Compression::PrinterPng) => String::new(),
        pages => format!(", {} of them gray", grouped(pages)),
    };
    let (first, last) = (totals.first.info.index, totals.last.index);
    format!("{} ({first} to {last}){gray}", grouped(totals.pages))
}

/// `1,200 pixels in all layers, 340.512 mm3`.
fn area_text(totals: &StackTotals) -> Option<String> {
    let pixels = grouped(totals.exposed_px?);
    // Pages state the number of gray pixels, not their levels.
    let most = if totals.gray_pages == 0 { "" } else { "at most " };
    let volume = totals.volume_mm3.map(|volume| format!(", {most}{}", volume_in_words(volume)));
    Some(format!("{pixels} pixels in all layers{}", volume.unwrap_or_default()))
}

fn checks_text(totals: &StackTotals, runs: Option<u64>) -> &'static str {
    match (totals.has_checks(), runs) {
        (false, _) => "none: images and the number of layers cannot be proven",
        (true, None) => {
            "texts, order and number of layers are as written; lamp verify checks the images"
        }
        (true, Some(_)) => "images, texts, order and number of layers are as written",
    }
}

fn stack_lines(stack: &StackInfo) -> Vec<(&'static str, String)> {
    let mut lines = vec![("part", stack.part.clone())];
    lines.extend(stack.commands.iter().map(|command| ("made by", command.clone())));
    lines.push(("input", stack.digest.clone()));
    lines.retain(|(_, value)| !value.is_empty());
    lines
}

fn resolution_text(page: &PageHeader) -> String {
    let Some(pitch) = page.pitch else { return "not stated".to_owned() };
    let [[columns, rows], [x, y]] = [page.size.map(f64::from), pitch.mm()];
    format!("{pitch:#} ({:.3} x {:.3} mm)", columns * x, rows * y)
}

fn range_text(NumberRange { least, greatest, .. }: NumberRange, unit: &str) -> String {
    let one = least == greatest;
    if one { format!("{least} {unit}") } else { format!("{least} to {greatest} {unit}") }
}
