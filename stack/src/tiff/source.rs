//! Bytes by offset, from a stream or a file.

use std::fmt;
use std::fs::File;
use std::io::{self, BufReader, Read};

/// Where bytes come from.
pub(super) enum Source {
    Stream { stream: BufReader<Box<dyn Read + Send>>, position: u64 },
    File { file: BufReader<File>, position: u64 },
}

impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Stream { .. } => "Stream",
            Self::File { .. } => "File",
        })
    }
}

impl Source {
    /// Whether bytes at `offset` can still be read: a stream goes forward only.
    pub(super) fn reaches(&self, offset: u64) -> bool {
        match self {
            Self::Stream { position, .. } => offset >= *position,
            Self::File { .. } => true,
        }
    }

    /// Up to `length` bytes at `offset`, fewer where the input ends. A length
    /// that lies costs nothing: memory grows with the bytes that arrive.
    pub(super) fn read_up_to(&mut self, offset: u64, length: u64) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let position = match self {
            Self::Stream { stream, position } => {
                let gap = offset - *position;
                if io::copy(&mut stream.by_ref().take(gap), &mut io::sink())? == gap {
                    stream.by_ref().take(length).read_to_end(&mut bytes)?;
                }
                position
            }
            Self::File { file, position } => {
                if let Ok(gap) = i64::try_from(i128::from(offset) - i128::from(*position)) {
                    match file.seek_relative(gap) {
                        // No file reaches so far.
                        Err(error) if error.kind() == io::ErrorKind::InvalidInput => {}
                        sought => {
                            sought?;
                            file.by_ref().take(length).read_to_end(&mut bytes)?;
                        }
                    }
                }
                position
            }
        };
        *position = offset + bytes.len() as u64;
        Ok(bytes)
    }
}
