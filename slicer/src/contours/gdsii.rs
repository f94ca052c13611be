//! Reads GDSII streams: boundaries, boxes and paths of all cells, placed by references and arrays.
//!
//! Each pair of layer and datatype is a mask. Polygons of a mask unite.

use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;
use std::io::{self, BufRead, Read};

use lamp_stack::one_line;

use super::curves::chords_of_arc;
use super::error::ContourFault;
use super::rows::{IDENTITY, Rows, at, placed, sin_cos};
use super::{Located, Opened, Pages};
use crate::fill::Fill;
use crate::prisms::Ring;
use crate::read_note::ReadNote;

/// The deepest nesting of cells, and the greatest number of placed cells.
const MAX_DEPTH: usize = 64;
const MAX_VISITS: usize = 1 << 24;

/// The greatest distance of chords from round ends of paths: 1 nm, as layouts are finer than parts.
const TOLERANCE_MM: f64 = 1e-6;

/// The types of records that are read (Calma, GDSII Stream Format Manual, release 6).
mod record {
    pub(super) const UNITS: u8 = 0x03;
    pub(super) const ENDLIB: u8 = 0x04;
    pub(super) const BGNSTR: u8 = 0x05;
    pub(super) const STRNAME: u8 = 0x06;
    pub(super) const ENDSTR: u8 = 0x07;
    pub(super) const BOUNDARY: u8 = 0x08;
    pub(super) const PATH: u8 = 0x09;
    pub(super) const SREF: u8 = 0x0A;
    pub(super) const AREF: u8 = 0x0B;
    pub(super) const TEXT: u8 = 0x0C;
    pub(super) const LAYER: u8 = 0x0D;
    pub(super) const DATATYPE: u8 = 0x0E;
    pub(super) const WIDTH: u8 = 0x0F;
    pub(super) const XY: u8 = 0x10;
    pub(super) const ENDEL: u8 = 0x11;
    pub(super) const SNAME: u8 = 0x12;
    pub(super) const COLROW: u8 = 0x13;
    pub(super) const NODE: u8 = 0x15;
    pub(super) const STRANS: u8 = 0x1A;
    pub(super) const MAG: u8 = 0x1B;
    pub(super) const ANGLE: u8 = 0x1C;
    pub(super) const PATHTYPE: u8 = 0x21;
    pub(super) const BOX: u8 = 0x2D;
    pub(super) const BOXTYPE: u8 = 0x2E;
    pub(super) const BGNEXTN: u8 = 0x30;
    pub(super) const ENDEXTN: u8 = 0x31;
}

/// An element while its records are read.
struct Element {
    kind: u8,
    layer: u32,
    datatype: u32,
    width: f64,
    points: Vec<[f64; 2]>,
    name: String,
    counts: [u32; 2],
    is_mirrored: bool,
    scale: f64,
    degrees: f64,
    path_type: i16,
    extensions: [f64; 2],
}

impl Element {
    fn new(kind: u8) -> Self {
        Self {
            kind,
            layer: 0,
            datatype: 0,
            width: 0.0,
            points: Vec::new(),
            name: String::new(),
            counts: [1; 2],
            is_mirrored: false,
            scale: 1.0,
            degrees: 0.0,
            path_type: 0,
            extensions: [0.0; 2],
        }
    }
}

#[derive(Default)]
struct Cell {
    name: String,
    shapes: Vec<Shape>,
    references: Vec<Reference>,
}

struct Shape {
    mask: [u32; 2],
    outline: Outline,
}

enum Outline {
    /// A polygon, and whether no sides of it cross.
    Polygon(Ring, bool),
    Path(PathShape),
}

struct PathShape {
    points: Vec<[f64; 2]>,
    width: f64,
    is_round: bool,
    /// The lengths by which it goes on behind its ends.
    extensions: [f64; 2],
}

struct Reference {
    cell: String,
    origin: [f64; 2],
    is_mirrored: bool,
    scale: f64,
    degrees: f64,
    counts: [u32; 2],
    steps: [[f64; 2]; 2],
}

