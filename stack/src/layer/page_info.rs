//! The metadata of pages and stacks.

use std::ops::Range;

use serde::{Deserialize, Serialize, Serializer};
use serde_json::{Map, Value};

use crate::length::Length;

/// The content of a page's JSON line: the layer's index and the metadata that later stages
/// need. Unknown keys are kept.
///
/// Pages of other writers may have no line; the index is then the page's number.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PageInfo {
    /// The layer's index, 0 at the bottom.
    #[serde(rename = "layer")]
    pub index: u32,
    /// The height of the layer's bottom in part coordinates, in micrometers.
    #[serde(default, skip_serializing_if = "Option::is_none", serialize_with = "short_number")]
    pub z_um: Option<f64>,
    /// The layer's thickness in micrometers.
    #[serde(default, skip_serializing_if = "Option::is_none", serialize_with = "short_number")]
    pub thickness_um: Option<f64>,
    /// The image's top left corner (x, y) in part coordinates, in millimeters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin_mm: Option<[f64; 2]>,
    /// The layer's exposure time in milliseconds.
    #[serde(default, skip_serializing_if = "Option::is_none", serialize_with = "short_number")]
    pub exposure_ms: Option<f64>,
    /// True if every contour of the layer's section closes, false if not, `None` if unknown.
    /// An open contour may still leave every row balanced.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub closed: Option<bool>,
    /// The first row below each end of an open contour, increasing; it may be the row below the
    /// image. Rows begin or cease to miss crossings only there. Empty unless `closed` is false.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub open_rows: Vec<u32>,
    /// The rows whose crossings did not balance, increasing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stray_rows: Vec<u32>,
    /// The metadata of the whole stack, on page 0 only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stack: Option<StackInfo>,
    /// The unknown keys of the line.
    #[serde(flatten)]
    pub other: Map<String, Value>,
}

/// The metadata of a whole stack, on page 0. It has no date, host or path, so that equal
/// input gives equal bytes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StackInfo {
    /// The part's name.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub part: String,
    /// The commands that made the stack, first to last, with the options that affect the images.
    #[serde(default)]
    pub commands: Vec<String>,
    /// The digest of the input: `blake3:` and 64 hexadecimal digits.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub digest: String,
    /// The number of layers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layers: Option<u32>,
    /// The unknown keys.
    #[serde(flatten)]
    pub other: Map<String, Value>,
}

impl StackInfo {
    /// Returns the metadata of a range of the stack's layers, given the stack's first layer.
    /// The layers are assumed to be consecutive.
    pub fn of_range(self, first: u32, range: &Range<u32>) -> Self {
        let within = |layers: u32| {
            let end = first.saturating_add(layers).min(range.end);
            end.saturating_sub(first.max(range.start))
        };
        Self { layers: self.layers.map(within), ..self }
    }
}

impl PageInfo {
    /// Returns the height of the layer's bottom, if known.
    pub fn z(&self) -> Option<Length> {
        self.z_um.map(Length::from_um)
    }

    /// Returns a name for messages, such as `layer 812 (z 81.20 mm)`.
    pub fn name(&self) -> String {
        match self.z() {
            Some(z) => format!("layer {} (z {:.2} mm)", self.index, z.mm()),
            None => format!("layer {}", self.index),
        }
    }

    /// Returns the JSON line without the page's check.
    pub(crate) fn to_line(&self) -> String {
        serde_json::to_string(self).expect("maps have string keys and numbers are finite")
    }
}

/// Writes a whole number without `.0`.
#[expect(clippy::ref_option, reason = "serde calls it with a reference to the field")]
pub(crate) fn short_number<S: Serializer>(number: &Option<f64>, to: S) -> Result<S::Ok, S::Error> {
    match *number {
        None => to.serialize_none(),
        // Below 2^53, whole doubles are exact as integers.
        Some(n) if n.fract() == 0.0 && n.abs() < 1e15 => to.serialize_i64(n as i64),
        Some(n) => to.serialize_f64(n),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layer::check::PageLine;

    fn parse(line: &str) -> Option<PageInfo> {
        PageLine::parse(line.as_bytes()).map(|line| line.info)
    }

    #[test]
    fn the_line_of_the_format_reads_and_writes_back() {
        let line = r#"{"layer":812,"z_um":81200,"thickness_um":100,"origin_mm":[-1.016934,77.216934],"exposure_ms":136.7,"closed":false,"stray_rows":[1034,1035],"who":{"knows":[1,null]}}"#;
        let info = parse(line).unwrap();
        assert_eq!(info.index, 812);
        assert_eq!(info.z(), Some(Length::from_mm(81.2)));
        assert_eq!((info.closed, &info.stray_rows[..]), (Some(false), &[1034, 1035][..]));
        assert_eq!(info.name(), "layer 812 (z 81.20 mm)");
        assert_eq!(info.to_line(), line);
    }

    #[test]
    fn a_range_states_how_many_layers_it_has() {
        let of = |layers, range: Range<u32>| {
            let stack = StackInfo { layers, ..StackInfo::default() };
            stack.of_range(100, &range).layers
        };
        assert_eq!(of(Some(50), 0..u32::MAX), Some(50));
        assert_eq!(of(Some(50), 110..120), Some(10));
        assert_eq!(of(Some(50), 140..200), Some(10));
        assert_eq!(of(Some(50), 0..100), Some(0));
        assert_eq!(of(Some(50), 200..300), Some(0));
        assert_eq!(of(Some(u32::MAX), 90..u32::MAX), Some(u32::MAX - 100));
        assert_eq!(of(None, 110..120), None);
    }

    #[test]
    fn numbers_of_all_digits_pass_through_unchanged() {
        let line = r#"{"layer":1,"z_um":31.245270191439438,"who":121.48791951161945}"#;
        assert_eq!(parse(line).unwrap().to_line(), line);
    }

    #[test]
    fn other_descriptions_are_not_taken_for_ours() {
        for text in ["", "a scan", "{}", r#"{"layer":-1}"#, "[1]", "\u{0}"] {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}
