//! Writes folders of single-page files.

use std::io;

use crate::error::StackError;
use crate::files::temporary::FolderBeside;
use crate::layer::check::CheckChain;

/// An encoded page that becomes a file of its own.
pub(crate) trait PageFile {
    /// Returns the file's name.
    fn name(&self) -> String;

    /// Returns the file's bytes. The page is one of several that `chain` runs through.
    fn bytes(&self, chain: &mut CheckChain, is_last: bool) -> Vec<u8>;
}

/// A folder of pages that is being written. One page is held back, because the last one says so.
pub(crate) struct PageFolder<P> {
    folder: FolderBeside,
    chain: CheckChain,
    held: Option<P>,
}

impl<P: PageFile> PageFolder<P> {
    pub(crate) fn new(folder: FolderBeside) -> Self {
        Self { folder, chain: CheckChain::default(), held: None }
    }

    /// Adds a page.
    pub(crate) fn push(&mut self, page: P) -> Result<(), StackError> {
        match self.held.replace(page) {
            Some(before) => Ok(self.write(&before, false)?),
            None => Ok(()),
        }
    }

    /// Writes the last page, and gives the folder its name.
    pub(crate) fn finish(mut self) -> Result<(), StackError> {
        let last = self.held.take().ok_or(StackError::NoLayers)?;
        self.write(&last, true)?;
        self.folder.persist()
    }

    fn write(&mut self, page: &P, is_last: bool) -> io::Result<()> {
        let bytes = page.bytes(&mut self.chain, is_last);
        self.folder.add(&page.name(), |out| out.write_all(&bytes))
    }
}
