//! A file of a part, and where it stands among others.

use std::ffi::OsString;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use lamp_slicing::{Axis, Placement};
use lamp_stack::{Length, file_word};

use crate::documents::{input_name, is_stream};

/// A part's file, and its own placement: `core.stl@50mm,0,0,90`.
#[derive(Clone, Debug, PartialEq)]
pub struct PartFile {
    /// The file; `-` is standard input.
    pub path: PathBuf,
    /// Where it stands, if not at its own coordinates.
    pub placement: Option<PartPlacement>,
}

impl PartFile {
    /// Reads `FILE` or `FILE@X,Y,Z,DEGREES`: the text after the last `@` is a placement, unless a
    /// file has the whole name.
    ///
    /// # Errors
    /// Returns a sentence if there is such a file, and the rest is no placement.
    pub fn parse(text: OsString) -> Result<Self, String> {
        let split = text.to_str().and_then(|text| text.rsplit_once('@'));
        let named = |name: &str| is_stream(Path::new(name)) || Path::new(name).exists();
        match split {
            // Names of files may have an `@` themselves: a file of the whole name is meant.
            Some((name, placement)) if !Path::new(&text).exists() => match placement.parse() {
                Ok(placement) => Ok(Self { path: name.into(), placement: Some(placement) }),
                // The file is there, so the rest was meant as a placement.
                Err(why) if named(name) => Err(why),
                Err(_) => Ok(Self { path: text.into(), placement: None }),
            },
            _ => Ok(Self { path: text.into(), placement: None }),
        }
    }

    /// Returns the name for messages.
    pub fn name(&self) -> String {
        input_name(&self.path)
    }

    /// Returns the file's name without its folder. Pipes have no names that last.
    pub fn file(&self) -> String {
        let is_file = self.path.metadata().is_ok_and(|metadata| metadata.is_file());
        let name = self.path.file_name().filter(|_| is_file);
        name.map_or_else(|| "-".to_owned(), |name| name.to_string_lossy().into_owned())
    }

    /// Returns the file as a stack records it: its name, and the placement.
    #[must_use]
    pub fn named(&self) -> Self {
        Self { path: self.file().into(), placement: self.placement }
    }

    /// Returns true if a stack records the same place for both.
    pub fn stands_like(&self, other: &Self) -> bool {
        let [a, b] = [self, other].map(|part| part.placement.unwrap_or_default());
        a == b
    }
}

impl fmt::Display for PartFile {
    /// Writes text that [`FromStr`] and [`PartFile::parse`] read.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let file = self.path.to_string_lossy();
        // In a name with an `@`, the rest would be read as the placement.
        let placement = self.placement.or_else(|| file.contains('@').then(PartPlacement::default));
        f.write_str(&if is_stream(&self.path) { file } else { file_word(&file) })?;
        placement.map_or(Ok(()), |placement| write!(f, "@{placement}"))
    }
}

impl FromStr for PartFile {
    type Err = std::convert::Infallible;

    /// Reads a recorded file, whatever files there are here.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let placed = text.rsplit_once('@').and_then(|(file, placement)| {
            Some(Self { path: file.into(), placement: Some(placement.parse().ok()?) })
        });
        Ok(placed.unwrap_or_else(|| Self { path: text.into(), placement: None }))
    }
}

/// Returns files and placements as a stack records them, for messages.
pub fn names_of(files: &[PartFile]) -> String {
    files.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

/// Returns the paths of parts.
pub fn paths(parts: &[PartFile]) -> impl Iterator<Item = &PathBuf> {
    parts.iter().map(|part| &part.path)
}

/// A turn about z, in degrees counter-clockwise seen from above, and then a move.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PartPlacement {
    by: [Length; 3],
    degrees: f64,
}

impl PartPlacement {
    /// Returns the placement of its facets.
    pub fn placement(self) -> Placement {
        Placement::default().rotated(Axis::Z, self.degrees).translated(self.by.map(Length::mm))
    }
}

