//! Reads the Common Layer Interface, version 2.0 and before, as ASCII and as binary.
//!
//! `$$LAYER/z` is the height of a layer's top; its bottom is the top of the layer below it.

use std::io::{self, BufRead, Read};

use super::error::ContourFault;
use super::{Located, Opened, Pages};
use crate::fill::Fill;
use crate::prisms::MAX_CORNERS;
use crate::read_note::ReadNote;

/// A limit above the length of any word: a command or a number.
const MAX_WORD: usize = 1 << 10;

struct CliReader<R> {
    text: R,
    /// The bytes read so far.
    at: u64,
    pages: Pages,
    corners: Vec<[f64; 2]>,
    open_lines: u64,
    hatches: u64,
    labels: u64,
}

/// Reads a file. Lengths are in its own unit, whose millimeters come with the result.
pub(super) fn read(text: impl BufRead) -> io::Result<Result<Opened, Located>> {
    let mut reader = CliReader {
        text,
        at: 0,
        pages: Pages::new(Fill::Solid),
        corners: Vec::new(),
        open_lines: 0,
        hatches: 0,
        labels: 0,
    };
    let outcome = reader.read()?;
    let at = format!("byte {}", reader.at);
    Ok(outcome.map_err(|fault| (at, fault)).and_then(|unit_mm| reader.finish(unit_mm)))
}

type Step<T> = io::Result<Result<T, ContourFault>>;

/// Returns the value of a step, or its fault.
macro_rules! step {
    ($step:expr) => {
        match $step? {
            Ok(value) => value,
            Err(fault) => return Ok(Err(fault)),
        }
    };
}

impl<R: BufRead> CliReader<R> {
    fn read(&mut self) -> Step<f64> {
        let (mut unit_mm, mut is_binary) = (1.0, false);
        loop {
            let Some(name) = self.command()? else { return Ok(Err(ContourFault::CutHeader)) };
            match name.as_str() {
                _ if self.peek()?.is_none() && name != "HEADEREND" => {
                    return Ok(Err(ContourFault::CutHeader));
                }
                "UNITS" => match step!(self.number()) {
                    // The number may go on, too.
                    _ if self.peek()?.is_none() => return Ok(Err(ContourFault::CutHeader)),
                    unit if unit > 0.0 => unit_mm = unit,
                    _ => return Ok(Err(ContourFault::Malformed("a unit in millimeters"))),
                },
                "BINARY" => is_binary = true,
                "ALIGN" => return Ok(Err(ContourFault::Unread("aligned data ($$ALIGN)"))),
                "USERDATA" => {
                    // Data of a stated length follow, which may be any bytes.
                    while self.peek()?.is_some_and(|byte| byte != b',') {
                        self.byte()?;
                    }
                    self.byte()?;
                    let length = step!(self.number());
                    self.skip(length as u64)?;
                }
                "LABEL" => self.labels += 1,
                "HEADEREND" => break,
                _ => {}
            }
        }
        match is_binary {
            true => step!(self.binary()),
            false => step!(self.ascii()),
        }
        Ok(Ok(unit_mm))
    }

    /// Reads the name of the next command, up to its `/`. Returns `None` at the end of the file.
    fn command(&mut self) -> io::Result<Option<String>> {
        let (mut before, mut is_comment) = (0, false);
        loop {
            let Some(byte) = self.byte()? else { return Ok(None) };
            // Comments stand between `//`.
            if byte == b'/' && before == b'/' {
                (is_comment, before) = (!is_comment, 0);
            } else if !is_comment && byte == b'$' && before == b'$' {
                break;
            } else {
                before = byte;
            }
        }
        let mut name = String::new();
        // Binary data follow the header's end at once.
        while let Some(byte) = self.peek()?
            && byte.is_ascii_alphanumeric()
            && name.len() < MAX_WORD
            && name != "HEADEREND"
        {
            name.push(byte.to_ascii_uppercase().into());
            self.byte()?;
        }
        match self.peek()? {
            Some(b'/') if name != "HEADEREND" => drop(self.byte()?),
            // The name may go on where the file was cut off.
            None if !["HEADEREND", "GEOMETRYEND"].contains(&&*name) => return Ok(None),
            _ => {}
        }
        Ok(Some(name))
    }

