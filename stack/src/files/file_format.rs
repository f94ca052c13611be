//! Names the format of a file by how it begins.

use std::fmt;
use std::io::Read;

use crate::codec::packed;
use crate::codec::picture_format::PictureFormat;
use crate::plain_text::PlainText;

/// The bytes at a file's start that [`FileFormat::of_start`] looks at.
pub const FORMAT_BYTES: usize = 4096;

/// The format of a file, as far as its first bytes say. As text it is its name with an article,
/// as `a PLY file`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FileFormat {
    /// A part that is read.
    Part(PartFormat),
    /// Pages of a stack that are read.
    Layers(&'static str),
    /// A model of a format that is not read.
    Model(&'static str),
    /// A drawing, a document, a program or a table.
    Document(&'static str),
    /// A file of packed files, or a packed file.
    Archive(&'static str),
    /// Orders for a printer, which a part has become already.
    PrintJob(&'static str),
    /// The page that a web server sends in place of a file.
    WebPage,
    /// A few lines that stand for a file, as Git LFS writes them.
    Pointer(&'static str),
    /// Text of no format that is known.
    Text,
}

/// A format of parts that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartFormat {
    /// Facets as bytes.
    BinaryStl,
    /// Facets as words.
    AsciiStl,
    /// Vertices and faces as words.
    Obj,
    /// Solids in exact surfaces.
    Step,
    /// Contours of layers in the Common Layer Interface.
    Cli,
    /// Contours of layers, or a flat drawing, in XML.
    Svg,
    /// Contours of layers, or a flat drawing, of AutoCAD as text.
    Dxf,
    /// A layout of masks.
    Gdsii,
    /// A layer of a circuit board, which is a mask.
    Gerber,
    /// A ZIP package, which may be a 3MF.
    Zip,
    /// A part in one of these formats, packed by gzip.
    Gzip,
}

impl FileFormat {
    /// A model in the Initial Graphics Exchange Specification, which a build with OpenCASCADE reads.
    pub const IGES: Self = Self::Model("an IGES file");
}

impl fmt::Display for FileFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Part(PartFormat::BinaryStl | PartFormat::AsciiStl) => "an STL file",
            Self::Part(PartFormat::Obj) => "an OBJ file",
            Self::Part(PartFormat::Step) => "a STEP file",
            Self::Part(PartFormat::Cli) => "a CLI file",
            Self::Part(PartFormat::Svg) => "an SVG file",
            Self::Part(PartFormat::Dxf) => "a DXF file",
            Self::Part(PartFormat::Gdsii) => "a GDSII file",
            Self::Part(PartFormat::Gerber) => "a Gerber file",
            Self::Part(PartFormat::Zip) => "a ZIP archive",
            Self::Part(PartFormat::Gzip) => "a file packed with gzip",
            Self::Layers(name)
            | Self::Model(name)
            | Self::Document(name)
            | Self::Archive(name)
            | Self::PrintJob(name)
            | Self::Pointer(name) => name,
            Self::WebPage => "a web page",
            Self::Text => "a text file",
        })
    }
}

use FileFormat::{Archive, Document, Layers, Model, Pointer, PrintJob, WebPage};

