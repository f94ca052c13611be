//! `lamp info` of a folder of strips or fields: its totals, and each of them.

use std::path::Path;

use lamp_build::{FieldFile, FieldForm, FieldKind, field_files};
use lamp_stack::{Pages, StackTotals};
use serde::Serialize;

use crate::exit::Exit;
use crate::output::json_report::{print_answer, schemas};
use crate::output::stack_facts::StackFacts;
use crate::streams::{failed_at, input_name, print};

/// A strip or field, and what its pages say.
struct FieldSummary {
    file: FieldFile,
    totals: StackTotals,
}

/// Totals of a folder of strips or fields.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Totals<'a> {
    /// Of strips: mirrors across a swath, in pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    mirrors: Option<u32>,
    /// Of fields: width and height of a field, in pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    field: Option<[u32; 2]>,
    /// Of fields: number of rows and of columns of fields.
    #[serde(skip_serializing_if = "Option::is_none")]
    grid: Option<[u32; 2]>,
    /// Pixels that neighbors share.
    overlap: u32,
    /// How neighbors share them.
    seam: &'a str,
    /// Number of layers.
    layers: u64,
    /// Number of layers with gray images.
    gray_layers: u64,
    /// Pixels that are not black, in all files and layers.
    exposed_px: Option<u64>,
    /// Size of the coded images of all files, in bytes.
    data_bytes: u64,
    /// Whether all pages carry checks.
    checks: bool,
}

/// Description of a folder of strips, by `lamp info FOLDER --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Strips<'a> {
    #[serde(flatten)]
    totals: &'a Totals<'a>,
    /// The strips, from the left.
    strips: Vec<StripLine<'a>>,
}

/// A strip.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct StripLine<'a> {
    /// Name of its file.
    file: &'a str,
    /// Its columns of the build: the first, and the one after the last.
    columns: [u32; 2],
    #[serde(flatten)]
    facts: StackFacts<'a>,
}

/// Description of a folder of fields, by `lamp info FOLDER --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Fields<'a> {
    #[serde(flatten)]
    totals: &'a Totals<'a>,
    /// The fields, row by row.
    fields: Vec<FieldLine<'a>>,
}

/// A field.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct FieldLine<'a> {
    /// Its row of fields, from 0.
    row: u32,
    /// Its column of fields, from 0.
    column: u32,
    /// Name of its file.
    file: &'a str,
    /// Its columns of the build, in pixels: the first, and the one after the last.
    columns: [u32; 2],
    /// Its rows of the build, in pixels: the first, and the one after the last.
    rows: [u32; 2],
    #[serde(flatten)]
    facts: StackFacts<'a>,
}

schemas! {
    "lamp-info-strips-1": Strips<'_>;
    "lamp-info-fields-1": Fields<'_>;
}

impl<'a> Totals<'a> {
    fn of(form: &'a FieldForm, fields: &[FieldSummary]) -> Self {
        let sum = |number: fn(&StackTotals) -> u64| fields.iter().map(|s| number(&s.totals)).sum();
        let last = fields.last().map(|last| last.file.place);
        Self {
            mirrors: form.height.is_none().then_some(form.width),
            field: form.height.map(|height| [form.width, height]),
            grid: form.height.and(last).map(|last| [last.row + 1, last.column + 1]),
            overlap: form.overlap,
            seam: form.seam.name(),
            layers: fields.iter().map(|field| field.totals.pages).max().unwrap_or(0),
            gray_layers: fields.iter().map(|field| field.totals.gray_pages).max().unwrap_or(0),
            exposed_px: fields.iter().map(|field| field.totals.exposed_px).sum(),
            data_bytes: sum(|totals| totals.data_bytes),
            checks: fields.iter().all(|field| field.totals.has_checks()),
        }
    }
}

/// Prints what is known of a folder of strips or fields.
pub(super) fn print_fields(folder: &Path, as_json: bool) -> Result<(), Exit> {
    let name = input_name(folder);
    let failed = |error| Exit::from(error).at(name.clone());
    let form = FieldForm::of(folder).map_err(failed)?;
    let files = field_files(folder).map_err(failed)?;
    let fields = files.into_iter().map(|file| read(folder, file));
    let fields = fields.collect::<Result<Vec<_>, _>>()?;
    // Fields of two runs may lie in one folder, and sums of both would mean nothing.
    if let Some(field) = fields.iter().find(|field| made_by(field) != made_by(&fields[0])) {
        return Err(failed(field.file.of_other_input()));
    }
    let totals = Totals::of(&form, &fields);
    if as_json {
        return match form.kind() {
            FieldKind::Strip => {
                print_answer("lamp-info-strips-1", &json_of_strips(&totals, &fields))
            }
            FieldKind::Field => {
                print_answer("lamp-info-fields-1", &json_of_fields(&totals, &fields))
            }
        };
    }
    print(&text(&name, &form, &totals, &fields))
}

