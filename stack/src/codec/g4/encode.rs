//! Encodes runs as T.6 codes.

use std::sync::LazyLock;

use super::codes::{
    Code, EOL, HORIZONTAL, LONGEST_MAKE_UP, PASS, TERMINATING_0, TERMINATING_1, VERTICAL, make_up,
};
use crate::image::mask::Mask;

/// Encodes a mask as one T.6 (CCITT Group 4) strip, most significant bit first, ended by
/// EOFB and padded to a byte. Black (0) is T.6's white.
///
/// The codes follow T.6's flow diagram, computed from the runs alone.
///
/// Source: ITU-T Recommendation T.6, sections 2.2.1 to 2.2.5.
pub fn encode(mask: &Mask) -> Vec<u8> {
    // A transition takes some four bits, a black row one.
    let mut bits = CodeWordWriter::new(mask.change_count() / 2 + mask.height() as usize / 8 + 16);
    let mut reference: &[u32] = &[];
    for row in mask.rows() {
        // a1 and b1 are both at the width: one vertical code.
        if row.is_empty() && reference.is_empty() {
            bits.put(VERTICAL[3]);
            continue;
        }
        encode_row(&mut bits, reference, row, mask.width());
        reference = row;
    }
    bits.put(EOL);
    bits.put(EOL);
    bits.finish()
}

/// Encodes one row against the row above it, with the names of T.6: a0 is the current
/// position, a1 and a2 are the next transitions of this row, b1 is the first transition of
/// the reference row right of a0 to the opposite color, and b2 the one after it.
fn encode_row(bits: &mut CodeWordWriter, reference: &[u32], row: &[u32], width: u32) {
    let four_verticals = &*FOUR_VERTICALS;
    let at = |transitions: &[u32], i: usize| transitions.get(i).copied().unwrap_or(width);
    // The first a0 is an imaginary pixel left of the row: at 0, but not past
    // a transition at 0.
    let (mut a0, mut started) = (0, false);
    // The indices of a1 and b1. Their parities agree, as both change to the same color.
    let (mut i, mut j) = (0, 0);
    // Even a row without columns has a code.
    while a0 < width || !started {
        let (a1, b1, b2) = (at(row, i), at(reference, j), at(reference, j + 1));
        let is_near = a1.abs_diff(b1) <= 3;
        if is_near {
            if let Some(code) = four_near(reference, row, i, j, width, four_verticals) {
                (i, j) = (i + 4, j + 4);
                // Both rows are at their ends, so the row's end is one more vertical code.
                if i == row.len() && j == reference.len() {
                    return bits.put(code.then(VERTICAL[3]));
                }
                bits.put(code);
                (a0, started) = (row[i - 1], true);
                continue;
            }
            if let Some(code) = last_two_near(reference, row, i, j, width) {
                return bits.put(code);
            }
        }
        // T.6 asks for pass mode first, even if a1 is near b1.
        if b2 < a1 {
            bits.put(PASS);
            (a0, j) = (b2, j + 2);
        } else if is_near {
            bits.put(VERTICAL[a1.wrapping_sub(b1).wrapping_add(3) as usize]);
            a0 = a1;
            i += 1;
            // The next transition of the other color may be before this one.
            j = if j > 0 { j - 1 } else { j + 1 };
        } else {
            let a2 = at(row, i + 1);
            bits.put_horizontal([a1 - a0, a2 - a1], i % 2 == 1);
            a0 = a2;
            i += 2;
        }
        started = true;
        while reference.get(j).is_some_and(|&b1| b1 <= a0) {
            j += 2;
        }
    }
}

/// Returns the codes of the next four transitions if each is within three pixels of the reference
/// row's and the reference runs are wide enough (four pixels) to exclude pass mode and any other
/// b1.
#[inline]
fn four_near(
    reference: &[u32],
    row: &[u32],
    i: usize,
    j: usize,
    width: u32,
    codes: &[u32],
) -> Option<Code> {
    let a: &[u32; 4] = row.get(i..)?.first_chunk()?;
    let b: &[u32; 4] = reference.get(j..)?.first_chunk()?;
    // The transition before b1 must be left of the next a0, the one after the last of b right
    // of the fourth a1. A difference that is too small sets the sign bit, a shift that is too
    // large sets a bit above the third.
    let behind = reference.get(j + 4).copied().unwrap_or(width);
    let before = if j == 0 { b[0].wrapping_sub(4) } else { reference[j - 1] };
    let mut narrow = b[0].wrapping_sub(before).wrapping_sub(4);
    narrow |= behind.wrapping_sub(b[3]).wrapping_sub(4);
    for k in 1..4 {
        narrow |= b[k].wrapping_sub(b[k - 1]).wrapping_sub(4);
    }
    let (mut far, mut index) = (0, 0);
    for k in 0..4 {
        let shift = a[k].wrapping_sub(b[k]).wrapping_add(3);
        far |= shift;
        index |= shift << (3 * k);
    }
    if narrow >> 31 | far >> 3 != 0 {
        return None;
    }
    let code = codes[index as usize];
    (code != 0).then_some(Code { bits: code & 0x07FF_FFFF, len: code >> 27 })
}

