//! Puts results where people look for them, under today's names of their parts.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{Scope, ScopedJoinHandle};
use std::time::UNIX_EPOCH;

use lamp_pipeline::Names;
use lamp_stack::{Destination, digest_of};
use serde::{Deserialize, Serialize};

use crate::error::BatchError;
use crate::key::Key;
use crate::night::{Night, NightFormat, NightOutput};
use crate::path_bytes::WrittenPath;
use crate::plan::{Subject, WantedResults};
use crate::store::{Damage, Store};

/// Delivers results to a folder.
pub struct Deliverer<'a> {
    /// The store of the night.
    pub store: &'a Store,
    /// Where results go.
    pub output: &'a NightOutput,
}

/// A delivered file: its place, and its state when it was delivered.
#[derive(PartialEq, Eq, Serialize, Deserialize)]
pub struct Delivered {
    key: Key,
    names: Vec<(String, String)>,
    bytes: u64,
    /// Nanoseconds since 1970.
    modified: u128,
    /// The digest of the file, `blake3:` and 64 hexadecimal digits.
    pub digest: String,
}

impl Deliverer<'_> {
    /// Returns where a result goes.
    pub fn path(&self, subject: &Subject) -> PathBuf {
        path(self.output, &subject.name, subject.is_build)
    }

    /// Takes a result away that is still to be delivered, if it was damaged. Returns what is wrong with
    /// it.
    ///
    /// # Errors
    /// Returns an error if the result cannot be removed.
    pub fn take_damaged(&self, subject: &Subject) -> Result<Option<Damage>, BatchError> {
        let Ok(wanted) = &subject.wanted else { return Ok(None) };
        if !self.store.has_manifest(wanted.stack) {
            return Ok(None);
        }
        let damage = self.store.check(wanted.stack).err();
        if damage.is_some() {
            self.store.forget(wanted.stack)?;
        }
        Ok(damage)
    }

    /// Returns what is there, if it is what is wanted.
    pub fn delivered(&self, subject: &Subject) -> Option<Delivered> {
        let wanted = subject.wanted.as_ref().ok()?;
        let path = self.path(subject);
        let known: Delivered = self.store.note(note(&path))?;
        let (bytes, modified) = stamp(&path)?;
        let is_it = known.key == wanted.stack && known.names == wanted.names;
        (is_it && (known.bytes, known.modified) == (bytes, modified)).then_some(known)
    }

    /// Delivers a result, unless it is there.
    fn deliver(&self, subject: &Subject, wanted: &WantedResults) -> Result<(), BatchError> {
        let path = self.path(subject);
        if self.delivered(subject).is_some() {
            return Ok(());
        }
        let folder = path.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(folder).map_err(BatchError::file(folder))?;
        let written = self.write(wanted, &path);
        written.map_err(|error| error.at(path.display().to_string()))?;
        let digest = File::open(&path).and_then(digest_of).map_err(BatchError::file(&path))?;
        let (bytes, modified) = stamp(&path).unwrap_or_default();
        let names = wanted.names.clone();
        let delivered = Delivered { key: wanted.stack, names, bytes, modified, digest };
        Ok(self.store.keep_note(note(&path), &delivered)?)
    }

    fn write(&self, wanted: &WantedResults, path: &Path) -> Result<(), lamp_pipeline::Error> {
        let to = Destination::File(path.to_owned());
        let names = Names::new(wanted.names.iter().cloned());
        let stored = self.store.result(wanted.stack);
        match self.output.format {
            NightFormat::Lamp => names.copy(&stored, to),
            NightFormat::Tif => names.unpack(&stored, to),
        }
    }

    /// Starts a thread that delivers what it is sent, while other tasks go on. It returns what
    /// failed, with the names of parts and builds.
    pub fn start<'s>(
        &'s self,
        scope: &'s Scope<'s, '_>,
        subjects: &'s [Subject],
    ) -> (Sender<usize>, ScopedJoinHandle<'s, Vec<(String, BatchError)>>) {
        let (sender, wanted): (Sender<usize>, Receiver<usize>) = channel();
        let work = move || {
            let mut failed = Vec::new();
            for subject in wanted.into_iter().map(|place| &subjects[place]) {
                let Ok(wanted) = &subject.wanted else { continue };
                if let Err(error) = self.deliver(subject, wanted) {
                    failed.push((subject.name.clone(), error));
                }
            }
            failed
        };
        (sender, scope.spawn(work))
    }
}

/// Returns where the result of a part or a build goes.
fn path(output: &NightOutput, name: &str, is_build: bool) -> PathBuf {
    let folder = if is_build { "builds" } else { "parts" };
    output.folder.join(folder).join(format!("{name}.{}", output.format.end()))
}

/// Hashes all files anew that were delivered for a night. Returns how many are as they were, and what
/// is wrong with each other one, which the next run delivers again.
///
/// # Errors
/// Returns an error if the store cannot be written.
pub fn check_delivered(night: &Night, store: &Store) -> Result<(usize, Vec<String>), BatchError> {
    let parts = night.parts.iter().map(|part| path(&night.output, &part.name, false));
    let builds = night.builds.iter().map(|build| path(&night.output, &build.name, true));
    let (mut whole, mut wrong) = (0, Vec::new());
    for path in parts.chain(builds) {
        let Some(known) = store.note::<Delivered>(note(&path)) else {
            // An earlier check found it wrong and forgot it, or another program wrote it.
            if path.exists() {
                let place = path.display();
                wrong.push(format!(
                    "{place}: its delivery is not known: the next run delivers it again"
                ));
            }
            continue;
        };
        let problem = match File::open(&path).and_then(digest_of) {
            Ok(digest) if digest == known.digest => {
                whole += 1;
                continue;
            }
            Ok(_) => "its bytes differ from the delivered ones".to_owned(),
            Err(error) if error.kind() == io::ErrorKind::NotFound => "it is gone".to_owned(),
            Err(error) => error.to_string(),
        };
        wrong.push(format!("{}: {problem}: the next run delivers it again", path.display()));
        store.forget_note(note(&path))?;
    }
    Ok((whole, wrong))
}

fn note(path: &Path) -> Key {
    Key::of_note("delivered", &WrittenPath(path))
}

/// Returns the size of a file and when it was changed.
fn stamp(path: &Path) -> Option<(u64, u128)> {
    let file = fs::metadata(path).ok()?;
    let modified = file.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
    Some((file.len(), modified.as_nanos()))
}
