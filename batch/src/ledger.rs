//! The state of each task of a run.

use std::collections::{HashMap, HashSet};

use crate::key::Key;
use crate::store::Store;
use crate::task::Graph;

/// How an attempt at a task ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// Its result is in the store.
    Done,
    /// Its input or its options are at fault: another attempt would end alike.
    Bad(String),
    /// It could not read or write: another attempt may succeed.
    Failed(String),
    /// Its process was ended before it could write to the journal: another attempt may succeed.
    Crashed(String),
    /// The disk is full.
    NoRoom(String),
    /// A result that it needs was damaged and is gone: it must be made again first.
    Damaged(String),
}

/// The state of a task.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum State {
    /// It waits for others, or for its turn.
    Waiting,
    /// It is being done.
    Running,
    /// Its result is in the store.
    Done,
    /// It failed for good: its last words.
    Failed(String),
    /// It is not done because a task that it needs failed.
    Skipped,
}

/// The states of all tasks to do for the goals of a batch.
pub struct Ledger<'a> {
    graph: &'a Graph,
    store: &'a Store,
    goals: Vec<Key>,
    states: HashMap<Key, State>,
    failures: HashMap<Key, u32>,
    /// The number of retries of a task.
    retries: u32,
    no_room: Option<String>,
}

impl<'a> Ledger<'a> {
    /// Starts with all tasks that are missing for the goals.
    pub fn new(graph: &'a Graph, store: &'a Store, goals: &[Key], retries: u32) -> Self {
        let mut ledger = Self {
            graph,
            store,
            goals: goals.to_vec(),
            states: HashMap::new(),
            failures: HashMap::new(),
            retries,
            no_room: None,
        };
        ledger.add_missing();
        ledger
    }

    /// Adds tasks whose results are missing, now.
    fn add_missing(&mut self) {
        let missing = self.graph.missing(&self.goals, |key| match self.states.get(&key) {
            // A damaged result may have been taken away since: the store is asked again.
            Some(State::Done) | None => self.store.manifest(key).is_some(),
            // Nothing below a failed task is worth making for it.
            Some(State::Failed(_) | State::Skipped) => true,
            Some(State::Waiting | State::Running) => false,
        });
        for key in missing {
            let state = self.states.entry(key).or_insert(State::Waiting);
            if *state == State::Done {
                *state = State::Waiting;
            }
        }
    }

    /// Returns the tasks of this run, each after the tasks that it needs.
    pub fn keys(&self) -> Vec<Key> {
        let keys = self.graph.keys().iter().copied();
        keys.filter(|key| self.states.contains_key(key)).collect()
    }

    /// Returns the state of a task; a task that was done before the run is done.
    pub fn state(&self, key: Key) -> State {
        self.states.get(&key).cloned().unwrap_or(State::Done)
    }

    /// Returns the tasks that can be started now, in order.
    pub fn ready(&self) -> Vec<Key> {
        if self.no_room.is_some() {
            return Vec::new();
        }
        let is_ready = |key: &Key| {
            self.states[key] == State::Waiting
                && self.graph.task(*key).needs.iter().all(|need| self.state(*need) == State::Done)
        };
        self.keys().into_iter().filter(is_ready).collect()
    }

    /// Records that a task is being done.
    pub fn start(&mut self, key: Key) {
        self.states.insert(key, State::Running);
    }

    /// Records the end of an attempt at a task. Returns whether it is to be tried again.
    pub fn end(&mut self, key: Key, end: End) -> bool {
        let (state, is_counted) = match end {
            // An exit status alone proves nothing: a result counts once its manifest is there.
            End::Done if self.store.manifest(key).is_some() => (State::Done, false),
            End::Done => (State::Failed("it ended without a result".to_owned()), true),
            // The same input would fail again, so it is not retried.
            End::Bad(why) => (State::Failed(why), false),
            End::Failed(why) | End::Crashed(why) | End::Damaged(why) => (State::Failed(why), true),
            // A full disk is no fault of the task: it waits for the next run.
            End::NoRoom(why) => {
                self.no_room = Some(why);
                (State::Waiting, false)
            }
        };
        if is_counted {
            let failures = self.failures.entry(key).or_default();
            *failures += 1;
            if *failures <= self.retries {
                self.states.insert(key, State::Waiting);
                // It may have failed because a result that it needs was damaged and taken away.
                self.add_missing();
                return true;
            }
        }
        let is_failed = matches!(state, State::Failed(_));
        self.states.insert(key, state);
        if is_failed {
            self.skip();
        }
        false
    }

