//! `lamp batch status`: prints the state of each part and build.

use std::collections::BTreeMap;

use lamp_batch::{Deliverer, Key, Ledger, SubjectState, SubjectSummary, Summary, events};

use serde::Serialize;

use super::NightArgs;
use super::night_file::NightFile;
use super::plan_text::printable_lines;
use super::run::counts;
use crate::args::options::Common;
use crate::exit::Exit;
use crate::output::json_report::{schemas, write_answer};
use crate::streams::print;
use crate::terminal::progress::printable;

/// The state of each part and build of a night, by `lamp batch status NIGHT.toml --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct StatusAnswer {
    /// Number of tasks to do.
    tasks_to_do: usize,
    /// How tasks that are to do failed the last time.
    last_failures: Vec<LastFailure>,
    #[serde(flatten)]
    summary: Summary,
}

/// How a task that is to do failed the last time.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct LastFailure {
    /// The part or the build.
    subject: String,
    /// The task.
    task: String,
    /// The reason.
    why: String,
}

schemas! { "lamp-batch-status-1": StatusAnswer; }

pub(super) fn run(args: &NightArgs, common: &Common) -> Result<(), Exit> {
    let file = NightFile::open_for_look(&args.night)?;
    let store = file.store()?;
    let plan = file.plan(&store)?;
    let ledger = Ledger::new(&plan.graph, &store, &plan.goals(), 0);
    let deliverer = Deliverer { store: &store, output: &file.night.output };
    let summary = Summary::new(&plan, &deliverer, &ledger);
    let mut text = String::new();
    for line in summary.lines().filter(|line| line.state != SubjectState::Done || common.verbose) {
        text += &told(line);
    }
    let to_do = ledger.keys();
    let mut last_failures = Vec::new();
    if !to_do.is_empty() {
        // The last words of attempts, the latest of each task.
        let failed = events(&store).map_err(|error| Exit::Failed(error.into()))?;
        let failed = failed.into_iter().filter(|event| !event.is_done());
        let last: BTreeMap<Key, _> = failed.map(|event| (event.key, event)).collect();
        for event in to_do.iter().filter_map(|key| last.get(key)) {
            let why = event.why.clone().unwrap_or_else(|| "it failed".to_owned());
            text += &printable(&format!("{} ({}): last time: {why}", event.subject, event.label));
            text.push('\n');
            let (subject, task) = (event.subject.clone(), event.label.clone());
            last_failures.push(LastFailure { subject, task, why });
        }
    }
    if common.verbose {
        for key in plan.graph.keys() {
            let task = plan.graph.task(*key);
            let state = if store.manifest(*key).is_some() { "done" } else { "to do" };
            text += &format!("{key} {state}: {} ({})\n", printable(&task.subject), task.label);
        }
    }
    let done = summary.count(SubjectState::Done) + summary.count(SubjectState::NeedsPerson);
    let all = summary.lines().count();
    let counts = counts(&summary);
    text += &match file.no_parts() {
        Some(none) => printable_lines(&none),
        None => format!("{done} of {all} are done ({counts}), {} tasks are to do\n", to_do.len()),
    };
    if !args.report.is_printed() {
        print(&text)?;
    }
    let Some(path) = args.report.path() else { return Ok(()) };
    let answer = StatusAnswer { tasks_to_do: to_do.len(), last_failures, summary };
    write_answer("lamp-batch-status-1", &answer, path)
}

fn told(line: &SubjectSummary) -> String {
    let why = line.why.as_ref().map(|why| format!(": {why}")).unwrap_or_default();
    format!("{}: {}{}\n", printable(&line.name), line.state.words(), printable(&why))
}
