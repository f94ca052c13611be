//! Reads DXF as text: closed polylines, circles, ellipses, solids, lines and arcs that close, and
//! blocks.
//!
//! Polygons at several heights are layers, whose tops are there. Else each layer of the drawing is a
//! mask. All polygons of a layer or mask together are filled by even-odd.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::f64::consts::TAU;
use std::io::{self, BufRead, Read};

use super::curves::{TOLERANCE_MM, check, chords_of_arc};
use super::error::ContourFault;
use super::{Located, Opened, Pages};
use crate::fill::Fill;
use crate::prisms::Ring;
use crate::read_note::ReadNote;

/// A limit above the length of any line.
const MAX_LINE: u64 = 1 << 16;
/// The deepest nesting of blocks, and the greatest number of placed blocks and empty layers.
const MAX_DEPTH: usize = 32;
const MAX_VISITS: usize = 1 << 20;
/// The greatest number of ends that are compared with an end, as near as they are.
const MOST_NEAR: usize = 64;
/// The distance at which ends of lines meet.
const TOUCHING_MM: f64 = 1e-6;

/// A line of a drawing: corners (x, y) and the bulge of the side behind each, the tangent of a
/// quarter of its angle.
struct Line {
    layer: usize,
    z: f64,
    corners: Vec<[f64; 3]>,
    is_closed: bool,
}

/// A block placed in another one, once or in columns and rows.
struct Insert {
    layer: usize,
    block: String,
    z: f64,
    at: [f64; 2],
    scale: [f64; 2],
    degrees: f64,
    counts: [u32; 2],
    steps: [f64; 2],
    is_mirrored: bool,
}

#[derive(Default)]
struct Block {
    base: [f64; 2],
    lines: Vec<Line>,
    inserts: Vec<Insert>,
}

/// An entity: its name, and its groups.
#[derive(Default)]
struct Entity {
    name: String,
    groups: Vec<(i32, String)>,
}

impl Entity {
    fn text(&self, code: i32) -> Option<&str> {
        self.groups.iter().find(|(of, _)| *of == code).map(|(_, text)| text.trim())
    }

    fn number(&self, code: i32) -> Result<Option<f64>, ContourFault> {
        self.text(code).map(finite).transpose()
    }

    fn number_or(&self, code: i32, usual: f64) -> Result<f64, ContourFault> {
        Ok(self.number(code)?.unwrap_or(usual))
    }

    fn point(&self, code: i32) -> Result<[f64; 2], ContourFault> {
        Ok([self.number_or(code, 0.0)?, self.number_or(code + 10, 0.0)?])
    }

    fn flags(&self, code: i32) -> Result<u32, ContourFault> {
        Ok(self.number_or(code, 0.0)? as u32)
    }

    /// Returns whether groups of these codes, which are widths, are above zero.
    fn is_wide(&self, codes: &[i32]) -> Result<bool, ContourFault> {
        let mut widths = self.groups.iter().filter(|(code, _)| codes.contains(code));
        widths.try_fold(false, |is_wide, (_, width)| Ok(is_wide | (finite(width)? > 0.0)))
    }

    /// Returns whether it lies in a plane seen from below, so that its x points left.
    fn is_mirrored(&self) -> Result<bool, ContourFault> {
        let normal = [210, 220].map(|code| self.number_or(code, 0.0));
        let [x, y] = [normal[0].clone()?, normal[1].clone()?];
        if x.abs().max(y.abs()) > 1e-9 {
            return Err(ContourFault::Unread("an entity that is not parallel to the plane"));
        }
        Ok(self.number_or(230, 1.0)? < 0.0)
    }
}

fn finite(text: &str) -> Result<f64, ContourFault> {
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        Ok(_) => Err(ContourFault::NotFinite),
        Err(_) => Err(ContourFault::Malformed("a number")),
    }
}

