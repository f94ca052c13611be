//! Materials, machines and projectors, built in, in files or in one's own folder, by the words of
//! settings: `alpha`, `mine.toml`, `mine`, or `mine.toml@blake3:0123456789abcdef` as stacks record
//! them.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, IsTerminal, Read};
use std::path::{Component, Path, PathBuf};

use etcetera::BaseStrategy;
use lamp_stack::{Builtin, Catalogued, Pages, digest_of, file_word};

use crate::error::{Error, ErrorKind};

/// A file of a catalog is text of a few kilobytes.
const MAX_FILE: u64 = 1 << 20;

/// A document whose errors can be reported.
pub trait Document: Catalogued<CheckError: std::error::Error + Send + Sync + 'static> {}

impl<T: Catalogued<CheckError: std::error::Error + Send + Sync + 'static>> Document for T {}

/// Returns whether a path means standard input or output.
pub fn is_stream(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Returns the name of an input for messages.
pub fn input_name(path: &Path) -> String {
    if is_stream(path) { "standard input".to_owned() } else { path.display().to_string() }
}

/// Opens a stack: a file, a folder of pages, or standard input.
///
/// # Errors
/// Returns an error with the stack's name if it cannot be read, or if nothing is piped in.
pub fn open_stack(path: &Path) -> Result<Pages, Error> {
    let pages = if is_stream(path) {
        refuse_terminal()?;
        Pages::from_stream(io::stdin())
    } else {
        Pages::open(path)
    };
    pages.map_err(|error| Error::from(error).at(input_name(path)))
}

/// Refuses to read a stack from a terminal.
///
/// # Errors
/// Returns an error if standard input is one.
pub fn refuse_terminal() -> Result<(), Error> {
    if io::stdin().is_terminal() {
        return Err(Error::settings(
            "no stack to read: name a file, or pipe one in (--help shows how)",
        ));
    }
    Ok(())
}

/// Returns the built-in document of a name, or the document in a file.
pub fn document<T: Document>(path: &Path) -> Result<T, Error> {
    document_and_text(path).map(|(document, _)| document)
}

/// Returns a document, and the word that stacks record for it: its name as given, without folders,
/// and the digest of its text. The word is accepted wherever the document's name is.
pub fn document_and_word<T: Document>(path: &Path) -> Result<(T, String), Error> {
    let (document, text) = document_and_text(path)?;
    Ok((document, word_of_text(&in_own_case::<T>(path), &text)))
}

/// The separator between a name and the digest of the file.
const DIGEST: &str = "@blake3:";

/// The hexadecimal digits of a digest behind a name.
const DIGEST_DIGITS: usize = 16;

/// Returns the word that stacks record for a file, given its digest.
pub fn word_of(path: &Path, digest: &str) -> String {
    let (path, _) = without_digest(path);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = if name == "-" { name } else { file_word(&name).into_owned().into() };
    let digits = digest.strip_prefix("blake3:").unwrap_or(digest);
    format!("{name}{DIGEST}{}", &digits[..DIGEST_DIGITS])
}

/// Returns the word that stacks record for a file of this text.
pub fn word_of_text(path: &Path, text: &str) -> String {
    word_of(path, &digest_of(text.as_bytes()).expect("it is in memory"))
}

/// Takes the digest from a word that stacks record.
pub fn without_digest(path: &Path) -> (PathBuf, Option<&str>) {
    match path.to_str().and_then(|text| text.rsplit_once(DIGEST)) {
        // A file of the whole name is meant as it is.
        Some((name, digest)) if !path.exists() => (name.into(), Some(digest)),
        _ => (path.to_owned(), None),
    }
}

/// Checks that a file has the digest that a word for it states; `found` is its current word.
pub fn check_word(path: &Path, found: &str) -> Result<(), Error> {
    let (name, Some(digest)) = without_digest(path) else { return Ok(()) };
    let found = found.rsplit_once(DIGEST).map_or("", |(_, found)| found);
    // A shortened digest is enough for people; an empty one would fit every file.
    if digest.is_empty() || !found.starts_with(digest) {
        let name = name.display();
        return Err(Error::work(format!(
            "{name} has changed: its digest begins with {found}, not with {digest}"
        )));
    }
    Ok(())
}

/// Returns the document of a word, and its text as it was written.
///
/// # Errors
/// Returns an error if there is no such document, or it is wrong.
pub fn document_and_text<T: Document>(word: &Path) -> Result<(T, String), Error> {
    let (path, _) = without_digest(&in_own_case::<T>(word));
    // Built-in names win over files of the same name, so that a record means the same in every
    // folder.
    let (document, text) = if let Some(builtin) = builtin::<T>(&path) {
        let document =
            T::from_toml(builtin.toml).map_err(|error| Error::new(ErrorKind::Work, error))?;
        (document, builtin.toml.to_owned())
    } else if is_stream(&path) || path.exists() {
        read_file(&path)?
    } else if let Some(own) = own_file::<T>(&path) {
        let (document, text) = read_file::<T>(&own)?;
        // A list shows the name within, so it must be the name that the file is asked for by.
        if Some(document.name()) != path.to_str() {
            let (own, name) = (own.display(), document.name());
            let text = format!("{own}: it is called {name} inside: rename the file {name}.toml");
            return Err(Error::work(text));
        }
        (document, text)
    } else {
        let builtins = T::BUILTINS.iter().map(|builtin| builtin.name.into());
        let names = builtins.chain(own_names::<T>());
        let names: Vec<String> = names.map(|name| name.display().to_string()).collect();
        let (path, kind) = (path.display().to_string(), T::KIND);
        let meant = match nearest(&path, names.iter().map(String::as_str)) {
            Some(name) => format!("did you mean {name}?"),
            None => names.join(", "),
        };
        let text = format!("{path}: there is no such file, nor a {kind} of that name: {meant}");
        return Err(Error::work(text));
    };
    check_word(word, &word_of_text(&path, &text))?;
    Ok((document, text))
}

/// Returns a word with the letters of the name that it means: people write `Mars3` for `mars3`. A file
/// of the word's own letters comes first.
fn in_own_case<T: Document>(word: &Path) -> PathBuf {
    let (path, digest) = without_digest(word);
    let own = own_names::<T>();
    let mut names = T::BUILTINS.iter().map(|builtin| OsStr::new(builtin.name));
    let mut all = names.by_ref().chain(own.iter().map(OsString::as_os_str));
    match all.find(|name| name.eq_ignore_ascii_case(path.as_os_str())) {
        Some(name) if name != path.as_os_str() && !path.exists() => {
            let digest = digest.map(|digest| format!("{DIGEST}{digest}")).unwrap_or_default();
            format!("{}{digest}", name.display()).into()
        }
        _ => word.to_owned(),
    }
}

/// Returns the nearest of some words, if somebody who mistyped may have meant it: one letter differs, or a
/// quarter of them, or one is the beginning of the other.
pub fn nearest<'a>(word: &str, words: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_lowercase();
    let begins = |other: &str| {
        word.len().min(other.len()) > 3 && (word.starts_with(other) || other.starts_with(&word))
    };
    let near = words.into_iter().filter_map(|other| {
        let lower = other.to_lowercase();
        let differs = strsim::damerau_levenshtein(&word, &lower);
        let most = 1.max(word.len().max(lower.len()) / 4);
        let is_near = word.len() > 2 && differs <= most || begins(&lower);
        is_near.then_some((differs, other))
    });
    near.min_by_key(|&(differs, _)| differs).map(|(_, other)| other)
}

