//! Unpacks files compressed with gzip.

use std::io::{self, BufReader, Read};

use flate2::bufread::MultiGzDecoder;

use crate::error::SliceError;
use crate::part_file::OpenPartFile;

/// Meshes shrink by a factor of up to 20 when compressed; bytes that shrink more than this limit
/// are not a mesh, and would fill the disk.
const MOST_SHRINKAGE: u64 = 100;
/// The number of bytes that are unpacked in any case.
const ALWAYS_BYTES: u64 = 64 << 20;

/// Returns true if a file that starts with these bytes was compressed with gzip.
pub(crate) fn is_gzip(start: &[u8]) -> bool {
    start.starts_with(b"\x1F\x8B")
}

/// Returns the greatest number of bytes unpacked from `packed` bytes.
pub(crate) fn most_unpacked(packed: u64) -> u64 {
    ALWAYS_BYTES.saturating_add(packed.saturating_mul(MOST_SHRINKAGE))
}

/// Unpacks a file into a temporary file.
///
/// # Errors
/// Returns an error if it is damaged, contains more than a mesh would, or the disk is full.
pub(crate) fn unpack(file: &OpenPartFile) -> Result<OpenPartFile, SliceError> {
    let most = most_unpacked(file.size());
    // One byte more than allowed shows that there is too much. A gzip file may have several members
    // (RFC 1952, section 2.2).
    let mut bytes = MultiGzDecoder::new(BufReader::new(file.reader())).take(most + 1);
    let mut unpacked = tempfile::tempfile()?;
    let size = io::copy(&mut bytes, &mut unpacked).map_err(SliceError::Packed)?;
    if size > most {
        return Err(SliceError::Inflated { most });
    }
    Ok(file.in_other_form(unpacked, size))
}

/// Unpacks bytes in memory, as [`unpack`] does.
pub(crate) fn unpack_bytes(bytes: &[u8]) -> Result<Vec<u8>, SliceError> {
    let most = most_unpacked(bytes.len() as u64);
    let mut unpacked = Vec::new();
    let size = MultiGzDecoder::new(bytes).take(most + 1).read_to_end(&mut unpacked);
    match size.map_err(SliceError::Packed)? as u64 > most {
        true => Err(SliceError::Inflated { most }),
        false => Ok(unpacked),
    }
}
