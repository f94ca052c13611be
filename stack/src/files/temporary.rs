//! Creates files and folders that get their name only when they are complete.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, IntoInnerError, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread;
use std::time::Duration;

use tempfile::{Builder, NamedTempFile, TempDir, TempPath};

use crate::error::StackError;
use crate::files::durable::{close, sync, sync_all_in, sync_folder};
use crate::files::folder_list::{FOLDER_LIST, list_of};
use crate::files::leftovers::{END, RANDOM_LETTERS, claim, remove_leftovers, start_of_name};
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
/// Its name contains the final one, and its lock shows that it is in use. Files that killed writers
/// left in that folder are removed.
///
/// [`persist`]: Self::persist
pub struct FileBeside {
    file: Arc<File>,
    temporary: TempPath,
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
            let (file, temporary) = file.into_parts();
            return Ok(Self { file: file.into(), temporary, registered, path: path.to_owned() });
        }
        Err(cannot_claim())
    }

    /// Returns the file, for writing. All writers to it must be gone before it gets its name.
    pub fn file(&self) -> Arc<File> {
        self.file.clone()
    }

    /// Renames the file to its final name once the disk has all of it, and waits until the disk has
    /// the name.
    ///
    /// # Errors
    /// Returns an error if the disk cannot take it, or renaming fails.
    pub fn persist(self) -> io::Result<()> {
        sync(&self.file)?;
        let path = self.path.clone();
        self.persist_lightly()?;
        sync_folder(folder_of(&path)?)
    }

    /// Renames the file to its final name. A loss of power may lose it, so that it must be one
    /// which can be made again.
    ///
    /// # Errors
    /// Returns an error if the file cannot be closed, or renaming fails.
    pub fn persist_lightly(self) -> io::Result<()> {
        let Self { file, temporary, registered, path } = self;
        // Its lock lasts as long as this does.
        let _lock = file.try_clone()?;
        close(Arc::into_inner(file).ok_or_else(|| io::Error::other("it is still being written"))?)?;
        registered.rename(|| {
            // On Windows, the standard library's rename replaces a file that others have open.
            let kept = temporary.keep().map_err(|error| error.error)?;
            fs::rename(&kept, path).inspect_err(|_| drop(fs::remove_file(&kept)))
        })
    }
}

/// A temporary folder, otherwise like [`FileBeside`].
pub struct FolderBeside {
    /// Holds the lock, where the system locks folders. Dropped first: Windows removes no folder that
    /// is open.
    _handle: Option<File>,
    folder: TempDir,
    registered: Registered,
    path: PathBuf,
    replaces: bool,
}

impl FolderBeside {
    /// Creates a folder that will become `path`, which must be an empty folder or not exist.
    ///
    /// # Errors
    /// Returns an error if `path` is anything else, or no folder can be created there.
    pub fn over_nothing(path: &Path) -> Result<Self, StackError> {
        Self::new(path, false)
    }

    /// Creates a folder that will become `path`, and then replaces a folder there. Its files must all
    /// be in its [`FOLDER_LIST`]. It stays until the new one is complete.
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
                // Another process mistook it for a dead writer's before it was locked.
                Ok(_) => continue,
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(_) => None,
            };
            return Ok(Self { _handle: handle, folder, registered, path, replaces });
        }
        Err(cannot_claim().into())
    }

    /// Returns the folder's temporary path.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Adds a file.
    ///
    /// # Errors
    /// Returns an error if the file is there, or cannot be written.
    pub fn add<E: From<io::Error>>(
        &self,
        name: &str,
        write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
    ) -> Result<(), E> {
        let file = File::create_new(self.path().join(name))?;
        let mut out = BufWriter::with_capacity(1 << 16, file);
        write(&mut out)?;
        Ok(close(out.into_inner().map_err(IntoInnerError::into_error)?)?)
    }

    /// Lists the folder's files in it, waits until the disk has them, renames the folder to its final
    /// name, and removes the one that it replaces.
    ///
    /// # Errors
    /// Returns an error if the disk cannot take it, there is something now that is not to be replaced,
    /// or renaming fails.
    pub fn persist(self) -> Result<(), StackError> {
        let (from, to) = (self.folder.path(), &self.path);
        let list = list_of(from)?;
        self.add(FOLDER_LIST, |out| out.write_all(list.as_bytes()))?;
        sync_all_in(from)?;
        let replaced =
            self.registered.rename(|| put_in_place(from, to, self.replaces, exchange))?;
        sync_folder(folder_of(to)?)?;
        let from = self.folder.keep();
        if replaced {
            // The rest of it is removed as a dead writer's.
            let _ = fs::remove_dir_all(from);
        }
        Ok(())
    }
}

