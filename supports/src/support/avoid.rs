//! Surfaces that supports must not touch.

use std::fmt;
use std::str::FromStr;

use lamp_slicing::brep::vector::Vec3;
use lamp_slicing::{Paint, SurfaceName};
use lamp_stack::{Length, TomlError, UnknownName, line_of, one_line, read_toml};
use serde::Deserialize;
use thiserror::Error;

/// Surfaces that no support may touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AvoidedSurface {
    /// All surfaces in a box.
    Box(AvoidedBox),
    /// The surfaces of a name.
    Named(SurfaceName),
}

/// A box in part coordinates whose surfaces no support may touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AvoidedBox {
    /// From and to along x, y and z.
    pub sides: [[Length; 2]; 3],
}

/// An error in a list of surfaces to avoid.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line}: {problem}")]
pub struct AvoidError {
    /// The line, from 1.
    pub line: usize,
    /// The fault in it.
    pub problem: String,
}

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
    color: Option<String>,
    face: Option<toml::Value>,
    painted: Option<String>,
}

/// Reads a list of surfaces from TOML.
///
/// # Errors
/// Returns an error with the line if the text is no such list.
pub fn avoided_surfaces(text: &str) -> Result<Vec<AvoidedSurface>, AvoidError> {
    let file: AvoidFile =
        read_toml(text).map_err(|TomlError { line, problem, .. }| AvoidError { line, problem })?;
    let mut surfaces = Vec::new();
    let nothing = |line| AvoidError { line, problem: "it names no surface".to_owned() };
    if file.avoid.is_empty() {
        return Err(nothing(1));
    }
    for table in file.avoid {
        let line = line_of(text, Some(table.span()));
        let named = table.into_inner().surfaces();
        let named = named.map_err(|problem| AvoidError { line, problem })?;
        if named.is_empty() {
            return Err(nothing(line));
        }
        surfaces.extend(named);
    }
    Ok(surfaces)
}

impl AvoidTable {
    /// Returns the surfaces of the table: several if it lists faces.
    fn surfaces(self) -> Result<Vec<AvoidedSurface>, String> {
        let Self { x, y, z, color, face, painted } = self;
        let is_box = x.is_some() || y.is_some() || z.is_some();
        let kinds = [is_box, color.is_some(), face.is_some(), painted.is_some()];
        if kinds.iter().filter(|is_given| **is_given).count() != 1 {
            return Err("write a box (x, y and z), a color, a face or painted, in a table of its \
                        own"
            .to_owned());
        }
        let mut names = Vec::new();
        if let Some(color) = color {
            names.push(SurfaceName::Color(color.parse()?));
        }
        if let Some(paint) = painted {
            let paint: Paint = paint.parse().map_err(|error: UnknownName| error.to_string())?;
            names.push(SurfaceName::Painted(paint));
        }
        if let Some(face) = face {
            let faces = match face {
                toml::Value::Array(faces) => faces,
                face => vec![face],
            };
            for face in faces {
                let number = face.as_integer().and_then(|number| u64::try_from(number).ok());
                let number = number.ok_or_else(|| {
                    let face = one_line(&face.to_string());
                    format!(
                        "{face} is no face: write its number in the STEP file, such as 42 for #42"
                    )
                })?;
                names.push(SurfaceName::Face(number));
            }
        }
        if !is_box {
            return Ok(names.into_iter().map(AvoidedSurface::Named).collect());
        }
        let side = |name: &str, side: Option<[String; 2]>| {
            let [from, to] = side.ok_or_else(|| format!("a box without {name}"))?;
            let length = |text: &str| text.parse::<Length>().map_err(|error| error.to_string());
            let (from, to) = (length(&from)?, length(&to)?);
            if from < to { Ok([from, to]) } else { Err(format!("{from} is not below {to}")) }
        };
        let sides = [side("x", x)?, side("y", y)?, side("z", z)?];
        Ok(vec![AvoidedSurface::Box(AvoidedBox { sides })])
    }
}

impl fmt::Display for AvoidedSurface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Box(of_box) => of_box.fmt(f),
            Self::Named(name) => name.fmt(f),
        }
    }
}

impl FromStr for AvoidedSurface {
    type Err = String;

    /// Parses a box, such as `0mm..5mm x 0mm..5mm x 2mm..3mm`, or the name of a surface, such as
    /// `color #ff0000`.
    fn from_str(text: &str) -> Result<Self, String> {
        match text.contains("..") {
            true => text.parse().map(Self::Box),
            false => text.parse().map(Self::Named),
        }
    }
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
        let [AvoidedSurface::Box(first)] = avoided_surfaces(text).unwrap()[..] else {
            panic!("a box")
        };
        assert_eq!(first.to_string(), "-1mm..5mm x 0um..500um x 2mm..3mm");
        assert_eq!(first.to_string().parse(), Ok(AvoidedSurface::Box(first)));
        for (x, is_met) in [(5.0, true), (5.3, true), (5.4, false), (2.0, true), (-1.4, false)] {
            assert_eq!(first.is_met([x, 0.2, 2.5], 0.35), is_met, "{x}");
        }
        // At a corner, by the distance in space.
        assert!(!first.is_met([5.3, 0.8, 2.5], 0.35));
    }

    #[test]
    fn names_are_read_and_written() {
        let text = "[[avoid]]\ncolor = \"#FF8000\"\n[[avoid]]\nface = [42, 43]\n[[avoid]]\n\
                    face = 7\n[[avoid]]\npainted = \"blocked\"\n[[avoid]]\ncolor = \"red\"\n";
        let surfaces = avoided_surfaces(text).unwrap();
        let written: Vec<String> = surfaces.iter().map(ToString::to_string).collect();
        assert_eq!(
            written,
            [
                "color #ff8000",
                "face #42",
                "face #43",
                "face #7",
                "painted blocked",
                "color #ff0000"
            ]
        );
        assert!(written.iter().zip(surfaces).all(|(text, surface)| text.parse() == Ok(surface)));
    }

    #[test]
    fn faults_have_lines() {
        for (text, words) in [
            ("color = \"teal\"", "`teal` is not a color"),
            ("face = \"#42\"", "such as 42 for #42"),
            ("face = [1, -1]", "-1 is no face"),
            ("face = [[1]]", "[1] is no face"),
            ("painted = \"red\"", "none of enforced, blocked"),
            ("", "write a box"),
            ("color = \"red\"\nface = 1", "in a table of its own"),
            ("color = \"red\"\nx = [\"1mm\", \"2mm\"]", "in a table of its own"),
            ("x = [\"1mm\", \"0mm\"]\ny = [\"0mm\", \"1mm\"]\nz = [\"0mm\", \"1mm\"]", "not below"),
            ("x = [\"1mm\", \"2mm\"]", "without y"),
            ("x = [\"1mm\", \"2\"]", "unit"),
            ("q = 1", "unknown key"),
        ] {
            let error = avoided_surfaces(&format!("[[avoid]]\n{text}\n")).unwrap_err();
            assert!(error.problem.contains(words) && !error.problem.contains('\n'), "{error}");
            assert!((1..=3).contains(&error.line), "{error}");
        }
        assert!(avoided_surfaces("nonsense").unwrap_err().to_string().starts_with("line 1"));
    }
}
