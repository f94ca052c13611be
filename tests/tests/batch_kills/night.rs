//! A small night with all kinds of tasks, and what is to come of it.

use std::collections::{BTreeMap, HashMap};
use std::fs::{self, File};
use std::io::{Read, Seek};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::thread;
use std::time::{Duration, Instant};

use lamp_batch::{Event, Store, events};
use lamp_fixtures::{Defect, Sample, inject};
use lamp_tests::{Scratch, tilted_ball};
use serde_json::Value;

use super::processes::PATIENCE;

/// Three parts, one with stray rows, in five ranges, their joins and checks, and a build; and a part with a
/// plan of its gray levels.
const NIGHT: &str = r#"
[defaults]
stages = ["slice --dpi 100 --thickness 100um", "fix"]
ranges = 2

[[part]]
file = "*.stl"

[[part]]
file = "plain.stl"
ranges = 1

[[part]]
file = "more/planned.stl"
stages = ["slice --dpi 100 --thickness 500um", "plan voxels --material pegda-sudan --expose 2s", "dither"]

[[build]]
name = "all"
parts = ["ball:2", "plain", "cube"]
tile = "--settle --mesh none --area 100x100mm"
"#;

/// A folder with a night.
pub(crate) struct Night {
    pub(crate) scratch: Scratch,
}

/// The outcome of a night: its files, and the facts of its summary and of its report.
#[derive(PartialEq)]
pub(crate) struct Outcome {
    pub(crate) files: BTreeMap<PathBuf, Vec<u8>>,
    summary: Value,
    report: String,
}

/// A night at work, or one that has ended.
pub(crate) struct Running {
    pub(crate) child: Child,
    said: File,
    told: File,
}

/// How a night ended.
#[derive(Debug)]
pub(crate) struct Ended {
    /// Its status; none if a signal ended it.
    pub(crate) status: Option<i32>,
    pub(crate) signal: Option<i32>,
    pub(crate) stderr: String,
    /// The summary that `--notify` gets, if it came to that.
    pub(crate) summary: Option<Value>,
}

impl Night {
    pub(crate) fn new() -> Self {
        let scratch = Scratch::new();
        let mut ball = tilted_ball();
        inject(&mut ball, Defect::Drop, 3, 1);
        scratch.mesh("ball.stl", &ball);
        scratch.mesh("plain.stl", &tilted_ball());
        scratch.part("cube.stl", Sample::Cube, 64);
        fs::create_dir(scratch.path("more")).expect("a folder");
        scratch.part("more/planned.stl", Sample::Cube, 100);
        scratch.write("night.toml", NIGHT.as_bytes());
        Self { scratch }
    }

    pub(crate) fn store(&self) -> PathBuf {
        // As the store itself names it.
        fs::canonicalize(self.scratch.as_ref()).expect("it is there").join("lamp-store")
    }

    /// Removes all that nights have made.
    pub(crate) fn clear(&self) {
        for name in ["lamp-store", "night"] {
            let _ = fs::remove_dir_all(self.scratch.path(name));
        }
    }

    /// Returns the command that does the night.
    pub(crate) fn command(&self) -> Command {
        // `cat` gives the summary.
        self.scratch.command("lamp batch night.toml --jobs 2 --verbose --notify cat")
    }

    /// Starts the night, as the head of a group of processes.
    pub(crate) fn start(&self) -> Running {
        Running::start(self.command())
    }

    /// Does the night to its end.
    pub(crate) fn run(&self) -> Ended {
        self.start().wait()
    }

    /// Does the night, with success, and returns what came of it.
    pub(crate) fn done(&self) -> Outcome {
        let ended = self.run();
        assert_eq!(ended.status, Some(0), "{ended:?}");
        self.outcome(&ended)
    }

    /// Returns the outcome of a night that printed its summary.
    pub(crate) fn outcome(&self, ended: &Ended) -> Outcome {
        let files = self.files();
        let report = self.scratch.bytes("night/report.html");
        let summary = ended.summary.clone().expect("a night tells its summary");
        Outcome { files, summary, report: facts(&String::from_utf8(report).expect("text")) }
    }

    /// Returns what the night has delivered.
    pub(crate) fn files(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut files = files_in(&self.scratch.path("night"));
        files.remove(Path::new("report.html")).expect("there is a report");
        files
    }

    /// Returns all events of the journal.
    pub(crate) fn events(&self) -> Vec<Event> {
        let store = Store::open(&self.store()).expect("a store");
        events(&store).expect("a journal")
    }

    /// Returns how many tasks have been done; none if there is no store yet.
    pub(crate) fn count_done(&self) -> usize {
        let events = Store::open(&self.store()).ok().and_then(|store| events(&store).ok());
        events.map_or(0, |events| events.iter().filter(|event| event.is_done()).count())
    }

