//! Reads Gerber files: draws, flashes and regions of a layer, painted dark and clear in their order.
//!
//! A file is one mask.
//!
//! Source: Ucamco, *The Gerber Layer Format Specification*, revision 2024.05, and its appendix of
//! deprecated commands.

mod apertures;
mod areas;

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};
use std::io::{self, BufRead};
use std::rc::Rc;

use lamp_stack::one_line;

use super::curves::{TOLERANCE_MM, check, chords_of_arc};
use super::error::ContourFault;
use super::rows::{IDENTITY, Rows, at, placed, sin_cos};
use super::{Located, MaskKey, Opened, Pages};
use crate::fill::Fill;
use crate::prisms::Ring;
use crate::read_note::ReadNote;

use apertures::{Aperture, Macro, Pen};
use areas::Area;

/// The deepest nesting of blocks, and the greatest number of placed objects.
const MAX_DEPTH: usize = 32;
const MAX_VISITS: usize = 1 << 21;
/// A limit above the bytes of a macro.
const MAX_COMMAND: usize = 1 << 22;
/// A limit on the work of macros: seconds.
const MAX_STEPS: u64 = 1 << 29;
/// The greatest number of dark and clear coats one over the other.
const MAX_COATS: u32 = 1 << 9;
/// The columns and rows in which objects are compared.
const CELLS: usize = 64;
/// The greatest part of an arc's radius by which its ends may differ in their distance from the
/// center, since coordinates are rounded.
const ROUNDED_SHARE: f64 = 0.05;

/// An area or a block that is painted, in the order of the file.
struct Object {
    is_clear: bool,
    form: Form,
}

enum Form {
    /// An area, and where its origin is.
    Area(Rc<Area>, [f64; 2]),
    Copies(Copies),
}

/// A block in columns and rows, or once.
struct Copies {
    block: Rc<Block>,
    rows: Rows,
    counts: [u32; 2],
    steps: [f64; 2],
}

struct Block {
    name: String,
    objects: Vec<Object>,
    /// The nesting of blocks within it.
    depth: usize,
}

enum Tool {
    Aperture(Aperture),
    Block(Rc<Block>),
}

/// Where objects go until a command ends.
enum Frame {
    Whole,
    Repeat([u32; 2], [f64; 2]),
    Block(u32),
}

/// The digits of coordinates before and after the point, and which zeros are left out.
#[derive(Clone, Copy)]
struct Digits {
    whole: usize,
    fraction: usize,
    omits_trailing: bool,
}

#[derive(Clone, Copy, PartialEq)]
enum Plot {
    Line,
    Clockwise,
    Counterclockwise,
}

struct GerberReader {
    unit_mm: Option<f64>,
    digits: Option<[Digits; 2]>,
    macros: HashMap<String, Rc<Macro>>,
    tools: HashMap<u32, Tool>,
    /// The shapes of apertures as they are flashed now.
    shapes: HashMap<u32, Rc<Area>>,
    tool: Option<u32>,
    position: [f64; 2],
    plot: Plot,
    /// Whether arcs have any angle and signs of their center (G75), or are of one quarter (G74).
    is_multi_quadrant: Option<bool>,
    operation: Option<u32>,
    is_clear: bool,
    mirror: [f64; 2],
    degrees: f64,
    scale: f64,
    /// The line that is drawn.
    path: Ring,
    /// The contour of a region.
    region: Option<Ring>,
    frames: Vec<(Frame, Vec<Object>)>,
    corners: usize,
    steps_left: u64,
    pages: Pages,
    thin: u64,
    empty: u64,
}

/// Reads a file. Its mask has a thickness in millimeters.
pub(super) fn read(mut text: impl BufRead, mask_mm: f64) -> io::Result<Result<Opened, Located>> {
    let mut reader = GerberReader {
        unit_mm: None,
        digits: None,
        macros: HashMap::new(),
        tools: HashMap::new(),
        shapes: HashMap::new(),
        tool: None,
        position: [0.0; 2],
        plot: Plot::Line,
        is_multi_quadrant: None,
        operation: None,
        is_clear: false,
        mirror: [1.0; 2],
        degrees: 0.0,
        scale: 1.0,
        path: Ring::new(),
        region: None,
        frames: vec![(Frame::Whole, Vec::new())],
        corners: 0,
        steps_left: MAX_STEPS,
        pages: Pages::new(Fill::Solid),
        thin: 0,
        empty: 0,
    };
    let mut line = 1;
    let outcome = reader.read(&mut text, &mut line)?;
    let at = |fault| (format!("line {line}"), fault);
    Ok(outcome.map_err(at).and_then(|()| reader.finish(mask_mm)))
}

