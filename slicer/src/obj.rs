//! Reads OBJ: the vertices and faces of Wavefront's text format.

use std::io::BufRead;

use crate::decimal_mesh::DecimalMesh;
use crate::error::{ObjFault, SliceError};
use crate::part::Piece;
use crate::text_lines::{TextLines, without_mark};

/// A face of a hundred thousand corners takes this much.
const MAX_LINE_BYTES: usize = 1 << 20;

/// First words of the lines that begin files.
const FIRST_WORDS: [&str; 12] =
    ["v", "vn", "vt", "vp", "f", "o", "g", "s", "l", "p", "mtllib", "usemtl"];

/// Returns true if a file that starts with these bytes is OBJ: text whose first line
/// that is no comment is one of the format's.
pub(crate) fn looks_obj(start: &[u8]) -> bool {
    let is_text = |byte: &u8| !byte.is_ascii_control() || byte.is_ascii_whitespace();
    let mut lines = TextLines::new(without_mark(start), MAX_LINE_BYTES);
    let mut has_lines = false;
    while let Ok(true) = lines.advance() {
        has_lines = true;
        let mut words = lines.words();
        let first = words.next().unwrap_or_default();
        if !first.starts_with(b"#") {
            let is_known = FIRST_WORDS.iter().any(|word| word.as_bytes() == first);
            return is_known && words.next().is_some() && start.iter().all(is_text);
        }
    }
    has_lines && start.iter().all(is_text)
}

/// Reads the faces of all objects, as fans of facets. A face that is not convex has
/// facets that overlap, but the same sections by either rule of filling.
pub(crate) fn read(text: impl BufRead) -> Result<Piece, SliceError> {
    let mut lines = TextLines::new(text, MAX_LINE_BYTES);
    let mut mesh = ObjMesh::default();
    while lines.advance()? {
        let failed = |fault| SliceError::Obj { line: lines.number(), fault };
        let is_first = lines.number() == 1;
        let line = if is_first { without_mark(lines.line()) } else { lines.line() };
        let (keyword, values) =
            line.split_at(line.iter().position(|b| *b == b' ').unwrap_or(line.len()));
        let added = match keyword {
            b"v" | b"f" if lines.is_cut() => Err(ObjFault::LongLine),
            b"v" => mesh.add_vertex(values),
            b"f" => mesh.add_face(values),
            b"curv" | b"curv2" | b"surf" => Err(ObjFault::FreeForm),
            _ => Ok(()),
        };
        added.map_err(failed)?;
    }
    Ok(mesh.mesh.into_piece())
}

#[derive(Default)]
struct ObjMesh {
    mesh: DecimalMesh,
    /// The corners of the face at hand.
    face: Vec<u32>,
}

impl ObjMesh {
    /// Adds `x y z`; a weight or colours may follow.
    fn add_vertex(&mut self, values: &[u8]) -> Result<(), ObjFault> {
        let text = str::from_utf8(values).map_err(|_| ObjFault::Number)?;
        let mut numbers = text.split_whitespace().map(str::parse);
        let mut number = || numbers.next().and_then(Result::ok).ok_or(ObjFault::Number);
        self.mesh.add_vertex([number()?, number()?, number()?]);
        Ok(())
    }

    /// Adds a face of corners `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn add_face(&mut self, values: &[u8]) -> Result<(), ObjFault> {
        self.face.clear();
        for corner in values.split(|&byte| byte == b' ').filter(|corner| !corner.is_empty()) {
            let vertex = corner.split(|&byte| byte == b'/').next().unwrap_or_default();
            let number = str::from_utf8(vertex).ok().and_then(|text| text.parse().ok());
            let number: i64 = number.ok_or(ObjFault::Number)?;
            let vertex = self.vertex(number).ok_or(ObjFault::NoVertex(number))?;
            self.face.push(vertex);
        }
        let [first, others @ ..] = &self.face[..] else { return Err(ObjFault::FewCorners) };
        if others.len() < 2 {
            return Err(ObjFault::FewCorners);
        }
        others.windows(2).for_each(|pair| self.mesh.add_facet([*first, pair[0], pair[1]]));
        Ok(())
    }

    /// Returns the index of a vertex by its number, from 1; or from -1, the last one, backwards.
    fn vertex(&self, number: i64) -> Option<u32> {
        let count = self.mesh.vertex_count();
        let index = if number < 0 {
            count.checked_sub(number.unsigned_abs().try_into().ok()?)?
        } else {
            usize::try_from(number).ok()?.checked_sub(1)?
        };
        u32::try_from(index).ok().filter(|_| index < count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facet::Facet;
    use crate::part::Facets;

    fn read_facets(text: &str) -> Vec<Facet> {
        match read(text.as_bytes()).unwrap().facets {
            Facets::Memory(facets) => facets.to_vec(),
            _ => panic!("text is read into memory"),
        }
    }

    const TETRA: &str = "\
# a tetrahedron
mtllib none.mtl
o tetra
v 0 0 0
v 1 0 0 1.0
v 0 1 0 0.5 0.5 0.5
v 0 0 1
vt 0 0
vn 0 0 1
usemtl none
f 1/1/1 3/1/1 2/1/1
f 1//1 2//1 4//1
f -4 -1 -2
f 2 3 4
";

    const CORNERS: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn corners_are_found_however_they_are_named() {
        let [o, x, y, z] = CORNERS;
        let expected = [[o, y, x], [o, x, z], [o, z, y], [x, y, z]];
        for text in [TETRA.to_owned(), TETRA.replace('\n', "\r\n"), format!("\u{FEFF}{TETRA}")] {
            assert!(looks_obj(text.as_bytes()));
            assert_eq!(read_facets(&text), expected);
        }
    }

    #[test]
    fn faces_are_fans() {
        let [o, x, y, z] = CORNERS;
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3 4 2\n";
        assert_eq!(read_facets(text), [[o, x, y], [o, y, z], [o, z, x]]);
    }

    #[test]
    fn a_fault_names_its_line() {
        for (line, words) in [
            ("v 1 2", "three numbers"),
            ("v 1 2 x", "three numbers"),
            ("f 1 2", "fewer than three"),
            ("f", "fewer than three"),
            ("f 1 2 9", "no vertex 9"),
            ("f 0 1 2", "no vertex 0"),
            ("f -9 1 2", "no vertex -9"),
            ("f 1 -9223372036854775808 2", "no vertex -9223372036854775808"),
            ("f 1 2 a", "three numbers"),
            ("surf 0 1 0 1 1 2 3 4", "free-form"),
        ] {
            let message = read(format!("{TETRA}\n{line}\n").as_bytes()).unwrap_err().to_string();
            assert!(message.starts_with("line 16 ") && message.contains(words), "{message}");
        }
        let long = format!("{TETRA}f{}", " 1".repeat(1 << 20));
        assert!(read(long.as_bytes()).unwrap_err().to_string().contains("longer than"));
    }

    #[test]
    fn other_text_is_no_obj() {
        for text in ["", "s", "solid part\nfacet", "v\0", "value 1 2 3", "{\"v\": 1}"] {
            assert!(!looks_obj(text.as_bytes()), "{text}");
        }
    }
}
