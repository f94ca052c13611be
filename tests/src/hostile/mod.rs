//! Checks of the readers against any input: one function each, for arbitrary bytes. The fuzz
//! targets in `fuzz/` and ordinary tests run the same ones.
//!
//! Each panics if a reader panics or an answer contradicts another; a refusal must be one line.

mod check;
mod damage;
mod facets;
mod seeds;

use std::collections::HashSet;
use std::error::Error;
use std::io::{Cursor, Write};
use std::path::Path;

use fax::decoder::decode_g4;
use lamp_edit::{Edits, Variants};
use lamp_gantry::{FrameReader, FrameWriter, Job};
use lamp_slicing::topology::{CornerTable, Crossings, MeshCheck, RepairOptions, Repaired, repair};
use lamp_slicing::{
    Fill, OpenOptions, Part, Placement, SliceError, SliceOptions, Slices, SurfaceName, Units,
};
use lamp_stack::{
    EncodedPage, Format, Image, IndexedStack, Layer, Length, Mask, MaskBuilder, PageWriter, Pages,
    Pitch, PrinterFault, StackError, g4 as codec,
};
use tempfile::NamedTempFile;

pub use check::check;
pub use damage::damage;
pub use facets::facets;
pub use seeds::{Seed, classic_tiff, seeds};

/// Parts are sliced only where their images are at most this high: the cost of
/// a few facets grows with the rows they cross.
const MAX_ROWS: u32 = 1000;
/// Meshes are checked only where they have at most so many facets.
const MAX_MESH: usize = 3000;
/// Surfaces are looked for by at most so many names of a kind.
const MAX_NAMES: usize = 20;
/// Images are encoded only if that takes about this many codes at most: a
/// run costs one for every 2560 pixels.
const MAX_CODES: u64 = 1 << 20;

/// Reads bytes as STL, as `part` says.
///
/// # Panics
/// If that does not hold.
pub fn stl(bytes: &[u8]) {
    part(bytes);
}

/// Reads bytes as OBJ, and as what gzip packed, as `part` says.
///
/// # Panics
/// If that does not hold.
pub fn obj(bytes: &[u8]) {
    part(bytes);
}

/// Reads bytes as contours or a layout, as `part` says.
///
/// # Panics
/// If that does not hold.
pub fn contours(bytes: &[u8]) {
    part(bytes);
}

/// Reads bytes as a 3MF package, and as the model of one, as `part` says.
///
/// # Panics
/// If that does not hold.
pub fn three_mf(bytes: &[u8]) {
    part(bytes);
    // Hardly any damaged package is unpacked.
    part(&lamp_fixtures::three_mf(&String::from_utf8_lossy(bytes), &[]));
}

/// Reads bytes as a part in any format and slices a few layers of what they hold, by
/// both rules of filling. The images are in canonical form, their rows end white exactly
/// where they are said to be stray, and the size of the slabs does not matter.
fn part(bytes: &[u8]) {
    let file = file_of(bytes);
    for fill in [Fill::EvenOdd, Fill::Solid] {
        let [tight, roomy] = [1, 64 << 20].map(|memory| sliced(file.path(), fill, memory));
        match (tight, roomy) {
            (Ok(tight), Ok(roomy)) => {
                assert_eq!(tight, roomy, "layers depend on the size of the slabs");
                roomy.iter().for_each(check_section);
            }
            (Err(tight), Err(roomy)) => assert_eq!(one_line(&tight), one_line(&roomy)),
            (tight, roomy) => panic!("the outcome depends on memory: {tight:?}, {roomy:?}"),
        }
    }
    if let Ok(part) = Part::open(file.path(), &OpenOptions::default()) {
        mesh(&part);
        let options = OpenOptions { keep_marks: true, ..OpenOptions::default() };
        match Part::open(file.path(), &options) {
            Ok(marked) => {
                assert_eq!(marked.facet_count(), part.facet_count(), "marks change the shape");
                surfaces(&marked);
            }
            Err(error) => drop(one_line(&error)),
        }
    }
}

/// Looks for the surfaces of a part by all their names. Each has the facets that are counted.
fn surfaces(part: &Part) {
    let names = match part.surface_names() {
        Ok(names) => names,
        Err(error) => return drop(one_line(&error)),
    };
    let facets = |name: SurfaceName| {
        part.surface(name, &Placement::default(), Units::Inches).expect("it is listed").len()
    };
    for (color, count) in names.colors.into_iter().take(MAX_NAMES) {
        assert_eq!(facets(SurfaceName::Color(color)), count);
    }
    for (face, count) in names.faces.into_iter().take(MAX_NAMES) {
        assert_eq!(facets(SurfaceName::Face(face)), count);
    }
    for (paint, count) in names.painted {
        assert!(facets(SurfaceName::Painted(paint)) >= count);
    }
    let none = part.surface(SurfaceName::Face(0), &Placement::default(), Units::Inches);
    one_line(&none.expect_err("no face has this number"));
}

