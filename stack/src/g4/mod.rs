//! Encodes and decodes CCITT Group 4 (T.6), and decodes Group 3 (T.4).
//!
//! Both codes describe the columns where a row changes colour, which is what a
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
    #[error("has bits that are no T.6 or T.4 code")]
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
    use crate::mask::{Mask, MaskBuilder};
    use crate::testing::{arbitrary_mask, fax_decode, fax_encode, mask_of};

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