impl GerberReader {
    /// Reads commands up to the end, and counts lines.
    fn read(
        &mut self,
        text: &mut impl BufRead,
        line: &mut u64,
    ) -> io::Result<Result<(), ContourFault>> {
        // The commands between two percent signs.
        let mut extended: Option<Vec<String>> = None;
        let mut command = Vec::new();
        let mut length = 0;
        loop {
            let bytes = text.fill_buf()?;
            if bytes.is_empty() {
                return Ok(Err(ContourFault::CutOff));
            }
            let used = bytes.len();
            for &byte in bytes {
                let outcome = match byte {
                    b'\n' => {
                        *line += 1;
                        Ok(false)
                    }
                    b'\r' => Ok(false),
                    b'*' => {
                        let of_command = String::from_utf8_lossy(&command).trim().to_owned();
                        command.clear();
                        match &mut extended {
                            Some(commands) => {
                                commands.push(of_command);
                                Ok(false)
                            }
                            None => {
                                length = 0;
                                self.word(&of_command)
                            }
                        }
                    }
                    b'%' if !command.trim_ascii().is_empty() => {
                        Err(ContourFault::Malformed("a command that ends in an asterisk"))
                    }
                    b'%' => {
                        command.clear();
                        length = 0;
                        match extended.take() {
                            Some(commands) => self.extended(&commands).map(|()| false),
                            None => {
                                extended = Some(Vec::new());
                                Ok(false)
                            }
                        }
                    }
                    _ => {
                        command.push(byte);
                        length += 1;
                        match length > MAX_COMMAND {
                            true => Err(ContourFault::Malformed("a command")),
                            false => Ok(false),
                        }
                    }
                };
                match outcome {
                    Ok(false) => {}
                    Ok(true) => return Ok(Ok(())),
                    Err(fault) => return Ok(Err(fault)),
                }
            }
            text.consume(used);
        }
    }

    /// Reads a command of letters with numbers. Returns true at the end of the file.
    fn word(&mut self, text: &str) -> Result<bool, ContourFault> {
        const WRONG: ContourFault = ContourFault::Malformed("a command");
        let mut rest = text;
        let mut numbers: [Option<f64>; 4] = [None; 4];
        let mut operation = None;
        while let Some(letter) = rest.chars().next() {
            rest = &rest[letter.len_utf8()..];
            let of_number = |byte: &u8| byte.is_ascii_digit() || b"+-.".contains(byte);
            let count = rest.bytes().take_while(|byte| of_number(byte)).count();
            let (number, behind) = rest.split_at(count);
            let code = || number.parse::<u32>().map_err(|_| WRONG);
            match letter {
                'G' => match code()? {
                    4 => return Ok(false),
                    code => self.general(code)?,
                },
                'D' => match code()? {
                    code @ 1..=3 => operation = Some(code),
                    code @ 10.. => self.select(code)?,
                    _ => return Err(WRONG),
                },
                'M' => match code()? {
                    0 | 2 => {
                        self.end()?;
                        return Ok(true);
                    }
                    1 => {}
                    code => return Err(ContourFault::Command(format!("M{code:02}"))),
                },
                'X' | 'Y' | 'I' | 'J' => {
                    let axis = usize::from(matches!(letter, 'Y' | 'J'));
                    let offset = if matches!(letter, 'I' | 'J') { 2 } else { 0 };
                    numbers[axis + offset] = Some(self.coordinate(number, axis)?);
                }
                // The number of a line.
                'N' => {
                    code()?;
                }
                ' ' => {}
                _ => return Err(WRONG),
            }
            rest = behind;
        }
        if operation.is_none() && numbers.iter().all(Option::is_none) {
            return Ok(false);
        }
        let operation = operation.or(self.operation);
        let operation = operation.ok_or(ContourFault::Early("an operation (D01, D02 or D03)"))?;
        self.operation = Some(operation);
        let [x, y, i, j] = numbers;
        let to = [x.unwrap_or(self.position[0]), y.unwrap_or(self.position[1])];
        match operation {
            1 => self.plot_to(to, [i, j].map(Option::unwrap_or_default))?,
            2 => {
                self.end_path()?;
                self.end_contour()?;
                self.position = to;
            }
            _ => {
                self.end_path()?;
                self.position = to;
                self.flash()?;
            }
        }
        Ok(false)
    }

