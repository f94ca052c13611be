//! Frames of a swath as a file or a stream.
//!
//! A header of 64 bytes, in little-endian numbers, then the frames without anything between:
//!
//! | bytes | content |
//! |---|---|
//! | 0 to 7 | `LAMPFRM1` |
//! | 8, 12 | mirrors across the scan, along it (u32) |
//! | 16 | bytes of a row of mirrors, a multiple of 8 (u32) |
//! | 20, 24 | the layer's index, the swath's number (u32) |
//! | 28 | the build's first column below the display (i32) |
//! | 32 | the row of the image below mirror row 0 in the first frame (i64) |
//! | 40 | the number of frames (u64) |
//! | 48 | rows per second (f64) |
//! | 56 | by how many rows the head moves on from frame to frame: 1 or -1 (i32) |
//! | 60 | zero (u32) |
//!
//! A frame has the rows of mirrors along the scan, each from the left, the highest bit of a byte
//! first, 1 for bright.

use std::io::{self, Read, Write};

use thiserror::Error;

use crate::frames::Frame;

const MAGIC: &[u8; 8] = b"LAMPFRM1";
const HEADER_BYTES: usize = 64;

/// The facts at the start of a file of frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameHeader {
    /// The mirrors across the scan, and along it.
    pub mirrors: [u32; 2],
    /// The layer's index.
    pub layer: u32,
    /// The swath's number, from the left.
    pub swath: u32,
    /// The build's first column below the display: below the first mirror, unless it is tilted.
    pub first_column: i32,
    /// The row of the image below mirror row 0 in the first frame.
    pub first_position: i64,
    /// The number of frames.
    pub frames: u64,
    /// Rows per second.
    pub rows_hz: f64,
    /// Whether the position falls from frame to frame; otherwise it rises.
    pub is_upward: bool,
}

/// Why a file holds no frames.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FrameFileError {
    /// It cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It begins with something else.
    #[error("this is not a file of frames: it does not begin with LAMPFRM1")]
    NoFrames,
    /// Its header contradicts itself.
    #[error("the header of the frames is damaged: {0}")]
    Header(&'static str),
    /// It ends within a frame, or before the last.
    #[error("the frames are cut off: {read} of {stated} are there")]
    CutOff {
        /// The number of whole frames.
        read: u64,
        /// The number that the header states.
        stated: u64,
    },
    /// More follows the last frame.
    #[error("something follows the last frame")]
    TooLong,
}

impl FrameHeader {
    fn row_bytes(&self) -> usize {
        self.mirrors[0].div_ceil(64) as usize * 8
    }

    fn frame_bytes(&self) -> usize {
        self.row_bytes() * self.mirrors[1] as usize
    }

    fn to_bytes(self) -> [u8; HEADER_BYTES] {
        let mut bytes = [0; HEADER_BYTES];
        let mut at = 0;
        let mut put = |part: &[u8]| {
            bytes[at..at + part.len()].copy_from_slice(part);
            at += part.len();
        };
        put(MAGIC);
        let row_bytes = self.row_bytes() as u32;
        let [across, along] = self.mirrors;
        for number in [across, along, row_bytes, self.layer, self.swath] {
            put(&number.to_le_bytes());
        }
        put(&self.first_column.to_le_bytes());
        put(&self.first_position.to_le_bytes());
        put(&self.frames.to_le_bytes());
        put(&self.rows_hz.to_le_bytes());
        put(&(if self.is_upward { -1_i32 } else { 1 }).to_le_bytes());
        bytes
    }

