//! Reads text in UTF-8 and UTF-16 as UTF-8 without a byte order mark.

use std::io::{self, BufRead, BufReader, Cursor, Read};

/// Returns a text as UTF-8, without a leading byte order mark. Text in UTF-16 is recognized by this
/// mark, or by the zero next to its first character.
///
/// # Errors
/// Returns an error if the text cannot be read.
pub(crate) fn as_utf8<'a>(mut text: impl BufRead + 'a) -> io::Result<Box<dyn BufRead + 'a>> {
    let mut start = Vec::new();
    text.by_ref().take(3).read_to_end(&mut start)?;
    let (mark, is_big) = match start[..] {
        [0xEF, 0xBB, 0xBF] => (3, None),
        [0xFF, 0xFE, ..] => (2, Some(false)),
        [0xFE, 0xFF, ..] => (2, Some(true)),
        // Without a mark, the first character is ASCII, so one of its two bytes is zero.
        [0, first, ..] if first > 0 => (0, Some(true)),
        [first, 0, ..] if first > 0 => (0, Some(false)),
        _ => (0, None),
    };
    let text = Cursor::new(start.split_off(mark)).chain(text);
    Ok(match is_big {
        None => Box::new(text),
        Some(is_big) => {
            Box::new(BufReader::new(Utf16 { text, is_big, high: None, utf8: Cursor::default() }))
        }
    })
}

/// UTF-16 text read as UTF-8. Halves of characters become U+FFFD.
struct Utf16<R> {
    text: R,
    is_big: bool,
    /// The first half of a character whose second half follows.
    high: Option<u16>,
    /// The decoded text that has not been read yet.
    utf8: Cursor<Vec<u8>>,
}

impl<R: Read> Utf16<R> {
    fn decode(&mut self) -> io::Result<()> {
        let mut bytes = Vec::new();
        // An even number, so that no unit of two bytes is split.
        self.text.by_ref().take(1 << 13).read_to_end(&mut bytes)?;
        let is_last = bytes.is_empty();
        let unit = |pair: &[u8; 2]| match self.is_big {
            true => u16::from_be_bytes(*pair),
            false => u16::from_le_bytes(*pair),
        };
        let mut units: Vec<u16> = self.high.take().into_iter().collect();
        units.extend(bytes.as_chunks().0.iter().map(unit));
        if !is_last && units.last().is_some_and(|last| matches!(last, 0xD800..0xDC00)) {
            self.high = units.pop();
        }
        let text: String = char::decode_utf16(units)
            .map(|character| character.unwrap_or(char::REPLACEMENT_CHARACTER))
            .collect();
        self.utf8 = Cursor::new(text.into_bytes());
        Ok(())
    }
}

impl<R: Read> Read for Utf16<R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        if self.utf8.position() == self.utf8.get_ref().len() as u64 {
            self.decode()?;
            // The text may end with the first half of a character.
            if self.utf8.get_ref().is_empty() && self.high.is_some() {
                self.decode()?;
            }
        }
        self.utf8.read(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8], capacity: usize) -> String {
        let mut text = String::new();
        let bytes = BufReader::with_capacity(capacity, bytes);
        as_utf8(bytes).unwrap().read_to_string(&mut text).unwrap();
        text
    }

    /// Characters of one to four bytes, some of which cross the boundaries of decoded pieces.
    #[test]
    fn text_is_the_same_in_every_encoding() {
        let text = "a<é\u{20AC}".to_owned() + &"\u{1F600}".repeat(5_000);
        let units = |mark: bool| {
            let mark = mark.then_some(0xFEFF);
            mark.into_iter().chain(text.encode_utf16()).collect::<Vec<u16>>()
        };
        for mark in [true, false] {
            let big: Vec<u8> = units(mark).iter().flat_map(|unit| unit.to_be_bytes()).collect();
            let little: Vec<u8> = units(mark).iter().flat_map(|unit| unit.to_le_bytes()).collect();
            let utf8 = format!("{}{text}", if mark { "\u{FEFF}" } else { "" });
            for bytes in [&big[..], &little, utf8.as_bytes()] {
                for capacity in [1, 7, 8192] {
                    assert!(read(bytes, capacity) == text, "{:?}", &bytes[..4]);
                }
            }
        }
    }

    #[test]
    fn short_and_broken_texts_end() {
        assert_eq!(read(b"", 8), "");
        assert_eq!(read(b"x", 8), "x");
        assert_eq!(read(b"\xEF\xBB\xBF", 8), "");
        assert_eq!(read(b"\xFF\xFEa\0\x00\xD8", 8), "a\u{FFFD}");
        assert_eq!(read(b"\xFF\xFEa\0\x00\xD8b\0", 8), "a\u{FFFD}b");
    }
}
