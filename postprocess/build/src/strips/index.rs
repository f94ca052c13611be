//! The index of a folder of strips.

use std::fs::{self, File};
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use lamp_stack::{MAX_SIDE, StackError, one_line};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{Seam, StripsError, Swaths};

/// The index's name in its folder.
pub(super) const INDEX: &str = "strips.json";

/// The greatest number of strips that are written: each is an open file.
pub(super) const MAX_STRIPS: u32 = 512;
/// The greatest size of an index in bytes.
const MAX_INDEX_BYTES: u64 = 1 << 20;

/// A malformed index.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum IndexError {
    /// It is not JSON of this form.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
    /// The strips that it lists do not fit a build of its size.
    #[error("its strips do not make up such a build")]
    Strips,
}

/// The index of a build and its strips.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StripIndex {
    /// The build's name.
    pub(super) name: String,
    /// The build's width and height.
    pub(super) pixels: [u32; 2],
    pub(super) layers: u32,
    pub(super) mirrors: u32,
    pub(super) overlap: u32,
    #[serde(default = "Seam::unnamed")]
    pub(super) seam: Seam,
    pub(super) strips: Vec<StripLine>,
}

/// A strip in the index.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StripLine {
    pub(super) file: String,
    /// The first column of the build, and the one after the last.
    pub(super) columns: [u32; 2],
}

impl StripLine {
    fn of(swaths: &Swaths, swath: u32) -> Self {
        let Range { start, end } = swaths.columns(swath);
        Self { file: file_name(swath), columns: [start, end] }
    }
}

/// Returns the name of a strip's file.
pub(super) fn file_name(swath: u32) -> String {
    // Up to `MAX_STRIPS`, names sort as the strips lie.
    format!("strip_{swath:03}.tif")
}

impl StripIndex {
    pub(super) fn new(name: &str, [width, height]: [u32; 2], layers: u32, swaths: &Swaths) -> Self {
        Self {
            name: name.to_owned(),
            pixels: [width, height],
            layers,
            mirrors: swaths.mirrors,
            overlap: swaths.overlap,
            seam: swaths.seam,
            strips: (0..swaths.count()).map(|swath| StripLine::of(swaths, swath)).collect(),
        }
    }

    /// Returns the text, a line for each strip.
    pub(super) fn to_json(&self) -> String {
        let Self { name, pixels: [width, height], layers, mirrors, overlap, seam, strips } = self;
        let line = |strip| serde_json::to_string(strip).expect("texts and numbers are JSON");
        let strips: Vec<_> = strips.iter().map(|strip| format!("    {}", line(strip))).collect();
        let name = serde_json::to_string(name).expect("a text is JSON");
        format!(
            "{{\n  \"name\": {name},\n  \"pixels\": [{width}, {height}],\n  \"layers\": {layers},\n  \
             \"mirrors\": {mirrors},\n  \"overlap\": {overlap},\n  \"seam\": \"{seam}\",\n  \"strips\": [\n{}\n  ]\n}}\n",
            strips.join(",\n")
        )
    }

    /// Reads the index of a folder.
    pub(super) fn read(folder: &Path) -> Result<Self, StripsError> {
        let mut text = String::new();
        // A longer index is cut off, and then it is no JSON.
        let read = File::open(folder.join(INDEX))
            .and_then(|file| file.take(MAX_INDEX_BYTES).read_to_string(&mut text));
        read.map_err(|error| StripsError::In {
            file: INDEX.to_owned(),
            source: StackError::Io(error),
        })?;
        let index = Self::parse(&text)?;
        index.check_no_more(folder)?;
        Ok(index)
    }

    /// Checks that a folder has no strips that the index does not list.
    fn check_no_more(&self, folder: &Path) -> Result<(), StripsError> {
        for entry in fs::read_dir(folder).map_err(StackError::Io)? {
            let file = entry.map_err(StackError::Io)?.file_name().to_string_lossy().into_owned();
            // A strip left by another build would pass for one of this build.
            let is_strip = file.starts_with("strip_") && file.ends_with(".tif");
            if is_strip && self.strips.iter().all(|strip| strip.file != file) {
                return Err(StripsError::More { file: one_line(&file) });
            }
        }
        Ok(())
    }

    fn parse(text: &str) -> Result<Self, StripsError> {
        let json = |error| StripsError::Index(IndexError::Json(error));
        let index: Self = serde_json::from_str(text).map_err(json)?;
        let swaths = Swaths::new(index.mirrors, index.overlap, index.pixels[0])?;
        // A lying index must not make a list of millions of strips.
        let is_written = index.mirrors <= MAX_SIDE && swaths.count() <= MAX_STRIPS;
        let lines = (0..swaths.count()).map(|swath| StripLine::of(&swaths, swath));
        if !is_written || !lines.eq(index.strips.iter().cloned()) {
            return Err(StripsError::Index(IndexError::Strips));
        }
        Ok(index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_index_reads_back_and_what_is_none_is_refused() {
        let swaths = Swaths::new(10, 4, 22).unwrap();
        let index = StripIndex::new("a \"b\"", [22, 7], 3, &swaths);
        let text = index.to_json();
        assert_eq!(StripIndex::parse(&text).unwrap(), index);
        assert_eq!(text.lines().count(), 13);
        // As before there were seams.
        let unnamed = StripIndex::parse(&text.replace("  \"seam\": \"comb\",\n", "")).unwrap();
        assert_eq!(unnamed, StripIndex { seam: Seam::Gray, ..index });
        for (from, to) in [
            ("\"overlap\": 4", "\"overlap\": 5"),
            ("\"mirrors\": 10", "\"mirrors\": 11"),
            ("[22, 7]", "[33, 7]"),
            ("strip_001", "../strip_001"),
            ("[6,16]", "[6,15]"),
            ("\"layers\": 3", "\"layers\": -3"),
            ("\"comb\"", "\"brush\""),
            ("\"mirrors\": 10", "\"mirrors\": 4294967295"),
            ("\"name\"", "\"nom\""),
            ("]\n}", "]"),
        ] {
            assert!(text.contains(from), "{from} in {text}");
            assert!(StripIndex::parse(&text.replacen(from, to, 1)).is_err(), "{to}");
        }
    }
}