    fn general(&mut self, code: u32) -> Result<(), ContourFault> {
        match code {
            1 => self.plot = Plot::Line,
            2 => self.plot = Plot::Clockwise,
            3 => self.plot = Plot::Counterclockwise,
            36 if self.region.is_some() => {
                return Err(ContourFault::Malformed("the end of its region (G37)"));
            }
            36 => {
                self.end_path()?;
                self.region = Some(Ring::new());
            }
            37 => {
                self.end_contour()?;
                if self.region.take().is_none() {
                    return Err(ContourFault::Early("the start of a region (G36)"));
                }
            }
            // They announce apertures and flashes, or are the usual ones.
            54 | 55 | 90 => {}
            70 => self.unit_mm = Some(25.4),
            71 => self.unit_mm = Some(1.0),
            74 => self.is_multi_quadrant = Some(false),
            75 => self.is_multi_quadrant = Some(true),
            _ => return Err(ContourFault::Command(format!("G{code:02}"))),
        }
        Ok(())
    }

    fn coordinate(&self, text: &str, axis: usize) -> Result<f64, ContourFault> {
        const WRONG: ContourFault = ContourFault::Malformed("a coordinate");
        let digits = self.digits.ok_or(ContourFault::Early("the form of coordinates (%FS)"))?[axis];
        let unit_mm = self.unit_mm()?;
        let (sign, number) = match text.as_bytes() {
            [b'-', ..] => (-1.0, &text[1..]),
            [b'+', ..] => (1.0, &text[1..]),
            _ => (1.0, text),
        };
        // More digits than any coordinate has are not exact.
        if number.is_empty() || number.len() > 15 || !number.bytes().all(|it| it.is_ascii_digit()) {
            return Err(WRONG);
        }
        let whole: f64 = number.parse().map_err(|_| WRONG)?;
        let missing = match digits.omits_trailing {
            true => (digits.whole + digits.fraction).checked_sub(number.len()).ok_or(WRONG)?,
            false => 0,
        };
        let places = digits.fraction as i32 - missing as i32;
        // A power of ten below one is not exact.
        let in_unit = match places {
            0.. => whole / 10f64.powi(places),
            _ => whole * 10f64.powi(-places),
        };
        Ok(sign * in_unit * unit_mm)
    }

    fn unit_mm(&self) -> Result<f64, ContourFault> {
        self.unit_mm.ok_or(ContourFault::Early("the unit (%MO)"))
    }

    fn select(&mut self, code: u32) -> Result<(), ContourFault> {
        self.end_path()?;
        if !self.tools.contains_key(&code) {
            return Err(ContourFault::Missing(format!("aperture D{code}")));
        }
        self.tool = Some(code);
        Ok(())
    }

