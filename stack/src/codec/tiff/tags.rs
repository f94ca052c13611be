//! Defines the numbers of the TIFF 6.0 tags and types that are read or written.

pub(super) const NEW_SUBFILE_TYPE: u16 = 254;
/// The tag that [`NEW_SUBFILE_TYPE`] replaced.
pub(super) const SUBFILE_TYPE: u16 = 255;
pub(super) const IMAGE_WIDTH: u16 = 256;
pub(super) const IMAGE_LENGTH: u16 = 257;
pub(super) const BITS_PER_SAMPLE: u16 = 258;
pub(super) const COMPRESSION: u16 = 259;
pub(super) const PHOTOMETRIC: u16 = 262;
pub(super) const FILL_ORDER: u16 = 266;
pub(super) const IMAGE_DESCRIPTION: u16 = 270;
pub(super) const STRIP_OFFSETS: u16 = 273;
pub(super) const ORIENTATION: u16 = 274;
pub(super) const SAMPLES_PER_PIXEL: u16 = 277;
pub(super) const ROWS_PER_STRIP: u16 = 278;
pub(super) const STRIP_BYTE_COUNTS: u16 = 279;
pub(super) const X_RESOLUTION: u16 = 282;
pub(super) const Y_RESOLUTION: u16 = 283;
pub(super) const PLANAR_CONFIGURATION: u16 = 284;
pub(super) const T4_OPTIONS: u16 = 292;
pub(super) const T6_OPTIONS: u16 = 293;
pub(super) const RESOLUTION_UNIT: u16 = 296;
pub(super) const PREDICTOR: u16 = 317;
pub(super) const TILE_WIDTH: u16 = 322;
pub(super) const TILE_LENGTH: u16 = 323;
pub(super) const TILE_OFFSETS: u16 = 324;
pub(super) const TILE_BYTE_COUNTS: u16 = 325;
pub(super) const SUB_IFDS: u16 = 330;
pub(super) const SAMPLE_FORMAT: u16 = 339;

/// Compression values.
pub(super) const UNCOMPRESSED: u64 = 1;
pub(super) const MODIFIED_HUFFMAN: u64 = 2;
pub(super) const T4: u64 = 3;
pub(super) const T6: u64 = 4;
pub(super) const LZW: u64 = 5;
pub(super) const DEFLATE: u64 = 8;
/// Deflate's number before 8 was assigned to it.
pub(super) const OLD_DEFLATE: u64 = 32_946;
pub(super) const PACK_BITS: u64 = 32_773;

/// Photometric interpretations.
pub(super) const WHITE_IS_ZERO: u64 = 0;
pub(super) const BLACK_IS_ZERO: u64 = 1;

/// Bits of the T.4 options.
pub(super) const TWO_DIMENSIONAL: u64 = 1;
pub(super) const UNCOMPRESSED_MODE: u64 = 2;

/// Resolution units.
pub(super) const PER_INCH: u64 = 2;
pub(super) const PER_CENTIMETRE: u64 = 3;

/// Bits of the new subfile type.
pub(super) const REDUCED: u64 = 1;
pub(super) const MASK: u64 = 4;
/// The old subfile type of an image of reduced resolution.
pub(super) const OLD_REDUCED: u64 = 2;

/// Field types.
pub(super) const BYTE: u16 = 1;
pub(super) const ASCII: u16 = 2;
pub(super) const SHORT: u16 = 3;
pub(super) const LONG: u16 = 4;
pub(super) const RATIONAL: u16 = 5;
pub(super) const SBYTE: u16 = 6;
pub(super) const SSHORT: u16 = 8;
pub(super) const SLONG: u16 = 9;
pub(super) const SRATIONAL: u16 = 10;
pub(super) const FLOAT: u16 = 11;
pub(super) const DOUBLE: u16 = 12;
pub(super) const IFD: u16 = 13;
pub(super) const LONG8: u16 = 16;
pub(super) const SLONG8: u16 = 17;
pub(super) const IFD8: u16 = 18;

/// Returns the size in bytes of a value of a field type, or 0 for unknown types.
pub(super) fn type_size(kind: u16) -> u64 {
    match kind {
        BYTE | ASCII | SBYTE | 7 => 1,
        SHORT | SSHORT => 2,
        LONG | SLONG | FLOAT | IFD => 4,
        RATIONAL | SRATIONAL | DOUBLE | LONG8 | SLONG8 | IFD8 => 8,
        _ => 0,
    }
}