/// First bytes that no other format has.
const SIGNATURES: &[(&[u8], FileFormat)] = &[
    (b"\x1F\x8B", FileFormat::Part(PartFormat::Gzip)),
    (b"PK\x03\x04", FileFormat::Part(PartFormat::Zip)),
    (b"$$HEADERSTART", FileFormat::Part(PartFormat::Cli)),
    (b"\0\x06\0\x02", FileFormat::Part(PartFormat::Gdsii)),
    (b"PK\x05\x06", Archive("an empty ZIP archive")),
    (b"II*\0", Layers("a TIFF file")),
    (b"II+\0", Layers("a TIFF file")),
    (b"MM\0*", Layers("a TIFF file")),
    (b"MM\0+", Layers("a TIFF file")),
    (b"\x89PNG", Layers("a PNG file")),
    (&packed::SIGNATURE, Layers("a packed stack")),
    (b"LAMPFRM1", PrintJob("a file of frames (lamp frames)")),
    (b"%PDF", Document("a PDF file")),
    (b"%!PS", Document("a PostScript file")),
    (b"8BPS", Document("a Photoshop file")),
    (b"\x7FELF", Document("a program")),
    (b"MZ\x90\0", Document("a program")),
    (b"SQLite format 3\0", Document("a database")),
    (b"bplist00", Document("a property list")),
    (b"\0\x05\x16\x07", Document("a companion file (._name) of macOS")),
    (b"\xFD7zXZ\0", Archive("a file packed with xz")),
    (b"\x28\xB5\x2F\xFD", Archive("a file packed with Zstandard")),
    (b"\x04\x22\x4D\x18", Archive("a file packed with LZ4")),
    (b"BZh", Archive("a file packed with bzip2")),
    (b"\x1F\x9D", Archive("a file packed with compress")),
    (b"7z\xBC\xAF\x27\x1C", Archive("a 7z archive")),
    (b"Rar!\x1A\x07", Archive("a RAR archive")),
    (b"MSCF\0\0\0\0", Archive("a CAB archive")),
    (b"\x4C\0\0\0\x01\x14\x02\0", Pointer("a Windows shortcut")),
    (b"\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1", Model("a SolidWorks, Inventor or other OLE file")),
    (b"ACIS BinaryFile", Model("a SAB file (ACIS)")),
    (b"ASM BinaryFile", Model("a SAB file (ACIS)")),
    (b"glTF", Model("a glTF file")),
    (b"Kaydara FBX Binary", Model("an FBX file")),
    (b"; FBX", Model("an FBX file")),
    (b"BLENDER", Model("a Blender file")),
    (b"AC10", Model("a DWG file")),
    (b"AutoCAD Binary DXF", Model("a binary DXF file")),
    (b"V5_CFV2", Model("a CATIA file")),
    (b"CATIA", Model("a CATIA file")),
    (b"#UGC:2", Model("a Creo file")),
    (b"3D Geometry File Format", Model("a Rhino file")),
    (b"#VRML", Model("a VRML file")),
    (b"#Inventor V", Model("an Open Inventor file")),
    (b"xof 0", Model("a DirectX file")),
    (b"PRC\0", Model("a PRC file")),
    (b"U3D\0", Model("a U3D file")),
    (b"DRACO", Model("a Draco file")),
    (b"\x19\0\xFD\x12", PrintJob("a CTB or Photon file of a resin printer")),
    (b"\x86\0\xFD\x12", PrintJob("a CTB file of a resin printer")),
    (b"\x07\x01\xFD\x12", PrintJob("a CTB file of a resin printer")),
    (b"ANYCUBIC\0", PrintJob("a Photon file of a resin printer")),
    (b"V3.0\x07\0\0\0DLP\0", Layers("a GOO file of a resin printer")),
];

/// First words of texts, in small letters.
const FIRST_WORDS: &[(&str, FileFormat)] = &[
    ("ply", Model("a PLY file")),
    ("off", Model("an OFF file")),
    ("coff", Model("an OFF file")),
    ("noff", Model("an OFF file")),
    ("dbrep_drawableshape", Model("a BREP file of OpenCASCADE")),
    ("cascade", Model("a BREP file of OpenCASCADE")),
    ("meshversionformatted", Model("a Medit file")),
    ("$meshformat", Model("a Gmsh file")),
    ("[internetshortcut]", Pointer("a web shortcut")),
    ("outs:", Pointer("a DVC pointer")),
    ("mime-version:", WebPage),
    ("{\\rtf1", Document("an RTF file")),
    ("dn:", Document("a directory entry")),
];

/// Words in the first lines of texts, in small letters.
const PHRASES: &[(&str, FileFormat)] = &[
    ("version https://git-lfs", Pointer("a Git LFS pointer")),
    ("version https://hawser", Pointer("a Git LFS pointer")),
    ("version http://git-media", Pointer("a Git LFS pointer")),
    ("annex/objects/", Pointer("a git-annex pointer")),
    ("**abcdefghijklmnopqrstuvwxyz", Model("a Parasolid file")),
    (": transmit file", Model("a Parasolid file")),
    ("asmheader", Model("a SAT file (ACIS)")),
    ("acis ", Model("a SAT file (ACIS)")),
];

/// The bytes that [`PHRASES`] are looked for in.
const PHRASE_BYTES: usize = 400;

/// Roots of XML, in small letters.
const XML_ROOTS: &[(&str, FileFormat)] = &[
    ("html", WebPage),
    ("amf", Model("an AMF file")),
    ("x3d", Model("an X3D file")),
    ("collada", Model("a COLLADA file")),
    ("model", Model("the model of a 3MF file without its package")),
    ("svg", FileFormat::Part(PartFormat::Svg)),
    ("xmc", Model("an XML file of Parasolid")),
    ("document", Model("an XML file of a CAD program")),
];

