//! `lamp brep`: describes a STEP part and checks that it can be sliced.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use lamp_pipeline::step::{Kernel, StepSettings, bytes_of, length, notes};
use lamp_slicing::brep::{Body, BodyReport, Comparison, PreparationAttempt, Prepared};
use lamp_slicing::{SliceError, body_name, read_step};
use lamp_stack::{Pitch, one_line};
use serde::Serialize;
use serde_json::{Map, Value};

use crate::args::solid::StepArgs;
use crate::exit::Exit;
use crate::output::json_report::{print_answer, schemas};
use crate::second_opinion::{self, SecondOpinion};
use crate::streams::{input_name, print};

/// Describe a STEP part, and check whether it can be sliced
///
/// For each body, it lists the faces by kind of surface, and the bounding box, volume and area
/// computed from the facets that `slice` would make. A body is sliced only if its facets close,
/// stay inside the control points of its surfaces, and enclose the same volume as the surfaces.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp brep blade.step
  lamp brep blade.step --tolerance 1um --strict
  lamp brep blade.step --both")]
pub(crate) struct BrepArgs {
    /// The part: a STEP file, or - for standard input
    #[arg(value_name = "PART")]
    part: PathBuf,

    /// Resolution to check for; the default tolerance is a quarter of a pixel
    #[arg(long, visible_alias = "pitch", value_name = "DPI", default_value = "1500")]
    #[arg(value_parser = Pitch::stated)]
    dpi: Pitch,

    #[command(flatten)]
    brep: StepArgs,

    /// Read the part with OpenCASCADE, too, and compare boxes, volumes and five sections of each
    /// body. Exit with status 3 if they differ by more than the tolerance explains
    #[arg(long, conflicts_with = "kernel")]
    both: bool,

    /// Exit with status 3 if a body would not be sliced
    #[arg(long)]
    strict: bool,

    /// Print JSON, as docs/json.md describes it
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &BrepArgs) -> Result<(), Exit> {
    let name = input_name(&args.part);
    let failed = |error: SliceError| Exit::from(error).at(name.clone());
    let step = StepSettings::from(&args.brep);
    let options = step.reader.for_opening(step.tolerance(args.dpi))?;
    let bytes = bytes_of(&args.part).map_err(failed)?;
    let prepared = read_step(bytes.clone(), &options).map_err(failed)?;
    // OpenCASCADE reads the file anew, which may take as long as the first reading.
    let second = match args.both || step.reader.kernel == Kernel::Both {
        true => Some(second_opinion::asked(&prepared, bytes, &options)),
        false => None,
    };
    let second = second.transpose().map_err(|error| error.at(name.clone()))?;
    match args.json {
        true => print_answer("lamp-brep-2", &answer(&name, &prepared, second.as_ref()))?,
        false => print(&text(&name, &prepared, second.as_ref()))?,
    }
    // After the answer is printed: a difference is a finding, and no failure to read.
    if second.is_some_and(|second| !second.differences().is_empty()) {
        let why = format!("{name}: LAMP and OpenCASCADE read it differently");
        return Err(Exit::Findings(why));
    }
    let refused = prepared.reports.iter().filter(|report| !report.faults.is_empty()).count();
    if args.strict && refused > 0 {
        let bodies = if refused == 1 { "body" } else { "bodies" };
        return Err(Exit::Findings(format!("{name}: {refused} {bodies} would not be sliced")));
    }
    Ok(())
}

/// A STEP part, by `lamp brep PART --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct BrepAnswer<'a> {
    /// Name of the part, as given.
    part: &'a str,
    /// The file's unit of length.
    unit: &'a str,
    /// Number of facets.
    facets: usize,
    /// Greatest chordal deviation of facets from surfaces, in millimeters.
    chordal_deviation_mm: f64,
    /// Distance within which edges were joined, in millimeters; 0 without healing.
    heal_mm: f64,
    /// Findings, repairs and omissions, as sentences.
    notes: Vec<String>,
    /// Rejected tries.
    tries: Vec<Attempt<'a>>,
    /// The bodies, in the file's order.
    bodies: Vec<BodyFields>,
    /// With `--both`: the second opinion.
    #[serde(skip_serializing_if = "Option::is_none")]
    second: Option<SecondOpinion<'a>>,
}

/// A rejected try.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Attempt<'a> {
    /// Greatest chordal deviation, in millimeters.
    chordal_deviation_mm: f64,
    /// Distance within which edges were joined, in millimeters; 0 without healing.
    heal_mm: f64,
    /// Why it was rejected.
    why: &'a str,
}

/// A body.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct BodyFields {
    /// Its name in the file, often empty.
    name: String,
    /// Number of its faces of each kind of surface, the most frequent first.
    #[cfg_attr(test, schemars(with = "std::collections::BTreeMap<String, usize>"))]
    faces: Map<String, Value>,
    /// Number of its facets.
    facets: usize,
    /// Its box: least x, y and z, and greatest, in millimeters.
    box_mm: [[f64; 3]; 2],
    /// Volume by its surfaces, in cubic millimeters.
    volume_mm3: f64,
    /// Volume by its facets, in cubic millimeters.
    facet_volume_mm3: f64,
    /// Area of its facets, in square millimeters.
    facet_area_mm2: f64,
    /// Reasons to refuse it, as sentences.
    faults: Vec<String>,
}

