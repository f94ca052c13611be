//! The files of a folder, and whether they are parts.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use lamp_slicing::{OpenOptions, Part};
use lamp_stack::{FORMAT_BYTES, FileFormat, PartFormat};

use crate::exit::Exit;

/// The entries of a folder, each list by name.
#[derive(Default)]
pub(super) struct FolderEntries {
    pub(super) files: Vec<PathBuf>,
    pub(super) folders: Vec<PathBuf>,
}

impl FolderEntries {
    /// Reads a folder, without the folders in it.
    pub(super) fn of(folder: &Path) -> io::Result<Self> {
        let mut entries = Self::default();
        for entry in fs::read_dir(folder)? {
            let path = folder.join(entry?.file_name());
            let list = if path.is_dir() { &mut entries.folders } else { &mut entries.files };
            list.push(path);
        }
        entries.files.sort_unstable();
        entries.folders.sort_unstable();
        Ok(entries)
    }
}

/// Returns why a file is not read as a part, if it is not.
pub(super) fn why_no_part(path: &Path) -> Option<String> {
    match format_of(path) {
        Err(error) => Some(error.to_string()),
        // Their first bytes do not decide.
        Ok(Some(FileFormat::Part(PartFormat::Zip | PartFormat::Gzip)) | None) => {
            let opened = Part::open(path, &OpenOptions::default());
            opened.err().map(|error| Exit::Failed(error.into()).to_string())
        }
        Ok(Some(FileFormat::Part(_))) => None,
        Ok(Some(format)) => Some(format.to_string()),
    }
}

/// Returns the format of a file by its first bytes.
fn format_of(path: &Path) -> io::Result<Option<FileFormat>> {
    let metadata = fs::metadata(path)?;
    if !metadata.is_file() {
        // To open a pipe would wait for a writer.
        return Err(io::Error::other("it is no file"));
    }
    let mut start = Vec::new();
    File::open(path)?.take(FORMAT_BYTES as u64).read_to_end(&mut start)?;
    Ok(FileFormat::of_start(&start, Some(metadata.len())))
}
