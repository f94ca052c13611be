//! Tasks as child processes: a crash ends only its own task.

use std::collections::{HashMap, HashSet};
use std::process::Command;
use std::sync::mpsc::{Receiver, Sender, channel};

use super::process::start;
use super::{Attempt, EngineError, Work};
use crate::key::Key;
use crate::ledger::{End, Ledger};
use crate::task::Graph;

/// Child processes on this machine.
#[derive(Clone, Debug)]
pub struct Local {
    /// How many threads work at once, in all processes together.
    pub jobs: usize,
    /// The bytes of memory that tasks may take together, by their estimates. A task that takes more
    /// runs alone.
    pub memory: u64,
}

/// Threads and memory of a running task.
#[derive(Clone, Copy)]
struct ResourceShare {
    threads: usize,
    memory: u64,
}

impl Local {
    pub(super) fn run(
        &self,
        work: &Work<'_>,
        ledger: &mut Ledger<'_>,
        tell: &mut dyn FnMut(&Attempt),
    ) -> Result<(), EngineError> {
        let (sender, ends): (Sender<(Key, End)>, Receiver<_>) = channel();
        let mut running: HashMap<Key, ResourceShare> = HashMap::new();
        loop {
            let ready = ledger.ready();
            for (at, &key) in ready.iter().enumerate() {
                let memory = work.graph.task(key).cost.memory;
                // No later task overtakes: small ones could keep a large one waiting for long.
                let Some(threads) = self.threads(&running, memory, ready.len() - at) else {
                    break;
                };
                if let Err(error) = work.store.write_task(work.graph.task(key)) {
                    // A full disk ends the run in order: running tasks may still finish.
                    let Some(why) = error.no_room() else { return Err(error.into()) };
                    let end = End::NoRoom(why);
                    let again = ledger.end(key, end.clone());
                    tell(&Attempt { key, end, again });
                    break;
                }
                let mut command = Command::new(&work.launcher.program);
                command.args(work.launcher.words(key, work.store, "local", threads));
                command.args(["--parent", &std::process::id().to_string()]);
                start(command, key, sender.clone()).map_err(EngineError::Start)?;
                ledger.start(key);
                running.insert(key, ResourceShare { threads, memory });
            }
            if running.is_empty() {
                return Ok(());
            }
            let (key, end) = ends.recv().expect("the sender is here, too");
            running.remove(&key);
            let again = ledger.end(key, end.clone());
            tell(&Attempt { key, end, again });
        }
    }

    /// Returns the seconds in which tasks of a graph are done, if each takes `seconds` with a number of
    /// threads. `keys` are the tasks to do, each after the tasks that it needs.
    pub(crate) fn duration(
        &self,
        graph: &Graph,
        keys: &[Key],
        seconds: impl Fn(Key, usize) -> f64,
    ) -> f64 {
        let mut waiting = keys.to_vec();
        let mut open: HashSet<Key> = keys.iter().copied().collect();
        let mut running: HashMap<Key, ResourceShare> = HashMap::new();
        let mut ends: Vec<(f64, Key)> = Vec::new();
        let mut now = 0.0;
        loop {
            let is_ready =
                |key: &Key| graph.task(*key).needs.iter().all(|need| !open.contains(need));
            let ready: Vec<Key> = waiting.iter().copied().filter(is_ready).collect();
            for (at, &key) in ready.iter().enumerate() {
                let memory = graph.task(key).cost.memory;
                let Some(threads) = self.threads(&running, memory, ready.len() - at) else { break };
                running.insert(key, ResourceShare { threads, memory });
                ends.push((now + seconds(key, threads), key));
                waiting.retain(|waiting| *waiting != key);
            }
            let next = ends.iter().enumerate().min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0));
            let Some((place, _)) = next else { return now };
            let (end, key) = ends.swap_remove(place);
            now = end;
            running.remove(&key);
            open.remove(&key);
        }
    }

    /// Returns the number of threads of the next task, if there is room for it: its share of the
    /// free threads, given the number of tasks that are ready.
    fn threads(
        &self,
        running: &HashMap<Key, ResourceShare>,
        memory: u64,
        ready: usize,
    ) -> Option<usize> {
        let taken: usize = running.values().map(|share| share.threads).sum();
        let held: u64 = running.values().map(|share| share.memory).sum();
        let free = self.jobs.saturating_sub(taken);
        let fits = running.is_empty() || held.saturating_add(memory) <= self.memory;
        (free > 0 && fits).then(|| (free / ready).max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::key::Kind;
    use crate::task::tests::task;

    #[test]
    fn threads_are_shared_among_what_is_ready() {
        let local = Local { jobs: 8, memory: 100 };
        let keys: Vec<Key> =
            (0..8).map(|k| task(&k.to_string(), Kind::Range, &[]).recipe.key()).collect();
        let mut running = HashMap::new();
        assert_eq!(local.threads(&running, 1000, 1), Some(8), "a large task runs alone");
        assert_eq!(local.threads(&running, 10, 3), Some(2));
        assert_eq!(local.threads(&running, 10, 100), Some(1));
        running.insert(keys[0], ResourceShare { threads: 7, memory: 60 });
        assert_eq!(local.threads(&running, 40, 1), Some(1));
        assert_eq!(local.threads(&running, 41, 1), None);
        running.insert(keys[1], ResourceShare { threads: 1, memory: 0 });
        assert_eq!(local.threads(&running, 0, 1), None);
    }

    #[test]
    fn a_duration_is_that_of_the_order_in_which_tasks_run() {
        let mut graph = Graph::default();
        let [a, b, c] = ["a", "b", "c"].map(|name| graph.add(task(name, Kind::Range, &[])));
        let join = graph.add(task("join", Kind::Join, &[a, b]));
        let local = |jobs| Local { jobs, memory: 100 };
        let length = |key: Key| if key == a { 4.0 } else { 1.0 };
        // One after another, whatever the order; with two, b and c run beside a, and the join behind.
        for (jobs, wanted) in [(1, 7.0), (2, 5.0), (3, 5.0)] {
            let found = local(jobs).duration(&graph, graph.keys(), |key, _| length(key));
            assert_eq!(found, wanted, "{jobs}");
        }
        // Threads that share a task's work: all of it is 7 s of processors.
        let shared = |key: Key, threads: usize| length(key) / threads as f64;
        assert_eq!(local(1).duration(&graph, graph.keys(), shared), 7.0);
        // c with both threads would be shorter: they have one each, and the join has two.
        assert_eq!(local(2).duration(&graph, graph.keys(), shared), 4.5);
        // Finished tasks need no time, and memory keeps tasks apart.
        assert_eq!(local(2).duration(&graph, &[c, join], |key, _| length(key)), 1.0);
        let tight = Local { jobs: 4, memory: 1 };
        assert_eq!(tight.duration(&graph, graph.keys(), |key, _| length(key)), 7.0);
        assert_eq!(tight.duration(&graph, &[], |_, _| 1.0), 0.0);
    }
}
