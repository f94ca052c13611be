//! Reads the colors of an OBJ: of its vertices, and of the materials in other files.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use lamp_brep::Color;

use crate::marks::{FacetMarks, of_corners};
use crate::number::NumberFormat;
use crate::words::Words;

/// The greatest number of bytes of a file of materials.
const MAX_BYTES: u64 = 16 << 20;
/// The greatest number of bytes of a name that counts.
const MAX_NAME: usize = 1 << 12;

/// The colors of an OBJ read so far.
#[derive(Debug, Default)]
pub(crate) struct ObjColors {
    /// The folder of the file, if it has one.
    folder: Option<PathBuf>,
    materials: HashMap<Vec<u8>, Color>,
    /// The color of the current material.
    material: Option<Color>,
    /// The colors of the vertices; shorter than their number if none has a color from there on.
    vertices: Vec<Option<Color>>,
    facets: Vec<Option<Color>>,
    /// The files of materials that cannot be read.
    pub(crate) missing: Vec<String>,
}

impl ObjColors {
    pub(crate) fn new(folder: Option<&Path>) -> Self {
        Self { folder: folder.map(Path::to_owned), ..Self::default() }
    }

    /// Adds the color of a vertex, counted from 0: three shares from 0 to 1 after its place.
    pub(crate) fn add_vertex(&mut self, vertex: usize, shares: &[f64]) {
        let color = shares.try_into().ok().and_then(Color::of_shares);
        if color.is_some() {
            self.vertices.resize(vertex, None);
            self.vertices.push(color);
        }
    }

    /// Adds the color of a facet: of its vertices, if they agree, or else of its material.
    pub(crate) fn add_facet(&mut self, corners: [u32; 3]) {
        let of_vertex = |vertex: u32| self.vertices.get(vertex as usize).copied().flatten();
        self.facets.push(of_corners(corners.map(of_vertex)).or(self.material));
    }

    /// Begins the facets of a material.
    pub(crate) fn use_material(&mut self, name: &[u8]) {
        self.material = self.materials.get(name).copied();
    }

    /// Reads files of materials in the folder of the OBJ. A name may have blanks, or be several
    /// names. Folders of other machines, in names, do not count.
    pub(crate) fn add_materials(&mut self, names: &[u8]) {
        let names = String::from_utf8_lossy(names).into_owned();
        if self.add_file(&names) {
            return;
        }
        for name in names.split_whitespace() {
            if !self.add_file(name) {
                self.missing.push(name.to_owned());
            }
        }
    }

    fn add_file(&mut self, name: &str) -> bool {
        let Some(folder) = &self.folder else { return false };
        let name = name.rsplit(['/', '\\']).next().unwrap_or_default();
        let path = folder.join(name);
        // Opening anything else, such as a pipe, may wait for ever.
        if name.is_empty() || !path.is_file() {
            return false;
        }
        let read = File::open(path).and_then(|file| self.read(file.take(MAX_BYTES)));
        read.is_ok()
    }

    /// Reads `newmtl NAME` and `Kd r g b`. Other statements are not about colors.
    fn read(&mut self, text: impl Read) -> io::Result<()> {
        let mut words = Words::new(text)?;
        let mut material = None;
        let mut has_word = words.advance()?;
        while has_word {
            let statement = words.word().to_ascii_lowercase();
            let mut rest = Vec::new();
            loop {
                has_word = words.advance()?;
                if !has_word || words.begins_line() {
                    break;
                }
                add_word(&mut rest, words.word());
            }
            match &*statement {
                b"newmtl" => material = Some(rest),
                b"kd" => {
                    let numbers = rest.split(|&byte| byte == b' ');
                    let shares = numbers.map(|word| NumberFormat::default().parse(word).ok());
                    // A comment may follow.
                    let shares: Option<Vec<f64>> = shares.take(3).collect();
                    let shares = shares.and_then(|shares| shares.try_into().ok());
                    if let (Some(name), Some(color)) =
                        (&material, shares.and_then(Color::of_shares))
                    {
                        self.materials.insert(name.clone(), color);
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    pub(crate) fn into_marks(self) -> FacetMarks {
        FacetMarks { colors: self.facets, painted: Vec::new() }
    }
}

/// Adds a word to the words of a name, with a blank between.
pub(crate) fn add_word(name: &mut Vec<u8>, word: &[u8]) {
    if name.len() < MAX_NAME {
        if !name.is_empty() {
            name.push(b' ');
        }
        name.extend_from_slice(word);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn materials_have_names_and_colors() {
        let mut colors = ObjColors::default();
        let text = "# colors\r\nnewmtl red one\r\nKa 1 1 1\nKd 1 0.5 0 # orange\nNs 5\n\
                    newmtl b\nKd 0 0 1\nnewmtl c\nKd spectral x.rfl\nnewmtl d\nKd 1 1 7\nkd";
        colors.read(text.as_bytes()).unwrap();
        let of = |name: &str| colors.materials.get(name.as_bytes()).copied();
        let [orange, blue] = [[255, 128, 0], [0, 0, 255]].map(|levels| Some(Color(levels)));
        assert_eq!(["red one", "b", "c", "d"].map(of), [orange, blue, None, None]);
    }

    proptest! {
        #[test]
        fn any_materials_end(words in prop::collection::vec(word(), 0..60)) {
            ObjColors::default().read(words.concat().as_bytes()).unwrap();
        }
    }

    fn word() -> impl Strategy<Value = String> {
        prop_oneof![
            prop::sample::select(vec![
                "newmtl ", "kd ", "\n", "1 ", "0.5 ", "\r", "#", "\\\n", "\0"
            ])
            .prop_map(str::to_owned),
            ".{0,6}",
        ]
    }

    #[test]
    fn names_do_not_lead_out_of_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("inner");
        std::fs::create_dir(&inner).unwrap();
        let blue = "newmtl a\nKd 0 0 1\n";
        std::fs::write(folder.path().join("out.mtl"), blue).unwrap();
        std::fs::write(inner.join("my paint.mtl"), blue).unwrap();
        let read = |names: &str| {
            let mut colors = ObjColors::new(Some(&inner));
            colors.add_materials(names.as_bytes());
            (colors.materials.len(), colors.missing)
        };
        for there in ["my paint.mtl", "./my paint.mtl", "C:\\parts\\my paint.mtl"] {
            assert_eq!(read(there), (1, vec![]));
        }
        for away in ["../out.mtl", "..", ".", "gone.mtl"] {
            assert_eq!(read(away), (0, vec![away.to_owned()]));
        }
        assert_eq!(read(""), (0, vec![]));
        assert_eq!(read("a.mtl b.mtl").1.len(), 2);
    }
}
