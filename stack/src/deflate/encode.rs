//! Writes runs.

use super::bits::{BitWriter, MOST_PUT};
use super::huffman::{code_lengths, codes};
use super::{
    END_OF_BLOCK, LENGTH_ORDER, MOST_BITS, MOST_COPIED, MOST_LENGTH_BITS, SYMBOLS, copies_of,
};
use crate::gray::GrayMask;

/// The number of runs in a block: enough that its codes take a hundredth of it.
const BLOCK_RUNS: usize = 1 << 14;
/// A zlib stream of Deflate with a window of 32 KiB, at the usual level.
const ZLIB_HEADER: [u8; 2] = [0x78, 0x9C];

/// Encodes a gray mask as a zlib stream of its bytes, row by row.
pub(crate) fn encode(image: &GrayMask) -> Vec<u8> {
    let runs = byte_runs(image);
    let mut out = BitWriter::after(ZLIB_HEADER.to_vec());
    let blocks = runs.len().div_ceil(BLOCK_RUNS).max(1);
    for block in 0..blocks {
        let runs = &runs[block * BLOCK_RUNS..runs.len().min((block + 1) * BLOCK_RUNS)];
        put_block(&mut out, runs, block + 1 == blocks);
    }
    let mut bytes = out.finish();
    bytes.extend_from_slice(&adler32(&runs).to_be_bytes());
    bytes
}

/// Returns the runs `(length, byte)` of all rows; they go on from row to row.
fn byte_runs(image: &GrayMask) -> Vec<(u32, u8)> {
    let mut runs = ByteRuns::with_room(image.change_count() + image.height() as usize + 1);
    for (row, changes) in (0..).zip(image.rows()) {
        let start = row * u64::from(image.width());
        if changes.first().is_none_or(|first| first.column > 0) {
            runs.change_at(start, 0);
        }
        for change in changes {
            runs.change_at(start + u64::from(change.column), change.level);
        }
    }
    runs.end_at(u64::from(image.width()) * u64::from(image.height()));
    runs.runs
}

/// Runs that are made from the first pixel on.
struct ByteRuns {
    runs: Vec<(u32, u8)>,
    /// The byte of the run that has begun, and its first pixel.
    byte: u8,
    since: u64,
}

impl ByteRuns {
    fn with_room(runs: usize) -> Self {
        Self { runs: Vec::with_capacity(runs), byte: 0, since: 0 }
    }

    #[inline]
    fn change_at(&mut self, pixel: u64, byte: u8) {
        if byte != self.byte {
            self.end_at(pixel);
            (self.byte, self.since) = (byte, pixel);
        }
    }

    #[inline]
    fn end_at(&mut self, pixel: u64) {
        let mut length = pixel - self.since;
        // A run of a huge image is cut where its length would not fit.
        while length > u64::from(u32::MAX) {
            self.runs.push((u32::MAX, self.byte));
            length -= u64::from(u32::MAX);
        }
        if length > 0 {
            self.runs.push((length as u32, self.byte));
        }
    }
}

/// A run as it is written: bytes, then copies of the last.
struct Copies {
    /// The number of bytes that are written as such: one, or up to three if no copy is left.
    bytes: u32,
    longest: u32,
    /// The length of a last copy that is shorter than the longest, or zero.
    last: u32,
}

impl Copies {
    #[inline]
    fn of(length: u32) -> Self {
        let (longest, last) = ((length - 1) / MOST_COPIED, (length - 1) % MOST_COPIED);
        // No copy is shorter than three.
        let bytes = if last < 3 { 1 + last } else { 1 };
        Self { bytes, longest, last: if last < 3 { 0 } else { last } }
    }
}

fn put_block(out: &mut BitWriter, runs: &[(u32, u8)], is_last: bool) {
    let lengths = code_lengths(&frequencies(runs), MOST_BITS);
    let codes = codes(&lengths);
    out.put(u32::from(is_last).into(), 1);
    // Codes of its own.
    out.put(2, 2);
    put_lengths(out, &lengths);
    let code = |symbol: usize| Bits { bits: codes[symbol].into(), count: lengths[symbol] };
    // Once, twice and thrice: at most 45 bits.
    let once: [Bits; 256] = std::array::from_fn(code);
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
        let copies = Copies::of(length);
        let first = bytes[copies.bytes as usize - 1][usize::from(byte)];
        let last = last[copies.last as usize];
        let bits = first.count + last.count;
        if u64::from(longest.once) * u64::from(copies.longest) + u64::from(bits) <= MOST_PUT.into()
        {
            let all = first.then(longest.times(copies.longest)).then(last);
            out.put(all.bits, all.count);
        } else {
            out.put(first.bits, first.count);
            longest.put(out, copies.longest);
            out.put(last.bits, last.count);
        }
    }
    let end = code(END_OF_BLOCK.into());
    out.put(end.bits, end.count);
}

/// Returns how often each symbol occurs in a block.
fn frequencies(runs: &[(u32, u8)]) -> [u32; SYMBOLS] {
    let (mut bytes, mut last, mut longest) = ([0; 256], [0; MOST_COPIED as usize], 0);
    for &(length, byte) in runs {
        let copies = Copies::of(length);
        bytes[usize::from(byte)] += copies.bytes;
        last[copies.last as usize] += 1;
        longest += u64::from(copies.longest);
    }
    let mut frequencies = [0; SYMBOLS];
    frequencies[..256].copy_from_slice(&bytes);
    frequencies[usize::from(END_OF_BLOCK)] = 1;
    for (length, times) in (0..).zip(last).skip(3) {
        frequencies[usize::from(length_symbol(length))] += times;
    }
    // A block of one colour may count beyond 32 bits; codes need no more than the order.
    let longest = longest + u64::from(frequencies[SYMBOLS - 1]);
    frequencies[SYMBOLS - 1] = longest.try_into().unwrap_or(u32::MAX);
    frequencies
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
        Self { bits: self.bits | next.bits << self.count, count: self.count + next.count }
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

    /// Returns the bits so many times, at most `most`.
    #[inline]
    fn times(&self, times: u32) -> Bits {
        let count = self.once * times as u8;
        Bits { bits: self.all & ((1 << count) - 1), count }
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
    if length > 0 {
        tokens.push((length, 0, 0));
        count -= 1;
    }
    while count > 0 {
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

/// Returns the Adler-32 check of bytes, in a few operations a run.
fn adler32(runs: &[(u32, u8)]) -> u32 {
    const MODULUS: u64 = 65_521;
    // So few short runs at a time overflow no sum.
    const SHORT: u32 = 1 << 16;
    let (mut a, mut b) = (1, 0);
    for some in runs.chunks(64) {
        for &(length, byte) in some {
            let (mut length, byte) = (u64::from(length), u64::from(byte));
            if length > u64::from(SHORT) {
                // b grows by the sum of a + byte, a + 2 byte, ..., and that of MODULUS bytes is 0.
                (a, b, length) = (a % MODULUS, b % MODULUS, length % MODULUS);
            }
            b += length * a + length * (length + 1) / 2 * byte;
            a += length * byte;
        }
        (a, b) = (a % MODULUS, b % MODULUS);
    }
    (b << 16 | a) as u32
}