schemas! { "lamp-brep-2": BrepAnswer<'_>; }

fn answer<'a>(
    name: &'a str,
    prepared: &'a Prepared,
    second: Option<&'a Comparison>,
) -> BrepAnswer<'a> {
    let attempt = |attempt: &'a PreparationAttempt| Attempt {
        chordal_deviation_mm: attempt.chord_mm,
        heal_mm: attempt.heal_mm,
        why: &attempt.why,
    };
    let bodies = prepared.kernel.bodies().iter().zip(&prepared.reports);
    BrepAnswer {
        part: name,
        unit: prepared.kernel.unit(),
        facets: prepared.mesh.facets.len(),
        chordal_deviation_mm: prepared.chord_mm,
        heal_mm: prepared.heal_mm,
        notes: notes(prepared),
        tries: prepared.tries.iter().map(attempt).collect(),
        bodies: bodies.map(|(body, report)| fields(body, report, prepared)).collect(),
        second: second.map(second_opinion::fields),
    }
}

fn fields(body: &Body, report: &BodyReport, prepared: &Prepared) -> BodyFields {
    let faces = kinds(body, prepared).into_iter();
    BodyFields {
        name: one_line(&report.name),
        faces: faces.map(|(kind, count)| (kind.to_owned(), count.into())).collect(),
        facets: report.facets,
        box_mm: report.box_mm,
        volume_mm3: report.exact_volume_mm3,
        facet_volume_mm3: report.volume_mm3,
        facet_area_mm2: report.area_mm2,
        faults: report.faults.iter().map(ToString::to_string).collect(),
    }
}

fn text(name: &str, prepared: &Prepared, second: Option<&Comparison>) -> String {
    let facets = prepared.mesh.facets.len();
    let mut text = format!(
        "part:       {name}\nunit:       {}\nfacets:     {facets}, up to {} from the surfaces\n\
         bodies:     {}\n",
        prepared.kernel.unit(),
        length(prepared.chord_mm),
        prepared.reports.len(),
    );
    for note in notes(prepared) {
        writeln!(text, "found:      {note}").expect("a string takes all");
    }
    for attempt in &prepared.tries {
        let (chord, heal) = (length(attempt.chord_mm), attempt.heal_mm);
        let healed =
            if heal > 0.0 { format!(", joined within {}", length(heal)) } else { String::new() };
        writeln!(text, "tried:      facets up to {chord} away{healed}: {}", attempt.why)
            .expect("a string takes all");
    }
    text += &second.map(second_opinion::text).unwrap_or_default();
    let bodies = (1..).zip(prepared.kernel.bodies().iter().zip(&prepared.reports));
    for (number, (body, report)) in bodies {
        text += &body_text(number, body, report, prepared);
    }
    text
}

fn body_text(number: usize, body: &Body, report: &BodyReport, prepared: &Prepared) -> String {
    let [low, high] = report.box_mm;
    let side = |k: usize| format!("{:.3} to {:.3}", low[k], high[k]);
    let sliced = if report.faults.is_empty() {
        "  sliced:   yes, it is closed\n".to_owned()
    } else {
        report.faults.iter().map(|fault| format!("  sliced:   no: {fault}\n")).collect()
    };
    format!(
        "{}\n  faces:    {}\n  box:      x {}, y {}, z {} mm\n\
         \x20 volume:   {:.6} mm3 (by facets {:.6})\n  area:     {:.6} mm2, as the box by facets\n{sliced}",
        body_name(number, &report.name),
        faces(body, prepared),
        side(0),
        side(1),
        side(2),
        report.exact_volume_mm3,
        report.volume_mm3,
        report.area_mm2,
    )
}

/// Lists the number of faces of each kind.
fn faces(body: &Body, prepared: &Prepared) -> String {
    let kinds = kinds(body, prepared).into_iter();
    let kinds: Vec<_> = kinds.map(|(kind, count)| format!("{count} {kind}")).collect();
    format!("{} ({})", body.faces.len(), kinds.join(", "))
}

/// Returns the number of faces of each kind, the most frequent first.
fn kinds<'a>(body: &Body, prepared: &'a Prepared) -> Vec<(&'a str, usize)> {
    let mut kinds: Vec<(&str, usize)> = Vec::new();
    for face in body.faces.clone() {
        let kind = prepared.kernel.face(face).kind;
        match kinds.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, count)) => *count += 1,
            None => kinds.push((kind, 1)),
        }
    }
    // Equal counts go by name, so that the order does not depend on the file.
    kinds.sort_by_key(|&(kind, count)| (std::cmp::Reverse(count), kind));
    kinds
}
