//! Writes runs.

use super::bits::{BitWriter, MOST_PUT};
use super::huffman::{code_lengths, codes};
use super::{
    END_OF_BLOCK, LENGTH_ORDER, MOST_BITS, MOST_COPIED, MOST_LENGTH_BITS, SYMBOLS, copies_of,
};
use crate::image::gray::{GrayMask, LevelChange};

/// The number of runs in a block: enough that its codes take a hundredth of it.
const BLOCK_RUNS: usize = 1 << 14;
/// A zlib stream of Deflate with a window of 32 KiB, at the usual level.
const ZLIB_HEADER: [u8; 2] = [0x78, 0x9C];

/// Encodes a gray mask as a zlib stream of its bytes, row by row.
pub(crate) fn encode(image: &GrayMask) -> Vec<u8> {
    // Most runs take less than four bytes.
    let mut out = BitWriter::after(&ZLIB_HEADER, 4 * image.change_count());
    let mut runs = ByteRuns { block: Block::new(), out: &mut out, byte: 0, since: 0 };
    for (row, changes) in (0..).zip(image.rows()) {
        let start = row * u64::from(image.width());
        // A row starts black, which ends a run that the row before left open.
        if changes.first().is_none_or(|first| first.column > 0) {
            runs.change_at(start, 0);
        }
        for change in changes {
            runs.change_at(start.wrapping_add(change.column.into()), change.level);
        }
    }
    runs.end_at(u64::from(image.width()) * u64::from(image.height()));
    runs.block.put(runs.out, true);
    let mut bytes = out.finish();
    bytes.extend_from_slice(&adler32(image).to_be_bytes());
    bytes
}

/// Runs `(length, byte)` that are made from the first pixel on; they go on from row to row.
struct ByteRuns<'a> {
    block: Block,
    out: &'a mut BitWriter,
    /// The byte of the run that has begun, and its first pixel.
    byte: u8,
    since: u64,
}

impl ByteRuns<'_> {
    #[inline]
    fn change_at(&mut self, pixel: u64, byte: u8) {
        if byte != self.byte {
            self.end_at(pixel);
            (self.byte, self.since) = (byte, pixel);
        }
    }

    #[inline]
    fn end_at(&mut self, pixel: u64) {
        match u32::try_from(pixel.wrapping_sub(self.since)) {
            Ok(0) => {}
            Ok(length) => self.push(length),
            Err(_) => self.push_cut(pixel),
        }
    }

    /// Cuts a run of a huge image where its length would not fit.
    #[cold]
    fn push_cut(&mut self, pixel: u64) {
        let mut length = pixel - self.since;
        while length > 0 {
            let some = u32::try_from(length).unwrap_or(u32::MAX);
            self.push(some);
            length -= u64::from(some);
        }
    }

    #[inline]
    fn push(&mut self, length: u32) {
        if self.block.runs.len() == BLOCK_RUNS {
            self.block.put(self.out, false);
        }
        self.block.push(length, self.byte);
    }
}

/// A run as it is written: bytes, then copies of the last.
#[derive(Clone, Copy)]
struct CopiedRun {
    longest: u32,
    /// The length of a last copy that is shorter than the longest, or zero.
    last: u16,
    /// The number of bytes that are written as such: one, or up to three if no copy is left.
    bytes: u8,
}

impl CopiedRun {
    #[inline]
    fn of(length: u32) -> Self {
        // Runs of no bytes were left out, so this does not wrap.
        let copied = length.wrapping_sub(1);
        let (longest, last) = (copied / MOST_COPIED, (copied % MOST_COPIED) as u16);
        // No copy is shorter than three.
        let is_short = last < 3;
        let bytes = if is_short { 1 + last as u8 } else { 1 };
        Self { longest, last: if is_short { 0 } else { last }, bytes }
    }
}

/// Runs that share their codes, and how often each symbol occurs in them.
struct Block {
    /// Lengths and bytes.
    runs: Vec<(u32, u8)>,
    bytes: [u32; 256],
    last: [u32; MOST_COPIED as usize],
    longest: u64,
}

impl Block {
    fn new() -> Self {
        let runs = Vec::with_capacity(BLOCK_RUNS);
        Self { runs, bytes: [0; 256], last: [0; MOST_COPIED as usize], longest: 0 }
    }

    /// Adds a run. Counts of so many fit in 32 bits.
    #[inline]
    fn push(&mut self, length: u32, byte: u8) {
        let copies = CopiedRun::of(length);
        let of_byte = &mut self.bytes[usize::from(byte)];
        *of_byte = of_byte.wrapping_add(copies.bytes.into());
        let of_last = &mut self.last[usize::from(copies.last)];
        *of_last = of_last.wrapping_add(1);
        self.longest = self.longest.wrapping_add(copies.longest.into());
        self.runs.push((length, byte));
    }

