//! Reads the night file of a command.

use std::env;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use lamp_batch::{BatchError, Night, NightPlan, Store, StoreError, WatchedNames};

use super::StoreArgs;
use super::task::LampCommands;
use crate::catalogue::read_text;
use crate::exit::Exit;

/// A night file is text of a few lines for each part.
const MAX_FILE: u64 = 16 << 20;

/// A night, and the file that it is from.
pub(super) struct NightFile {
    pub(super) night: Night,
    /// As an absolute path.
    pub(super) path: PathBuf,
    /// As it was given, for messages.
    pub(super) name: String,
}

impl NightFile {
    /// Reads a night file. From here on this process works in its folder, so that all names of
    /// files in it are from there.
    pub(super) fn open(path: &Path) -> Result<Self, Exit> {
        Self::open_with(path, None)
    }

    /// Reads a night file as [`open`](Self::open) does; it may name no part.
    pub(super) fn open_for_look(path: &Path) -> Result<Self, Exit> {
        Self::open_with(path, Some((&[], &mut WatchedNames::default())))
    }

    /// Returns a line for people if there is no part in the file.
    pub(super) fn no_parts(&self) -> Option<String> {
        let why = "--watch FOLDER makes the parts of a folder, which are not looked at here";
        self.night.parts.is_empty().then(|| format!("{}: no [[part]] in it: {why}\n", self.name))
    }

    /// Reads a night file as [`open`](Self::open) does. Each of `others` is a part, too, if there are
    /// any, with the name that it had.
    pub(super) fn open_with(
        path: &Path,
        others: Option<(&[PathBuf], &mut WatchedNames)>,
    ) -> Result<Self, Exit> {
        let name = path.display().to_string();
        let failed = |error: anyhow::Error| Exit::Usage(error).at(name.clone());
        if !path.is_file() {
            let problem = if path.exists() { "it is no file" } else { "there is no such file" };
            return Err(failed(anyhow!("{problem}: docs/batch.md shows a night file")));
        }
        let text = read_text(path, MAX_FILE, "a night file").map_err(failed)?;
        let path = path.canonicalize().with_context(|| name.clone())?;
        let night = match others {
            None => Night::parse(&text, &path),
            Some((others, names)) => Night::parse_with(&text, &path, others, names),
        };
        let night = night.map_err(|error| failed(error.into()))?;
        let folder = path.parent().unwrap_or(Path::new("/"));
        env::set_current_dir(folder).with_context(|| folder.display().to_string())?;
        Ok(Self { night, path, name })
    }

    /// Opens the night's store, or makes it.
    pub(super) fn store(&self) -> Result<Store, Exit> {
        let at_its_place = |error: StoreError| match self.night.store_place {
            Some(place) => Exit::Failed(error.into()).at(format!("{}: {place}", self.name)),
            None => Exit::Failed(error.into()),
        };
        Store::create(&self.night.store).map_err(at_its_place)
    }
}

impl NightFile {
    /// Plans the night. Files in it are from the folder of the night file, where this process works.
    pub(super) fn plan(&self, store: &Store) -> Result<NightPlan, Exit> {
        let folder = env::current_dir().context("the folder of the night file")?;
        NightPlan::new(&self.night, &folder, &LampCommands, store).map_err(|error| match error {
            BatchError::Night { .. } => Exit::from(error).at(self.name.clone()),
            error => error.into(),
        })
    }
}

/// Opens the store that a command names, and reads the night file that it is from, if one is named.
pub(super) fn store_of(args: &StoreArgs) -> Result<(Store, Option<NightFile>), Exit> {
    let file = match &args.night {
        Some(night) => Some(NightFile::open_for_look(night)?),
        None => None,
    };
    let folder = file.as_ref().map(|file| &file.night.store).or(args.store.as_ref());
    let folder = folder.expect("one of them is required");
    let store = Store::open(folder).map_err(|error| Exit::Usage(error.into()))?;
    Ok((store, file))
}
