//! Tasks that a batch names, kept in the store, so that `gc` knows which results are still wanted.

use std::fs;
use std::io;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use serde::{Deserialize, Serialize};

use crate::key::Key;
use crate::path_bytes;
use crate::store::{Store, StoreError, is_read_only, sealed};
use crate::task::Graph;

/// The tasks of a batch, and which of them it wants in the end.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NamedTasks {
    /// The night file, as an absolute path.
    #[serde(with = "path_bytes")]
    pub night: PathBuf,
    /// The tasks whose results are wanted.
    pub goals: Vec<Key>,
    /// All tasks, each after the tasks that it needs.
    pub tasks: Vec<NamedTask>,
}

/// A task, and the tasks that it needs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedTask {
    /// The task.
    pub key: Key,
    /// The tasks that it needs.
    pub needs: Vec<Key>,
}

impl NamedTasks {
    /// Returns the tasks that a batch names.
    pub fn new(night: PathBuf, graph: &Graph, goals: &[Key]) -> Self {
        let named = |&key: &Key| NamedTask { key, needs: graph.task(key).needs.clone() };
        Self { night, goals: goals.to_vec(), tasks: graph.keys().iter().map(named).collect() }
    }

    /// Returns where it is kept: one file for each night file.
    fn path(&self, store: &Store) -> PathBuf {
        let name = blake3::hash(self.night.as_os_str().as_encoded_bytes()).to_hex();
        store.root().join("batches").join(format!("{}.json", &name[..16]))
    }

    /// Keeps it. The file's time is the time when the batch was last run.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn keep(&self, store: &Store) -> Result<(), StoreError> {
        let path = self.path(store);
        if sealed::read::<Self>(&path).as_ref() == Some(self) {
            let touch = || fs::File::open(&path)?.set_modified(SystemTime::now());
            return match touch() {
                Err(error) if is_read_only(&error) => Ok(()),
                touched => touched.map_err(|error| StoreError::Io(path, error)),
            };
        }
        match sealed::write(&path, self) {
            // Nothing is removed from it either.
            Err(error) if is_read_only(&error) => Ok(()),
            kept => kept.map_err(|error| StoreError::Io(path, error)),
        }
    }

    /// Returns the tasks of batches that were run within a time, and the files of other batches.
    pub(crate) fn within(store: &Store, keep: Duration) -> io::Result<(Vec<Self>, Vec<PathBuf>)> {
        let (mut recent, mut old) = (Vec::new(), Vec::new());
        let entries = match fs::read_dir(store.root().join("batches")) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok((recent, old)),
            entries => entries?,
        };
        for entry in entries {
            let entry = entry?;
            let age = entry.metadata()?.modified()?.elapsed().unwrap_or_default();
            match sealed::read(&entry.path()) {
                Some(named) if age <= keep => recent.push(named),
                _ if age <= keep => {
                    // The tasks that it names are unknown: nothing is safe to remove.
                    let path = entry.path().display().to_string();
                    let problem = format!("{path} is damaged: run its batch again, or remove it");
                    return Err(io::Error::new(io::ErrorKind::InvalidData, problem));
                }
                _ => old.push(entry.path()),
            }
        }
        Ok((recent, old))
    }
}
