//! Finds materials, machines and projectors, built in or in files, by the name given in an option.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, IsTerminal, Read};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use lamp_stack::{Builtin, Catalogued, digest_of, file_word};

use crate::exit::Exit;
use crate::streams::{input_name, is_stream, print};

/// A file of a catalogue is text of a few kilobytes.
const MAX_FILE: u64 = 1 << 20;

/// A document whose errors can be reported.
pub(crate) trait Entry: Catalogued<CheckError: Reportable> {}

impl<T: Catalogued<CheckError: Reportable>> Entry for T {}

pub(crate) trait Reportable: std::error::Error + Send + Sync + 'static {}

impl<T: std::error::Error + Send + Sync + 'static> Reportable for T {}

/// Returns the built-in document of a name, or that of a file.
pub(crate) fn entry<T: Entry>(path: &Path) -> Result<T, Exit> {
    entry_and_text(path).map(|(entry, _)| entry)
}

/// Returns a document, and the word that stacks record for it: its name as it was given, without
/// folders, and the digest of its text. The word is taken for the document wherever its name is.
pub(crate) fn entry_and_word<T: Entry>(path: &Path) -> Result<(T, String), Exit> {
    let (entry, text) = entry_and_text(path)?;
    Ok((entry, word_of_text(path, &text)))
}

/// The separator between a name and the digest of the file.
const DIGEST: &str = "@blake3:";

/// The hexadecimal digits of a digest behind a name.
const DIGEST_DIGITS: usize = 16;

/// Returns the word that stacks record for a file, given its digest.
pub(crate) fn word_of(path: &Path, digest: &str) -> String {
    let (path, _) = without_digest(path);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = if name == "-" { name } else { file_word(&name).into_owned().into() };
    let digits = digest.strip_prefix("blake3:").unwrap_or(digest);
    format!("{name}{DIGEST}{}", &digits[..DIGEST_DIGITS])
}

/// Returns the word that stacks record for a file of this text.
pub(crate) fn word_of_text(path: &Path, text: &str) -> String {
    word_of(path, &digest_of(text.as_bytes()).expect("it is in memory"))
}

/// Takes the digest from a word that stacks record.
pub(crate) fn without_digest(path: &Path) -> (PathBuf, Option<&str>) {
    match path.to_str().and_then(|text| text.rsplit_once(DIGEST)) {
        Some((name, digest)) if !path.exists() => (name.into(), Some(digest)),
        _ => (path.to_owned(), None),
    }
}

/// Checks that a file has the digest that a word for it states; `found` is the word for it as it is.
pub(crate) fn check_word(path: &Path, found: &str) -> Result<(), Exit> {
    let (name, Some(digest)) = without_digest(path) else { return Ok(()) };
    let found = found.rsplit_once(DIGEST).map_or("", |(_, found)| found);
    if digest.is_empty() || !found.starts_with(digest) {
        let name = name.display();
        return Err(Exit::Failed(anyhow!(
            "{name} is not as it was: its digest begins with {found}, not with {digest}"
        )));
    }
    Ok(())
}

/// Returns the built-in document of a name, or that of a file, and its text as it was
/// written.
fn entry_and_text<T: Entry>(word: &Path) -> Result<(T, String), Exit> {
    let (path, _) = without_digest(word);
    let (entry, text) = if let Some(builtin) = builtin::<T>(&path) {
        let entry = T::from_toml(builtin.toml).map_err(anyhow::Error::new)?;
        (entry, builtin.toml.to_owned())
    } else if !is_stream(&path) && !path.exists() {
        let names: Vec<_> = T::BUILTINS.iter().map(|builtin| builtin.name).collect();
        let (path, kind, names) = (path.display(), T::KIND, names.join(", "));
        let text = format!("{path}: there is no such file, nor a built-in {kind}: {names}");
        return Err(Exit::Failed(anyhow!(text)));
    } else {
        read_file(&path)?
    };
    check_word(word, &word_of_text(&path, &text))?;
    Ok((entry, text))
}

fn builtin<T: Entry>(path: &Path) -> Option<&'static Builtin> {
    T::BUILTINS.iter().find(|builtin| path.to_str() == Some(builtin.name))
}

/// Returns a word for a document in an option: a built-in one's name, with the digest of its text;
/// `file` for a file, whatever its name.
pub(crate) fn canonical_word<T: Entry>(path: &Path) -> String {
    let word = |builtin: &Builtin| word_of_text(builtin.name.as_ref(), builtin.toml);
    builtin::<T>(&without_digest(path).0).map_or_else(|| "file".to_owned(), word)
}

/// Returns what of a document's or another file's record its digest does not give: a built-in one's
/// word, or the name of a file.
pub(crate) fn recorded_name<T: Entry>(path: &Path) -> OsString {
    match is_file::<T>(path) {
        true => without_digest(path).0.file_name().unwrap_or_default().into(),
        false => canonical_word::<T>(path).into(),
    }
}

/// Returns whether a word of an option means a file, and not a built-in document.
pub(crate) fn is_file<T: Entry>(path: &Path) -> bool {
    builtin::<T>(&without_digest(path).0).is_none()
}

/// Reads a document's file, and its text.
pub(crate) fn read_file<T: Entry>(path: &Path) -> Result<(T, String), Exit> {
    if is_stream(path) && io::stdin().is_terminal() {
        return Err(Exit::usage(format!("no {} to read: name a file, or pipe one in", T::KIND)));
    }
    let read = || -> anyhow::Result<(T, String)> {
        let text = read_text(path, MAX_FILE, &format!("a {} file", T::KIND))?;
        Ok((T::from_toml(&text)?, text))
    };
    Ok(read().with_context(|| input_name(path))?)
}

/// Prints a document's file as it was written, once it is checked.
pub(crate) fn show<T: Entry>(path: &Path) -> Result<(), Exit> {
    print(&entry_and_text::<T>(path)?.1)
}

/// Reads a text of at most `max` bytes. `what` is the word for it in messages.
pub(crate) fn read_text(path: &Path, max: u64, what: &str) -> anyhow::Result<String> {
    let from: Box<dyn Read> =
        if is_stream(path) { Box::new(io::stdin().lock()) } else { Box::new(File::open(path)?) };
    let mut bytes = Vec::new();
    from.take(max + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > max {
        return Err(anyhow!("more than {} MiB is not {what}", max >> 20));
    }
    String::from_utf8(bytes)
        .map_err(|error| anyhow!("byte {} is not UTF-8 text", error.utf8_error().valid_up_to()))
}
