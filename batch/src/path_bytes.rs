//! Writes paths as JSON: as text, or as bytes where their names are no text.

use std::path::{Path, PathBuf};

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

#[derive(Deserialize)]
#[serde(untagged)]
enum PathForm {
    Text(String),
    Bytes(Vec<u8>),
}

/// Writes a path.
///
/// # Errors
/// Returns an error if the serializer does.
pub fn serialize<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    match path.to_str() {
        Some(text) => serializer.serialize_str(text),
        None => path.as_os_str().as_encoded_bytes().serialize(serializer),
    }
}

/// Reads a path.
///
/// # Errors
/// Returns an error if it is neither, or no path of this system.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<PathBuf, D::Error> {
    match PathForm::deserialize(deserializer)? {
        PathForm::Text(text) => Ok(text.into()),
        PathForm::Bytes(bytes) => of_bytes(bytes).ok_or_else(|| Error::custom("no path")),
    }
}

#[cfg(unix)]
fn of_bytes(bytes: Vec<u8>) -> Option<PathBuf> {
    use std::os::unix::ffi::OsStringExt;
    Some(std::ffi::OsString::from_vec(bytes).into())
}

/// Elsewhere such names are not bytes.
#[cfg(not(unix))]
fn of_bytes(_: Vec<u8>) -> Option<PathBuf> {
    None
}

/// A path in something that is written.
#[derive(Debug, Serialize)]
#[serde(transparent)]
pub struct WrittenPath<'a>(#[serde(serialize_with = "serialize")] pub &'a Path);