struct DxfReader<R> {
    text: R,
    line: u64,
    unit_mm: Option<f64>,
    layers: Vec<String>,
    numbers_of_layers: HashMap<String, usize>,
    blocks: HashMap<String, Block>,
    /// The block whose entities are read; the drawing itself has no name.
    block: String,
    /// The polyline whose vertices are read.
    polyline: Option<Line>,
    hidden_layers: HashSet<String>,
    hidden: u64,
    others: u64,
    /// Polylines with a width, whose outlines are read without it.
    wide: u64,
    /// Whether the polyline whose vertices are read has a width.
    is_wide: bool,
}

/// Reads a drawing. Masks have a thickness in millimeters.
pub(super) fn read(text: impl BufRead, mask_mm: f64) -> io::Result<Result<Opened, Located>> {
    let mut reader = DxfReader {
        text,
        line: 0,
        unit_mm: None,
        // The layer of blocks' contents is known by its number.
        layers: vec!["0".to_owned()],
        numbers_of_layers: HashMap::from([("0".to_owned(), 0)]),
        blocks: HashMap::from([(String::new(), Block::default())]),
        block: String::new(),
        polyline: None,
        hidden_layers: HashSet::new(),
        hidden: 0,
        others: 0,
        wide: 0,
        is_wide: false,
    };
    let outcome = reader.read()?;
    let at = |fault| (format!("line {}", reader.line), fault);
    Ok(outcome.map_err(at).and_then(|()| reader.finish(mask_mm)))
}

impl<R: BufRead> DxfReader<R> {
    fn next_line(&mut self) -> io::Result<Option<String>> {
        let mut line = Vec::new();
        let length = self.text.by_ref().take(MAX_LINE).read_until(b'\n', &mut line)?;
        self.line += 1;
        Ok((length > 0).then(|| String::from_utf8_lossy(&line).trim_end().to_owned()))
    }

    /// Returns the next group: its code and its value.
    fn group(&mut self) -> io::Result<Result<(i32, String), ContourFault>> {
        let Some(code) = self.next_line()? else { return Ok(Err(ContourFault::CutOff)) };
        let Ok(code) = code.trim().parse() else {
            return Ok(Err(ContourFault::Malformed("the code of a group")));
        };
        let Some(value) = self.next_line()? else { return Ok(Err(ContourFault::CutOff)) };
        Ok(Ok((code, value)))
    }

    fn read(&mut self) -> io::Result<Result<(), ContourFault>> {
        let (mut section, mut entity) = (String::new(), Entity::default());
        loop {
            let (code, value) = match self.group()? {
                Ok(group) => group,
                Err(fault) => return Ok(Err(fault)),
            };
            if code != 0 {
                // Other tables and objects are not kept.
                let is_kept = match section.as_str() {
                    "" | "HEADER" | "BLOCKS" | "ENTITIES" => true,
                    "TABLES" => entity.name == "LAYER",
                    _ => false,
                };
                if is_kept && code != 999 {
                    entity.groups.push((code, value));
                }
                continue;
            }
            let ended = std::mem::take(&mut entity);
            let outcome = match (section.as_str(), ended.name.as_str()) {
                (_, "SECTION") => {
                    section = ended.text(2).unwrap_or_default().to_ascii_uppercase();
                    // The header's variables follow the section's name.
                    self.header(&ended)
                }
                ("TABLES", "LAYER") => self.layer_state(&ended),
                ("BLOCKS" | "ENTITIES", "") => Ok(()),
                ("BLOCKS" | "ENTITIES", _) => self.entity(&ended),
                _ => Ok(()),
            };
            if let Err(fault) = outcome {
                return Ok(Err(fault));
            }
            let value = value.trim().to_ascii_uppercase();
            match value.as_str() {
                "EOF" => return Ok(Ok(())),
                "ENDSEC" => section.clear(),
                _ => {}
            }
            entity.name = value;
        }
    }

