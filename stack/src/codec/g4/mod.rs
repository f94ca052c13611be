//! Encodes and decodes CCITT Group 4 (T.6), and decodes Group 3 (T.4).
//!
//! Both codes describe the columns where a row changes color, which is what a
//! [`Mask`](crate::Mask) stores, so no bitmap is needed.

mod coded_row;
mod codes;
mod decode;
mod encode;
mod group3;

pub use decode::decode;
pub(crate) use decode::decode_rows;
pub use encode::encode;
pub(crate) use group3::{Group3, decode_group3_rows};

use thiserror::Error;

/// An error in decoding a T.6 or T.4 strip.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("row {row} {fault}")]
pub struct G4Error {
    /// The row that could not be decoded, from the image's top.
    pub row: u32,
    /// The fault.
    pub fault: G4Fault,
}

/// A fault in a row of T.6 or T.4 codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum G4Fault {
    /// The strip ends, or its EOFB comes, before the row is complete.
    #[error("is missing: the codes end early")]
    EndsEarly,
    /// The bits are no code (uncompressed mode is not supported).
    #[error("has bits that are not a T.6 or T.4 code")]
    NotACode,
    /// A Group 3 row lacks the end of line that other rows have.
    #[error("has no end of line before it")]
    NoEndOfLine,
    /// The image has more runs than an image may have, as in a strip made to exhaust memory.
    #[error("makes more runs than an image may have")]
    TooManyRuns,
    /// A run exceeds the width or ends before it starts.
    #[error("has a run outside the image")]
    OutsideRow,
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::image::mask::{Mask, MaskBuilder};
    use crate::testing::{arbitrary_mask, fax_decode, fax_encode, mask_of};

    /// Appends a code word.
    fn put(bits: &mut String, code: codes::Code) {
        bits.push_str(&format!("{:0width$b}", code.bits, width = code.len as usize));
    }

    fn put_run(bits: &mut String, white: bool, mut length: u32) {
        while length >= 64 {
            let units = length.min(codes::LONGEST_MAKE_UP) / 64;
            put(bits, codes::make_up(white, units));
            length -= 64 * units;
        }
        let terminating = if white { codes::TERMINATING_1 } else { codes::TERMINATING_0 };
        put(bits, terminating[length as usize]);
    }

    /// Encodes a mask with runs of length zero where `choices` put them. Rows are coded against
    /// those above as libtiff keeps them: with both ends of such runs.
    fn encode_with_empty_runs(mask: &Mask, choices: &[u8]) -> Vec<u8> {
        let width = mask.width();
        let mut bits = String::new();
        let mut choices = choices.iter().copied().cycle();
        let mut above: Vec<u32> = Vec::new();
        for row in mask.rows() {
            let mut coded: Vec<u32> = Vec::new();
            let (mut a0, mut white, mut passes, mut added) = (0, false, 0, 0);
            let mut changes = row.iter().copied().chain([width, width]).peekable();
            while a0 < width {
                let is_b1 = |&i: &usize| i % 2 == usize::from(white) && above[i] > a0;
                let i = match coded.is_empty() {
                    true => 2 * passes,
                    false => (0..above.len()).find(is_b1).unwrap_or(above.len()),
                };
                let b = |i: usize| above.get(i).copied().unwrap_or(width);
                let a1 = *changes.peek().expect("the width is left");
                let shift = i64::from(a1) - i64::from(b(i));
                match choices.next().expect("there is a choice") {
                    choice @ 0..=60 if added < 3 => {
                        added += 1;
                        let part = u32::from(choice) % (a1 - a0 + 1);
                        put(&mut bits, codes::HORIZONTAL);
                        put_run(&mut bits, white, part);
                        put_run(&mut bits, !white, 0);
                        a0 += part;
                        coded.extend([a0, a0]);
                    }
                    61..=90 if b(i) - a0 <= 3 && a1 < width => {
                        put(&mut bits, codes::VERTICAL[3 - (b(i) - a0) as usize]);
                        put(&mut bits, codes::HORIZONTAL);
                        put_run(&mut bits, !white, 0);
                        put_run(&mut bits, white, a1 - a0);
                        coded.extend([a0, a0, a1]);
                        (a0, white) = (a1, !white);
                        changes.next();
                    }
                    _ if b(i + 1) < a1 => {
                        put(&mut bits, codes::PASS);
                        a0 = b(i + 1);
                        passes += 1;
                    }
                    choice if shift.abs() <= 3 && choice < 240 => {
                        put(&mut bits, codes::VERTICAL[(shift + 3) as usize]);
                        coded.push(a1);
                        (a0, white) = (a1, !white);
                        changes.next();
                    }
                    _ => {
                        put(&mut bits, codes::HORIZONTAL);
                        for colour in [white, !white] {
                            let end = changes.next().expect("the width is there twice");
                            put_run(&mut bits, colour, end - a0);
                            coded.push(end);
                            a0 = end;
                        }
                    }
                }
            }
            coded.retain(|&column| column < width);
            above = coded;
        }
        put(&mut bits, EOFB_HALF);
        put(&mut bits, EOFB_HALF);
        let byte = |byte: &[u8]| byte.iter().fold(0, |byte, bit| byte << 1 | (bit - b'0'));
        let padded = format!("{bits}{}", "0".repeat(bits.len().wrapping_neg() % 8));
        padded.as_bytes().chunks(8).map(byte).collect()
    }

    const EOFB_HALF: codes::Code = codes::EOL;

    fn check(mask: &Mask) {
        let strip = encode(mask);
        assert_eq!(&decode(&strip, mask.width(), mask.height()).unwrap(), mask);
        if mask.width() > 0 {
            assert_eq!(&fax_decode(&strip, mask.width(), mask.height()), mask);
            assert_eq!(decode(&fax_encode(mask), mask.width(), mask.height()).unwrap(), *mask);
        }
    }

    proptest! {
        #[test]
        fn decoding_undoes_encoding_and_the_fax_crate_agrees(mask in arbitrary_mask()) {
            check(&mask);
        }

        #[test]
        fn runs_of_length_zero_change_nothing(
            mask in arbitrary_mask(),
            choices in prop::collection::vec(any::<u8>(), 1..40),
        ) {
            prop_assume!(mask.width() > 0);
            // Choices that only add runs would not end a row.
            let choices = [&choices[..], &[250]].concat();
            let strip = encode_with_empty_runs(&mask, &choices);
            prop_assert_eq!(decode(&strip, mask.width(), mask.height()), Ok(mask));
        }

        #[test]
        fn no_bytes_make_the_decoder_panic(
            strip in prop::collection::vec(any::<u8>(), 0..200),
            width in 0u32..5000,
            height in 0u32..50,
        ) {
            if let Ok(mask) = decode(&strip, width, height) {
                let rows = mask.rows().flatten().copied().collect::<Vec<_>>();
                prop_assert!(rows.iter().all(|&t| t < width));
                prop_assert_eq!(mask.height(), height);
            }
        }

        #[test]
        fn a_cut_strip_is_an_error(mask in arbitrary_mask(), part in 0.0..1.0f64) {
            // Whole bytes of the last row's codes are gone with EOFB's 3.
            let strip = encode(&mask);
            let cut = (strip.len().saturating_sub(4) as f64 * part) as usize;
            if mask.width() > 0 && mask.height() > 0 && cut + 4 < strip.len() {
                let fault = decode(&strip[..cut], mask.width(), mask.height()).unwrap_err().fault;
                prop_assert_eq!(fault, G4Fault::EndsEarly);
            }
        }
    }

    #[test]
    fn every_run_length_survives() {
        for width in [1u32, 7, 8, 9, 63, 64, 65, 1727, 1728, 2559, 2560, 2561, 2623, 2624, 8000] {
            let mut mask = MaskBuilder::new(width);
            for start in 0..width.min(3000) {
                mask.push_row(&[start]).unwrap();
                // A black row between keeps the codes horizontal.
                mask.push_black(1);
            }
            check(&mask.finish());
        }
    }

    #[test]
    fn the_widest_image_survives() {
        let width = u32::MAX;
        let row = [0, 9, 20, width - 20, width - 9, width - 1];
        let near = [0, 7, 23, width - 17, width - 10, width - 2];
        let mask = mask_of(width, [&row[..], &near, &[], &row]);
        assert_eq!(decode(&encode(&mask), width, 4).unwrap(), mask);
    }

    #[test]
    fn adversarial_rows_survive() {
        for width in [1u32, 2, 3, 31, 32, 33, 64, 2560, 2561] {
            let alternating: Vec<u32> = (0..width).collect();
            let shifted: Vec<u32> = (1..width).collect();
            let pairs: Vec<u32> = (0..width).step_by(2).collect();
            let full = vec![0];
            let rows = [&alternating, &shifted, &full, &pairs, &alternating, &vec![], &pairs];
            check(&mask_of(width, rows.iter().map(|row| row.as_slice())));
        }
    }

    #[test]
    fn a_transition_just_left_of_b1_is_not_passed_over() {
        // Behind a horizontal code, the b1 after next is left of the next one.
        let above = [0, 50, 98, 100, 120, 140, 160, 180, 200, 220];
        let row = [0, 60, 70, 97, 99, 140, 160, 180, 200, 220];
        check(&mask_of(400, [&above[..], &row]));
    }

    #[test]
    fn a_pair_of_transitions_at_one_column_counts_in_the_row_below() {
        // Rows of 64 pixels, written by hand. Pillow 13.0 with libtiff 4.7.1 reads the same rows.
        // Horizontal 0 and 0, 10 and 20, V0 at the edge; the pass steps over the empty run.
        let first = "001 00110101 0000110111 001 00111 00001101000 1";
        let passed = format!("{first} 0001 111 {}", "111".repeat(7));
        // Horizontal 8 and 0, 2 and 20, V0; V0 at 8, after which 8 is no b1 any more.
        let first = "001 10011 0000110111 001 0111 00001101000 1";
        let kept = format!("{first} {}", "1".repeat(8 * 5));
        let rows = |below: u32| (0..9).map(move |row| [if row == 0 { 10 } else { below }, 30]);
        for (bits, below) in [(passed, 10), (kept, 8)] {
            let bits = format!("{:0<128}", bits.replace(' ', ""));
            let bytes: Vec<u8> = bits
                .as_bytes()
                .chunks(8)
                .map(|byte| byte.iter().fold(0, |byte, bit| byte << 1 | (bit - b'0')))
                .collect();
            let rows: Vec<[u32; 2]> = rows(below).collect();
            let wanted = mask_of(64, rows.iter().map(|row| &row[..]));
            assert_eq!(decode(&bytes, 64, 9), Ok(wanted));
        }
    }

    #[test]
    fn a_known_page_has_known_bits() {
        // `......##` after a black row: VL2, V0 at the edge; the same again:
        // V0, V0; `#.......`: horizontal, 0 and 1, VR2 from b1 at 6; EOFB.
        let mask = Mask::new(8, vec![0, 1, 2, 4], vec![6, 6, 0, 1]).unwrap();
        let bits: String = encode(&mask).iter().map(|byte| format!("{byte:08b}")).collect();
        let expected =
            "000010 1 1 1 001 00110101 010 000011 000000000001 000000000001".replace(' ', "");
        assert!(bits.starts_with(&expected), "{bits}");
        assert!(bits[expected.len()..].chars().all(|bit| bit == '0'));
    }
}