    fn peek(&mut self) -> io::Result<Option<u8>> {
        Ok(self.text.fill_buf()?.first().copied())
    }

    fn byte(&mut self) -> io::Result<Option<u8>> {
        let byte = self.peek()?;
        if byte.is_some() {
            self.text.consume(1);
            self.at += 1;
        }
        Ok(byte)
    }

    fn skip(&mut self, bytes: u64) -> io::Result<()> {
        self.at += io::copy(&mut self.text.by_ref().take(bytes), &mut io::sink())?;
        Ok(())
    }

    fn bytes<const N: usize>(&mut self) -> Step<[u8; N]> {
        let mut bytes = [0; N];
        match self.text.read_exact(&mut bytes) {
            Ok(()) => self.at += N as u64,
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                return Ok(Err(ContourFault::CutOff));
            }
            Err(error) => return Err(error),
        }
        Ok(Ok(bytes))
    }

    /// Reads the geometry of an ASCII file. Numbers are read one by one, so that a line of any
    /// length needs no memory beside its corners.
    fn ascii(&mut self) -> Step<()> {
        loop {
            let Some(name) = self.command()? else { return Ok(Err(ContourFault::CutOff)) };
            match name.as_str() {
                "GEOMETRYSTART" => {}
                "GEOMETRYEND" => return Ok(Ok(())),
                "LAYER" => {
                    let z = step!(self.number());
                    if let Err(fault) = self.pages.begin(z, None) {
                        return Ok(Err(fault));
                    }
                }
                "POLYLINE" => {
                    step!(self.number());
                    let direction = step!(self.number());
                    let count = step!(self.number());
                    if !(count >= 0.0 && count.fract() == 0.0) {
                        return Ok(Err(ContourFault::Malformed("a number of corners")));
                    }
                    self.corners.clear();
                    // The count may be a lie, so it reserves nothing.
                    let mut left = count;
                    while left > 0.0 {
                        left -= 1.0;
                        let corner = [step!(self.number()), step!(self.number())];
                        self.corners.push(corner);
                        if self.corners.len() > MAX_CORNERS {
                            return Ok(Err(ContourFault::TooManyCorners(MAX_CORNERS)));
                        }
                    }
                    if let Err(fault) = self.polyline(direction) {
                        return Ok(Err(fault));
                    }
                }
                "HATCHES" => self.hatches += 1,
                "" => return Ok(Err(ContourFault::Malformed("a command of the geometry"))),
                _ => return Ok(Err(ContourFault::Unread("an unknown command"))),
            }
        }
    }

    /// Reads a number, and the comma behind it.
    fn number(&mut self) -> Step<f64> {
        let mut word = Vec::new();
        while let Some(byte) = self.peek()? {
            let is_blank = byte.is_ascii_whitespace();
            if byte == b'$' || word.len() >= MAX_WORD || is_blank && !word.is_empty() {
                break;
            }
            self.byte()?;
            if byte == b',' {
                break;
            }
            if !is_blank {
                word.push(byte);
            }
        }
        // Blanks may stand before the comma.
        while self.peek()?.is_some_and(|byte| byte.is_ascii_whitespace()) {
            self.byte()?;
        }
        if self.peek()? == Some(b',') && !word.is_empty() {
            self.byte()?;
        }
        let number = str::from_utf8(&word).ok().and_then(|word| word.parse::<f64>().ok());
        Ok(match number {
            Some(number) if number.is_finite() => Ok(number),
            Some(_) => Err(ContourFault::NotFinite),
            None if self.peek()?.is_none() => Err(ContourFault::CutOff),
            None => Err(ContourFault::Malformed("a number")),
        })
    }

    /// Reads the geometry of a binary file: little-endian, to the end of the file.
    fn binary(&mut self) -> Step<()> {
        loop {
            if self.peek()?.is_none() {
                return Ok(Ok(()));
            }
            let code = u16::from_le_bytes(step!(self.bytes()));
            match code {
                // Long and short commands: 32-bit floating-point numbers, and 16-bit integers.
                127 => {
                    let z = f32::from_le_bytes(step!(self.bytes()));
                    if let Err(fault) = self.pages.begin(shortest(z), None) {
                        return Ok(Err(fault));
                    }
                }
                128 => {
                    let z = u16::from_le_bytes(step!(self.bytes()));
                    if let Err(fault) = self.pages.begin(f64::from(z), None) {
                        return Ok(Err(fault));
                    }
                }
                129 => {
                    let [_, direction, count] = step!(self.words());
                    self.corners.clear();
                    for _ in 0..count {
                        let [x, y] = step!(self.words()).map(f64::from);
                        self.corners.push([x, y]);
                    }
                    if let Err(fault) = self.polyline(direction.into()) {
                        return Ok(Err(fault));
                    }
                }
                130 => {
                    step!(self.bytes::<4>());
                    let direction = i32::from_le_bytes(step!(self.bytes()));
                    let count = i32::from_le_bytes(step!(self.bytes()));
                    if count < 0 {
                        return Ok(Err(ContourFault::Malformed("a number of corners")));
                    }
                    self.corners.clear();
                    for _ in 0..count {
                        let [x, y] = [step!(self.bytes()), step!(self.bytes())];
                        self.corners.push([x, y].map(|it| f32::from_le_bytes(it).into()));
                        if self.corners.len() > MAX_CORNERS {
                            return Ok(Err(ContourFault::TooManyCorners(MAX_CORNERS)));
                        }
                    }
                    if let Err(fault) = self.polyline(direction.into()) {
                        return Ok(Err(fault));
                    }
                }
                131 => {
                    let [_, count] = step!(self.words());
                    self.skip(8 * u64::from(count))?;
                    self.hatches += 1;
                }
                132 => {
                    step!(self.bytes::<4>());
                    let count = u32::from_le_bytes(step!(self.bytes()));
                    self.skip(16 * u64::from(count))?;
                    self.hatches += 1;
                }
                _ => return Ok(Err(ContourFault::Malformed("a command of binary CLI"))),
            }
        }
    }

    fn words<const N: usize>(&mut self) -> Step<[u16; N]> {
        let mut words = [0; N];
        for word in &mut words {
            *word = u16::from_le_bytes(step!(self.bytes()));
        }
        Ok(Ok(words))
    }

    /// Adds the corners as a polygon of a direction: 0 around holes, 1 around areas, 2 open.
    fn polyline(&mut self, direction: f64) -> Result<(), ContourFault> {
        let is_hole = match direction {
            0.0 => true,
            1.0 => false,
            2.0 => {
                self.open_lines += 1;
                return Ok(());
            }
            _ => return Err(ContourFault::Malformed("a direction from 0 to 2")),
        };
        if self.corners.first() != self.corners.last() {
            return Err(ContourFault::Open);
        }
        let slab = self.pages.slab().ok_or(ContourFault::NoLayer)?;
        self.pages.drawing.add_turned(slab, &self.corners, is_hole)
    }

    fn finish(self, unit_mm: f64) -> Result<Opened, Located> {
        let mut notes = Vec::new();
        ReadNote::leave_out(&mut notes, ["open line", "open lines"], self.open_lines);
        ReadNote::leave_out(&mut notes, ["group of hatches", "groups of hatches"], self.hatches);
        // The parts of all labels are built together.
        if self.labels > 1 {
            let what = ["name of a part", "names of parts, which are one part here,"];
            ReadNote::leave_out(&mut notes, what, self.labels);
        }
        let none =
            || ("the geometry".to_owned(), ContourFault::NoArea("; it has no layer".to_owned()));
        self.pages.into_stack(unit_mm, notes).ok_or_else(none)
    }
}

/// Returns the number with the shortest decimals that round to a 32-bit number: 0.05 and not
/// 0.0500000007.
fn shortest(number: f32) -> f64 {
    number.to_string().parse().unwrap_or(f64::from(number))
}
