//! `lamp info` of a folder of strips: its totals, and each strip.

use std::path::Path;

use lamp_build::{StripDifference, StripFile, StripForm, StripsError, check_number, strip_files};
use lamp_stack::{Pages, StackTotals};
use serde::Serialize;

use crate::exit::Exit;
use crate::output::json_report::print_answer;
use crate::output::stack_facts::StackFacts;
use crate::streams::{failed_at, input_name, print};

/// A strip, and what its pages say.
struct StripSummary {
    file: StripFile,
    totals: StackTotals,
}

#[derive(Serialize)]
struct Totals<'a> {
    mirrors: u32,
    overlap: u32,
    seam: &'a str,
    layers: u64,
    gray_layers: u64,
    exposed_px: Option<u64>,
    data_bytes: u64,
    checks: bool,
}

impl<'a> Totals<'a> {
    fn of(form: &'a StripForm, strips: &[StripSummary]) -> Self {
        let sum = |number: fn(&StackTotals) -> u64| strips.iter().map(|s| number(&s.totals)).sum();
        Self {
            mirrors: form.mirrors,
            overlap: form.overlap,
            seam: form.seam.name(),
            layers: strips.iter().map(|strip| strip.totals.pages).max().unwrap_or(0),
            gray_layers: strips.iter().map(|strip| strip.totals.gray_pages).max().unwrap_or(0),
            exposed_px: strips.iter().map(|strip| strip.totals.exposed_px).sum(),
            data_bytes: sum(|totals| totals.data_bytes),
            checks: strips.iter().all(|strip| strip.totals.has_checks()),
        }
    }
}

/// Prints what is known of a folder of strips.
pub(super) fn print_strips(folder: &Path, as_json: bool) -> Result<(), Exit> {
    let name = input_name(folder);
    let failed = |error| Exit::from(error).at(name.clone());
    let form = StripForm::of(folder).map_err(failed)?;
    let files = strip_files(folder).map_err(failed)?;
    let strips = files.into_iter().zip(0..).map(|(file, number)| read(folder, file, number));
    let strips = strips.collect::<Result<Vec<_>, _>>()?;
    // Strips of two runs may lie in one folder, and sums of both would mean nothing.
    if let Some(strip) = strips.iter().find(|strip| made_by(strip) != made_by(&strips[0])) {
        let (file, difference) = (strip.file.name.clone(), StripDifference::Input);
        return Err(failed(StripsError::Unlike { file, difference }));
    }
    let totals = Totals::of(&form, &strips);
    if as_json {
        return print_answer("lamp-info-strips-1", &json(&totals, &strips));
    }
    print(&text(&name, &totals, &strips))
}

/// Returns the input of a strip, and the commands that made its build: all but the strip's own.
fn made_by(strip: &StripSummary) -> Option<(&str, &[String])> {
    let stack = strip.totals.first.info.stack.as_ref()?;
    let (_, commands) = stack.commands.split_last()?;
    Some((&stack.digest, commands))
}

fn read(folder: &Path, file: StripFile, number: u32) -> Result<StripSummary, Exit> {
    let path = folder.join(&file.name);
    let at = |error| failed_at(input_name(&path), error);
    let mut totals: Option<StackTotals> = None;
    for header in Pages::open(&path).map_err(at)?.headers() {
        let header = header.map_err(at)?;
        check_number(&header.info, number).map_err(|difference| {
            let file = file.name.clone();
            Exit::from(StripsError::Unlike { file, difference }).at(input_name(folder))
        })?;
        match &mut totals {
            Some(totals) => totals.add(&header),
            None => totals = Some(StackTotals::of(&header)),
        }
    }
    let totals = totals.ok_or(lamp_stack::StackError::NoLayers).map_err(at)?;
    Ok(StripSummary { file, totals })
}

fn json<'a>(totals: &'a Totals<'a>, strips: &'a [StripSummary]) -> impl Serialize + 'a {
    #[derive(Serialize)]
    struct Answer<'a> {
        #[serde(flatten)]
        totals: &'a Totals<'a>,
        strips: Vec<Line<'a>>,
    }
    #[derive(Serialize)]
    struct Line<'a> {
        file: &'a str,
        columns: [u32; 2],
        #[serde(flatten)]
        facts: StackFacts<'a>,
    }
    let line = |strip: &'a StripSummary| Line {
        file: &strip.file.name,
        columns: [strip.file.columns.start, strip.file.columns.end],
        facts: StackFacts::new(&strip.totals),
    };
    Answer { totals, strips: strips.iter().map(line).collect() }
}

fn text(name: &str, totals: &Totals<'_>, strips: &[StripSummary]) -> String {
    let exposed = |pixels: Option<u64>| match pixels {
        Some(pixels) => format!("{pixels} pixels"),
        None => "an unknown number of pixels".to_owned(),
    };
    let gray = match totals.gray_layers {
        0 => String::new(),
        gray => format!(", {gray} of them gray"),
    };
    let mut text = format!(
        "strips:     {name}\nlayers:     {}{gray}\nswaths:     {} of {} mirrors, {} shared{}\n\
         exposed:    {} in all strips and layers\ndata:       {} bytes\n",
        totals.layers,
        strips.len(),
        totals.mirrors,
        totals.overlap,
        if totals.overlap > 0 { format!(" ({})", totals.seam) } else { String::new() },
        exposed(totals.exposed_px),
        totals.data_bytes,
    );
    for StripSummary { file, totals } in strips {
        text.push_str(&format!(
            "{}: columns {} to {}, {} layers, {}, {} bytes\n",
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
