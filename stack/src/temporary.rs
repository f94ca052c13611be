//! Creates files and folders that get their name only when they are complete.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread;
use std::time::Duration;

use tempfile::{Builder, NamedTempFile, TempDir};

use crate::error::StackError;
use crate::leftovers::{END, RANDOM_LETTERS, claim, remove_leftovers, start_of_name};
use crate::text::one_line;

/// The temporary files and folders of this process that exist now; `None` once they have been
/// removed for good.
static LIVE: Mutex<Option<BTreeSet<PathBuf>>> = Mutex::new(Some(BTreeSet::new()));

/// How often a temporary file is made anew that another process removed at once.
const ATTEMPTS: usize = 100;

/// Removes the temporary files and folders of this process, which can make no others from then
/// on. Call it before exiting without running destructors.
///
/// Gives up after a second if another thread keeps them: that thread may be stopped. The next
/// process that writes to their folders removes them.
pub fn remove_temporaries() {
    let locked = (0..100).find_map(|_| match LIVE.try_lock() {
        Ok(live) => Some(live),
        // The set is valid even if a thread panicked while it held the lock.
        Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
        Err(TryLockError::WouldBlock) => {
            thread::sleep(Duration::from_millis(10));
            None
        }
    });
    let Some(mut live) = locked else { return };
    // Nothing gets its final name while it is being removed: the lock is held.
    for path in live.take().unwrap_or_default() {
        // A folder that another thread still fills may need several attempts.
        let remove = || fs::remove_file(&path).or_else(|_| fs::remove_dir_all(&path));
        let _ = (0..100).find(|_| remove().is_ok() || !path.exists());
    }
}

fn live() -> MutexGuard<'static, Option<BTreeSet<PathBuf>>> {
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Keeps a path in [`LIVE`] until it is dropped.
struct Registered(PathBuf);

impl Registered {
    /// Makes a file or folder, unless [`remove_temporaries`] was faster. Nobody can remove all
    /// meanwhile, and miss it.
    fn made<T: AsRef<Path>>(make: impl FnOnce() -> io::Result<T>) -> io::Result<(T, Self)> {
        let mut live = live();
        let live = live.as_mut().ok_or(io::ErrorKind::Interrupted)?;
        let made = make()?;
        let path = made.as_ref().to_owned();
        live.insert(path.clone());
        Ok((made, Self(path)))
    }

    /// Gives the file or folder another name, unless [`remove_temporaries`] was faster.
    fn rename<T, E: From<io::Error>>(&self, rename: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        let live = live();
        if !live.as_ref().is_some_and(|live| live.contains(&self.0)) {
            return Err(io::Error::from(io::ErrorKind::Interrupted).into());
        }
        rename()
    }
}

impl Drop for Registered {
    fn drop(&mut self) {
        if let Some(live) = live().as_mut() {
            live.remove(&self.0);
        }
    }
}

/// A temporary file in the folder of its final path, removed on drop unless [`persist`]ed.
///
/// Its name tells the final one, and a lock that it is in use. What writers that were killed left
/// in that folder is removed.
///
/// [`persist`]: Self::persist
pub struct FileBeside {
    file: NamedTempFile,
    registered: Registered,
    path: PathBuf,
}

impl FileBeside {
    /// Creates a file that will become `path`, with the permissions of an existing file there.
    ///
    /// # Errors
    /// Returns an error if no file can be created in that folder.
    pub fn new(path: &Path) -> io::Result<Self> {
        let folder = folder_of(path)?;
        remove_leftovers(folder);
        let start = start_of_name(path);
        let builder = builder(&start, 0o666);
        for _ in 0..ATTEMPTS {
            let (file, registered) = Registered::made(|| builder.tempfile_in(folder))?;
            if !claim(file.as_file(), file.path()) {
                continue;
            }
            if let Ok(before) = fs::metadata(path) {
                file.as_file().set_permissions(before.permissions())?;
            }
            return Ok(Self { file, registered, path: path.to_owned() });
        }
        Err(cannot_claim())
    }

    /// Returns the file, for writing.
    pub fn file(&mut self) -> &mut File {
        self.file.as_file_mut()
    }

    /// Renames the file to its final name.
    ///
    /// # Errors
    /// Returns an error if renaming fails.
    pub fn persist(self) -> io::Result<()> {
        let Self { file, registered, path } = self;
        registered.rename(|| file.persist(path).map(drop).map_err(|error| error.error))
    }
}

/// A temporary folder, otherwise like [`FileBeside`].
pub struct FolderBeside {
    folder: TempDir,
    registered: Registered,
    path: PathBuf,
    replaces: bool,
    /// Holds the lock, where the system locks folders.
    _handle: Option<File>,
}

impl FolderBeside {
    /// Creates a folder that will become `path`, which must be an empty folder or not exist.
    ///
    /// # Errors
    /// Returns an error if `path` is anything else, or no folder can be created there.
    pub fn over_nothing(path: &Path) -> Result<Self, StackError> {
        Self::new(path, false)
    }

