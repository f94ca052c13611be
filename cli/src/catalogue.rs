//! Texts of files, and materials, machines and projectors as they are printed.

use std::path::Path;

use lamp_pipeline::documents::{self, Document, document_and_text, own_names};

use crate::exit::{Exit, boxed};
use crate::streams::print;
use crate::terminal::progress::Severity;

/// Prints a document's file as it was written, once it is checked.
pub(crate) fn show<T: Document>(path: &Path) -> Result<(), Exit> {
    print(&document_and_text::<T>(path)?.1)
}

/// Returns all documents of a kind that have a name: the built-in ones, then the user's own. A
/// warning names each file of the user's that is wrong.
pub(crate) fn named<T: Document>() -> Vec<T> {
    let own = own_names::<T>().into_iter().filter_map(|name| {
        let read = documents::document(Path::new(&name));
        read.inspect_err(|error| Severity::Warning.say(&error.to_string())).ok()
    });
    T::builtins().chain(own).collect()
}

/// Reads a text of at most `max` bytes. `what` is the word for it in messages.
pub(crate) fn read_text(path: &Path, max: u64, what: &str) -> anyhow::Result<String> {
    let text = documents::read_text(path, max, what);
    text.map_err(|error| boxed(error.into_parts().0))
}