/// A file for another program, which its owner alone may read (mode 600). It is
/// removed on drop, and by [`remove_temporaries`].
pub struct PrivateFile {
    file: NamedTempFile,
    _registered: Registered,
}

impl PrivateFile {
    /// Writes a file with a name between `start` and `end` that nobody can guess.
    ///
    /// It is in the user's folder for the session (`XDG_RUNTIME_DIR`), which is not on a disk, or
    /// in the folder for temporary files.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn new(start: &str, end: &str, content: &[u8]) -> io::Result<Self> {
        let session = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
        let session = session.filter(|folder| folder.is_absolute());
        let written = session.map(|folder| Self::within(&folder, start, end, content));
        match written {
            Some(Ok(file)) => Ok(file),
            _ => Self::within(&std::env::temp_dir(), start, end, content),
        }
    }

    fn within(folder: &Path, start: &str, end: &str, content: &[u8]) -> io::Result<Self> {
        let mut builder = Builder::new();
        builder.prefix(start).suffix(end).rand_bytes(RANDOM_LETTERS);
        // The mode is set before anything is written; a file with this name is not taken over.
        let (mut file, registered) = Registered::made(|| builder.tempfile_in(folder))?;
        file.write_all(content)?;
        file.flush()?;
        Ok(Self { file, _registered: registered })
    }

    /// Returns the file's path.
    pub fn path(&self) -> &Path {
        self.file.path()
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
        if cfg!(windows) && !replaced {
            // Only an empty folder goes, which other systems replace by themselves.
            let _ = fs::remove_dir(to);
        }
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

/// The state of the place where a folder will be.
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
    let names = entries.map(|entry| Ok(entry?.file_name())).collect::<io::Result<Vec<_>>>()?;
    if names.is_empty() {
        return Ok(Existing::Nothing);
    }
    if !replaces {
        return Err(StackError::Exists);
    }
    let list = match fs::read_to_string(path.join(FOLDER_LIST)) {
        Ok(list) => list,
        // Another process has replaced the folder meanwhile.
        Err(_) if !path.exists() => return Ok(Existing::Nothing),
        Err(_) => return Err(StackError::NotOurs),
    };
    let listed: BTreeSet<&str> = list.lines().skip(1).chain([FOLDER_LIST]).collect();
    let is_listed = |name: &&OsString| name.to_str().is_some_and(|name| listed.contains(name));
    match names.iter().find(|name| !is_listed(name)) {
        Some(name) => Err(StackError::NotReplaceable { name: one_line(&name.to_string_lossy()) }),
        None => Ok(Existing::Replaceable),
    }
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
            // Folders that cannot be exchanged stay where they are.
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
                fs::write(from.join(FOLDER_LIST), "\n").unwrap();
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
    fn only_a_folder_of_listed_files_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let site = folder.path().join("site");
        let write = |text: &str| {
            let new = FolderBeside::replacing(&site)?;
            new.add("index.html", |out| out.write_all(text.as_bytes()))?;
            new.persist()
        };
        fs::create_dir(&site).unwrap();
        fs::write(site.join("index.html"), "mine").unwrap();
        assert!(matches!(write("ours"), Err(StackError::NotOurs)));
        fs::remove_file(site.join("index.html")).unwrap();
        write("first").unwrap();
        write("second").unwrap();
        for name in ["notes", "layer_00001.tif"] {
            fs::write(site.join(name), "mine").unwrap();
            let refused = write("third").unwrap_err();
            assert!(matches!(refused, StackError::NotReplaceable { name: of } if of == name));
            fs::remove_file(site.join(name)).unwrap();
        }
        assert_eq!(fs::read(site.join("index.html")).unwrap(), b"second");
        fs::create_dir(site.join("more")).unwrap();
        assert!(matches!(write("third"), Err(StackError::NotReplaceable { .. })));
    }

    #[test]
    fn what_was_removed_gets_no_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("build.tif");
        let file = FileBeside::new(&path).unwrap();
        // As a signal does, for this file alone: other tests run in this process.
        live().as_mut().unwrap().remove(&*file.temporary);
        assert_eq!(file.persist().unwrap_err().kind(), io::ErrorKind::Interrupted);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