    /// Reads the commands between two percent signs.
    fn extended(&mut self, commands: &[String]) -> Result<(), ContourFault> {
        let mut commands = commands.iter().map(|command| command.trim());
        while let Some(command) = commands.next() {
            let Some((name, rest)) = command.split_at_checked(2) else {
                if command.is_empty() {
                    continue;
                }
                return Err(ContourFault::Malformed("a command"));
            };
            if name != "TF" && name != "TA" && name != "TO" && name != "TD" {
                self.end_path()?;
            }
            let unread = || ContourFault::Command(shown(command));
            let is_all = |usual: f64| {
                let numbers = rest.split(|c: char| c.is_ascii_alphabetic());
                let mut numbers = numbers.filter(|it| !it.is_empty());
                numbers.all(|number| number.parse() == Ok(usual))
            };
            match (name, rest) {
                // The rest is its primitives.
                ("AM", name) => {
                    let of_macro = Macro::new(commands.by_ref())?;
                    self.macros.insert(name.to_owned(), Rc::new(of_macro));
                }
                ("AD", definition) => self.define(definition)?,
                ("FS", form) => self.digits = Some(digits(form)?),
                ("MO", "MM") => self.unit_mm = Some(1.0),
                ("MO", "IN") => self.unit_mm = Some(25.4),
                ("LP", "D") => self.is_clear = false,
                ("LP", "C") => self.is_clear = true,
                ("LM", "N" | "X" | "Y" | "XY") => {
                    self.mirror =
                        ['X', 'Y'].map(|axis| if rest.contains(axis) { -1.0 } else { 1.0 });
                    self.shapes.clear();
                }
                ("LR", degrees) => {
                    self.degrees = finite(degrees)?;
                    self.shapes.clear();
                }
                ("LS", scale) => {
                    self.scale = finite(scale)?;
                    if self.scale <= 0.0 {
                        return Err(ContourFault::Malformed("a scale above zero"));
                    }
                    self.shapes.clear();
                }
                ("SR" | "AB", _) if self.region.is_some() => {
                    return Err(ContourFault::Malformed("the end of its region (G37)"));
                }
                ("SR", steps) => self.repeat(steps)?,
                ("AB", name) => self.block(name)?,
                ("TF" | "TA" | "TO" | "TD" | "IN" | "LN", _) | ("IP", "POS") | ("AS", "AXBY") => {}
                ("OF" | "MI" | "IR", _) if is_all(0.0) => {}
                ("SF", _) if is_all(1.0) => {}
                _ => return Err(unread()),
            }
        }
        Ok(())
    }

    /// Defines an aperture.
    fn define(&mut self, text: &str) -> Result<(), ContourFault> {
        let (code, template) = code_of(text)?;
        let unit_mm = self.unit_mm()?;
        let aperture = Aperture::new(template, unit_mm, &self.macros)?;
        self.shapes.remove(&code);
        self.tools.insert(code, Tool::Aperture(aperture));
        Ok(())
    }

    /// Begins to repeat the objects that follow, or ends it.
    fn repeat(&mut self, text: &str) -> Result<(), ContourFault> {
        const WRONG: ContourFault = ContourFault::Malformed("a step and repeat (%SR)");
        self.end_repeat();
        let (mut counts, mut steps) = ([1; 2], [0.0; 2]);
        let mut rest = text;
        while let Some(letter) = rest.chars().next() {
            rest = &rest[letter.len_utf8()..];
            let end = rest.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(rest.len());
            let (number, behind) = rest.split_at(end);
            rest = behind;
            let axis = usize::from(matches!(letter, 'Y' | 'J'));
            match letter {
                'X' | 'Y' => {
                    let count = number.parse().ok().filter(|count| *count > 0);
                    counts[axis] = count.ok_or(WRONG)?;
                }
                'I' | 'J' => steps[axis] = finite(number)? * self.unit_mm()?,
                _ => return Err(WRONG),
            }
        }
        if counts != [1; 2] {
            self.frames.push((Frame::Repeat(counts, steps), Vec::new()));
        }
        Ok(())
    }

    fn end_repeat(&mut self) {
        if let Some((Frame::Repeat(counts, steps), objects)) =
            self.frames.pop_if(|(frame, _)| matches!(frame, Frame::Repeat(..)))
        {
            let block = Rc::new(Block::new("a step and repeat (%SR)".to_owned(), objects));
            let form = Form::Copies(Copies { block, rows: IDENTITY, counts, steps });
            self.paint(false, form);
        }
    }

    /// Begins a block of an aperture, or ends it.
    fn block(&mut self, text: &str) -> Result<(), ContourFault> {
        if !text.is_empty() {
            let (code, _) = code_of(text)?;
            if self.frames.len() > MAX_DEPTH {
                return Err(ContourFault::Endless(format!("aperture D{code}")));
            }
            self.frames.push((Frame::Block(code), Vec::new()));
            return Ok(());
        }
        self.end_repeat();
        let Some((Frame::Block(code), objects)) =
            self.frames.pop_if(|(frame, _)| matches!(frame, Frame::Block(_)))
        else {
            return Err(ContourFault::Early("the start of a block (%AB)"));
        };
        let block = Block::new(format!("aperture D{code}"), objects);
        self.shapes.remove(&code);
        self.tools.insert(code, Tool::Block(Rc::new(block)));
        Ok(())
    }

