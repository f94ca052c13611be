//! Finds the files of a ZIP package, regardless of how programs write their names.

use std::collections::HashMap;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};

use zip::ZipArchive;

use super::error::ThreeMfError;
use super::xml::{BoundedText, Xml, attribute, for_each_piece};
use crate::part_file::{FileReader, OpenPartFile};
use crate::unpack::most_unpacked;
use crate::utf8_text::as_utf8;

/// The relationship that names the model of a package.
const MODEL_RELATIONSHIP: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
/// The end of the relationship that names the list of encrypted files.
const KEYSTORE_RELATIONSHIP: &str = "/keystore";
const RELATIONSHIPS: &str = "_rels/.rels";
/// Where nearly all programs put the model.
const USUAL_MODEL: &str = "3D/3dmodel.model";

/// A ZIP package.
pub(super) struct Package<'a> {
    archive: ZipArchive<BufReader<FileReader<'a>>>,
    /// The numbers and names of its files, by the plain forms of the names.
    files: HashMap<String, (usize, String)>,
    /// The total number of bytes that may be unpacked, and the number so far.
    pub(super) most: u64,
    unpacked: u64,
}

impl<'a> Package<'a> {
    pub(super) fn open(file: &'a OpenPartFile) -> Result<Self, ThreeMfError> {
        let archive = ZipArchive::new(BufReader::new(file.reader()))?;
        let mut files = HashMap::new();
        for (number, name) in archive.file_names_raw().enumerate() {
            let name = String::from_utf8_lossy(name).into_owned();
            files.entry(plain(&name)).or_insert((number, name));
        }
        Ok(Self { archive, files, most: most_unpacked(file.size()), unpacked: 0 })
    }

    /// Returns the name of the file that a target in a file of the package refers to.
    pub(super) fn find(&self, target: &str, from: &str) -> Option<&str> {
        let folder = from.rsplit_once(['/', '\\']).map_or("", |(folder, _)| folder);
        let beside = || self.files.get(&plain(&format!("{folder}/{target}")));
        self.files.get(&plain(target)).or_else(beside).map(|(_, name)| name.as_str())
    }

    /// Returns the names of files whose plain forms have one of these ends, in order.
    pub(super) fn ending(&self, ends: &[&str]) -> Vec<String> {
        let has_end = |plain: &str| ends.iter().any(|end| plain.ends_with(end));
        let found = self.files.iter().filter(|(plain, _)| has_end(plain));
        let mut names: Vec<String> = found.map(|(_, (_, name))| name.clone()).collect();
        names.sort_unstable();
        names
    }

    /// Reads a file's text with `read`. It may be in UTF-8 or UTF-16.
    pub(super) fn read<T>(
        &mut self,
        name: &str,
        read: impl FnOnce(&mut BoundedText<&mut dyn BufRead>) -> T,
    ) -> Result<T, ThreeMfError> {
        // All files of a package share the limit.
        let most = self.most - self.unpacked;
        let file = self.files.get(&plain(name));
        let (number, _) = file.ok_or_else(|| ThreeMfError::NoModel(without_root(name)))?;
        let entry = self.archive.by_index(*number)?;
        let failed = |error: io::Error| ThreeMfError::Package(error.into());
        let mut text = as_utf8(BufReader::new(entry)).map_err(failed)?.take(most + 1);
        let mut text = BoundedText::new(&mut text as &mut dyn BufRead);
        let outcome = read(&mut text);
        if text.read > most {
            return Err(ThreeMfError::Inflated(most));
        }
        self.unpacked += text.read;
        Ok(outcome)
    }

    /// Returns the name of the package's main model, and the names of encrypted files.
    pub(super) fn model_path(&mut self) -> Result<(String, Vec<String>), ThreeMfError> {
        let (mut model, mut keystore) = (None, None);
        if let Some(path) = self.find(RELATIONSHIPS, "").map(str::to_owned) {
            self.for_each_tag(&path, |name, attribute| {
                let kind = attribute("Type").filter(|_| name == "Relationship");
                let of_kind = match kind.unwrap_or_default() {
                    kind if kind == MODEL_RELATIONSHIP => &mut model,
                    kind if kind.ends_with(KEYSTORE_RELATIONSHIP) => &mut keystore,
                    _ => return,
                };
                if of_kind.is_none() {
                    *of_kind = attribute("Target");
                }
            })?;
        }
        let model = model.unwrap_or_else(|| USUAL_MODEL.to_owned());
        let Some(model) = self.find(&model, "").map(str::to_owned) else {
            return Err(ThreeMfError::NoModel(without_root(&model)));
        };
        let mut encrypted = Vec::new();
        if let Some(path) = keystore.and_then(|path| self.find(&path, "").map(str::to_owned)) {
            self.for_each_tag(&path, |name, attribute| {
                encrypted.extend(attribute("path").filter(|_| name == "resourcedata"));
            })?;
        }
        let encrypted = encrypted.iter().filter_map(|path| self.find(path, ""));
        Ok((model, encrypted.map(str::to_owned).collect()))
    }

