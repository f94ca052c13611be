//! Reads and writes layouts as JSON files.
//!
//! ```json
//! {
//!   "area_mm": [101.6, 114.3],
//!   "copies": [
//!     {"part": "blade.tif", "x_mm": 2.54, "y_mm": 3.5, "turn": 90}
//!   ]
//! }
//! ```
//!
//! `x_mm` and `y_mm` are the distances from the build area's lower left corner to the lower left
//! corner of the copy's image, as it lies there, rounded to pixels. The image is the whole page
//! with its black margin, which may reach beyond the area where the part does not. `turn` is 0, 90,
//! 180 or 270 degrees counterclockwise; `"mirror": true` mirrors the image left to right before it
//! is turned. `serial` is a copy's serial number, if it has one.

use std::collections::HashMap;

use lamp_stack::{Frame, Length, Orientation, Size, one_line};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::placed::RequestedPlacement;
use super::{CopyPlacement, Layout, PartStack, PixelSize, TileError};

/// A layout as a file has it.
///
/// ```
/// use lamp_build::LayoutFile;
///
/// let text = r#"{"copies": [{"part": "blade.tif", "x_mm": 2, "y_mm": 3, "turn": 90}]}"#;
/// let file = LayoutFile::from_json(text)?;
/// assert_eq!(LayoutFile::from_json(&file.to_json())?, file);
/// # Ok::<(), lamp_build::LayoutError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LayoutFile {
    /// The width and height of the build area in millimeters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    area_mm: Option<[f64; 2]>,
    copies: Vec<CopyEntry>,
}

/// A copy as a file has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CopyEntry {
    /// The part's stack.
    pub part: String,
    /// From the area's left edge to the left edge of the copy's image.
    pub x_mm: f64,
    /// From the area's lower edge to the lower edge of the copy's image.
    pub y_mm: f64,
    /// Degrees counterclockwise, after it is mirrored.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub turn: u32,
    /// Whether its image is mirrored left to right.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub mirror: bool,
    /// Its serial number, which no other copy has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub serial: Option<String>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_zero(turn: &u32) -> bool {
    *turn == 0
}

/// Why a text is no layout, or one that the parts do not allow.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LayoutError {
    /// The text is no JSON, or has other keys.
    #[error(
        "this is not a layout: {problem}; write {{\"copies\": [{{\"part\": \"blade.tif\", \"x_mm\": 1, \"y_mm\": 1, \"turn\": 90}}]}}"
    )]
    Json {
        /// The parser's message, with the line and column.
        problem: String,
    },
    /// A number is no distance on a build area.
    #[error("{place}: {value} is not a length on a build area")]
    Number {
        /// The key, as `copies[3].x_mm`.
        place: String,
        /// Its value.
        value: f64,
    },
    /// A turn is no multiple of 90 degrees below 360.
    #[error("copies[{copy}].turn: {turn} is not a turn: write 0, 90, 180 or 270")]
    Turn {
        /// The copy's index, from 0.
        copy: usize,
        /// The turn in degrees.
        turn: u32,
    },
    /// A serial number says nothing.
    #[error("copies[{copy}].serial: it is empty: leave it out")]
    EmptySerial {
        /// The copy's index, from 0.
        copy: usize,
    },
    /// Two copies have the same serial number.
    #[error("copies[{copy}].serial: copies[{first}] is {serial:?}, too")]
    SerialTwice {
        /// The copy's index, from 0.
        copy: usize,
        /// The index of the first copy with this serial number, from 0.
        first: usize,
        /// The serial number.
        serial: String,
    },
    /// The layout has no copy.
    #[error("there is no copy in it")]
    Empty,
    /// No stack has the name of a copy's part.
    #[error("copies[{copy}].part: no stack is called {part:?}: there is {}", known.join(", "))]
    Unknown {
        /// The copy's index, from 0.
        copy: usize,
        /// The name.
        part: String,
        /// The stacks there are.
        known: Vec<String>,
    },
    /// A stack has no copy.
    #[error("{part} has no copy in it")]
    Unused {
        /// The stack.
        part: String,
    },
    /// The copies overlap or reach beyond the area, or the parts do not go together.
    #[error(transparent)]
    Tile(#[from] TileError),
}

