//! The report of a night: one page, failures first.

use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::path::Path;

use anyhow::Context;
use lamp_batch::path_bytes::WrittenPath;
use lamp_batch::{
    Event, Key, Kind, NightPlan, Store, SubjectState, SubjectSummary, Summary, events,
};
use lamp_pipeline::heights::time_text;
use lamp_pipeline::memory::in_words;
use lamp_stack::digest_of;
use maud::{Markup, PreEscaped, html};

use super::night_file::NightFile;
use super::run::counts;
use super::task::{CheckResult, middle};
use crate::commands::report::{InlinePicture, document};
use crate::exit::Exit;
use crate::output::numbers::{grouped, number_of};
use crate::streams::write_file;
use crate::terminal::progress::printable;
use lamp_plots::{Plot, curve, inline_svg, linear};

/// The most findings of a part that are listed.
const MOST_LINES: usize = 5;

/// A stack of a part or a build, as the report shows it.
struct SeenStack {
    picture: InlinePicture,
    /// Lines of its plans of exposures.
    planned: Vec<String>,
    /// The findings of its check, the worst first.
    findings: Vec<String>,
}

/// Time and memory that tasks of a part or a build took.
#[derive(Clone, Copy, Default)]
struct Took {
    seconds: f64,
    cpu_s: f64,
    memory: u64,
}

/// Writes the report.
pub(super) fn write(
    path: &Path,
    file: &NightFile,
    plan: &NightPlan,
    store: &Store,
    summary: &Summary,
) -> Result<(), Exit> {
    let done = done(plan, store)?;
    let took = took(&done);
    let stacks: HashMap<usize, SeenStack> =
        summary.lines().filter_map(|line| Some((line.place, seen(line, plan, store)?))).collect();
    let name = file.path.file_name().unwrap_or_default().to_string_lossy();
    let content = html! {
        h1 { "Night run: " (printable(&name)) }
        p.subtitle { (counts(summary)) ", " (plan.graph.keys().len()) " tasks" }
        (first(summary))
        @for (title, lines) in [("Builds", &summary.builds), ("Parts", &summary.parts)] {
            @if !lines.is_empty() { section { h2 { (title) } (table(lines, &took)) } }
        }
        section {
            h2 { "A layer of each stack" }
            div.sheet {
                @for line in summary.builds.iter().chain(&summary.parts) {
                    @if let Some(SeenStack { picture, planned, findings }) = stacks.get(&line.place) {
                        figure {
                            img src=(picture.address) alt=(printable(&line.name));
                            figcaption {
                                b { (printable(&line.name)) } ", " (picture.caption)
                                @for line in planned { br; (printable(line)) }
                                @for finding in findings.iter().take(MOST_LINES) { br; (printable(finding)) }
                                @if findings.len() > MOST_LINES { br; "and " (number_of((findings.len() - MOST_LINES) as u64, "more finding")) }
                            }
                        }
                    }
                }
            }
        }
        section {
            h2 { "Tasks over time" }
            div.charts { @for chart in charts(&done) { div.chart { (PreEscaped(chart)) } } }
        }
    };
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let page = document(&format!("Night run: {name}"), &content);
    write_file(path, |out| out.write_all(page.as_bytes()))?;
    // Without the note it is written again.
    let _ = store.keep_note(note(path), &digest(summary)?);
    Ok(())
}

/// Returns whether the report is there and describes this summary. A run that was killed before it
/// wrote its own report leaves the report of an earlier run.
pub(super) fn is_written(path: &Path, store: &Store, summary: &Summary) -> Result<bool, Exit> {
    Ok(path.exists() && store.note(note(path)) == Some(digest(summary)?))
}

fn note(path: &Path) -> Key {
    Key::of_note("report", &WrittenPath(path))
}

fn digest(summary: &Summary) -> Result<String, Exit> {
    let text = serde_json::to_vec(summary).context("the summary")?;
    Ok(digest_of(&text[..]).context("the summary")?)
}

/// Returns how each task of the plan was done, the last time.
fn done(plan: &NightPlan, store: &Store) -> Result<Vec<Event>, Exit> {
    let all = events(store).context("the journal")?.into_iter().filter(Event::is_done);
    let last: BTreeMap<Key, Event> = all.map(|event| (event.key, event)).collect();
    let mut done: Vec<Event> =
        plan.graph.keys().iter().filter_map(|key| last.get(key).cloned()).collect();
    // Of equal parts, tasks are done once: they count for the first.
    for event in &mut done {
        event.subject.clone_from(&plan.graph.task(event.key).subject);
    }
    done.sort_by(|a, b| a.at.total_cmp(&b.at));
    Ok(done)
}

fn took(done: &[Event]) -> HashMap<&str, Took> {
    let mut took: HashMap<&str, Took> = HashMap::new();
    for event in done {
        let took = took.entry(&event.subject).or_default();
        took.seconds += event.seconds;
        took.cpu_s += event.cpu_s.unwrap_or(event.seconds);
        took.memory = took.memory.max(event.memory.unwrap_or(0));
    }
    took
}

