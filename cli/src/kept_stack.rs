//! Stacks that are read more than once.

use std::fs::File;
use std::io::Seek;
use std::path::{Path, PathBuf};

use lamp_stack::{Pages, StackError};

use crate::exit::Exit;
use crate::streams::{failed_at, input_name, is_stream, open_pages, spool_stdin};
use crate::terminal::stack_notes::noting;

/// A stack that can be read again.
pub(crate) struct KeptStack {
    pub(crate) path: PathBuf,
    /// Standard input, kept.
    spooled: Option<File>,
}

impl KeptStack {
    pub(crate) fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), spooled: None }
    }

    /// Opens the pages; standard input is kept if it will be read `again`.
    pub(crate) fn pages(&mut self, again: bool) -> Result<Pages, Exit> {
        // Standard input that is read once needs no copy.
        if !is_stream(&self.path) || (!again && self.spooled.is_none()) {
            return open_pages(&self.path);
        }
        let reopened = |file: &File| -> Result<Pages, StackError> {
            let mut file = file.try_clone()?;
            // Clones share one position in the file.
            file.rewind()?;
            Pages::from_file(file)
        };
        let file = self.spooled.take().map_or_else(spool_stdin, Ok)?;
        let pages = reopened(&file).map_err(|error| failed_at(input_name(&self.path), error));
        self.spooled = Some(file);
        Ok(noting(pages?, &self.path))
    }
}
