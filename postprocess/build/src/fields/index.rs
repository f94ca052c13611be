//! The index of a folder of strips or fields.

use std::fs::{self, File};
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use lamp_stack::{Dpi, Pitch, StackError, one_line, to_nm};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{FieldForm, FieldKind, FieldPlace, Fields, FieldsError, Seam};

/// The greatest number of fields that are written: each is an open file.
pub(super) const MAX_FIELDS: u32 = 512;
/// The greatest side of a field of rows and columns in pixels, more than any display has.
pub(super) const MAX_FIELD_SIDE: u32 = 65_535;
/// The greatest size of an index in bytes.
const MAX_INDEX_BYTES: u64 = 1 << 20;

/// A malformed index.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum IndexError {
    /// It is not JSON of this form.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
    /// The strips or fields that it lists do not fit a build of its size.
    #[error("its {0}s do not make up such a build")]
    Fields(FieldKind),
}

/// The index of a build and its fields.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FieldIndex {
    /// The build's name.
    pub(super) name: String,
    pub(super) layers: u32,
    /// The build's resolution, if fields have places in millimeters.
    pub(super) pitch: Option<Pitch>,
    pub(super) fields: Fields,
}

/// An index of strips, as it stands in its file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StripsFile {
    name: String,
    /// The build's width and height.
    pixels: [u32; 2],
    layers: u32,
    mirrors: u32,
    overlap: u32,
    #[serde(default = "Seam::unnamed")]
    seam: Seam,
    strips: Vec<StripLine>,
}

/// A strip in its index.
#[derive(PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StripLine {
    file: String,
    /// The first column of the build, and the one after the last.
    columns: [u32; 2],
}

/// An index of fields, as it stands in its file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FieldsFile {
    name: String,
    /// The build's width and height.
    pixels: [u32; 2],
    layers: u32,
    dpi: Option<Pitch>,
    /// A field's width and height.
    field: [u32; 2],
    overlap: u32,
    seam: Seam,
    fields: Vec<FieldLine>,
}

/// A field in its index.
#[derive(PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FieldLine {
    row: u32,
    column: u32,
    file: String,
    /// The first column of the build, and the one after the last.
    columns: [u32; 2],
    /// The first row of the build, and the one after the last.
    rows: [u32; 2],
    /// From the build's left edge to the field's.
    x_mm: Option<f64>,
    /// From the build's top edge down to the field's.
    y_mm: Option<f64>,
}

impl StripLine {
    fn of(index: &FieldIndex, field: u32) -> Self {
        let Range { start, end } = index.fields.columns(field);
        Self { file: index.file_name(field), columns: [start, end] }
    }
}

impl FieldLine {
    fn of(index: &FieldIndex, field: u32) -> Self {
        let FieldPlace { row, column } = index.fields.place(field);
        let (columns, rows) = (index.fields.columns(field), index.fields.rows(field));
        let mm = |axis: fn(&Pitch) -> Dpi, pixels: u32| {
            let pitch = index.pitch.as_ref().map(axis)?.pitch();
            Some(to_nm(f64::from(pixels) * pitch.mm()))
        };
        Self {
            row,
            column,
            file: index.file_name(field),
            x_mm: mm(|pitch| pitch.x, columns.start),
            y_mm: mm(|pitch| pitch.y, rows.start),
            columns: [columns.start, columns.end],
            rows: [rows.start, rows.end],
        }
    }
}

impl FieldIndex {
    fn file_name(&self, field: u32) -> String {
        self.fields.form().file_name(self.fields.place(field))
    }

    fn lines<L>(&self, line: fn(&Self, u32) -> L) -> impl Iterator<Item = L> {
        (0..self.fields.count()).map(move |field| line(self, field))
    }

    /// Returns the text, a line for each field.
    pub(super) fn to_json(&self) -> String {
        let Self { name, layers, fields, .. } = self;
        let FieldForm { width: field_width, height: field_height, overlap, seam } = fields.form();
        let [width, height] = fields.layer_size();
        let name = serde_json::to_string(name).expect("a text is JSON");
        let dpi = serde_json::to_string(&self.pitch).expect("a number is JSON");
        let (size, kind, lines) = match field_height {
            None => {
                (format!("\"mirrors\": {field_width}"), "strips", json(self.lines(StripLine::of)))
            }
            Some(field_height) => (
                format!("\"dpi\": {dpi},\n  \"field\": [{field_width}, {field_height}]"),
                "fields",
                json(self.lines(FieldLine::of)),
            ),
        };
        format!(
            "{{\n  \"name\": {name},\n  \"pixels\": [{width}, {height}],\n  \"layers\": {layers},\n  \
             {size},\n  \"overlap\": {overlap},\n  \"seam\": \"{seam}\",\n  \"{kind}\": [\n{lines}\n  ]\n}}\n"
        )
    }

    /// Reads the index of a folder.
    pub(super) fn read(folder: &Path) -> Result<Self, FieldsError> {
        let is_there = |kind: &FieldKind| folder.join(kind.index()).is_file();
        let kind = FieldKind::ALL.into_iter().find(is_there).unwrap_or(FieldKind::Strip);
        let mut text = String::new();
        // A longer index is cut off, and then it is no JSON.
        let read = File::open(folder.join(kind.index()))
            .and_then(|file| file.take(MAX_INDEX_BYTES).read_to_string(&mut text));
        read.map_err(|error| FieldsError::In {
            file: kind.index().to_owned(),
            source: StackError::Io(error),
        })?;
        let index = Self::parse(&text, kind)?;
        index.check_no_more(folder)?;
        Ok(index)
    }

