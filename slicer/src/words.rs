//! Reads text word by word, with bounded memory for any text.

use std::io::{self, Read};
use std::ops::Range;

use lamp_stack::PlainText;

/// The number of bytes read at once.
const READ_BYTES: usize = 1 << 16;
/// A limit above the length of any number or keyword. Longer words come in pieces.
const MAX_WORD_BYTES: usize = 1 << 12;

/// The words of a text, one at a time. Lines end in line feeds, carriage returns (as in old
/// Macintosh files) or both.
#[derive(Debug)]
pub(crate) struct Words<R> {
    text: PlainText<R>,
    buffer: Vec<u8>,
    /// The bytes of the buffer that were read but are not part of a word yet.
    unread: Range<usize>,
    word: Range<usize>,
    line: u64,
    begins_line: bool,
    after_return: bool,
    is_held: bool,
    is_over: bool,
}

impl<R: Read> Words<R> {
    /// Reads the words of a text, in any encoding that [`PlainText`] supports.
    pub(crate) fn new(text: R) -> io::Result<Self> {
        Ok(Self {
            text: PlainText::new(text)?,
            buffer: vec![0; READ_BYTES],
            unread: 0..0,
            word: 0..0,
            line: 1,
            begins_line: true,
            after_return: false,
            is_held: false,
            is_over: false,
        })
    }

    /// Moves to the next word. Returns false, with an empty word, at the end of the text.
    pub(crate) fn advance(&mut self) -> io::Result<bool> {
        if std::mem::take(&mut self.is_held) {
            return Ok(!self.word.is_empty());
        }
        // No line end precedes the first word of a text.
        self.begins_line = self.word.is_empty() && self.line == 1;
        self.word = self.unread.start..self.unread.start;
        self.skip_blanks()?;
        let mut length = 0;
        loop {
            let bytes = &self.buffer[self.unread.start + length..self.unread.end];
            match bytes.iter().position(u8::is_ascii_whitespace) {
                Some(end) => {
                    length += end;
                    break;
                }
                None => length += bytes.len(),
            }
            // A file without blanks must not become a single word in memory.
            if length >= MAX_WORD_BYTES || !self.fill()? {
                break;
            }
        }
        let length = length.min(MAX_WORD_BYTES);
        self.word = self.unread.start..self.unread.start + length;
        self.unread.start += length;
        Ok(length > 0)
    }

    /// Keeps the word, so that it comes next again.
    pub(crate) fn hold(&mut self) {
        self.is_held = true;
    }

    /// Returns the word.
    pub(crate) fn word(&self) -> &[u8] {
        &self.buffer[self.word.clone()]
    }

    /// Returns true if the word is the first of its line.
    pub(crate) fn begins_line(&self) -> bool {
        self.begins_line
    }

    /// Returns true if nothing follows the word, not even the end of its line.
    pub(crate) fn ends_text(&self) -> bool {
        self.is_over && self.unread.is_empty()
    }

    /// Returns the number of the word's line, from 1.
    pub(crate) fn line(&self) -> u64 {
        self.line
    }

    /// Moves past the last word of the line.
    pub(crate) fn skip_line(&mut self) -> io::Result<()> {
        while self.advance()? {
            if self.begins_line {
                self.hold();
                break;
            }
        }
        Ok(())
    }

    /// Returns true if the word begins with a zero or a Ctrl-Z. Some programs pad files with these
    /// bytes.
    pub(crate) fn begins_padding(&self) -> bool {
        matches!(self.word(), [0 | 0x1A, ..])
    }

    /// Moves past all such bytes and returns their number, or `None` if words follow.
    pub(crate) fn padding(&mut self) -> io::Result<Option<u64>> {
        let mut bytes = 0;
        while self.word().iter().all(|byte| matches!(byte, 0 | 0x1A)) {
            bytes += self.word().len() as u64;
            if !self.advance()? {
                return Ok(Some(bytes));
            }
        }
        Ok(None)
    }

    fn skip_blanks(&mut self) -> io::Result<()> {
        loop {
            for at in self.unread.clone() {
                let byte = self.buffer[at];
                if !byte.is_ascii_whitespace() {
                    self.unread.start = at;
                    return Ok(());
                }
                if matches!(byte, b'\n' | b'\r') {
                    // A line feed after a carriage return ends the same line.
                    self.line += u64::from(byte == b'\r' || !self.after_return);
                    self.begins_line = true;
                }
                self.after_return = byte == b'\r';
            }
            self.unread = 0..0;
            if !self.fill()? {
                return Ok(());
            }
        }
    }

    /// Reads further bytes after the unread ones, which move to the buffer's start. Returns false
    /// if the file has no more bytes.
    fn fill(&mut self) -> io::Result<bool> {
        self.buffer.copy_within(self.unread.clone(), 0);
        self.unread = 0..self.unread.len();
        while !self.is_over {
            match self.text.read(&mut self.buffer[self.unread.end..]) {
                Ok(read) => {
                    self.is_over = read == 0;
                    self.unread.end += read;
                    return Ok(read > 0);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns at most a given number of bytes at a time.
    struct Slow<'a>(&'a [u8], usize);

    impl Read for Slow<'_> {
        fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
            let length = to.len().min(self.1);
            self.0.read(&mut to[..length])
        }
    }

    fn found(text: impl Read) -> Vec<(u64, bool, String)> {
        let mut words = Words::new(text).unwrap();
        let mut found = Vec::new();
        while words.advance().unwrap() {
            let word = String::from_utf8_lossy(words.word()).into_owned();
            found.push((words.line(), words.begins_line(), word));
        }
        assert!(!words.advance().unwrap() && words.word().is_empty());
        found
    }

    #[test]
    fn words_know_their_lines_however_these_end() {
        for end in ["\n", "\r\n", "\r"] {
            let text = [" a  b", "", "\tc ", "d"].join(end);
            for at_once in [1, 2, 3, 100] {
                let expected = [(1, true, "a"), (1, false, "b"), (3, true, "c"), (4, true, "d")];
                let expected = expected.map(|(line, begins, word)| (line, begins, word.to_owned()));
                assert_eq!(found(Slow(text.as_bytes(), at_once)), expected, "{text:?}");
            }
        }
    }

    #[test]
    fn a_text_is_the_same_at_the_ends_of_the_buffer() {
        let words: Vec<String> = (0..60_000).map(|k| "x".repeat(k % 7 + 1)).collect();
        let text = words.join(" ");
        let found = found(text.as_bytes());
        assert!(found.iter().map(|(.., word)| word).eq(&words));
    }

    #[test]
    fn a_held_word_comes_again_and_lines_are_skipped() {
        let mut words = Words::new(&b"a b\nc"[..]).unwrap();
        words.advance().unwrap();
        words.hold();
        assert!(words.advance().unwrap() && words.word() == b"a" && !words.ends_text());
        words.skip_line().unwrap();
        assert!(words.advance().unwrap() && words.word() == b"c" && words.ends_text());
        words.skip_line().unwrap();
        assert!(!words.advance().unwrap());
    }

    #[test]
    fn long_words_come_in_pieces() {
        let found = found(&[b'a'; 3 * MAX_WORD_BYTES / 2][..]);
        let lengths: Vec<_> = found.iter().map(|(_, begins, word)| (*begins, word.len())).collect();
        assert_eq!(lengths, [(true, MAX_WORD_BYTES), (false, MAX_WORD_BYTES / 2)]);
    }
}