fn builtin<T: Document>(path: &Path) -> Option<&'static Builtin> {
    T::BUILTINS.iter().find(|builtin| path.to_str() == Some(builtin.name))
}

/// Returns the folder of one's own settings: `lamp` in `XDG_CONFIG_HOME` or `~/.config`, on Windows
/// in `%APPDATA%`; `None` where no home is known. It has `config.toml`, and a folder for each kind
/// of document, such as `machines`.
pub fn config_folder() -> Option<PathBuf> {
    Some(etcetera::choose_base_strategy().ok()?.config_dir().join("lamp"))
}

/// Returns the folder of one's own documents of a kind, such as `machines`.
pub fn own_folder<T: Document>() -> Option<PathBuf> {
    Some(config_folder()?.join(format!("{}s", T::KIND)))
}

/// Returns the file in one's own folder that a name means, if there is one and nothing else has the
/// name.
pub fn own_file<T: Document>(word: &Path) -> Option<PathBuf> {
    let (name, _) = without_digest(word);
    let mut parts = name.components();
    let (Some(Component::Normal(_)), None) = (parts.next(), parts.next()) else { return None };
    let mut file = name.clone().into_os_string();
    file.push(".toml");
    let file = own_folder::<T>()?.join(file);
    (!name.exists() && builtin::<T>(&name).is_none() && file.is_file()).then_some(file)
}

