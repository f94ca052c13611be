//! Decodes T.6 codes to runs.

use std::sync::LazyLock;

use super::coded_row::{AT_ONCE, CodedRow, LOOK, WIDE};
use super::codes::{
    Code, EOL, HORIZONTAL, MAKE_UP_0, MAKE_UP_1, MAKE_UP_LONG, PASS, TERMINATING_0, TERMINATING_1,
    VERTICAL,
};
use super::{G4Error, G4Fault};
use crate::image::mask::Mask;
use crate::limits::MAX_RUNS;

/// Decodes a T.6 (CCITT Group 4) strip of `height` rows, most significant bit first, into a
/// mask. T.6's white is black (0).
///
/// Bytes after the last row, with or without EOFB, are ignored. Memory grows with the codes
/// read, not with the claimed size.
///
/// # Errors
/// Returns an error with the row if the codes end early, are not T.6, or leave the row.
///
/// Source: ITU-T Recommendation T.6, section 2.2.
pub fn decode(strip: &[u8], width: u32, height: u32) -> Result<Mask, G4Error> {
    let mut mask = Mask::without_rows(width);
    decode_rows(strip, width, height, MAX_RUNS, &mut mask)?;
    Ok(mask)
}

/// Decodes a strip and adds its rows below the rows of `mask`.
pub(crate) fn decode_rows(
    strip: &[u8],
    width: u32,
    height: u32,
    max_runs: usize,
    mask: &mut Mask,
) -> Result<(), G4Error> {
    let mut bits = CodeWordReader::new(strip);
    let (mut above, mut row) = (CodedRow::black(width), CodedRow::black(width));
    let mut index = 0;
    while index < height {
        // Below a black row, a black row is a single bit, V0.
        if above.len == 0 {
            let black = bits.take_ones(height - index);
            mask.push_black_rows(black);
            index += black;
            if index == height {
                break;
            }
        }
        decode_row(&mut bits, &above, &mut row, width)
            .map_err(|fault| G4Error { row: index, fault })?;
        row.push_to(mask);
        if mask.change_count() > max_runs {
            return Err(G4Error { row: index, fault: G4Fault::TooManyRuns });
        }
        std::mem::swap(&mut above, &mut row);
        index += 1;
    }
    Ok(())
}

/// Decodes one row against the row above it, with the names of [`encode_row`](super::encode).
pub(super) fn decode_row(
    bits: &mut CodeWordReader<'_>,
    above: &CodedRow,
    row: &mut CodedRow,
    width: u32,
) -> Result<(), G4Fault> {
    row.clear();
    let (mut a0, mut started) = (0, false);
    let mut white = false;
    // The index of b1; its parity is the color's parity.
    let mut j = 0;
    while a0 < width || !started {
        if let Some(count) = take_verticals(bits, above, j, a0, row, width) {
            a0 = row.places[row.len + count - 1];
            row.len += count;
            row.make_room();
            white ^= count % 2 == 1;
            j += count;
            started = true;
            row.len -= usize::from(a0 == width);
            continue;
        }
        match bits.mode()? {
            CodingMode::Vertical(shift) => {
                let a1 = above.at(j).checked_add_signed(shift).ok_or(G4Fault::OutsideRow)?;
                if a1 < a0 || a1 > width {
                    return Err(G4Fault::OutsideRow);
                }
                row.toggle(a1, width);
                a0 = a1;
                white = !white;
                // b1 must now change to the other color, and the one before it may be right of a0.
                j = if j > 0 { j - 1 } else { j + 1 };
            }
            CodingMode::Pass => {
                // a0 moves below b2, and the color stays.
                a0 = above.at(j + 1);
                j += 2;
            }
            CodingMode::Horizontal => {
                for colour in [white, !white] {
                    a0 += bits.run(colour, width - a0)?;
                    row.toggle(a0, width);
                }
            }
        }
        started = true;
        // libtiff does not look for the next b1 before the row has a run. Without runs of length
        // zero above, b1 is past a0 then.
        while row.len > 0 && j < above.len && above.places[j] <= a0 {
            j += 2;
        }
    }
    row.end(width);
    Ok(())
}

