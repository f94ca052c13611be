//! Reads ASCII STL: any number of solids, in any case, however long their lines.

use std::io::{self, BufRead, Cursor, Read, Seek, SeekFrom};

use crate::error::{AsciiFault, SliceError};
use crate::facet::Facet;
use crate::text_lines::{TextLines, without_mark};

/// More bytes than any line of a facet has.
const MAX_LINE_BYTES: usize = 4096;

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

/// Reads the facets of all solids of an ASCII file.
pub(crate) fn read(text: impl BufRead) -> Result<Vec<Facet>, SliceError> {
    let mut facets = Vec::new();
    let mut lines = TextLines::new(text, MAX_LINE_BYTES);
    while lines.advance()? {
        let is_solid = |line: &[u8]| line.len() >= 5 && line[..5].eq_ignore_ascii_case(b"solid");
        if !is_solid(without_mark(lines.line())) {
            return Err(SliceError::Ascii { facet: facets.len(), fault: AsciiFault::NoSolid });
        }
        read_solid(&mut lines, &mut facets)?;
    }
    Ok(facets)
}

fn read_solid(
    lines: &mut TextLines<impl BufRead>,
    facets: &mut Vec<Facet>,
) -> Result<(), SliceError> {
    let failed = |facet, error| SliceError::Ascii { facet, fault: AsciiFault::Line(error) };
    let mut source = PlainText::new(lines);
    let triangles =
        stl_io::create_stl_reader(&mut source).map_err(|error| failed(facets.len(), error))?;
    for triangle in triangles {
        let triangle = triangle.map_err(|error| failed(facets.len(), error))?;
        facets.push(triangle.vertices.map(|corner| corner.0));
    }
    Ok(())
}

/// A solid as stl_io reads it, line by line: in lower case, and without names, which
/// may not be UTF-8, and normals, which may be no numbers. It would refuse both, though
/// facets need neither.
struct PlainText<'a, R> {
    /// The lines behind the solid's first.
    lines: &'a mut TextLines<R>,
    line: Cursor<Vec<u8>>,
    has_begun: bool,
    has_ended: bool,
}

impl<'a, R: BufRead> PlainText<'a, R> {
    fn new(lines: &'a mut TextLines<R>) -> Self {
        Self { lines, line: Self::header(), has_begun: false, has_ended: false }
    }

    /// Returns a first line, whatever the text's is.
    fn header() -> Cursor<Vec<u8>> {
        Cursor::new(b"solid part\n".to_vec())
    }

    /// Takes the next line off the text.
    fn next_line(&mut self) -> io::Result<()> {
        self.has_begun = true;
        if self.lines.advance()? {
            let mut line = std::mem::take(&mut self.line).into_inner();
            line.clear();
            plain(self.lines.line(), &mut line);
            self.has_ended = line == END;
            self.line = Cursor::new(line);
        } else {
            self.has_ended = true;
        }
        Ok(())
    }
}

impl<R: BufRead> Read for PlainText<'_, R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        if self.line.fill_buf()?.is_empty() && !self.has_ended {
            self.next_line()?;
        }
        self.line.read(to)
    }
}

impl<R: BufRead> Seek for PlainText<'_, R> {
    /// Only to the start, as stl_io does once it knows the format from the first line.
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        if to != SeekFrom::Start(0) || self.has_begun {
            return Err(io::ErrorKind::Unsupported.into());
        }
        self.line = Self::header();
        Ok(0)
    }
}

/// The last line of a solid.
const END: &[u8] = b"endsolid\n";

/// Writes a line as stl_io reads it.
fn plain(line: &[u8], plain: &mut Vec<u8>) {
    let mut words = line.split(|&byte| byte == b' ');
    let mut is = |name: &str| words.next().is_some_and(|w| w.eq_ignore_ascii_case(name.as_bytes()));
    if line.len() >= 8 && line[..8].eq_ignore_ascii_case(b"endsolid") {
        plain.extend_from_slice(END);
    } else if is("facet") && is("normal") && words.count() == 3 {
        plain.extend_from_slice(b"facet normal 0 0 0\n");
    } else {
        plain.extend_from_slice(line);
        plain.make_ascii_lowercase();
        plain.push(b'\n');
    }
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
