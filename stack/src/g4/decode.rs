//! T.6 codes to runs.

use std::sync::LazyLock;

use super::codes::{
    Code, EOL, HORIZONTAL, MAKE_UP_0, MAKE_UP_1, MAKE_UP_LONG, PASS, TERMINATING_0, TERMINATING_1,
    VERTICAL,
};
use super::{G4Error, G4Fault};
use crate::mask::{MOST_RUNS, Mask, MaskBuilder};

/// Decodes a T.6 (CCITT Group 4) strip of `height` rows, most significant
/// bit first, into a mask. T.6's white is black (0).
///
/// Bytes after the last row, with or without EOFB, are not looked at. Memory
/// grows with the codes read, not with the size that is claimed.
///
/// # Errors
/// Where the codes end early, are not T.6, or leave the row; the error names
/// the row.
///
/// Source: ITU-T Recommendation T.6, section 2.2.
pub fn decode(strip: &[u8], width: u32, height: u32) -> Result<Mask, G4Error> {
    let mut mask = MaskBuilder::new(width);
    decode_rows(strip, width, height, &mut mask)?;
    Ok(mask.finish())
}

/// Decodes a strip below the rows that `mask` has.
pub(crate) fn decode_rows(
    strip: &[u8],
    width: u32,
    height: u32,
    mask: &mut MaskBuilder,
) -> Result<(), G4Error> {
    let mut bits = BitReader::new(strip);
    let mut above = RowAbove::new(width);
    let mut row = Vec::new();
    for index in 0..height {
        row.clear();
        decode_row(&mut bits, &above, &mut row, width)
            .map_err(|fault| G4Error { row: index, fault })?;
        mask.push_checked(&row);
        if mask.transition_count() > MOST_RUNS {
            return Err(G4Error { row: index, fault: G4Fault::TooManyRuns });
        }
        above.replace(&mut row);
    }
    Ok(())
}

/// The row above, with places behind its last transition, so that several can
/// be looked at together: the width, and on from there in wide steps.
struct RowAbove {
    places: Vec<u32>,
    len: usize,
    behind: [u32; LOOK],
}

/// How many vertical codes are taken together, and the place after them.
const LOOK: usize = 5;
/// Transitions so far apart stay in order when each moves by three pixels.
const WIDE: u32 = 7;

impl RowAbove {
    fn new(width: u32) -> Self {
        let behind = std::array::from_fn(|k| width + WIDE * k as u32);
        Self { places: behind.to_vec(), len: 0, behind }
    }

    /// Takes the row's transitions, leaving it some other ones.
    fn replace(&mut self, row: &mut Vec<u32>) {
        std::mem::swap(&mut self.places, row);
        self.len = self.places.len();
        self.places.extend_from_slice(&self.behind);
    }

    /// Transition `i`; the width behind the last.
    #[inline]
    fn at(&self, i: usize) -> u32 {
        if i < self.len { self.places[i] } else { self.behind[0] }
    }
}

/// Decodes one row against the row above it. Names are those of
/// [`encode_row`](super::encode).
fn decode_row(
    bits: &mut BitReader<'_>,
    above: &RowAbove,
    row: &mut Vec<u32>,
    width: u32,
) -> Result<(), G4Fault> {
    let (mut a0, mut started) = (0, false);
    let mut white = false;
    // The index of b1; its parity is the colour's.
    let mut j = 0;
    while a0 < width || !started {
        if let Some(count) = take_verticals(bits, above, j, a0, row) {
            a0 = row[row.len() - 1];
            white ^= count % 2 == 1;
            j += count;
            started = true;
            if a0 == width {
                row.pop();
            }
            continue;
        }
        match bits.mode()? {
            Mode::Vertical(shift) => {
                let a1 = above.at(j).checked_add_signed(shift).ok_or(G4Fault::OutsideRow)?;
                if a1 < a0 || a1 > width {
                    return Err(G4Fault::OutsideRow);
                }
                toggle(row, a1, width);
                a0 = a1;
                white = !white;
                j = if j > 0 { j - 1 } else { j + 1 };
            }
            Mode::Pass => {
                a0 = above.at(j + 1);
                j += 2;
            }
            Mode::Horizontal => {
                for colour in [white, !white] {
                    a0 += bits.run(colour, width - a0)?;
                    toggle(row, a0, width);
                }
            }
        }
        started = true;
        while j < above.len && above.places[j] <= a0 {
            j += 2;
        }
    }
    Ok(())
}

