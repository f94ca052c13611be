//! What can be wrong with a stack.

use std::io;

use thiserror::Error;

use crate::g4::G4Error;

/// Why a stack cannot be read or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StackError {
    /// Nothing arrived at all.
    #[error("the input is empty: no stack arrived")]
    Empty,
    /// The first bytes are those of no TIFF and no PNG.
    #[error("this is not a TIFF stack or a PNG (it starts with bytes {start:02x?})")]
    NotTiff {
        /// The first bytes of the input.
        start: Vec<u8>,
    },
    /// The input ends before its last page's end.
    #[error("the stack is cut off: {}; run the stage that wrote it again", last_whole_text(*.last_whole))]
    CutOff {
        /// The last layer that arrived whole.
        last_whole: Option<u32>,
    },
    /// A page's directory or data contradicts itself.
    #[error("page {page}: {what}")]
    Malformed {
        /// The page, from 0.
        page: u32,
        /// What is wrong.
        what: String,
    },
    /// A page that is valid but not of a kind that is read here.
    #[error(
        "page {page}: {what} is not read here; save it as a 1-bit or an 8-bit gray TIFF first, with any lossless compression"
    )]
    Unsupported {
        /// The page, from 0.
        page: u32,
        /// The feature in question.
        what: String,
    },
    /// A TIFF whose parts stand in an order that a stream cannot follow.
    #[error(
        "page {page}: its parts do not follow each other, so it cannot be read from a pipe; give the file's name instead"
    )]
    NotForward {
        /// The page, from 0.
        page: u32,
    },
    /// A strip that does not decode.
    #[error("layer {layer}")]
    Strip {
        /// The layer's index.
        layer: u32,
        /// What is wrong with its codes.
        source: G4Error,
    },
    /// A file of a folder that cannot be read.
    #[error("{file}")]
    InFile {
        /// The file's name.
        file: String,
        /// What is wrong with it.
        source: Box<StackError>,
    },
    /// Layers that do not go up.
    #[error("layer {layer} stands behind layer {before}: a stack's layers go up")]
    Order {
        /// The layer that is out of order.
        layer: u32,
        /// The one before it.
        before: u32,
    },
    /// A folder without pages.
    #[error("the folder holds no .tif or .png page")]
    NoPages,
    /// A folder of pages of both kinds.
    #[error(
        "the folder holds .tif and .png pages: keep those that are the stack, and move the others away"
    )]
    MixedPages,
    /// A page is missing from a folder.
    #[error("the folder lacks a page: layer {layer} does not follow what was before it")]
    MissingPage {
        /// The layer behind the gap.
        layer: u32,
    },
    /// A file of a folder that is a stack of its own.
    #[error("it has several pages: the files of a folder have one page each")]
    SeveralPages,
    /// The stack does not fit a classic TIFF.
    #[error(
        "the stack passes 4 GiB at layer {layer}: a classic TIFF cannot hold it, write a BigTIFF"
    )]
    PastClassic {
        /// The layer that does not fit.
        layer: u32,
    },
    /// A stack must have at least one layer.
    #[error("there is no layer to write")]
    NoLayers,
    /// A folder of pages is to be written where something stands already.
    #[error(
        "a folder of pages is not written over what is there: remove it or choose another name"
    )]
    Exists,
    /// Reading or writing failed.
    #[error(transparent)]
    Io(#[from] io::Error),
}

fn last_whole_text(last_whole: Option<u32>) -> String {
    match last_whole {
        Some(layer) => format!("the last whole layer is {layer}"),
        None => "not one layer is whole".to_owned(),
    }
}