    fn paint(&mut self, is_clear: bool, form: Form) {
        if let Some((_, objects)) = self.frames.last_mut() {
            objects.push(Object { is_clear, form });
        }
    }

    fn paint_area(&mut self, area: Area) -> Result<(), ContourFault> {
        self.corners += area.corner_count();
        check(self.corners)?;
        self.paint(self.is_clear, Form::Area(Rc::new(area), [0.0; 2]));
        Ok(())
    }

    /// Returns how apertures lie: mirrored first, then turned and scaled.
    fn turn(&self, scale: f64) -> Rows {
        let (sin, cos) = sin_cos(self.degrees);
        let [x, y] = self.mirror.map(|sign| sign * scale * self.scale);
        [[cos * x, -sin * y, 0.0], [sin * x, cos * y, 0.0]]
    }

    fn flash(&mut self) -> Result<(), ContourFault> {
        if self.region.is_some() {
            return Err(ContourFault::Malformed("a side of its region"));
        }
        let code = self.tool.ok_or(ContourFault::Early("an aperture (D10 or above)"))?;
        let to = self.position;
        if let Some(Tool::Block(block)) = self.tools.get(&code) {
            if block.depth >= MAX_DEPTH {
                return Err(ContourFault::Endless(block.name.clone()));
            }
            let mut rows = self.turn(1.0);
            (0..2).for_each(|axis| rows[axis][2] = to[axis]);
            let block = block.clone();
            let form = Form::Copies(Copies { block, rows, counts: [1; 2], steps: [0.0; 2] });
            self.paint(self.is_clear, form);
            return Ok(());
        }
        let shape = match self.shapes.get(&code) {
            Some(shape) => shape.clone(),
            None => {
                let shape = Rc::new(self.shape(code)?);
                self.shapes.insert(code, shape.clone());
                shape
            }
        };
        self.empty += u64::from(shape.corner_count() == 0);
        self.paint(self.is_clear, Form::Area(shape, to));
        Ok(())
    }

    /// Returns the shape of an aperture as it is flashed.
    fn shape(&mut self, code: u32) -> Result<Area, ContourFault> {
        let Some(Tool::Aperture(aperture)) = self.tools.get(&code) else {
            return Err(ContourFault::Missing(format!("aperture D{code}")));
        };
        let left = self.steps_left.checked_sub(aperture.work());
        self.steps_left = left.ok_or(ContourFault::Unread("macros with too many primitives"))?;
        let rows = self.turn(aperture.unit_mm);
        let tolerance = TOLERANCE_MM / (aperture.unit_mm * self.scale);
        let mut primitives = aperture.primitives(tolerance, &mut self.steps_left)?;
        let area = Area::of_primitives(&mut primitives, &rows, &mut self.steps_left)?;
        self.corners += area.corner_count();
        check(self.corners)?;
        Ok(area)
    }

    fn plot_to(&mut self, to: [f64; 2], center: [f64; 2]) -> Result<(), ContourFault> {
        let mut half = 0.0;
        if self.region.is_none() {
            match self.pen()? {
                Pen::Circle(diameter) => half = diameter / 2.0,
                Pen::Convex(_) if self.plot == Plot::Line => {}
                Pen::Convex(_) => {
                    return Err(ContourFault::Unread("an arc that is not drawn by a circle"));
                }
            }
        }
        let from = self.position;
        let mut points = match self.plot {
            Plot::Line => vec![to],
            _ => self.arc(to, center, half)?,
        };
        let line = self.region.as_mut().unwrap_or(&mut self.path);
        if line.is_empty() {
            line.push(from);
        }
        line.append(&mut points);
        check(line.len())?;
        self.position = to;
        Ok(())
    }