struct GdsReader<R> {
    bytes: R,
    at: u64,
    unit_mm: f64,
    cells: Vec<Cell>,
    pages: Pages,
    texts: u64,
    nodes: u64,
    lines: u64,
}

/// Reads a stream. Masks have a thickness in millimeters.
pub(super) fn read(bytes: impl BufRead, mask_mm: f64) -> io::Result<Result<Opened, Located>> {
    let mut reader = GdsReader {
        bytes,
        at: 0,
        unit_mm: 1e-6,
        cells: Vec::new(),
        pages: Pages::new(Fill::Solid),
        texts: 0,
        nodes: 0,
        lines: 0,
    };
    let outcome = reader.read()?;
    let at = |fault| (format!("byte {}", reader.at), fault);
    Ok(outcome.map_err(at).and_then(|()| reader.finish(mask_mm)))
}

/// Returns the whole numbers of a record.
fn integers<const N: usize>(data: &[u8]) -> impl Iterator<Item = i64> {
    data.as_chunks::<N>().0.iter().map(|bytes| {
        let sign = if bytes[0] >= 0x80 { -1i64 } else { 0 };
        bytes.iter().fold(sign, |number, byte| number << 8 | i64::from(*byte))
    })
}

/// Returns a real number: a sign, a power of 16 and a fraction of 56 bits.
fn real(data: &[u8]) -> Option<f64> {
    let bytes: [u8; 8] = data.get(..8)?.try_into().ok()?;
    let bits = u64::from_be_bytes(bytes);
    let fraction = (bits & ((1 << 56) - 1)) as f64 / (1u64 << 56) as f64;
    let number = fraction * 16f64.powi((bits >> 56 & 0x7F) as i32 - 64);
    Some(if bits >> 63 == 1 { -number } else { number })
}

impl<R: BufRead> GdsReader<R> {
    fn read(&mut self) -> io::Result<Result<(), ContourFault>> {
        let mut element: Option<Element> = None;
        let mut data = Vec::new();
        loop {
            let mut head = [0; 4];
            if let Err(error) = self.bytes.read_exact(&mut head) {
                return match error.kind() {
                    io::ErrorKind::UnexpectedEof => Ok(Err(ContourFault::CutOff)),
                    _ => Err(error),
                };
            }
            let length = u64::from(u16::from_be_bytes([head[0], head[1]]));
            if length < 4 {
                return Ok(Err(ContourFault::Malformed("a record of GDSII")));
            }
            data.clear();
            let read = self.bytes.by_ref().take(length - 4).read_to_end(&mut data)?;
            if (read as u64) < length - 4 {
                return Ok(Err(ContourFault::CutOff));
            }
            match self.record(head[2], &data, &mut element) {
                Ok(true) => self.at += length,
                Ok(false) => return Ok(Ok(())),
                Err(fault) => return Ok(Err(fault)),
            }
        }
    }

