//! Names of temporary files that show their purpose, locks that show whether a writer still lives,
//! and the removal of files that dead writers left.
//!
//! A writer locks its file or folder before it relies on it, and holds the lock until the end. So a
//! file or folder that can be locked has no living writer. Locks are the system's, which ends them
//! with the process, however that ends.

use std::fs::{self, DirEntry, File, OpenOptions, TryLockError};
use std::io;
use std::path::Path;

/// The mark between the final name and the random letters of a temporary one.
const MARK: &str = ".lamp-";
/// The end of temporary names.
pub(crate) const END: &str = ".part";
/// The number of random letters and digits.
pub(crate) const RANDOM_LETTERS: usize = 6;
/// The most bytes of a final name in a temporary one: file systems take 143 at least.
const MAX_BYTES: usize = 100;

/// Returns how the temporary names for `path` start: hidden, and with the name that the file will
/// have, or as much of it as fits.
pub(crate) fn start_of_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    // Cut between letters, for a part of a letter is no UTF-8.
    let ends = name.char_indices().map(|(at, letter)| at + letter.len_utf8());
    let end = ends.take_while(|&end| end <= MAX_BYTES).last().unwrap_or(0);
    format!(".{}{MARK}", &name[..end])
}

/// Returns whether a name is one of our temporary ones.
fn is_temporary(name: &str) -> bool {
    let inner = name.strip_prefix('.').and_then(|name| name.strip_suffix(END));
    inner.and_then(|inner| inner.rsplit_once(MARK)).is_some_and(|(of, random)| {
        !of.is_empty()
            && random.len() == RANDOM_LETTERS
            && random.bytes().all(|letter| letter.is_ascii_alphanumeric())
    })
}

/// Locks a new temporary file or folder for as long as `handle` is open. Returns false if it is
/// lost: another process saw it before it was locked, and mistook it for a dead writer's.
pub(crate) fn claim(handle: &File, path: &Path) -> bool {
    // On a file system without locks nothing counts as a dead writer's.
    !matches!(handle.try_lock(), Err(TryLockError::WouldBlock)) && is_at(handle, path)
}

/// Removes the temporary files and folders in `folder` that no living process writes.
pub fn remove_leftovers(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        if is_temporary(&entry.file_name().to_string_lossy()) {
            // It stays where it may not be removed, as another user's.
            let _ = remove_if_dead(&entry);
        }
    }
}

fn remove_if_dead(entry: &DirEntry) -> io::Result<()> {
    let (path, kind) = (entry.path(), entry.file_type()?);
    if !kind.is_file() && !kind.is_dir() {
        return Ok(());
    }
    // Network file systems lock only files that are open for writing.
    let writable = OpenOptions::new().read(true).write(true).open(&path);
    let handle = writable.or_else(|_| File::open(&path))?;
    handle.try_lock()?;
    match kind.is_dir() {
        // Since the folder was listed, the file may have got its final name.
        _ if !is_at(&handle, &path) => Ok(()),
        true => fs::remove_dir_all(path),
        false => fs::remove_file(path),
    }
}

/// Returns whether an open file is the one at `path`.
#[cfg(unix)]
fn is_at(handle: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let same = |a: fs::Metadata, b: fs::Metadata| (a.dev(), a.ino()) == (b.dev(), b.ino());
    handle.metadata().ok().zip(fs::symlink_metadata(path).ok()).is_some_and(|(a, b)| same(a, b))
}

/// Returns whether an open file is the one at `path`, of which names are random enough.
#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_name_tells_its_file_and_fits() {
        assert_eq!(start_of_name(Path::new("out/build.tif")), ".build.tif.lamp-");
        for name in ["l".repeat(255), "ö".repeat(127), "葉".repeat(85)] {
            let start = start_of_name(Path::new(&name));
            assert!(start.len() + RANDOM_LETTERS + END.len() <= 143, "{start}");
            assert!(start[1..].starts_with(&name[..90]), "{start}");
        }
    }

    #[test]
    fn only_names_of_our_pattern_are_temporary() {
        for ours in [".build.tif.lamp-aB3xY9.part", ".a.lamp-x.lamp-aB3xY9.part"] {
            assert!(is_temporary(ours), "{ours}");
        }
        for other in [
            ".lamp-aB3xY9.part",
            "build.tif.lamp-aB3xY9.part",
            ".build.tif.lamp-aB3xY.part",
            ".build.tif.lamp-aB3xY90.part",
            ".build.tif.lamp-aB3x-9.part",
            ".build.tif.lamp-aB3xY9.par",
            ".build.tif.part",
        ] {
            assert!(!is_temporary(other), "{other}");
        }
    }

    #[test]
    fn what_nobody_writes_is_removed_and_all_else_stays() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at(".a.tif.lamp-aaaaaa.part"), "dead").unwrap();
        fs::create_dir(at(".b.lamp-bbbbbb.part")).unwrap();
        fs::write(at(".b.lamp-bbbbbb.part/layer_00000.tif"), "dead").unwrap();
        fs::write(at(".notes.part"), "mine").unwrap();
        let held = File::create(at(".c.tif.lamp-cccccc.part")).unwrap();
        fs::create_dir(at(".d.lamp-dddddd.part")).unwrap();
        let held_folder = File::open(at(".d.lamp-dddddd.part")).unwrap();
        assert!(claim(&held, &at(".c.tif.lamp-cccccc.part")));
        assert!(claim(&held_folder, &at(".d.lamp-dddddd.part")));

        remove_leftovers(folder.path());
        let living = [".c.tif.lamp-cccccc.part", ".d.lamp-dddddd.part", ".notes.part"];
        assert_eq!(names(folder.path()), living);
        drop((held, held_folder));
        remove_leftovers(folder.path());
        assert_eq!(names(folder.path()), [".notes.part"]);
    }

    #[test]
    fn what_was_taken_for_a_dead_writers_is_lost() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(".a.tif.lamp-aaaaaa.part");
        let early = File::create(&path).unwrap();
        remove_leftovers(folder.path());
        assert!(!claim(&early, &path), "it is gone");
        let later = File::create(&path).unwrap();
        assert!(!claim(&early, &path), "the name has another file");
        assert!(claim(&later, &path));
        assert!(!claim(&File::open(&path).unwrap(), &path), "it is locked");
    }

    #[cfg(unix)]
    #[test]
    fn links_of_such_names_stay_with_what_they_mean() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("mine"), "keep").unwrap();
        std::os::unix::fs::symlink("mine", at(".a.lamp-aaaaaa.part")).unwrap();
        remove_leftovers(folder.path());
        assert_eq!(names(folder.path()), [".a.lamp-aaaaaa.part", "mine"]);
    }
}
