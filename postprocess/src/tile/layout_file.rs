//! Layouts as JSON files.
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
//! x and y are where the lower left corner of the copy's image stands, turned as
//! it is, from the lower left corner of the build area, to the nearest pixel. The
//! image is all of the page, with its black margin: it may reach beyond the
//! area where the part's extents do not. `turn` is 0, 90, 180 or 270 degrees
//! anticlockwise; with `"mirror": true` the image is mirrored left to right
//! before it is turned.

use lamp_stack::{Frame, Length, Orientation, Size};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::layout::RequestedPlacement;
use super::{CopyPlacement, Layout, PartStack, PixelSize, TileError};

/// A layout as it stands in a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LayoutFile {
    /// The build area in millimetres, width and height.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    area_mm: Option<[f64; 2]>,
    copies: Vec<CopyEntry>,
}

/// A copy as it stands in a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CopyEntry {
    part: String,
    x_mm: f64,
    y_mm: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    turn: u32,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    mirror: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_zero(turn: &u32) -> bool {
    *turn == 0
}

/// Why a text is no layout.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LayoutError {
    /// It is not such a JSON file.
    #[error(
        "this is not a layout: {0}; write {{\"copies\": [{{\"part\": \"blade.tif\", \"x_mm\": 1, \"y_mm\": 1, \"turn\": 90}}]}}"
    )]
    Json(#[from] serde_json::Error),
    /// A number that is no place or no area.
    #[error("{place}: {value} is no length on a build area")]
    Number {
        /// Where it stands, as `copies[3].x_mm`.
        place: String,
        /// What stands there.
        value: f64,
    },
    /// No right angle.
    #[error("copies[{copy}].turn: {turn} is no turn: write 0, 90, 180 or 270")]
    Turn {
        /// Which copy, from 0.
        copy: usize,
        /// What stands there.
        turn: u32,
    },
    /// There is no copy.
    #[error("there is no copy in it")]
    Empty,
    /// No stack is called so.
    #[error("copies[{copy}].part: no stack is called {part:?}: there is {}", known.join(", "))]
    Unknown {
        /// Which copy, from 0.
        copy: usize,
        /// What stands there.
        part: String,
        /// The stacks there are.
        known: Vec<String>,
    },
    /// A stack is not used.
    #[error("{part} has no copy in it")]
    Unused {
        /// The stack.
        part: String,
    },
    /// The copies cannot stand there.
    #[error(transparent)]
    Tile(#[from] TileError),
}

/// No build is larger, in millimetres: 2^26 pixels at 1 dpi.
const MAX_MM: f64 = 1e10;

impl LayoutFile {
    /// Reads a layout.
    ///
    /// # Errors
    /// Where the text is none.
    pub fn from_json(text: &str) -> Result<Self, LayoutError> {
        let file: Self = serde_json::from_str(text)?;
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
        if file.copies.is_empty() { Err(LayoutError::Empty) } else { Ok(file) }
    }

    /// Writes the layout, a line for each copy.
    pub fn to_json(&self) -> String {
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

    /// The build area, where the file has one.
    pub fn area(&self) -> Option<Size> {
        let [width, height] = self.area_mm?.map(Length::from_mm);
        Some(Size { width, height })
    }

    /// Places copies of parts as the file says. A part is called by its name or
    /// by the last of it, as `blade.tif` of `stacks/blade.tif`.
    ///
    /// # Errors
    /// Where no part is called as a copy is, or a part has no copy; where copies
    /// overlap or are not on the area.
    pub fn place(&self, parts: Vec<PartStack>, area: Size) -> Result<Layout, LayoutError> {
        let mut wishes = Vec::new();
        for (index, copy) in self.copies.iter().enumerate() {
            let unknown = || LayoutError::Unknown {
                copy: index,
                part: copy.part.clone(),
                known: parts.iter().map(|part| part.name().to_owned()).collect(),
            };
            let part = part_called(&parts, &copy.part).ok_or_else(unknown)?;
            wishes.push(copy.wish(part, &parts[part], area));
        }
        if let Some(unused) =
            (0..parts.len()).find(|part| wishes.iter().all(|wish| wish.part != *part))
        {
            return Err(LayoutError::Unused { part: parts[unused].name().to_owned() });
        }
        Ok(Layout::placed(parts, &wishes, area)?)
    }
}

impl Layout {
    /// The layout as a file, which gives the same layout again.
    pub fn to_file(&self) -> LayoutFile {
        let nm = |mm: f64| (mm * 1e6).round() / 1e6 + 0.0;
        let Size { width, height } = self.area;
        let pitch = self.dpi.pitch().mm();
        let line = |at: &CopyPlacement| {
            let part = &self.parts[at.part];
            let image = image_of(part, at);
            CopyEntry {
                part: label(&self.parts, at.part).to_owned(),
                x_mm: nm(image.left as f64 * pitch),
                y_mm: nm(height.mm() - (image.top + i64::from(image.height)) as f64 * pitch),
                turn: at.turn.quarters() * 90,
                mirror: at.turn.is_mirrored(),
            }
        };
        LayoutFile {
            area_mm: Some([width.mm(), height.mm()]),
            copies: self.placements.iter().map(line).collect(),
        }
    }
}

impl CopyEntry {
    fn wish(&self, index: usize, part: &PartStack, area: Size) -> RequestedPlacement {
        let turn = Orientation::new(self.turn / 90, self.mirror);
        let pitch = part.dpi().pitch().mm();
        let (margin_left, margin_top) = margins(part, turn);
        let image = part.image();
        let (_, height) = turn.size(image.width, image.height);
        let left = (self.x_mm / pitch).round() as i64;
        let bottom = ((area.height.mm() - self.y_mm) / pitch).round() as i64;
        let top = bottom - i64::from(height);
        RequestedPlacement { part: index, turn, left: left + margin_left, top: top + margin_top }
    }
}

/// Where all of a copy's image is on the build.
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

/// How far from the turned image's left and top its frame begins.
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
        // Anticlockwise: what was on the right comes to the top.
        (left, top, right, bottom) = (top, right, bottom, left);
    }
    (left, top)
}

fn check_number(is_right: bool, value: f64, place: impl Fn() -> String) -> Result<(), LayoutError> {
    if is_right { Ok(()) } else { Err(LayoutError::Number { place: place(), value }) }
}

/// The part of that name, or the one whose name ends so.
fn part_called(parts: &[PartStack], name: &str) -> Option<usize> {
    let by_name = parts.iter().position(|part| part.name() == name);
    by_name.or_else(|| (0..parts.len()).find(|&part| label(parts, part) == name))
}

/// The last of a part's name, if no other part's ends so.
fn label(parts: &[PartStack], part: usize) -> &str {
    let last = |part: &PartStack| part.name().rsplit(['/', '\\']).next().map(str::to_owned);
    let own = last(&parts[part]);
    let name = parts[part].name();
    match parts.iter().filter(|part| last(part) == own).count() {
        1 => &name[name.len() - own.map_or(0, |own| own.len())..],
        _ => name,
    }
}
