//! The list of a folder that was written whole, by which it is known who made it.

use std::path::Path;
use std::{fs, io};

/// The file in a folder that lists the others, so that it is known who made them.
pub const FOLDER_LIST: &str = ".lamp-folder";

/// Returns a line on what the list of a folder is for, and the names of its files.
pub(crate) fn list_of(folder: &Path) -> io::Result<String> {
    let names = fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name()));
    let mut names = names.collect::<io::Result<Vec<_>>>()?;
    names.sort_unstable();
    let first = "lamp wrote the files below. With --force it replaces a folder of no others.";
    let lines = names.iter().map(|name| name.to_string_lossy());
    Ok([first.into()]
        .into_iter()
        .chain(lines)
        .fold(String::new(), |text, line| text + &line + "\n"))
}
