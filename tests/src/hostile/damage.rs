//! Damages inputs, a place at a time.

use std::ops::Range;

use lamp_fixtures::SplitMix;

/// Values at the limits of fields.
const EXTREMES: [u32; 8] = [0, 1, 0x7F, 0xFF, 0xFFFF, 1 << 26, 1 << 31, u32::MAX];
/// Replacements of a number in a text.
const NUMBERS: [&str; 10] =
    ["0", "-1", "1e308", "-1e-308", "nan", "inf", "4294967296", "1e6", "0.1", "#"];

/// Changes one place in the bytes.
pub fn damage(bytes: &mut Vec<u8>, numbers: &mut SplitMix) {
    let at = numbers.below(bytes.len() + 1);
    let rest = bytes.len() - at;
    let some = numbers.below(rest.min(60) + 1);
    match numbers.below(7) {
        0 if rest > 0 => bytes[at] ^= 1 << numbers.below(8),
        1 if rest > 0 => bytes[at] = numbers.below(256) as u8,
        2 if rest >= 4 => {
            let extreme = EXTREMES[numbers.below(EXTREMES.len())].to_le_bytes();
            bytes[at..at + 4].copy_from_slice(&extreme);
        }
        3 => drop(bytes.drain(at..at + some)),
        4 => {
            let copy = bytes[at..at + some].to_vec();
            let to = numbers.below(bytes.len() + 1);
            bytes.splice(to..to, copy);
        }
        5 => {
            let new = NUMBERS[numbers.below(NUMBERS.len())];
            bytes.splice(number_from(bytes, at), new.bytes());
        }
        _ => bytes.truncate(at),
    }
}

/// Returns the position of the next number of a text, from some position on; otherwise the end.
fn number_from(bytes: &[u8], at: usize) -> Range<usize> {
    let is_of_number = |byte: &u8| byte.is_ascii_digit() || b".-+".contains(byte);
    let next = |from: usize, wanted: bool| {
        let found = bytes[from..].iter().position(|byte| is_of_number(byte) == wanted);
        found.map_or(bytes.len(), |found| from + found)
    };
    let start = next(at, true);
    start..next(start, false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_in_texts() {
        let text = b"dpi = 72.25 # 3";
        assert_eq!([0, 7, 12, 15].map(|at| number_from(text, at)), [6..11, 7..11, 14..15, 15..15]);
    }

    #[test]
    fn damage_is_the_same_for_the_same_numbers_and_does_something() {
        let of = |seed| {
            let mut bytes = b"vertex 1.5 -2 3e5".to_vec();
            damage(&mut bytes, &mut SplitMix(seed));
            bytes
        };
        assert!((0..200).all(|seed| of(seed) == of(seed)));
        assert!((0..200).filter(|&seed| of(seed) != b"vertex 1.5 -2 3e5").count() > 150);
    }
}
