//! The store: results by the key of their task, each whole or absent.
//!
//! ```text
//! tasks/ab/KEY.task   what `lamp batch task KEY` does
//! tasks/ab/KEY.result  its result
//! tasks/ab/KEY.json   the manifest, without which there is no result
//! notes/ab/KEY.json   what would take time to find out again
//! batches/NAME.json   what a batch names, for `gc`
//! journal/HOST.jsonl  times, machines and engines
//! digests.json        digests of inputs by their file's times
//! ```

mod digests;
mod manifest;
pub(crate) mod sealed;
mod unpublished;

use std::collections::HashMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lamp_stack::{digest_of, remove_leftovers};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use thiserror::Error;

use crate::key::Key;
use crate::task::Task;

pub use digests::Digests;
pub use manifest::{CheckCounts, Facts, Manifest, Written};
pub use unpublished::Unpublished;

/// A folder of results.
#[derive(Clone, Debug)]
pub struct Store {
    root: PathBuf,
    /// Notes that cannot be written, since the store can only be read.
    unkept: Arc<Mutex<HashMap<Key, Value>>>,
}

/// Why a store cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StoreError {
    /// The folder holds something else.
    #[error("{0} contains other things: name an empty or a new folder as the store")]
    Other(PathBuf),
    /// The store is of another version.
    #[error("{0} is a store of a different lamp version: name a new folder as the store")]
    Version(PathBuf),
    /// There is no store, where one is to be read.
    #[error("{0} is not a store: name the night file, or its store with --store")]
    None(PathBuf),
    /// A file cannot be read or written.
    #[error("{0}")]
    Io(PathBuf, #[source] io::Error),
}

impl StoreError {
    /// Returns the text of an error whose cause is a full disk.
    pub(crate) fn no_room(&self) -> Option<String> {
        use io::ErrorKind::{QuotaExceeded, StorageFull};
        match self {
            Self::Io(path, error) if matches!(error.kind(), StorageFull | QuotaExceeded) => {
                Some(format!("{}: {error}", path.display()))
            }
            _ => None,
        }
    }

    fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |error| Self::Io(path.to_owned(), error)
    }
}

/// Damage to a result.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Damage {
    /// There is no manifest, or it is not whole.
    #[error("it has no whole manifest")]
    NoManifest,
    /// The manifest stands under another key.
    #[error("its manifest belongs to another task")]
    OtherTask,
    /// The result is not there.
    #[error("its file is gone")]
    Gone,
    /// The result is not what the manifest says.
    #[error("the bytes of its file differ from its manifest")]
    OtherBytes,
}

/// The file that makes a folder a store, and its text.
const MARK: (&str, &str) = ("lamp-store", "lamp-store-1\n");

/// The folders of a store that have one folder for each two letters of keys.
const SHARDED: [&str; 2] = ["tasks", "notes"];

impl Store {
    /// Opens the store in a folder, which is made if need be, and removes the temporary files of
    /// writers that were killed.
    ///
    /// # Errors
    /// Returns an error if the folder holds anything else, or cannot be written.
    pub fn create(root: &Path) -> Result<Self, StoreError> {
        let mark = root.join(MARK.0);
        fs::create_dir_all(root).map_err(StoreError::io(root))?;
        let root = fs::canonicalize(root).map_err(StoreError::io(root))?;
        if !mark.exists() {
            let mut entries = fs::read_dir(&root).map_err(StoreError::io(&root))?;
            // Another process may be making the store at this moment.
            let is_other = |entry: io::Result<fs::DirEntry>| {
                entry.is_ok_and(|entry| !entry.file_name().to_string_lossy().contains(MARK.0))
            };
            if entries.any(is_other) {
                return Err(StoreError::Other(root));
            }
            sealed::write_whole(&mark, MARK.1.as_bytes()).map_err(StoreError::io(&mark))?;
        }
        let store = Self::open(&root)?;
        store.sweep();
        Ok(store)
    }