    /// Reads a record. Returns false at the end of the library.
    fn record(
        &mut self,
        kind: u8,
        data: &[u8],
        element: &mut Option<Element>,
    ) -> Result<bool, ContourFault> {
        let wrong = || ContourFault::Malformed("a record of GDSII");
        let short = || integers::<2>(data).next().ok_or_else(wrong);
        let text = || String::from_utf8_lossy(data).trim_end_matches('\0').to_owned();
        match kind {
            record::ENDLIB => return Ok(false),
            record::UNITS => {
                let meters = data.get(8..).and_then(real).ok_or_else(wrong)?;
                if !(1e-18..=1.0).contains(&meters) {
                    return Err(ContourFault::Malformed("a unit of GDSII"));
                }
                self.unit_mm = decimal(meters * 1000.0);
            }
            record::BGNSTR => self.cells.push(Cell::default()),
            record::STRNAME => {
                self.cells.last_mut().ok_or_else(wrong)?.name = text();
            }
            record::BOUNDARY | record::PATH | record::SREF | record::AREF | record::BOX => {
                *element = Some(Element::new(kind));
            }
            record::TEXT => {
                self.texts += 1;
                *element = None;
            }
            record::NODE => {
                self.nodes += 1;
                *element = None;
            }
            record::ENDEL => {
                if let Some(element) = element.take() {
                    self.end(element)?;
                }
            }
            record::ENDSTR => *element = None,
            _ => {
                let Some(element) = element else { return Ok(true) };
                match kind {
                    record::LAYER => element.layer = u32::from(short()? as u16),
                    record::DATATYPE | record::BOXTYPE => {
                        element.datatype = u32::from(short()? as u16);
                    }
                    record::WIDTH => {
                        element.width = integers::<4>(data).next().ok_or_else(wrong)? as f64;
                    }
                    record::XY => {
                        let mut numbers = integers::<4>(data).map(|number| number as f64);
                        while let (Some(x), Some(y)) = (numbers.next(), numbers.next()) {
                            element.points.push([x, y]);
                        }
                    }
                    record::SNAME => element.name = text(),
                    record::COLROW => {
                        let mut counts = integers::<2>(data);
                        for count in &mut element.counts {
                            let number = counts.next().ok_or_else(wrong)?;
                            *count = u32::try_from(number)
                                .ok()
                                .filter(|&number| number > 0)
                                .ok_or(ContourFault::Malformed("a number of columns and rows"))?;
                        }
                    }
                    record::STRANS => {
                        let bits = short()? as u16;
                        element.is_mirrored = bits & 0x8000 != 0;
                        if bits & 0x0006 != 0 {
                            return Err(ContourFault::Unread("an absolute magnification or angle"));
                        }
                    }
                    record::MAG => element.scale = real(data).ok_or_else(wrong)?,
                    record::ANGLE => element.degrees = real(data).ok_or_else(wrong)?,
                    record::PATHTYPE => element.path_type = short()? as i16,
                    record::BGNEXTN | record::ENDEXTN => {
                        let length = integers::<4>(data).next().ok_or_else(wrong)? as f64;
                        element.extensions[usize::from(kind == record::ENDEXTN)] = length;
                    }
                    _ => {}
                }
            }
        }
        Ok(true)
    }

    /// Adds an element to its cell.
    fn end(&mut self, element: Element) -> Result<(), ContourFault> {
        let wrong = || ContourFault::Malformed("an element within a cell");
        let mask = [element.layer, element.datatype];
        let mut points = element.points;
        let outline = match element.kind {
            record::SREF | record::AREF => {
                let &origin = points.first().ok_or_else(wrong)?;
                let [columns, rows] = element.counts;
                let steps = match (element.kind, &points[..]) {
                    (record::AREF, &[_, right, up]) => {
                        [(right, columns), (up, rows)].map(|(end, count)| {
                            [0, 1].map(|axis| (end[axis] - origin[axis]) / f64::from(count))
                        })
                    }
                    (record::AREF, _) => return Err(wrong()),
                    _ => [[0.0; 2]; 2],
                };
                if !(element.scale > 0.0 && element.scale.is_finite()) {
                    return Err(ContourFault::Malformed("a magnification above zero"));
                }
                let reference = Reference {
                    cell: element.name,
                    origin,
                    is_mirrored: element.is_mirrored,
                    scale: element.scale,
                    degrees: element.degrees,
                    counts: if element.kind == record::AREF { element.counts } else { [1; 2] },
                    steps,
                };
                self.cells.last_mut().ok_or_else(wrong)?.references.push(reference);
                return Ok(());
            }
            record::PATH => {
                points.dedup();
                let width = element.width;
                let half = width.abs() / 2.0;
                let extensions = match element.path_type {
                    0 | 1 => [0.0; 2],
                    2 => [half; 2],
                    4 => element.extensions,
                    _ => return Err(ContourFault::Unread("this type of path")),
                };
                let is_round = element.path_type == 1;
                // A line has no area, nor has a point without round or extended ends.
                let is_area = is_round || points.len() > 1 || extensions.iter().sum::<f64>() > 0.0;
                if width == 0.0 || points.is_empty() || !is_area {
                    self.lines += 1;
                    return Ok(());
                }
                Outline::Path(PathShape { points, width, is_round, extensions })
            }
            _ => {
                if points.first() != points.last() {
                    return Err(ContourFault::Open);
                }
                points.pop();
                let is_simple = self.pages.drawing.is_simple(&points);
                Outline::Polygon(points, is_simple)
            }
        };
        self.cells.last_mut().ok_or_else(wrong)?.shapes.push(Shape { mask, outline });
        Ok(())
    }

