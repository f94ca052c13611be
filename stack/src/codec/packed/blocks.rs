//! Packs bytes by zstd, and unpacks them without trusting the size that they claim.

use std::io::Read;

use zstd::bulk::Compressor;
use zstd::zstd_safe::CParameter;

use super::numbers;
use super::streams::{STREAMS, Streams};

/// How far back zstd looks, as a power of 2: the bytes of a block that a reader keeps, whatever it
/// claims.
const WINDOW_LOG: u32 = 20;
/// Blocks up to this size are unpacked at once.
const AT_ONCE: usize = 1 << WINDOW_LOG;
/// The fewest bytes that zstd takes for a repetition, where it can look for as many: fewer cost
/// more than the tokens themselves.
const MIN_MATCH: u32 = 7;
/// Bytes that are too few to pack.
const FEW: usize = 16;

/// A packer of blocks.
pub(super) struct Packer(Compressor<'static>);

impl Packer {
    pub(super) fn new(level: i32) -> Self {
        let compressor = Compressor::new(level).and_then(|mut compressor| {
            compressor.set_parameter(CParameter::WindowLog(WINDOW_LOG))?;
            compressor.set_parameter(CParameter::MinMatch(MIN_MATCH))?;
            Ok(compressor)
        });
        Self(compressor.expect("the level and the window are in zstd's range"))
    }

    /// Returns the packed bytes, or the bytes themselves if packing does not make them fewer.
    pub(super) fn pack(&mut self, bytes: &[u8]) -> Vec<u8> {
        if bytes.len() < FEW {
            return bytes.to_vec();
        }
        let packed = self.0.compress(bytes).expect("memory grows, so nothing else can fail");
        // Equal sizes mark bytes that are not packed, so packed ones must be fewer.
        if packed.len() < bytes.len() { packed } else { bytes.to_vec() }
    }

    /// Packs streams, each behind its size and its packed size.
    pub(super) fn pack_streams(&mut self, streams: &Streams) -> Vec<u8> {
        let mut out = Vec::new();
        for stream in streams.all() {
            let packed = self.pack(stream);
            numbers::put(&mut out, stream.len() as u64);
            numbers::put(&mut out, packed.len() as u64);
            out.extend_from_slice(&packed);
        }
        out
    }
}

/// Returns about how many bytes the streams take when they are packed.
pub(super) fn packed_len(streams: &Streams) -> usize {
    // The fastest level: the result is only compared.
    let mut packer = Packer::new(1);
    streams.all().map(|stream| packer.pack(stream).len()).iter().sum()
}

/// Unpacks a block of `length` bytes. Returns `None` if it is damaged or has another length.
/// Memory grows with the bytes that come.
pub(super) fn unpack(packed: &[u8], length: usize) -> Option<Vec<u8>> {
    if packed.len() == length {
        return Some(packed.to_vec());
    }
    // The length is a claim, and unpacking at once allocates all of it.
    let bytes = if length <= AT_ONCE {
        zstd::bulk::decompress(packed, length).ok()?
    } else {
        let mut decoder = zstd::stream::read::Decoder::with_buffer(packed).ok()?.single_frame();
        decoder.window_log_max(WINDOW_LOG).ok()?;
        let mut bytes = Vec::new();
        // One byte more shows a block that is too long.
        decoder.take(length as u64 + 1).read_to_end(&mut bytes).ok()?;
        bytes
    };
    (bytes.len() == length).then_some(bytes)
}

/// Unpacks streams of at most `most` bytes together.
pub(super) fn unpack_streams(mut packed: &[u8], most: usize) -> Option<Streams> {
    let mut streams: [Vec<u8>; STREAMS] = Default::default();
    let mut room = most;
    for stream in &mut streams {
        let [length, bytes] = [numbers::take(&mut packed)?, numbers::take(&mut packed)?];
        let [length, bytes] = [usize::try_from(length).ok()?, usize::try_from(bytes).ok()?];
        room = room.checked_sub(length)?;
        let (block, rest) = packed.split_at_checked(bytes)?;
        packed = rest;
        *stream = unpack(block, length)?;
    }
    packed.is_empty().then(|| streams.into())
}