    fn header(&mut self, header: &Entity) -> Result<(), ContourFault> {
        let mut groups = header.groups.iter();
        if groups.any(|(code, name)| *code == 9 && name.trim() == "$INSUNITS")
            && let Some((_, unit)) = groups.next()
        {
            self.unit_mm = match finite(unit)? as i32 {
                0 => None,
                1 => Some(25.4),
                2 => Some(304.8),
                4 => Some(1.0),
                5 => Some(10.0),
                6 => Some(1000.0),
                8 => Some(25.4e-6),
                9 => Some(0.0254),
                11 => Some(1e-7),
                12 => Some(1e-6),
                13 => Some(1e-3),
                14 => Some(100.0),
                _ => return Err(ContourFault::Unread("this unit ($INSUNITS)")),
            };
        }
        Ok(())
    }

    /// Reads whether a layer is shown: not off (its color is below zero) or frozen (flag 1).
    fn layer_state(&mut self, layer: &Entity) -> Result<(), ContourFault> {
        if layer.number_or(62, 0.0)? < 0.0 || layer.flags(70)? & 1 == 1 {
            self.hidden_layers.insert(layer.text(2).unwrap_or_default().to_owned());
        }
        Ok(())
    }

    fn layer(&mut self, entity: &Entity) -> usize {
        let name = entity.text(8).unwrap_or("0");
        if let Some(&number) = self.numbers_of_layers.get(name) {
            return number;
        }
        self.layers.push(name.to_owned());
        self.numbers_of_layers.insert(name.to_owned(), self.layers.len() - 1);
        self.layers.len() - 1
    }

    fn current_block(&mut self) -> &mut Block {
        self.blocks.entry(self.block.clone()).or_default()
    }

