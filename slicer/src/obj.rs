//! Reads OBJ, Wavefront's text format: its vertices and faces.

use std::io::{self, Read};
use std::sync::Arc;

use crate::decimal_mesh::DecimalMesh;
use crate::error::{ObjFault, SliceError};
use crate::number::{NumberFault, NumberFormat};
use crate::obj_colors::{ObjColors, add_word};
use crate::piece::Piece;
use crate::read_note::ReadNote;
use crate::words::Words;

/// A limit above the number of corners of any real face.
const MAX_CORNERS: usize = 1 << 19;

/// First words of lines without information about the shape: normals, texture, names, groups,
/// materials and display settings.
const PASSED_OVER: [&[u8]; 30] = [
    b"vn",
    b"vt",
    b"vp",
    b"g",
    b"o",
    b"s",
    b"mg",
    b"mtllib",
    b"usemtl",
    b"newmtl",
    b"maplib",
    b"usemap",
    b"lod",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"shadow_obj",
    b"trace_obj",
    b"ka",
    b"kd",
    b"ks",
    b"ke",
    b"tf",
    b"ns",
    b"ni",
    b"d",
    b"tr",
    b"illum",
    b"map_kd",
    b"map_ka",
];

/// Reads the faces of all objects of a file, which `open` opens, as fans of facets. The facets of a
/// non-convex face overlap, but have the same sections under either fill rule.
///
/// Colors are read if `colors` returns a place for them.
///
/// Returns an error if a vertex, a face or the file cannot be read.
pub(crate) fn read<R: Read>(
    open: impl Fn() -> R,
    colors: impl Fn() -> Option<ObjColors>,
) -> Result<(Piece, Vec<ReadNote>), SliceError> {
    match ObjReader::new(open(), NumberFormat::default(), colors())?.read() {
        // Only all numbers together show the meaning of commas.
        Err(SliceError::Obj { fault: ObjFault::Comma, .. }) => {
            ObjReader::new(open(), NumberFormat::with_commas(), colors())?.read()
        }
        read => read,
    }
}

struct ObjReader<R> {
    words: Words<R>,
    numbers: NumberFormat,
    mesh: ObjMesh,
    notes: Vec<ReadNote>,
    few_corners: u64,
}

impl<R: Read> ObjReader<R> {
    fn new(text: R, numbers: NumberFormat, colors: Option<ObjColors>) -> io::Result<Self> {
        let (mesh, notes) = (ObjMesh { colors, ..ObjMesh::default() }, Vec::new());
        Ok(Self { words: Words::new(text)?, numbers, mesh, notes, few_corners: 0 })
    }

    fn read(mut self) -> Result<(Piece, Vec<ReadNote>), SliceError> {
        while self.words.advance()? {
            let line = self.words.line();
            let failed = |fault| SliceError::Obj { line, fault };
            match self.words.word() {
                [b'v' | b'V'] => self.vertex()?.map_err(failed)?,
                // `fo` is an obsolete form of `f`.
                [b'f' | b'F'] | b"fo" => self.face()?.map_err(failed)?,
                [b'#', ..] => self.words.skip_line()?,
                _ => self.other_line()?.map_err(failed)?,
            }
        }
        if self.numbers.is_ambiguous() {
            return Err(SliceError::Obj { line: self.words.line(), fault: ObjFault::Comma });
        }
        if self.numbers.has_commas {
            self.notes.push(ReadNote::DecimalCommas);
        }
        if self.few_corners > 0 {
            self.notes.push(ReadNote::FewCorners { faces: self.few_corners });
        }
        let mut piece = self.mesh.mesh.into_piece();
        if let Some(mut colors) = self.mesh.colors {
            let missing = std::mem::take(&mut colors.missing).into_iter();
            self.notes.extend(missing.map(|file| ReadNote::NoMaterials { file }));
            piece.marks = Some(Arc::new(colors.into_marks()));
        }
        Ok((piece, self.notes))
    }

    /// Moves to the next word of the current line, which a `\` at its end continues. Returns false
    /// at its end.
    #[inline]
    fn advance(&mut self) -> io::Result<bool> {
        // A `\` may also follow the last word of a line without a space.
        let continues = u64::from(self.words.word().ends_with(b"\\"));
        let mut line = self.words.line() + continues;
        loop {
            if !self.words.advance()? {
                return Ok(false);
            }
            if self.words.begins_line() && self.words.line() != line {
                self.words.hold();
                return Ok(false);
            }
            match self.words.word() {
                b"\\" => line = self.words.line() + 1,
                [b'#', ..] => {
                    self.words.skip_line()?;
                    return Ok(false);
                }
                _ => return Ok(true),
            }
        }
    }

