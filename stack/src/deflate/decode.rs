//! Reads runs.

use super::bits::BitReader;
use super::huffman::Symbols;
use super::{END_OF_BLOCK, LENGTH_ORDER, MOST_BITS, copies_of};

/// Returns the runs `(length, byte)` of a zlib stream in which all copies are of the byte before,
/// up to `bytes` bytes. Returns `None` for other streams, sound or not.
///
/// Takes at most eight times as many runs as the stream has bytes.
pub(crate) fn runs(stream: &[u8], bytes: u64) -> Option<Vec<(u32, u8)>> {
    let (&[method, flags], data) = stream.split_first_chunk()?;
    let is_zlib = method & 0x0F == 8 && method >> 4 <= 7 && flags & 0x20 == 0;
    if !is_zlib || !u16::from_be_bytes([method, flags]).is_multiple_of(31) {
        return None;
    }
    let mut bits = BitReader::new(data);
    let mut reader = RunReader { runs: Vec::new(), left: bytes };
    loop {
        let is_last = bits.take(1)? == 1;
        let [symbols, distances] = match bits.take(2)? {
            1 => fixed_codes()?,
            2 => own_codes(&mut bits)?,
            _ => return None,
        };
        reader.read_block(&mut bits, &symbols, &distances)?;
        if is_last || reader.left == 0 {
            return Some(reader.runs);
        }
    }
}

struct RunReader {
    runs: Vec<(u32, u8)>,
    /// The number of bytes that are still wanted.
    left: u64,
}

impl RunReader {
    fn read_block(
        &mut self,
        bits: &mut BitReader<'_>,
        symbols: &Symbols,
        distances: &Symbols,
    ) -> Option<()> {
        while self.left > 0 {
            let symbol = symbols.read(bits)?;
            if let Ok(byte) = u8::try_from(symbol) {
                self.runs.push((1, byte));
                self.left -= 1;
                continue;
            }
            if symbol == END_OF_BLOCK {
                break;
            }
            let (first, more) = copies_of(symbol)?;
            let length = first + bits.take(more)?;
            // The first distance, of one byte, has no bits that count on.
            if distances.read(bits)? != 0 {
                return None;
            }
            let (before, _) = self.runs.last_mut()?;
            *before = before.checked_add(length)?;
            self.left = self.left.saturating_sub(length.into());
        }
        Some(())
    }
}

/// The codes of blocks that state none.
fn fixed_codes() -> Option<[Symbols; 2]> {
    let lengths: Vec<u8> =
        [(144, 8), (112, 9), (24, 7), (8, 8)].iter().flat_map(|&(n, k)| vec![k; n]).collect();
    Some([Symbols::new(&lengths)?, Symbols::new(&[5; 32])?])
}

fn own_codes(bits: &mut BitReader<'_>) -> Option<[Symbols; 2]> {
    let symbols = bits.take(5)? as usize + 257;
    let distances = bits.take(5)? as usize + 1;
    let stated = bits.take(4)? as usize + 4;
    let mut of_lengths = [0; 19];
    for &symbol in &LENGTH_ORDER[..stated] {
        of_lengths[symbol] = bits.take(3)? as u8;
    }
    let of_lengths = Symbols::new(&of_lengths)?;
    let mut lengths = Vec::new();
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
