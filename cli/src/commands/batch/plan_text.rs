//! `lamp batch plan`: shows the work of a night before it starts.

use std::collections::{BTreeMap, HashSet};

use lamp_batch::{
    Cost, Deliverer, DiskRoom, Forecast, Key, Kind, Ledger, Local, Night, NightPlan, events,
};
use lamp_pipeline::heights::time_text;
use lamp_pipeline::memory::in_words;

use serde::Serialize;

use super::PlanArgs;
use super::machine_time::{Clock, MachineTime, StackTime, machine_refuses};
use super::night_file::NightFile;
use crate::args::options::Common;
use crate::exit::Exit;
use crate::output::json_report::{schemas, write_answer};
use crate::output::numbers::number_of;
use crate::streams::print;
use crate::terminal::progress::printable;

/// The stacks whose times on the machine are listed.
const MOST_STACKS: usize = 12;

/// The work of a night before it starts, by `lamp batch plan NIGHT.toml --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PlanAnswer<'a> {
    /// Number of tasks.
    tasks: usize,
    /// Number of tasks to do.
    to_do: usize,
    /// Estimated cost of the tasks to do.
    cost: Cost,
    /// Kinds of tasks.
    kinds: Vec<KindOfTasks>,
    /// Parts and builds that cannot be made.
    cannot_be_made: Vec<Unmakeable<'a>>,
    /// A sentence if the disk has too little room.
    disk_shortage: Option<String>,
    /// Number of threads that the expected times are for.
    threads: usize,
    /// Least expected time of the tasks to do, in seconds.
    least_s: f64,
    /// Greatest expected time of the tasks to do, in seconds; null if kinds of tasks are unknown.
    most_s: Option<f64>,
    /// Number of earlier tasks that the expected times are from.
    earlier_tasks: usize,
    /// Kinds of tasks without a known time.
    unknown: Vec<UnknownTasks>,
    /// Times that the machine takes for each build, and for parts in no build.
    machine_times: Vec<StackTime<'a>>,
    /// Sum of these times, in seconds; null if one is not known.
    machine_s: Option<f64>,
    /// Sum of all that is known of these times, in seconds.
    machine_least_s: f64,
}

/// Tasks whose time is not known, as none of their kind was done before.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct UnknownTasks {
    /// Name of their kind.
    kind: &'static str,
    /// Number of them to do.
    tasks: usize,
}

/// A kind of tasks.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct KindOfTasks {
    /// Its name.
    kind: &'static str,
    /// Number of its tasks.
    tasks: usize,
    /// Number of its tasks to do.
    to_do: usize,
    /// Estimated cost of its tasks to do.
    cost: Cost,
}

/// A part or build that cannot be made.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Unmakeable<'a> {
    /// Its name.
    name: &'a str,
    /// Why it cannot be made.
    why: String,
}

