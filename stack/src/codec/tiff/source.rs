//! Reads bytes at offsets of a stream or a file.

use std::fmt;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};

/// A source of bytes.
pub(crate) enum ByteSource {
    Stream { stream: BufReader<Box<dyn Read + Send>>, position: u64 },
    File { file: BufReader<File>, position: u64 },
}

impl fmt::Debug for ByteSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Stream { .. } => "Stream",
            Self::File { .. } => "File",
        })
    }
}

impl ByteSource {
    /// Returns whether bytes at `offset` can still be read: a stream only goes forward.
    pub(crate) fn reaches(&self, offset: u64) -> bool {
        match self {
            Self::Stream { position, .. } => offset >= *position,
            Self::File { .. } => true,
        }
    }

    /// Returns another handle of a file, which shares its position; `None` of a stream.
    pub(crate) fn file(&self) -> io::Result<Option<File>> {
        match self {
            Self::Stream { .. } => Ok(None),
            Self::File { file, .. } => file.get_ref().try_clone().map(Some),
        }
    }

    /// Returns the length in bytes of a file, `None` of a stream.
    pub(crate) fn length(&self) -> io::Result<Option<u64>> {
        match self {
            Self::Stream { .. } => Ok(None),
            Self::File { file, .. } => Ok(Some(file.get_ref().metadata()?.len())),
        }
    }

    /// Reads less of a file ahead, for small reads far from each other. A pipe that was opened
    /// as a file stays as it is.
    pub(crate) fn reading_little_ahead(self) -> Self {
        match self {
            Self::File { mut file, position } => match file.seek(SeekFrom::Start(position)) {
                Ok(_) => Self::File { file: BufReader::new(file.into_inner()), position },
                Err(_) => Self::File { file, position },
            },
            stream @ Self::Stream { .. } => stream,
        }
    }

    /// Passes over `length` bytes at `offset`. Returns whether the input has them.
    pub(crate) fn skip(&mut self, offset: u64, length: u64) -> io::Result<bool> {
        let end = offset.saturating_add(length);
        match self {
            Self::Stream { stream, position } => {
                let gap = end - *position;
                let skipped = io::copy(&mut stream.by_ref().take(gap), &mut io::sink())?;
                *position += skipped;
                Ok(skipped == gap)
            }
            // Nothing is read: the file's length shows whether the bytes are there.
            Self::File { file, .. } => Ok(file.get_ref().metadata()?.len() >= end),
        }
    }

    /// Reads up to `length` bytes at `offset`, fewer at the end of the input. Memory grows with
    /// the bytes read, so a false length costs nothing.
    pub(crate) fn read_up_to(&mut self, offset: u64, length: u64) -> io::Result<Vec<u8>> {
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
                    // Unlike `seek`, this keeps what is buffered.
                    match file.seek_relative(gap) {
                        // The offset is larger than any file's.
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
