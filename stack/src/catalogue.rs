//! Entries of a catalogue: TOML documents that are built in or read from files.

use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Deserializer};
use thiserror::Error;

use crate::one_line;
use crate::toml_document::{TomlError, TomlStep, read_toml};

/// A TOML document of a kind with built-in documents, such as materials and machines.
///
/// ```
/// use lamp_stack::{Builtin, CatalogueError, Catalogued};
///
/// #[derive(serde::Deserialize)]
/// struct Lamp {
///     name: String,
///     watts: f64,
/// }
///
/// impl Catalogued for Lamp {
///     const KIND: &'static str = "lamp";
///     const BUILTINS: &'static [Builtin] =
///         &[Builtin { name: "desk", toml: "name = 'desk'\nwatts = 8.0" }];
///     type CheckError = std::convert::Infallible;
///
///     fn name(&self) -> &str {
///         &self.name
///     }
///
///     fn check(&self) -> Result<(), Self::CheckError> {
///         Ok(())
///     }
/// }
///
/// assert_eq!(Lamp::builtin("desk").unwrap().watts, 8.0);
/// let error = Lamp::from_toml("name = 'mine'").err().unwrap();
/// assert!(matches!(error, CatalogueError::Key { line: 1, .. }));
/// ```
pub trait Catalogued: DeserializeOwned {
    /// The word for such a document in messages.
    const KIND: &'static str;
    /// The built-in documents, in the order of their names.
    const BUILTINS: &'static [Builtin];
    /// Why values make no document although each can be read.
    type CheckError;

    /// Returns the document's name: small letters, digits and `-`.
    fn name(&self) -> &str;

    /// Checks what single values cannot show.
    ///
    /// # Errors
    /// Returns an error if the values contradict each other.
    fn check(&self) -> Result<(), Self::CheckError>;

    /// Reads a document.
    ///
    /// # Errors
    /// Returns an error if the text is not TOML, if a key is unknown, missing or wrong,
    /// or if [`check`](Self::check) fails. Every error names its line or key.
    fn from_toml(text: &str) -> Result<Self, CatalogueError<Self::CheckError>> {
        let entry: Self =
            read_toml(text).map_err(|TomlError { line, path, problem }| match path {
                None => CatalogueError::Syntax { kind: Self::KIND, line, problem },
                Some(path) => {
                    CatalogueError::Key { line, key: key_of(&path), problem: with_remedy(problem) }
                }
            })?;
        let letters = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        if entry.name().is_empty() || !entry.name().chars().all(letters) {
            let example = Self::BUILTINS.first().map_or("mine", |builtin| builtin.name);
            return Err(CatalogueError::Name { name: one_line(entry.name()), example });
        }
        entry.check().map_err(CatalogueError::Check)?;
        Ok(entry)
    }

    /// Returns the built-in document of a name.
    ///
    /// # Panics
    /// Panics if the built-in text is no document, which the tests of its crate exclude.
    fn builtin(name: &str) -> Option<Self> {
        Self::BUILTINS.iter().find(|builtin| builtin.name == name).map(read_builtin)
    }

    /// Returns all built-in documents, in the order of their names.
    ///
    /// # Panics
    /// Panics if a built-in text is no document, which the tests of its crate exclude.
    fn builtins() -> impl Iterator<Item = Self> {
        Self::BUILTINS.iter().map(read_builtin)
    }
}

fn read_builtin<T: Catalogued>(builtin: &Builtin) -> T {
    T::from_toml(builtin.toml).ok().expect("built-in documents are whole")
}

/// A document that is built in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Builtin {
    /// The document's name.
    pub name: &'static str,
    /// Its text, with comments on what its sources leave open.
    pub toml: &'static str,
}

/// Why a text is no document of a catalogue.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CatalogueError<E> {
    /// The text is not TOML.
    #[error("line {line}: {problem}: a {kind} is a TOML file")]
    Syntax {
        /// The word for such a document.
        kind: &'static str,
        /// The line, from 1.
        line: usize,
        /// The parser's message.
        problem: String,
    },
    /// A key is wrong, unknown or missing.
    #[error("line {line}: {key}: {problem}")]
    Key {
        /// The line, from 1.
        line: usize,
        /// The key's path, as `working-curve.critical-dose`.
        key: String,
        /// The parser's message, or the message of the value's type.
        problem: String,
    },
    /// The name holds other characters than a name may.
    #[error("name: `{name}` is not a name: write small letters, digits and -, such as {example}")]
    Name {
        /// The name as it stands.
        name: String,
        /// A name that would do.
        example: &'static str,
    },
    /// The values make no document.
    #[error(transparent)]
    Check(E),
}

/// Returns a key's path, as `working-curve.critical-dose`.
fn key_of(path: &[TomlStep]) -> String {
    let mut key = String::new();
    for step in path {
        match step {
            TomlStep::Index(index) => key += &format!("[{index}]"),
            TomlStep::Key(name) => {
                key += if key.is_empty() { "" } else { "." };
                key += &one_line(name);
            }
        }
    }
    if key.is_empty() { "the file".to_owned() } else { key }
}

/// Adds what to do about a missing key.
fn with_remedy(problem: String) -> String {
    if problem.starts_with("missing key") { problem + ": add it" } else { problem }
}

/// Deserializes a text of more than spaces, for keys such as `source`.
///
/// # Errors
/// Returns an error if the value is no text, or an empty one.
pub fn nonempty_text<'de, D: Deserializer<'de>>(from: D) -> Result<String, D::Error> {
    let text = String::deserialize(from)?;
    if text.trim().is_empty() {
        return Err(D::Error::custom("this is empty: describe it for the next reader"));
    }
    Ok(text)
}
