//! Runs to T.6 codes.

use std::sync::LazyLock;

use super::codes::{
    Code, EOL, HORIZONTAL, LONGEST_MAKE_UP, PASS, TERMINATING_0, TERMINATING_1, VERTICAL, make_up,
};
use crate::mask::Mask;

/// Encodes a mask as one T.6 (CCITT Group 4) strip, most significant bit
/// first, ended by EOFB and padded to a byte. Black (0) is T.6's white.
///
/// The codes are those that T.6's flow diagram gives; no pixel is looked at.
///
/// Source: ITU-T Recommendation T.6, sections 2.2.1 to 2.2.5.
pub fn encode(mask: &Mask) -> Vec<u8> {
    let mut bits = BitWriter::new(mask.transition_count() / 2 + mask.height() as usize / 8 + 16);
    let mut reference: &[u32] = &[];
    for row in mask.rows() {
        encode_row(&mut bits, reference, row, mask.width());
        reference = row;
    }
    bits.put(EOL);
    bits.put(EOL);
    bits.finish()
}

/// Encodes one row against the row above it, naming positions as T.6 does:
/// a0 is where coding stands, a1 and a2 the next transitions of this row, b1
/// the first transition of the reference row right of a0 towards the other
/// colour, and b2 the one after it.
fn encode_row(bits: &mut BitWriter, reference: &[u32], row: &[u32], width: u32) {
    let four_verticals = &*FOUR_VERTICALS;
    let at = |transitions: &[u32], i: usize| transitions.get(i).copied().unwrap_or(width);
    // The first a0 is an imaginary pixel left of the row: at 0, but not past
    // a transition at 0.
    let (mut a0, mut started) = (0, false);
    // Indices of a1 and b1. They agree in parity: both change colour alike.
    let (mut i, mut j) = (0, 0);
    while a0 < width || !started {
        if let Some(index) = four_near(reference, row, i, j) {
            let packed = four_verticals[index];
            bits.put(Code { bits: packed & 0x07FF_FFFF, len: packed >> 27 });
            (i, j) = (i + 4, j + 4);
            (a0, started) = (row[i - 1], true);
            continue;
        }
        let (a1, b1, b2) = (at(row, i), at(reference, j), at(reference, j + 1));
        if b2 < a1 {
            bits.put(PASS);
            (a0, j) = (b2, j + 2);
        } else if a1.abs_diff(b1) <= 3 {
            bits.put(VERTICAL[(a1 + 3 - b1) as usize]);
            a0 = a1;
            i += 1;
            // The other colour's next transition may stand before this one.
            j = if j > 0 { j - 1 } else { j + 1 };
        } else {
            let a2 = at(row, i + 1);
            bits.put(HORIZONTAL);
            bits.put_run(a1 - a0, i % 2 == 1);
            bits.put_run(a2 - a1, i % 2 == 0);
            a0 = a2;
            i += 2;
        }
        started = true;
        while reference.get(j).is_some_and(|&b1| b1 <= a0) {
            j += 2;
        }
    }
}

/// If the next four transitions all lie within three pixels of the reference
/// row's, and the reference runs between are wide enough (four pixels) that
/// no pass mode and no other b1 is possible, the index of their four codes.
#[inline]
fn four_near(reference: &[u32], row: &[u32], i: usize, j: usize) -> Option<usize> {
    let a: &[u32; 4] = row.get(i..i + 4)?.try_into().ok()?;
    // With b[0] the reference transition before b1: it must lie left of a0's
    // successor, and b[5] right of the fourth a1.
    let b: &[u32; 6] = reference.get(j.checked_sub(1)?..j + 5)?.try_into().ok()?;
    let mut wide = true;
    for k in 0..5 {
        wide &= b[k + 1] - b[k] > 3;
    }
    let mut near = true;
    let mut index = 0;
    for k in 0..4 {
        let shift = a[k].wrapping_sub(b[k + 1]).wrapping_add(3);
        near &= shift <= 6;
        index |= (shift as usize & 7) << (3 * k);
    }
    (wide && near).then_some(index)
}

/// Four vertical codes in one word, indexed by four 3-bit values of
/// `a1 - b1 + 3`, first lowest: the length in the top 5 bits, the bits below
/// (27 are enough, since every code longer than 3 bits starts with zeros).
static FOUR_VERTICALS: LazyLock<Vec<u32>> = LazyLock::new(|| {
    let join = |index: usize| {
        (0..4).try_fold(Code { bits: 0, len: 0 }, |joined, k| {
            let code = VERTICAL.get(index >> (3 * k) & 7)?;
            Some(Code { bits: joined.bits << code.len | code.bits, len: joined.len + code.len })
        })
    };
    (0..4096).map(|index| join(index).map_or(0, |code| code.len << 27 | code.bits)).collect()
});

/// Gathers bits, most significant first.
struct BitWriter {
    out: Vec<u8>,
    /// The bits not yet written, left-aligned; fewer than 32 between calls.
    pending: u64,
    count: u32,
}

impl BitWriter {
    fn new(capacity: usize) -> Self {
        Self { out: Vec::with_capacity(capacity), pending: 0, count: 0 }
    }

    /// Appends a code of at most 32 bits.
    #[inline]
    fn put(&mut self, code: Code) {
        self.pending |= u64::from(code.bits) << (64 - self.count - code.len);
        self.count += code.len;
        if self.count >= 32 {
            self.out.extend_from_slice(&((self.pending >> 32) as u32).to_be_bytes());
            self.pending <<= 32;
            self.count -= 32;
        }
    }

    fn put_run(&mut self, mut length: u32, white: bool) {
        while length >= LONGEST_MAKE_UP + 64 {
            self.put(make_up(white, LONGEST_MAKE_UP / 64));
            length -= LONGEST_MAKE_UP;
        }
        if length >= 64 {
            self.put(make_up(white, (length / 64).min(LONGEST_MAKE_UP / 64)));
            length -= (length / 64 * 64).min(LONGEST_MAKE_UP);
        }
        let terminating = if white { &TERMINATING_1 } else { &TERMINATING_0 };
        self.put(terminating[length as usize]);
    }

    fn finish(mut self) -> Vec<u8> {
        let bytes = self.count.div_ceil(8) as usize;
        self.out.extend_from_slice(&self.pending.to_be_bytes()[..bytes]);
        self.out
    }
}
