//! Finds the stacks in a folder.

use std::collections::HashSet;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::error::StackError;
use crate::file_format::{FORMAT_BYTES, FileFormat};
use crate::input::Pages;
use crate::note::StackNote;
use crate::page_names::PageFiles;

/// The endings of names of stacks in one file, in small letters.
pub const STACK_ENDINGS: [&str; 5] = ["tif", "tiff", "btf", "tf8", "lamp"];

/// Returns whether a file has the extension of a stack in one file.
pub fn is_stack_name(path: &Path) -> bool {
    let extension = path.extension().map(|end| end.to_string_lossy().to_ascii_lowercase());
    extension.is_some_and(|end| STACK_ENDINGS.contains(&&*end))
}

/// Returns the stacks at a path, by name: the path itself if it is a file or a folder of pages,
/// otherwise every stack in the folder and in the folders below it. Hidden files are left out.
///
/// A file is a stack by its name or by its first bytes, so that neither a damaged one nor one of
/// another name is passed over. A file that is a whole stack of its own is no page of the folder's
/// stack.
///
/// # Errors
/// Returns an error if a folder cannot be read.
pub fn stacks_in(path: &Path) -> io::Result<Vec<PathBuf>> {
    let mut stacks = Vec::new();
    add_stacks(path, &mut HashSet::new(), &mut stacks)?;
    Ok(stacks)
}

/// Adds the stacks at a path, but not those of a folder that links have led to before.
fn add_stacks(
    path: &Path,
    seen: &mut HashSet<PathBuf>,
    stacks: &mut Vec<PathBuf>,
) -> io::Result<()> {
    if !path.is_dir() {
        stacks.push(path.to_owned());
        return Ok(());
    }
    let is_stack = is_stack(path);
    if is_stack {
        stacks.push(path.to_owned());
    }
    if !seen.insert(path.canonicalize()?) {
        return Ok(());
    }
    let mut entries = fs::read_dir(path)?.collect::<Result<Vec<_>, _>>()?;
    entries.retain(|entry| !entry.file_name().as_encoded_bytes().starts_with(b"."));
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let path = entry.path();
        match path.is_dir() {
            true if is_stack => {}
            true => add_stacks(&path, seen, stacks)?,
            // A packed stack next to pages is a stack of its own.
            false if is_stack && is_packed(&path) => stacks.push(path),
            false if !is_stack && is_stack_file(&path) => stacks.push(path),
            false => {}
        }
    }
    Ok(())
}

/// Returns whether a file is a stack by its name or its first bytes.
fn is_stack_file(path: &Path) -> bool {
    let is_picture = || path.extension().is_some_and(|end| end.eq_ignore_ascii_case("png"));
    is_stack_name(path) || is_picture() || matches!(format(path), Some(FileFormat::Layers(_)))
}

/// Returns whether a file is a packed stack by its name or its first bytes.
fn is_packed(path: &Path) -> bool {
    let is_named = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("lamp"));
    is_named || format(path) == Some(FileFormat::Layers("a packed stack"))
}

fn format(path: &Path) -> Option<FileFormat> {
    let mut start = Vec::new();
    // A pipe would wait for a writer.
    let file = path.is_file().then(|| File::open(path).ok())??;
    file.take(FORMAT_BYTES as u64).read_to_end(&mut start).ok()?;
    FileFormat::of_start(&start, None)
}

/// Returns whether a folder's files are the pages of one stack. The first file that tells decides.
fn is_stack(folder: &Path) -> bool {
    let PageFiles { files, left_out, .. } = match PageFiles::of(folder) {
        Ok(found) => found,
        // The folder's stack is refused when it is opened.
        Err(StackError::SamePage { .. }) => return true,
        Err(_) => return false,
    };
    let is_alone = files.len() == 1 && !left_out.iter().any(StackNote::is_doubt);
    !files.is_empty() && files.iter().find_map(|file| is_page(file, is_alone)).unwrap_or(true)
}

/// Returns whether a file is a page and not a stack of its own, if it says so. A file alone is.
fn is_page(file: &Path, is_alone: bool) -> Option<bool> {
    let mut headers = Pages::open(file).ok()?.headers();
    let first = headers.next()?.ok()?;
    match headers.next() {
        // A page of ours that says that others follow.
        Some(Err(StackError::EndedEarly { .. } | StackError::MissingPages { .. })) => Some(true),
        // Several pages, or a stack that was cut off.
        Some(_) => Some(false),
        None if is_alone => Some(true),
        None => first.pages.map(|pages| pages > 1),
    }
}
