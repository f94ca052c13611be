//! Surfaces that supports must not touch.

use std::fmt;
use std::str::FromStr;

use lamp_slicing::brep::vector::Vec3;
use lamp_stack::{Length, line_of, one_line};
use serde::Deserialize;
use thiserror::Error;

/// A box in part coordinates whose surfaces no support may touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AvoidedBox {
    /// From and to along x, y and z.
    pub sides: [[Length; 2]; 3],
}

/// An error in a list of surfaces to avoid.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum AvoidError {
    /// It is no list of boxes.
    #[error("line {line}: {problem}")]
    Syntax {
        /// The line, from 1.
        line: usize,
        /// The fault in it.
        problem: String,
    },
    /// A box is named by something that parts do not keep.
    #[error(
        "line {line}: parts are read without their {key}s: name the surface by a box, as \
         x = [\"0mm\", \"5mm\"], y and z"
    )]
    NotKept {
        /// The line, from 1.
        line: usize,
        /// The key.
        key: &'static str,
    },
}

/// Reads a list of boxes from TOML.
///
/// # Errors
/// Returns an error with the line if the text is no such list.
pub fn avoided_boxes(text: &str) -> Result<Vec<AvoidedBox>, AvoidError> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct AvoidFile {
        avoid: Vec<toml::Spanned<AvoidTable>>,
    }
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct AvoidTable {
        x: Option<[String; 2]>,
        y: Option<[String; 2]>,
        z: Option<[String; 2]>,
        color: Option<toml::Value>,
        face: Option<toml::Value>,
    }
    let file: AvoidFile = toml::from_str(text).map_err(|error| AvoidError::Syntax {
        line: line_of(text, error.span()),
        problem: one_line(error.message()),
    })?;
    let read = |table: toml::Spanned<AvoidTable>| {
        let line = line_of(text, Some(table.span()));
        let table = table.into_inner();
        for (key, value) in [("color", &table.color), ("face", &table.face)] {
            if value.is_some() {
                return Err(AvoidError::NotKept { line, key });
            }
        }
        let syntax = |problem: String| AvoidError::Syntax { line, problem };
        let side = |name: &str, side: Option<[String; 2]>| {
            let side = side.ok_or_else(|| syntax(format!("a box without {name}")))?;
            let [from, to] = side.map(|text| text.parse::<Length>());
            let from = from.map_err(|error| syntax(error.to_string()))?;
            let to = to.map_err(|error| syntax(error.to_string()))?;
            if from < to {
                Ok([from, to])
            } else {
                Err(syntax(format!("{from} is not below {to}")))
            }
        };
        Ok(AvoidedBox { sides: [side("x", table.x)?, side("y", table.y)?, side("z", table.z)?] })
    };
    file.avoid.into_iter().map(read).collect()
}

impl AvoidedBox {
    /// Returns whether a contact of this radius about a point may meet the box.
    pub(super) fn is_met(&self, at_mm: Vec3, radius_mm: f64) -> bool {
        // The distance from the nearest point of the box.
        let off = |k: usize| {
            let [from, to] = self.sides[k].map(Length::mm);
            (from - at_mm[k]).max(at_mm[k] - to).max(0.0)
        };
        (0..3).map(|k| off(k).powi(2)).sum::<f64>() <= radius_mm * radius_mm
    }
}

impl fmt::Display for AvoidedBox {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.sides.map(|[from, to]| format!("{from}..{to}"));
        write!(f, "{x} x {y} x {z}")
    }
}

impl FromStr for AvoidedBox {
    type Err = String;

    /// Parses `0mm..5mm x 0mm..5mm x 2mm..3mm`.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is not a box: write X..X x Y..Y x Z..Z with units");
        let side = |side: &str| -> Option<[Length; 2]> {
            let (from, to) = side.split_once("..")?;
            Some([from.parse().ok()?, to.parse().ok()?])
        };
        let sides: Option<Vec<[Length; 2]>> = text.split(" x ").map(side).collect();
        let sides = sides.and_then(|sides| sides.try_into().ok());
        sides.map(|sides| Self { sides }).ok_or_else(wrong)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_read_and_written() {
        let text = "[[avoid]]\nx = [\"-1mm\", \"5mm\"]\ny = [\"0mm\", \"500um\"]\nz = [\"2mm\", \"3mm\"]\n";
        let boxes = avoided_boxes(text).unwrap();
        assert_eq!(boxes[0].to_string(), "-1mm..5mm x 0um..500um x 2mm..3mm");
        assert_eq!(boxes[0].to_string().parse(), Ok(boxes[0]));
        for (x, is_met) in [(5.0, true), (5.3, true), (5.4, false), (2.0, true), (-1.4, false)] {
            assert_eq!(boxes[0].is_met([x, 0.2, 2.5], 0.35), is_met, "{x}");
        }
        // At a corner, by the distance in space.
        assert!(!boxes[0].is_met([5.3, 0.8, 2.5], 0.35));
        let error = |text: &str| avoided_boxes(text).unwrap_err().to_string();
        assert!(error("[[avoid]]\ncolor = \"red\"\n").contains("without their colors"));
        assert!(
            error(
                "[[avoid]]\nx = [\"1mm\", \"0mm\"]\ny = [\"0mm\", \"1mm\"]\nz = [\"0mm\", \"1mm\"]"
            )
            .contains("not below")
        );
        assert!(error("[[avoid]]\nx = [\"1mm\", \"2mm\"]").contains("without y"));
        assert!(error("[[avoid]]\nq = 1").starts_with("line 2"));
        assert!(error("nonsense").starts_with("line 1"));
    }
}
