//! Splits the text of a STEP file into tokens (ISO 10303-21).

use super::error::StepError;

/// A token of the text.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum StepToken {
    /// The name of an entity type or a section.
    Word(String),
    /// A reference to an entity, such as `#12`.
    Reference(u64),
    /// An integer or real number.
    Number(f64),
    /// A string, `'text'`, with doubled quotes undone.
    Text(String),
    /// An enumeration, `.T.`, without its dots.
    Enumeration(String),
    /// An omitted value, `$`.
    Omitted,
    /// A derived value, `*`.
    Derived,
    /// A delimiter: `( ) , ; =`.
    Sign(u8),
}

/// An iterator over the tokens of a STEP file.
pub(crate) struct Tokens<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Tokens<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Returns the offset of the next token, in bytes.
    pub(crate) fn offset(&self) -> usize {
        self.at
    }

    /// Returns the next token, or `None` at the end of the text.
    pub(crate) fn next(&mut self) -> Result<Option<StepToken>, StepError> {
        self.skip_blank()?;
        let Some(&byte) = self.bytes.get(self.at) else { return Ok(None) };
        let start = self.at;
        self.at += 1;
        Ok(Some(match byte {
            b'(' | b')' | b',' | b';' | b'=' => StepToken::Sign(byte),
            b'$' => StepToken::Omitted,
            b'*' => StepToken::Derived,
            b'#' => StepToken::Reference(self.number_from(self.at)?),
            b'\'' => StepToken::Text(self.text(start)?),
            // A binary value, which no geometry uses.
            b'"' => StepToken::Text(self.until(b'"', start)?),
            b'.' if self.peek_is(|b| b.is_ascii_alphabetic()) => {
                StepToken::Enumeration(self.until(b'.', start)?)
            }
            b'+' | b'-' | b'.' | b'0'..=b'9' => StepToken::Number(self.number_from(start)?),
            b'!' | b'_' | b'a'..=b'z' | b'A'..=b'Z' => {
                self.take_while(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-');
                StepToken::Word(self.slice(start).to_ascii_uppercase())
            }
            _ => return Err(StepError::Unreadable { offset: start }),
        }))
    }

    fn peek_is(&self, is: impl Fn(u8) -> bool) -> bool {
        self.bytes.get(self.at).is_some_and(|&b| is(b))
    }

    fn take_while(&mut self, is: impl Fn(u8) -> bool) {
        while self.peek_is(&is) {
            self.at += 1;
        }
    }

    fn slice(&self, start: usize) -> String {
        String::from_utf8_lossy(&self.bytes[start..self.at]).into_owned()
    }

    /// Skips spaces and comments.
    fn skip_blank(&mut self) -> Result<(), StepError> {
        loop {
            self.take_while(|b| b.is_ascii_whitespace() || b == 0);
            if !self.bytes[self.at..].starts_with(b"/*") {
                return Ok(());
            }
            let start = self.at;
            let end = self.bytes[start..].windows(2).position(|pair| pair == b"*/");
            self.at += 2 + end.ok_or(StepError::Unreadable { offset: start })?;
        }
    }

    fn until(&mut self, end: u8, start: usize) -> Result<String, StepError> {
        let from = self.at;
        self.take_while(|b| b != end);
        if self.at == self.bytes.len() {
            return Err(StepError::Unreadable { offset: start });
        }
        let text = self.slice(from);
        self.at += 1;
        Ok(text)
    }

    /// Reads a string, in which quotes are doubled.
    fn text(&mut self, start: usize) -> Result<String, StepError> {
        let mut text = self.until(b'\'', start)?;
        while self.peek_is(|b| b == b'\'') {
            self.at += 1;
            text.push('\'');
            text += &self.until(b'\'', start)?;
        }
        Ok(decoded(&text).unwrap_or(text))
    }

    fn number_from<N: std::str::FromStr>(&mut self, start: usize) -> Result<N, StepError> {
        // A sign may only come first or after an exponent's letter.
        self.take_while(|b| b.is_ascii_digit() || matches!(b, b'.' | b'E' | b'e' | b'+' | b'-'));
        let text = self.slice(start);
        text.parse().map_err(|_| StepError::Unreadable { offset: start })
    }
}

