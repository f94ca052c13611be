//! Digests of input files, which are read again only when they may have changed.

use std::collections::BTreeMap;
use std::fs::{File, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use lamp_stack::digest_of;
use serde::{Deserialize, Serialize};

use super::{Store, StoreError, is_read_only, sealed};

/// Digests by path, each with the facts of its file.
#[derive(Debug)]
pub struct Digests {
    path: PathBuf,
    known: BTreeMap<String, Known>,
    is_changed: bool,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Known {
    stamp: Stamp,
    digest: String,
}

/// Facts that change when a file does.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Stamp {
    bytes: u64,
    /// Nanoseconds since 1970.
    modified: u128,
    /// Device, inode, and the time of the last change of either bytes or name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    inode: Option<[i64; 4]>,
}

/// A file that changed less long ago may change again without a new time: file systems count time
/// in steps of up to 2 s.
const STEP_NS: u128 = 2_000_000_000;

impl Digests {
    /// Reads the digests that the store knows.
    pub fn of(store: &Store) -> Self {
        let path = store.root().join("digests.json");
        // Without known digests, files are read once more: no error.
        let known = sealed::read(&path).unwrap_or_default();
        Self { path, known, is_changed: false }
    }

    /// Returns the digest of a file.
    ///
    /// # Errors
    /// Returns an error if it cannot be read.
    pub fn digest(&mut self, path: &Path) -> io::Result<String> {
        let metadata = path.metadata()?;
        if !metadata.is_file() {
            // A pipe would wait for a writer, and a device may have no end.
            return Err(io::Error::other("it is no file"));
        }
        let stamp = Stamp::of(&metadata);
        let name = path.display().to_string();
        if let Some(known) = self.known.get(&name).filter(|known| known.stamp == stamp) {
            return Ok(known.digest.clone());
        }
        let file = File::open(path)?;
        // The path may name another file since the first look.
        let stamp = Stamp::of(&file.metadata()?);
        let digest = digest_of(&file)?;
        // Displayed names that are not UTF-8 may be equal for two files.
        if now_ns().saturating_sub(stamp.modified) > STEP_NS && path.to_str().is_some() {
            self.known.insert(name, Known { stamp, digest: digest.clone() });
            self.is_changed = true;
        }
        Ok(digest)
    }

    /// Writes the known digests.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn keep(&mut self) -> Result<(), StoreError> {
        if std::mem::take(&mut self.is_changed) {
            // Otherwise it would grow with every file that was ever named.
            self.known.retain(|path, _| Path::new(path).exists());
            match sealed::write_lightly(&self.path, &self.known) {
                Err(error) if is_read_only(&error) => {}
                kept => kept.map_err(StoreError::io(&self.path))?,
            }
        }
        Ok(())
    }
}

fn now_ns() -> u128 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos())
}

impl Stamp {
    fn of(metadata: &Metadata) -> Self {
        let modified = metadata.modified().ok().and_then(|at| at.duration_since(UNIX_EPOCH).ok());
        Self {
            bytes: metadata.len(),
            modified: modified.map_or(0, |since| since.as_nanos()),
            inode: inode(metadata),
        }
    }
}

#[cfg(unix)]
fn inode(metadata: &Metadata) -> Option<[i64; 4]> {
    use std::os::unix::fs::MetadataExt;
    Some([metadata.dev() as i64, metadata.ino() as i64, metadata.ctime(), metadata.ctime_nsec()])
}

#[cfg(not(unix))]
fn inode(_: &Metadata) -> Option<[i64; 4]> {
    None
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_file_is_read_again_when_it_may_have_changed() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::create(&folder.path().join("store")).unwrap();
        let path = folder.path().join("a.stl");
        let write = |text: &str, age: u64| {
            let mut file = File::create(&path).unwrap();
            io::Write::write_all(&mut file, text.as_bytes()).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(age)).unwrap();
        };
        write("one", 60);
        let mut digests = Digests::of(&store);
        let one = digests.digest(&path).unwrap();
        assert_eq!(one, digest_of(&b"one"[..]).unwrap());
        digests.keep().unwrap();
        let mut again = Digests::of(&store);
        assert_eq!(again.known.len(), 1);
        // The same size and time, but another change of the inode.
        let before = path.metadata().unwrap().modified().unwrap();
        std::thread::sleep(Duration::from_millis(20));
        fs::write(&path, "two").unwrap();
        File::options().write(true).open(&path).unwrap().set_modified(before).unwrap();
        assert_ne!(again.digest(&path).unwrap(), one);
        // A file that has just changed is not relied on.
        write("new", 0);
        again.known.clear();
        again.digest(&path).unwrap();
        assert!(again.known.is_empty());
        fs::remove_file(&path).unwrap();
        assert_eq!(again.digest(&path).unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
