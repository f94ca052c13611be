//! ASCII STL.

use std::borrow::Cow;
use std::io::Cursor;

use crate::error::SliceError;
use crate::facet::Facet;

/// Whether a file that starts with these bytes is ASCII STL: text that begins
/// with `solid` and goes on with a facet, or ends at once, or has a first line
/// too long to tell.
pub(crate) fn looks_ascii(start: &[u8], is_whole: bool) -> bool {
    let text = without_mark(start).to_ascii_lowercase();
    let holds = |word: &[u8]| text.windows(word.len()).any(|window| window == word);
    let is_text = !text.iter().any(|byte| byte.is_ascii_control() && !byte.is_ascii_whitespace());
    text.trim_ascii_start().starts_with(b"solid")
        && is_text
        && (holds(b"facet") || holds(b"endsolid") || !is_whole)
}

/// Text without the byte order mark that some editors put before it.
fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text)
}

/// The facets of all solids of an ASCII file.
pub(crate) fn read(text: &[u8]) -> Result<Vec<Facet>, SliceError> {
    let mut facets = Vec::new();
    let mut text = Cow::from(without_mark(text));
    if !text.contains(&b'\n') {
        // Lines of old Macintosh files end in a carriage return alone.
        text.to_mut().iter_mut().filter(|byte| **byte == b'\r').for_each(|byte| *byte = b'\n');
    }
    let mut rest = text.trim_ascii();
    while !rest.is_empty() {
        let end = end_of_solid(rest);
        read_solid(&rest[..end], &mut facets)?;
        rest = rest[end..].trim_ascii_start();
    }
    Ok(facets)
}

/// Where the solid at the start of `text` ends: behind its `endsolid` line.
fn end_of_solid(text: &[u8]) -> usize {
    let mut end = 0;
    for line in text.split_inclusive(|&byte| byte == b'\n') {
        end += line.len();
        let word = line.trim_ascii_start();
        if word.len() >= 8 && word[..8].eq_ignore_ascii_case(b"endsolid") {
            break;
        }
    }
    end
}

fn read_solid(text: &[u8], facets: &mut Vec<Facet>) -> Result<(), SliceError> {
    let failed =
        |facet, reason: &dyn ToString| SliceError::Ascii { facet, reason: reason.to_string() };
    let (header, body) = text.split_at(text.iter().position(|&b| b == b'\n').unwrap_or(text.len()));
    if header.len() < 5 || !header[..5].eq_ignore_ascii_case(b"solid") {
        return Err(failed(facets.len(), &"a line stands where `solid` should"));
    }
    let mut plain = b"solid part".to_vec();
    body.split_inclusive(|&byte| byte == b'\n').for_each(|line| push_plain(line, &mut plain));
    let mut source = Cursor::new(plain);
    let triangles = stl_io::create_stl_reader(&mut source).map_err(|e| failed(facets.len(), &e))?;
    for triangle in triangles {
        let triangle = triangle.map_err(|e| failed(facets.len(), &e))?;
        facets.push(triangle.vertices.map(|corner| corner.0));
    }
    Ok(())
}

/// Adds a line as stl_io wants it: in lower case, and without what it would
/// refuse though nothing here needs it, names that are not UTF-8 and normals
/// that are no numbers.
fn push_plain(line: &[u8], out: &mut Vec<u8>) {
    let line = line.to_ascii_lowercase();
    let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    match (words.next(), words.next(), words.count()) {
        (Some(b"endsolid"), ..) => out.extend_from_slice(b"endsolid\n"),
        (Some(b"facet"), Some(b"normal"), 3) => out.extend_from_slice(b"facet normal 0 0 0\n"),
        _ => out.extend_from_slice(&line),
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
    fn other_text_is_refused() {
        assert!(!looks_ascii(b"solid state physics", true));
        assert!(!looks_ascii(b"solid facet\0", true));
        assert!(read((solid(" a") + "more").as_bytes()).is_err());
    }
}