    fn finish(mut self, mask_mm: f64) -> Result<Opened, Located> {
        let cells = std::mem::take(&mut self.cells);
        let whole = |fault| ("the library".to_owned(), fault);
        let mut numbers: HashMap<&str, usize> = HashMap::with_capacity(cells.len());
        for (number, cell) in cells.iter().enumerate() {
            if numbers.insert(&cell.name, number).is_some() {
                return Err(whole(ContourFault::Twice(shown(&cell.name))));
            }
        }
        let placed: HashSet<&str> = cells
            .iter()
            .flat_map(|cell| &cell.references)
            .map(|reference| reference.cell.as_str())
            .collect();
        let tops: Vec<_> =
            cells.iter().filter(|cell| !placed.contains(cell.name.as_str())).collect();
        if let (true, Some(cell)) = (tops.is_empty(), cells.first()) {
            return Err(whole(ContourFault::Endless(shown(&cell.name))));
        }
        let mut flat = Flat {
            cells: &cells,
            numbers,
            tolerance: TOLERANCE_MM / self.unit_mm,
            visits: 0,
            pages: &mut self.pages,
        };
        for top in &tops {
            let number = flat.numbers[top.name.as_str()];
            flat.expand(number, &IDENTITY, 1.0, 0).map_err(whole)?;
        }
        let mut notes = Vec::new();
        ReadNote::leave_out(&mut notes, ["text", "texts"], self.texts);
        ReadNote::leave_out(&mut notes, ["node", "nodes"], self.nodes);
        ReadNote::leave_out(&mut notes, ["path without area", "paths without area"], self.lines);
        if tops.len() > 1 {
            notes.push(ReadNote::TopCells { cells: tops.len() });
        }
        Ok(self.pages.into_masks(self.unit_mm, mask_mm, notes))
    }
}

/// Returns the nearest number with 12 digits: the format has no exact powers of ten.
fn decimal(number: f64) -> f64 {
    format!("{number:.11e}").parse().unwrap_or(number)
}

fn shown(cell: &str) -> String {
    let name: String = one_line(cell).chars().take(40).collect();
    format!("cell {name}")
}

/// The masks of a library, with all cells in their places.
struct Flat<'a> {
    cells: &'a [Cell],
    numbers: HashMap<&'a str, usize>,
    tolerance: f64,
    visits: usize,
    pages: &'a mut Pages,
}

impl Flat<'_> {
    /// Adds a cell in its place, where lengths are `scale` times as large.
    fn expand(
        &mut self,
        number: usize,
        rows: &Rows,
        scale: f64,
        depth: usize,
    ) -> Result<(), ContourFault> {
        self.visits += 1;
        let cell = &self.cells[number];
        if depth > MAX_DEPTH {
            return Err(ContourFault::Endless(shown(&cell.name)));
        }
        if self.visits > MAX_VISITS {
            return Err(ContourFault::TooManyCopies(shown(&cell.name)));
        }
        for Shape { mask: [layer, datatype], outline } in &cell.shapes {
            let slab = self.pages.mask(&(*layer, *datatype, String::new()));
            let drawing = &mut self.pages.drawing;
            match outline {
                Outline::Polygon(ring, is_simple) => {
                    let placed: Ring = ring.iter().map(|corner| at(rows, *corner)).collect();
                    match is_simple {
                        true => drawing.add_turned(slab, &placed, false)?,
                        false => drawing.add_shape(slab, &[placed], Fill::Solid)?,
                    }
                }
                Outline::Path(path) => {
                    // A width below zero is not magnified.
                    let half =
                        if path.width < 0.0 { -path.width / scale } else { path.width } / 2.0;
                    let tolerance = self.tolerance / scale;
                    path.for_each_polygon(half, tolerance, |ring| {
                        let placed: Ring = ring.iter().map(|corner| at(rows, *corner)).collect();
                        drawing.add_turned(slab, &placed, false)
                    })?;
                }
            }
        }
        for reference in &cell.references {
            let Some(&inner) = self.numbers.get(reference.cell.as_str()) else {
                return Err(ContourFault::Missing(shown(&reference.cell)));
            };
            let turned = reference.rows();
            let [columns, rows_of] = reference.counts;
            for column in 0..columns {
                for row in 0..rows_of {
                    let [right, up] = reference.steps;
                    let moved = [0, 1].map(|axis| {
                        reference.origin[axis]
                            + f64::from(column) * right[axis]
                            + f64::from(row) * up[axis]
                    });
                    let own = [0, 1].map(|axis| [turned[axis][0], turned[axis][1], moved[axis]]);
                    let placed = placed(rows, &own);
                    self.expand(inner, &placed, scale * reference.scale, depth + 1)?;
                }
            }
        }
        Ok(())
    }
}

