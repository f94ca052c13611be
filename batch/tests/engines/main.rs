//! Engines at work on small tasks, with whatever kills them: the same bytes, nothing done twice.
//!
//! This program has three parts to play: `batch task` is a task as `lamp` does it, but small;
//! `coordinate` is a night; without these words it is the test, of one engine or all. `--list` prints
//! their names, as libtest does for `cargo nextest`. Slurm and HyperQueue are the real
//! ones. Where they are not installed, it says so.

mod hyperqueue;
mod night;
mod running;
mod slurm;
mod task;

use std::env;
use std::fs::OpenOptions;
use std::io::Write;
use std::iter;
use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use night::Night;
use running::Running;

const ENGINES: [&str; 3] = ["local", "slurm", "hyperqueue"];

fn main() {
    let words: Vec<String> = env::args().collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        [_, "batch", "task", key, "--store", store, "--engine", engine, ..] => {
            task::run(key.parse().unwrap(), Path::new(store), engine)
        }
        [_, "coordinate", store, engine, seconds] => {
            night::coordinate(Path::new(store), engine, seconds.parse().unwrap());
        }
        [_, "in", engine, folder] => in_engine(engine, Path::new(folder)),
        [_, .., "--ignored"] if words.contains(&"--list") => {}
        _ if words.contains(&"--list") => ENGINES.iter().for_each(|name| println!("{name}: test")),
        _ => tests(words.get(1).copied().unwrap_or_default()),
    }
}

/// Tests all engines whose names have a word.
fn tests(word: &str) {
    let filter = if word.starts_with("--") { "" } else { word };
    let program = env::current_exe().unwrap();
    for engine in ENGINES.iter().filter(|name| name.contains(filter)) {
        let folder = tempfile::tempdir().unwrap();
        let bin = folder.path().join("bin");
        let before = env::var_os("PATH").unwrap();
        let path = env::join_paths(iter::once(bin).chain(env::split_paths(&before))).unwrap();
        // In a process of its own, all that it starts finds the scheduler.
        let status = Command::new(&program)
            .args(["in", engine])
            .arg(folder.path())
            .env("PATH", path)
            .env("SLURM_CONF", folder.path().join("slurm.conf"))
            .env("HQ_SERVER_DIR", folder.path().join("hq"))
            .status();
        assert!(status.unwrap().success(), "{engine}");
    }
}

fn in_engine(engine: &str, folder: &Path) {
    match engine {
        "slurm" => match slurm::Slurm::start(folder) {
            Ok(mut slurm) => scenarios(engine, Some(&mut slurm)),
            Err(why) => skipped("Slurm", &why),
        },
        "hyperqueue" => match hyperqueue::HyperQueue::start(folder) {
            Ok(mut hq) => scenarios(engine, Some(&mut hq)),
            Err(why) => skipped("HyperQueue", &why),
        },
        _ => scenarios(engine, None),
    }
}

/// Says that an engine was not tried, also in the summary of `.ci/run`.
fn skipped(engine: &str, why: &str) {
    let line = format!("the engine {engine} was not tried: {why}");
    println!("{line}");
    if let Some(path) = env::var_os("LAMP_NOTES") {
        let mut notes = OpenOptions::new().append(true).create(true).open(path).unwrap();
        writeln!(notes, "{line}").unwrap();
    }
}

fn scenarios(engine: &str, running: Option<&mut dyn Running>) {
    let folder = tempfile::tempdir().unwrap();
    let wanted = Night::new(folder.path(), "wanted").done("local");
    let night = |name: &str| {
        println!("{engine}: {name}");
        Night::new(folder.path(), name)
    };
    assert_eq!(night("undisturbed").done(engine), wanted);
    assert_eq!(night("a task is killed").with_killed_task().done(engine), wanted);
    night("a task finds bad input").with_bad_input().loses_one_part(engine);

    let coordinated = night("the coordinator is killed");
    let mut coordinator = coordinated.coordinate(engine);
    coordinated.wait_for_results(3);
    coordinator.kill().unwrap();
    coordinator.wait().unwrap();
    thread::sleep(Duration::from_millis(100));
    assert_eq!(coordinated.done(engine), wanted);

    let Some(running) = running else { return };
    for part in running.parts() {
        let night = night(&format!("{part} is killed"));
        let mut coordinator = night.coordinate(engine);
        night.wait_for_results(2);
        running.kill(part);
        let start = Instant::now();
        let status = loop {
            if let Some(status) = coordinator.try_wait().unwrap() {
                break status;
            }
            if start.elapsed() > Duration::from_secs(600) {
                println!("{}", running.state());
                coordinator.kill().unwrap();
            }
            running.mend();
            thread::sleep(Duration::from_secs(1));
        };
        assert!(status.success(), "{engine} goes on without {part}");
        assert_eq!(night.done(engine), wanted);
    }
}
