//! Files and folders that get their name only when they are complete.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use tempfile::{Builder, NamedTempFile, TempDir};

use crate::error::StackError;

/// What would remain if the process were ended now.
static LIVE: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// How temporary names start: hidden, and short whatever the final name.
const PREFIX: &str = ".lamp-";

/// Removes the temporary files and folders of this process: to be called
/// before it ends without running destructors.
pub fn remove_temporaries() {
    // A thread that panicked with the lock left the set as good as any.
    let mut live = LIVE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    for path in std::mem::take(&mut *live) {
        // What is gone or renamed already is as it should be. A folder that
        // is still being filled may take several goes.
        let remove = || fs::remove_file(&path).or_else(|_| fs::remove_dir_all(&path));
        let _ = (0..100).find(|_| remove().is_ok() || !path.exists());
    }
}

/// Keeps a path among those to remove.
struct Registered(PathBuf);

impl Registered {
    fn new(path: &Path) -> Self {
        LIVE.lock().unwrap_or_else(std::sync::PoisonError::into_inner).insert(path.to_owned());
        Self(path.to_owned())
    }
}

impl Drop for Registered {
    fn drop(&mut self) {
        LIVE.lock().unwrap_or_else(std::sync::PoisonError::into_inner).remove(&self.0);
    }
}

/// A new file beside its final place, gone again unless [`persist`]ed.
///
/// [`persist`]: Self::persist
pub struct FileBeside {
    file: NamedTempFile,
    _registered: Registered,
    path: PathBuf,
}

impl FileBeside {
    /// Makes a file that is to be `path`, with the permissions of what stands
    /// there now.
    ///
    /// # Errors
    /// Where no file can be made in that folder.
    pub fn new(path: &Path) -> io::Result<Self> {
        let mut builder = Builder::new();
        set_mode(&mut builder, 0o666);
        let file = builder.prefix(PREFIX).suffix(".part").tempfile_in(folder_of(path)?)?;
        if let Ok(before) = fs::metadata(path) {
            file.as_file().set_permissions(before.permissions())?;
        }
        let registered = Registered::new(file.path());
        Ok(Self { file, _registered: registered, path: path.to_owned() })
    }

    /// The file, to write to.
    pub fn file(&mut self) -> &mut fs::File {
        self.file.as_file_mut()
    }

    /// Gives the file its final name.
    ///
    /// # Errors
    /// Where it cannot be renamed.
    pub fn persist(self) -> io::Result<()> {
        self.file.persist(self.path).map_err(|error| error.error)?;
        Ok(())
    }
}

/// As [`FileBeside`], a folder.
pub struct FolderBeside {
    folder: TempDir,
    _registered: Registered,
    path: PathBuf,
}

impl FolderBeside {
    fn new(path: &Path) -> io::Result<Self> {
        let mut builder = Builder::new();
        set_mode(&mut builder, 0o777);
        let folder = builder.prefix(PREFIX).suffix(".part").tempdir_in(folder_of(path)?)?;
        let registered = Registered::new(folder.path());
        Ok(Self { folder, _registered: registered, path: path.to_owned() })
    }

    /// A new folder that is to be `path`, where nothing may stand but an
    /// empty folder.
    ///
    /// # Errors
    /// Where something does, or no folder can be made there.
    pub fn over_nothing(path: &Path) -> Result<Self, StackError> {
        let is_empty = || fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none());
        if path.exists() && !is_empty() {
            return Err(StackError::Exists);
        }
        Ok(Self::new(path)?)
    }

    /// Where it is for now: what is put there comes along.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Gives the folder its final name.
    ///
    /// # Errors
    /// Where it cannot be renamed.
    pub fn persist(self) -> io::Result<()> {
        fs::rename(self.folder.path(), &self.path)?;
        // The folder has another name now: there is nothing to remove.
        let _ = self.folder.keep();
        Ok(())
    }
}

/// The folder that `path` is to stand in.
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

/// Gives the permissions that other programs' new files have (the umask
/// applies), not those of private temporary files.
fn set_mode(builder: &mut Builder<'_, '_>, mode: u32) {
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(mode));
    #[cfg(not(unix))]
    let _ = (builder, mode);
}
