//! Texts of files, and materials, machines and projectors as they are printed.

use std::path::Path;

use lamp_pipeline::documents::{self, Document, document_and_text};

use crate::exit::{Exit, boxed};
use crate::streams::print;

/// Prints a document's file as it was written, once it is checked.
pub(crate) fn show<T: Document>(path: &Path) -> Result<(), Exit> {
    print(&document_and_text::<T>(path)?.1)
}

/// Reads a text of at most `max` bytes. `what` is the word for it in messages.
pub(crate) fn read_text(path: &Path, max: u64, what: &str) -> anyhow::Result<String> {
    let text = documents::read_text(path, max, what);
    text.map_err(|error| boxed(error.into_parts().0))
}
