//! Results that are being written.

use std::fs::File;
use std::io::{self, Seek};
use std::path::Path;
use std::sync::Arc;

use lamp_stack::{FileBeside, digest_of};

use super::manifest::Written;

/// A result that is being written, under a temporary name and locked. Dropped, it is removed.
pub struct Unpublished {
    beside: FileBeside,
}

impl Unpublished {
    pub(super) fn new(path: &Path) -> io::Result<Self> {
        Ok(Self { beside: FileBeside::new(path)? })
    }

    /// Returns the file, for writing.
    pub fn file(&self) -> Arc<File> {
        self.beside.file()
    }

    /// Gives the result its place, read-only, synced, and its folder, too.
    ///
    /// # Errors
    /// Returns an error if it cannot be read, synced or renamed.
    pub fn finish(self) -> io::Result<Written> {
        let mut file = self.beside.file();
        file.rewind()?;
        // Writers hold the file itself, so only the finished file shows all bytes.
        let digest = digest_of(&*file)?;
        let metadata = file.metadata()?;
        let mut permissions = metadata.permissions();
        // Later runs find the result by its key and expect these bytes.
        permissions.set_readonly(true);
        file.set_permissions(permissions)?;
        drop(file);
        self.beside.persist()?;
        Ok(Written { digest, bytes: metadata.len() })
    }
}
