//! Tasks, and the graph of their needs.

use std::collections::HashMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::key::{Key, TaskRecipe};
use crate::path_bytes;

/// A piece of work with one result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// The recipe, which decides the bytes of its result.
    pub recipe: TaskRecipe,
    /// The part or build that it is for, as the night file names it.
    pub subject: String,
    /// The work, for people: `layers 0..320`.
    pub label: String,
    /// Tasks whose results it uses, in their order.
    pub needs: Vec<Key>,
    /// Files that it reads, with the digests that they have.
    pub files: Vec<InputFile>,
    /// The estimated cost.
    pub cost: Cost,
    /// The work, for the program that does it.
    pub work: Value,
}

/// A file that a task reads.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputFile {
    /// Where it is now, as an absolute path.
    #[serde(with = "path_bytes")]
    pub path: PathBuf,
    /// `blake3:` and 64 hexadecimal digits.
    pub digest: String,
}

/// The estimated cost of a task.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Cost {
    /// Seconds of one processor.
    pub cpu_s: f64,
    /// Most bytes of memory at once.
    pub memory: u64,
    /// Bytes of the result.
    pub disk: u64,
}

impl std::iter::Sum for Cost {
    /// Adds times and results; memory is the memory of the largest task.
    fn sum<I: Iterator<Item = Self>>(costs: I) -> Self {
        costs.fold(Self::default(), |sum, cost| Self {
            cpu_s: sum.cpu_s + cost.cpu_s,
            memory: sum.memory.max(cost.memory),
            disk: sum.disk + cost.disk,
        })
    }
}

/// Tasks, each after all tasks that it needs, without two of one key.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    tasks: Vec<Task>,
    keys: Vec<Key>,
    places: HashMap<Key, usize>,
}

impl Graph {
    /// Adds a task and returns its key. If the key is there already, that task stays as it is.
    ///
    /// # Panics
    /// Panics if a task that it needs has not been added before.
    pub fn add(&mut self, task: Task) -> Key {
        let key = task.recipe.key();
        assert!(
            task.needs.iter().all(|need| self.places.contains_key(need)),
            "tasks come in order"
        );
        if !self.places.contains_key(&key) {
            self.places.insert(key, self.tasks.len());
            self.keys.push(key);
            self.tasks.push(task);
        }
        key
    }

    /// Returns the task of a key.
    ///
    /// # Panics
    /// Panics if the graph has no such task.
    pub fn task(&self, key: Key) -> &Task {
        &self.tasks[self.places[&key]]
    }

    /// Returns all keys, each after the keys that it needs.
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// Returns the tasks to do for `goals`, each after the tasks that it needs: goals that are not
    /// done, and unfinished tasks that they need.
    pub fn missing(&self, goals: &[Key], mut is_done: impl FnMut(Key) -> bool) -> Vec<Key> {
        let mut wanted = vec![false; self.tasks.len()];
        for goal in goals {
            wanted[self.places[goal]] = true;
        }
        // A task stands after the tasks that it needs.
        for place in (0..self.tasks.len()).rev() {
            wanted[place] = wanted[place] && !is_done(self.keys[place]);
            if wanted[place] {
                for need in &self.tasks[place].needs {
                    wanted[self.places[need]] = true;
                }
            }
        }
        let is_wanted = |(key, wanted): (&Key, bool)| wanted.then_some(*key);
        self.keys.iter().zip(wanted).filter_map(is_wanted).collect()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::key::Kind;

    /// A task with a name, which does nothing and has only needs.
    pub(crate) fn task(name: &str, kind: Kind, needs: &[Key]) -> Task {
        let inputs = needs.iter().map(ToString::to_string).collect();
        let recipe = TaskRecipe { kind, options: vec![name.to_owned()], inputs, code: Vec::new() };
        Task {
            recipe,
            subject: name.to_owned(),
            label: name.to_owned(),
            needs: needs.to_vec(),
            files: Vec::new(),
            cost: Cost { cpu_s: 1.0, memory: 1, disk: 1 },
            work: Value::Null,
        }
    }

    #[test]
    fn only_what_is_missing_for_the_goals_is_done() {
        let mut graph = Graph::default();
        let ranges = ["a", "b", "c"].map(|name| graph.add(task(name, Kind::Range, &[])));
        let low = graph.add(task("low", Kind::Join, &ranges[..2]));
        let high = graph.add(task("high", Kind::Join, &ranges[1..]));
        let build = graph.add(task("build", Kind::Tile, &[low, high]));
        assert_eq!(graph.add(task("low", Kind::Join, &ranges[..2])), low);
        assert_eq!(graph.keys().len(), 6);
        let missing = |goals: &[Key], done: &[Key]| graph.missing(goals, |key| done.contains(&key));
        assert_eq!(missing(&[build], &[]), graph.keys());
        // A joined part needs its ranges no more, but another part may.
        assert_eq!(missing(&[build], &[low]), [ranges[1], ranges[2], high, build]);
        assert_eq!(missing(&[build], &[build]), []);
        assert_eq!(missing(&[low, build], &[build]), [ranges[0], ranges[1], low]);
    }
}
