//! Processes as the kernel reports them.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

/// More than any night here takes, and a hang.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// Returns the tasks of a store that are at work, all or only tasks with a key.
pub(crate) fn tasks(store: &Path, key: Option<&str>) -> Vec<u32> {
    let words: Vec<String> =
        [store.to_str(), key].into_iter().flatten().map(str::to_owned).collect();
    let entries = fs::read_dir("/proc").expect("Linux has /proc").flatten();
    let numbers = entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    numbers.filter(|&id| has_words(id, &words) && is_at_work(id)).collect()
}

fn has_words(id: u32, words: &[String]) -> bool {
    let line = fs::read(format!("/proc/{id}/cmdline")).unwrap_or_default();
    let of_line: Vec<&[u8]> = line.split(|&byte| byte == 0).collect();
    words.iter().all(|word| of_line.contains(&word.as_bytes()))
}

/// Returns whether a process is there, and not one that has ended and is not yet waited for.
fn is_at_work(id: u32) -> bool {
    let stat = fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    let state = stat.rsplit_once(") ").and_then(|(_, rest)| rest.chars().next());
    !matches!(state, None | Some('Z' | 'X'))
}

/// Sends a signal to a process, or to a group of them, which has a minus before its number.
/// Returns whether there was one.
pub(crate) fn send(signal: &str, to: &str) -> bool {
    let kill = Command::new("kill").args(["-s", signal, "--", to]).output();
    kill.expect("there is kill").status.success()
}

/// Waits until no task of a store is at work.
pub(crate) fn wait_for_no_task(store: &Path) {
    let start = Instant::now();
    while !tasks(store, None).is_empty() {
        assert!(start.elapsed() < PATIENCE, "tasks go on without the night that started them");
        thread::sleep(Duration::from_millis(2));
    }
}
