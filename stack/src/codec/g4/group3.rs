//! Decodes T.4 (Group 3) codes to runs.

use super::coded_row::CodedRow;
use super::codes::EOL;
use super::decode::{CodeWordReader, decode_row};
use super::{G4Error, G4Fault};
use crate::image::mask::Mask;

/// The kinds of Group 3 coding in TIFF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Group3 {
    /// Rows of run lengths, each starting on a byte boundary (TIFF compression 2).
    ModifiedHuffman,
    /// Rows of run lengths, each after an end of line.
    OneDimensional,
    /// A bit after each end of line selects run lengths or coding against the row above.
    TwoDimensional,
}

/// Decodes a Group 3 strip of `height` rows and adds them below the rows of `mask`. T.4's white is
/// black (0).
///
/// Fill zeros before an end of line are skipped. In one-dimensional coding, the first row's end of
/// line may be missing, or every row's; any other row without one is damaged.
///
/// # Errors
/// Returns an error in the same cases as [`decode`](super::decode); damaged rows are not
/// concealed.
///
/// Sources: ITU-T Recommendation T.4, section 4; TIFF 6.0, sections 10 and 11.
pub(crate) fn decode_group3_rows(
    kind: Group3,
    strip: &[u8],
    width: u32,
    height: u32,
    max_runs: usize,
    mask: &mut Mask,
) -> Result<(), G4Error> {
    let mut rows = Group3Rows { bits: CodeWordReader::new(strip), kind, ends_of_line: false };
    let (mut above, mut row) = (CodedRow::black(width), CodedRow::black(width));
    for index in 0..height {
        let failed = |fault| G4Error { row: index, fault };
        if rows.start(index).map_err(failed)? {
            decode_row(&mut rows.bits, &above, &mut row, width).map_err(failed)?;
        } else {
            rows.runs(&mut row, width).map_err(failed)?;
        }
        row.push_to(mask);
        if mask.change_count() > max_runs {
            return Err(failed(G4Fault::TooManyRuns));
        }
        std::mem::swap(&mut above, &mut row);
    }
    Ok(())
}

struct Group3Rows<'a> {
    bits: CodeWordReader<'a>,
    kind: Group3,
    /// True if an end of line preceded the last row.
    ends_of_line: bool,
}

