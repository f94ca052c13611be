//! Notes on what a part's file holds and slicing does not use.

use std::fmt;

/// Something that a part's file holds and slicing does not use. As text it is one sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReadNote {
    /// Objects of a 3MF file that are no solids: supports, surfaces and others.
    NoSolids {
        /// How often items and components place them.
        items: usize,
    },
    /// Items of a 3MF file that are not to be printed.
    NotPrintable {
        /// The number of items.
        items: usize,
    },
    /// Volumes of a slicer's project that are no solids.
    Volumes {
        /// Their kind, such as `modifier`.
        kind: String,
        /// How many there are.
        volumes: usize,
    },
    /// Negative volumes of a slicer's project without solids that they could be cut out of.
    LoneNegatives {
        /// How many there are.
        volumes: usize,
    },
    /// Slices of a 3MF file beside a mesh of the same volume.
    Slices {
        /// The number of objects.
        objects: usize,
    },
    /// Meshes of a 3MF file beside slices that stand for something else.
    StandIns {
        /// The number of objects.
        objects: usize,
    },
    /// Elements of objects that are of an extension of 3MF that is not known.
    Extension {
        /// The extension's name.
        name: String,
    },
    /// Something of a slicer's project for printers of resin.
    ProjectData {
        /// Its name.
        what: &'static str,
    },
    /// Several plates of a slicer's project, which are built at once.
    Plates {
        /// How many there are.
        plates: usize,
    },
}

impl fmt::Display for ReadNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSolids { items: 1 } => write!(f, "1 item is left out: it is no solid"),
            Self::NoSolids { items } => {
                write!(f, "{items} items are left out: they are no solids")
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
                    "the meshes of {objects} {} are left out: slices stand for more than such a mesh",
                    of_objects(*objects)
                )
            }
            Self::Extension { name } => {
                write!(f, "elements of the extension {name} are left out: it is not known")
            }
            Self::ProjectData { what } => write!(f, "the project's {what} are left out"),
            Self::Plates { plates } => {
                write!(f, "the project has {plates} plates, which are built side by side")
            }
        }
    }
}

fn of_objects(objects: usize) -> &'static str {
    if objects == 1 { "object" } else { "objects" }
}