/// First words of lines of an OBJ, in small letters.
const OBJ_WORDS: &[&str] = &[
    "v",
    "vn",
    "vt",
    "vp",
    "f",
    "o",
    "g",
    "s",
    "l",
    "p",
    "mg",
    "mtllib",
    "usemtl",
    "newmtl",
    "maplib",
    "usemap",
    "lod",
    "cstype",
    "deg",
    "bevel",
    "call",
    "shadow_obj",
];

impl FileFormat {
    /// Returns the format of a file that starts with these bytes, of which [`FORMAT_BYTES`] or
    /// all are enough; `size` is the file's if it is known. `None` if it is not known.
    ///
    /// A file whose size matches the number of facets in its header is a binary STL, whatever its
    /// header contains.
    pub fn of_start(start: &[u8], size: Option<u64>) -> Option<Self> {
        if size.is_some_and(|size| is_counted(start, size)) {
            return Some(Self::Part(PartFormat::BinaryStl));
        }
        let signature = SIGNATURES.iter().find(|(bytes, _)| start.starts_with(bytes));
        let format = signature.map(|(_, format)| *format);
        format.or_else(|| of_bytes(start, size)).or_else(|| of_text(start, size))
    }
}

/// Returns true if a file has the size of the facets that its header counts.
fn is_counted(start: &[u8], size: u64) -> bool {
    // The range has four bytes, as many as the array.
    let count = start.get(80..84).map(|count| u32::from_le_bytes(count.try_into().unwrap()));
    // A binary STL has a header of 80 bytes, the count, and 50 bytes a facet.
    count.is_some_and(|count| 84 + 50 * u64::from(count) == size)
}

/// Returns the format of bytes that have more than a signature.
fn of_bytes(start: &[u8], size: Option<u64>) -> Option<FileFormat> {
    let has = |at: usize, bytes: &[u8]| start.get(at..).is_some_and(|it| it.starts_with(bytes));
    let length = |at: usize| Some(u32::from_le_bytes(start.get(at..at + 4)?.try_into().ok()?));
    // Their signatures are short, and may begin a text.
    let is_picture = match PictureFormat::of_start(start) {
        // A BMP has four reserved bytes, zero, behind its size.
        Some(PictureFormat::Bmp) => has(6, &[0; 4]),
        Some(PictureFormat::WebP) => has(8, b"WEBP"),
        _ => true,
    };
    let picture = PictureFormat::of_start(start).filter(|_| is_picture);
    Some(match picture {
        Some(PictureFormat::Bmp) => Layers("a BMP file"),
        Some(PictureFormat::Gif) => Layers("a GIF file"),
        Some(PictureFormat::Jpeg) => Layers("a JPEG file"),
        Some(PictureFormat::Pnm) => Layers("a PNM file"),
        Some(PictureFormat::WebP) => Layers("a WebP file"),
        // A 3DS file is one chunk, which states its own length.
        None if has(0, b"MM") && length(2).map(u64::from) == size => Model("a 3DS file"),
        None if has(0, b"FORM") && (has(8, b"LWO2") || has(8, b"LWOB")) => {
            Model("a LightWave file")
        }
        None if has(0, b"Version ") && has_words(&start[..start.len().min(80)], b" JT") => {
            Model("a JT file")
        }
        None if has(0, b"PS") && has_words(&start[..start.len().min(99)], b": TRANSMIT FILE") => {
            Model("a Parasolid file")
        }
        None if has(257, b"ustar") => Archive("a tar archive"),
        // Its numbers may be binary.
        None if has(0, b"ply\n") || has(0, b"ply\r") => Model("a PLY file"),
        None => return None,
    })
}

fn has_words(text: &[u8], words: &[u8]) -> bool {
    text.windows(words.len()).any(|window| window == words)
}