impl Group3Rows<'_> {
    /// Moves to the codes of row `index` and returns whether they refer to the row above.
    fn start(&mut self, index: u32) -> Result<bool, G4Fault> {
        // TIFF 6.0, section 10: rows have no ends of line, and begin at a byte.
        if self.kind == Group3::ModifiedHuffman {
            return self.bits.align().map(|()| false);
        }
        let found = self.end_of_line()?;
        let expected = self.ends_of_line || self.kind == Group3::TwoDimensional;
        // From the second row on, either all rows have an end of line or none has.
        if (expected && !found) || (index > 1 && found != self.ends_of_line) {
            return Err(G4Fault::NoEndOfLine);
        }
        self.ends_of_line = found;
        if self.kind == Group3::OneDimensional {
            return Ok(false);
        }
        // A tag bit of 1 announces run lengths, 0 codes against the row above (T.4, section 4.2).
        let tag = self.bits.peek(1);
        self.bits.take(1)?;
        Ok(tag == 0)
    }

    /// Takes an end of line with the fill zeros before it, if it comes next. No other code
    /// starts with eleven zeros.
    fn end_of_line(&mut self) -> Result<bool, G4Fault> {
        if self.bits.peek(EOL.len - 1) != 0 {
            return Ok(false);
        }
        self.bits.take(EOL.len as u8 - 1)?;
        while self.bits.peek(1) == 0 {
            self.bits.take(1)?;
        }
        self.bits.take(1)?;
        Ok(true)
    }

    /// Decodes a row of run lengths, black (T.4's white) first.
    fn runs(&mut self, row: &mut CodedRow, width: u32) -> Result<(), G4Fault> {
        row.clear();
        let (mut column, mut white) = (0, false);
        while column < width {
            column += self.bits.run(white, width - column)?;
            row.toggle(column, width);
            white = !white;
        }
        row.end(width);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::codes::{Code, LONGEST_MAKE_UP, TERMINATING_0, TERMINATING_1, make_up};
    use super::*;
    use crate::testing::{arbitrary_mask, mask_of};

    const KINDS: [Group3; 3] =
        [Group3::ModifiedHuffman, Group3::OneDimensional, Group3::TwoDimensional];

    fn digits(code: Code) -> String {
        format!("{:0width$b}", code.bits, width = code.len as usize)
    }

    fn coded_runs(row: &[u32], width: u32) -> String {
        let ends = row.iter().copied().chain([width]);
        let starts = [0].into_iter().chain(row.iter().copied());
        let mut bits = String::new();
        for (start, (end, white)) in starts.zip(ends.zip([false, true].into_iter().cycle())) {
            let mut length = end - start;
            while length >= 64 {
                let part = length.min(LONGEST_MAKE_UP) / 64;
                bits += &digits(make_up(white, part));
                length -= 64 * part;
            }
            let terminating = if white { TERMINATING_1 } else { TERMINATING_0 };
            bits += &digits(terminating[length as usize]);
        }
        bits
    }

    /// Returns the two-dimensional code of a row: the T.6 code of both rows without the code of
    /// the row above.
    fn coded_against(above: &[u32], row: &[u32], width: u32) -> String {
        let bits = |rows: &[&[u32]]| -> String {
            let strip = super::super::encode(&mask_of(width, rows.iter().copied()));
            let bits: String = strip.iter().map(|byte| format!("{byte:08b}")).collect();
            bits[..bits.rfind(&digits(EOL).repeat(2)).unwrap()].to_owned()
        };
        bits(&[above, row])[bits(&[above]).len()..].to_owned()
    }

    /// The options of a strip's coding besides its kind.
    #[derive(Clone, Copy, Debug, Default)]
    struct Style {
        /// Fill bits make each end of line end on a byte boundary.
        fill: bool,
        /// One row of every `k` is coded as run lengths.
        k: u32,
        /// The end of line follows each row, so that none precedes the first row.
        behind: bool,
    }

    fn encode(mask: &Mask, kind: Group3, style: Style) -> Vec<u8> {
        let mut bits = String::new();
        let mut above: &[u32] = &[];
        for (index, row) in (0..).zip(mask.rows()) {
            if kind == Group3::ModifiedHuffman {
                bits += &"0".repeat(bits.len().next_multiple_of(8) - bits.len());
            } else if index > 0 || !style.behind {
                let fill = (bits.len() + 12).next_multiple_of(8) - bits.len() - 12;
                bits += &"0".repeat(if style.fill { fill } else { 0 });
                bits += &digits(EOL);
            }
            if kind == Group3::TwoDimensional && index % style.k != 0 {
                bits += &format!("0{}", coded_against(above, row, mask.width()));
            } else {
                bits += if kind == Group3::TwoDimensional { "1" } else { "" };
                bits += &coded_runs(row, mask.width());
            }
            above = row;
        }
        let bytes = bits.as_bytes().chunks(8);
        bytes
            .map(|byte| {
                byte.iter().rev().zip(0..).fold(0, |b, (&d, i)| b | (d - b'0') << i)
                    << (8 - byte.len())
            })
            .collect()
    }

    fn decode(strip: &[u8], kind: Group3, width: u32, height: u32) -> Result<Mask, G4Error> {
        let mut mask = Mask::without_rows(width);
        decode_group3_rows(kind, strip, width, height, crate::MAX_RUNS, &mut mask)?;
        Ok(mask)
    }

    fn check(mask: &Mask, style: Style) {
        for kind in KINDS {
            let style = Style { behind: style.behind && kind == Group3::OneDimensional, ..style };
            let strip = encode(mask, kind, style);
            let decoded = decode(&strip, kind, mask.width(), mask.height());
            assert_eq!(decoded.as_ref(), Ok(mask), "{kind:?} {style:?}");
        }
    }

    proptest! {
        #[test]
        fn decoding_undoes_encoding(
            mask in arbitrary_mask(),
            fill in any::<bool>(),
            k in 1u32..5,
            behind in any::<bool>(),
        ) {
            prop_assume!(mask.width() > 0);
            check(&mask, Style { fill, k, behind });
        }

        #[test]
        fn no_bytes_make_the_decoder_panic(
            strip in prop::collection::vec(any::<u8>(), 0..200),
            width in 1u32..5000,
            height in 0u32..50,
        ) {
            for kind in KINDS {
                if let Ok(mask) = decode(&strip, kind, width, height) {
                    prop_assert_eq!(mask.height(), height);
                }
            }
        }

        #[test]
        fn a_flipped_bit_is_an_error_or_another_image_of_the_same_size(
            mask in arbitrary_mask(),
            place in 0.0..1.0f64,
        ) {
            prop_assume!(mask.width() > 0 && mask.height() > 0);
            for kind in KINDS {
                let mut strip = encode(&mask, kind, Style { k: 2, ..Style::default() });
                let bit = (strip.len() as f64 * 8.0 * place) as usize;
                strip[bit / 8] ^= 0x80 >> (bit % 8);
                match decode(&strip, kind, mask.width(), mask.height()) {
                    Ok(decoded) => prop_assert_eq!(decoded.height(), mask.height()),
                    Err(error) => prop_assert!(error.row < mask.height()),
                }
            }
        }

        #[test]
        fn a_cut_strip_is_an_error_in_a_row_that_is_not_whole(
            mask in arbitrary_mask(),
            part in 0.0..1.0f64,
        ) {
            prop_assume!(mask.width() > 0 && mask.height() > 0);
            for kind in KINDS {
                let strip = encode(&mask, kind, Style { k: 2, ..Style::default() });
                let cut = (strip.len() as f64 * part) as usize;
                let error = decode(&strip[..cut], kind, mask.width(), mask.height()).unwrap_err();
                prop_assert_eq!(error.fault, G4Fault::EndsEarly);
                let whole = decode(&strip[..cut], kind, mask.width(), error.row).unwrap();
                prop_assert!(whole.rows().eq(mask.rows().take(error.row as usize)));
            }
        }
    }

    #[test]
    fn every_run_length_survives() {
        for width in [1, 63, 64, 65, 1728, 2559, 2560, 2561, 2623, 2624, 8000] {
            let starts: Vec<u32> = (0..width).collect();
            let mask = mask_of(width, starts.chunks(1));
            check(&mask, Style { k: 3, ..Style::default() });
        }
    }

    #[test]
    fn rows_without_any_end_of_line_are_read() {
        let rows: [&[u32]; 3] = [&[1, 5], &[], &[0, 7]];
        let bits: String = rows.iter().map(|row| coded_runs(row, 8)).collect();
        let strip = u64::from_str_radix(&format!("{bits:0<64}"), 2).unwrap().to_be_bytes();
        assert_eq!(decode(&strip, Group3::OneDimensional, 8, 3), Ok(mask_of(8, rows)));
    }

    #[test]
    fn a_row_that_loses_its_end_of_line_is_named() {
        let rows: [&[u32]; 4] = [&[1, 5], &[], &[0, 7], &[3]];
        let eol = digits(EOL);
        let mut bits: Vec<String> =
            rows.iter().map(|row| format!("{eol}{}", coded_runs(row, 8))).collect();
        bits[2] = coded_runs(rows[2], 8);
        let bits = format!("{:0<128}", bits.concat());
        let strip = u128::from_str_radix(&bits, 2).unwrap().to_be_bytes();
        let error = decode(&strip, Group3::OneDimensional, 8, 4).unwrap_err();
        assert_eq!(error, G4Error { row: 2, fault: G4Fault::NoEndOfLine });
        let error = decode(&strip[2..], Group3::TwoDimensional, 8, 4).unwrap_err();
        assert_eq!(error, G4Error { row: 0, fault: G4Fault::NoEndOfLine });
    }

    #[test]
    fn an_end_of_page_before_the_last_row_is_named() {
        // Six ends of lines end a page.
        let bits = format!("{:0<96}", digits(EOL).repeat(6));
        let strip = u128::from_str_radix(&bits, 2).unwrap().to_be_bytes();
        let error = decode(&strip[4..], Group3::OneDimensional, 8, 1).unwrap_err();
        assert_eq!(error, G4Error { row: 0, fault: G4Fault::EndsEarly });
    }
}