/// Takes up to four vertical codes at once and adds their transitions, where
/// these lie in order whatever the codes, because the runs above are wide. The
/// last may be the row's end. Gives how many were taken.
#[inline]
fn take_verticals(
    bits: &mut BitReader<'_>,
    above: &RowAbove,
    j: usize,
    a0: u32,
    row: &mut Vec<u32>,
) -> Option<usize> {
    let b: &[u32; LOOK] = above.places.get(j..)?.first_chunk()?;
    // The transition before b1 goes the other way: left of the next a0, it
    // cannot be the b1 after this one.
    let alone = j == 0 || b[0] - above.places[j - 1] > 3;
    let mut wide = alone && b[0] >= a0 + WIDE;
    for k in 1..LOOK {
        wide &= b[k].wrapping_sub(b[k - 1]) >= WIDE;
    }
    let codes = bits.verticals[bits.peek(VERTICALS_BITS)];
    // Behind the last transition stands the row's end, coded once.
    let count = usize::from(codes.count).min(above.len - j + 1);
    if !wide || count == 0 {
        return None;
    }
    let moved: [u32; 4] = std::array::from_fn(|k| b[k].wrapping_add_signed(codes.shifts[k].into()));
    if moved[count - 1] > above.behind[0] {
        return None;
    }
    bits.take(codes.ends[count - 1]).ok()?;
    row.extend_from_slice(&moved[..count]);
    Some(count)
}

/// Adds a transition; an empty run cancels the one before it.
#[inline]
fn toggle(row: &mut Vec<u32>, column: u32, width: u32) {
    if row.last() == Some(&column) {
        row.pop();
    } else if column < width {
        row.push(column);
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Pass,
    Horizontal,
    Vertical(i32),
}

/// What a code word that starts at some bits stands for, and its length; a
/// length of 0 marks bits that start no code.
#[derive(Clone, Copy)]
struct Entry<T> {
    value: T,
    len: u8,
}

/// The longest code of a table, in bits: how many bits index it.
const MODE_BITS: u32 = 7;
const RUN_BITS: u32 = 13;

/// Enters `value` at every index that begins with `code`.
fn enter<T: Copy>(table: &mut [Entry<T>], index_bits: u32, code: Code, value: T) {
    let spare = index_bits - code.len;
    let first = (code.bits << spare) as usize;
    table[first..first + (1 << spare)].fill(Entry { value, len: code.len as u8 });
}

static MODES: LazyLock<Vec<Entry<Mode>>> = LazyLock::new(|| {
    let mut table = vec![Entry { value: Mode::Pass, len: 0 }; 1 << MODE_BITS];
    enter(&mut table, MODE_BITS, PASS, Mode::Pass);
    enter(&mut table, MODE_BITS, HORIZONTAL, Mode::Horizontal);
    for (code, shift) in VERTICAL.into_iter().zip(-3..) {
        enter(&mut table, MODE_BITS, code, Mode::Vertical(shift));
    }
    table
});

/// The vertical codes that some bits begin with, at most four.
#[derive(Clone, Copy, Default)]
struct Verticals {
    count: u8,
    shifts: [i8; 4],
    /// How many bits the first code takes, the first two, and so on.
    ends: [u8; 4],
}

const VERTICALS_BITS: u32 = 11;

static VERTICALS: LazyLock<Vec<Verticals>> = LazyLock::new(|| {
    let begin = |bits: usize| {
        let mut found = Verticals::default();
        let mut end = 0;
        while found.count < 4 {
            let rest = bits << end & ((1 << VERTICALS_BITS) - 1);
            let entry = MODES[rest >> (VERTICALS_BITS - MODE_BITS)];
            let Mode::Vertical(shift) = entry.value else { break };
            end += u32::from(entry.len);
            if entry.len == 0 || end > VERTICALS_BITS {
                break;
            }
            found.shifts[usize::from(found.count)] = shift as i8;
            found.ends[usize::from(found.count)] = end as u8;
            found.count += 1;
        }
        found
    };
    (0..1 << VERTICALS_BITS).map(begin).collect()
});

/// Run-length codes of both colours, 0 first.
static RUNS: LazyLock<[Vec<Entry<u16>>; 2]> = LazyLock::new(|| {
    let table = |terminating: &[Code], make_up: &[Code]| {
        let mut table = vec![Entry { value: 0, len: 0 }; 1 << RUN_BITS];
        let make_up = make_up.iter().chain(&MAKE_UP_LONG).zip((64..).step_by(64));
        for (&code, run) in terminating.iter().zip(0..).chain(make_up) {
            enter(&mut table, RUN_BITS, code, run);
        }
        table
    };
    [table(&TERMINATING_0, &MAKE_UP_0), table(&TERMINATING_1, &MAKE_UP_1)]
});

/// Takes code words off a strip.
struct BitReader<'a> {
    rest: &'a [u8],
    /// The bits at hand, left-aligned.
    pending: u64,
    /// How many bits are at hand; negative once bits past the end were taken.
    count: i32,
    modes: &'static [Entry<Mode>],
    verticals: &'static [Verticals],
    runs: &'static [Vec<Entry<u16>>; 2],
}