    /// Checks that no task was done again after it had been done. Two may have done one at the same
    /// time.
    pub(crate) fn check_nothing_done_twice(&self) {
        let mut done = HashMap::new();
        for event in self.events().into_iter().filter(Event::is_done) {
            let first = *done.entry(event.key).or_insert(event.at);
            let name = format!("{} ({})", event.subject, event.label);
            assert!(event.at - event.seconds <= first, "{name} was done again");
        }
    }

    /// Checks that there is nothing that no name belongs to.
    pub(crate) fn check_tidy(&self) {
        let is_known = |path: &Path| {
            let end = path.extension().and_then(|end| end.to_str()).unwrap_or_default();
            let folder = path.iter().next().and_then(|name| name.to_str());
            let is_hidden = path.file_name().is_some_and(|name| name.as_encoded_bytes()[0] == b'.');
            let ends: &[&str] = match folder {
                Some("tasks") => &["task", "json", "result"],
                Some("notes" | "batches") => &["json"],
                Some("journal") => &["jsonl"],
                Some("parts" | "builds") => &["lamp", "tif"],
                _ => {
                    return ["lamp-store", "digests.json", "report.html"]
                        .iter()
                        .any(|name| path == Path::new(name));
                }
            };
            !is_hidden && ends.contains(&end)
        };
        // A night that was ended early has delivered nothing.
        let made = |folder: &&str| self.scratch.path(folder).exists();
        for folder in ["lamp-store", "night"].into_iter().filter(made) {
            for path in files_in(&self.scratch.path(folder)).into_keys() {
                assert!(is_known(&path), "{folder}/{} is left over", path.display());
            }
        }
    }
}

impl Outcome {
    /// Checks that another outcome is the same.
    pub(crate) fn check(&self, found: &Self, what: &str) {
        let names = |outcome: &Self| outcome.files.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(found), names(self), "{what}");
        for (name, bytes) in &self.files {
            assert!(found.files[name] == *bytes, "{what}: {} has other bytes", name.display());
        }
        assert_eq!(found.summary, self.summary, "{what}: the summary");
        assert_eq!(found.report, self.report, "{what}: the report");
    }
}

impl Running {
    pub(crate) fn start(mut command: Command) -> Self {
        let [said, told] = [(); 2].map(|()| tempfile::tempfile().expect("a temporary file"));
        let copy = |file: &File| file.try_clone().expect("a file has many handles");
        command.stdout(copy(&told)).stderr(copy(&said)).process_group(0);
        Self { child: command.spawn().expect("lamp starts"), said, told }
    }

    /// Returns whether it still runs after a time.
    pub(crate) fn runs_for(&mut self, time: Duration) -> bool {
        let start = Instant::now();
        loop {
            if self.child.try_wait().expect("a child can be waited for").is_some() {
                return false;
            }
            let left = time.saturating_sub(start.elapsed());
            if left.is_zero() {
                return true;
            }
            thread::sleep(left.min(Duration::from_millis(2)));
        }
    }

    pub(crate) fn wait(mut self) -> Ended {
        assert!(!self.runs_for(PATIENCE), "the night hangs: {}", text(&mut self.said));
        let status = self.child.wait().expect("a child can be waited for");
        let told = text(&mut self.told);
        let summary = serde_json::from_str(told.trim()).ok();
        let stderr = text(&mut self.said);
        assert!(!stderr.contains("panicked"), "{stderr}");
        Ended { status: status.code(), signal: status.signal(), stderr, summary }
    }
}

impl Ended {
    /// Returns the number of tasks reported as killed.
    pub(crate) fn killed_tasks(&self) -> usize {
        self.stderr.lines().filter(|line| line.contains("was ended by signal 9")).count()
    }
}

fn text(file: &mut File) -> String {
    let mut text = String::new();
    file.rewind().and_then(|()| file.read_to_string(&mut text)).expect("text");
    text
}

/// Returns all files below a folder, by their names from there.
fn files_in(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(inner) = open.pop() {
        for entry in fs::read_dir(&inner).unwrap_or_else(|error| panic!("{inner:?}: {error}")) {
            let path = entry.expect("it can be listed").path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("it is in there").to_owned();
                files.insert(name, fs::read(&path).expect("a file"));
            }
        }
    }
    files
}

/// Returns what a report says without times and memory: those are columns 7 to 9 of its tables, and
/// the charts at its end.
fn facts(html: &str) -> String {
    let (html, _) = html.split_once("<h2>Tasks over time").expect("a chapter of charts");
    let row = |row: &str| {
        let cells = row.split("<td").enumerate();
        let cells = cells.filter(|(column, _)| !(7..10).contains(column)).map(|(_, cell)| cell);
        cells.collect::<Vec<_>>().join("<td")
    };
    html.split("<tr>").map(row).collect::<Vec<_>>().join("<tr>")
}
