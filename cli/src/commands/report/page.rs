//! The page of a stack, as HTML. maud escapes all texts, which come from files.

use lamp_pipeline::heights::time_text;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::charts::{charts, same_thickness_um};
use super::gather::{Drawn, StackReport};
use super::pictures::InlinePicture;
use crate::commands::info;
use crate::terminal::progress::printable;
use lamp_supports::Feature;

/// The most findings of a kind that are listed, as `lamp check` does.
const MOST_LINES: usize = 20;

/// Returns a whole page: its title, styles and content.
pub(in crate::commands) fn document(title: &str, content: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                // The page needs nothing from anywhere.
                meta http-equiv="Content-Security-Policy"
                    content="default-src 'none'; img-src data:; style-src 'unsafe-inline'";
                title { (printable(title)) }
                style { (PreEscaped(include_str!("style.css"))) }
            }
            body { main { (content) } footer { "Written by lamp " (env!("CARGO_PKG_VERSION")) "." } }
        }
    };
    page.into_string()
}

/// Returns the page of a stack, with a link to an index if it has one.
pub(super) fn html(report: &StackReport, index: Option<&str>) -> String {
    let part = report.totals.first.info.stack.as_ref().map(|stack| stack.part.as_str());
    let name = part.filter(|part| !part.is_empty()).unwrap_or(&report.name);
    let content = html! {
        @if let Some(index) = index { nav { a href=(index) { "All reports" } } }
        h1 { (printable(name)) }
        p.subtitle { "Report of " (printable(&report.name)) }
        (warnings(report))
        section { h2 { "Stack" } (facts(report)) }
        section { h2 { "Build time" } (build_time(report)) }
        @if let Ok(drawn) = &report.found { section { h2 { "Findings" } (findings(drawn)) } }
        section {
            h2 { "Views" }
            p.note { "Black is empty; the brighter, the nearer. The front is below in the view from above." }
            div.views { @for picture in &report.views { (figure(picture)) } }
        }
        section {
            h2 { "Layers" }
            div.sheet { @for picture in &report.sheet { (figure(picture)) } }
        }
        section {
            h2 { "Over the height" }
            @if let Some(um) = same_thickness_um(&report.layers) {
                p { "Every layer is " (um) " µm thick." }
            }
            div.charts { @for chart in charts(report) { div.chart { (PreEscaped(chart)) } } }
        }
    };
    document(name, &content)
}

fn warnings(report: &StackReport) -> Markup {
    let warnings = report.warnings();
    html! {
        @if warnings.is_empty() {
            p.good { "Nothing to warn of." }
        } @else {
            section.warnings {
                h2 { "Look at this first" }
                ul { @for warning in &warnings { li { (printable(warning)) } } }
            }
        }
    }
}

/// The lines of `lamp info`, and what only a report knows.
fn facts(report: &StackReport) -> Markup {
    let rows_fixed: u64 = report.layers.iter().map(|layer| layer.fixed_rows).sum();
    let stack = report.totals.first.info.stack.as_ref();
    let material = stack.and_then(|stack| stack.other.get("material")?["name"].as_str());
    html! {
        table.facts {
            @for (key, value) in info::lines(&report.totals, &report.name, None) {
                tr { th { (key) } td { (with_signs(&value)) } }
            }
            @if rows_fixed > 0 { tr { th { "stray rows fixed" } td { (rows_fixed) } } }
            @if let Some(name) = material {
                tr { th { "material" } td { (printable(name)) } }
            }
        }
    }
}

fn build_time(report: &StackReport) -> Markup {
    let time = &report.time;
    html! {
        @match time.sum_s() {
            None => p {
                @match &time.unscanned {
                    Some(why) => { "Not known: " (why) "." }
                    None => {
                        "Not known: not every layer states its exposure."
                        @if time.least_s() > 0.0 { " The rest takes " (time_text(time.least_s())) "." }
                    }
                }
            },
            Some(sum) => table.facts {
                @if let Some((fields, seconds)) = time.fields.zip(time.fields.and_then(|f| f.seconds())) {
                    tr { th { "fields" } td { (time_text(seconds)) ", " (fields.count) " in all" } }
                } @else if let Some(swaths) = time.swaths {
                    tr { th { "swaths" } td { (time_text(swaths.seconds)) ", " (swaths.count) " in all" } }
                } @else if let Some(exposure_s) = time.exposure_s {
                    tr { th { "exposures" } td { (time_text(exposure_s)) } }
                }
                @if let Some(seconds) = time.recoating_s {
                    tr { th { "recoating" } td { (time_text(seconds)) } }
                }
                @if let Some(seconds) = time.lifts_s {
                    tr { th { "lifts and waits" } td { (time_text(seconds)) } }
                }
                tr { th { (if time.is_whole() { "in all" } else { "at least" }) } td { (time_text(sum)) } }
            },
        }
        @if time.recoating_s.is_none() && time.lifts_s.is_none() {
            p.note { "Recoating, peeling and moving are not in it: give --recoat, or name a machine whose recoating is known with --machine." }
        } @else if time.lifts_s.is_none() {
            p.note { "Peeling, waiting and moving are not in it." }
        }
    }
}

fn findings(Drawn { found, pictures }: &Drawn) -> Markup {
    let name = |feature: &Feature| found.records[feature.finding].name();
    let text = |feature: &Feature| with_signs(&found.text(feature));
    let kinds = found.features.chunk_by(|a, b| name(a) == name(b));
    let specks = found.findings.specks.count();
    html! {
        @if found.records.is_empty() { p { "lamp check finds nothing." } }
        @if !pictures.is_empty() {
            div.evidence {
                @for (number, picture) in pictures {
                    @let feature = &found.features[*number];
                    figure {
                        img src=(picture.address) alt=(name(feature));
                        figcaption { b { (name(feature)) } ": " (text(feature)) }
                    }
                }
            }
            p.note {
                "Red: the finding. Yellow: other white without white below. White: white. Gray: white in the layer below only. Blue: the place in the whole layer, and the layer in the side view."
            }
        }
        table.findings {
            @for features in kinds {
                @for feature in &features[..features.len().min(MOST_LINES)] {
                    tr { th { (name(feature)) } td { (text(feature)) } }
                }
                @if features.len() > MOST_LINES {
                    tr { th { (name(&features[0])) } td { (features.len() - MOST_LINES) " more (lamp check --report lists them)" } }
                }
            }
        }
        @for note in found.unchecked_rules() { p.note { "In lamp check, " (printable(&note.to_string())) "." } }
        @if specks > 0 { p.note { (specks) " specks: islands too small to count." } }
    }
}

/// Returns a terminal's line with units as signs, as in charts.
fn with_signs(line: &str) -> String {
    let signs = [(" mm2", " mm²"), (" mm3", " mm³"), (" um", " µm")];
    signs.iter().fold(line.to_owned(), |line, (letters, sign)| line.replace(letters, sign))
}

fn figure(picture: &InlinePicture) -> Markup {
    html! {
        figure {
            img src=(picture.address) alt=(picture.caption);
            figcaption { (picture.caption) }
        }
    }
}
