//! `lamp mesh repair`: mends a mesh.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use lamp_pipeline::size::PartSize;
use lamp_slicing::topology::{CornerTable, Deed, RepairOptions, Repaired, repair};
use lamp_slicing::{SliceError, write_stl};
use lamp_stack::Length;
use serde::Serialize;
use serde_json::{Map, Value};

use crate::args::options::{Common, parse_distance};
use crate::commands::mesh::MeshPart;
use crate::commands::mesh::answer::{MeshCounts, counts, deeds};
use crate::commands::mesh::text::faults;
use crate::exit::Exit;
use crate::output::endings::{STL, check_ending};
use crate::output::json_report::{JsonReport, ReportTo, schemas};
use crate::output::numbers::number_of;
use crate::streams::{check_beside, check_not_input, is_stream, write_mesh};
use crate::terminal::progress::{Progress, say};

/// Repair a mesh: weld, drop, flip and add facets, and list each change
///
/// It welds vertices of boundary edges, drops facets that are doubled or degenerate, turns facets
/// the same way and shells outward (voids inward), and closes small holes. It writes a binary STL,
/// in the units of the file. A mesh keeps its bytes if nothing can be repaired.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp mesh repair blade.stl -o mended.stl
  lamp mesh repair scan.stl -o mended.stl --weld 20um --close 5mm --report repair.json
  lamp mesh repair blade.obj -o - | slice - -o blade.tif")]
pub(super) struct RepairArgs {
    #[command(flatten)]
    part: MeshPart,

    /// Where to write the mesh: an STL file, or - for standard output
    #[arg(short, long, value_name = "OUT.stl")]
    output: PathBuf,

    /// Merge vertices of boundary edges that are no farther apart than this [default: 1/20000 of
    /// the part's diagonal, at most a quarter of the shortest boundary edge, at least the
    /// resolution of 32 bits]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance)]
    weld: Option<Length>,

    /// Close holes no wider than this: the width is the diagonal of the box around a hole's edges
    #[arg(long, value_name = "LENGTH", default_value = "1mm", value_parser = parse_distance)]
    close: Length,

    #[command(flatten)]
    report: ReportTo,

    /// Exit with status 3 if faults are left; the mesh is still written
    #[arg(long)]
    strict: bool,
}

/// The share of the diagonal from which a weld is doubtful: walls of castings are a hundredth.
const LARGE_WELD: f64 = 1e-3;

pub(super) fn run(args: &RepairArgs, common: &Common) -> Result<(), Exit> {
    let (name, input) = (args.part.name(), &args.part.part);
    check_not_input(&args.output, [input])?;
    check_ending(&args.output, &STL)?;
    args.report.check_output(&args.output)?;
    if let Some(report) = args.report.path() {
        check_beside(report, &args.output, [input])?;
    }
    let failed = |error: SliceError| Exit::from(error).at(name.clone());
    let (part, bytes) = args.part.open("mesh repair", common)?;
    // Facets stay in the file's own unit, so that coordinates keep their bits: lengths are
    // converted.
    let unit = if part.states_unit() { 1.0 } else { args.part.units.mm() };
    let facets = part.facets().map_err(failed)?;
    let weld = match args.weld {
        Some(weld) => weld.mm() / unit,
        None => CornerTable::of_facets(&facets).map_err(failed)?.usual_weld(),
    };
    let corners = facets.iter().flatten().filter(|corner| corner.iter().all(|c| c.is_finite()));
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for corner in corners.map(|corner| corner.map(|c| f64::from(c) * unit)) {
        low = [0, 1, 2].map(|axis| low[axis].min(corner[axis]));
        high = [0, 1, 2].map(|axis| high[axis].max(corner[axis]));
    }
    let progress = Progress::new("mesh repair", common, true);
    let units = (!part.states_unit()).then_some(args.part.units);
    if let Some(doubt) = PartSize::new([low, high], units).doubt_of_unit() {
        progress.warn(&format!("{name}: {doubt}"));
    }
    let diagonal = [0, 1, 2].map(|axis| high[axis] - low[axis]).iter().map(|d| d * d).sum::<f64>();
    if weld * unit > LARGE_WELD * diagonal.sqrt() {
        progress.warn(&format!(
            "{name}: vertices up to {:.3} mm apart become one, more than a thousandth of the part's \
             diagonal: walls thinner than that may close; give a smaller --weld",
            weld * unit
        ));
    }
    let options = RepairOptions { weld, close: args.close.mm() / unit };
    let repaired = repair(facets, &options).map_err(failed)?;
    let output = &args.output;
    match repaired.touched.is_empty() && is_stl(input, &bytes)? {
        true => write_mesh(output, |out| {
            copy(input, &bytes, out)?;
            // Another program may have written to the file since its facets were read.
            part.check_unchanged().map_err(io::Error::other)
        })?,
        false => write_mesh(output, |out| write_stl(repaired.facets.iter().copied(), out))?,
    }
    progress.wrote(output, &[number_of(repaired.facets.len() as u64, "facet")]);
    let left = faults_left(&repaired).map_err(failed)?;
    if !common.quiet {
        tell(&repaired, &left, weld * unit);
        let widths = repaired.left.loops.iter().map(|hole| hole.width_mm() * unit);
        let widest = widths.filter(|width| *width > args.close.mm()).fold(0.0, f64::max);
        if widest > 0.0 {
            // A tenth of a millimeter up, so that the widest hole is no wider.
            say(&format!(
                "mesh repair: holes wider than {} stay open: to close them, give --close {:.1}mm",
                args.close,
                (widest * 10.0).floor() / 10.0 + 0.1
            ));
        }
    }
    if let Some(report) = args.report.path() {
        write_report(report, &name, &repaired)?;
    }
    match args.strict && !repaired.left.is_clean() {
        true => Err(Exit::Findings(format!("{name}: faults are left in its mesh"))),
        false => Ok(()),
    }
}

