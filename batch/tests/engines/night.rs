//! A night of three parts of three ranges each, and a build of all.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::thread;
use std::time::{Duration, Instant};

use lamp_batch::{
    Cost, Engine, Event, Graph, Key, Kind, Launcher, Ledger, Local, State, Store, Task, TaskRecipe,
    Work as Works, events,
};

use crate::task::{Fault, NO_PART, Work};

const PARTS: [&str; 3] = ["blade", "vane", "it's"];
/// The part in which tasks have faults.
const FAULTY: &str = "vane";
const PATIENCE: Duration = Duration::from_secs(120);

pub(crate) struct Night {
    folder: PathBuf,
    fault: Fault,
}

/// All tasks, and the goals: parts and the build.
struct Tasks {
    graph: Graph,
    goals: Vec<Key>,
}

fn task(name: String, kind: Kind, needs: &[Key], work: &Work) -> Task {
    Task {
        recipe: TaskRecipe {
            kind,
            options: vec![name.clone()],
            inputs: needs.iter().map(ToString::to_string).collect(),
            code: Vec::new(),
        },
        subject: name.split(' ').next().unwrap_or_default().to_owned(),
        label: name,
        needs: needs.to_vec(),
        files: Vec::new(),
        cost: Cost { cpu_s: work.seconds, memory: 20_000_000, disk: 100 },
        work: serde_json::to_value(work).unwrap(),
    }
}

fn tasks(fault: Fault, seconds: f64) -> Tasks {
    let mut graph = Graph::default();
    let joined = PARTS.map(|part| {
        let ranges = [0, 1, 2].map(|range| {
            let is_faulty = part == FAULTY && range == 1;
            let fault = if is_faulty { fault } else { Fault::None };
            let name = format!("{part} {range}");
            graph.add(task(name, Kind::Range, &[], &Work { fault, seconds }))
        });
        let work = Work { fault: Fault::None, seconds };
        graph.add(task(part.to_owned(), Kind::Join, &ranges, &work))
    });
    let work = Work { fault: Fault::None, seconds };
    let build = graph.add(task("build".to_owned(), Kind::Tile, &joined, &work));
    let goals = joined.into_iter().chain([build]).collect();
    Tasks { graph, goals }
}

fn engine(name: &str) -> Engine {
    match name {
        "slurm" => Engine::Slurm,
        "hyperqueue" => Engine::HyperQueue,
        _ => Engine::Local(Local { jobs: 2, memory: 1 << 30 }),
    }
}

/// Does what is missing, and returns what became of each task.
fn run(store: &Path, name: &str, fault: Fault, seconds: f64) -> Vec<(String, State)> {
    let store = Store::create(store).unwrap();
    let tasks = tasks(fault, seconds);
    let launcher = Launcher { program: std::env::current_exe().unwrap() };
    let mut ledger = Ledger::new(&tasks.graph, &store, &tasks.goals, 2);
    let work = Works { graph: &tasks.graph, store: &store, launcher: &launcher };
    engine(name).run(&work, &mut ledger, &mut |_| ()).unwrap();
    let keys = tasks.graph.keys().iter();
    keys.map(|&key| (tasks.graph.task(key).label.clone(), ledger.state(key))).collect()
}

/// Plays the night that is killed.
pub(crate) fn coordinate(store: &Path, engine: &str, seconds: f64) {
    run(store, engine, Fault::None, seconds);
}

impl Night {
    pub(crate) fn new(folder: &Path, name: &str) -> Self {
        let folder = folder.join(name);
        fs::create_dir_all(&folder).unwrap();
        Self { folder, fault: Fault::None }
    }

    pub(crate) fn with_killed_task(self) -> Self {
        Self { fault: Fault::Killed, ..self }
    }

    pub(crate) fn with_bad_input(self) -> Self {
        Self { fault: Fault::BadInput, ..self }
    }

    fn store(&self) -> PathBuf {
        self.folder.join("store")
    }

    /// Starts the night as a process of its own, with tasks that leave time to kill something.
    pub(crate) fn coordinate(&self, engine: &str) -> Child {
        let program = std::env::current_exe().unwrap();
        let mut night = Command::new(program);
        night.arg("coordinate").arg(self.store()).args([engine, "0.5"]).spawn().unwrap()
    }

    /// Waits until so many tasks are done.
    pub(crate) fn wait_for_results(&self, count: usize) {
        let start = Instant::now();
        let graph = tasks(self.fault, 0.0).graph;
        loop {
            let store = Store::open(&self.store()).ok();
            let is_done = |key: &&Key| store.as_ref().unwrap().manifest(**key).is_some();
            if store.is_some() && graph.keys().iter().filter(is_done).count() >= count {
                return;
            }
            assert!(start.elapsed() < PATIENCE, "{count} results do not come");
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Does what is missing and returns the bytes of all results.
    pub(crate) fn done(&self, engine: &str) -> Vec<Vec<u8>> {
        for (label, state) in run(&self.store(), engine, self.fault, 0.05) {
            assert_eq!(state, State::Done, "{label}");
        }
        self.is_clean();
        let store = Store::open(&self.store()).unwrap();
        let keys = tasks(self.fault, 0.0).graph.keys().to_vec();
        keys.iter().for_each(|&key| drop(store.check(key).unwrap()));
        keys.iter().map(|&key| fs::read(store.result(key)).unwrap()).collect()
    }

    /// Does all but the faulty part, and what depends on it.
    pub(crate) fn loses_one_part(&self, engine: &str) {
        let states: HashMap<_, _> =
            run(&self.store(), engine, self.fault, 0.05).into_iter().collect();
        let why = State::Failed(NO_PART.to_owned());
        assert_eq!(states["vane 1"], why);
        assert_eq!((&states["vane"], &states["build"]), (&State::Skipped, &State::Skipped));
        assert_eq!((&states["blade"], &states["it's"]), (&State::Done, &State::Done));
        self.is_clean();
        let store = Store::open(&self.store()).unwrap();
        let failed = events(&store).unwrap().into_iter().filter(|event| !event.is_done());
        assert_eq!(failed.count(), 1, "bad input is not tried again");
    }

    /// Checks that no finished task was done again, and that no file is left over.
    fn is_clean(&self) {
        // Opening for a run takes away what dead processes left.
        let store = Store::create(&self.store()).unwrap();
        // Events come in the order of their ends. Two may have done one task at the same time.
        let mut done = HashMap::new();
        for event in events(&store).unwrap().into_iter().filter(Event::is_done) {
            let first = *done.entry(event.label.clone()).or_insert(event.at);
            assert!(event.at - event.seconds < first, "{} was done again", event.label);
        }
        // A task of a coordinator that was killed may still wait for the disk.
        let start = Instant::now();
        while let Some(name) = left_over(&store) {
            assert!(start.elapsed() < PATIENCE, "{name} is left over");
            thread::sleep(Duration::from_millis(20));
            Store::create(&self.store()).unwrap();
        }
    }
}

/// Returns the name of a file among tasks that belongs to no task.
fn left_over(store: &Store) -> Option<String> {
    let shards = fs::read_dir(store.root().join("tasks")).unwrap();
    let files = shards.flat_map(|shard| fs::read_dir(shard.unwrap().path()).unwrap());
    let mut names = files.map(|file| file.unwrap().file_name().into_string().unwrap());
    let is_ours = |name: &String| {
        let end = name.rsplit_once('.').map(|(_, end)| end);
        matches!(end, Some("task" | "json" | "result"))
    };
    names.find(|name| !is_ours(name))
}