    fn entity(&mut self, entity: &Entity) -> Result<(), ContourFault> {
        let is_shape = !matches!(entity.name.as_str(), "BLOCK" | "ENDBLK" | "SEQEND" | "VERTEX");
        let is_hidden = self.hidden_layers.contains(entity.text(8).unwrap_or("0"));
        // On paper, or on a layer that is off.
        if is_shape && (is_hidden || entity.number(67)? == Some(1.0)) {
            self.hidden += 1;
            return Ok(());
        }
        let layer = self.layer(entity);
        let mut line = Line { layer, z: 0.0, corners: Vec::new(), is_closed: true };
        match entity.name.as_str() {
            "BLOCK" => {
                self.block = entity.text(2).unwrap_or_default().to_ascii_uppercase();
                self.current_block().base = entity.point(10)?;
                return Ok(());
            }
            "ENDBLK" => {
                self.block.clear();
                return Ok(());
            }
            "SEQEND" => {
                if let Some(line) = self.polyline.take() {
                    self.wide += u64::from(self.is_wide);
                    self.current_block().lines.push(line);
                }
                return Ok(());
            }
            "VERTEX" => {
                // Control points of splines are no corners.
                let is_corner = entity.flags(70)? & 16 == 0;
                let [x, y] = entity.point(10)?;
                let (bulge, z) = (entity.number_or(42, 0.0)?, entity.number(30)?);
                self.is_wide |= entity.is_wide(&[40, 41])?;
                if let Some(line) = self.polyline.as_mut().filter(|_| is_corner) {
                    line.corners.push([x, y, bulge]);
                    line.z = z.unwrap_or(line.z);
                }
                return Ok(());
            }
            "POLYLINE" => {
                let flags = entity.flags(70)?;
                // Meshes and polylines in space: 8, 16 and 64.
                if flags & 0b101_1000 != 0 {
                    self.others += 1;
                    return Ok(());
                }
                if entity.is_mirrored()? {
                    return Err(ContourFault::Unread("a polyline seen from below"));
                }
                line.is_closed = flags & 1 == 1;
                line.z = entity.number_or(30, 0.0)?;
                self.is_wide = entity.is_wide(&[40, 41])?;
                self.polyline = Some(line);
                return Ok(());
            }
            "LWPOLYLINE" => {
                line.is_closed = entity.flags(70)? & 1 == 1;
                line.z = entity.number_or(38, 0.0)?;
                self.wide += u64::from(entity.is_wide(&[40, 41, 43])?);
                for (code, value) in &entity.groups {
                    match (code, line.corners.last_mut()) {
                        (10, _) => line.corners.push([finite(value)?, 0.0, 0.0]),
                        (20, Some(corner)) => corner[1] = finite(value)?,
                        (42, Some(corner)) => corner[2] = finite(value)?,
                        _ => {}
                    }
                }
            }
            "LINE" => {
                line.is_closed = false;
                line.z = entity.number_or(30, 0.0)?;
                line.corners =
                    [entity.point(10)?, entity.point(11)?].map(|[x, y]| [x, y, 0.0]).to_vec();
            }
            "CIRCLE" | "ARC" => {
                let ([x, y], radius) = (entity.point(10)?, entity.number_or(40, 0.0)?);
                line.z = entity.number_or(30, 0.0)?;
                let (mut from, mut over) = (0.0, 360.0);
                if entity.name == "ARC" {
                    line.is_closed = false;
                    from = entity.number_or(50, 0.0)?;
                    over = (entity.number_or(51, 0.0)? - from).rem_euclid(360.0);
                }
                // Two halves, since no bulge spans a whole circle.
                let bulge = (over / 8.0).to_radians().tan();
                let corner = |share: f64| {
                    let (sin, cos) = (from + over * share).to_radians().sin_cos();
                    [x + radius * cos, y + radius * sin, bulge]
                };
                line.corners = vec![corner(0.0), corner(0.5)];
                if !line.is_closed {
                    line.corners.push(corner(1.0));
                }
            }
            "ELLIPSE" => {
                let ([x, y], [a, b]) = (entity.point(10)?, entity.point(11)?);
                let ratio = entity.number_or(40, 1.0)?;
                let (from, to) = (entity.number_or(41, 0.0)?, entity.number_or(42, TAU)?);
                let over =
                    if (to - from).abs() >= TAU - 1e-9 { TAU } else { (to - from).rem_euclid(TAU) };
                line.z = entity.number_or(30, 0.0)?;
                line.is_closed = over == TAU;
                let tolerance = TOLERANCE_MM / self.unit_mm.unwrap_or(1.0);
                let chords = chords_of_arc(a.hypot(b) * ratio.abs().max(1.0), over, tolerance)?;
                let ends = chords + usize::from(!line.is_closed);
                line.corners.extend((0..ends).map(|k| {
                    let (sin, cos) = (from + over * k as f64 / chords as f64).sin_cos();
                    [x + a * cos - ratio * b * sin, y + b * cos + ratio * a * sin, 0.0]
                }));
            }
            "SOLID" | "TRACE" => {
                // Its third and fourth corner are in the order of the letter Z.
                line.z = entity.number_or(30, 0.0)?;
                for code in [10, 11, 13, 12] {
                    let [x, y] = entity.point(code)?;
                    line.corners.push([x, y, 0.0]);
                }
            }
            "INSERT" => {
                let count = |code: i32| -> Result<u32, ContourFault> {
                    Ok(entity.number_or(code, 1.0)?.clamp(1.0, 65_535.0) as u32)
                };
                let insert = Insert {
                    layer,
                    block: entity.text(2).unwrap_or_default().to_ascii_uppercase(),
                    z: entity.number_or(30, 0.0)?,
                    at: entity.point(10)?,
                    scale: [entity.number_or(41, 1.0)?, entity.number_or(42, 1.0)?],
                    degrees: entity.number_or(50, 0.0)?,
                    counts: [count(70)?, count(71)?],
                    steps: [entity.number_or(44, 0.0)?, entity.number_or(45, 0.0)?],
                    is_mirrored: entity.is_mirrored()?,
                };
                self.current_block().inserts.push(insert);
                return Ok(());
            }
            "SPLINE" => return Err(ContourFault::Unread("a spline: export it as a polyline")),
            "ATTRIB" | "ENDSEC" => return Ok(()),
            _ => {
                self.others += 1;
                return Ok(());
            }
        }
        // Lines and ellipses are in the coordinates of the drawing.
        if !matches!(entity.name.as_str(), "LINE" | "ELLIPSE") && entity.is_mirrored()? {
            for corner in &mut line.corners {
                *corner = [-corner[0], corner[1], -corner[2]];
            }
        }
        self.current_block().lines.push(line);
        Ok(())
    }

