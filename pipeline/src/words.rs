//! Settings as words of a command, for people, and as texts, for records.
//!
//! Each value appears as people write it, so that the words are a command that can be run. Nothing
//! reads the words again: records hold the settings themselves.

use std::fmt::Display;
use std::str::FromStr;

use lamp_stack::quoted;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

/// Returns settings as words of a shell, ` --dpi 1500 --snap` and so on: each key is an option, in
/// the order of the fields.
pub fn words_of(settings: &impl Serialize) -> String {
    let word = |(key, value): (&String, &Value)| match value {
        // A flag is its name alone, and a false one has no word.
        Value::Bool(true) => format!(" --{key}"),
        Value::String(value) => option(key, value),
        Value::Number(value) => option(key, &value.to_string()),
        Value::Array(values) => {
            values.iter().filter_map(Value::as_str).map(|value| option(key, value)).collect()
        }
        _ => String::new(),
    };
    match serde_json::to_value(settings) {
        Ok(Value::Object(options)) => options.iter().map(word).collect(),
        _ => unreachable!("settings are texts and flags"),
    }
}

/// Returns the key of the first setting that differs between both.
pub fn differing<T: Serialize>(a: &T, b: &T) -> Option<String> {
    let [a, b] = [a, b].map(|it| serde_json::to_value(it).expect("settings are texts and flags"));
    let (a, b) = (a.as_object()?, b.as_object()?);
    let differs = |key: &&String| a.get(*key) != b.get(*key);
    // Keys with default values may be left out of one of them.
    a.keys().chain(b.keys()).find(differs).cloned()
}

/// Returns an option with its value as words of a shell.
pub fn option(key: &str, value: &str) -> String {
    // Otherwise it would be read as an option.
    let between = if value.starts_with("--") { '=' } else { ' ' };
    format!(" --{key}{between}{}", quoted(value))
}

fn parsed<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(text: &str) -> Result<T, D::Error> {
    text.parse().map_err(D::Error::custom)
}

/// Files with their placements as texts, for serde.
pub mod parts {
    use super::{Deserialize, Deserializer, Serializer};
    use crate::part_file::PartFile;

    /// Writes them.
    ///
    /// # Errors
    /// Returns the errors of the format.
    pub fn serialize<S: Serializer>(parts: &[PartFile], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(parts.iter().map(ToString::to_string))
    }

    /// Reads them.
    ///
    /// # Errors
    /// Returns an error if a text does not parse.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<PartFile>, D::Error> {
        let texts = Vec::<String>::deserialize(from)?;
        texts.iter().map(|text| super::parsed::<PartFile, D>(text)).collect()
    }
}

/// A value as text, for serde.
pub mod text {
    use super::{Deserialize, Deserializer, Display, FromStr, Serializer, parsed};

    /// Writes them.
    ///
    /// # Errors
    /// Returns the errors of the format.
    pub fn serialize<S: Serializer>(value: &impl Display, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(value)
    }

    /// Reads them.
    ///
    /// # Errors
    /// Returns an error if the text does not parse.
    pub fn deserialize<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(
        from: D,
    ) -> Result<T, D::Error> {
        parsed::<T, D>(&String::deserialize(from)?)
    }
}

/// A value that may be missing as text, for serde.
pub mod optional {
    use super::{Deserializer, Display, FromStr, Serializer, text};

    /// Writes it.
    ///
    /// # Errors
    /// Returns the errors of the format.
    pub fn serialize<S: Serializer>(
        value: &Option<impl Display>,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        match value {
            Some(value) => text::serialize(value, to),
            None => to.serialize_none(),
        }
    }

    /// Reads them.
    ///
    /// # Errors
    /// Returns an error if the text does not parse.
    pub fn deserialize<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Option<T>, D::Error> {
        text::deserialize(from).map(Some)
    }
}

/// Values as one text with commas between, for serde.
pub mod list {
    use super::{Deserialize, Deserializer, Display, FromStr, Serializer, parsed};

    /// Writes them.
    ///
    /// # Errors
    /// Returns the errors of the format.
    pub fn serialize<S: Serializer>(values: &[impl Display], to: S) -> Result<S::Ok, S::Error> {
        match values {
            [] => to.serialize_none(),
            _ => to
                .collect_str(&values.iter().map(ToString::to_string).collect::<Vec<_>>().join(",")),
        }
    }

    /// Reads them.
    ///
    /// # Errors
    /// Returns an error if a text does not parse.
    pub fn deserialize<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Vec<T>, D::Error> {
        String::deserialize(from)?.split(',').map(parsed::<T, D>).collect()
    }
}

/// A path as text, for serde. Names that are not Unicode get replacement characters.
pub mod path {
    use std::path::{Path, PathBuf};

    use super::{Deserialize, Deserializer, Serializer};

    /// Writes it.
    ///
    /// # Errors
    /// Returns the errors of the format.
    pub fn serialize<S: Serializer>(path: &Path, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(&path.display())
    }

    /// Reads it.
    ///
    /// # Errors
    /// Returns an error if there is no text.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<PathBuf, D::Error> {
        String::deserialize(from).map(PathBuf::from)
    }
}

/// A path that may be missing as text, for serde.
pub mod optional_path {
    use std::path::PathBuf;

    use super::{Deserializer, Serializer, path};

    /// Writes it.
    ///
    /// # Errors
    /// Returns the errors of the format.
    pub fn serialize<S: Serializer>(path: &Option<PathBuf>, to: S) -> Result<S::Ok, S::Error> {
        match path {
            Some(path) => path::serialize(path, to),
            None => to.serialize_none(),
        }
    }

    /// Reads it.
    ///
    /// # Errors
    /// Returns an error if there is no text.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<PathBuf>, D::Error> {
        path::deserialize(from).map(Some)
    }
}
