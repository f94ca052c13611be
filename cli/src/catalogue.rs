//! Finds materials, machines and projectors, built in or in files, by the name given in an option.

use std::fs::File;
use std::io::{self, IsTerminal, Read};
use std::path::Path;

use anyhow::{Context, anyhow};
use lamp_stack::{Builtin, Catalogued, digest_of};

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

/// Returns the built-in document of a name, or that of a file, and its text as it was
/// written.
fn entry_and_text<T: Entry>(path: &Path) -> Result<(T, String), Exit> {
    let builtin = T::BUILTINS.iter().find(|builtin| path.to_str() == Some(builtin.name));
    if let Some(builtin) = builtin {
        let entry = T::from_toml(builtin.toml).map_err(anyhow::Error::new)?;
        return Ok((entry, builtin.toml.to_owned()));
    }
    if !is_stream(path) && !path.exists() {
        let names: Vec<_> = T::BUILTINS.iter().map(|builtin| builtin.name).collect();
        let (path, kind, names) = (path.display(), T::KIND, names.join(", "));
        let text = format!("{path}: there is no such file, nor a built-in {kind}: {names}");
        return Err(Exit::Failed(anyhow!(text)));
    }
    read_file(path)
}

/// Returns a word for a document in an option: a built-in one's name, with the digest of its text;
/// `file` for a file, whatever its name.
pub(crate) fn canonical_word<T: Entry>(path: &Path) -> String {
    let builtin = T::BUILTINS.iter().find(|builtin| path.to_str() == Some(builtin.name));
    let word = |builtin: &Builtin| {
        let digest = digest_of(builtin.toml.as_bytes()).expect("it is in memory");
        format!("{}@{digest}", builtin.name)
    };
    builtin.map_or_else(|| "file".to_owned(), word)
}

/// Returns whether a word of an option means a file, and not a built-in document.
pub(crate) fn is_file<T: Entry>(path: &Path) -> bool {
    T::BUILTINS.iter().all(|builtin| path.to_str() != Some(builtin.name))
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
