//! Creates files and folders that get their name only when they are complete.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use tempfile::{Builder, NamedTempFile, TempDir};

use crate::error::StackError;

/// The temporary files and folders that exist now.
static LIVE: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// The prefix of temporary names: hidden, and short even if the final name is long.
const PREFIX: &str = ".lamp-";

/// Removes the temporary files and folders of this process. Call it before exiting without
/// running destructors.
pub fn remove_temporaries() {
    // The set is valid even if a thread panicked while it held the lock.
    let mut live = LIVE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    for path in std::mem::take(&mut *live) {
        // The path may already be removed or renamed. A folder that another thread still
        // fills may need several attempts.
        let remove = || fs::remove_file(&path).or_else(|_| fs::remove_dir_all(&path));
        let _ = (0..100).find(|_| remove().is_ok() || !path.exists());
    }
}

/// Keeps a path in [`LIVE`] until it is dropped.
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

/// A temporary file in the folder of its final path, removed on drop unless [`persist`]ed.
///
/// [`persist`]: Self::persist
pub struct FileBeside {
    file: NamedTempFile,
    _registered: Registered,
    path: PathBuf,
}

impl FileBeside {
    /// Creates a file that will become `path`, with the permissions of an existing file there.
    ///
    /// # Errors
    /// Returns an error if no file can be created in that folder.
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

    /// Returns the file, for writing.
    pub fn file(&mut self) -> &mut fs::File {
        self.file.as_file_mut()
    }

    /// Renames the file to its final name.
    ///
    /// # Errors
    /// Returns an error if renaming fails.
    pub fn persist(self) -> io::Result<()> {
        self.file.persist(self.path).map_err(|error| error.error)?;
        Ok(())
    }
}

/// A temporary folder, otherwise like [`FileBeside`].
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

    /// Creates a folder that will become `path`, which must be an empty folder or not exist.
    ///
    /// # Errors
    /// Returns an error if `path` is anything else, or no folder can be created there.
    pub fn over_nothing(path: &Path) -> Result<Self, StackError> {
        let is_empty = || fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none());
        if path.exists() && !is_empty() {
            return Err(StackError::Exists);
        }
        Ok(Self::new(path)?)
    }

    /// Returns the folder's temporary path.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Renames the folder to its final name.
    ///
    /// # Errors
    /// Returns an error if renaming fails.
    pub fn persist(self) -> io::Result<()> {
        fs::rename(self.folder.path(), &self.path)?;
        // The folder has been renamed, so there is nothing to remove.
        let _ = self.folder.keep();
        Ok(())
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

/// Sets the usual permissions of new files (subject to the umask) instead of the private
/// ones of temporary files.
fn set_mode(builder: &mut Builder<'_, '_>, mode: u32) {
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(mode));
    #[cfg(not(unix))]
    let _ = (builder, mode);
}