    /// Adds `x y z`; a weight or colors may follow.
    fn vertex(&mut self) -> io::Result<Result<(), ObjFault>> {
        let mut vertex = [0.0; 3];
        for number in &mut vertex {
            let has_word = self.advance()?;
            let word = if has_word { self.words.word() } else { b"" };
            let word = word.strip_suffix(b"\\").unwrap_or(word);
            *number = match self.numbers.parse(word) {
                Ok(number) => number,
                Err(NumberFault::Comma) => return Ok(Err(ObjFault::Comma)),
                Err(NumberFault::NoNumber) => return Ok(Err(ObjFault::Number)),
            };
        }
        let number = self.mesh.mesh.vertex_count();
        self.mesh.mesh.add_vertex(vertex);
        if self.mesh.colors.is_none() {
            self.pass_over()?;
            return Ok(Ok(()));
        }
        // Of their own: commas in colors must not decide how places are read.
        let mut numbers = match self.numbers.has_commas {
            true => NumberFormat::with_commas(),
            false => NumberFormat::default(),
        };
        let mut after = Vec::new();
        while self.advance()? {
            let word = self.words.word();
            let word = word.strip_suffix(b"\\").unwrap_or(word);
            // A weight alone, or one before the colors, is no color.
            if after.len() < 4 {
                after.push(numbers.parse(word).unwrap_or(f64::NAN));
            }
        }
        if let Some(colors) = &mut self.mesh.colors {
            colors.add_vertex(number, &after);
        }
        Ok(Ok(()))
    }

    /// Adds a face of corners `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn face(&mut self) -> io::Result<Result<(), ObjFault>> {
        self.mesh.face.clear();
        while self.advance()? {
            let word = self.words.word();
            let corner = word.strip_suffix(b"\\").unwrap_or(word);
            if let Err(fault) = self.mesh.add_corner(corner) {
                return Ok(Err(fault));
            }
        }
        self.few_corners += u64::from(!self.mesh.add_face());
        Ok(Ok(()))
    }

    /// Skips a line of another kind.
    fn other_line(&mut self) -> io::Result<Result<(), ObjFault>> {
        if self.words.begins_padding() {
            let Some(bytes) = self.words.padding()? else { return Ok(Err(ObjFault::Zeros)) };
            self.notes.push(ReadNote::BytesAfter { bytes });
            return Ok(Ok(()));
        }
        let word = self.words.word().to_ascii_lowercase();
        if matches!(&*word, b"curv" | b"curv2" | b"surf") {
            return Ok(Err(ObjFault::FreeForm));
        }
        if matches!(&*word, b"usemtl" | b"mtllib") && self.mesh.colors.is_some() {
            let mut name = Vec::new();
            while self.advance()? {
                add_word(&mut name, self.words.word());
            }
            match &mut self.mesh.colors {
                Some(colors) if *word == *b"usemtl" => colors.use_material(&name),
                Some(colors) => colors.add_materials(&name),
                None => {}
            }
            return Ok(Ok(()));
        }
        if !PASSED_OVER.contains(&&*word) {
            ReadNote::count_statement(&mut self.notes, &word);
        }
        self.pass_over()?;
        Ok(Ok(()))
    }

    fn pass_over(&mut self) -> io::Result<()> {
        while self.advance()? {}
        Ok(())
    }
}

#[derive(Default)]
struct ObjMesh {
    mesh: DecimalMesh,
    /// The corners of the current face.
    face: Vec<u32>,
    /// The colors, if they are read.
    colors: Option<ObjColors>,
}

impl ObjMesh {
    fn add_corner(&mut self, corner: &[u8]) -> Result<(), ObjFault> {
        if self.face.len() == MAX_CORNERS {
            return Err(ObjFault::ManyCorners);
        }
        let number = vertex_number(corner).ok_or(ObjFault::Number)?;
        self.face.push(self.vertex(number).ok_or(ObjFault::NoVertex(number))?);
        Ok(())
    }

    /// Adds the current face. Returns false if it has fewer than three corners.
    fn add_face(&mut self) -> bool {
        let [first, others @ ..] = &self.face[..] else { return false };
        for pair in others.windows(2) {
            let corners = [*first, pair[0], pair[1]];
            self.mesh.add_facet(corners);
            if let Some(colors) = &mut self.colors {
                colors.add_facet(corners);
            }
        }
        others.len() > 1
    }

