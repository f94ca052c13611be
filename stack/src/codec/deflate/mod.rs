//! Deflate between runs of bytes and bits, without a pass over pixels.
//!
//! A run is its byte once and copies of the byte before it, up to 258 at a time: two bits each
//! where they are frequent. Copies from farther back are not written. They would save a twentieth
//! of a gray layer's bytes, and a reader would have to keep rows.
//!
//! Source: RFC 1950 (zlib) and RFC 1951 (Deflate).

mod bits;
mod decode;
mod encode;
mod huffman;

pub(crate) use decode::runs;
pub(crate) use encode::encode;

/// The length of the longest copy.
const MOST_COPIED: u32 = 258;
/// The symbol that ends a block; those above it are lengths of copies.
const END_OF_BLOCK: u16 = 256;
/// The number of symbols of bytes, lengths and the end of a block.
const SYMBOLS: usize = 286;
/// The number of bits of the longest code of a symbol.
const MOST_BITS: u8 = 15;
/// The number of bits of the longest code of a code's length.
const MOST_LENGTH_BITS: u8 = 7;
/// The order in which a block states how codes' lengths are coded.
const LENGTH_ORDER: [usize; 19] =
    [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];

/// Returns the shortest copy of a length symbol and the number of bits that count on from it.
fn copies_of(symbol: u16) -> Option<(u32, u8)> {
    Some(match u32::from(symbol.checked_sub(END_OF_BLOCK + 1)?) {
        index @ 0..=7 => (index + 3, 0),
        // The longest copy has a symbol without extra bits (RFC 1951, section 3.2.5).
        28 => (MOST_COPIED, 0),
        index @ 8..=27 => {
            let bits = index / 4 - 1;
            (3 + ((4 + index % 4) << bits), bits as u8)
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests;
