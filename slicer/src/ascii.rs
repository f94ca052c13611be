//! Reads ASCII STL: any number of solids, in any case, however long their lines.

use std::io::{self, BufRead, Cursor, Read, Seek, SeekFrom};

use crate::error::{AsciiFault, SliceError};
use crate::facet::Facet;

/// Returns true if a file that starts with these bytes is ASCII STL: text that begins
/// with `solid` and goes on with a facet, or ends at once, or has a first line
/// longer than these bytes.
pub(crate) fn looks_ascii(start: &[u8], is_whole: bool) -> bool {
    let text = without_mark(start).to_ascii_lowercase();
    let holds = |word: &[u8]| text.windows(word.len()).any(|window| window == word);
    let is_text = !text.iter().any(|byte| byte.is_ascii_control() && !byte.is_ascii_whitespace());
    text.trim_ascii_start().starts_with(b"solid")
        && is_text
        && (holds(b"facet") || holds(b"endsolid") || !is_whole)
}

/// Returns a text without the byte order mark that some editors put before it.
fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text)
}

/// Reads the facets of all solids of an ASCII file.
pub(crate) fn read(text: &[u8]) -> Result<Vec<Facet>, SliceError> {
    let mut facets = Vec::new();
    let text = without_mark(text);
    // Lines of old Macintosh files end in a carriage return alone.
    let end_of_line = if text.contains(&b'\n') { b'\n' } else { b'\r' };
    let mut rest = text.trim_ascii();
    while !rest.is_empty() {
        let (solid, behind) = rest.split_at(end_of_solid(rest, end_of_line));
        read_solid(solid, end_of_line, &mut facets)?;
        rest = behind.trim_ascii_start();
    }
    Ok(facets)
}

/// Returns where the solid at the start of `text` ends: behind its `endsolid` line.
fn end_of_solid(text: &[u8], end_of_line: u8) -> usize {
    let mut end = 0;
    for line in text.split_inclusive(|&byte| byte == end_of_line) {
        end += line.len();
        let word = line.trim_ascii_start();
        if word.len() >= 8 && word[..8].eq_ignore_ascii_case(b"endsolid") {
            break;
        }
    }
    end
}

fn read_solid(text: &[u8], end_of_line: u8, facets: &mut Vec<Facet>) -> Result<(), SliceError> {
    let failed = |facet, fault| SliceError::Ascii { facet, fault };
    if text.len() < 5 || !text[..5].eq_ignore_ascii_case(b"solid") {
        return Err(failed(facets.len(), AsciiFault::NoSolid));
    }
    let end_of_header = text.iter().position(|&byte| byte == end_of_line).unwrap_or(text.len());
    let mut source = PlainText::new(&text[end_of_header..], end_of_line);
    let triangles = stl_io::create_stl_reader(&mut source)
        .map_err(|e| failed(facets.len(), AsciiFault::Line(e)))?;
    for triangle in triangles {
        let triangle = triangle.map_err(|e| failed(facets.len(), AsciiFault::Line(e)))?;
        facets.push(triangle.vertices.map(|corner| corner.0));
    }
    Ok(())
}

/// A solid as stl_io reads it, line by line: in lower case, and without names, which
/// may not be UTF-8, and normals, which may be no numbers. It would refuse both, though
/// facets need neither. No line is long, however long the text's are.
struct PlainText<'a> {
    /// All but the first line.
    body: &'a [u8],
    /// The lines still to come.
    rest: &'a [u8],
    end_of_line: u8,
    line: Cursor<Vec<u8>>,
}

/// More words than any line has, and more bytes than any number.
const MAX_WORDS: usize = 6;
const MAX_WORD_BYTES: usize = 1000;

impl<'a> PlainText<'a> {
    fn new(body: &'a [u8], end_of_line: u8) -> Self {
        Self { body, rest: body, end_of_line, line: Self::header() }
    }