/// Returns the folder of the file that a word means, from which the document names other files; it is empty
/// for the current folder, standard input and built-in documents.
pub fn folder_of<T: Document>(word: &Path) -> PathBuf {
    let (mut file, _) = without_digest(word);
    find_own::<T>(&mut file);
    file.parent().unwrap_or(Path::new("")).to_owned()
}

/// Puts the file in the place of a name, if the name means a document of one's own folder. Other names
/// get the letters of the document that they mean.
pub fn find_own<T: Document>(word: &mut PathBuf) {
    *word = in_own_case::<T>(word);
    if let Some(own) = own_file::<T>(word) {
        *word = own;
    }
}

/// Returns the names of the documents of one's own folder, sorted.
pub fn own_names<T: Document>() -> Vec<OsString> {
    let files =
        own_folder::<T>().and_then(|folder| fs::read_dir(folder).ok()).into_iter().flatten();
    let paths = files.filter_map(|file| Some(file.ok()?.path()));
    let toml = paths
        .filter(|path| path.extension().is_some_and(|ending| ending == "toml") && path.is_file());
    let names = toml.filter_map(|path| Some(path.file_stem()?.to_owned()));
    // Built-in names win.
    let mut names: Vec<_> = names.filter(|name| builtin::<T>(name.as_ref()).is_none()).collect();
    names.sort();
    names
}

/// Returns a word for a document in an option: a built-in one's name, with the digest of its text;
/// `file` for a file, whatever its name.
pub fn canonical_word<T: Document>(path: &Path) -> String {
    let word = |builtin: &Builtin| word_of_text(builtin.name.as_ref(), builtin.toml);
    builtin::<T>(&without_digest(path).0).map_or_else(|| "file".to_owned(), word)
}

/// Returns the facts of a document's or another file's record beyond its digest: a built-in one's
/// word, or the name of a file.
pub fn recorded_name<T: Document>(path: &Path) -> OsString {
    match is_file::<T>(path) {
        true => without_digest(path).0.file_name().unwrap_or_default().into(),
        false => canonical_word::<T>(path).into(),
    }
}

/// Returns whether a word of an option means a file, and not a built-in document.
pub fn is_file<T: Document>(path: &Path) -> bool {
    builtin::<T>(&without_digest(path).0).is_none()
}

/// Reads a document's file, and its text.
pub fn read_file<T: Document>(path: &Path) -> Result<(T, String), Error> {
    let text = text_of::<T>(path)?;
    let document = T::from_toml(&text);
    let document =
        document.map_err(|error| Error::new(ErrorKind::Work, error).at(input_name(path)))?;
    Ok((document, text))
}

/// Reads the text of a document's file, or of standard input.
///
/// # Errors
/// Returns an error with the file's name if it cannot be read, is longer than documents are, or is no
/// text.
pub fn text_of<T: Document>(path: &Path) -> Result<String, Error> {
    if is_stream(path) && io::stdin().is_terminal() {
        let why = format!("no {} to read: name a file, or pipe one in", T::KIND);
        return Err(Error::settings(why));
    }
    let text = read_text(path, MAX_FILE, &format!("a {} file", T::KIND));
    text.map_err(|error| error.at(input_name(path)))
}

/// Reads a text of at most `max` bytes. `what` names it in messages.
///
/// # Errors
/// Returns an error if it cannot be read, is longer, or is no text.
pub fn read_text(path: &Path, max: u64, what: &str) -> Result<String, Error> {
    let read = || -> io::Result<Vec<u8>> {
        let from: Box<dyn Read> = if is_stream(path) {
            Box::new(io::stdin().lock())
        } else {
            Box::new(File::open(path)?)
        };
        let mut bytes = Vec::new();
        // One byte more than allowed shows that there is more; a pipe may have no end.
        from.take(max + 1).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    let bytes = read()?;
    if bytes.len() as u64 > max {
        return Err(Error::work(format!("more than {} MiB: this is not {what}", max >> 20)));
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        Error::work(format!("byte {at} is not UTF-8 text"))
    })
}