    /// Returns how the current aperture draws, in millimeters.
    fn pen(&self) -> Result<Pen, ContourFault> {
        const OTHER: ContourFault =
            ContourFault::Unread("a line drawn by a block, a macro or an aperture with a hole");
        let code = self.tool.ok_or(ContourFault::Early("an aperture (D10 or above)"))?;
        let Some(Tool::Aperture(aperture)) = self.tools.get(&code) else { return Err(OTHER) };
        let tolerance = TOLERANCE_MM / (aperture.unit_mm * self.scale);
        match aperture.pen(tolerance)? {
            None => Err(OTHER),
            Some(Pen::Circle(diameter)) => {
                Ok(Pen::Circle(diameter * aperture.unit_mm * self.scale))
            }
            Some(Pen::Convex(ring)) => {
                let rows = self.turn(aperture.unit_mm);
                Ok(Pen::Convex(ring.into_iter().map(|corner| at(&rows, corner)).collect()))
            }
        }
    }

    /// Returns the corners of an arc behind its start, which is here.
    fn arc(&self, to: [f64; 2], offset: [f64; 2], half: f64) -> Result<Ring, ContourFault> {
        let from = self.position;
        let is_multi = self.is_multi_quadrant.ok_or(ContourFault::Early("G74 or G75"))?;
        let clockwise = self.plot == Plot::Clockwise;
        // The center, and its distances from both ends, and the angle between them.
        let about = |center: [f64; 2]| {
            let [a, b] = [from, to].map(|end| [0, 1].map(|axis| end[axis] - center[axis]));
            let [start, end] = [a, b].map(|[x, y]| y.atan2(x));
            let angle = if clockwise { start - end } else { end - start };
            (center, [a, b].map(|[x, y]| x.hypot(y)), start, angle.rem_euclid(TAU))
        };
        let differs = |radii: [f64; 2]| (radii[0] - radii[1]).abs();
        let (center, radii, start, angle) = match is_multi {
            true => {
                let (center, radii, start, angle) = about([0, 1].map(|k| from[k] + offset[k]));
                (center, radii, start, if from == to { TAU } else { angle })
            }
            false => {
                let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
                let arcs =
                    signs.map(|sign| about([0, 1].map(|k| from[k] + sign[k] * offset[k].abs())));
                // Coordinates are rounded, and so are angles.
                let quarters = arcs.into_iter().filter(|(.., angle)| *angle <= PI / 2.0 + 0.01);
                let best = quarters.min_by(|a, b| differs(a.1).total_cmp(&differs(b.1)));
                best.ok_or(ContourFault::Malformed("an arc of a quarter or less (G74)"))?
            }
        };
        let most = radii[0].max(radii[1]);
        if differs(radii) > ROUNDED_SHARE * most {
            return Err(ContourFault::Malformed("an arc with a center (I and J)"));
        }
        let chords = chords_of_arc(most + half, angle, TOLERANCE_MM)?;
        let point = |k: usize| {
            let share = k as f64 / chords as f64;
            let turned = if clockwise { start - share * angle } else { start + share * angle };
            let radius = radii[0] + share * (radii[1] - radii[0]);
            let (sin, cos) = turned.sin_cos();
            [center[0] + radius * cos, center[1] + radius * sin]
        };
        Ok((1..chords).map(point).chain([to]).collect())
    }

    /// Paints the line that was drawn.
    fn end_path(&mut self) -> Result<(), ContourFault> {
        let path = std::mem::take(&mut self.path);
        if path.is_empty() {
            return Ok(());
        }
        let area = match self.pen()? {
            Pen::Circle(diameter) if diameter > 0.0 => Area::of_stroke(&path, diameter / 2.0)?,
            Pen::Convex(ring) if !ring.is_empty() => Area::of_swept(&path, &ring),
            _ => {
                self.thin += 1;
                return Ok(());
            }
        };
        self.paint_area(area)
    }

    /// Paints a contour of the region.
    fn end_contour(&mut self) -> Result<(), ContourFault> {
        let Some(region) = &mut self.region else { return Ok(()) };
        let mut ring = std::mem::take(region);
        if ring.first() != ring.last() {
            return Err(ContourFault::Open);
        }
        ring.pop();
        if ring.is_empty() {
            return Ok(());
        }
        let mut area = Area::new();
        area.is_simple = self.pages.drawing.is_simple(&ring);
        area.add(ring);
        self.paint_area(area)
    }

    fn end(&mut self) -> Result<(), ContourFault> {
        self.end_path()?;
        if self.region.is_some() {
            return Err(ContourFault::Malformed("the end of its region (G37)"));
        }
        self.end_repeat();
        match self.frames.len() {
            1 => Ok(()),
            _ => Err(ContourFault::Malformed("the end of its block (%AB*%)")),
        }
    }