/// Checks and repairs a mesh. Repairing a repaired mesh changes nothing.
fn mesh(part: &Part) {
    let facets = match part.facets() {
        Ok(facets) if facets.len() <= MAX_MESH => facets,
        Ok(_) => return,
        Err(error) => return drop(one_line(&error)),
    };
    let table = CornerTable::of_part(part, &Placement::default(), Units::Millimetres);
    match table {
        Ok(table) => drop((MeshCheck::new(&table), Crossings::new(&table, 10))),
        Err(error) => return drop(one_line(&error)),
    }
    let options = RepairOptions { weld: 0.001, close: 10.0 };
    match repair(facets, &options) {
        Ok(Repaired { facets, .. }) => {
            let again = repair(facets, &options).expect("it was repaired before");
            assert_eq!(again.touched, [], "a repair leaves something to repair");
        }
        Err(error) => drop(one_line(&error)),
    }
}

fn sliced(path: &Path, fill: Fill, memory: u64) -> Result<Vec<Layer>, SliceError> {
    let options = SliceOptions {
        pitch: Pitch::of_dpi(25.4).expect("a resolution"),
        thickness: Length::from_mm(1.0),
        layers: Some(0..6),
        fill,
        memory,
        ..SliceOptions::default()
    };
    let slices = Slices::new(Part::open(path, &OpenOptions::default())?, &options)?;
    if slices.grid().height > MAX_ROWS { Ok(Vec::new()) } else { slices.collect() }
}

/// Reads bytes as STEP and slices a few layers of what passes the gate, on facets and on
/// surfaces: every contour closes and every row balances.
///
/// # Panics
/// If that does not hold.
pub fn step(bytes: &[u8]) {
    // Parts of files that make sense are some centimeters large.
    let options = OpenOptions { tolerance: Length::from_mm(0.5), ..OpenOptions::default() };
    let model = match Part::from_step("part", bytes, &options) {
        Ok(model) => model,
        Err(error) => return drop(one_line(&error)),
    };
    surfaces(&model);
    for polish in [false, true] {
        let options = SliceOptions {
            pitch: Pitch::of_dpi(25.4).expect("a resolution"),
            thickness: Length::from_mm(1.0),
            layers: Some(0..6),
            polish,
            ..SliceOptions::default()
        };
        let slices = match Slices::new(model.clone(), &options) {
            Ok(slices) if slices.grid().height <= MAX_ROWS => slices,
            Ok(_) => return,
            Err(error) => return drop(one_line(&error)),
        };
        for layer in slices {
            let layer = layer.expect("facets in memory");
            check_section(&layer);
            assert!(layer.info.closed == Some(true) && layer.info.stray_rows.is_empty());
        }
    }
}

fn check_section(layer: &Layer) {
    let Image::Mask(mask) = &*layer.image else { panic!("slices are masks") };
    check_canonical(mask);
    let ends_white = (0..mask.height()).filter(|&row| mask.row(row).len() % 2 == 1);
    assert_eq!(ends_white.collect::<Vec<_>>(), layer.info.stray_rows);
}

/// Reads bytes as a stack, as a stream and as a file. Both give the same, and a decoded stack is
/// the same after it was encoded and decoded again.
///
/// # Panics
/// If that does not hold.
pub fn tiff(bytes: &[u8]) {
    let file = file_of(bytes);
    let from_file = decoded(Pages::open(file.path()));
    match (decoded(Pages::from_stream(Cursor::new(bytes.to_vec()))), &from_file) {
        (Err(StackError::NotForward { .. } | StackError::Printer(PrinterFault::Piped(_))), _) => {}
        (Ok(streamed), Ok(from_file)) => assert_eq!(&streamed, from_file),
        (Err(streamed), Err(from_file)) => assert_eq!(one_line(&streamed), one_line(from_file)),
        (streamed, from_file) => panic!("a pipe gives {streamed:?}, a file {from_file:?}"),
    }
    match from_file {
        Ok(layers) => check_stack(&layers),
        Err(error) => drop(one_line(&error)),
    }
}

/// Reads bytes as a packed stack, once their checks are made right, in order and from the last page
/// to the first.
///
/// # Panics
/// If the reader panics, or pages depend on the order.
pub fn packed(bytes: &[u8]) {
    let bytes = mended(bytes);
    tiff(&bytes);
    let Ok(layers) = decoded(Pages::from_stream(Cursor::new(bytes.clone()))) else { return };
    let file = file_of(&bytes);
    let stack = IndexedStack::open(file.path()).expect("it was read in order");
    assert_eq!(stack.headers().len(), layers.len());
    for (position, layer) in layers.iter().enumerate().rev() {
        assert_eq!(&stack.layer(position).expect("it was read in order"), layer);
    }
}