    /// Creates a folder that will become `path`, and then replaces a folder there. That may only
    /// hold files with the names of pages, ranges of layers, strips, targets, plans or pictures, as this
    /// workspace writes them. It stays until the new one is complete.
    ///
    /// # Errors
    /// Returns an error if `path` is anything else, or no folder can be created there.
    pub fn replacing(path: &Path) -> Result<Self, StackError> {
        Self::new(path, true)
    }

    fn new(path: &Path, replaces: bool) -> Result<Self, StackError> {
        // A folder is replaced, not a link to it.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        check_replaceable(&path, replaces)?;
        let parent = folder_of(&path)?;
        remove_leftovers(parent);
        let start = start_of_name(&path);
        let builder = builder(&start, 0o777);
        for _ in 0..ATTEMPTS {
            let (folder, registered) = Registered::made(|| builder.tempdir_in(parent))?;
            let handle = match File::open(folder.path()) {
                Ok(handle) if claim(&handle, folder.path()) => Some(handle),
                // Another process took it for a dead writer's before it was locked.
                Ok(_) => continue,
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(_) => None,
            };
            return Ok(Self { folder, registered, path, replaces, _handle: handle });
        }
        Err(cannot_claim().into())
    }

    /// Returns the folder's temporary path.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Renames the folder to its final name, and removes the one that it replaces.
    ///
    /// # Errors
    /// Returns an error if there is something now that is not to be replaced, or renaming fails.
    pub fn persist(self) -> Result<(), StackError> {
        let (from, to) = (self.folder.path(), &self.path);
        let replaced =
            self.registered.rename(|| put_in_place(from, to, self.replaces, exchange))?;
        let from = self.folder.keep();
        if replaced {
            // What remains of it is removed as a dead writer's.
            let _ = fs::remove_dir_all(from);
        }
        Ok(())
    }
}

/// Waits until no other process gives a folder its name in `parent`, and has the others wait as
/// long as the file lives. An exchange in steps must not meet another.
///
/// Gives up after ten seconds, and at once on a file system without locks.
fn turn_in(parent: &Path) -> Option<File> {
    let handle = File::open(parent).ok()?;
    for _ in 0..1000 {
        match handle.try_lock() {
            Ok(()) => return Some(handle),
            Err(fs::TryLockError::WouldBlock) => thread::sleep(Duration::from_millis(10)),
            Err(fs::TryLockError::Error(_)) => break,
        }
    }
    None
}

/// Gives a folder its final name. Returns whether it has replaced one, which now has its own.
fn put_in_place(
    from: &Path,
    to: &Path,
    replaces: bool,
    exchange: fn(&Path, &Path) -> io::Result<()>,
) -> Result<bool, StackError> {
    use io::ErrorKind::{AlreadyExists, DirectoryNotEmpty, NotFound};
    let _turn = turn_in(folder_of(to)?);
    loop {
        let replaced = check_replaceable(to, replaces)? == Existing::Replaceable;
        match if replaced { exchange(from, to) } else { fs::rename(from, to) } {
            // Another process was faster.
            Err(error)
                if !replaced && matches!(error.kind(), AlreadyExists | DirectoryNotEmpty) => {}
            Err(error) if replaced && error.kind() == NotFound && !to.exists() => {}
            done => return Ok(done.map(|()| replaced)?),
        }
    }
}

/// Exchanges two folders.
fn exchange(new: &Path, old: &Path) -> io::Result<()> {
    exchange_at_once(new, old).or_else(|_| exchange_in_steps(new, old))
}

/// Exchanges two folders so that a process that ends at any time leaves one of them in place. Some
/// file systems cannot.
#[cfg(target_os = "linux")]
fn exchange_at_once(new: &Path, old: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, new, CWD, old, RenameFlags::EXCHANGE)?)
}

#[cfg(not(target_os = "linux"))]
fn exchange_at_once(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Exchanges two folders. The old one is aside for a moment, under a name that nothing removes.
fn exchange_in_steps(new: &Path, old: &Path) -> io::Result<()> {
    let aside = new.with_extension("old");
    fs::rename(old, &aside)?;
    fs::rename(new, old).inspect_err(|_| drop(fs::rename(&aside, old)))?;
    fs::rename(aside, new)
}

/// What stands where a folder will be.
#[derive(PartialEq, Eq)]
enum Existing {
    /// Nothing, or an empty folder.
    Nothing,
    /// A folder that an earlier run wrote.
    Replaceable,
}

fn check_replaceable(path: &Path, replaces: bool) -> Result<Existing, StackError> {
    let entries = match fs::read_dir(path) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Existing::Nothing),
        Err(_) => return Err(StackError::Exists),
    };
    let mut existing = Existing::Nothing;
    for entry in entries {
        if !replaces {
            return Err(StackError::Exists);
        }
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let is_file = match entry.file_type() {
            Ok(kind) => kind.is_file(),
            // Another process has replaced the folder meanwhile.
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(error) => return Err(error.into()),
        };
        if !is_file || !is_name_in_folders(&name) {
            return Err(StackError::NotReplaceable { name: one_line(&name) });
        }
        existing = Existing::Replaceable;
    }
    Ok(existing)
}