    /// Returns a first line, whatever the text's is.
    fn header() -> Cursor<Vec<u8>> {
        Cursor::new(b"solid part\n".to_vec())
    }

    /// Takes the next line off the text.
    fn next_line(&mut self) {
        let end = self.rest.iter().position(|&byte| byte == self.end_of_line);
        let (line, rest) = self.rest.split_at(end.map_or(self.rest.len(), |end| end + 1));
        self.rest = rest;
        self.line = Cursor::new(plain(line));
    }
}

impl Read for PlainText<'_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        while self.line.fill_buf()?.is_empty() && !self.rest.is_empty() {
            self.next_line();
        }
        self.line.read(to)
    }
}

impl Seek for PlainText<'_> {
    /// Only to the start, as stl_io does once it knows the format.
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        if to != SeekFrom::Start(0) {
            return Err(io::ErrorKind::Unsupported.into());
        }
        self.rest = self.body;
        self.line = Self::header();
        Ok(0)
    }
}

/// Returns a line as stl_io reads it.
fn plain(line: &[u8]) -> Vec<u8> {
    let words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let words: Vec<&[u8]> = words.take(MAX_WORDS).collect();
    let is = |i: usize, name: &str| {
        words.get(i).is_some_and(|w| w.eq_ignore_ascii_case(name.as_bytes()))
    };
    if is(0, "endsolid") {
        return b"endsolid\n".to_vec();
    }
    if is(0, "facet") && is(1, "normal") && words.len() == 5 {
        return b"facet normal 0 0 0\n".to_vec();
    }
    let mut plain = Vec::new();
    for word in words {
        plain.extend_from_slice(if word.len() > MAX_WORD_BYTES { b"..." } else { word });
        plain.push(b' ');
    }
    plain.make_ascii_lowercase();
    plain.push(b'\n');
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solid(name: &str) -> String {
        format!(
            "solid{name}\n facet normal 0 0 1\n outer loop\n vertex 0 0 0\n vertex 1e0 0 0\n \
             vertex 0 1.5 -2\n endloop\n endfacet\nendsolid{name}\n"
        )
    }

    const FACET: Facet = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.5, -2.0]];

    #[test]
    fn several_solids_in_any_case_are_one_part() {
        let text = solid("") + &solid(" Two Words").to_uppercase() + "\r\n" + &solid(" c");
        assert!(looks_ascii(text.as_bytes(), true));
        assert_eq!(read(text.as_bytes()).unwrap(), [FACET; 3]);
    }

    #[test]
    fn marks_long_names_and_old_line_ends_are_read() {
        let long = solid(&format!(" {}", "a".repeat(3000)));
        for text in [format!("\u{FEFF}{}", solid("")), solid(" a").replace('\n', "\r"), long] {
            let bytes = text.as_bytes();
            assert!(looks_ascii(&bytes[..bytes.len().min(1024)], bytes.len() <= 1024));
            assert_eq!(read(bytes).unwrap(), [FACET]);
        }
    }

    #[test]
    fn a_cut_file_names_its_facet() {
        let text = solid(" a") + &solid(" b");
        let cut = &text[..text.len() - 30];
        let message = read(cut.as_bytes()).unwrap_err().to_string();
        assert!(message.starts_with("facet 1 "), "{message}");
    }

    #[test]
    fn a_refusal_is_short_however_long_the_line() {
        for bad in ["endloop\u{8}".repeat(90), "endloop ".repeat(9000), "9".repeat(9000)] {
            let text = solid(" a").replace("endloop", &bad);
            let message = read(text.as_bytes()).unwrap_err().to_string();
            assert!(message.starts_with("facet 0 ") && message.len() < 300, "{message}");
        }
    }

    #[test]
    fn other_text_is_refused() {
        assert!(!looks_ascii(b"solid state physics", true));
        assert!(!looks_ascii(b"solid facet\0", true));
        assert!(read((solid(" a") + "more").as_bytes()).is_err());
    }
}
