//! Reads the numbers of texts, as programs in all languages write them.

use std::str::FromStr;

/// The number format of a text.
#[derive(Debug, Default)]
pub(crate) struct NumberFormat {
    /// Whether commas are decimal points, as in some locales.
    pub(crate) has_commas: bool,
    /// Whether no comma can separate thousands.
    is_decimal: bool,
}

/// The reason why a word is not a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NumberFault {
    NoNumber,
    /// It is a number if commas are decimal points.
    Comma,
}

impl NumberFormat {
    /// Returns the numbers of a text with decimal commas.
    pub(crate) fn with_commas() -> Self {
        Self { has_commas: true, is_decimal: false }
    }

    /// Returns the number of a word.
    #[inline]
    pub(crate) fn parse<F: FromStr>(&mut self, word: &[u8]) -> Result<F, NumberFault> {
        // Nearly every word parses at once. Only the rest is copied and changed.
        let text = str::from_utf8(word).map_err(|_| NumberFault::NoNumber)?;
        match text.parse() {
            // A text has points or commas, not both.
            Ok(_) if self.has_commas && word.contains(&b'.') => Err(NumberFault::NoNumber),
            Ok(number) => Ok(number),
            Err(_) => self.parse_odd(text),
        }
    }

    /// Returns the number of a word with an exponent of Fortran (`1.0D+02`), a comma after it, or a
    /// comma as its decimal point.
    fn parse_odd<F: FromStr>(&mut self, text: &str) -> Result<F, NumberFault> {
        let plain = text.strip_suffix([',', ';']).unwrap_or(text).replace(['d', 'D'], "e");
        let is_plain = !(self.has_commas && plain.contains('.'));
        if let Some(number) = plain.parse().ok().filter(|_| is_plain) {
            return Ok(number);
        }
        let (whole, decimals) = plain.split_once(',').ok_or(NumberFault::NoNumber)?;
        let with_point = plain.replacen(',', ".", 1);
        let number = with_point.parse().ok().filter(|_| !plain.contains('.'));
        let number = number.ok_or(NumberFault::NoNumber)?;
        let digits = |text: &str| text.trim_start_matches(['-', '+']).to_owned();
        let decimals = decimals.split(['e', 'E']).next().unwrap_or_default();
        // 1,000 may be a thousand; 0,125, 1234,500 and 1,5 cannot.
        let whole = digits(whole);
        self.is_decimal |= decimals.len() != 3 || whole.len() > 3 || whole.starts_with('0');
        if self.has_commas { Ok(number) } else { Err(NumberFault::Comma) }
    }

    /// Returns true if the commas so far may separate thousands.
    pub(crate) fn is_ambiguous(&self) -> bool {
        self.has_commas && !self.is_decimal
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_in_many_styles() {
        for (word, number) in [
            ("1", 1.0),
            ("-.5", -0.5),
            ("+1.e2", 100.0),
            ("1.0D+02", 100.0),
            ("-2.5d-1", -0.25),
            ("3.5,", 3.5),
            ("4;", 4.0),
        ] {
            assert_eq!(NumberFormat::default().parse(word.as_bytes()), Ok(number), "{word}");
        }
        for word in ["", "x", "1.2.3", "1,2,3", "1,2.3", "1.2,3", "--1", "\u{e9}", "1e", ","] {
            let number = NumberFormat::default().parse::<f32>(word.as_bytes());
            assert_eq!(number, Err(NumberFault::NoNumber), "{word}");
        }
    }

    #[test]
    fn commas_are_points_only_if_they_must_be() {
        assert_eq!(NumberFormat::default().parse::<f32>(b"0,5"), Err(NumberFault::Comma));
        for (words, is_ambiguous) in [
            (&["1,500", "12,250", "3"][..], true),
            (&["1,500", "0,250"], false),
            (&["1,500", "-0,250"], false),
            (&["1,500", "1,5"], false),
            (&["1,500e0", "1234,250"], false),
        ] {
            let mut numbers = NumberFormat::with_commas();
            for word in words {
                let number: f64 = numbers.parse(word.as_bytes()).unwrap();
                assert_eq!(number, word.replace(',', ".").parse::<f64>().unwrap());
            }
            assert_eq!(numbers.is_ambiguous(), is_ambiguous, "{words:?}");
        }
        assert!(NumberFormat::with_commas().parse::<f32>(b"1.5").is_err());
    }
}