/// Returns the format of a text; `None` of other bytes.
fn of_text(start: &[u8], size: Option<u64>) -> Option<FileFormat> {
    let is_whole = size.is_none_or(|size| size == start.len() as u64);
    let mut text = Vec::new();
    PlainText::new(start).ok()?.read_to_end(&mut text).ok()?;
    text.make_ascii_lowercase();
    // Zeros and 0x1A, the end of texts in CP/M and DOS, pad some files.
    let padding = |byte: &u8| matches!(byte, 0 | 0x1A) || byte.is_ascii_whitespace();
    let has_zeros = text.contains(&0);
    let Some(last) = text.iter().rposition(|byte| !padding(byte)) else {
        // Blank lines are no header.
        return (!has_zeros && !text.is_empty()).then_some(FileFormat::Text);
    };
    let end = last + 1;
    let text = &text[..end];
    if text.iter().any(|byte| byte.is_ascii_control() && !byte.is_ascii_whitespace()) {
        return None;
    }
    // Text behind a signature may name any program, as STEP and STL headers do.
    let signed = || of_part(text, is_whole).filter(|format| is_signed(*format));
    let of_format = of_xml(text).or_else(signed);
    let of_format = of_format.or_else(|| of_phrases(text)).or_else(|| of_columns(text));
    let of_format = of_format.or_else(|| of_part(text, is_whole)).or_else(|| of_lines(text));
    // The header of a binary file that was cut off may be text, too.
    of_format.or((!has_zeros).then_some(FileFormat::Text))
}

/// Returns whether a part begins with a word that no other format begins with.
fn is_signed(format: FileFormat) -> bool {
    matches!(format, FileFormat::Part(PartFormat::Step | PartFormat::AsciiStl | PartFormat::Gerber))
}

fn of_phrases(text: &[u8]) -> Option<FileFormat> {
    let first = words(text).next()?;
    let is_first = |(word, _): &&(&str, FileFormat)| match *word {
        "cascade" => first.starts_with(b"cascade") || first.starts_with(b"casecade"),
        word => word.as_bytes() == first,
    };
    let is_there = |(phrase, _): &&(&str, FileFormat)| {
        has_words(&text[..text.len().min(PHRASE_BYTES)], phrase.as_bytes())
    };
    let found = FIRST_WORDS.iter().find(is_first);
    found.or_else(|| PHRASES.iter().find(is_there)).map(|(_, format)| *format)
}

fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// Returns the lines that are neither blank nor a comment, without the blanks before them.
fn lines(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    let lines = text.split(|byte| matches!(byte, b'\n' | b'\r')).map(<[u8]>::trim_ascii);
    let is_comment = |line: &[u8]| line.starts_with(b"#") || line.starts_with(b"//");
    lines.filter(move |line| !line.is_empty() && !is_comment(line))
}

/// Returns the format of a text by its root, if it is XML.
fn of_xml(text: &[u8]) -> Option<FileFormat> {
    let mut rest = text.trim_ascii_start();
    if !rest.starts_with(b"<") || rest.starts_with(b"<<") {
        return None;
    }
    if has_words(text, b"<html") || has_words(text, b"<!doctype html") {
        return Some(WebPage);
    }
    let behind = |text: &'_ [u8], end: &[u8]| {
        text.windows(end.len()).position(|window| window == end).map(|at| at + end.len())
    };
    loop {
        let end: &[u8] = match rest {
            [b'<', b'?', ..] => b"?>",
            [b'<', b'!', b'-', b'-', ..] => b"-->",
            [b'<', b'!', ..] => b">",
            _ => break,
        };
        let Some(at) = behind(rest, end) else { return Some(Document("an XML file")) };
        rest = rest[at..].trim_ascii_start();
    }
    let name = rest.get(1..).unwrap_or_default();
    let name = name.split(|&byte| !byte.is_ascii_alphanumeric() && byte != b':').next()?;
    let name = name.rsplit(|&byte| byte == b':').next()?;
    let of_root = XML_ROOTS.iter().find(|(root, _)| root.as_bytes() == name);
    let is_page = ["head", "body", "div", "title", "meta", "script", "center", "h1", "error"];
    Some(match of_root {
        Some((_, format)) => *format,
        None if is_page.iter().any(|root| root.as_bytes() == name) => WebPage,
        None => Document("an XML file"),
    })
}