    fn from_bytes(bytes: &[u8; HEADER_BYTES]) -> Result<Self, FrameFileError> {
        fn take<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
            bytes[at..at + N].try_into().expect("within the header")
        }
        if take(bytes, 0) != *MAGIC {
            return Err(FrameFileError::NoFrames);
        }
        let number = |at| u32::from_le_bytes(take(bytes, at));
        let header = Self {
            mirrors: [number(8), number(12)],
            layer: number(20),
            swath: number(24),
            first_column: i32::from_le_bytes(take(bytes, 28)),
            first_position: i64::from_le_bytes(take(bytes, 32)),
            frames: u64::from_le_bytes(take(bytes, 40)),
            rows_hz: f64::from_le_bytes(take(bytes, 48)),
            is_upward: number(56) == u32::MAX,
        };
        let side = 1..=u32::from(u16::MAX);
        let wrong = if !header.mirrors.iter().all(|count| side.contains(count)) {
            "mirrors must be 1 to 65535"
        } else if number(16) as usize != header.row_bytes() {
            "the bytes of a row do not fit the mirrors"
        } else if !(header.rows_hz > 0.0 && header.rows_hz.is_finite()) {
            "the row clock must be above zero"
        } else if ![1, u32::MAX].contains(&number(56)) || number(60) != 0 {
            "the direction must be 1 or -1, and zero must follow"
        } else if header.first_position.unsigned_abs() > 1 << 40 || header.frames > 1 << 40 {
            "the position or the number of frames is too large"
        } else {
            return Ok(header);
        };
        Err(FrameFileError::Header(wrong))
    }
}

/// Writes frames.
pub struct FrameWriter<W> {
    out: W,
    bytes: Vec<u8>,
}

impl<W: Write> FrameWriter<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn new(mut out: W, header: FrameHeader) -> io::Result<Self> {
        out.write_all(&header.to_bytes())?;
        Ok(Self { out, bytes: vec![0; header.frame_bytes()] })
    }

    /// Writes a frame.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn push(&mut self, frame: &Frame<'_>) -> io::Result<()> {
        for (bytes, word) in self.bytes.chunks_exact_mut(8).zip(frame.words) {
            bytes.copy_from_slice(&word.to_be_bytes());
        }
        self.out.write_all(&self.bytes)
    }

    /// Ends the stream.
    ///
    /// # Errors
    /// Returns an error if the rest cannot be written.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}

/// Reads frames.
pub struct FrameReader<R> {
    from: R,
    header: FrameHeader,
    read: u64,
    bytes: Vec<u8>,
    words: Vec<u64>,
}

impl<R: Read> FrameReader<R> {
    /// Reads the header.
    ///
    /// # Errors
    /// Returns an error if the header is missing or contradicts itself.
    pub fn new(mut from: R) -> Result<Self, FrameFileError> {
        let mut bytes = [0; HEADER_BYTES];
        from.read_exact(&mut bytes).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => FrameFileError::NoFrames,
            _ => error.into(),
        })?;
        let header = FrameHeader::from_bytes(&bytes)?;
        Ok(Self { from, header, read: 0, bytes: Vec::new(), words: Vec::new() })
    }

    /// Returns the header.
    pub fn header(&self) -> FrameHeader {
        self.header
    }

    /// Reads the next frame, or returns `None` after the last.
    ///
    /// # Errors
    /// Returns an error if the frames are cut off, or if something follows them.
    #[expect(clippy::should_implement_trait, reason = "a frame borrows from its reader")]
    pub fn next(&mut self) -> Option<Result<Frame<'_>, FrameFileError>> {
        let FrameHeader { frames: stated, first_position, is_upward, .. } = self.header;
        if self.read == stated {
            // One read at the end, then silence.
            self.read += 1;
            return match self.from.read(&mut [0]) {
                Ok(0) => None,
                Ok(_) => Some(Err(FrameFileError::TooLong)),
                Err(error) => Some(Err(error.into())),
            };
        }
        if self.read > stated {
            return None;
        }
        // Not allocated by what the header says before a frame is there.
        self.bytes.clear();
        let wanted = self.header.frame_bytes();
        match (&mut self.from).take(wanted as u64).read_to_end(&mut self.bytes) {
            Ok(read) if read == wanted => {}
            Ok(_) => {
                let read = std::mem::replace(&mut self.read, stated + 1);
                return Some(Err(FrameFileError::CutOff { read, stated }));
            }
            Err(error) => return Some(Err(error.into())),
        }
        let word = |bytes: &[u8]| u64::from_be_bytes(bytes.try_into().expect("eight bytes"));
        self.words.clear();
        self.words.extend(self.bytes.chunks_exact(8).map(word));
        let moved = self.read as i64;
        let position = if is_upward { first_position - moved } else { first_position + moved };
        self.read += 1;
        Some(Ok(Frame { position, words: &self.words }))
    }
}
