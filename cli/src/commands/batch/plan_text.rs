//! `lamp batch plan`: shows the work of a night before it starts.

use std::collections::{BTreeMap, HashSet};

use lamp_batch::{Cost, Deliverer, DiskRoom, Key, Kind, Ledger};
use lamp_pipeline::heights::time_text;
use lamp_pipeline::memory::in_words;

use serde_json::json;

use super::NightArgs;
use super::night_file::NightFile;
use crate::args::options::Common;
use crate::exit::Exit;
use crate::output::json_report::write_answer;
use crate::streams::print;
use crate::terminal::progress::printable;

pub(super) fn run(args: &NightArgs, common: &Common) -> Result<(), Exit> {
    let file = NightFile::open(&args.night)?;
    let store = file.store()?;
    let plan = file.plan(&store)?;
    let ledger = Ledger::new(&plan.graph, &store, &plan.goals(), 0);
    let to_do: HashSet<Key> = ledger.keys().into_iter().collect();
    let mut text = String::new();
    for subject in &plan.subjects {
        if let Err(why) = &subject.wanted {
            text += &printable(&format!("{}: cannot be made: {why}", subject.name));
            text.push('\n');
        }
    }
    let mut kinds: BTreeMap<Kind, (usize, usize, Cost)> = BTreeMap::new();
    for key in plan.graph.keys() {
        let task = plan.graph.task(*key);
        let (all, missing, cost) = kinds.entry(task.recipe.kind).or_default();
        *all += 1;
        if to_do.contains(key) {
            *missing += 1;
            *cost = [*cost, task.cost].into_iter().sum();
        }
        if common.verbose {
            let state = if to_do.contains(key) { "to do" } else { "done or not needed" };
            text += &format!("{key} {state}: {} ({})\n", printable(&task.subject), task.label);
        }
    }
    for (kind, (all, missing, cost)) in &kinds {
        text += &line(kind.name(), *missing, *all, cost);
    }
    let cost: Cost = kinds.values().map(|(.., cost)| *cost).sum();
    text += &line("all", to_do.len(), plan.graph.keys().len(), &cost);
    let deliverer = Deliverer { store: &store, output: &file.night.output };
    let shortage = DiskRoom::of(&plan, &ledger, &deliverer).shortage();
    if let Some(shortage) = &shortage {
        text += &printable(shortage);
        text.push('\n');
    }
    if !args.report.is_printed() {
        print(&text)?;
    }
    let Some(path) = args.report.path() else { return Ok(()) };
    let faults = plan.subjects.iter().filter_map(|subject| {
        let why = subject.wanted.as_ref().err()?;
        Some(json!({ "name": subject.name, "why": why.to_string() }))
    });
    let kinds = kinds.iter().map(|(kind, (all, to_do, cost))| {
        json!({ "kind": kind.name(), "tasks": all, "to_do": to_do, "cost": cost })
    });
    let answer = json!({
        "tasks": plan.graph.keys().len(),
        "to_do": to_do.len(),
        "cost": cost,
        "kinds": kinds.collect::<Vec<_>>(),
        "cannot_be_made": faults.collect::<Vec<_>>(),
        "disk_shortage": shortage,
    });
    write_answer("lamp-batch-plan-1", &answer, path)
}

/// A line of the plan: `range   8 of 12 to do, 40s of processors, 300 MB of memory, 2 MB on disk`.
fn line(kind: &str, missing: usize, all: usize, cost: &Cost) -> String {
    let takes = match missing {
        0 => String::new(),
        _ => format!(
            ", about {} of CPU time, {} of memory, {} on disk",
            time_text(cost.cpu_s),
            in_words(cost.memory),
            in_words(cost.disk)
        ),
    };
    format!("{kind:<6} {missing} of {all} tasks to do{takes}\n")
}