    /// Opens the store in a folder.
    ///
    /// # Errors
    /// Returns an error if the folder holds no store.
    pub fn open(root: &Path) -> Result<Self, StoreError> {
        match fs::read_to_string(root.join(MARK.0)) {
            Ok(text) if text == MARK.1 => {
                let root = fs::canonicalize(root).map_err(StoreError::io(root))?;
                Ok(Self { root, unkept: Arc::default() })
            }
            Ok(_) => Err(StoreError::Version(root.to_owned())),
            Err(_) => Err(StoreError::None(root.to_owned())),
        }
    }

    /// Returns the store's folder, as an absolute path.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Removes the temporary files that no living process writes.
    fn sweep(&self) {
        remove_leftovers(&self.root);
        for name in ["batches", "journal"] {
            remove_leftovers(&self.root.join(name));
        }
        for shard in SHARDED.iter().flat_map(|name| folders_in(&self.root.join(name))) {
            remove_leftovers(&shard);
        }
    }

    fn of_task(&self, key: Key, end: &str) -> PathBuf {
        self.root.join("tasks").join(key.place(end))
    }

    /// Returns where the result of a task is, if it has one.
    pub fn result(&self, key: Key) -> PathBuf {
        self.of_task(key, "result")
    }

    /// Returns the manifest of a task that is done: the manifest is complete, and the result has
    /// the size that it states. [`check`](Self::check) compares bytes.
    pub fn manifest(&self, key: Key) -> Option<Manifest> {
        self.whole_manifest(key).ok()
    }

    /// Returns whether there is a manifest, whole or not.
    pub fn has_manifest(&self, key: Key) -> bool {
        self.of_task(key, "json").exists()
    }

    fn whole_manifest(&self, key: Key) -> Result<Manifest, Damage> {
        let path = self.of_task(key, "json");
        let manifest: Manifest = sealed::read(&path).ok_or(Damage::NoManifest)?;
        // A copied or renamed file would otherwise stand for another task's result.
        if manifest.recipe.key() != key {
            return Err(Damage::OtherTask);
        }
        let Some(written) = &manifest.result else { return Ok(manifest) };
        match fs::metadata(self.result(key)) {
            Ok(file) if file.len() == written.bytes => Ok(manifest),
            Ok(_) => Err(Damage::OtherBytes),
            Err(_) => Err(Damage::Gone),
        }
    }

    /// Reads a result anew and compares its digest with its manifest.
    ///
    /// # Errors
    /// Returns the damage, if any.
    pub fn check(&self, key: Key) -> Result<Manifest, Damage> {
        let manifest = self.whole_manifest(key)?;
        if let Some(written) = &manifest.result {
            let file = File::open(self.result(key)).map_err(|_| Damage::Gone)?;
            let digest = digest_of(file).map_err(|_| Damage::OtherBytes)?;
            if digest != written.digest {
                return Err(Damage::OtherBytes);
            }
        }
        Ok(manifest)
    }

    /// Removes a damaged result, so that it is made again.
    ///
    /// # Errors
    /// Returns an error if it cannot be removed.
    pub fn forget(&self, key: Key) -> Result<(), StoreError> {
        // The manifest goes first: without it, there is no result.
        for end in ["json", "result"] {
            remove(&self.of_task(key, end))?;
        }
        Ok(())
    }

    /// Starts the result of a task, next to its place.
    ///
    /// # Errors
    /// Returns an error if no file can be made there.
    pub fn begin(&self, key: Key) -> Result<Unpublished, StoreError> {
        let path = self.result(key);
        sealed::make_folder_of(&path).map_err(StoreError::io(&path))?;
        Unpublished::new(&path).map_err(StoreError::io(&path))
    }