/// The bytes of a GOO file before its previews, which no reader looks at, and their number.
pub(crate) const GOO_PREVIEWS: (usize, usize) = (194, 195_116);

/// Reads bytes as a printer's file, in order and from the last page to the first. A GOO file comes
/// without its previews, so that damage meets what is read.
///
/// # Panics
/// If the reader panics, or pages depend on the order.
pub fn printer(bytes: &[u8]) {
    let (start, previews) = GOO_PREVIEWS;
    let file = match bytes.split_at_checked(start) {
        Some((start, rest)) if start.starts_with(b"V") => {
            file_of(&[start, &vec![0; previews], rest].concat())
        }
        _ => file_of(bytes),
    };
    let layers = match decoded(Pages::open(file.path())) {
        Ok(layers) => layers,
        Err(error) => return drop(one_line(&error)),
    };
    check_stack(&layers);
    let stack = IndexedStack::open(file.path()).expect("it was read in order");
    assert_eq!(stack.headers().len(), layers.len());
    for (position, layer) in layers.iter().enumerate().rev() {
        assert_eq!(&stack.layer(position).expect("it was read in order"), layer);
    }
}

/// Corrects the checks of a packed stack's parts, so that damage gets past them. The format is in
/// `docs/pack.md`.
fn mended(bytes: &[u8]) -> Vec<u8> {
    const SIGNATURE: [u8; 8] = [0x93, b'L', b'A', b'M', b'P', b'\r', b'\n', 1];
    let mut bytes = bytes.to_vec();
    let start = bytes.len().min(SIGNATURE.len());
    bytes[..start].copy_from_slice(&SIGNATURE[..start]);
    let mut rest = bytes.get_mut(9..).unwrap_or_default();
    while rest.len() >= 25 {
        let (header, after) = rest.split_at_mut(25);
        let size = |at: usize| {
            u32::from_le_bytes(header[at..at + 4].try_into().expect("four bytes")) as usize
        };
        let (head, images) = (size(5).min(after.len()), size(13));
        let (head, after) = after.split_at_mut(head);
        let (images, after) = after.split_at_mut(images.min(after.len()));
        header[17..21].copy_from_slice(&crc32fast::hash(images).to_le_bytes());
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(&header[..21]);
        hasher.update(head);
        header[21..].copy_from_slice(&hasher.finalize().to_le_bytes());
        rest = after;
    }
    bytes
}

fn decoded(pages: Result<Pages, StackError>) -> Result<Vec<Layer>, StackError> {
    pages?.layers().collect()
}

fn check_stack(layers: &[Layer]) {
    for layer in layers {
        if let Image::Mask(mask) = &*layer.image {
            check_canonical(mask);
        }
    }
    let codes = |image: &Image| u64::from(image.height()) * u64::from(1 + image.width() / 2560);
    if layers.is_empty() || layers.iter().map(|layer| codes(&layer.image)).sum::<u64>() > MAX_CODES
    {
        return;
    }
    for format in [Format::Big, Format::Classic] {
        let mut pages = PageWriter::new(Vec::new(), format);
        for layer in layers {
            pages.push(EncodedPage::new(layer)).expect("memory takes all");
        }
        let bytes = pages.finish().expect("there are layers");
        let again = decoded(Pages::from_stream(Cursor::new(bytes))).expect("a good stack");
        assert_eq!(again.len(), layers.len());
        for (again, layer) in again.into_iter().zip(layers) {
            // Resolutions are written with four decimals.
            let [new, old] =
                [again.pitch, layer.pitch].map(|pitch| pitch.map_or([0.0; 2], Pitch::dpi));
            let is_near = |axis: usize| (new[axis] - old[axis]).abs() < 1e-4;
            assert!(is_near(0) && is_near(1), "{old:?} dpi became {new:?}");
            assert_eq!(Layer { pitch: layer.pitch, ..again }, *layer);
        }
    }
}

/// Takes bytes as frames of a swath, and as a job. Frames that are read come as they were written, and
/// a job that is read is one after it is written, too.
///
/// # Panics
/// If that does not hold.
pub fn scan(bytes: &[u8]) {
    if let Ok(mut reader) = FrameReader::new(bytes) {
        let header = reader.header();
        let mut writer = FrameWriter::new(Vec::new(), header).expect("memory takes all");
        let mut whole = true;
        while let Some(frame) = reader.next() {
            match frame {
                Ok(frame) => writer.push(&frame).expect("memory takes all"),
                Err(error) => {
                    drop(one_line(&error));
                    whole = false;
                }
            }
        }
        let written = writer.finish().expect("memory takes all");
        assert!(!whole || written == bytes);
    }
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let name = std::path::Path::new("job.json");
    match Job::read(text, name) {
        Ok(job) => {
            let text = serde_json::to_string(&job).expect("jobs have text keys");
            assert_eq!(Job::read(&text, name).expect("it was read"), job);
        }
        Err(error) => drop(one_line(&error)),
    }
}