/// Returns whether the input is an STL as it stands, and not packed or of another format.
fn is_stl(input: &Path, bytes: &[u8]) -> Result<bool, Exit> {
    let (mut start, mut size) = (Vec::new(), bytes.len() as u64);
    let read = match is_stream(input) {
        true => bytes.take(START_BYTES).read_to_end(&mut start),
        false => File::open(input).and_then(|file| {
            size = file.metadata()?.len();
            file.take(START_BYTES).read_to_end(&mut start)
        }),
    };
    read.with_context(|| input.display().to_string())?;
    let count = start.get(80..84).map(|count| u32::from_le_bytes(count.try_into().unwrap()));
    // A binary STL has 80 bytes, a count, and 50 bytes a facet. Its header may begin with `solid`,
    // so its size comes first.
    let is_binary = count.is_some_and(|count| 84 + 50 * u64::from(count) == size);
    Ok(is_binary || start.trim_ascii_start().starts_with(b"solid"))
}

/// The bytes that identify an STL: its header and count, or its first word after some blanks.
const START_BYTES: u64 = 4096;

fn copy(input: &Path, mut bytes: &[u8], out: &mut dyn Write) -> io::Result<()> {
    match is_stream(input) {
        true => io::copy(&mut bytes, out)?,
        false => io::copy(&mut File::open(input)?, out)?,
    };
    Ok(())
}

/// Returns a sentence for each kind of fault that is left.
fn faults_left(repaired: &Repaired) -> Result<Vec<String>, SliceError> {
    match repaired.left.is_clean() {
        true => Ok(Vec::new()),
        false => Ok(faults(&CornerTable::of_facets(&repaired.facets)?, &repaired.left)),
    }
}

fn tell(repaired: &Repaired, left: &[String], weld_mm: f64) {
    let done: Vec<String> = deeds(repaired)
        .map(|(deed, count)| format!("{count} {}", deed.replace('-', " ")))
        .collect();
    match done.is_empty() {
        true => say("mesh repair: no facet was touched"),
        false => say(&format!("mesh repair: facets: {}", done.join(", "))),
    }
    if repaired.touched.iter().any(|it| it.deed == Deed::Moved) {
        say(&format!(
            "mesh repair: vertices of boundary edges within {:.3}um are one",
            weld_mm * 1e3
        ));
    }
    left.iter().for_each(|fault| say(&format!("mesh repair: left: {fault}")));
}

/// Repair of a mesh, by `lamp mesh repair PART --report`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct RepairHead<'a> {
    /// Name of the part or of its file.
    part: &'a str,
    /// Number of facets after the repair.
    facets: usize,
    /// Number of facets of each action: `moved`, `turned`, `dropped-not-finite`, `dropped-collapsed`,
    /// `dropped-doubled`, `dropped-alone`, `added`; without actions of no facet.
    #[cfg_attr(test, schemars(with = "std::collections::BTreeMap<String, usize>"))]
    repair_actions: Map<String, Value>,
    /// Whether no fault is left, self-intersections aside.
    clean: bool,
    /// Numbers of the faults that are left.
    left: MeshCounts,
}

/// A facet that the repair touched.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct TouchedFacet {
    /// Its number before the repair, from 0; of an added facet, its number afterwards.
    facet: usize,
    /// The action.
    action: &'static str,
}

schemas! { "lamp-mesh-repair-2": RepairHead<'_>, "touched": [TouchedFacet]; }

fn write_report(report: &Path, name: &str, repaired: &Repaired) -> Result<(), Exit> {
    let head = RepairHead {
        part: name,
        facets: repaired.facets.len(),
        repair_actions: deeds(repaired)
            .map(|(deed, count)| (deed.to_owned(), count.into()))
            .collect(),
        clean: repaired.left.is_clean(),
        left: counts(&repaired.left),
    };
    let touched = repaired.touched.iter();
    let touched = touched.map(|it| TouchedFacet { facet: it.facet, action: it.deed.name() });
    JsonReport::of_schema("lamp-mesh-repair-2", &head).list("touched", touched).write(report)
}