    /// Checks that a folder has no strips or fields that the index does not list.
    fn check_no_more(&self, folder: &Path) -> Result<(), FieldsError> {
        let kind = self.fields.form().kind();
        for entry in fs::read_dir(folder).map_err(StackError::Io)? {
            let file = entry.map_err(StackError::Io)?.file_name().to_string_lossy().into_owned();
            // A field left by another build would pass for one of this build.
            let is_field = file.starts_with(&format!("{kind}_")) && file.ends_with(".tif");
            if is_field && (0..self.fields.count()).all(|field| self.file_name(field) != file) {
                return Err(FieldsError::More { file: one_line(&file), kind });
            }
        }
        Ok(())
    }

    fn parse(text: &str, kind: FieldKind) -> Result<Self, FieldsError> {
        let malformed = || malformed(kind, IndexError::Fields(kind));
        let (index, is_alike) = match kind {
            FieldKind::Strip => {
                let StripsFile { name, pixels, layers, mirrors, overlap, seam, strips } =
                    from_json(text, kind)?;
                let form = FieldForm { width: mirrors, height: None, overlap, seam };
                let index = Self { name, layers, pitch: None, fields: form.fields(pixels)? };
                let is_alike = index.lines(StripLine::of).eq(strips);
                (index, is_alike)
            }
            FieldKind::Field => {
                let FieldsFile { name, pixels, layers, dpi, field, overlap, seam, fields } =
                    from_json(text, kind)?;
                let [width, height] = field;
                let form = FieldForm { width, height: Some(height), overlap, seam };
                let index = Self { name, layers, pitch: dpi, fields: form.fields(pixels)? };
                let is_alike = index.lines(FieldLine::of).eq(fields);
                (index, is_alike)
            }
        };
        if is_alike { Ok(index) } else { Err(malformed()) }
    }
}

fn from_json<F: DeserializeOwned>(text: &str, kind: FieldKind) -> Result<F, FieldsError> {
    serde_json::from_str(text).map_err(|error| malformed(kind, error.into()))
}

fn malformed(kind: FieldKind, source: IndexError) -> FieldsError {
    FieldsError::Index { kind, source }
}

/// Returns the lines of a list.
fn json<L: Serialize>(lines: impl Iterator<Item = L>) -> String {
    let line = |line: L| serde_json::to_string(&line).expect("texts and numbers are JSON");
    lines.map(|of| format!("    {}", line(of))).collect::<Vec<_>>().join(",\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_index_reads_back_and_what_is_none_is_refused() {
        let form = FieldForm { width: 10, height: None, overlap: 4, seam: Seam::Comb };
        let fields = form.fields([22, 7]).unwrap();
        let index = FieldIndex { name: "a \"b\"".to_owned(), layers: 3, pitch: None, fields };
        let text = index.to_json();
        let parse = |text: &str| FieldIndex::parse(text, FieldKind::Strip);
        assert_eq!(parse(&text).unwrap(), index);
        assert_eq!(text.lines().count(), 13);
        // As before there were seams.
        let unnamed = parse(&text.replace("  \"seam\": \"comb\",\n", "")).unwrap();
        assert_eq!(unnamed.fields.form(), FieldForm { seam: Seam::Gray, ..form });
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
            assert!(parse(&text.replacen(from, to, 1)).is_err(), "{to}");
        }
    }

    #[test]
    fn an_index_of_fields_has_rows_columns_and_places() {
        let form = FieldForm { width: 10, height: Some(8), overlap: 2, seam: Seam::Comb };
        let fields = form.fields([22, 13]).unwrap();
        let index =
            FieldIndex { name: "a".to_owned(), layers: 3, pitch: Pitch::of_dpi(1500.0), fields };
        let text = index.to_json();
        let parse = |text: &str| FieldIndex::parse(text, FieldKind::Field);
        assert_eq!(parse(&text).unwrap(), index);
        // 8 pixels of 25.4 mm / 1500.
        let line = r#"{"row":0,"column":1,"file":"field_000_001.tif","columns":[8,18],"rows":[0,8],"x_mm":0.135467,"y_mm":0.0}"#;
        assert!(text.contains(line), "{text}");
        let without = FieldIndex { pitch: None, ..index.clone() };
        assert!(without.to_json().contains("\"x_mm\":null"));
        assert_eq!(parse(&without.to_json()).unwrap(), without);
        for (from, to) in [
            ("\"overlap\": 2", "\"overlap\": 4"),
            ("\"field\": [10, 8]", "\"field\": [10, 9]"),
            ("\"field\": [10, 8]", "\"field\": [10, 0]"),
            ("\"field\": [10, 8]", "\"field\": [10, 4294967295]"),
            ("\"field\": [10, 8]", "\"field\": [1, 8]"),
            ("\"dpi\": 1500", "\"dpi\": 1501"),
            ("\"dpi\": 1500", "\"dpi\": -1"),
            ("[22, 13]", "[22, 12]"),
            ("[22, 13]", "[4294967295, 4294967295]"),
            ("\"row\":0", "\"row\":1"),
            ("field_000_001", "../field_000_001"),
            ("[8,18]", "[8,17]"),
            ("[0,8]", "[0,7]"),
            ("\"comb\"", "\"brush\""),
            ("\"y_mm\":0.0", "\"y_mm\":0.1"),
        ] {
            assert!(text.contains(from), "{from} in {text}");
            assert!(parse(&text.replacen(from, to, 1)).is_err(), "{to}");
        }
    }
}