/// The line between a list of edits and a table of variants.
const TABLE: &str = "\n===\n";

/// Reads bytes as a list of edits and, below a line `===`, a table of its variants. Each variant has a
/// name of its own, and is a list of edits with as many edits.
///
/// # Panics
/// If that does not hold.
pub fn variants(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let (list, table) = text.split_once(TABLE).unwrap_or((text, ""));
    let edits = match Edits::from_toml(list) {
        Ok(edits) => edits,
        Err(error) => return drop(one_line(&error)),
    };
    let variants = match Variants::read(list, table) {
        Ok(variants) => variants,
        Err(error) => return drop(one_line(&error)),
    };
    let names: HashSet<_> = variants.names().collect();
    assert_eq!(names.len(), variants.names().len());
    for variant in 0..names.len() {
        let of_row = Edits::from_toml(&variants.list(variant)).expect("it was read before");
        assert_eq!(of_row.count(), edits.count());
    }
}

/// Takes bytes as a width, a height and a T.6 strip, and as the runs of an image. A decoded image
/// is canonical, has the right height and decodes again from its own codes, by the `fax` crate too.
///
/// # Panics
/// If that does not hold.
pub fn g4(bytes: &[u8]) {
    let Some((size, rest)) = bytes.split_first_chunk::<8>() else { return };
    let [width, height] = [&size[..4], &size[4..]]
        .map(|number| u32::from_le_bytes(number.try_into().expect("four bytes")));
    match codec::decode(rest, width, height) {
        Ok(mask) => {
            assert_eq!((mask.width(), mask.height()), (width, height));
            check_codec(&mask);
        }
        Err(error) => drop(one_line(&error)),
    }
    check_codec(&mask_of_runs(width % 10_000, rest));
}

/// An image whose bytes are runs, each of up to 127 pixels, or up to 127 times
/// 32; a zero ends its row.
fn mask_of_runs(width: u32, runs: &[u8]) -> Mask {
    let mut mask = MaskBuilder::new(width);
    for row in runs.split(|&run| run == 0) {
        let lengths = row.iter().map(|&run| u32::from(run & 127) << (5 * (run >> 7)));
        let columns = lengths.scan(0, |end, length| {
            *end += length;
            Some(*end)
        });
        let mut columns: Vec<u32> = columns.take_while(|&column| column < width).collect();
        columns.dedup();
        mask.push_row(&columns).expect("columns in rising order");
    }
    mask.finish()
}

fn check_codec(mask: &Mask) {
    check_canonical(mask);
    let (width, height) = (mask.width(), mask.height());
    if u64::from(height) * u64::from(1 + width / 2560) > MAX_CODES {
        return;
    }
    let strip = codec::encode(mask);
    assert_eq!(codec::decode(&strip, width, height).as_ref(), Ok(mask));
    // The fax crate knows no image without pixels.
    if width > 0 && height > 0 {
        assert_eq!(decoded_by_fax(&strip, width, height), *mask);
    }
}

fn decoded_by_fax(strip: &[u8], width: u32, height: u32) -> Mask {
    let mut mask = MaskBuilder::new(width);
    decode_g4(strip.iter().copied(), width, Some(height), |row| {
        let inside: Vec<u32> = row.iter().copied().filter(|&column| column < width).collect();
        mask.push_row(&inside).expect("columns in rising order");
    })
    .expect("the fax crate reads it");
    mask.finish()
}

fn check_canonical(mask: &Mask) {
    let mut again = MaskBuilder::new(mask.width());
    for row in mask.rows() {
        again.push_row(row).expect("the canonical form");
    }
    assert_eq!(again.finish(), *mask);
}

/// Returns a command's message about the error: one line, and not a long one.
fn one_line(error: &dyn Error) -> String {
    let mut line = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        line = format!("{line}: {error}");
        cause = error.source();
    }
    assert!(!line.is_empty() && !line.contains(char::is_control), "{line:?}");
    // A stage that gave up says why in its own words.
    assert!(line.len() < 400 || line.contains("the stage before gave up: "), "{line}");
    line
}

fn file_of(bytes: &[u8]) -> NamedTempFile {
    let mut file = NamedTempFile::new().expect("a temporary file");
    file.write_all(bytes).expect("the disk has room");
    file
}