    /// Returns the index of a vertex by its number: from 1 forward, or from -1, the last vertex,
    /// backward.
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

/// Returns the number before the first `/`. Most numbers contain only digits, whose encoding need
/// not be checked.
#[inline]
fn vertex_number(corner: &[u8]) -> Option<i64> {
    let digits = corner.iter().take_while(|byte| byte.is_ascii_digit());
    let (length, number) = digits.fold((0, 0), |(length, number): (usize, i64), digit| {
        (length + 1, number.wrapping_mul(10).wrapping_add(i64::from(digit - b'0')))
    });
    // 18 digits always fit in 64 bits. A longer product may have wrapped.
    if (1..=18).contains(&length) && matches!(corner.get(length), None | Some(b'/')) {
        return Some(number);
    }
    let vertex = corner.split(|&byte| byte == b'/').next()?;
    str::from_utf8(vertex).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facet::Facet;
    use crate::piece::Facets;

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

    fn read_text(text: &str) -> Result<(Vec<Facet>, Vec<ReadNote>), String> {
        let (piece, notes) =
            read(|| text.as_bytes(), || None).map_err(|error| error.to_string())?;
        let Facets::Memory(facets) = piece.facets else { panic!("they are in memory") };
        Ok((facets.to_vec(), notes))
    }

    #[test]
    fn corners_are_found_however_they_are_written() {
        let [o, x, y, z] = CORNERS;
        let expected = vec![[o, y, x], [o, x, z], [o, z, y], [x, y, z]];
        for text in [
            TETRA.to_owned(),
            TETRA.replace('\n', "\r\n"),
            TETRA.replace('\n', "\r"),
            format!("\u{FEFF}{TETRA}"),
            TETRA.replace('\n', " # and more\n"),
            TETRA.replace(" 3/1/1", " \\\n 3/1/1"),
            TETRA.replace("1/1/1 3", "1/1/1\\\n3"),
            TETRA.replace("0 0 1\n", "0 \\\r\n0 1\n"),
            TETRA.replace("f 2 3 4", "f 2 3 4 \\\n\n"),
            TETRA.replace("0.5 0.5 0.5", "nan"),
            TETRA.replace("o tetra", "o"),
            TETRA.replace("o tetra", "g\ns off\nnewmtl a\nKd 1 1 1"),
            TETRA.replace("1 0 0 1.0", "10.0D-1 0.0d0 0 1.0"),
        ] {
            assert_eq!(read_text(&text), Ok((expected.clone(), vec![])), "{text}");
        }
    }

    #[test]
    fn faces_are_fans() {
        let [o, x, y, z] = CORNERS;
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3 4 2\n";
        assert_eq!(read_text(text).unwrap().0, [[o, x, y], [o, y, z], [o, z, x]]);
    }

    #[test]
    fn lines_that_are_left_out_are_noted() {
        for (line, note) in [
            ("f 1 2", "1 face with fewer than three corners is left out"),
            ("f 1 2\nf 3\nf", "3 faces with fewer than three corners are left out"),
            ("l 1 2 3\nl 2 3", "2 statements that begin with `l` are left out"),
            ("p 1", "1 statement that begins with `p` is left out"),
            ("\0\0\0", "3 bytes after the last facet are left out"),
        ] {
            let (facets, notes) = read_text(&format!("{TETRA}{line}\n")).unwrap();
            let notes: Vec<String> = notes.iter().map(ToString::to_string).collect();
            assert_eq!((facets.len(), notes), (4, vec![note.to_owned()]));
        }
    }

    #[test]
    fn decimal_commas_are_read_where_nothing_else_is_meant() {
        let text = TETRA.replace("v 1 0 0 1.0", "v 1,0 0,0 0").replace("0.5 ", "0,5 ");
        let (facets, notes) = read_text(&text).unwrap();
        assert_eq!((facets[3][0], notes), (CORNERS[1], vec![ReadNote::DecimalCommas]));
        assert!(read_text(&TETRA.replace("v 1 0", "v 1,000 0")).unwrap_err().contains("commas"));
    }

    #[test]
    fn a_fault_names_its_line() {
        for (line, words) in [
            ("v 1 2", "three numbers"),
            ("v 1 2 x", "three numbers"),
            ("f 1 2 9", "no vertex 9"),
            ("f 0 1 2", "no vertex 0"),
            ("f -9 1 2", "no vertex -9"),
            ("f 1 -9223372036854775808 2", "no vertex -9223372036854775808"),
            ("f 1 2 a", "three numbers"),
            ("\0\0 v 1 2 3", "NUL bytes"),
            ("surf 0 1 0 1 1 2 3 4", "free-form"),
        ] {
            let message = read_text(&format!("{TETRA}\n{line}\n")).unwrap_err();
            assert!(message.starts_with("line 16 ") && message.contains(words), "{message}");
        }
        let long = format!("{TETRA}f{}", " 1".repeat(1 << 20));
        assert!(read_text(&long).unwrap_err().contains("more than 500000 corners"));
    }
}