    fn finish(self, mask_mm: f64) -> Result<Opened, Located> {
        let unit_mm = self.unit_mm.unwrap_or(1.0);
        let mut flat = Flat {
            blocks: &self.blocks,
            unit_mm,
            tolerance: TOLERANCE_MM / unit_mm,
            visits: 0,
            corners: 0,
            closed: Vec::new(),
            open: BTreeMap::new(),
        };
        let whole = |fault| ("the drawing".to_owned(), fault);
        flat.expand("", &Placed::default(), 0).map_err(whole)?;
        let Flat { mut closed, open, .. } = flat;
        for ((layer, z), lines) in open {
            let (rings, left) = linked(lines, TOUCHING_MM / unit_mm);
            if left > 0 {
                let at = format!("layer {}", lamp_stack::one_line(&self.layers[layer]));
                return Err((at, ContourFault::OpenLines(left)));
            }
            closed.extend(rings.into_iter().map(|ring| (layer, f64::from_bits(z), ring)));
        }
        let mut notes = Vec::new();
        if self.unit_mm.is_none() {
            notes.push(ReadNote::NoUnit { taken: "millimeters" });
        }
        let what = [
            "entity without an area (a text, hatch, point or other)",
            "entities without an area (texts, hatches, points and others)",
        ];
        ReadNote::leave_out(&mut notes, what, self.others);
        let what = [
            "entity on paper or on a layer that is off or frozen",
            "entities on paper or on layers that are off or frozen",
        ];
        ReadNote::leave_out(&mut notes, what, self.hidden);
        let what = [
            "width of a polyline, whose outline is read,",
            "widths of polylines, whose outlines are read,",
        ];
        ReadNote::leave_out(&mut notes, what, self.wide);
        closed.sort_by(|a, b| a.1.total_cmp(&b.1));
        // Heights that differ by less are rounded.
        let nm = 1e-6 / unit_mm;
        let mut heights: Vec<f64> = closed.iter().map(|(_, z, _)| *z).collect();
        heights.dedup_by(|a, b| *a - *b < nm);
        let mut pages = Pages::new(Fill::EvenOdd);
        if heights.len() < 2 {
            for (layer, _, ring) in closed {
                let slab = pages.mask(&(0, 0, self.layers[layer].clone()));
                pages.drawing.add(slab, ring).map_err(whole)?;
            }
            return Ok(pages.into_masks(unit_mm, mask_mm, notes));
        }
        let gap = heights.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::MAX, f64::min);
        let steps = |pair: &[f64]| (pair[1] - pair[0]) / gap;
        // Layers of one thickness may be empty, so that nothing in the file has their height.
        let is_even =
            heights.windows(2).all(|pair| (steps(pair) - steps(pair).round()).abs() < 1e-3);
        let span = (heights[heights.len() - 1] - heights[0]) / gap;
        let is_even = is_even && span < MAX_VISITS as f64;
        let mut rings = closed.into_iter().peekable();
        for (k, &z) in heights.iter().enumerate() {
            if k > 0 && is_even {
                let below = heights[k - 1];
                let count = steps(&[below, z]).round() as u32;
                for step in 1..count {
                    let between = below + gap * f64::from(step);
                    pages.begin(between, Some(gap)).map_err(whole)?;
                }
            }
            pages.begin(z, is_even.then_some(gap)).map_err(whole)?;
            let slab = pages.slab().expect("a layer was begun");
            while let Some((_, _, ring)) = rings.next_if(|(_, of, _)| *of < z + nm) {
                pages.drawing.add(slab, ring).map_err(whole)?;
            }
        }
        pages.into_stack(unit_mm, notes).ok_or_else(|| whole(ContourFault::NoLayer))
    }
}

