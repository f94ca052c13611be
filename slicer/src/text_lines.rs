//! Reads text as lines of words, in memory that no line can exceed.

use std::io::{self, BufRead};

/// Text, line by line. Lines end in line feeds, carriage returns (as old Macintosh files
/// have them) or both; blank ones are left out, and one blank stands between words.
#[derive(Debug)]
pub(crate) struct TextLines<R> {
    text: R,
    max_bytes: usize,
    line: Vec<u8>,
    number: u64,
    ended: u64,
    is_cut: bool,
    after_return: bool,
}

impl<R: BufRead> TextLines<R> {
    /// Reads lines of which at most `max_bytes` are kept.
    pub(crate) fn new(text: R, max_bytes: usize) -> Self {
        let line = Vec::new();
        Self { text, max_bytes, line, number: 0, ended: 0, is_cut: false, after_return: false }
    }

    /// Moves to the next line that is not blank. Returns false if there is none.
    pub(crate) fn advance(&mut self) -> io::Result<bool> {
        self.line.clear();
        self.is_cut = false;
        let mut is_behind_blank = false;
        loop {
            self.number = self.ended + 1;
            let bytes = match self.text.fill_buf() {
                Ok([]) => return Ok(!self.line.is_empty()),
                Ok(bytes) => bytes,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(error),
            };
            let end = bytes.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
            let (line, rest) = bytes.split_at(end.unwrap_or(bytes.len()));
            for &byte in line {
                if self.line.len() >= self.max_bytes {
                    self.is_cut = true;
                    break;
                }
                if byte.is_ascii_whitespace() {
                    is_behind_blank = true;
                    continue;
                }
                if std::mem::take(&mut is_behind_blank) && !self.line.is_empty() {
                    self.line.push(b' ');
                }
                self.line.push(byte);
            }
            let is_return = rest.first() == Some(&b'\r');
            let is_second_half = end == Some(0) && self.after_return && !is_return;
            if end.is_some() || !line.is_empty() {
                self.after_return = is_return;
            }
            self.ended += u64::from(end.is_some() && !is_second_half);
            let used = line.len() + usize::from(end.is_some());
            self.text.consume(used);
            if end.is_some() && !self.line.is_empty() {
                return Ok(true);
            }
        }
    }

    /// Returns the line: words with one blank between.
    pub(crate) fn line(&self) -> &[u8] {
        &self.line
    }

    /// Returns the words of the line.
    pub(crate) fn words(&self) -> impl Iterator<Item = &[u8]> + Clone {
        self.line.split(|&byte| byte == b' ')
    }

    /// Returns the number of the line, from 1.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// Returns true if the line was longer than what was kept of it.
    pub(crate) fn is_cut(&self) -> bool {
        self.is_cut
    }
}

/// Returns a text without the byte order mark that some editors put before it.
pub(crate) fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text)
}

#[cfg(test)]
mod tests {
    use std::io::BufReader;

    use super::*;

    #[test]
    fn lines_are_the_same_however_they_end_and_are_read() {
        for end in ["\n", "\r\n", "\r"] {
            let text = ["a  b", "", " \tc ", "d"].join(end);
            for capacity in [1, 2, 3, 100] {
                let reader = BufReader::with_capacity(capacity, text.as_bytes());
                let mut lines = TextLines::new(reader, 100);
                let mut found = Vec::new();
                while lines.advance().unwrap() {
                    found
                        .push((lines.number(), String::from_utf8_lossy(lines.line()).into_owned()));
                }
                let expected = [(1, "a b"), (3, "c"), (4, "d")];
                assert_eq!(found, expected.map(|(number, line)| (number, line.to_owned())));
            }
        }
    }

    #[test]
    fn long_lines_are_cut() {
        let text = "abcdef\nabc";
        let mut lines = TextLines::new(text.as_bytes(), 3);
        assert!(lines.advance().unwrap() && lines.is_cut() && lines.line() == b"abc");
        assert!(lines.advance().unwrap() && !lines.is_cut() && lines.line() == b"abc");
        assert!(!lines.advance().unwrap());
    }
}
