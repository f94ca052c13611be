//! Slicing options as a stack records them: words of a command, and back.
//!
//! Each value stands as people write it, so that the words are a command that can be run.

use std::fmt::Display;
use std::str::FromStr;

use lamp_stack::quoted;
use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Map, Value};

/// The options that decide the images, in the order in which they are recorded. Stacks made
/// with other paths, or with less memory, are to have the same bytes: such options are left out.
const RECORDED: &str = "\
    dpi adaptive min max step criterion deviation cusp layers-budget time-budget layer-overhead \
    row-pitch snap thickness plane plane-tolerance units fill bodies subtract intersect scale mirror rotate translate tolerance \
    kernel no-polish gray print-through material overcure lamp-intensity exposure-table origin size \
    margin trust-extent";

/// Returns the options as words of a shell: ` --dpi 1500 --snap` and so on, those for which `applies`
/// holds.
pub(crate) fn to_words(options: &impl Serialize, applies: impl Fn(&str) -> bool) -> String {
    let options = serde_json::to_value(options).expect("options are texts and flags");
    let word = |key: &str| match &options[key] {
        Value::Bool(true) => format!(" --{key}"),
        Value::String(value) => option(key, value),
        Value::Array(values) => {
            let values = values.iter().filter_map(Value::as_str);
            values.map(|value| option(key, value)).collect()
        }
        _ => String::new(),
    };
    RECORDED.split(' ').filter(|key| applies(key)).map(word).collect()
}

/// Returns the first option that is not the same in both.
pub(crate) fn differing<T: Serialize>(a: &T, b: &T) -> Option<&'static str> {
    let [a, b] = [a, b].map(|it| serde_json::to_value(it).expect("options are texts and flags"));
    RECORDED.split(' ').find(|&key| a[key] != b[key])
}

/// Returns an option with its value as words of a shell.
pub(crate) fn option(key: &str, value: &str) -> String {
    // Else it would be taken for an option.
    let between = if value.starts_with("--") { '=' } else { ' ' };
    format!(" --{key}{between}{}", quoted(value))
}

/// Reads options from their words. Returns none if there are words of other options.
pub(crate) fn from_words<T: DeserializeOwned>(words: &[String]) -> Option<T> {
    let mut options = Map::new();
    let mut words = words.iter().peekable();
    while let Some(word) = words.next() {
        let word = word.strip_prefix("--")?;
        let (key, value) = match word.split_once('=') {
            Some((key, value)) => (key, Some(value.to_owned())),
            None => (word, words.next_if(|value| !value.starts_with("--")).cloned()),
        };
        if !RECORDED.split(' ').any(|it| it == key) {
            return None;
        }
        let value = value.map_or(Value::Bool(true), Value::String);
        match options.get_mut(key) {
            None => drop(options.insert(key.to_owned(), value)),
            Some(Value::Array(values)) => values.push(value),
            Some(before) => *before = Value::Array(vec![before.take(), value]),
        }
    }
    serde_json::from_value(Value::Object(options)).ok()
}

fn parsed<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(text: &str) -> Result<T, D::Error> {
    text.parse().map_err(D::Error::custom)
}

/// Files with their placements as texts, for serde: a list, or a text if there is one.
pub(crate) mod parts {
    use super::{Deserialize, Deserializer, Error, Serializer};
    use crate::part_arg::PartArg;

    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Texts {
        One(String),
        Some(Vec<String>),
    }

    pub(crate) fn serialize<S: Serializer>(parts: &[PartArg], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(parts.iter().map(PartArg::recorded))
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Vec<PartArg>, D::Error> {
        let texts = match Texts::deserialize(from)? {
            Texts::One(text) => vec![text],
            Texts::Some(texts) => texts,
        };
        let parsed = texts.into_iter().map(|text| PartArg::parse(text.into()));
        parsed.collect::<Result<_, _>>().map_err(D::Error::custom)
    }
}

/// A value as text, for serde.
pub(crate) mod text {
    use super::{Deserialize, Deserializer, Display, FromStr, Serializer, parsed};

    pub(crate) fn serialize<S: Serializer>(value: &impl Display, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(value)
    }

    pub(crate) fn deserialize<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(
        from: D,
    ) -> Result<T, D::Error> {
        parsed::<T, D>(&String::deserialize(from)?)
    }
}

/// A value that may be missing as text, for serde.
pub(crate) mod optional {
    use super::{Deserializer, Display, FromStr, Serializer, text};

    #[expect(clippy::ref_option, reason = "serde calls it with a reference to the field")]
    pub(crate) fn serialize<S: Serializer>(
        value: &Option<impl Display>,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        match value {
            Some(value) => text::serialize(value, to),
            None => to.serialize_none(),
        }
    }

    pub(crate) fn deserialize<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Option<T>, D::Error> {
        text::deserialize(from).map(Some)
    }
}

/// Values as one text with commas between, for serde.
pub(crate) mod list {
    use super::{Deserialize, Deserializer, Display, FromStr, Serializer, parsed};

    pub(crate) fn serialize<S: Serializer>(
        values: &[impl Display],
        to: S,
    ) -> Result<S::Ok, S::Error> {
        match values {
            [] => to.serialize_none(),
            _ => to
                .collect_str(&values.iter().map(ToString::to_string).collect::<Vec<_>>().join(",")),
        }
    }

    pub(crate) fn deserialize<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Vec<T>, D::Error> {
        String::deserialize(from)?.split(',').map(parsed::<T, D>).collect()
    }
}