/// The place of a block: sums of x, y and 1, its layer where it is in another one, and its height.
#[derive(Clone)]
struct Placed {
    rows: [[f64; 3]; 2],
    layer: Option<usize>,
    z: f64,
}

impl Default for Placed {
    fn default() -> Self {
        Self { rows: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], layer: None, z: 0.0 }
    }
}

impl Placed {
    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        self.rows.map(|row| row[0] * x + row[1] * y + row[2])
    }
}

/// The lines of a drawing, with all blocks in their places.
struct Flat<'a> {
    blocks: &'a HashMap<String, Block>,
    unit_mm: f64,
    tolerance: f64,
    visits: usize,
    corners: usize,
    closed: Vec<(usize, f64, Ring)>,
    /// Open lines by their layer and the bits of their height.
    open: BTreeMap<(usize, u64), Vec<Ring>>,
}

impl Flat<'_> {
    fn expand(&mut self, name: &str, place: &Placed, depth: usize) -> Result<(), ContourFault> {
        self.visits += 1;
        if depth > MAX_DEPTH {
            return Err(ContourFault::Endless(shown(name)));
        }
        if self.visits > MAX_VISITS {
            return Err(ContourFault::TooManyCopies(shown(name)));
        }
        let blocks = self.blocks;
        let Some(block) = blocks.get(name) else { return Err(ContourFault::Missing(shown(name))) };
        let [a, b] = place.rows;
        let scale = a[0].hypot(b[0]).max(a[1].hypot(b[1]));
        for line in &block.lines {
            // A copied line costs at least as much as a placed block.
            self.visits += usize::from(depth > 0);
            let mut ring = flattened(line, self.tolerance / scale)?;
            self.corners += ring.len();
            check(self.corners)?;
            ring.iter_mut().for_each(|corner| *corner = place.at(*corner));
            if ring.iter().flatten().any(|number| !number.is_finite()) {
                return Err(ContourFault::NotFinite);
            }
            // Contents of a block on layer 0 are on the layer of the block.
            let layer = match place.layer {
                Some(layer) if line.layer == 0 => layer,
                _ => line.layer,
            };
            // Heights of rounded drawings differ in digits that say nothing.
            let nm = 1e-6 / self.unit_mm;
            let z = ((place.z + line.z) / nm).round() * nm + 0.0;
            if line.is_closed || ring.len() > 3 && ring.first() == ring.last() {
                self.closed.push((layer, z, ring));
            } else if ring.len() > 1 {
                self.open.entry((layer, z.to_bits())).or_default().push(ring);
            }
        }
        for insert in &block.inserts {
            let base = blocks.get(&insert.block).map_or([0.0; 2], |block| block.base);
            let (sin, cos) = insert.degrees.to_radians().sin_cos();
            for column in 0..insert.counts[0] {
                for row in 0..insert.counts[1] {
                    let step =
                        [f64::from(column) * insert.steps[0], f64::from(row) * insert.steps[1]];
                    let mirror = if insert.is_mirrored { -1.0 } else { 1.0 };
                    let [sx, sy] = insert.scale;
                    let own = |[x, y]: [f64; 2]| {
                        let [x, y] = [sx * (x - base[0]) + step[0], sy * (y - base[1]) + step[1]];
                        let [x, y] = [cos * x - sin * y, sin * x + cos * y];
                        place.at([mirror * (x + insert.at[0]), y + insert.at[1]])
                    };
                    let (origin, right, up) = (own([0.0; 2]), own([1.0, 0.0]), own([0.0, 1.0]));
                    let rows = [0, 1].map(|axis| {
                        [right[axis] - origin[axis], up[axis] - origin[axis], origin[axis]]
                    });
                    let layer = match place.layer {
                        Some(layer) if insert.layer == 0 => layer,
                        _ => insert.layer,
                    };
                    let inner = Placed { rows, layer: Some(layer), z: place.z + insert.z };
                    self.expand(&insert.block, &inner, depth + 1)?;
                }
            }
        }
        Ok(())
    }
}

