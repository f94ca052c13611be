//! Why a printer's file cannot be read or written.

use thiserror::Error;

use crate::printer::write::PrinterFormat;

/// A reason why a printer's file cannot be read or written.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PrinterFault {
    /// The version is not one that is read.
    #[error("its version is {found}, but {read} alone is read: save it anew in that version")]
    Version {
        /// The version of the file.
        found: String,
        /// The version that is read.
        read: &'static str,
    },
    /// A part of the file contradicts the format.
    #[error("its {0} is damaged")]
    Damaged(&'static str),
    /// The file's ZIP archive cannot be read.
    #[error("its ZIP archive is damaged ({0}): copy it again, or make it again")]
    Archive(String),
    /// A file does not begin, or end, as its name has it.
    #[error("this is not {0}, or it was cut off or damaged: copy it again, or make it again")]
    NotAsNamed(PrinterFormat),
    /// A format whose parts are read in any order, on a pipe.
    #[error("{0} cannot be read from a pipe: give the file's name instead")]
    Piped(&'static str),
    /// A file of an archive is missing.
    #[error("its ZIP archive lacks {0}")]
    Missing(String),
    /// A text of an archive cannot be read.
    #[error("its {file} cannot be read: {problem}")]
    Text {
        /// The name of the file in the archive.
        file: String,
        /// The parser's message.
        problem: String,
    },
    /// A file states what is not read.
    #[error("it states {0}, which is not read")]
    Unread(&'static str),
    /// Two images of an archive differ in size.
    #[error(
        "the image of layer {layer} has {} x {} pixels, but the panel has {} x {}",
        size[0], size[1], panel[0], panel[1]
    )]
    OtherSize {
        /// The layer's index.
        layer: u32,
        /// The image's width and height.
        size: [u32; 2],
        /// The panel's columns and rows.
        panel: [u32; 2],
    },
    /// A format states one thickness for all layers.
    #[error("{format} has one thickness for all layers: layer {layer} has another than the first")]
    Uneven {
        /// The format's name.
        format: &'static str,
        /// The layer's index.
        layer: u32,
    },
    /// A format states the steps of the printer alone, not of single layers.
    #[error(
        "{format} has no times and moves of single layers: layer {layer} has others than its \
         printer's"
    )]
    OwnStep {
        /// The format's name.
        format: &'static str,
        /// The layer's index.
        layer: u32,
    },
    /// The stack does not say which printer it is for.
    #[error(
        "the stack does not say which printer it is for: slice or lamp convert it with --machine and \
         a machine that has a [panel]"
    )]
    NoPanel,
    /// An image is not of the panel's size.
    #[error(
        "layer {layer} has {} x {} pixels, but the panel of {printer} has {} x {}: give \
         lamp slice or lamp convert the same --machine, which centers images on its panel",
        size[0], size[1], panel[0], panel[1]
    )]
    Size {
        /// The layer's index.
        layer: u32,
        /// The image's width and height.
        size: [u32; 2],
        /// The printer's name.
        printer: String,
        /// The panel's columns and rows.
        panel: [u32; 2],
    },
    /// The panel is larger than a format can state.
    #[error("{format} has at most {most} pixels a side")]
    Side {
        /// The format's name.
        format: &'static str,
        /// The most columns or rows.
        most: u32,
    },
    /// The stack does not state its number of layers.
    #[error(
        "the stack does not state its number of layers, which {0} has before them: write it to a .tif \
         file first, and convert that"
    )]
    NoCount(&'static str),
    /// The stack states another number of layers than it has.
    #[error("the stack states {stated} layers, and has {layers}: make it again")]
    OtherCount {
        /// The number that it states.
        stated: u32,
        /// The number that it has.
        layers: u32,
    },
    /// A layer's thickness is not known.
    #[error("layer {layer} has no thickness: slice the part anew")]
    NoThickness {
        /// The layer's index.
        layer: u32,
    },
    /// The layers end above the printer's reach.
    #[error(
        "layer {layer} ends {height_mm} mm above the platform, but {printer} builds {most_mm} mm \
         high"
    )]
    Height {
        /// The layer's index.
        layer: u32,
        /// The height of its top.
        height_mm: f64,
        /// The printer's name.
        printer: String,
        /// The height that it builds.
        most_mm: f64,
    },
    /// The format cannot state what the printer needs.
    #[error("{format} cannot state {what}")]
    Unstated {
        /// The format's name.
        format: &'static str,
        /// The printer's property.
        what: &'static str,
    },
    /// The printer of the stack does not say how the platform moves, and the format makes it move.
    #[error(
        "the stack does not say how far and how fast {printer} lifts and retracts, and {format} moves \
         it so: slice for a machine whose [panel] has lift_mm, lift_mm_per_min and retract_mm_per_min"
    )]
    NoMoves {
        /// The format's name.
        format: &'static str,
        /// The printer's name.
        printer: String,
    },
    /// An archive has more images than it states layers.
    #[error(
        "it states {stated} layers, but has an image of layer {layer}: its texts are not its own"
    )]
    MoreImages {
        /// The number of layers.
        stated: u32,
        /// The layer of the image.
        layer: u32,
    },
    /// A file cannot be written to a pipe.
    #[error("{0} cannot be written to a pipe or a folder: name a file with -o")]
    NotAFile(&'static str),
}
