//! Reads text as bytes, however its characters are coded.

use std::io::{self, Cursor, Read};

/// Reads a text's bytes, in UTF-8 or any code that contains ASCII: without a mark of the order of
/// bytes, and in UTF-16 each character that ASCII lacks as `?`.
///
/// UTF-16 is recognized by its mark, or by the zeros in its first two characters.
#[derive(Debug)]
pub struct PlainText<R> {
    text: io::Chain<Cursor<Vec<u8>>, R>,
    /// Where the byte of an ASCII character is in its two bytes, in UTF-16.
    ascii_byte: Option<usize>,
    /// The first byte of a character whose second is not read yet.
    half: Option<u8>,
}

impl<R: Read> PlainText<R> {
    /// Reads the first bytes, which say how the text is coded.
    ///
    /// # Errors
    /// Returns an error if they cannot be read.
    pub fn new(mut text: R) -> io::Result<Self> {
        let mut start = Vec::new();
        // Four bytes hold the longest mark, or two characters of UTF-16.
        text.by_ref().take(4).read_to_end(&mut start)?;
        let (mark, ascii_byte) = match *start {
            [0xEF, 0xBB, 0xBF, ..] => (3, None),
            [0xFF, 0xFE, ..] => (2, Some(0)),
            [0xFE, 0xFF, ..] => (2, Some(1)),
            [1..=0x7F, 0, 1..=0x7F, 0] => (0, Some(0)),
            [0, 1..=0x7F, 0, 1..=0x7F] => (0, Some(1)),
            _ => (0, None),
        };
        let text = Cursor::new(start.split_off(mark)).chain(text);
        Ok(Self { text, ascii_byte, half: None })
    }
}

impl<R: Read> Read for PlainText<R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let Some(ascii_byte) = self.ascii_byte else { return self.text.read(to) };
        let mut pairs = [0; 8192];
        loop {
            let held = usize::from(self.half.is_some());
            pairs[0] = self.half.unwrap_or_default();
            // No more pairs than bytes that are wanted: decoded bytes are kept nowhere.
            let room = pairs.len().min(2 * to.len());
            let read = self.text.read(&mut pairs[held..room])?;
            let (whole, rest) = pairs[..held + read].as_chunks::<2>();
            // At the end, half a character is left out.
            self.half = rest.first().copied().filter(|_| read > 0);
            for (to, pair) in to.iter_mut().zip(whole) {
                *to = match [pair[1 - ascii_byte], pair[ascii_byte]] {
                    [0, byte] if byte.is_ascii() => byte,
                    // Programs that join texts leave marks within them.
                    [0xFE, 0xFF] => b' ',
                    _ => b'?',
                };
            }
            // No bytes would mean the end, so half a character waits for its other half.
            if read == 0 || !whole.is_empty() || to.is_empty() {
                return Ok(whole.len());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gives one byte at a time.
    struct Slow<'a>(&'a [u8]);

    impl Read for Slow<'_> {
        fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
            let length = to.len().min(1);
            self.0.read(&mut to[..length])
        }
    }

    #[test]
    fn text_is_the_same_however_it_is_coded() {
        let text = "solid B\u{fc}rste\r\n".repeat(3000);
        let plain = text.replace('\u{fc}', "?");
        for mark in ["", "\u{feff}"] {
            let units: Vec<u16> = format!("{mark}{text}").encode_utf16().collect();
            let little: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
            let big: Vec<u8> = units.iter().flat_map(|unit| unit.to_be_bytes()).collect();
            for coded in [little, big] {
                for text in [&mut &coded[..] as &mut dyn Read, &mut Slow(&coded)] {
                    let mut read = String::new();
                    PlainText::new(text).unwrap().read_to_string(&mut read).unwrap();
                    assert!(read == plain, "{read}");
                }
            }
            let mut read = String::new();
            let coded = format!("{mark}{text}");
            PlainText::new(coded.as_bytes()).unwrap().read_to_string(&mut read).unwrap();
            assert!(read == text);
        }
    }

    #[test]
    fn bytes_that_are_no_text_stay() {
        for bytes in [&b""[..], b"\0", b"s\0", &[0; 9], b"\xFF", b"a\0\0\0"] {
            let mut read = Vec::new();
            PlainText::new(bytes).unwrap().read_to_end(&mut read).unwrap();
            assert_eq!(read, bytes);
        }
        // Half a character at the end does not count.
        let mut read = Vec::new();
        PlainText::new(&b"a\0b\0c"[..]).unwrap().read_to_end(&mut read).unwrap();
        assert_eq!(read, b"ab");
    }
}