fn shown(block: &str) -> String {
    let name: String = lamp_stack::one_line(block).chars().take(40).collect();
    format!("block {name}")
}

/// Returns the corners of a line with chords for its arcs.
fn flattened(line: &Line, tolerance: f64) -> Result<Ring, ContourFault> {
    let mut ring = Ring::new();
    let count = line.corners.len();
    for (k, &[x, y, bulge]) in line.corners.iter().enumerate() {
        ring.push([x, y]);
        let is_side = k + 1 < count || line.is_closed;
        if bulge == 0.0 || !is_side || count < 2 {
            continue;
        }
        let [to_x, to_y, _] = line.corners[(k + 1) % count];
        let [dx, dy] = [to_x - x, to_y - y];
        let chord = dx.hypot(dy);
        if chord == 0.0 {
            continue;
        }
        let angle = 4.0 * bulge.atan();
        let radius = chord * (1.0 + bulge * bulge) / (4.0 * bulge.abs());
        // The middle is on the left of the chord where the arc turns left.
        let off = (1.0 - bulge * bulge) / (4.0 * bulge);
        let middle = [x + 0.5 * dx - off * dy, y + 0.5 * dy + off * dx];
        let chords = chords_of_arc(radius, angle, tolerance)?;
        let start = (y - middle[1]).atan2(x - middle[0]);
        ring.extend((1..chords).map(|k| {
            let (sin, cos) = (start + angle * k as f64 / chords as f64).sin_cos();
            [middle[0] + radius * cos, middle[1] + radius * sin]
        }));
        check(ring.len())?;
    }
    Ok(ring)
}

/// Joins lines whose ends meet to polygons. Returns them, and the number of lines left.
fn linked(lines: Vec<Ring>, touching: f64) -> (Vec<Ring>, usize) {
    // Zero has no sign in a key.
    let cell = |[x, y]: [f64; 2]| [x, y].map(|c| (c / (2.0 * touching)).floor() + 0.0);
    let key = |cell: [f64; 2]| cell.map(f64::to_bits);
    let ends = |line: &Ring| [line[0], line[line.len() - 1]];
    let mut by_cell: HashMap<[u64; 2], Vec<usize>> = HashMap::new();
    for (number, line) in lines.iter().enumerate() {
        for end in ends(line) {
            by_cell.entry(key(cell(end))).or_default().push(number);
        }
    }
    let is_near = |a: [f64; 2], b: [f64; 2]| {
        (a[0] - b[0]).abs() <= touching && (a[1] - b[1]).abs() <= touching
    };
    let mut lines: Vec<Option<Ring>> = lines.into_iter().map(Some).collect();
    let (mut rings, mut left) = (Vec::new(), 0);
    for first in 0..lines.len() {
        let Some(mut chain) = lines[first].take() else { continue };
        let mut links = 1;
        loop {
            let [start, end] = ends(&chain);
            if chain.len() > 2 && is_near(start, end) {
                chain.pop();
                rings.push(chain);
                break;
            }
            let [x, y] = cell(end);
            let mut around = [-1.0, 0.0, 1.0]
                .into_iter()
                .flat_map(|i| [-1.0, 0.0, 1.0].into_iter().map(move |j| [x + i, y + j]));
            let next = around.find_map(|cell| {
                let numbers = by_cell.get_mut(&key(cell))?;
                let mut k = 0;
                // Each line is dropped once, and few others are so near without a meeting.
                while k < numbers.len().min(MOST_NEAR) {
                    match &lines[numbers[k]] {
                        None => drop(numbers.swap_remove(k)),
                        Some(line) if ends(line).iter().any(|other| is_near(*other, end)) => {
                            return Some(numbers[k]);
                        }
                        Some(_) => k += 1,
                    }
                }
                None
            });
            let Some(mut line) = next.and_then(|number| lines[number].take()) else {
                left += links;
                break;
            };
            if !is_near(line[0], end) {
                line.reverse();
            }
            chain.extend(line.into_iter().skip(1));
            links += 1;
        }
    }
    (rings, left)
}
