//! Tasks by Slurm: an array for the ranges of a part, and jobs that depend on it.
//!
//! `SBATCH_PARTITION`, `SBATCH_ACCOUNT` and the other variables that `sbatch` reads set the
//! partition, the account and the like.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use super::rounds::{RoundTask, Scheduler, SchedulerError, answer_of, not_understood};
use lamp_stack::quoted;

use crate::key::Kind;
use crate::store::Store;

const SBATCH: &str = "sbatch";
/// Slurm's arrays have at most 1001 tasks, unless its configuration says otherwise.
const MOST_IN_ARRAY: usize = 1000;

/// The cluster that `sbatch` knows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slurm;

/// Tasks of one kind that need the same, by their places in the round.
struct Array {
    tasks: Vec<usize>,
    /// The arrays that it needs.
    needs: Vec<usize>,
}

/// Puts a round into arrays, each after the arrays that it needs.
fn arrays(round: &[RoundTask]) -> Vec<Array> {
    let mut arrays: Vec<Array> = Vec::new();
    let mut array_of: Vec<usize> = Vec::new();
    let mut open: HashMap<(Kind, &str, Vec<usize>), usize> = HashMap::new();
    for (place, task) in round.iter().enumerate() {
        let mut needs: Vec<usize> = task.needs.iter().map(|&need| array_of[need]).collect();
        needs.sort_unstable();
        needs.dedup();
        let like = (task.kind, task.subject.as_str(), needs.clone());
        let array = match open.get(&like) {
            Some(&array) if arrays[array].tasks.len() < MOST_IN_ARRAY => array,
            _ => {
                arrays.push(Array { tasks: Vec::new(), needs });
                open.insert(like, arrays.len() - 1);
                arrays.len() - 1
            }
        };
        arrays[array].tasks.push(place);
        array_of.push(array);
    }
    arrays
}

/// Returns the script of an array: each of its tasks does its own.
fn script(array: &Array, round: &[RoundTask]) -> String {
    let mut script = "#!/bin/sh\ncase $SLURM_ARRAY_TASK_ID in\n".to_owned();
    for (number, &place) in array.tasks.iter().enumerate() {
        let words = round[place].command.iter().map(|word| quoted(word));
        script += &format!("{number}) exec {};;\n", words.collect::<Vec<_>>().join(" "));
    }
    script + "esac\n"
}

/// Returns the words for `sbatch` that state the resources of an array.
fn limits(array: &Array, round: &[RoundTask]) -> [String; 2] {
    let costs = || array.tasks.iter().map(|&place| round[place].cost);
    let memory = costs().map(|cost| cost.memory).max().unwrap_or(0);
    let seconds = costs().map(|cost| cost.cpu_s).fold(0.0, f64::max);
    // Slurm ends tasks that exceed their limits, so there is room for low estimates.
    let mebibytes = (memory + memory / 2).div_ceil(1 << 20) + 128;
    let minutes = (5.0 * seconds / 60.0).ceil() as u64 + 10;
    [format!("--mem={mebibytes}M"), format!("--time={minutes}")]
}

/// Returns a name that no other round has.
fn name() -> String {
    static ROUNDS: AtomicU32 = AtomicU32::new(0);
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let round = ROUNDS.fetch_add(1, Ordering::Relaxed);
    format!("lamp-{:x}-{:x}-{round}", since.as_millis(), std::process::id())
}

impl Scheduler for Slurm {
    /// The name that all jobs of a round have.
    type Job = String;

    const NAME: &'static str = "slurm";

    fn submit(&self, round: &[RoundTask], store: &Store) -> Result<String, SchedulerError> {
        let name = name();
        let mut ids: Vec<u64> = Vec::new();
        for array in arrays(round) {
            let id = submit_array(&array, round, store, &name, &ids);
            // Otherwise half a round would be done twice.
            let id = id.inspect_err(|_| drop(self.cancel(&name)))?;
            ids.push(id);
        }
        Ok(name)
    }

    fn is_at_work(&self, job: &String) -> Result<bool, SchedulerError> {
        let name = format!("--name={job}");
        let answer = answer_of("squeue", &["--noheader", "--format=%i", &name], None)?;
        Ok(!answer.trim().is_empty())
    }

    fn cancel(&self, job: &String) -> Result<(), SchedulerError> {
        answer_of("scancel", &[&format!("--name={job}")], None).map(drop)
    }
}

/// Submits an array, given the numbers of earlier arrays. Returns its number.
fn submit_array(
    array: &Array,
    round: &[RoundTask],
    store: &Store,
    name: &str,
    ids: &[u64],
) -> Result<u64, SchedulerError> {
    let needs: Vec<String> = array.needs.iter().map(|&need| ids[need].to_string()).collect();
    let [memory, time] = limits(array, round);
    let mut words = vec![
        "--parsable".to_owned(),
        format!("--job-name={name}"),
        format!("--comment={}", round[array.tasks[0]].subject),
        format!("--array=0-{}", array.tasks.len() - 1),
        format!("--chdir={}", store.root().display()),
        "--cpus-per-task=1".to_owned(),
        memory,
        time,
        "--requeue".to_owned(),
        // Jobs behind a failed one would otherwise stay in the queue forever.
        "--kill-on-invalid-dep=yes".to_owned(),
        // Last words are in the journal.
        "--output=/dev/null".to_owned(),
    ];
    if !needs.is_empty() {
        words.push(format!("--dependency=afterok:{}", needs.join(":")));
    }
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let answer = answer_of(SBATCH, &words, Some(&script(array, round)))?;
    // A cluster of several has its name behind the number.
    let id = answer.trim().split(';').next().unwrap_or_default().parse();
    id.map_err(|_| not_understood(SBATCH, &answer))
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::*;
    use crate::engine::rounds::testing::round;

    #[test]
    fn ranges_of_a_part_are_an_array_that_others_wait_for() {
        let arrays = arrays(&round());
        let tasks: Vec<_> = arrays.iter().map(|array| array.tasks.clone()).collect();
        assert_eq!(tasks, [vec![0, 1], vec![2], vec![3]]);
        let needs: Vec<_> = arrays.iter().map(|array| array.needs.clone()).collect();
        assert_eq!(needs, [vec![], vec![0], vec![1]]);
        assert_eq!(limits(&arrays[0], &round()), ["--mem=558M", "--time=18"]);
    }

    #[test]
    fn an_array_is_never_larger_than_slurm_takes() {
        let round = vec![round()[0].clone(); 2 * MOST_IN_ARRAY + 1];
        let sizes: Vec<_> = arrays(&round).iter().map(|array| array.tasks.len()).collect();
        assert_eq!(sizes, [MOST_IN_ARRAY, MOST_IN_ARRAY, 1]);
    }

    #[test]
    fn each_task_of_an_array_does_its_own() {
        let mut round = round();
        for (task, word) in round.iter_mut().zip(["it's", "a b $HOME"]) {
            task.command = vec!["echo".to_owned(), word.to_owned()];
        }
        let script = script(&arrays(&round)[0], &round);
        for (number, said) in [("0", "it's\n"), ("1", "a b $HOME\n")] {
            let mut shell = Command::new("sh");
            shell.args(["-c", &script]).env("SLURM_ARRAY_TASK_ID", number);
            assert_eq!(shell.output().unwrap().stdout, said.as_bytes());
        }
    }
}