    /// Calls `each` with the name of every element of a file, and a function that returns its
    /// attributes.
    fn for_each_tag(
        &mut self,
        path: &str,
        mut each: impl FnMut(&str, &dyn Fn(&str) -> Option<String>),
    ) -> Result<(), ThreeMfError> {
        let outcome = self.read(path, |text| {
            for_each_piece(text, |piece| {
                if let Xml::Start(_, tag) = piece {
                    let found = |name: &str| attribute(tag, name).ok().flatten();
                    each(tag.local_name().as_ref(), &found);
                }
                Ok(())
            })
        })?;
        outcome.map_err(|(at, fault)| ThreeMfError::Model { model: path.to_owned(), at, fault })
    }
}

/// Returns a name without the slash that represents the package.
pub(super) fn without_root(name: &str) -> String {
    name.trim_start_matches(['/', '\\']).to_owned()
}

/// Returns the form in which a name is compared: names are equal regardless of case (OPC, 6.3.5),
/// some programs write backslashes, and targets may be percent-encoded.
fn plain(name: &str) -> String {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name.as_bytes();
    while let [first, after @ ..] = rest {
        let digits = rest.get(1..3).and_then(|digits| str::from_utf8(digits).ok());
        match digits.and_then(|digits| u8::from_str_radix(digits, 16).ok()) {
            Some(byte) if *first == b'%' => {
                bytes.push(byte);
                rest = &rest[3..];
            }
            _ => {
                bytes.push(*first);
                rest = after;
            }
        }
    }
    let name = String::from_utf8_lossy(&bytes).to_lowercase();
    let mut steps = Vec::new();
    for step in name.split(['/', '\\']) {
        match step {
            "" | "." => {}
            ".." => drop(steps.pop()),
            step => steps.push(step),
        }
    }
    steps.join("/")
}

/// Returns true if a file is a ZIP package, even if other bytes precede it.
///
/// # Errors
/// Returns an error if the file cannot be read.
pub(crate) fn looks_packaged(file: &OpenPartFile, start: &[u8]) -> io::Result<bool> {
    /// The size of the record at a package's end; a comment may follow it.
    const END_BYTES: usize = 22;
    const LONGEST_COMMENT: u64 = 1 << 16;
    if start.starts_with(b"PK\x03\x04") {
        return Ok(true);
    }
    let mut reader = file.reader();
    let tail_start = file.size().saturating_sub(LONGEST_COMMENT + END_BYTES as u64);
    reader.seek(SeekFrom::Start(tail_start))?;
    let mut tail = Vec::new();
    reader.take(LONGEST_COMMENT + END_BYTES as u64).read_to_end(&mut tail)?;
    let u16_at = |at: usize| usize::from(u16::from_le_bytes([tail[at], tail[at + 1]]));
    let is_end = |&at: &usize| {
        // The end of central directory record (ZIP's APPNOTE, 4.3.16) with its comment ends the
        // file.
        tail[at..].starts_with(b"PK\x05\x06") && at + END_BYTES + u16_at(at + 20) == tail.len()
    };
    let Some(end) = (0..(tail.len() + 1).saturating_sub(END_BYTES)).rfind(is_end) else {
        return Ok(false);
    };
    // It is preceded by the directory, or by the end of a long one.
    let size = u64::from(u32::from_le_bytes(tail[end + 12..][..4].try_into().expect("four bytes")));
    // Counted back from the end: bytes before a package make the record's own offset wrong.
    let Some(directory) = (tail_start + end as u64).checked_sub(size) else {
        return Ok(tail[..end].ends_with(b"PK\x06\x07"));
    };
    let mut reader = file.reader();
    reader.seek(SeekFrom::Start(directory))?;
    let mut first = Vec::new();
    reader.take(4).read_to_end(&mut first)?;
    Ok(first == b"PK\x01\x02")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_plain() {
        for name in [
            "/3D/My Part.model",
            "3d\\my part.MODEL",
            "/3D/My%20Part.model",
            "./3D/x/../My%20part.model",
            "//3D//my part.model",
        ] {
            assert_eq!(plain(name), "3d/my part.model");
        }
        assert_eq!(plain("a%zz%4"), "a%zz%4");
        assert_eq!(plain("../../%C3%89"), "é");
    }
}