    /// Returns how often each symbol occurs.
    fn frequencies(&self) -> [u32; SYMBOLS] {
        let mut frequencies = [0; SYMBOLS];
        frequencies[..256].copy_from_slice(&self.bytes);
        frequencies[usize::from(END_OF_BLOCK)] = 1;
        for (length, times) in (0..).zip(self.last).skip(3) {
            frequencies[usize::from(length_symbol(length))] += times;
        }
        // A block of one color may count beyond 32 bits; codes need no more than the order.
        let longest = self.longest + u64::from(frequencies[SYMBOLS - 1]);
        frequencies[SYMBOLS - 1] = longest.try_into().unwrap_or(u32::MAX);
        frequencies
    }

    /// Writes the block, and empties it.
    fn put(&mut self, out: &mut BitWriter, is_last: bool) {
        let lengths = code_lengths(&self.frequencies(), MOST_BITS);
        let codes = codes(&lengths);
        out.put(u32::from(is_last).into(), 1);
        // Codes of its own.
        out.put(2, 2);
        put_lengths(out, &lengths);
        let code = |symbol: usize| Bits { bits: codes[symbol].into(), count: lengths[symbol] };
        put_runs(out, &self.runs, code);
        let end = code(END_OF_BLOCK.into());
        out.put(end.bits, end.count);
        self.runs.clear();
        (self.bytes, self.last, self.longest) = ([0; 256], [0; MOST_COPIED as usize], 0);
    }
}

fn put_runs(out: &mut BitWriter, runs: &[(u32, u8)], code: impl Fn(usize) -> Bits) {
    // Once, twice and thrice: at most 45 bits.
    let once: [Bits; 256] = std::array::from_fn(&code);
    let twice = once.map(|byte| byte.then(byte));
    let bytes = [once, twice, std::array::from_fn(|byte| once[byte].then(twice[byte]))];
    // The only distance, from the byte before, is a zero bit.
    let zero = Bits { bits: 0, count: 1 };
    let longest = Often::new(code(SYMBOLS - 1).then(zero));
    let last: [Bits; MOST_COPIED as usize] = std::array::from_fn(|length| {
        if length < 3 {
            return Bits::default();
        }
        let symbol = length_symbol(length as u32);
        let (first, count) = copies_of(symbol).expect("it is the symbol of a length");
        let more = Bits { bits: length as u64 - u64::from(first), count };
        code(symbol.into()).then(more).then(zero)
    });
    for &(length, byte) in runs {
        let copies = CopiedRun::of(length);
        let first = bytes[usize::from(copies.bytes.wrapping_sub(1))][usize::from(byte)];
        let last = last[usize::from(copies.last)];
        let others = u64::from(first.count.wrapping_add(last.count));
        // Nearly all runs fit in one write.
        if longest.bits_of(copies.longest).wrapping_add(others) <= MOST_PUT.into() {
            let all = first.then(longest.times(copies.longest)).then(last);
            out.put(all.bits, all.count);
        } else {
            out.put(first.bits, first.count);
            longest.put(out, copies.longest);
            out.put(last.bits, last.count);
        }
    }
}

/// A code, the first bit lowest.
#[derive(Clone, Copy, Default)]
struct Bits {
    bits: u64,
    count: u8,
}

impl Bits {
    /// Returns the bits with others behind them.
    #[inline]
    fn then(self, next: Self) -> Self {
        let bits = self.bits | next.bits.wrapping_shl(self.count.into());
        Self { bits, count: self.count.wrapping_add(next.count) }
    }
}

/// Bits that are written many times, as many at once as fit.
struct Often {
    once: u8,
    most: u32,
    all: u64,
}

impl Often {
    fn new(once: Bits) -> Self {
        let most = MOST_PUT / once.count;
        let all = (0..most).fold(Bits::default(), |all, _| all.then(once));
        Self { once: once.count, most: most.into(), all: all.bits }
    }

    /// Returns the number of bits of this many times.
    #[inline]
    fn bits_of(&self, times: u32) -> u64 {
        u64::from(self.once).wrapping_mul(times.into())
    }

    /// Returns the bits this many times, at most `most`.
    #[inline]
    fn times(&self, times: u32) -> Bits {
        let count = self.bits_of(times) as u8;
        Bits { bits: self.all & 1u64.wrapping_shl(count.into()).wrapping_sub(1), count }
    }

