//! Why a printer's file cannot be read or written.

use thiserror::Error;

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
    /// The stack does not say which printer it is for.
    #[error(
        "the stack does not say which printer it is for: slice it with --machine and a machine \
         that has a [panel]"
    )]
    NoPanel,
    /// An image is not of the panel's size.
    #[error(
        "layer {layer} has {} x {} pixels, but the panel of {printer} has {} x {}: give \
         lamp slice the same --machine, which centers the part on its panel",
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
    /// A file cannot be written to a pipe.
    #[error("{0} cannot be written to a pipe or a folder: name a file with -o")]
    NotAFile(&'static str),
    /// The file is larger than the format can be.
    #[error("{format} holds at most {most}")]
    TooLarge {
        /// The format's name.
        format: &'static str,
        /// What it holds.
        most: &'static str,
    },
}