/// Returns the format of a text that has it in certain columns or lines.
fn of_columns(text: &[u8]) -> Option<FileFormat> {
    let begun = text.trim_ascii_start();
    let number = |word: &[u8]| !word.is_empty() && word.iter().all(u8::is_ascii_digit);
    // Lines of IGES have their section's letter in column 73, then a number.
    if text.get(72) == Some(&b's') && text.get(73..80).is_some_and(|it| number(it.trim_ascii())) {
        return Some(FileFormat::IGES);
    }
    let mut first = words(text);
    match [first.next()?, first.next().unwrap_or_default()] {
        [b"0" | b"999", b"section"] => return Some(FileFormat::Part(PartFormat::Dxf)),
        [b"999", _] if has_words(text, b"section") => {
            return Some(FileFormat::Part(PartFormat::Dxf));
        }
        _ => {}
    }
    // Four numbers, and a line whose texts have their lengths before them.
    let mut of_file = lines(text);
    let is_first =
        of_file.next().is_some_and(|line| words(line).count() == 4 && words(line).all(number));
    let second = of_file.next().unwrap_or_default();
    let is_named =
        second.strip_prefix(b"@").unwrap_or(second).first().is_some_and(u8::is_ascii_digit);
    if is_first && is_named && second.iter().any(u8::is_ascii_alphabetic) {
        return Some(Model("a SAT file (ACIS)"));
    }
    let mut signs = begun.iter().filter(|byte| !byte.is_ascii_whitespace());
    let is_json = match (signs.next()?, signs.next()) {
        (b'{', next) => matches!(next, Some(b'"' | b'}')),
        (b'[', next) => matches!(next, Some(b'{' | b'[' | b']' | b'"' | b'-' | b'0'..=b'9')),
        _ => false,
    };
    let is_gltf = |key: &&str| has_words(text, key.as_bytes());
    match is_json {
        true if has_words(text, b"\"asset\"")
            && ["\"version\"", "\"scene", "\"buffers\"", "\"meshes\""].iter().any(is_gltf) =>
        {
            Some(Model("a glTF file"))
        }
        true => Some(Document("a JSON file")),
        false => None,
    }
}

/// Returns the format of a part that is text.
fn of_part(text: &[u8], is_whole: bool) -> Option<FileFormat> {
    let mut rest = text.trim_ascii_start();
    while let Some(comment) = rest.strip_prefix(b"/*") {
        let end = comment.windows(2).position(|window| window == b"*/");
        // A longer comment may have the signature behind it.
        rest = match end {
            Some(end) => comment[end + 2..].trim_ascii_start(),
            None if is_whole => return None,
            None => return Some(FileFormat::Part(PartFormat::Step)),
        };
    }
    if rest.starts_with(b"iso-10303-21") {
        return Some(FileFormat::Part(PartFormat::Step));
    }
    if is_gerber(rest) {
        return Some(FileFormat::Part(PartFormat::Gerber));
    }
    let Some(line) = lines(text).next() else {
        // More comments than were read; only an OBJ begins with so many.
        let format = FileFormat::Part(PartFormat::Obj);
        return Some(format).filter(|_| !is_whole);
    };
    let mut of_line = words(line);
    let first = of_line.next()?;
    let is_stl = match first {
        b"facet" => matches!(words(rest).nth(1), Some(b"normal" | b"outer" | b"vertex")),
        // Other texts may begin with `solid`, so facets must prove the format.
        _ => {
            first.starts_with(b"solid")
                && (has_words(text, b"facet") || has_words(text, b"endsolid") || !is_whole)
        }
    };
    if is_stl {
        return Some(FileFormat::Part(PartFormat::AsciiStl));
    }
    let is_vertex = |line: &&[u8]| {
        let mut words = words(line);
        words.next() == Some(b"v") && words.next().is_some_and(is_number)
    };
    let vertices = lines(text).filter(is_vertex).count();
    let is_known = OBJ_WORDS.iter().any(|word| word.as_bytes() == first);
    let is_shape = matches!(first, b"v" | b"f") && of_line.next().is_some();
    let is_obj = is_known && (is_shape || vertices > 0 || !is_whole) || vertices > 2;
    is_obj.then_some(FileFormat::Part(PartFormat::Obj))
}

/// Returns true if a text begins with a command of Gerber, and states the form of its coordinates:
/// which zeros are left out, and whether they are absolute or incremental.
fn is_gerber(text: &[u8]) -> bool {
    let states_form = |it: &[u8]| {
        matches!(
            it,
            [
                b'%' | b'*' | b'\n' | b'\r',
                b'f',
                b's',
                b'l' | b't' | b'd',
                b'a' | b'i',
                b'x' | b'n' | b'g' | b'd' | b'm'
            ]
        )
    };
    matches!(text, [b'%' | b'*', ..] | [b'g' | b'n' | b'd' | b'm', b'0'..=b'9', ..])
        && text.windows(6).any(states_form)
}

