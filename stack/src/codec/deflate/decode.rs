//! Reads runs.

use super::bits::BitReader;
use super::huffman::Symbols;
use super::{END_OF_BLOCK, LENGTH_ORDER, MOST_BITS, copies_of};

/// Returns the runs `(length, byte)` of a zlib stream in which all copies are of the byte before,
/// up to `bytes` bytes. Returns `None` for other streams, sound or not, and for those whose check
/// does not agree.
///
/// Takes at most eight times as many runs as the stream has bytes.
pub(crate) fn runs(stream: &[u8], bytes: u64) -> Option<Vec<(u32, u8)>> {
    let (&[method, flags], data) = stream.split_first_chunk()?;
    // Method 8, a window up to 32 KiB and no preset dictionary (RFC 1950, section 2.2).
    let is_zlib = method & 0x0F == 8 && method >> 4 <= 7 && flags & 0x20 == 0;
    // FCHECK makes the header a multiple of 31.
    if !is_zlib || !u16::from_be_bytes([method, flags]).is_multiple_of(31) {
        return None;
    }
    let mut bits = BitReader::new(data);
    let mut reader = RunDecoder { runs: Vec::new(), left: bytes };
    loop {
        let is_last = bits.take(1)? == 1;
        // BTYPE (RFC 1951, section 3.2.3). Stored blocks are left to a decoder of bytes.
        let [symbols, distances] = match bits.take(2)? {
            1 => fixed_codes()?,
            2 => own_codes(&mut bits)?,
            _ => return None,
        };
        let is_whole = reader.read_block(&mut bits, &symbols, &distances)?;
        if is_last || reader.left == 0 {
            // A check that is cut off, or of more bytes than are wanted, says nothing.
            let check = if is_last && is_whole { bits.last_word() } else { None };
            let agrees = check.is_none_or(|check| check == adler32(&reader.runs));
            return agrees.then_some(reader.runs);
        }
    }
}

struct RunDecoder {
    runs: Vec<(u32, u8)>,
    /// The number of bytes that are still wanted.
    left: u64,
}

impl RunDecoder {
    /// Reads a block, or as much of it as is wanted. Returns whether it is all of it.
    fn read_block(
        &mut self,
        bits: &mut BitReader<'_>,
        symbols: &Symbols,
        distances: &Symbols,
    ) -> Option<bool> {
        loop {
            if self.left == 0 {
                return Some(symbols.read(bits) == Some(END_OF_BLOCK));
            }
            let symbol = symbols.read(bits)?;
            if let Ok(byte) = u8::try_from(symbol) {
                self.runs.push((1, byte));
                self.left -= 1;
                continue;
            }
            if symbol == END_OF_BLOCK {
                return Some(true);
            }
            let (first, more) = copies_of(symbol)?;
            let length = first + bits.take(more)?;
            // The first distance, of one byte, has no bits that count on.
            if distances.read(bits)? != 0 {
                return None;
            }
            let (before, _) = self.runs.last_mut()?;
            // Copies that follow each other may pass 32 bits.
            *before = before.checked_add(length)?;
            self.left = self.left.saturating_sub(length.into());
        }
    }
}

/// Returns the Adler-32 check of runs of bytes.
fn adler32(runs: &[(u32, u8)]) -> u32 {
    const MODULUS: u64 = 65_521;
    let (mut a, mut b) = (1u64, 0u64);
    for &(length, byte) in runs {
        let (mut left, byte) = (u64::from(length), u64::from(byte));
        while left > 0 {
            let part = left.min(1 << 16);
            // b adds up all values of a: n a + byte (1 + 2 + ... + n) (RFC 1950, section 8.2).
            b += part * a + byte * (part * (part + 1) / 2);
            a += part * byte;
            // Remainders are seldom taken: both sums still fit.
            if a >= 1 << 32 {
                a %= MODULUS;
            }
            if b >= 1 << 60 {
                b %= MODULUS;
            }
            left -= part;
        }
    }
    (((b % MODULUS) << 16) | (a % MODULUS)) as u32
}

/// The codes of blocks that state none.
fn fixed_codes() -> Option<[Symbols; 2]> {
    // RFC 1951, section 3.2.6: there are 288 codes, although the last two never occur.
    let lengths: Vec<u8> =
        [(144, 8), (112, 9), (24, 7), (8, 8)].iter().flat_map(|&(n, k)| vec![k; n]).collect();
    Some([Symbols::new(&lengths)?, Symbols::new(&[5; 32])?])
}

fn own_codes(bits: &mut BitReader<'_>) -> Option<[Symbols; 2]> {
    // HLIT, HDIST and HCLEN (RFC 1951, section 3.2.7).
    let symbols = bits.take(5)? as usize + 257;
    let distances = bits.take(5)? as usize + 1;
    let stated = bits.take(4)? as usize + 4;
    let mut of_lengths = [0; 19];
    for &symbol in &LENGTH_ORDER[..stated] {
        of_lengths[symbol] = bits.take(3)? as u8;
    }
    let of_lengths = Symbols::new(&of_lengths)?;
    let mut lengths = Vec::new();
    // Both kinds of lengths are one sequence: repeats may cross from one to the other.
    while lengths.len() < symbols + distances {
        let (length, count) = match of_lengths.read(bits)? {
            16 => (*lengths.last()?, 3 + bits.take(2)?),
            17 => (0, 3 + bits.take(3)?),
            18 => (0, 11 + bits.take(7)?),
            length => (length as u8, 1),
        };
        debug_assert!(length <= MOST_BITS, "symbols are below 19");
        lengths.extend(std::iter::repeat_n(length, count as usize));
    }
    if lengths.len() > symbols + distances {
        return None;
    }
    let (symbols, distances) = lengths.split_at(symbols);
    Some([Symbols::new(symbols)?, Symbols::new(distances)?])
}