/// Returns a text whose letters beyond ASCII are written as they are, or `None` if a directive
/// is not one of ISO 10303-21 (6.4.3).
fn decoded(text: &str) -> Option<String> {
    let mut rest = text;
    let mut out = String::new();
    while let Some((before, after)) = rest.split_once('\\') {
        out += before;
        if let Some(after) = after.strip_prefix('\\') {
            out.push('\\');
            rest = after;
        } else if let Some(after) = after.strip_prefix("S\\") {
            // The second half of ISO 8859-1.
            let letter = after.chars().next()?;
            out.push(char::from(u8::try_from(letter).ok()?.checked_add(128)?));
            rest = &after[letter.len_utf8()..];
        } else if let Some(after) = after.strip_prefix("X\\") {
            out.push(char::from(u8::from_str_radix(after.get(..2)?, 16).ok()?));
            rest = &after[2..];
        } else {
            let digits = if after.starts_with("X2\\") { 4 } else { 8 };
            let after = after.strip_prefix("X2\\").or_else(|| after.strip_prefix("X4\\"))?;
            let (codes, after) = after.split_once("\\X0\\")?;
            let codes: Option<Vec<u32>> = codes
                .as_bytes()
                .chunks(digits)
                .map(|code| u32::from_str_radix(std::str::from_utf8(code).ok()?, 16).ok())
                .collect();
            if digits == 4 {
                let units: Vec<u16> = codes?.into_iter().map(|code| code as u16).collect();
                out += &String::from_utf16(&units).ok()?;
            } else {
                out.extend(codes?.into_iter().map(char::from_u32).collect::<Option<Vec<_>>>()?);
            }
            rest = after;
        }
    }
    out += rest;
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_beyond_ascii_are_decoded() {
        for (text, letters) in [
            (r"T\X2\011B\X0\leso1", Some("Těleso1")),
            (r"\X\D8 5\S\5m", Some("Ø 5µm")),
            (r"\X4\0001F600\X0\ \X2\D83DDE00\X0\", Some("\u{1F600} \u{1F600}")),
            (r"C:\\a", Some(r"C:\a")),
            (r"C:\a", None),
            (r"\X2\011", None),
        ] {
            assert_eq!(decoded(text).as_deref(), letters, "{text}");
        }
    }

    fn all(text: &str) -> Result<Vec<StepToken>, StepError> {
        let mut tokens = Tokens::new(text.as_bytes());
        let mut list = Vec::new();
        while let Some(token) = tokens.next()? {
            list.push(token);
        }
        Ok(list)
    }

    #[test]
    fn every_kind_of_token() {
        use StepToken::{Derived, Enumeration, Number, Omitted, Reference, Sign, Text, Word};
        let text = "/* #9 */ #12 = b_Spline( 'it''s; (', -1.5E-3, 3, .T., $, *,\r\n\"0F\");";
        let expected = [
            Reference(12),
            Sign(b'='),
            Word("B_SPLINE".into()),
            Sign(b'('),
            Text("it's; (".into()),
            Sign(b','),
            Number(-1.5e-3),
            Sign(b','),
            Number(3.0),
            Sign(b','),
            Enumeration("T".into()),
            Sign(b','),
            Omitted,
            Sign(b','),
            Derived,
            Sign(b','),
            Text("0F".into()),
            Sign(b')'),
            Sign(b';'),
        ];
        assert_eq!(all(text).unwrap(), expected);
    }

    #[test]
    fn what_is_cut_off_or_foreign_is_an_error_at_its_byte() {
        for (text, offset) in
            [("  'abc", 2), ("/* a", 0), ("#x", 1), ("1.2.3", 0), ("#1 = ~", 5), (" .T", 1)]
        {
            match all(text) {
                Err(StepError::Unreadable { offset: found }) => assert_eq!(found, offset, "{text}"),
                other => panic!("{text}: {other:?}"),
            }
        }
    }
}