fn is_number(word: &[u8]) -> bool {
    str::from_utf8(word).is_ok_and(|word| word.parse::<f64>().is_ok())
}

/// Returns the format of a text by the first words of its lines.
fn of_lines(text: &[u8]) -> Option<FileFormat> {
    let is_order = |line: &[u8]| match line {
        [b'g' | b'm', b'0'..=b'9', rest @ ..] => {
            rest.iter().take_while(|byte| !byte.is_ascii_whitespace()).all(u8::is_ascii_digit)
        }
        _ => line.starts_with(b";flavor:") || line.starts_with(b"; generated by"),
    };
    if lines(text).find(|line| !line.starts_with(b";")) == Some(b"m48") {
        return Some(Model("an Excellon drill file"));
    }
    let is_code = lines(text).find(|line| is_order(line) || !line.starts_with(b";"));
    let is_code = is_code.is_some_and(|line| line == b"%" || is_order(line));
    is_code.then_some(PrintJob("a G-code file"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(start: &[u8]) -> String {
        let format = FileFormat::of_start(start, Some(start.len() as u64));
        format.map_or_else(|| "none".to_owned(), |format| format.to_string())
    }

    #[test]
    fn parts_are_known_by_their_content() {
        for (text, format) in [
            ("solid a\nfacet normal", PartFormat::AsciiStl),
            ("# by hand\n  SOLID\nENDSOLID", PartFormat::AsciiStl),
            ("facet normal 0 0 1", PartFormat::AsciiStl),
            ("\u{feff}solid a facet", PartFormat::AsciiStl),
            ("solid facet\0\0\x1a", PartFormat::AsciiStl),
            ("ISO-10303-21;", PartFormat::Step),
            (
                "ISO-10303-21;\nHEADER;\nFILE_NAME('', '', (''), (''), 'ACIS Interop'",
                PartFormat::Step,
            ),
            ("solid by ACIS 7\nfacet normal", PartFormat::AsciiStl),
            ("\u{feff} \r\n/* a */\n/* b\n*/ ISO-10303-21;\nHEADER;", PartFormat::Step),
            ("v 0 0 0", PartFormat::Obj),
            ("# a\ng\nv 0 0 0", PartFormat::Obj),
            ("o\nv -1e3 0 0", PartFormat::Obj),
            ("newmtl a\nKd 1 1 1\nv 1 2 3", PartFormat::Obj),
            ("an OBJ\nv 0 0 0\nv 0 0 1\nv 0 1 0\n", PartFormat::Obj),
            ("%FSLAX26Y26*%\n%MOMM*%\n", PartFormat::Gerber),
            ("G04 from a CAD program*\n%TF.Part,Single*%\n%FSTAX24Y24*%", PartFormat::Gerber),
            ("%ASAXBY*MOIN*\nFSLAN2X25Y25*%", PartFormat::Gerber),
            ("PK\x03\x04", PartFormat::Zip),
        ] {
            let whole = FileFormat::of_start(text.as_bytes(), Some(text.len() as u64));
            assert_eq!(whole, Some(FileFormat::Part(format)), "{text:?}");
            let units: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
            if format != PartFormat::Zip {
                let whole = FileFormat::of_start(&units, Some(units.len() as u64));
                assert_eq!(whole, Some(FileFormat::Part(format)), "{text:?} in UTF-16");
            }
        }
        // Its end is not read yet.
        for (start, format) in [
            (format!("solid {}", "a".repeat(5000)), PartFormat::AsciiStl),
            (format!("/*{}", " ".repeat(5000)), PartFormat::Step),
            ("# comment\n".repeat(500), PartFormat::Obj),
        ] {
            let start = &start.as_bytes()[..4096];
            let format = Some(FileFormat::Part(format));
            assert_eq!(FileFormat::of_start(start, Some(1 << 20)), format);
            assert_ne!(FileFormat::of_start(start, Some(4096)), format);
        }
    }

    #[test]
    fn a_binary_stl_is_one_whatever_its_header_says() {
        for header in ["", "solid facet", "<!DOCTYPE html>", "ply", "%PDF-1.4", "{\"asset\":1}"] {
            let mut bytes = header.as_bytes().to_vec();
            bytes.resize(80, b' ');
            bytes.extend([2, 0, 0, 0]);
            bytes.resize(184, 1);
            assert_eq!(named(&bytes), "an STL file", "{header}");
            assert_ne!(named(&bytes[..180]), "an STL file", "{header}");
        }
    }

    #[test]
    fn other_formats_are_named() {
        let mut iges = format!("{:72}S{:7}\n", "from a CAD program", 1).into_bytes();
        iges.extend(format!("{:72}G{:7}\n", "1H,,1H;,4HSLOT", 1).into_bytes());
        assert_eq!(named(&iges), "an IGES file");
        let mut tar = vec![0; 257];
        tar.extend(b"ustar\x0000");
        assert_eq!(named(&tar), "a tar archive");
        for (start, format) in [
            ("\n <!-- saved -->\n<!DOCTYPE html>\n<html>", "a web page"),
            ("\u{feff}<HTML lang='en'>", "a web page"),
            ("<?xml version=\"1.0\"?><Error><Code>AccessDenied</Code></Error>", "a web page"),
            ("<?xml version='1.0'?>\n<amf unit='mm'>", "an AMF file"),
            ("<X3D>", "an X3D file"),
            ("<c:COLLADA>", "a COLLADA file"),
            ("<svg width='1'>", "an SVG file"),
            ("<?xml version='1.0'?><a/>", "an XML file"),
            ("<!-- no end", "an XML file"),
            (
                "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12\n",
                "a Git LFS pointer",
            ),
            ("/annex/objects/SHA256E-s12--4d.stl\n", "a git-annex pointer"),
            ("outs:\n- md5: 4d7a\n", "a DVC pointer"),
            ("400 0 1 0 \n16 Autodesk AutoCAD 19 ASM 223.0.1.7 NT 24\n", "a SAT file (ACIS)"),
            ("ACIS BinaryFile\0", "a SAB file (ACIS)"),
            ("**ABCDEFGHIJKLMNOPQRSTUVWXYZabcdef\n**PART1;\n", "a Parasolid file"),
            ("PS\0\0\0?: TRANSMIT FILE created by modeller", "a Parasolid file"),
            ("glTF\x02\0\0\0", "a glTF file"),
            ("{\"scene\": 0, \"asset\": {\"version\": \"2.0\"}}", "a glTF file"),
            ("{ \"name\": 1 }", "a JSON file"),
            ("[[1, 2]]", "a JSON file"),
            ("ply\nformat ascii 1.0\n", "a PLY file"),
            ("OFF\n8 6 12\n", "an OFF file"),
            ("  0\nSECTION\n  2\nHEADER\n", "a DXF file"),
            ("999\nby hand\n0\nSECTION\n", "a DXF file"),
            ("AC1032\0", "a DWG file"),
            ("Version 8.1 JT  DM 6.0\n\0\x01", "a JT file"),
            ("Kaydara FBX Binary  \0", "an FBX file"),
            ("BLENDER-v300", "a Blender file"),
            ("#VRML V2.0 utf8\n", "a VRML file"),
            ("MM\x0a\0\0\0ab\x01\x02", "a 3DS file"),
            ("%PDF-1.7", "a PDF file"),
            ("\x7FELF", "a program"),
            ("BZh9", "a file packed with bzip2"),
            ("Rar!\x1A\x07\x01", "a RAR archive"),
            ("; generated by PrusaSlicer 2.6\nM104 S210\n", "a G-code file"),
            ("; #@! TF\nM48\nMETRIC\n", "an Excellon drill file"),
            ("%\nG90 (FSLAX)\nG1 X1\n", "a G-code file"),
            ("G21 ; mm\nG90\nG1 X1\n", "a G-code file"),
            ("GIF89a", "a GIF file"),
            ("A recipe for pancakes.\n", "a text file"),
            ("solid state physics", "a text file"),
            ("value 1 2 3", "a text file"),
            ("s", "a text file"),
            ("# a\n# b\n", "a text file"),
            ("404: Not Found", "a text file"),
            ("\0\0\0", "none"),
            ("\x01\x02\x03", "none"),
            ("", "none"),
        ] {
            assert_eq!(named(start.as_bytes()), format, "{start:?}");
        }
        assert_eq!(
            named(b"\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1"),
            "a SolidWorks, Inventor or other OLE file"
        );
        assert_eq!(named(b"\x89PNG\r\n\x1a\n"), "a PNG file");
        assert_eq!(named(b"\xFD7zXZ\0"), "a file packed with xz");
        assert_eq!(named(b"\x1f\x8b\x08"), "a file packed with gzip");
    }
}