/// The first things to know: failures, and results to look at.
fn first(summary: &Summary) -> Markup {
    let is_told = |line: &&SubjectSummary| line.state != SubjectState::Done;
    let mut told: Vec<&SubjectSummary> = summary.lines().filter(is_told).collect();
    told.sort_by_key(|line| line.state);
    html! {
        @if told.is_empty() {
            p.good { "All is done, and nothing needs a person." }
        } @else {
            section.warnings {
                h2 { "Look at this first" }
                ul {
                    @for line in told {
                        li {
                            b { (printable(&line.name)) } " " (line.state.words())
                            @if let Some(why) = &line.why { ": " (printable(why)) }
                        }
                    }
                }
            }
        }
    }
}

fn table(lines: &[SubjectSummary], took: &HashMap<&str, Took>) -> Markup {
    let known = |number: Option<u64>| number.map_or_else(String::new, grouped);
    html! {
        table.index {
            thead { tr {
                th { "name" } th { "state" } th { "layers" } th { "stray bands corrected" }
                th { "stray bands left" } th { "islands" } th { "time of its tasks" } th { "CPU time" }
                th { "most memory" } th { "BLAKE3 digest begins" }
            } }
            tbody {
                @for line in lines {
                    tr {
                        td {
                            // Long names break between their words.
                            @for word in printable(&line.name).split_inclusive(['_', '-', '.']) { (word) wbr; }
                        }
                        td { (line.state.words()) }
                        td.whole { (known(line.layers)) }
                        td.whole { (known(line.layers.map(|_| line.stray_fixed))) }
                        td.whole { (known(line.layers.map(|_| line.stray_left))) }
                        td.whole { (known(line.layers.map(|_| line.islands))) }
                        @match took.get(line.name.as_str()) {
                            Some(took) => {
                                td.whole { (time_text(took.seconds)) }
                                td.whole { (time_text(took.cpu_s)) }
                                td.whole { (in_words(took.memory)) }
                            }
                            None => { td {} td {} td {} }
                        }
                        td.whole { (line.digest.as_deref().map_or("", shown_digest)) }
                    }
                }
            }
        }
    }
}

/// Returns enough digits of a digest for people to compare files.
fn shown_digest(digest: &str) -> &str {
    let digits = digest.split_once(':').map_or(digest, |(_, digits)| digits);
    digits.get(..12).unwrap_or(digits)
}

/// Returns the lines of the plans of exposures that a stack is made by, the first plan's first.
fn lines_of_plans(stack: Key, plan: &NightPlan, store: &Store) -> Vec<String> {
    let task = plan.graph.task(stack);
    let mut lines = match (task.recipe.kind, &task.needs[..]) {
        (Kind::Whole | Kind::Plan, &[before]) => lines_of_plans(before, plan, store),
        _ => Vec::new(),
    };
    if task.recipe.kind == Kind::Plan {
        lines.extend(store.manifest(stack).into_iter().flat_map(|manifest| manifest.facts.notes));
    }
    lines
}

/// Returns how a stack is shown, if it is made and checked.
fn seen(line: &SubjectSummary, plan: &NightPlan, store: &Store) -> Option<SeenStack> {
    let wanted = plan.subjects[line.place].wanted.as_ref().ok()?;
    let planned = lines_of_plans(wanted.stack, plan, store);
    let Some(check) = wanted.check else {
        store.manifest(wanted.stack)?;
        let picture = middle(&store.result(wanted.stack)).ok()?;
        return Some(SeenStack { picture, planned, findings: Vec::new() });
    };
    store.manifest(check)?;
    let text = fs::read(store.result(check)).ok()?;
    let checked: CheckResult = serde_json::from_slice(&text).ok()?;
    Some(SeenStack { picture: checked.picture?, planned, findings: checked.lines })
}

/// Draws how many tasks were at work, and how many were done.
fn charts(done: &[Event]) -> Vec<String> {
    let starts = done.iter().map(|event| event.at - event.seconds);
    let Some(start) = starts.clone().reduce(f64::min) else { return Vec::new() };
    let last = done.iter().map(|event| event.at).fold(start, f64::max);
    let (unit, label) = match last - start {
        ..200.0 => (1.0, "time (s)"),
        ..10_000.0 => (60.0, "time (min)"),
        _ => (3600.0, "time (h)"),
    };
    let end = ((last - start) / unit).max(1e-3);
    let mut steps: Vec<(f64, i64)> = starts.map(|at| (at, 1)).collect();
    steps.extend(done.iter().map(|event| (event.at, -1)));
    let at_work = heights(steps, start, unit);
    let finished = heights(done.iter().map(|event| (event.at, 1)).collect(), start, unit);
    let chart = |title: &str, of: &str, points: Vec<(f64, f64)>| {
        let most = points.iter().map(|point| point.1).fold(1.0, f64::max);
        let plot = Plot {
            title: title.to_owned(),
            x: linear(label, 0.0..end),
            y: linear(of, 0.0..1.3 * most),
            series: vec![curve(of, points)],
        };
        inline_svg(&plot)
    };
    vec![chart("At work", "tasks at work", at_work), chart("Done", "tasks done", finished)]
}

/// Returns the corners of a staircase, given where it goes up and down.
fn heights(mut steps: Vec<(f64, i64)>, start: f64, unit: f64) -> Vec<(f64, f64)> {
    steps.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut height = 0;
    let mut corners = vec![(0.0, 0.0)];
    for (at, by) in steps {
        let x = ((at - start) / unit).max(0.0);
        corners.push((x, height as f64));
        height += by;
        corners.push((x, height as f64));
    }
    corners
}