    fn finish(mut self, mask_mm: f64) -> Result<Opened, Located> {
        let whole = |fault| ("the picture".to_owned(), fault);
        let objects = self.frames.swap_remove(0).1;
        // The bounds of all objects, and whether any of them clears others.
        let mut bounds = [[f64::MAX; 2], [f64::MIN; 2]];
        let (mut visits, mut clears, mut corners) = (0, false, 0);
        let mut survey = |area: &Area, rows: &Rows, is_clear: bool| {
            clears |= is_clear;
            corners += area.corner_count();
            check(corners)?;
            if let Some([low, high]) = area.bounds(rows) {
                for axis in 0..2 {
                    bounds[0][axis] = bounds[0][axis].min(low[axis]);
                    bounds[1][axis] = bounds[1][axis].max(high[axis]);
                }
            }
            Ok(())
        };
        for_each_area(&objects, &IDENTITY, false, &mut visits, &mut survey).map_err(whole)?;
        let mut coats = Coats::new(bounds);
        let slab = self.pages.mask(&MaskKey::default());
        let drawing = &mut self.pages.drawing;
        let mut add = |area: &Area, rows: &Rows, is_clear: bool| {
            if clears && let Some(of_area) = area.bounds(rows) {
                match coats.add(of_area, is_clear)? {
                    Some(coat) => drawing.set_coat(coat),
                    None => return Ok(()),
                }
            }
            let mut placed = Ring::new();
            for ring in area.rings() {
                placed.clear();
                placed.extend(ring.iter().map(|corner| at(rows, *corner)));
                match area.is_simple {
                    true => drawing.add_loop(slab, &placed, false)?,
                    false => drawing.add_shape(slab, &[placed.clone()], Fill::Solid)?,
                }
            }
            Ok(())
        };
        visits = 0;
        for_each_area(&objects, &IDENTITY, false, &mut visits, &mut add).map_err(whole)?;
        let mut notes = Vec::new();
        let thin = ["line drawn without width", "lines drawn without width"];
        ReadNote::leave_out(&mut notes, thin, self.thin);
        ReadNote::leave_out(&mut notes, ["flash without area", "flashes without area"], self.empty);
        Ok(self.pages.into_masks(1.0, mask_mm, notes))
    }
}

impl Block {
    fn new(name: String, objects: Vec<Object>) -> Self {
        let depths = objects.iter().map(|object| match &object.form {
            Form::Area(..) => 0,
            Form::Copies(copies) => copies.block.depth,
        });
        let depth = 1 + depths.max().unwrap_or(0);
        Self { name, objects, depth }
    }
}

/// Calls `each` with all areas in their places and their order, and whether they are clear.
fn for_each_area(
    objects: &[Object],
    rows: &Rows,
    is_inverted: bool,
    visits: &mut usize,
    each: &mut impl FnMut(&Area, &Rows, bool) -> Result<(), ContourFault>,
) -> Result<(), ContourFault> {
    for Object { is_clear, form } in objects {
        let is_clear = *is_clear != is_inverted;
        match form {
            Form::Area(area, [x, y]) => {
                *visits += 1;
                if *visits > MAX_VISITS {
                    return Err(ContourFault::TooManyCopies("its objects".to_owned()));
                }
                let moved = [[1.0, 0.0, *x], [0.0, 1.0, *y]];
                each(area, &placed(rows, &moved), is_clear)?;
            }
            Form::Copies(Copies { block, rows: of_block, counts, steps }) => {
                for column in 0..counts[0] {
                    for row in 0..counts[1] {
                        *visits += 1;
                        if *visits > MAX_VISITS {
                            return Err(ContourFault::TooManyCopies(block.name.clone()));
                        }
                        let [x, y] = [f64::from(column) * steps[0], f64::from(row) * steps[1]];
                        let moved = placed(&[[1.0, 0.0, x], [0.0, 1.0, y]], of_block);
                        let own = placed(rows, &moved);
                        for_each_area(&block.objects, &own, is_clear, visits, each)?;
                    }
                }
            }
        }
    }
    Ok(())
}