schemas! { "lamp-batch-plan-1": PlanAnswer<'_>; }

pub(super) fn run(args: &PlanArgs, common: &Common) -> Result<(), Exit> {
    let file = NightFile::open_for_look(&args.night.night)?;
    let store = file.store()?;
    let plan = file.plan(&store)?;
    let ledger = Ledger::new(&plan.graph, &store, &plan.goals(), 0);
    let to_do: HashSet<Key> = ledger.keys().into_iter().collect();
    let mut text = String::new();
    let faults = plan.subjects.iter().filter_map(|subject| {
        let why = subject.wanted.as_ref().err()?.to_string();
        Some(Unmakeable { name: &subject.name, why })
    });
    let refused = refused_builds(&file.night, &plan)?;
    let faults: Vec<_> = faults.chain(refused).collect();
    for Unmakeable { name, why } in &faults {
        text += &format!("{name}: cannot be made: {why}\n");
    }
    text = printable_lines(&text);
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
    let local = args.local.engine();
    let done = events(&store).map_err(|error| Exit::Failed(error.into()))?;
    let forecast = Forecast::new(&plan.graph, &ledger.keys(), &store, &done, &local);
    let is_known = forecast.unknown.is_empty();
    if !to_do.is_empty() {
        text += &expected(&forecast, &local);
    }
    let wait_s = is_known.then_some(forecast.seconds[1]);
    let most = if common.verbose { usize::MAX } else { MOST_STACKS };
    let machine_times = MachineTime::of_night(&file, &plan, &store, args.times)?;
    if !machine_times.is_empty() {
        text += &printable_lines(&MachineTime::text(&machine_times, wait_s, most));
    }
    let (machine_s, machine_least_s) = MachineTime::sum(&machine_times);
    if plan.subjects.len() > 1 {
        text += &total(&forecast, to_do.is_empty(), machine_s, machine_least_s);
    }
    if let Some(none) = file.no_parts() {
        text = printable_lines(&none);
    }
    if !args.night.report.is_printed() {
        print(&text)?;
    }
    let Some(path) = args.night.report.path() else { return Ok(()) };
    let kinds = kinds.iter().map(|(kind, (all, to_do, cost))| KindOfTasks {
        kind: kind.name(),
        tasks: *all,
        to_do: *to_do,
        cost: *cost,
    });
    let unknown = forecast.unknown.iter();
    let unknown = unknown.map(|(kind, tasks)| UnknownTasks { kind: kind.name(), tasks: *tasks });
    let answer = PlanAnswer {
        tasks: plan.graph.keys().len(),
        to_do: to_do.len(),
        cost,
        kinds: kinds.collect(),
        cannot_be_made: faults,
        disk_shortage: shortage,
        threads: local.jobs,
        least_s: forecast.seconds[0],
        most_s: wait_s,
        earlier_tasks: forecast.earlier,
        unknown: unknown.collect(),
        machine_times: machine_times.iter().map(MachineTime::answer).collect(),
        machine_s,
        machine_least_s,
    };
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

/// Returns lines about the time of the tasks to do: how long, until when, and what is not known.
fn expected(forecast: &Forecast, local: &Local) -> String {
    let Forecast { seconds: [least, most], earlier, unknown } = forecast;
    let threads = number_of(local.jobs as u64, "thread");
    let from = format!("with {threads}, from {}", number_of(*earlier as u64, "earlier task"));
    let end = |seconds: f64| {
        Clock::after(seconds).map_or("a distant day".to_owned(), |at| at.to_string())
    };
    let mut text = match (*earlier, unknown.is_empty()) {
        (0, _) => "expected: not known\n".to_owned(),
        (_, true) => {
            let ends = match [*least, *most].map(Clock::after) {
                [Some(first), Some(last)] if first == last => format!("at {last}"),
                [Some(first), Some(last)] if first.day == last.day => {
                    format!("between {} and {last}", first.time)
                }
                _ => format!("between {} and {}", end(*least), end(*most)),
            };
            let [least, most] = [*least, *most].map(time_text);
            format!("expected: {least} to {most} {from}; started now, it ends {ends}\n")
        }
        (_, false) => {
            let (least, end) = (time_text(*least), end(*least));
            format!("expected: at least {least} {from}; started now, it ends after {end}\n")
        }
    };
    if !unknown.is_empty() {
        let kinds: Vec<&str> = unknown.iter().map(|(kind, _)| kind.name()).collect();
        text += &format!(
            "no time is known of tasks of the kind {}: this store and machine have done none\n",
            kinds.join(", ")
        );
    }
    text
}

/// Returns the builds with parts that their machine refuses, which would fail once their parts are made.
fn refused_builds<'a>(night: &Night, plan: &'a NightPlan) -> Result<Vec<Unmakeable<'a>>, Exit> {
    let (_, builds) = plan.subjects.split_at(night.parts.len());
    let mut refused = Vec::new();
    for (build, subject) in night.builds.iter().zip(builds) {
        if subject.wanted.is_ok()
            && let Some(why) = machine_refuses(night, build)?
        {
            refused.push(Unmakeable { name: &subject.name, why });
        }
    }
    Ok(refused)
}

/// Returns the last line: the sum of the tasks' times, and of the machine's.
fn total(forecast: &Forecast, is_done: bool, machine_s: Option<f64>, least_s: f64) -> String {
    let Forecast { seconds: [least, most], earlier, unknown } = forecast;
    let tasks = match (*earlier, unknown.is_empty()) {
        _ if is_done => "no task is to do".to_owned(),
        (0, _) => "time of the tasks not known".to_owned(),
        (_, true) => format!("{} to {} for the tasks", time_text(*least), time_text(*most)),
        (_, false) => format!("at least {} for the tasks", time_text(*least)),
    };
    let machine = match machine_s {
        Some(seconds) => format!("{} on the machine", time_text(seconds)),
        None if least_s > 0.0 => format!("at least {} on the machine", time_text(least_s)),
        None => "time on the machine not known".to_owned(),
    };
    format!("in all: {tasks}; {machine}\n")
}

/// Escapes what could steer a terminal in each line.
pub(super) fn printable_lines(text: &str) -> String {
    text.lines().map(|line| format!("{}\n", printable(line))).collect()
}