    /// Sets aside tasks that cannot be done any more, and tasks that have become useless.
    fn skip(&mut self) {
        // Keys come after the keys that they need, so one pass reaches all tasks above a failed
        // one.
        for key in self.keys() {
            let is_lost =
                |need: &Key| matches!(self.state(*need), State::Failed(_) | State::Skipped);
            if self.states[&key] == State::Waiting && self.graph.task(key).needs.iter().any(is_lost)
            {
                self.states.insert(key, State::Skipped);
            }
        }
        // A task whose users are all skipped would make a result that nothing reads.
        let wanted: HashSet<Key> = self
            .graph
            .missing(&self.goals, |key| {
                matches!(self.state(key), State::Done | State::Failed(_) | State::Skipped)
            })
            .into_iter()
            .collect();
        let is_idle = |key: &Key| self.states[key] == State::Waiting && !wanted.contains(key);
        for key in self.keys().into_iter().filter(is_idle).collect::<Vec<_>>() {
            self.states.insert(key, State::Skipped);
        }
    }

    /// Returns the reason why no task is started any more, if the disk is full.
    pub fn no_room(&self) -> Option<&str> {
        self.no_room.as_deref()
    }

    /// Returns the last words of a failed task that a task needs, or its own.
    pub fn why(&self, key: Key) -> Option<&str> {
        if let Some(State::Failed(why)) = self.states.get(&key) {
            return Some(why);
        }
        self.graph.task(key).needs.iter().find_map(|need| self.why(*need))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::key::Kind;
    use crate::store::{Facts, Manifest};
    use crate::task::tests::task;

    struct Batch {
        _folder: tempfile::TempDir,
        store: Store,
        graph: Graph,
    }

    impl Batch {
        /// Two parts of two ranges, and a build of both.
        fn new() -> (Self, [Key; 7]) {
            let folder = tempfile::tempdir().unwrap();
            let store = Store::create(&folder.path().join("store")).unwrap();
            let mut graph = Graph::default();
            let [a, b, c, d] =
                ["a", "b", "c", "d"].map(|name| graph.add(task(name, Kind::Range, &[])));
            let low = graph.add(task("low", Kind::Join, &[a, b]));
            let high = graph.add(task("high", Kind::Join, &[c, d]));
            let build = graph.add(task("build", Kind::Tile, &[low, high]));
            (Self { _folder: folder, store, graph }, [a, b, c, d, low, high, build])
        }

        fn publish(&self, key: Key) {
            let recipe = self.graph.task(key).recipe.clone();
            let manifest = Manifest { recipe, result: None, facts: Facts::default() };
            self.store.publish(&manifest).unwrap();
        }
    }

    #[test]
    fn tasks_follow_what_they_need_to_the_end() {
        let (batch, [a, b, c, d, low, high, build]) = Batch::new();
        batch.publish(b);
        let mut ledger = Ledger::new(&batch.graph, &batch.store, &[low, high, build], 2);
        assert_eq!(ledger.ready(), [a, c, d]);
        for key in [a, c, d, low, high, build] {
            assert!(ledger.ready().contains(&key));
            ledger.start(key);
            assert!(!ledger.ready().contains(&key));
            batch.publish(key);
            assert!(!ledger.end(key, End::Done));
        }
        assert_eq!((ledger.ready(), ledger.state(build)), (vec![], State::Done));
        let again = Ledger::new(&batch.graph, &batch.store, &[low, high, build], 2);
        assert_eq!(again.keys(), []);
    }

    #[test]
    fn what_fails_takes_its_dependents_with_it_and_nothing_else() {
        let (batch, [a, b, c, d, low, high, build]) = Batch::new();
        let mut ledger = Ledger::new(&batch.graph, &batch.store, &[low, high, build], 1);
        ledger.start(a);
        assert!(ledger.end(a, End::Failed("crash".to_owned())));
        assert_eq!(ledger.ready(), [a, b, c, d]);
        assert!(!ledger.end(a, End::Failed("crash again".to_owned())));
        // The rest of that part would be useless.
        for skipped in [b, low, build] {
            assert_eq!(ledger.state(skipped), State::Skipped);
        }
        assert_eq!(ledger.ready(), [c, d]);
        assert_eq!((ledger.why(build), ledger.why(high)), (Some("crash again"), None));
        let mut other = Ledger::new(&batch.graph, &batch.store, &[high], 9);
        assert!(!other.end(c, End::Bad("no part".to_owned())), "bad input is not tried again");
        assert!(!other.end(d, End::NoRoom("full".to_owned())));
        assert_eq!((other.ready(), other.no_room()), (vec![], Some("full")));
    }

    #[test]
    fn a_result_that_is_gone_is_made_again_first() {
        let (batch, [a, b, .., low, _, build]) = Batch::new();
        [a, b, low].into_iter().for_each(|key| batch.publish(key));
        let mut ledger = Ledger::new(&batch.graph, &batch.store, &[build], 2);
        assert!(!ledger.ready().contains(&build));
        assert!(!ledger.keys().contains(&low));
        batch.store.forget(low).unwrap();
        batch.store.forget(a).unwrap();
        assert!(ledger.end(build, End::Damaged("low is damaged".to_owned())));
        assert!(ledger.ready().contains(&a) && !ledger.ready().contains(&b));
        assert_eq!(ledger.state(low), State::Waiting);
        // A process that reports success without a result has failed.
        for again in [true, true, false] {
            assert_eq!(ledger.end(a, End::Done), again);
        }
        assert_eq!(ledger.state(low), State::Skipped);
    }
}
