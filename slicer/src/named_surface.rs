//! Surfaces of parts that people name: by color, by face, or by their paint in a slicer.

use std::collections::BTreeMap;
use std::fmt;
use std::io;
use std::str::FromStr;

use lamp_brep::Color;
use lamp_brep::vector::Vec3;
use thiserror::Error;

use crate::binary_stl::{FACET_BYTES, HEADER_BYTES};
use crate::error::SliceError;
use crate::facet::Units;
use crate::paint::{Paint, divided};
use crate::part::Part;
use crate::part_file::OpenPartFile;
use crate::piece::{Facets, Piece};
use crate::placed_part::PlacedPart;
use crate::placement::Placement;

/// A name of surfaces of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceName {
    /// Facets of this color.
    Color(Color),
    /// The face with this number in a STEP file, such as 42 for `#42`.
    Face(u64),
    /// Regions painted for supports in a project of a slicer.
    Painted(Paint),
}

impl fmt::Display for SurfaceName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Color(color) => write!(f, "color {color}"),
            Self::Face(number) => write!(f, "face #{number}"),
            Self::Painted(paint) => write!(f, "painted {paint}"),
        }
    }
}

impl FromStr for SurfaceName {
    type Err = String;

    /// Parses `color #ff0000`, `face #42` or `painted blocked`.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("`{text}` is no surface: write color #ff0000, face #42 or painted blocked");
        let (key, value) = text.split_once(' ').ok_or_else(wrong)?;
        match key {
            "color" => value.parse().map(Self::Color),
            "painted" => value.parse().map(Self::Painted).map_err(|_| wrong()),
            "face" => {
                let number = value.strip_prefix('#').and_then(|number| number.parse().ok());
                number.map(Self::Face).ok_or_else(wrong)
            }
            _ => Err(wrong()),
        }
    }
}

/// The reason why a part's surfaces cannot be returned.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// The part has no surface of this name.
    #[error("no surface is `{name}`: {}", known.sentence(*name))]
    None {
        /// The name.
        name: SurfaceName,
        /// The names of its surfaces.
        known: Box<SurfaceNames>,
    },
    /// The part cannot be read.
    #[error(transparent)]
    Part(#[from] SliceError),
}

/// The names of a part's surfaces, with their numbers of facets.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SurfaceNames {
    /// The colors, the most frequent first.
    pub colors: Vec<(Color, usize)>,
    /// The numbers of faces in STEP files, in ascending order.
    pub faces: Vec<(u64, usize)>,
    /// The facets on which something is painted, wholly or in part.
    pub painted: Vec<(Paint, usize)>,
}

impl SurfaceNames {
    /// The greatest number of colors that a sentence lists.
    const MOST: usize = 4;

    /// Returns what there is instead of a name.
    fn sentence(&self, name: SurfaceName) -> String {
        let facets = |count: &usize| match count {
            1 => "1 facet".to_owned(),
            count => format!("{count} facets"),
        };
        let listed = |names: Vec<String>| match names.len().saturating_sub(Self::MOST) {
            0 => names.join(", "),
            more => format!("{} and {more} more", names[..Self::MOST].join(", ")),
        };
        match name {
            SurfaceName::Color(_) if self.colors.is_empty() => {
                "no facet of the part has a color".to_owned()
            }
            SurfaceName::Color(_) => {
                let named =
                    |(color, count): &(Color, usize)| format!("{color} ({})", facets(count));
                format!("the part's colors are {}", listed(self.colors.iter().map(named).collect()))
            }
            SurfaceName::Face(_) => match (self.faces.first(), self.faces.last()) {
                (Some((first, _)), Some((last, _))) => {
                    let count = self.faces.len();
                    format!("the part's {count} faces have numbers from #{first} to #{last}")
                }
                _ => "only faces of STEP parts, read by lamp's own kernel, have numbers".to_owned(),
            },
            SurfaceName::Painted(_) if self.painted.is_empty() => {
                "nothing is painted on the part for supports".to_owned()
            }
            SurfaceName::Painted(_) => {
                let named =
                    |(paint, count): &(Paint, usize)| format!("{paint} ({})", facets(count));
                format!("the part is painted {}", listed(self.painted.iter().map(named).collect()))
            }
        }
    }
}

impl Part {
    /// Returns the facets of surfaces in the part's place: corners in millimeters. Painted facets are
    /// divided as their paint is. Files that do not state a unit are in `units`.
    ///
    /// Colors and paint of 3MF and OBJ files are known if [`OpenOptions::keep_marks`] kept them.
    ///
    /// # Errors
    /// Returns an error if the part has no surface of this name, or cannot be read.
    ///
    /// [`OpenOptions::keep_marks`]: crate::OpenOptions::keep_marks
    pub fn surface(
        &self,
        name: SurfaceName,
        placement: &Placement,
        units: Units,
    ) -> Result<Vec<[Vec3; 3]>, SurfaceError> {
        let placed = PlacedPart::new(self.clone(), placement, units);
        let mut found = Vec::new();
        for (number, piece) in self.pieces().iter().enumerate() {
            let marks = PieceMarks::of(piece).map_err(|error| self.reason(error.into()))?;
            let transform = placed.transform_of(number);
            let mut facet_number = 0;
            let read = piece.facets.for_each(0..piece.facets.count(), |facet| {
                let number = facet_number;
                facet_number += 1;
                let corners = || transform.placed(facet).map(|[x, y, um]| [x, y, um / 1000.0]);
                match name {
                    SurfaceName::Color(_) | SurfaceName::Face(_) if marks.is(number, name) => {
                        found.push(corners());
                    }
                    SurfaceName::Painted(paint) => marks.divide(number, corners, |of, corners| {
                        if of == Some(paint) {
                            found.push(corners);
                        }
                    }),
                    _ => {}
                }
            });
            read.map_err(|error| self.reason(error.into()))?;
        }
        self.check_unchanged()?;
        if found.is_empty() {
            let known = Box::new(self.surface_names()?);
            return Err(SurfaceError::None { name, known });
        }
        Ok(found)
    }