/// Decodes up to four vertical codes at once, if the runs above are wide enough to keep the
/// transitions in order for any codes. Writes the transitions after the row's end and
/// returns their number; the last may be the end of the row.
#[inline]
fn take_verticals(
    bits: &mut CodeWordReader<'_>,
    above: &CodedRow,
    j: usize,
    a0: u32,
    row: &mut CodedRow,
    width: u32,
) -> Option<usize> {
    if j > above.len {
        return None;
    }
    let b: &[u32; LOOK] = above.places.get(j..)?.first_chunk()?;
    // The transition before b1 has the opposite color. If it is left of the next a0, it
    // cannot be the next b1.
    let alone = j == 0 || b[0] - above.places[j - 1] > 3;
    // Any difference that is too small sets the sign bit.
    let mut narrow = b[0].wrapping_sub(a0).wrapping_sub(WIDE);
    for k in 1..LOOK {
        narrow |= b[k].wrapping_sub(b[k - 1]).wrapping_sub(WIDE);
    }
    let codes = bits.verticals[bits.peek(VERTICALS_BITS)];
    // The row's end follows the last transition and is coded once.
    let count = usize::from(codes.count).min(above.len - j + 1);
    if !alone || narrow >> 31 != 0 || count == 0 {
        return None;
    }
    let moved: &mut [u32; AT_ONCE] = row.places.get_mut(row.len..)?.first_chunk_mut()?;
    for k in 0..AT_ONCE {
        moved[k] = b[k].wrapping_add_signed(codes.shifts[k].into());
    }
    // The moved transitions stay in order, so the last bounds all.
    if moved[count - 1] > width {
        return None;
    }
    // Every vertical code ends with a 1, so none extends into the zeros after the strip.
    bits.skip(codes.end(count - 1));
    Some(count)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CodingMode {
    Pass,
    Horizontal,
    Vertical(i32),
}

/// The value and length of the code word that some bits start with; the length is 0 if they
/// start with none.
#[derive(Clone, Copy)]
struct CodeTableEntry<T> {
    value: T,
    len: u8,
}

/// The longest mode code in bits, and so the bits of the table's index.
const MODE_BITS: u32 = 7;
// The longest codes of runs, black ones, have 13 bits.
const RUN_BITS: u32 = 13;

/// Stores `value` at every index that begins with `code`.
fn enter<T: Copy>(table: &mut [CodeTableEntry<T>], index_bits: u32, code: Code, value: T) {
    let spare = index_bits - code.len;
    let first = (code.bits << spare) as usize;
    table[first..first + (1 << spare)].fill(CodeTableEntry { value, len: code.len as u8 });
}

static MODES: LazyLock<Vec<CodeTableEntry<CodingMode>>> = LazyLock::new(|| {
    let mut table = vec![CodeTableEntry { value: CodingMode::Pass, len: 0 }; 1 << MODE_BITS];
    enter(&mut table, MODE_BITS, PASS, CodingMode::Pass);
    enter(&mut table, MODE_BITS, HORIZONTAL, CodingMode::Horizontal);
    for (code, shift) in VERTICAL.into_iter().zip(-3..) {
        enter(&mut table, MODE_BITS, code, CodingMode::Vertical(shift));
    }
    table
});

/// The vertical codes, at most four, that some bits begin with.
#[derive(Clone, Copy, Default)]
struct Verticals {
    shifts: [i8; AT_ONCE],
    count: u8,
    /// The end of each code in bits, packed in 4 bits each.
    ends: u16,
}

impl Verticals {
    /// Returns the end of code `k` in bits.
    #[inline]
    fn end(self, k: usize) -> u32 {
        u32::from(self.ends) >> (4 * k) & 15
    }

    fn push(&mut self, shift: i32, end: u32) {
        self.shifts[usize::from(self.count)] = shift as i8;
        self.ends |= (end << (4 * self.count)) as u16;
        self.count += 1;
    }
}

// Four codes of three bits, VL1 or VR1, fit; longer ones are decoded fewer at a time.
const VERTICALS_BITS: u32 = 12;

static VERTICALS: LazyLock<Vec<Verticals>> = LazyLock::new(|| {
    let begin = |bits: usize| {
        let mut found = Verticals::default();
        let mut end = 0;
        while usize::from(found.count) < AT_ONCE {
            let rest = bits << end & ((1 << VERTICALS_BITS) - 1);
            let entry = MODES[rest >> (VERTICALS_BITS - MODE_BITS)];
            let CodingMode::Vertical(shift) = entry.value else { break };
            end += u32::from(entry.len);
            if entry.len == 0 || end > VERTICALS_BITS {
                break;
            }
            found.push(shift, end);
        }
        found
    };
    (0..1 << VERTICALS_BITS).map(begin).collect()
});

/// The run-length codes of both colors, 0 first.
static RUNS: LazyLock<[Vec<CodeTableEntry<u16>>; 2]> = LazyLock::new(|| {
    let table = |terminating: &[Code], make_up: &[Code]| {
        let mut table = vec![CodeTableEntry { value: 0, len: 0 }; 1 << RUN_BITS];
        let make_up = make_up.iter().chain(&MAKE_UP_LONG).zip((64..).step_by(64));
        for (&code, run) in terminating.iter().zip(0..).chain(make_up) {
            enter(&mut table, RUN_BITS, code, run);
        }
        table
    };
    [table(&TERMINATING_0, &MAKE_UP_0), table(&TERMINATING_1, &MAKE_UP_1)]
});

/// A reader of a strip's code words.
pub(super) struct CodeWordReader<'a> {
    rest: &'a [u8],
    /// The buffered bits, left-aligned.
    pending: u64,
    /// The number of buffered bits; negative after bits past the end were taken.
    count: i32,
    modes: &'static [CodeTableEntry<CodingMode>],
    verticals: &'static [Verticals],
    runs: &'static [Vec<CodeTableEntry<u16>>; 2],
}

