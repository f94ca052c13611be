//! A task: it takes a moment, and makes bytes from the results that it needs.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, exit};
use std::thread;
use std::time::{Duration, Instant};

use lamp_batch::{Event, Journal, Key, Manifest, Store, host, now, status};
use serde::{Deserialize, Serialize};

/// The fault of a task, if it has one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Fault {
    None,
    /// It is killed, the first time.
    Killed,
    /// Its input is bad.
    BadInput,
}

/// How a task is done.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Work {
    pub(crate) fault: Fault,
    pub(crate) seconds: f64,
}

/// The last words of a task with bad input.
pub(crate) const NO_PART: &str = "there is no such part";

pub(crate) fn run(key: Key, store: &Path, engine: &str) -> ! {
    let started = Instant::now();
    let store = Store::open(store).unwrap();
    if store.manifest(key).is_some() {
        exit(status::DONE);
    }
    let task = store.task(key).unwrap();
    let work: Work = serde_json::from_value(task.work).unwrap();
    thread::sleep(Duration::from_secs_f64(work.seconds));
    let result = store.begin(key).unwrap();
    let been_here = store.root().parent().unwrap().join("killed once");
    if work.fault == Fault::Killed && !been_here.exists() {
        fs::write(been_here, "").unwrap();
        let me = std::process::id().to_string();
        Command::new("kill").args(["-9", &me]).status().unwrap();
    }
    let bad = work.fault == Fault::BadInput;
    if !bad {
        let needed = task.needs.iter().map(|&need| fs::read(store.result(need)).unwrap());
        let bytes: Vec<u8> = needed.flatten().chain(key.to_string().into_bytes()).collect();
        result.file().write_all(&bytes).unwrap();
        let written = Some(result.finish().unwrap());
        let recipe = task.recipe.clone();
        store.publish(&Manifest { recipe, result: written, facts: Default::default() }).unwrap();
    }
    if bad {
        eprintln!("{NO_PART}");
    }
    let status = if bad { status::BAD_INPUT } else { status::DONE };
    let event = Event {
        at: now(),
        host: host(),
        engine: engine.to_owned(),
        key,
        kind: task.recipe.kind,
        subject: task.subject,
        label: task.label,
        seconds: started.elapsed().as_secs_f64(),
        cpu_s: None,
        memory: None,
        status: Some(status),
        why: bad.then(|| NO_PART.to_owned()),
    };
    Journal::open(&store).unwrap().append(&event).unwrap();
    exit(status)
}