    /// Returns the names of its surfaces, as far as [`surface`](Self::surface) knows them.
    ///
    /// # Errors
    /// Returns an error if the part cannot be read.
    pub fn surface_names(&self) -> Result<SurfaceNames, SliceError> {
        let (mut colors, mut faces) = (BTreeMap::new(), BTreeMap::new());
        let mut painted = [Paint::Enforced, Paint::Blocked].map(|paint| (paint, 0));
        for piece in self.pieces() {
            let marks = PieceMarks::of(piece).map_err(|error| self.reason(error.into()))?;
            for color in marks.colors.iter().flatten() {
                *colors.entry(*color).or_default() += 1;
            }
            for face in marks.faces.iter().filter(|face| **face > 0) {
                *faces.entry(*face).or_default() += 1;
            }
            for (number, _) in marks.painted {
                let mut has = [false; 2];
                marks.divide(*number, Default::default, |of, _| {
                    has[0] |= of == Some(Paint::Enforced);
                    has[1] |= of == Some(Paint::Blocked);
                });
                painted.iter_mut().zip(has).for_each(|(count, has)| count.1 += usize::from(has));
            }
        }
        let mut colors: Vec<(Color, usize)> = colors.into_iter().collect();
        colors.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        let painted = painted.into_iter().filter(|(_, count)| *count > 0).collect();
        Ok(SurfaceNames { colors, faces: faces.into_iter().collect(), painted })
    }
}

/// The marks of a piece, however its format has them.
struct PieceMarks<'a> {
    /// The color of each facet; empty if none has one.
    colors: Vec<Option<Color>>,
    /// The number of the face of each facet; empty if there are no faces.
    faces: Vec<u64>,
    painted: &'a [(usize, Box<str>)],
}

impl<'a> PieceMarks<'a> {
    fn of(piece: &'a Piece) -> io::Result<Self> {
        let painted = piece.marks.as_ref().map_or(&[][..], |marks| &marks.painted);
        let (colors, faces) = match &piece.facets {
            Facets::Memory(_) | Facets::Prisms(_) => {
                let marks = piece.marks.as_ref();
                (marks.map(|marks| marks.colors.clone()).unwrap_or_default(), Vec::new())
            }
            Facets::Binary { file, count } => (stl_colors(file, *count)?, Vec::new()),
            Facets::Surfaces { prepared, facets } => {
                let kernel = &prepared.kernel;
                let facets = &prepared.mesh.facets[facets.clone()];
                // Facets are sorted by face, and each face is asked once.
                let of_faces = facets.chunk_by(|a, b| a.face == b.face).flat_map(|facets| {
                    let face = facets[0].face;
                    let marks = (kernel.color(face), kernel.face(face).entity);
                    std::iter::repeat_n(marks, facets.len())
                });
                of_faces.unzip()
            }
        };
        Ok(Self { colors, faces, painted })
    }

    /// Returns whether a facet has a color or is of a face.
    fn is(&self, facet: usize, name: SurfaceName) -> bool {
        match name {
            SurfaceName::Color(color) => self.colors.get(facet) == Some(&Some(color)),
            SurfaceName::Face(number) => number > 0 && self.faces.get(facet) == Some(&number),
            SurfaceName::Painted(_) => false,
        }
    }

    /// Calls `each` with the triangles of a facet that is painted.
    fn divide(
        &self,
        facet: usize,
        corners: impl FnOnce() -> [Vec3; 3],
        each: impl FnMut(Option<Paint>, [Vec3; 3]),
    ) {
        if let Ok(place) = self.painted.binary_search_by_key(&facet, |(facet, _)| *facet) {
            // The digits were checked when they were read.
            let _ = divided(&self.painted[place].1, corners(), each);
        }
    }
}

/// Returns the colors that programs put into the two bytes after each facet of a binary STL, which
/// are zero in the original format.
///
/// `VisCAM` and `SolidView` write 15 bits, blue the lowest, and set the sixteenth. Magics writes red
/// the lowest, and sets the sixteenth where the color after `COLOR=` in the header counts; without
/// that header there are no colors of Magics.
fn stl_colors(file: &OpenPartFile, count: usize) -> io::Result<Vec<Option<Color>>> {
    let header = file.start(80)?;
    let of_part = header.windows(6).position(|window| window == b"COLOR=");
    let of_part = of_part.and_then(|at| header.get(at + 6..at + 9)?.try_into().ok()).map(Color);
    let mut colors = Vec::with_capacity(count);
    let bytes = HEADER_BYTES..HEADER_BYTES + (count * FACET_BYTES) as u64;
    file.for_each_record(bytes, |record: &[u8; FACET_BYTES]| {
        let bits = u16::from_le_bytes([record[48], record[49]]);
        // 31 stands for 255.
        let levels =
            [0, 5, 10].map(|shift| ((u32::from(bits >> shift & 31) * 255 + 15) / 31) as u8);
        let [low, middle, high] = levels;
        let is_marked = bits >> 15 == 1;
        colors.push(match of_part {
            Some(color) if is_marked => Some(color),
            Some(_) => Some(Color([low, middle, high])),
            None => is_marked.then_some(Color([high, middle, low])),
        });
    })?;
    Ok(colors)
}

#[cfg(test)]
mod tests;
