//! The key of a task: a digest of its work and its inputs.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Everything that decides the bytes of a task's result, and nothing else.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TaskRecipe {
    /// The kind of task.
    pub kind: Kind,
    /// Options that matter to bytes, in canonical form.
    pub options: Vec<String>,
    /// Digests of files, and keys of tasks whose results are used, in their order.
    pub inputs: Vec<String>,
    /// Names of the code that runs, each with the number that changes when its output bytes do.
    pub code: Vec<(String, u32)>,
}

/// The kinds of tasks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// The stages of a part, for a range of its layers.
    Range,
    /// The ranges of a part as one stack.
    Join,
    /// A stage that needs the whole stack.
    Whole,
    /// A plan of exposures of the whole stack.
    Plan,
    /// The findings in a part's stack that need a person.
    Check,
    /// A build of parts.
    Tile,
}

impl Kind {
    /// Returns the word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Range => "range",
            Self::Join => "join",
            Self::Whole => "whole",
            Self::Plan => "plan",
            Self::Check => "check",
            Self::Tile => "tile",
        }
    }
}

impl TaskRecipe {
    /// Returns the key of the task.
    pub fn key(&self) -> Key {
        // The tag keeps keys of tasks and of notes apart. Its number changes with the form of
        // recipes. Fields are written in the order of the struct, so equal recipes have one text.
        let text = serde_json::to_vec(&("lamp-task-1", self)).expect("recipes have text keys");
        Key(*blake3::hash(&text).as_bytes())
    }
}

/// The key of a task: BLAKE3 of its [`TaskRecipe`]. Equal keys mean equal results.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Key([u8; 32]);

impl Key {
    /// Returns the key of a note of a kind, given everything it depends on.
    pub fn of_note(kind: &str, about: &impl Serialize) -> Self {
        let text = serde_json::to_vec(&("lamp-note-1", kind, about));
        Self(*blake3::hash(&text.expect("notes are about texts and numbers")).as_bytes())
    }

    /// Returns the place of the key's files in the store: a folder and a name in it.
    pub(crate) fn place(&self, end: &str) -> PathBuf {
        let text = self.to_string();
        // Two digits make 256 folders: none of them grows long.
        PathBuf::from(&text[..2]).join(format!("{text}.{end}"))
    }

    /// Returns the first letters, enough for people to distinguish tasks.
    pub fn short(&self) -> String {
        self.to_string()[..12].to_owned()
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.short())
    }
}

/// The error of a text that is no key.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a key: lamp batch status --verbose lists keys, 64 digits 0 to 9 and a to f")]
pub struct KeyError(String);

impl FromStr for Key {
    type Err = KeyError;

    fn from_str(text: &str) -> Result<Self, KeyError> {
        // BLAKE3 also reads capital digits, but a key must have one text only: it names files.
        let is_plain = text.bytes().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f'));
        let hash = blake3::Hash::from_hex(text).ok().filter(|_| is_plain);
        hash.map(|hash| Self(*hash.as_bytes())).ok_or_else(|| KeyError(lamp_stack::one_line(text)))
    }
}

impl TryFrom<String> for Key {
    type Error = KeyError;

    fn try_from(text: String) -> Result<Self, KeyError> {
        text.parse()
    }
}

impl From<Key> for String {
    fn from(key: Key) -> Self {
        key.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recipe() -> TaskRecipe {
        TaskRecipe {
            kind: Kind::Range,
            options: vec!["slice --dpi 1500".to_owned(), "fix".to_owned()],
            inputs: vec!["blake3:aa".to_owned()],
            code: vec![("slice".to_owned(), 1)],
        }
    }

    #[test]
    fn every_part_of_a_recipe_counts() {
        let plain = recipe();
        let mut others = vec![plain.clone(); 5];
        others[0].kind = Kind::Join;
        others[1].options = vec!["slice --dpi 1500 fix".to_owned()];
        others[2].inputs.push(String::new());
        others[3].code[0].1 = 2;
        others[4].options.swap(0, 1);
        let mut keys: Vec<_> = others.iter().map(TaskRecipe::key).chain([plain.key()]).collect();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), 6);
        assert_eq!(plain.key(), recipe().key());
    }

    #[test]
    fn keys_are_read_as_they_are_written() {
        let key = recipe().key();
        assert_eq!(key.to_string().parse(), Ok(key));
        assert_eq!(key.to_string().len(), 64);
        for wrong in ["", "00", &"g".repeat(64), &key.to_string().to_uppercase()] {
            assert!(wrong.parse::<Key>().is_err(), "{wrong}");
        }
    }
}
