//! How the image of a page is compressed.

use crate::codec::picture_format::PictureFormat;

/// The compression of a page's image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    /// No compression.
    Uncompressed,
    /// CCITT modified Huffman: Group 3 without end-of-line codes.
    ModifiedHuffman,
    /// CCITT Group 3, one-dimensional.
    Group3,
    /// CCITT Group 3, two-dimensional.
    Group3TwoDimensional,
    /// CCITT Group 4.
    G4,
    /// TIFF's LZW.
    Lzw,
    /// Deflate (zlib).
    Deflate,
    /// Apple's PackBits run lengths.
    PackBits,
    /// The page is a PNG file.
    Png,
    /// The page is another picture file.
    Picture(PictureFormat),
    /// The page is one of a packed stack.
    Packed,
    /// The run lengths of GOO files.
    Goo,
    /// The run lengths of CTB files.
    Ctb,
    /// The page is a PNG in a printer's file.
    PrinterPng,
}