impl<'a> BitReader<'a> {
    fn new(strip: &'a [u8]) -> Self {
        Self {
            rest: strip,
            pending: 0,
            count: 0,
            modes: &MODES,
            verticals: &VERTICALS,
            runs: &RUNS,
        }
    }

    /// The next `n` bits (zeros past the end).
    #[inline]
    fn peek(&mut self, n: u32) -> usize {
        if self.count < 32 {
            self.refill();
        }
        (self.pending >> (64 - n)) as usize
    }

    #[inline]
    fn refill(&mut self) {
        if let Some((word, rest)) = self.rest.split_first_chunk::<4>()
            && self.count >= 0
        {
            self.pending |= u64::from(u32::from_be_bytes(*word)) << (32 - self.count);
            self.count += 32;
            self.rest = rest;
        } else {
            while (0..=56).contains(&self.count) && !self.rest.is_empty() {
                self.pending |= u64::from(self.rest[0]) << (56 - self.count);
                self.count += 8;
                self.rest = &self.rest[1..];
            }
        }
    }

    #[inline]
    fn take(&mut self, len: u8) -> Result<(), G4Fault> {
        self.pending <<= len;
        self.count -= i32::from(len);
        if self.count < 0 { Err(G4Fault::EndsEarly) } else { Ok(()) }
    }

    #[inline]
    fn mode(&mut self) -> Result<Mode, G4Fault> {
        let entry = self.modes[self.peek(MODE_BITS)];
        if entry.len == 0 {
            return Err(self.no_code());
        }
        self.take(entry.len)?;
        Ok(entry.value)
    }

    /// A run of at most `room` pixels: any make-up codes and a terminating
    /// code.
    fn run(&mut self, white: bool, room: u32) -> Result<u32, G4Fault> {
        let runs = self.runs;
        let table = &runs[usize::from(white)];
        let mut length = 0;
        loop {
            let entry = table[self.peek(RUN_BITS)];
            if entry.len == 0 {
                return Err(self.no_code());
            }
            self.take(entry.len)?;
            length += u32::from(entry.value);
            if length > room {
                return Err(G4Fault::OutsideRow);
            }
            if entry.value < 64 {
                return Ok(length);
            }
        }
    }

    /// Why the next bits are no code: the strip or the page ended, or they
    /// are not T.6.
    fn no_code(&mut self) -> G4Fault {
        if self.peek(EOL.len) == EOL.bits as usize || (self.pending == 0 && self.rest.is_empty()) {
            G4Fault::EndsEarly
        } else {
            G4Fault::NotACode
        }
    }
}