    #[cold]
    fn put(&self, out: &mut BitWriter, mut times: u32) {
        while times > 0 {
            let some = times.min(self.most);
            let bits = self.times(some);
            out.put(bits.bits, bits.count);
            times -= some;
        }
    }
}

/// Returns the symbol of a copy's length, 3 to 257.
fn length_symbol(length: u32) -> u16 {
    let from_three = length - 3;
    // RFC 1951, section 3.2.5: eight lengths alone, then four for each number of extra bits.
    let index = if from_three < 8 {
        from_three
    } else {
        let bits = from_three.ilog2() - 2;
        4 * bits + (from_three >> bits)
    };
    END_OF_BLOCK + 1 + index as u16
}

/// Appends the lengths of a block's codes. Of distances there is one, of one bit.
fn put_lengths(out: &mut BitWriter, lengths: &[u8]) {
    let mut tokens = Vec::new();
    for run in lengths.iter().chain(&[1]).copied().collect::<Vec<_>>().chunk_by(|a, b| a == b) {
        put_length_run(&mut tokens, run[0], run.len());
    }
    let mut frequencies = [0; 19];
    tokens.iter().for_each(|&(symbol, ..)| frequencies[usize::from(symbol)] += 1);
    let of_lengths = code_lengths(&frequencies, MOST_LENGTH_BITS);
    let codes = codes(&of_lengths);
    // HLIT, HDIST and HCLEN: all symbols, one distance, and all lengths of lengths.
    out.put(SYMBOLS as u64 - 257, 5);
    out.put(0, 5);
    out.put(LENGTH_ORDER.len() as u64 - 4, 4);
    LENGTH_ORDER.iter().for_each(|&symbol| out.put(of_lengths[symbol].into(), 3));
    for (symbol, more, bits) in tokens {
        out.put(codes[usize::from(symbol)].into(), of_lengths[usize::from(symbol)]);
        out.put(more.into(), bits);
    }
}

/// Adds the symbols, with bits that count on, of codes of one length that follow each other.
fn put_length_run(tokens: &mut Vec<(u8, u32, u8)>, length: u8, mut count: usize) {
    // Symbol 16 repeats the length before, so the first one is written itself.
    if length > 0 {
        tokens.push((length, 0, 0));
        count -= 1;
    }
    while count > 0 {
        // Repeat codes of RFC 1951, section 3.2.7; none is shorter than three.
        let (symbol, least, most, bits) = match (length, count) {
            (_, 1 | 2) => (length, 1, 1, 0),
            (1.., _) => (16, 3, 6, 2),
            (_, 3..=10) => (17, 3, 10, 3),
            _ => (18, 11, 138, 7),
        };
        let part = count.min(most);
        tokens.push((symbol, (part - least) as u32, bits));
        count -= part;
    }
}

/// Returns the Adler-32 check of an image's bytes, in a few operations a change.
fn adler32(image: &GrayMask) -> u32 {
    const MODULUS: u64 = 65_521;
    let (mut a, mut b) = (1u64, 0u64);
    for changes in image.rows() {
        // Remainders are seldom taken: with what a row of the greatest width adds, which is below
        // 2^60, both sums still fit.
        if a >= 1 << 24 {
            a %= MODULUS;
        }
        if b >= 1 << 44 {
            b %= MODULUS;
        }
        let (sum, weighted) = row_sums(changes, image.width());
        // b grows by all values of a on the way: by the one before the row for each byte, and by
        // each byte as often as there are bytes from it to the row's end.
        b = b.wrapping_add(a.wrapping_mul(image.width().into())).wrapping_add(weighted);
        a = a.wrapping_add(sum);
    }
    (((b % MODULUS) << 16) | (a % MODULUS)) as u32
}

/// Returns the sum of a row's bytes, and the sum of the bytes times their distance from the row's
/// end.
///
/// A change to another level adds the step to all bytes up to the end. Sums wrap around on the way,
/// but the whole ones fit: a row has no more than [`MAX_SIDE`](crate::MAX_SIDE) bytes.
#[inline]
fn row_sums(changes: &[LevelChange], width: u32) -> (u64, u64) {
    let (mut sum, mut twice_weighted, mut before) = (0u64, 0u64, 0u8);
    for change in changes {
        let step = i64::from(change.level).wrapping_sub(before.into()) as u64;
        let left = u64::from(width.wrapping_sub(change.column));
        let once = step.wrapping_mul(left);
        sum = sum.wrapping_add(once);
        // The step has distances 1 to `left` from the end, left (left + 1) / 2 in sum.
        twice_weighted = twice_weighted.wrapping_add(once.wrapping_mul(left.wrapping_add(1)));
        before = change.level;
    }
    (sum, twice_weighted / 2)
}
