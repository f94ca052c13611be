//! Tasks by HyperQueue, on one's own machines or inside allocations of a cluster.
//!
//! A round is one job, written as a job file. HyperQueue handles workers that die: it starts their
//! tasks elsewhere. A task whose process dies counts as failed there, and goes into the next round.

use std::collections::BTreeMap;
use std::io::Write;

use serde::Serialize;
use serde_json::Value;

use super::rounds::{RoundTask, Scheduler, SchedulerError, answer_of, not_understood};
use crate::store::Store;

const HQ: &str = "hq";
/// The number of workers that a task may lose before it counts as failed.
const CRASH_LIMIT: u32 = 5;

/// A HyperQueue server, as `hq` finds it: by `HQ_SERVER_DIR`, or in the home folder.
#[derive(Clone, Copy, Debug)]
pub(super) struct HyperQueue;

#[derive(Serialize)]
struct HyperQueueJob {
    name: &'static str,
    task: Vec<JobTask>,
}

#[derive(Serialize)]
struct JobTask {
    id: usize,
    command: Vec<String>,
    deps: Vec<usize>,
    cwd: String,
    stdout: &'static str,
    stderr: &'static str,
    crash_limit: u32,
    request: [Request; 1],
}

#[derive(Serialize)]
struct Request {
    resources: BTreeMap<&'static str, u64>,
}

/// Returns a round as a job file.
fn job_file(round: &[RoundTask], store: &Store) -> String {
    let cwd = store.root().display().to_string();
    let entry = |(id, task): (usize, &RoundTask)| {
        // HyperQueue counts memory in MB, and refuses a request of 0.
        let megabytes = task.cost.memory.div_ceil(1_000_000).max(1);
        JobTask {
            id,
            command: task.command.clone(),
            deps: task.needs.clone(),
            cwd: cwd.clone(),
            // Last words are in the journal.
            stdout: "none",
            stderr: "none",
            crash_limit: CRASH_LIMIT,
            request: [Request { resources: BTreeMap::from([("cpus", 1), ("mem", megabytes)]) }],
        }
    };
    let task = round.iter().enumerate().map(entry).collect();
    toml::to_string(&HyperQueueJob { name: "lamp", task }).expect("job files are tables of texts")
}

impl Scheduler for HyperQueue {
    type Job = u64;

    const NAME: &'static str = "hyperqueue";

    fn submit(&self, round: &[RoundTask], store: &Store) -> Result<u64, SchedulerError> {
        let failed = |source| SchedulerError::JobFile { source };
        let mut file = tempfile::Builder::new().suffix(".toml").tempfile().map_err(failed)?;
        file.write_all(job_file(round, store).as_bytes()).map_err(failed)?;
        let path = file.path().display().to_string();
        let answer = answer_of(HQ, &["job", "submit-file", &path, "--output-mode", "json"], None)?;
        let id = json(&answer)?["id"].as_u64();
        id.ok_or_else(|| not_understood(HQ, &answer))
    }

    fn is_at_work(&self, job: &u64) -> Result<bool, SchedulerError> {
        let id = job.to_string();
        let answer = answer_of(HQ, &["job", "info", &id, "--output-mode", "json"], None)?;
        let jobs = json(&answer)?;
        let jobs = jobs.as_array().ok_or_else(|| not_understood(HQ, &answer))?;
        // A server that was restarted without its journal knows no job.
        let Some(job) = jobs.first() else { return Ok(false) };
        let counts = &job["info"]["task_stats"];
        let count = |state: &str| counts[state].as_u64();
        match (count("waiting"), count("running")) {
            (Some(waiting), Some(running)) => Ok(waiting + running > 0),
            _ => Err(not_understood(HQ, &answer)),
        }
    }

    fn cancel(&self, job: &u64) -> Result<(), SchedulerError> {
        answer_of(HQ, &["job", "cancel", &job.to_string()], None).map(drop)
    }
}

fn json(answer: &str) -> Result<Value, SchedulerError> {
    serde_json::from_str(answer).map_err(|_| not_understood(HQ, answer))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::rounds::testing::round;

    #[test]
    fn a_job_file_has_what_tasks_need_and_take() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::create(&folder.path().join("store")).unwrap();
        let file: toml::Table = job_file(&round(), &store).parse().unwrap();
        let tasks = file["task"].as_array().unwrap();
        assert_eq!(tasks.len(), 4);
        let join = &tasks[2];
        assert_eq!(join["id"].as_integer(), Some(2));
        assert_eq!(join["deps"], toml::Value::from(vec![0, 1]));
        assert_eq!(join["command"][0].as_str(), Some("/opt/my lamp"));
        let resources = &join["request"][0]["resources"];
        assert_eq!(resources["cpus"].as_integer(), Some(1));
        assert_eq!(resources["mem"].as_integer(), Some(300));
    }
}
