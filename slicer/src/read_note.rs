//! Defines notes on the contents of a part's file that slicing does not use.

use std::fmt;

use lamp_stack::one_line;

/// Contents of a part's file that slicing does not use, or that were read differently from the
/// format's definition. As text it is one sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReadNote {
    /// Objects of a 3MF file that are not solids: supports, surfaces and others.
    NoSolids {
        /// The number of times that items and components place them.
        items: usize,
    },
    /// Items of a 3MF file that are not to be printed.
    NotPrintable {
        /// The number of items.
        items: usize,
    },
    /// Volumes of a slicer's project that are not solids.
    Volumes {
        /// Their kind, such as `modifier`.
        kind: String,
        /// The number of volumes.
        volumes: usize,
    },
    /// Negative volumes of a slicer's project without solids to subtract them from.
    LoneNegatives {
        /// The number of volumes.
        volumes: usize,
    },
    /// Slices of a 3MF file in addition to a mesh of the same volume.
    Slices {
        /// The number of objects.
        objects: usize,
    },
    /// Meshes of a 3MF file in addition to slices that represent something else.
    StandIns {
        /// The number of objects.
        objects: usize,
    },
    /// Elements of objects that belong to an unknown extension of 3MF.
    Extension {
        /// The extension's name.
        name: String,
    },
    /// Data of a slicer's project for resin printers.
    ProjectData {
        /// Its name.
        what: &'static str,
    },
    /// Several plates of a slicer's project, which are built at once.
    Plates {
        /// The number of plates.
        plates: usize,
    },
    /// Bytes after the last facet.
    BytesAfter {
        /// The number of bytes.
        bytes: u64,
    },
    /// A binary STL with more facets than its header declares. Programs write such files if they do
    /// not know the number when they begin.
    WrongCount {
        /// The number of facets in the header.
        declared: u32,
        /// The number of facets in the file, which are read.
        held: usize,
    },
    /// An ASCII STL without an end, which may be cut off between two facets.
    NoEnd,
    /// Numbers with commas for decimal points.
    DecimalCommas,
    /// Statements of a text other than facets and their enclosing statements.
    Statements {
        /// The word that they begin with; empty for several other words.
        word: String,
        /// The number of statements.
        count: u64,
    },
    /// Faces of an OBJ with one or two corners.
    FewCorners {
        /// The number of faces.
        faces: u64,
    },
    /// Contents of a contour file or a layout that have no area, or are not read.
    LeftOut {
        /// Their name, of one and of several.
        what: [&'static str; 2],
        /// Their number.
        count: u64,
    },
    /// The masks of a layout, which are pages.
    Masks {
        /// Their names, from page 0.
        names: Vec<String>,
    },
    /// Cells of a GDSII library that no other cell places.
    TopCells {
        /// The number of cells.
        cells: usize,
    },
    /// A drawing that states no unit.
    NoUnit {
        /// The unit that is taken.
        taken: &'static str,
    },
    /// A file of an OBJ's materials that cannot be read, so that their colors are unknown.
    NoMaterials {
        /// Its name in the OBJ.
        file: String,
    },
}

/// The number of words whose statements are counted separately.
const MAX_WORDS: usize = 8;
/// The greatest number of characters of a word that a note quotes.
const MAX_CHARACTERS: usize = 40;
/// The number of masks that a note names.
const MAX_MASKS: usize = 32;

