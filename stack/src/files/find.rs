//! Finds the stacks in a folder.

use std::collections::HashSet;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::error::StackError;
use crate::files::file_format::{FORMAT_BYTES, FileFormat};
use crate::files::input::Pages;
use crate::files::page_names::PageFiles;
use crate::files::stack_format::StackFormat;
use crate::note::StackNote;

/// Returns whether a file has the extension of a stack in one file.
pub fn is_stack_name(path: &Path) -> bool {
    let format = StackFormat::of_name(path);
    format.is_some_and(|format| !matches!(format, StackFormat::Contours(_)))
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

/// Adds the stacks at a path, except for stacks of a folder that links have led to before.
fn add_stacks(
    path: &Path,
    seen: &mut HashSet<PathBuf>,
    stacks: &mut Vec<PathBuf>,
) -> io::Result<()> {
    if !path.is_dir() {
        stacks.push(path.to_owned());
        return Ok(());
    }
    let named =
        |error: io::Error| io::Error::new(error.kind(), format!("{}: {error}", path.display()));
    if !seen.insert(path.canonicalize().map_err(named)?) {
        return Ok(());
    }
    let entries = fs::read_dir(path).and_then(Iterator::collect::<io::Result<Vec<_>>>);
    let mut entries = entries.map_err(named)?;
    entries.retain(|entry| !entry.file_name().as_encoded_bytes().starts_with(b"."));
    entries.sort_by_key(fs::DirEntry::file_name);
    let pages = pages_of(path);
    if pages.is_some() {
        stacks.push(path.to_owned());
    }
    for entry in entries {
        let path = entry.path();
        let is_page = pages.as_ref().is_some_and(|pages| pages.contains(&path));
        match path.metadata() {
            Ok(metadata) if metadata.is_dir() => add_stacks(&path, seen, stacks)?,
            Ok(metadata)
                if !metadata.is_file()
                    && !is_page
                    && (is_stack_name(&path) || is_picture(&path)) =>
            {
                let why = format!("{} is a pipe or a device, not a stack", path.display());
                return Err(io::Error::other(why));
            }
            // Pictures next to pages are thumbnails and the like.
            Ok(_) if !is_page && is_stack_file(&path, pages.is_none()) => stacks.push(path),
            // A link to nothing, or a file that cannot be looked at: opening it says why.
            Err(_) if !is_page => stacks.push(path),
            _ => {}
        }
    }
    Ok(())
}

/// Returns whether a file is a stack by its name or its first bytes; `pictures` count, if they may.
fn is_stack_file(path: &Path, pictures: bool) -> bool {
    is_stack_name(path)
        || match format(path) {
            Some(FileFormat::Layers("a TIFF file" | "a packed stack")) => true,
            Some(FileFormat::Layers(_)) => pictures,
            _ => pictures && is_picture(path),
        }
}

fn is_picture(path: &Path) -> bool {
    path.extension().is_some_and(|end| end.eq_ignore_ascii_case("png"))
}

fn format(path: &Path) -> Option<FileFormat> {
    let mut start = Vec::new();
    // A pipe would wait for a writer.
    let file = path.is_file().then(|| File::open(path).ok())??;
    file.take(FORMAT_BYTES as u64).read_to_end(&mut start).ok()?;
    FileFormat::of_start(&start, None)
}

/// Returns the files of a folder that are the pages of one stack. The first file that says so decides.
fn pages_of(folder: &Path) -> Option<Vec<PathBuf>> {
    let PageFiles { files, left_out, .. } = match PageFiles::of(folder) {
        Ok(found) => found,
        // The folder's stack is refused when it is opened, and its files with it.
        Err(StackError::SamePage { .. } | StackError::NoFile { .. }) => {
            let entries = fs::read_dir(folder).into_iter().flatten().flatten();
            return Some(entries.map(|entry| entry.path()).filter(|path| !path.is_dir()).collect());
        }
        Err(_) => return None,
    };
    let is_alone = files.len() == 1 && !left_out.iter().any(StackNote::is_doubt);
    let are_pages =
        !files.is_empty() && files.iter().find_map(|file| is_page(file, is_alone)).unwrap_or(true);
    are_pages.then_some(files)
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