impl Reference {
    /// Returns the sums of x and y: mirrored about the x axis first, then magnified and turned.
    fn rows(&self) -> [[f64; 2]; 2] {
        let (sin, cos) = sin_cos(self.degrees);
        let (sin, cos) = (sin * self.scale, cos * self.scale);
        let y = if self.is_mirrored { -1.0 } else { 1.0 };
        [[cos, -sin * y], [sin, cos * y]]
    }
}

impl PathShape {
    /// Calls `each` with polygons that unite to the path: a rectangle for each side, a wedge where
    /// sides meet, and round ends. A wedge ends in a tip, or is cut off where sides turn by more
    /// than a right angle.
    fn for_each_polygon(
        &self,
        half: f64,
        tolerance: f64,
        mut each: impl FnMut(&[[f64; 2]]) -> Result<(), ContourFault>,
    ) -> Result<(), ContourFault> {
        let Self { points, is_round, extensions, .. } = self;
        let last = points.len() - 1;
        let along = |k: usize| -> [f64; 2] {
            // A single point has ends to the left and right.
            let (a, b) =
                if last == 0 { ([0.0; 2], [1.0, 0.0]) } else { (points[k], points[k + 1]) };
            let [x, y] = [b[0] - a[0], b[1] - a[1]];
            let length = x.hypot(y);
            [x / length, y / length]
        };
        for k in 0..last.max(1) {
            let [x, y] = along(k);
            let [from, to] = [points[k], points[(k + 1).min(last)]];
            let before = if k == 0 { extensions[0] } else { 0.0 };
            let after = if k + 1 >= last { extensions[1] } else { 0.0 };
            let from = [from[0] - before * x, from[1] - before * y];
            let to = [to[0] + after * x, to[1] + after * y];
            let [left, right] = [half, -half].map(|by| [-y * by, x * by]);
            let corner = |at: [f64; 2], by: [f64; 2]| [at[0] + by[0], at[1] + by[1]];
            each(&[corner(from, left), corner(from, right), corner(to, right), corner(to, left)])?;
            if k + 1 < last {
                let [next_x, next_y] = along(k + 1);
                let middle = points[k + 1];
                let turn = x * next_y - y * next_x;
                let cos = x * next_x + y * next_y;
                // The wedge is on the outside of the turn.
                let by = if turn > 0.0 { -half } else { half };
                let [a, b] = [[x, y], [next_x, next_y]]
                    .map(|[x, y]| [middle[0] - y * by, middle[1] + x * by]);
                if cos < 0.0 {
                    each(&[middle, a, b])?;
                } else if turn != 0.0 {
                    let tan = turn.abs() / (1.0 + cos) * half;
                    let tip = [a[0] + tan * x, a[1] + tan * y];
                    each(&[middle, a, tip, b])?;
                }
            }
        }
        if *is_round {
            let chords = chords_of_arc(half, 2.0 * PI, tolerance)?.next_multiple_of(4);
            for end in [points[0], points[last]] {
                let circle: Ring = (0..chords)
                    .map(|k| {
                        let (sin, cos) = (2.0 * PI * k as f64 / chords as f64).sin_cos();
                        [end[0] + half * cos, end[1] + half * sin]
                    })
                    .collect();
                each(&circle)?;
            }
        }
        Ok(())
    }
}
