//! Decompresses strips and tiles to rows of byte runs.

use std::io::{self, Read};

use flate2::read::ZlibDecoder;
use weezl::{BitOrder, LzwStatus, decode::Decoder};

use crate::codec::bits::byte_runs;
use crate::codec::compression::Compression;
use crate::codec::{deflate, packbits};

/// A reason to stop decompressing.
#[derive(Debug)]
pub(super) enum UnpackError {
    /// The data ends before the last row does.
    TooShort,
    /// The data is not valid for the compression.
    Damaged,
    /// The caller stopped because the image has too many runs.
    Enough,
}

/// The size of a strip's or tile's rows in bytes.
pub(super) struct PieceShape {
    pub(super) row_bytes: u32,
    pub(super) rows: u32,
    /// True if each byte is stored as its difference from the byte before in its row.
    pub(super) differences: bool,
}

/// Calls `each` with every row as runs `(length, byte)`, until it returns false. Only one
/// row is held at a time.
pub(super) fn unpack(
    compression: Compression,
    bytes: &[u8],
    shape: &PieceShape,
    each: impl FnMut(&[(u32, u8)]) -> bool,
) -> Result<(), UnpackError> {
    match compression {
        Compression::PackBits => cut_runs(packbits::Runs::new(bytes), shape, each),
        Compression::Lzw => cut_bytes(LzwReader::new(bytes), shape, each),
        Compression::Deflate if !shape.differences => {
            let length = u64::from(shape.row_bytes) * u64::from(shape.rows);
            match deflate::runs(bytes, length) {
                Some(runs) => cut_runs(runs.into_iter(), shape, each),
                // Other programs also copy from farther back.
                None => cut_zlib(bytes, shape, each),
            }
        }
        Compression::Deflate => cut_zlib(bytes, shape, each),
        _ => cut_bytes(bytes, shape, each),
    }
}

fn cut_runs(
    mut runs: impl Iterator<Item = (u32, u8)>,
    shape: &PieceShape,
    mut each: impl FnMut(&[(u32, u8)]) -> bool,
) -> Result<(), UnpackError> {
    let (mut length, mut byte) = (0, 0);
    let mut row = Vec::new();
    for _ in 0..shape.rows {
        row.clear();
        let mut room = shape.row_bytes;
        while room > 0 {
            if length == 0 {
                (length, byte) = runs.next().ok_or(UnpackError::TooShort)?;
            }
            let part = length.min(room);
            push_run(&mut row, part, byte);
            length -= part;
            room -= part;
        }
        if !each(&row) {
            return Err(UnpackError::Enough);
        }
    }
    Ok(())
}

fn cut_zlib(
    bytes: &[u8],
    shape: &PieceShape,
    each: impl FnMut(&[(u32, u8)]) -> bool,
) -> Result<(), UnpackError> {
    let mut bytes = ZlibDecoder::new(bytes);
    cut_bytes(&mut bytes, shape, each)?;
    // The check is compared at the stream's end.
    bytes.read(&mut [0]).map_err(|_| UnpackError::Damaged)?;
    Ok(())
}

fn cut_bytes(
    mut bytes: impl Read,
    shape: &PieceShape,
    mut each: impl FnMut(&[(u32, u8)]) -> bool,
) -> Result<(), UnpackError> {
    let (mut row, mut runs) = (Vec::new(), Vec::new());
    for _ in 0..shape.rows {
        row.clear();
        // Memory grows with the bytes read, not with the claimed width.
        match bytes.by_ref().take(shape.row_bytes.into()).read_to_end(&mut row) {
            Ok(length) if length == shape.row_bytes as usize => {}
            Ok(_) => return Err(UnpackError::TooShort),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                return Err(UnpackError::TooShort);
            }
            Err(_) => return Err(UnpackError::Damaged),
        }
        if shape.differences {
            let mut before = 0u8;
            for byte in &mut row {
                before = before.wrapping_add(*byte);
                *byte = before;
            }
        }
        byte_runs(&row, &mut runs);
        if !each(&runs) {
            return Err(UnpackError::Enough);
        }
    }
    Ok(())
}

/// Appends a run, or extends the last run if it has the same byte.
fn push_run(row: &mut Vec<(u32, u8)>, length: u32, byte: u8) {
    match row.last_mut() {
        Some((before, same)) if *same == byte => *before += length,
        _ => row.push((length, byte)),
    }
}

/// A reader that decompresses TIFF's LZW on demand.
struct LzwReader<'a> {
    decoder: Decoder,
    rest: &'a [u8],
}

impl<'a> LzwReader<'a> {
    fn new(rest: &'a [u8]) -> Self {
        // TIFF's LZW widens its codes one code early (TIFF 6.0, section 13).
        Self { decoder: Decoder::with_tiff_size_switch(BitOrder::Msb, 8), rest }
    }
}

impl Read for LzwReader<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let mut stuck = false;
        loop {
            let done = self.decoder.decode_bytes(self.rest, out);
            self.rest = &self.rest[done.consumed_in..];
            match done.status {
                _ if done.consumed_out > 0 => return Ok(done.consumed_out),
                Ok(LzwStatus::Done) => return Ok(0),
                Ok(_) if done.consumed_in > 0 => stuck = false,
                Ok(_) if stuck => return Ok(0),
                // The decoder may still hold bytes and return them when called again.
                Ok(_) => stuck = true,
                Err(error) => return Err(io::Error::new(io::ErrorKind::InvalidData, error)),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use weezl::encode::Encoder;

    use super::*;

    #[test]
    fn lzw_gives_its_last_bytes() {
        for (row_bytes, rows) in (1..40).flat_map(|width| (1..40).map(move |rows| (width, rows))) {
            let black = vec![0; (row_bytes * rows) as usize];
            let mut strip =
                Encoder::with_tiff_size_switch(BitOrder::Msb, 8).encode(&black).unwrap();
            // Some writers omit the last code.
            for cut in [0, 1] {
                strip.truncate(strip.len() - cut);
                let shape = PieceShape { row_bytes, rows, differences: false };
                let mut count = 0;
                let done = unpack(Compression::Lzw, &strip, &shape, |row| {
                    assert_eq!(row, [(row_bytes, 0)]);
                    count += 1;
                    true
                });
                assert!(done.is_ok() && count == rows, "{rows} rows of {row_bytes} bytes");
            }
        }
    }
}