impl fmt::Display for PartPlacement {
    /// Formats in millimeters: `50,0,0,90`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.by.map(Length::mm);
        write!(f, "{x},{y},{z},{}", self.degrees)
    }
}

impl FromStr for PartPlacement {
    type Err = String;

    /// Parses `x,y`, `x,y,z` or `x,y,z,degrees`; lengths without a unit are in millimeters.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "`{text}` is not a placement: write @X,Y,Z,DEGREES, such as @50mm,0,0,90 or @2in,0"
            )
        };
        let number = |text: &str| text.parse().ok().filter(|number: &f64| number.is_finite());
        let length = |text: &&str| {
            let mm = number(text.trim()).map(Length::from_mm);
            mm.or_else(|| text.parse().ok()).ok_or_else(wrong)
        };
        let values: Vec<&str> = text.split(',').collect();
        let (lengths, turn) = values.split_at(values.len().min(3));
        let degrees = match turn {
            [] if lengths.len() > 1 => 0.0,
            [degrees] => number(degrees.trim()).ok_or_else(wrong)?,
            _ => return Err(wrong()),
        };
        let mut by = [Length::default(); 3];
        for (by, text) in by.iter_mut().zip(lengths) {
            *by = length(text)?;
        }
        Ok(Self { by, degrees })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> PartFile {
        PartFile::parse(text.into()).unwrap()
    }

    #[test]
    fn placements_are_read_as_they_are_written() {
        for (text, recorded) in [
            ("50,0", "50,0,0,0"),
            ("5cm, -2mm ,1in,-12.5", "50,-2,25.4,-12.5"),
            ("0,0,0.5,90", "0,0,0.5,90"),
        ] {
            let placement: PartPlacement = text.parse().unwrap();
            assert_eq!(placement.to_string(), recorded);
            assert_eq!(recorded.parse(), Ok(placement));
        }
        for wrong in ["", "1", "1,2,3,4,5", "1,2,x", "1,nan", "1,2,3,90deg", "1,,2", "1,2furlong"] {
            assert!(wrong.parse::<PartPlacement>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn it_turns_and_then_moves() {
        let placement: PartPlacement = "50,0,1,90".parse().unwrap();
        assert_eq!(placement.placement().at([2.0, 0.0, 0.0]), [50.0, 2.0, 1.0]);
    }

    #[test]
    fn names_may_hold_the_sign() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
        let [plain, signed, placed] = ["a.stl", "b@c.stl", "d@1,2"].map(path);
        for file in [&plain, &signed, &placed] {
            std::fs::write(file, "solid").unwrap();
        }
        for file in [&plain, &signed, &placed, &path("e@f.stl")] {
            let alone = PartFile { path: file.into(), placement: None };
            assert_eq!(parsed(file), alone);
            let at = parsed(&format!("{file}@1,2,3,4"));
            assert_eq!((at.path, at.placement.is_some()), (alone.path, true));
        }
        assert!(PartFile::parse(format!("{plain}@1,x").into()).unwrap_err().contains("`1,x`"));
        assert_eq!(parsed(&format!("{placed}@1,2")).named().to_string(), "d@1,2@1,2,0,0");
        assert_eq!(parsed("-@1,2").named().to_string(), "-@1,2,0,0");
    }

    #[test]
    fn a_record_is_read_as_it_was_written() {
        let placement: PartPlacement = "5,-2,0.5,90".parse().unwrap();
        for (name, placement, text) in [
            ("a b.stl", None, "a b.stl"),
            ("a.stl", Some(placement), "a.stl@5,-2,0.5,90"),
            ("b@1,2", None, "b@1,2@0,0,0,0"),
            ("./--x.stl", None, "./--x.stl"),
            ("-", Some(placement), "-@5,-2,0.5,90"),
        ] {
            let file = PartFile { path: name.into(), placement };
            assert_eq!(file.to_string(), text);
            let Ok(read) = text.parse::<PartFile>();
            assert_eq!((read.to_string().as_str(), read.path.to_str()), (text, Some(name)));
            assert!(read.stands_like(&file));
        }
    }
}