    /// Records that a task is done. Its result, if it has one, is [`Written`] before.
    ///
    /// # Errors
    /// Returns an error if the manifest cannot be written.
    pub fn publish(&self, manifest: &Manifest) -> Result<(), StoreError> {
        let path = self.of_task(manifest.recipe.key(), "json");
        sealed::write(&path, manifest).map_err(StoreError::io(&path))
    }

    /// Writes the work of a task, for the process that does it.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn write_task(&self, task: &Task) -> Result<(), StoreError> {
        let path = self.of_task(task.recipe.key(), "task");
        match sealed::read::<Task>(&path) {
            Some(before) if before == *task => Ok(()),
            _ => sealed::write_lightly(&path, task).map_err(StoreError::io(&path)),
        }
    }

    /// Returns the work of a task, if a batch has written it.
    pub fn task(&self, key: Key) -> Option<Task> {
        sealed::read(&self.of_task(key, "task"))
    }

    /// Returns the name of a task for people.
    pub fn name_of(&self, key: Key) -> String {
        let task = self.task(key);
        task.map_or_else(|| key.short(), |task| format!("{} ({})", task.subject, task.label))
    }

    /// Returns a note, if there is one.
    pub fn note<T: DeserializeOwned>(&self, key: Key) -> Option<T> {
        if let Some(note) = self.unkept().get(&key) {
            return serde_json::from_value(note.clone()).ok();
        }
        sealed::read(&self.root.join("notes").join(key.place("json")))
    }

    /// Keeps a note, which would take time to find out again. If the store can only be read, this
    /// process keeps it for itself.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn keep_note(&self, key: Key, note: &impl Serialize) -> Result<(), StoreError> {
        let path = self.root.join("notes").join(key.place("json"));
        match sealed::write_lightly(&path, note) {
            Err(error) if is_read_only(&error) => {
                let note = serde_json::to_value(note).expect("notes have text keys");
                self.unkept().insert(key, note);
                Ok(())
            }
            kept => kept.map_err(StoreError::io(&path)),
        }
    }

    fn unkept(&self) -> MutexGuard<'_, HashMap<Key, Value>> {
        // The map is valid even if a thread panicked while it held the lock.
        self.unkept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Removes a note, if there is one.
    ///
    /// # Errors
    /// Returns an error if it cannot be removed.
    pub fn forget_note(&self, key: Key) -> Result<(), StoreError> {
        match remove(&self.root.join("notes").join(key.place("json"))) {
            Err(StoreError::Io(_, error)) if is_read_only(&error) => Ok(()),
            removed => removed,
        }
    }

    /// Returns the keys of all tasks with a file in the store.
    ///
    /// # Errors
    /// Returns an error if a folder cannot be read.
    pub fn keys(&self) -> Result<Vec<Key>, StoreError> {
        let mut keys = Vec::new();
        for shard in folders_in(&self.root.join("tasks")) {
            for entry in fs::read_dir(&shard).map_err(StoreError::io(&shard))?.flatten() {
                let name = entry.file_name().to_string_lossy().into_owned();
                keys.extend(name.split_once('.').and_then(|(key, _)| key.parse::<Key>().ok()));
            }
        }
        // A task has up to three files, all with its key.
        keys.sort();
        keys.dedup();
        Ok(keys)
    }
}

/// Returns whether an error means a read-only store: it still serves its results.
pub(crate) fn is_read_only(error: &io::Error) -> bool {
    // A store of another user denies permission, a snapshot is mounted read-only.
    matches!(error.kind(), io::ErrorKind::ReadOnlyFilesystem | io::ErrorKind::PermissionDenied)
}

/// Removes a file, if it is there.
pub(crate) fn remove(path: &Path) -> Result<(), StoreError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(StoreError::Io(path.to_owned(), error))
        }
        _ => Ok(()),
    }
}

/// Returns the folders in a folder, in the order of their names; empty if it is not there.
pub(crate) fn folders_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut folders: Vec<_> = entries
        .filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()))
        .map(|entry| entry.path())
        .collect();
    folders.sort();
    folders
}