/// Returns the codes of the last two transitions and of the row's end, where they are as in
/// [`four_near`] and the last two of the reference row.
#[inline]
fn last_two_near(reference: &[u32], row: &[u32], i: usize, j: usize, width: u32) -> Option<Code> {
    let &[a0, a1] = row.get(i..)? else { return None };
    let &[b0, b1] = reference.get(j..)? else { return None };
    let is_wide = (j == 0 || b0 - reference[j - 1] >= 4) && b1 - b0 >= 4 && width - b1 >= 4;
    let vertical = |a: u32, b: u32| VERTICAL.get(a.wrapping_sub(b).wrapping_add(3) as usize);
    let (first, second) = (vertical(a0, b0)?, vertical(a1, b1)?);
    is_wide.then(|| first.then(*second).then(VERTICAL[3]))
}

/// Four vertical codes in one word, indexed by four 3-bit values of `a1 - b1 + 3`, the first
/// lowest: the length in the top 5 bits, the codes' bits below. 27 bits are enough, because
/// every code longer than 3 bits starts with zeros.
static FOUR_VERTICALS: LazyLock<Vec<u32>> = LazyLock::new(|| {
    let join = |index: usize| {
        (0..4).try_fold(Code { bits: 0, len: 0 }, |joined, k| {
            let code = VERTICAL.get(index >> (3 * k) & 7)?;
            Some(joined.then(*code))
        })
    };
    (0..4096).map(|index| join(index).map_or(0, |code| code.len << 27 | code.bits)).collect()
});

/// Returns the code of a run of less than 64 pixels, or of the rest of a longer one.
#[inline]
fn terminating(length: u32, white: bool) -> Code {
    let codes = if white { &TERMINATING_1 } else { &TERMINATING_0 };
    codes[length as usize]
}

/// A writer of bits, most significant first.
struct CodeWordWriter {
    /// The whole bytes, up to `end`, and room for more.
    out: Vec<u8>,
    end: usize,
    /// The bits of the byte that has begun, left-aligned; fewer than 8 between calls.
    pending: u64,
    count: u32,
}

impl CodeWordWriter {
    fn new(capacity: usize) -> Self {
        Self { out: vec![0; capacity.max(8)], end: 0, pending: 0, count: 0 }
    }

    /// Appends a code of at most 32 bits.
    ///
    /// Writes all bits, whole bytes or not: a branch on their number would be mispredicted often.
    #[inline]
    fn put(&mut self, code: Code) {
        self.pending |= u64::from(code.bits) << (64 - self.count - code.len);
        self.count += code.len;
        if self.out.len() - self.end < 8 {
            self.grow();
        }
        self.out[self.end..][..8].copy_from_slice(&self.pending.to_be_bytes());
        self.end += (self.count / 8) as usize;
        self.pending <<= self.count & !7;
        self.count %= 8;
    }

    #[cold]
    fn grow(&mut self) {
        self.out.resize(2 * self.out.len(), 0);
    }

    /// Appends two runs in horizontal mode; either the first or the second is white.
    #[inline]
    fn put_horizontal(&mut self, [first, second]: [u32; 2], first_is_white: bool) {
        if first < 64 && second < 64 {
            let first = terminating(first, first_is_white);
            let second = terminating(second, !first_is_white);
            return self.put(HORIZONTAL.then(first).then(second));
        }
        self.put(HORIZONTAL);
        self.put_run(first, first_is_white);
        self.put_run(second, !first_is_white);
    }

    fn put_run(&mut self, mut length: u32, white: bool) {
        // Up to 2623 pixels take one make-up code and a terminating code.
        while length >= LONGEST_MAKE_UP + 64 {
            self.put(make_up(white, LONGEST_MAKE_UP / 64));
            length -= LONGEST_MAKE_UP;
        }
        let last = terminating(length % 64, white);
        self.put(if length >= 64 { make_up(white, length / 64).then(last) } else { last });
    }

    fn finish(mut self) -> Vec<u8> {
        self.out.truncate(self.end + self.count.div_ceil(8) as usize);
        self.out
    }
}
