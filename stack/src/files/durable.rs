//! Hands what was written over to the disk.
//!
//! A disk may fail after the last write: a thinly provisioned one is full, a network takes files only
//! as they are closed. The system then reports it as a file is synced or closed, and nowhere else.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

static SKIPS_SYNC: AtomicBool = AtomicBool::new(false);

/// Lets outputs of this process have their names before the disk has their bytes, so that a loss of
/// power, or a disk that fails late, may take them. For disks whose files can be made again.
pub fn skip_sync() {
    // The flag guards no other data, so its order does not matter.
    SKIPS_SYNC.store(true, Ordering::Relaxed);
}

/// Waits until the disk has all of an open file, or all names of an open folder. Pipes, devices and
/// file systems that cannot sync are passed over.
///
/// # Errors
/// Returns an error if the disk could not take it.
pub fn sync(file: &File) -> io::Result<()> {
    if SKIPS_SYNC.load(Ordering::Relaxed) {
        return Ok(());
    }
    match file.sync_all() {
        Err(error) if is_unable(&error) => Ok(()),
        done => done,
    }
}

/// Returns true if nothing of that kind can be synced.
fn is_unable(error: &io::Error) -> bool {
    // fsync(2): EINVAL and EROFS say that pipes and other special files cannot be synced.
    #[cfg(unix)]
    if matches!(error.raw_os_error(), Some(libc::EINVAL | libc::ENOTSUP | libc::EROFS)) {
        return true;
    }
    error.kind() == io::ErrorKind::Unsupported
}

/// Closes a file that was written to.
///
/// # Errors
/// Returns an error if the system could not keep what was written.
#[cfg(unix)]
#[expect(unsafe_code, reason = "the standard library drops what close returns")]
pub fn close(file: File) -> io::Result<()> {
    use std::os::fd::IntoRawFd;
    // SAFETY: the descriptor was owned by `file` alone, and nothing uses it from here on.
    match unsafe { libc::close(file.into_raw_fd()) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

/// Closes a file that was written to.
///
/// # Errors
/// None on this system.
#[cfg(not(unix))]
pub fn close(file: File) -> io::Result<()> {
    drop(file);
    Ok(())
}

/// Waits until the disk has the names in a folder.
#[cfg(unix)]
pub(crate) fn sync_folder(folder: &Path) -> io::Result<()> {
    sync(&File::open(folder)?)
}

/// Other systems keep names by themselves, and open no folders.
#[cfg(not(unix))]
pub(crate) fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

/// Waits until the disk has a folder of files: their bytes, and then their names.
pub(crate) fn sync_all_in(folder: &Path) -> io::Result<()> {
    let files = fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
    let files = files.collect::<io::Result<Vec<_>>>()?;
    // Disks take many at once; an error of a file is reported to whoever syncs it first.
    // Windows synchronizes only files that are open for writing.
    let open = |file: &PathBuf| OpenOptions::new().read(true).write(cfg!(windows)).open(file);
    files.par_iter().try_for_each(|file| sync(&open(file)?))?;
    sync_folder(folder)
}