/// Returns whether commands give that name to files in the folders that they write.
fn is_name_in_folders(name: &str) -> bool {
    const STARTS: [&str; 5] = ["check_", "layer_", "layers_", "strip_", "squares_"];
    let numbered = |start: &&str| {
        name.strip_prefix(start).is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
    };
    let is_image = name.ends_with(".tif") || name.ends_with(".png");
    let is_of_plan = matches!(
        name,
        "bitmaps.tif" | "report.json" | "section.svg" | "residual.png" | "times.png"
    );
    let is_report = name == "index.html" || name.ends_with(".html") && numbered(&"report_");
    matches!(name, "strips.json" | "squares.csv")
        || is_of_plan
        || is_report
        || is_image && STARTS.iter().any(numbered)
}

/// Returns the parent folder of `path`.
fn folder_of(path: &Path) -> io::Result<&Path> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if folder.is_dir() {
        return Ok(folder);
    }
    let message = format!("there is no folder {}: make it first", folder.display());
    Err(io::Error::new(io::ErrorKind::NotFound, message))
}

fn cannot_claim() -> io::Error {
    io::Error::other("other programs remove its temporary files as soon as they are made")
}

/// Returns a builder of temporary names that start with `start`. They have the usual permissions
/// of new files (subject to the umask) instead of the private ones of temporary files.
fn builder(start: &str, mode: u32) -> Builder<'_, 'static> {
    let mut builder = Builder::new();
    builder.prefix(start).rand_bytes(RANDOM_LETTERS).suffix(END);
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(mode));
    #[cfg(not(unix))]
    let _ = mode;
    builder
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_exchanged_at_once_or_in_steps() {
        for exchange in [exchange, exchange_in_steps] {
            let folder = tempfile::tempdir().unwrap();
            let [new, old] = [".a.lamp-aaaaaa.part", "a"].map(|name| folder.path().join(name));
            for (path, page) in [(&new, "new"), (&old, "old")] {
                fs::create_dir(path).unwrap();
                fs::write(path.join(page), "").unwrap();
            }
            exchange(&new, &old).unwrap();
            assert!(old.join("new").exists() && new.join("old").exists());
            // What cannot be exchanged stays where it is.
            assert!(exchange(&folder.path().join("none"), &old).is_err());
            assert!(old.join("new").exists());
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
        }
    }

    #[test]
    fn folders_that_replace_one_at_once_do_so_in_turn() {
        let folder = tempfile::tempdir().unwrap();
        let to = folder.path().join("a");
        let replace = &|writer: usize| {
            for _ in 0..50 {
                let from = folder.path().join(format!(".a.lamp-aaaaa{writer}.part"));
                fs::create_dir(&from).unwrap();
                fs::write(from.join("layer_00000.tif"), "").unwrap();
                if put_in_place(&from, &to, true, exchange_in_steps).unwrap() {
                    fs::remove_dir_all(from).unwrap();
                }
            }
        };
        thread::scope(|scope| (0..4).for_each(|writer| drop(scope.spawn(move || replace(writer)))));
        let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(Result::unwrap).collect();
        assert_eq!(left.iter().map(fs::DirEntry::path).collect::<Vec<_>>(), [to]);
    }

    #[test]
    fn only_folders_of_numbered_images_are_replaced() {
        for ours in ["layer_00812.tif", "layer_00812.png", "layers_00500-00999.tif"] {
            assert!(is_name_in_folders(ours), "{ours}");
        }
        for ours in ["layer_00007_rows_00001-00002_left.png", "strip_000.tif", "strips.json"] {
            assert!(is_name_in_folders(ours), "{ours}");
        }
        assert!(
            ["bitmaps.tif", "report.json", "times.png"].iter().all(|name| is_name_in_folders(name))
        );
        assert!(["squares_00025px.tif", "squares.csv"].iter().all(|name| is_name_in_folders(name)));
        for other in ["thesis.doc", "layer.png", "layer_a.png", "img_0001.png", "layer_1.stl", ""] {
            assert!(!is_name_in_folders(other), "{other}");
        }
    }

    #[test]
    fn what_was_removed_gets_no_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("build.tif");
        let file = FileBeside::new(&path).unwrap();
        // As a signal does, but for this one alone: other tests run in this process.
        live().as_mut().unwrap().remove(file.file.path());
        assert_eq!(file.persist().unwrap_err().kind(), io::ErrorKind::Interrupted);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