/// A side of 2^26 pixels at 1 dpi is shorter than this.
const MAX_MM: f64 = 1e10;

impl LayoutFile {
    /// Reads a layout.
    ///
    /// # Errors
    /// Returns an error if the text is not a layout, or a value cannot stand on a build area.
    pub fn from_json(text: &str) -> Result<Self, LayoutError> {
        let file: Self = serde_json::from_str(text)
            .map_err(|error| LayoutError::Json { problem: one_line(&error.to_string()) })?;
        for (axis, value) in ["[0]", "[1]"].into_iter().zip(file.area_mm.into_iter().flatten()) {
            let is_side = value > 0.0 && value < MAX_MM;
            check_number(is_side, value, || format!("area_mm{axis}"))?;
        }
        for (index, copy) in file.copies.iter().enumerate() {
            for (key, value) in [("x_mm", copy.x_mm), ("y_mm", copy.y_mm)] {
                check_number(value.abs() < MAX_MM, value, || format!("copies[{index}].{key}"))?;
            }
            if copy.turn % 90 != 0 || copy.turn >= 360 {
                return Err(LayoutError::Turn { copy: index, turn: copy.turn });
            }
        }
        file.check_serials()?;
        if file.copies.is_empty() { Err(LayoutError::Empty) } else { Ok(file) }
    }

    fn check_serials(&self) -> Result<(), LayoutError> {
        let mut known = HashMap::new();
        for (copy, entry) in self.copies.iter().enumerate() {
            let Some(serial) = &entry.serial else { continue };
            if serial.trim().is_empty() {
                return Err(LayoutError::EmptySerial { copy });
            }
            if let Some(first) = known.insert(serial, copy) {
                let serial = serial.clone();
                return Err(LayoutError::SerialTwice { copy, first, serial });
            }
        }
        Ok(())
    }

    /// Returns the copies, in order.
    pub fn copies(&self) -> &[CopyEntry] {
        &self.copies
    }

    /// Returns the layout as JSON, with a line for each copy.
    pub fn to_json(&self) -> String {
        // A copy a line reads and compares well; the pretty form of serde_json takes a line for
        // each key.
        let line = |copy| serde_json::to_string(copy).expect("texts and numbers are JSON");
        let copies: Vec<_> = self.copies.iter().map(|copy| format!("    {}", line(copy))).collect();
        let area =
            self.area_mm.map(|[width, height]| format!("  \"area_mm\": [{width}, {height}],\n"));
        format!(
            "{{\n{}  \"copies\": [\n{}\n  ]\n}}\n",
            area.unwrap_or_default(),
            copies.join(",\n")
        )
    }

    /// Returns the build area, if the file has one.
    pub fn area(&self) -> Option<Size> {
        let [width, height] = self.area_mm?.map(Length::from_mm);
        Some(Size { width, height })
    }

    /// Places copies of parts as the file says. It names a part by the part's name or
    /// by the end of it, as `blade.tif` for `stacks/blade.tif`.
    ///
    /// # Errors
    /// Returns an error if a copy's part is unknown or a part has no copy, and if copies
    /// overlap or reach beyond the area.
    pub fn place(&self, parts: Vec<PartStack>, area: Size) -> Result<Layout, LayoutError> {
        let mut requested = Vec::new();
        for (index, copy) in self.copies.iter().enumerate() {
            let unknown = || LayoutError::Unknown {
                copy: index,
                part: copy.part.clone(),
                known: parts.iter().map(|part| part.name().to_owned()).collect(),
            };
            let part = part_called(&parts, &copy.part).ok_or_else(unknown)?;
            requested.push(copy.request(part, &parts[part], area));
        }
        if let Some(unused) =
            (0..parts.len()).find(|part| requested.iter().all(|request| request.part != *part))
        {
            return Err(LayoutError::Unused { part: parts[unused].name().to_owned() });
        }
        let mut layout = Layout::placed(parts, &requested, area)?;
        layout.serials = self.copies.iter().map(|copy| copy.serial.clone()).collect();
        Ok(layout)
    }
}