impl<'a> CodeWordReader<'a> {
    pub(super) fn new(strip: &'a [u8]) -> Self {
        Self {
            rest: strip,
            pending: 0,
            count: 0,
            modes: &MODES,
            verticals: &VERTICALS,
            runs: &RUNS,
        }
    }

    /// Returns the next `n` bits, zeros past the end, without taking them.
    #[inline]
    pub(super) fn peek(&mut self, n: u32) -> usize {
        // No table's index has more than 13 bits, so 32 are enough.
        if self.count < 32 {
            self.refill();
        }
        (self.pending >> (64 - n)) as usize
    }

    #[inline]
    fn refill(&mut self) {
        if let Some(word) = self.rest.first_chunk::<8>()
            && self.count >= 0
        {
            // The bits after the last whole byte are loaded again next time.
            self.pending |= u64::from_be_bytes(*word) >> self.count;
            self.rest = &self.rest[(63 - self.count) as usize / 8..];
            // All bytes that fit: afterwards the count is 56 to 63, with the same low three bits.
            self.count |= 56;
        } else {
            while (0..=56).contains(&self.count) && !self.rest.is_empty() {
                self.pending |= u64::from(self.rest[0]) << (56 - self.count);
                self.count += 8;
                self.rest = &self.rest[1..];
            }
        }
    }

    /// Takes bits that are buffered.
    #[inline]
    fn skip(&mut self, len: u32) {
        self.pending <<= len;
        self.count -= len as i32;
    }

    /// Takes the next 1 bits, at most `most`, and returns their number.
    fn take_ones(&mut self, most: u32) -> u32 {
        let mut taken = 0;
        loop {
            self.peek(1);
            // Bits beyond the count are there, too, but come again with the next refill.
            let ones = self.pending.leading_ones().min(self.count.max(0) as u32).min(most - taken);
            if ones == 0 {
                return taken;
            }
            self.skip(ones.min(32));
            taken += ones.min(32);
        }
    }

    #[inline]
    pub(super) fn take(&mut self, len: u8) -> Result<(), G4Fault> {
        self.pending <<= len;
        self.count -= i32::from(len);
        // Zeros past the end may look like a code.
        if self.count < 0 { Err(G4Fault::EndsEarly) } else { Ok(()) }
    }

    #[inline]
    fn mode(&mut self) -> Result<CodingMode, G4Fault> {
        let entry = self.modes[self.peek(MODE_BITS)];
        if entry.len == 0 {
            return Err(self.no_code());
        }
        self.take(entry.len)?;
        Ok(entry.value)
    }

    /// Reads a run of at most `room` pixels: any make-up codes and a terminating code.
    pub(super) fn run(&mut self, white: bool, room: u32) -> Result<u32, G4Fault> {
        let runs = self.runs;
        let table = &runs[usize::from(white)];
        let mut length = 0u32;
        loop {
            let entry = table[self.peek(RUN_BITS)];
            if entry.len == 0 {
                return Err(self.no_code());
            }
            self.take(entry.len)?;
            length = length
                .checked_add(entry.value.into())
                .filter(|&length| length <= room)
                .ok_or(G4Fault::OutsideRow)?;
            // A terminating code follows any make-up codes, even for a rest of no pixels.
            if entry.value < 64 {
                return Ok(length);
            }
        }
    }

    /// Skips to the next byte boundary.
    pub(super) fn align(&mut self) -> Result<(), G4Fault> {
        // Bits were buffered as whole bytes, so the count modulo 8 is the rest of the begun byte.
        self.take((self.count % 8) as u8)
    }

    /// Returns the fault of bits that are no code: the strip or the page ended, or they are not
    /// T.6.
    fn no_code(&mut self) -> G4Fault {
        if self.peek(EOL.len) == EOL.bits as usize || (self.pending == 0 && self.rest.is_empty()) {
            G4Fault::EndsEarly
        } else {
            G4Fault::NotACode
        }
    }
}
