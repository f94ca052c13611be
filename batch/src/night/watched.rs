//! The names of parts in a folder that is watched: once given, they stay.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::key::Key;
use crate::path_bytes::{self, WrittenPath};
use crate::store::{Store, StoreError};

/// The names of parts, by their files. A name is nobody else's, even when its file is gone.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WatchedNames(pub(super) BTreeMap<PathBuf, String>);

/// A part's file, and its name.
#[derive(Serialize, Deserialize)]
struct NamedFile {
    #[serde(with = "path_bytes")]
    file: PathBuf,
    name: String,
}

impl WatchedNames {
    /// Returns the names that a store has for a night file and a folder.
    pub fn of(store: &Store, night: &Path, folder: &Path) -> Self {
        let known: Option<Vec<NamedFile>> = store.note(note(night, folder));
        let names = known.into_iter().flatten().map(|NamedFile { file, name }| (file, name));
        Self(names.collect())
    }

    /// Keeps them in a store.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn keep(&self, store: &Store, night: &Path, folder: &Path) -> Result<(), StoreError> {
        let named = |(file, name): (&PathBuf, &String)| {
            let (file, name) = (file.clone(), name.clone());
            NamedFile { file, name }
        };
        let names: Vec<NamedFile> = self.0.iter().map(named).collect();
        store.keep_note(note(night, folder), &names)
    }
}

fn note(night: &Path, folder: &Path) -> Key {
    Key::of_note("watched", &[WrittenPath(night), WrittenPath(folder)])
}