impl Layout {
    /// Returns the layout as a file, which gives the same layout again.
    pub fn to_file(&self) -> LayoutFile {
        // Whole nanometers hide the rounding of pitches. Zero is added to turn -0.0 into 0.0.
        let nm = |mm: f64| (mm * 1e6).round() / 1e6 + 0.0;
        let Size { width, height } = self.area;
        let [pitch_x, pitch_y] = self.pitch.mm();
        let line = |(copy, at): (usize, &CopyPlacement)| {
            let part = &self.parts[at.part];
            let image = image_of(part, at);
            CopyEntry {
                part: label(&self.parts, at.part).to_owned(),
                x_mm: nm(image.left as f64 * pitch_x),
                y_mm: nm(height.mm() - (image.top + i64::from(image.height)) as f64 * pitch_y),
                turn: at.turn.quarters() * 90,
                mirror: at.turn.is_mirrored(),
                serial: self.serials.get(copy).cloned().flatten(),
            }
        };
        LayoutFile {
            area_mm: Some([width.mm(), height.mm()]),
            copies: self.placements.iter().enumerate().map(line).collect(),
        }
    }
}

impl CopyEntry {
    fn request(&self, index: usize, part: &PartStack, area: Size) -> RequestedPlacement {
        let turn = Orientation::new(self.turn / 90, self.mirror);
        let [pitch_x, pitch_y] = part.pitch().mm();
        let (margin_left, margin_top) = margins(part, turn);
        let image = part.image();
        let (_, height) = turn.size(image.width, image.height);
        // `from_json` limits lengths to 1e10 mm, so they are far below 2^63 pixels at any
        // resolution.
        let left = (self.x_mm / pitch_x).round() as i64;
        // Files count from the lower edge, images from the upper one.
        let bottom = ((area.height.mm() - self.y_mm) / pitch_y).round() as i64;
        let top = bottom - i64::from(height);
        RequestedPlacement { part: index, turn, left: left + margin_left, top: top + margin_top }
    }
}

/// Returns the frame of a copy's whole image on the build.
fn image_of(part: &PartStack, at: &CopyPlacement) -> Frame {
    let (margin_left, margin_top) = margins(part, at.turn);
    let image = part.image();
    let (width, height) = at.turn.size(image.width, image.height);
    Frame {
        left: i64::from(at.left) - margin_left,
        top: i64::from(at.top) - margin_top,
        width,
        height,
    }
}

/// Returns the distances from the oriented image's left and top edge to its frame.
fn margins(part: &PartStack, turn: Orientation) -> (i64, i64) {
    let PixelSize { width, height } = part.image();
    let frame = part.frame();
    let mut left = frame.left;
    let mut top = frame.top;
    let mut right = i64::from(width) - left - i64::from(frame.width);
    let mut bottom = i64::from(height) - top - i64::from(frame.height);
    if turn.is_mirrored() {
        (left, right) = (right, left);
    }
    for _ in 0..turn.quarters() {
        // A quarter counterclockwise brings the right edge to the top.
        (left, top, right, bottom) = (top, right, bottom, left);
    }
    (left, top)
}

fn check_number(is_right: bool, value: f64, place: impl Fn() -> String) -> Result<(), LayoutError> {
    if is_right { Ok(()) } else { Err(LayoutError::Number { place: place(), value }) }
}

/// Returns the part of a name, or the one whose label it is.
fn part_called(parts: &[PartStack], name: &str) -> Option<usize> {
    let by_name = parts.iter().position(|part| part.name() == name);
    // A whole name goes first, since it may be the label of another part.
    by_name.or_else(|| (0..parts.len()).find(|&part| label(parts, part) == name))
}

/// Returns the file name in a part's name, or all of it if another part has the same.
fn label(parts: &[PartStack], part: usize) -> &str {
    fn file_name(part: &PartStack) -> &str {
        part.name().rsplit(['/', '\\']).next().unwrap_or_default()
    }
    let own = file_name(&parts[part]);
    let is_unique = parts.iter().filter(|part| file_name(part) == own).count() == 1;
    if is_unique { own } else { parts[part].name() }
}