impl ReadNote {
    /// Adds a note on contents that are left out, if there are any.
    pub(crate) fn leave_out(notes: &mut Vec<Self>, what: [&'static str; 2], count: u64) {
        if count > 0 {
            notes.push(Self::LeftOut { what, count });
        }
    }

    /// Counts a statement that is skipped.
    pub(crate) fn count_statement(notes: &mut Vec<Self>, statement: &[u8]) {
        let quoted = String::from_utf8_lossy(statement);
        let mut quoted: String = quoted.chars().take(MAX_CHARACTERS).collect();
        let words = notes.iter().filter(|note| matches!(note, Self::Statements { .. })).count();
        let is_known =
            |note: &Self| matches!(note, Self::Statements { word, .. } if *word == quoted);
        // A damaged text has a new word in each line, and its notes would fill screens.
        if words >= MAX_WORDS && !notes.iter().any(is_known) {
            quoted.clear();
        }
        for note in &mut *notes {
            if let Self::Statements { word, count } = note
                && *word == quoted
            {
                *count += 1;
                return;
            }
        }
        notes.push(Self::Statements { word: quoted, count: 1 });
    }
}

impl fmt::Display for ReadNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSolids { items: 1 } => write!(f, "1 item is left out: it is not a solid"),
            Self::NoSolids { items } => {
                write!(f, "{items} items are left out: they are not solids")
            }
            Self::NotPrintable { items: 1 } => {
                write!(f, "1 item is left out: its file marks it as not printable")
            }
            Self::NotPrintable { items } => {
                write!(f, "{items} items are left out: their file marks them as not printable")
            }
            Self::Volumes { kind, volumes: 1 } => {
                write!(f, "1 volume is left out: its kind is {kind}")
            }
            Self::Volumes { kind, volumes } => {
                write!(f, "{volumes} volumes are left out: their kind is {kind}")
            }
            Self::LoneNegatives { volumes: 1 } => {
                write!(f, "1 negative volume is left out: its object has no solid to cut")
            }
            Self::LoneNegatives { volumes } => {
                write!(
                    f,
                    "{volumes} negative volumes are left out: their objects have no solids to cut"
                )
            }
            Self::Slices { objects } => {
                write!(
                    f,
                    "the slices of {objects} {} are left out: meshes of the same volume are read",
                    of_objects(*objects)
                )
            }
            Self::StandIns { objects } => {
                write!(
                    f,
                    "the meshes of {objects} {} are left out: slices hold more than such a mesh",
                    of_objects(*objects)
                )
            }
            Self::Extension { name } => {
                write!(
                    f,
                    "elements of the extension {name} are left out: the extension is not known"
                )
            }
            Self::ProjectData { what } => write!(f, "the project's {what} are left out"),
            Self::Plates { plates } => {
                write!(f, "the project has {plates} plates, which are built side by side")
            }
            Self::BytesAfter { bytes: 1 } => {
                write!(f, "1 byte after the last facet is left out")
            }
            Self::BytesAfter { bytes } => {
                write!(f, "{bytes} bytes after the last facet are left out")
            }
            Self::WrongCount { declared, held } => write!(
                f,
                "the header declares {declared} facets, but the file holds {held}: all facets \
                 in the file are read"
            ),
            Self::NoEnd => write!(
                f,
                "the file ends after a facet, without `endsolid`: check that it is complete"
            ),
            Self::DecimalCommas => {
                write!(f, "commas in its numbers are read as decimal points")
            }
            Self::Statements { word, count } => {
                let [statements, are] = match count {
                    1 => ["statement", "is"],
                    _ => ["statements", "are"],
                };
                match &**word {
                    "" => write!(f, "{count} other {statements} {are} left out"),
                    word => write!(
                        f,
                        "{count} {statements} that begin{} with `{}` {are} left out",
                        if *count == 1 { "s" } else { "" },
                        word.escape_debug()
                    ),
                }
            }
            Self::FewCorners { faces: 1 } => {
                write!(f, "1 face with fewer than three corners is left out")
            }
            Self::FewCorners { faces } => {
                write!(f, "{faces} faces with fewer than three corners are left out")
            }
            Self::LeftOut { what: [what, _], count: 1 } => write!(f, "1 {what} is left out"),
            Self::LeftOut { what: [_, what], count } => {
                write!(f, "{count} {what} are left out")
            }
            Self::Masks { names } => {
                let shown = names.iter().take(MAX_MASKS).enumerate();
                let name = |name: &String| -> String {
                    one_line(name).chars().take(MAX_CHARACTERS).collect()
                };
                let shown: Vec<_> =
                    shown.map(|(page, of)| format!("mask {page} is {}", name(of))).collect();
                write!(f, "{}", shown.join(", "))?;
                match names.len().saturating_sub(MAX_MASKS) {
                    0 => Ok(()),
                    more => write!(f, ", and {more} more in ascending order"),
                }
            }
            Self::TopCells { cells } => {
                write!(f, "no cell places {cells} cells: they are built together, as they lie")
            }
            Self::NoUnit { taken } => {
                write!(f, "the drawing states no unit: its numbers are read as {taken}")
            }
            Self::NoMaterials { file } => {
                let file: String = one_line(file).chars().take(MAX_CHARACTERS).collect();
                write!(
                    f,
                    "colors of materials are unknown: there is no readable {file} beside the OBJ"
                )
            }
        }
    }
}

fn of_objects(objects: usize) -> &'static str {
    if objects == 1 { "object" } else { "objects" }
}
