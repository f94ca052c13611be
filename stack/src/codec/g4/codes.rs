//! Defines the code words of T.6 and T.4.

/// A code word: its bits, right-aligned, and their number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Code {
    pub(super) bits: u32,
    pub(super) len: u32,
}

impl Code {
    /// Returns both codes as one, at most 32 bits long.
    #[inline]
    pub(super) fn then(self, next: Self) -> Self {
        Self { bits: self.bits << next.len | next.bits, len: self.len + next.len }
    }
}

/// Parses code words in the recommendations' notation, separated by white space.
const fn codes<const N: usize>(digits: &str) -> [Code; N] {
    let digits = digits.as_bytes();
    let mut table = [Code { bits: 0, len: 0 }; N];
    let (mut code, mut i) = (0, 0);
    while i < digits.len() {
        if let b'0' | b'1' = digits[i] {
            table[code].bits = table[code].bits << 1 | (digits[i] - b'0') as u32;
            table[code].len += 1;
        } else if table[code].len > 0 && code + 1 < N {
            // White space behind the last code begins none.
            code += 1;
        }
        i += 1;
    }
    table
}

const fn code(digits: &str) -> Code {
    codes::<1>(digits)[0]
}

// T.6, table 1.
pub(super) const PASS: Code = code("0001");
pub(super) const HORIZONTAL: Code = code("001");
/// T.4's end of line. Two of these end a T.6 page (EOFB).
pub(super) const EOL: Code = code("000000000001");

/// Vertical codes by `a1 - b1 + 3`: VL3 to VR3.
pub(super) const VERTICAL: [Code; 7] = codes("0000010 000010 010 1 011 000011 0000011");

// T.4, table 2, for both colors.
/// Terminating codes of runs of 0 bits (T.4's white), lengths 0 to 63.
pub(super) const TERMINATING_0: [Code; 64] = codes(
    "
    00110101 000111 0111 1000 1011 1100 1110 1111 10011 10100 00111 01000 001000 000011 110100
    110101 101010 101011 0100111 0001100 0001000 0010111 0000011 0000100 0101000 0101011
    0010011 0100100 0011000 00000010 00000011 00011010 00011011 00010010 00010011 00010100
    00010101 00010110 00010111 00101000 00101001 00101010 00101011 00101100 00101101 00000100
    00000101 00001010 00001011 01010010 01010011 01010100 01010101 00100100 00100101 01011000
    01011001 01011010 01011011 01001010 01001011 00110010 00110011 00110100
    ",
);

/// Terminating codes of runs of 1 bits (T.4's black), lengths 0 to 63.
pub(super) const TERMINATING_1: [Code; 64] = codes(
    "
    0000110111 010 11 10 011 0011 0010 00011 000101 000100 0000100 0000101 0000111 00000100
    00000111 000011000 0000010111 0000011000 0000001000 00001100111 00001101000 00001101100
    00000110111 00000101000 00000010111 00000011000 000011001010 000011001011 000011001100
    000011001101 000001101000 000001101001 000001101010 000001101011 000011010010 000011010011
    000011010100 000011010101 000011010110 000011010111 000001101100 000001101101 000011011010
    000011011011 000001010100 000001010101 000001010110 000001010111 000001100100 000001100101
    000001010010 000001010011 000000100100 000000110111 000000111000 000000100111 000000101000
    000001011000 000001011001 000000101011 000000101100 000001011010 000001100110 000001100111
    ",
);

// T.4, table 3a, for both colors.
/// Make-up codes of runs of 0 bits, lengths 64, 128, ... 1728.
pub(super) const MAKE_UP_0: [Code; 27] = codes(
    "
    11011 10010 010111 0110111 00110110 00110111 01100100 01100101 01101000 01100111 011001100
    011001101 011010010 011010011 011010100 011010101 011010110 011010111 011011000 011011001
    011011010 011011011 010011000 010011001 010011010 011000 010011011
    ",
);

/// Make-up codes of runs of 1 bits, lengths 64, 128, ... 1728.
pub(super) const MAKE_UP_1: [Code; 27] = codes(
    "
    0000001111 000011001000 000011001001 000001011011 000000110011 000000110100 000000110101
    0000001101100 0000001101101 0000001001010 0000001001011 0000001001100 0000001001101
    0000001110010 0000001110011 0000001110100 0000001110101 0000001110110 0000001110111
    0000001010010 0000001010011 0000001010100 0000001010101 0000001011010 0000001011011
    0000001100100 0000001100101
    ",
);

// T.4, table 3b.
/// Make-up codes of both colors, lengths 1792, 1856, ... 2560.
pub(super) const MAKE_UP_LONG: [Code; 13] = codes(
    "
    00000001000 00000001100 00000001101 000000010010 000000010011 000000010100 000000010101
    000000010110 000000010111 000000011100 000000011101 000000011110 000000011111
    ",
);

/// The longest run that one make-up code encodes.
pub(super) const LONGEST_MAKE_UP: u32 = 2560;

/// Returns the make-up code of a run of `64 * units` pixels, `units` from 1 to 40.
pub(super) fn make_up(white: bool, units: u32) -> Code {
    match (units as usize, white) {
        // From 1792 pixels on, both colors share their codes.
        (28.., _) => MAKE_UP_LONG[units as usize - 28],
        (units, false) => MAKE_UP_0[units - 1],
        (units, true) => MAKE_UP_1[units - 1],
    }
}
