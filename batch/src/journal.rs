//! The journal: which task was done when, where and by which engine, as lines of JSON.
//!
//! Each machine appends to its own file, so that no two mix. A line cut by a loss of power is
//! skipped.

use std::env;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::key::{Key, Kind};
use crate::store::Store;

/// A line of the journal: how an attempt at a task ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// When it ended, in seconds since 1970.
    pub at: f64,
    /// The machine.
    pub host: String,
    /// The engine that started it.
    pub engine: String,
    /// The task.
    pub key: Key,
    /// Its kind.
    pub kind: Kind,
    /// The part or build that it was for.
    pub subject: String,
    /// The work, for people.
    pub label: String,
    /// The duration, in seconds.
    pub seconds: f64,
    /// The processor time, in seconds, where the system reports it.
    pub cpu_s: Option<f64>,
    /// The most memory that it held, in bytes, where the system reports it.
    pub memory: Option<u64>,
    /// Its exit status; `None` if a signal ended it.
    pub status: Option<i32>,
    /// Its last words, if it failed.
    pub why: Option<String>,
}

impl Event {
    /// Returns whether the task was done.
    pub fn is_done(&self) -> bool {
        self.status == Some(0)
    }
}

/// Appends events to the file of this machine.
pub struct Journal {
    file: File,
}

impl Journal {
    /// Opens the file of this machine.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn open(store: &Store) -> io::Result<Self> {
        let folder = folder(store);
        fs::create_dir_all(&folder)?;
        let path = folder.join(format!("{}.jsonl", host()));
        Ok(Self { file: OpenOptions::new().read(true).append(true).create(true).open(path)? })
    }

    /// Appends an event.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn append(&mut self, event: &Event) -> io::Result<()> {
        let mut line = serde_json::to_string(event).expect("events have text keys");
        line.push('\n');
        // Without a line break, a line that a loss of power cut would spoil this one, too.
        if self.ends_in_a_line_that_is_cut()? {
            line.insert(0, '\n');
        }
        // In one call, so that two processes do not mix their lines.
        self.file.write_all(line.as_bytes())
    }

    fn ends_in_a_line_that_is_cut(&mut self) -> io::Result<bool> {
        if self.file.seek(SeekFrom::End(0))? == 0 {
            return Ok(false);
        }
        self.file.seek(SeekFrom::End(-1))?;
        let mut last = [0];
        self.file.read_exact(&mut last)?;
        Ok(last != *b"\n")
    }
}

/// Returns all events of a store, in the order of their times.
///
/// # Errors
/// Returns an error if a file cannot be read.
pub fn events(store: &Store) -> io::Result<Vec<Event>> {
    let mut events: Vec<Event> = Vec::new();
    for path in files(&folder(store))? {
        let text = fs::read(path)?;
        let lines = text.split(|&byte| byte == b'\n');
        events.extend(lines.filter_map(|line| serde_json::from_slice(line).ok()));
    }
    events.sort_by(|a, b| a.at.total_cmp(&b.at));
    Ok(events)
}

fn folder(store: &Store) -> PathBuf {
    store.root().join("journal")
}

fn files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries?,
    };
    let mut files = entries.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<_>>>()?;
    files.retain(|path| path.extension().is_some_and(|end| end == "jsonl"));
    files.sort();
    Ok(files)
}

/// Returns the name of this machine, with only characters that file names may have.
pub fn host() -> String {
    let of_kernel = fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let of_shell = || env::var("HOSTNAME").or_else(|_| env::var("COMPUTERNAME")).ok();
    let name = of_kernel.or_else(of_shell).unwrap_or_default();
    let is_plain = |c: &char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    let name: String = name.trim().chars().take(60).filter(is_plain).collect();
    if name.is_empty() { "this-machine".to_owned() } else { name }
}

/// Returns the seconds since 1970.
pub fn now() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::key::TaskRecipe;

    #[test]
    fn a_line_that_was_cut_costs_itself_alone() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::create(&folder.path().join("store")).unwrap();
        assert_eq!(events(&store).unwrap(), []);
        let recipe = TaskRecipe { kind: Kind::Join, options: vec![], inputs: vec![], code: vec![] };
        let event = |at: f64| Event {
            at,
            host: host(),
            engine: "local".to_owned(),
            key: recipe.key(),
            kind: Kind::Join,
            subject: "blade \u{1b}\n".to_owned(),
            label: String::new(),
            seconds: 1.5,
            cpu_s: None,
            memory: Some(1 << 30),
            status: Some(0),
            why: None,
        };
        for at in [2.0, 1.0, 3.0] {
            Journal::open(&store).unwrap().append(&event(at)).unwrap();
        }
        let path = files(&super::folder(&store)).unwrap().remove(0);
        let text = fs::read(&path).unwrap();
        for cut in 1..60 {
            fs::write(&path, &text[..text.len() - cut]).unwrap();
            Journal::open(&store).unwrap().append(&event(4.0)).unwrap();
            let times: Vec<_> = events(&store).unwrap().iter().map(|event| event.at).collect();
            // The last line is whole, only its line break is missing.
            let whole = if cut == 1 { &[1.0, 2.0, 3.0, 4.0][..] } else { &[1.0, 2.0, 4.0] };
            assert_eq!(times, whole, "{cut}");
        }
    }
}