/// Returns the input of a field, and the commands that made its build: all but the field's own.
fn made_by(field: &FieldSummary) -> Option<(&str, &[String])> {
    let stack = field.totals.first.info.stack.as_ref()?;
    let (_, commands) = stack.commands.split_last()?;
    Some((&stack.digest, commands))
}

fn read(folder: &Path, file: FieldFile) -> Result<FieldSummary, Exit> {
    let path = folder.join(&file.name);
    let at = |error| failed_at(input_name(&path), error);
    let mut totals: Option<StackTotals> = None;
    for header in Pages::open(&path).map_err(at)?.headers() {
        let header = header.map_err(at)?;
        let is_of = file.check(&header.info);
        is_of.map_err(|error| Exit::from(error).at(input_name(folder)))?;
        match &mut totals {
            Some(totals) => totals.add(&header),
            None => totals = Some(StackTotals::of(&header)),
        }
    }
    let totals = totals.ok_or(lamp_stack::StackError::NoLayers).map_err(at)?;
    Ok(FieldSummary { file, totals })
}

fn json_of_strips<'a>(totals: &'a Totals<'a>, strips: &'a [FieldSummary]) -> Strips<'a> {
    let line = |strip: &'a FieldSummary| StripLine {
        file: &strip.file.name,
        columns: [strip.file.columns.start, strip.file.columns.end],
        facts: StackFacts::new(&strip.totals),
    };
    Strips { totals, strips: strips.iter().map(line).collect() }
}

fn json_of_fields<'a>(totals: &'a Totals<'a>, fields: &'a [FieldSummary]) -> Fields<'a> {
    let line = |field: &'a FieldSummary| FieldLine {
        row: field.file.place.row,
        column: field.file.place.column,
        file: &field.file.name,
        columns: [field.file.columns.start, field.file.columns.end],
        rows: [field.file.rows.start, field.file.rows.end],
        facts: StackFacts::new(&field.totals),
    };
    Fields { totals, fields: fields.iter().map(line).collect() }
}

fn text(name: &str, form: &FieldForm, totals: &Totals<'_>, fields: &[FieldSummary]) -> String {
    let exposed = |pixels: Option<u64>| match pixels {
        Some(pixels) => format!("{pixels} pixels"),
        None => "an unknown number of pixels".to_owned(),
    };
    let gray = match totals.gray_layers {
        0 => String::new(),
        gray => format!(", {gray} of them gray"),
    };
    let kind = form.kind();
    let sizes = match totals.field.zip(totals.grid) {
        None => format!("{:<12}{} of {} mirrors", "swaths:", fields.len(), form.width),
        Some(([width, height], [rows, columns])) => {
            let grid = format!("{rows} {} of {columns}", if rows == 1 { "row" } else { "rows" });
            format!("{:<12}{grid}, of {width} x {height} pixels", "grid:")
        }
    };
    let mut text = format!(
        "{:<12}{name}\nlayers:     {}{gray}\n{sizes}, {} shared{}\n\
         exposed:    {} in all {kind}s and layers\ndata:       {} bytes\n",
        format!("{kind}s:"),
        totals.layers,
        totals.overlap,
        if totals.overlap > 0 { format!(" ({})", totals.seam) } else { String::new() },
        exposed(totals.exposed_px),
        totals.data_bytes,
    );
    for FieldSummary { file, totals } in fields {
        let rows = match kind {
            FieldKind::Strip => String::new(),
            FieldKind::Field => format!(", rows {} to {}", file.rows.start, file.rows.end - 1),
        };
        text.push_str(&format!(
            "{}: columns {} to {}{rows}, {} layers, {}, {} bytes\n",
            file.name,
            file.columns.start,
            file.columns.end - 1,
            totals.pages,
            exposed(totals.exposed_px),
            totals.data_bytes,
        ));
    }
    text
}