/// The coats of objects: even ones are dark, and odd ones clear all below them. An object's is above
/// all coats of the opposite polarity that it may touch, as far as the cells of a grid say.
struct Coats {
    low: [f64; 2],
    size: [f64; 2],
    /// One more than the topmost dark and clear coat of each cell.
    tops: Vec<[u32; 2]>,
}

impl Coats {
    fn new([low, high]: [[f64; 2]; 2]) -> Self {
        let size =
            [0, 1].map(|axis| ((high[axis] - low[axis]) / CELLS as f64).max(f64::MIN_POSITIVE));
        Self { low, size, tops: vec![[0; 2]; CELLS * CELLS] }
    }

    /// Returns the coat of an object between these corners. `None` if it clears nothing.
    fn add(&mut self, bounds: [[f64; 2]; 2], is_clear: bool) -> Result<Option<u32>, ContourFault> {
        let cells = bounds.map(|corner| {
            [0, 1].map(|axis| {
                let cell = (corner[axis] - self.low[axis]) / self.size[axis];
                (cell.max(0.0) as usize).min(CELLS - 1)
            })
        });
        let [[left, bottom], [right, top]] = cells;
        let rows = (bottom..=top).map(|row| row * CELLS + left..row * CELLS + right + 1);
        let (own, other) = (usize::from(is_clear), usize::from(!is_clear));
        let below = rows.clone().flat_map(|cells| &self.tops[cells]).map(|tops| tops[other]).max();
        let coat = match below.unwrap_or(0) {
            0 if is_clear => return Ok(None),
            below => below,
        };
        if coat > MAX_COATS {
            return Err(ContourFault::TooManyCoats(MAX_COATS));
        }
        for cells in rows {
            for tops in &mut self.tops[cells] {
                tops[own] = tops[own].max(coat + 1);
            }
        }
        Ok(Some(coat))
    }
}

/// Reads `LAX26Y26`: which zeros are left out, absolute coordinates, and digits for x and y.
fn digits(form: &str) -> Result<[Digits; 2], ContourFault> {
    const WRONG: ContourFault = ContourFault::Malformed("a form of coordinates (%FS)");
    let (mut is_absolute, mut omits_trailing) = (false, false);
    let mut found = [None; 2];
    let mut rest = form.bytes();
    while let Some(letter) = rest.next() {
        match letter {
            b'L' | b'D' => {}
            b'T' => omits_trailing = true,
            b'A' => is_absolute = true,
            b'I' => return Err(ContourFault::Command(shown(&format!("FS{form}")))),
            // The digits of other codes.
            b'N' | b'G' | b'M' => {
                rest.next();
            }
            b'X' | b'Y' => {
                let digit = |byte: Option<u8>| {
                    let byte = byte.filter(u8::is_ascii_digit).ok_or(WRONG)?;
                    Ok::<_, ContourFault>(usize::from(byte - b'0'))
                };
                let [whole, fraction] = [digit(rest.next())?, digit(rest.next())?];
                found[usize::from(letter == b'Y')] = Some([whole, fraction]);
            }
            _ => return Err(WRONG),
        }
    }
    let [Some(x), Some(y)] = found else { return Err(WRONG) };
    if !is_absolute {
        return Err(WRONG);
    }
    Ok([x, y].map(|[whole, fraction]| Digits { whole, fraction, omits_trailing }))
}

/// Reads the number of an aperture, as in `D10C,0.5`, and what follows.
fn code_of(text: &str) -> Result<(u32, &str), ContourFault> {
    let wrong = || ContourFault::Malformed("an aperture's number (D10 or above)");
    let number = text.strip_prefix('D').ok_or_else(wrong)?;
    let end = number.find(|c: char| !c.is_ascii_digit()).unwrap_or(number.len());
    let code = number[..end].parse().ok().filter(|code| *code >= 10);
    Ok((code.ok_or_else(wrong)?, &number[end..]))
}

fn finite(text: &str) -> Result<f64, ContourFault> {
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(ContourFault::Malformed("a number")),
    }
}

/// Returns the kind of a thing and its name.
fn named(kind: &str, name: &str) -> String {
    format!("{kind} {}", shown(name))
}

fn shown(text: &str) -> String {
    one_line(text).chars().take(40).collect()
}
