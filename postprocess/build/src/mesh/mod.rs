//! Fills the empty places of a build area with a mesh.
//!
//! Its walls keep the uncured suspension from sloshing when the next layer is spread
//! (002 section 2.4.2, figure 30). A moat around each part, and all that it encloses,
//! stays free; break lines cut through the mesh so that parts come free of it. The
//! first layers are mesh alone: the parts stand on them and break off (section 1.1.3).
//! Pieces of mesh that would float or are small are left out.

mod base_layers;
mod break_lines;
#[cfg(test)]
mod hanging_tests;
mod kept;
mod lattice;
mod mesh_options;
mod mesh_rows;
#[cfg(test)]
mod mesh_tests;
mod pieces;

use lamp_stack::{Frame, Length, Mask, MaskBuilder, Op, white_runs};

use self::break_lines::{BreakLines, Rect};
use self::lattice::{Lattice, toggle};
use super::{Layout, PartStack, PixelSize, TileError};
use lamp_offset::{offset_one_bit, without_holes};

pub(super) use base_layers::{base_page, on_base};
pub(super) use kept::KeptMesh;
pub use mesh_options::{CellShape, MeshOptions, MeshPattern, Moat};
pub(super) use mesh_rows::MeshRows;

/// The mesh of a layout. Lengths are in pixels.
#[derive(Clone, Debug)]
pub(super) struct BuildMesh {
    lattice: Lattice,
    /// The walls that break lines leave.
    standing: MeshRows,
    clearance: f64,
    pub(super) moat: Moat,
    /// The least number of pixels that a piece of mesh has.
    least_piece: u64,
    pub(super) base_layers: u32,
    build: PixelSize,
    /// The number of transitions in all rows, without moats.
    changes: usize,
}

impl Layout {
    /// Surrounds the copies with a mesh.
    ///
    /// # Errors
    /// Returns an error if the mesh would have no holes, no room next to the moats or more runs
    /// than an image can hold, or if moats are to follow outlines and a part was read without its
    /// outline.
    pub fn with_mesh(mut self, options: &MeshOptions) -> Result<Self, TileError> {
        let pixels = |length: Length| length.pixels(self.dpi).max(0.0);
        let clearance = pixels(options.clearance);
        let longest = self.pixels.width.max(self.pixels.height);
        // A wider moat leaves no mesh. The limit also keeps pixels within u32 below.
        if clearance > f64::from(longest) {
            return Err(TileError::WideMoat { clearance: options.clearance, area_mm: self.area });
        }
        let least_piece = options.least_piece_mm2 / self.dpi.pitch().mm().powi(2);
        if least_piece > f64::from(self.pixels.width) * f64::from(self.pixels.height) {
            let least_mm2 = options.least_piece_mm2;
            return Err(TileError::LargePiece { least_mm2, area_mm: self.area });
        }
        let lattice = options.lattice(self.dpi, self.pixels)?;
        let whole = |length| (pixels(length).round().min(f64::from(longest))) as u32;
        let breaks = match whole(options.break_width) {
            0 => BreakLines::default(),
            width => {
                let area = [self.pixels.width, self.pixels.height];
                BreakLines::new(&self.places(clearance), area, width, whole(options.break_pitch))
                    .ok_or(TileError::ManyBreaks)?
            }
        };
        if options.moat == Moat::Outline
            && let Some(part) = self.parts.iter().find(|part| part.outline().is_none())
        {
            return Err(TileError::NoOutline { name: part.name().to_owned() });
        }
        let mut mesh = BuildMesh {
            lattice,
            standing: MeshRows::default(),
            clearance,
            moat: options.moat,
            least_piece: least_piece.ceil() as u64,
            base_layers: options.base_layers,
            build: self.pixels,
            changes: 0,
        };
        mesh.stand(&breaks);
        self.mesh = Some(mesh);
        self.command += &options.command();
        Ok(self)
    }

    /// Returns the boxes around the copies and their clearance.
    fn places(&self, clearance: f64) -> Vec<Rect> {
        let free = clearance.ceil() as u32;
        let place = |at: &super::CopyPlacement| {
            let PixelSize { width, height } = self.parts[at.part].size(at.turn);
            Rect {
                left: at.left.saturating_sub(free),
                top: at.top.saturating_sub(free),
                right: (at.left + width + free).min(self.pixels.width),
                bottom: (at.top + height + free).min(self.pixels.height),
            }
        };
        self.placements.iter().map(place).collect()
    }
}

impl BuildMesh {
    /// Returns the memory that its image takes, estimated in bytes.
    pub(super) fn bytes(&self) -> usize {
        (self.changes + self.build.height as usize) * size_of::<u32>()
    }

    /// Returns whether pieces that are not small may hang on nothing. Other moats only grow, so the
    /// mesh of each layer is inside the mesh of the layer below.
    pub(super) fn tells_loose(&self) -> bool {
        self.moat == Moat::Layer
    }

    /// Makes the walls that break lines leave.
    fn stand(&mut self, breaks: &BreakLines) {
        let (mut wall, mut left) = (Vec::new(), Vec::new());
        for index in 0..self.build.height {
            self.wall_row(index, &mut wall);
            Op::Difference.rows(&wall, breaks.row(index), &mut left);
            self.standing.push(&left);
        }
        self.changes = self.standing.change_count();
    }

    /// Returns the number of pixels that a moat may reach beyond its part.
    pub(super) fn reach(&self) -> u32 {
        self.clearance.ceil() as u32 + 1
    }

    /// Returns the moat around the white pixels, on an image that is larger by the
    /// [`reach`](Self::reach) on every side. Cavities belong to it, because mesh in them could not
    /// be removed.
    fn moat(&self, white: &Mask) -> Mask {
        let reach = self.reach();
        let frame = Frame {
            left: -i64::from(reach),
            top: -i64::from(reach),
            width: white.width() + 2 * reach,
            height: white.height() + 2 * reach,
        };
        // Offsets round to whole pixels: half a pixel more leaves no less than the
        // clearance between the last pixel of the part and the first of the mesh.
        without_holes(&offset_one_bit(&white.framed(frame), -(self.clearance + 0.5)))
    }

    /// Returns the mesh without moats and break lines.
    pub(super) fn whole(&self) -> Mask {
        let PixelSize { width, height } = self.build;
        let mut mask = MaskBuilder::new(width);
        mask.reserve(height as usize, self.changes);
        let mut row = Vec::new();
        for index in 0..height {
            self.wall_row(index, &mut row);
            mask.push_row(&row).expect("columns rise");
        }
        mask.finish()
    }

    /// Replaces `row` by a row of walls. Its last column is black, because a row that
    /// ends white counts as stray.
    fn wall_row(&self, index: u32, row: &mut Vec<u32>) {
        let last = self.build.width - 1;
        self.lattice.row(index, last, row);
        if row.len() % 2 == 1 {
            row.push(last);
        }
    }
}

/// Replaces `out` by a row of walls without its `free` columns.
fn cut(mut wall: &[u32], free: &[u32], width: u32, out: &mut Vec<u32>) {
    out.clear();
    // Whether the rest of the walls begins white.
    let mut is_wall = false;
    for (start, end) in white_runs(free, width) {
        let before = count_below(wall, start);
        out.extend_from_slice(&wall[..before]);
        is_wall ^= before % 2 == 1;
        if is_wall {
            toggle(start, width, out);
        }
        // A wall's transition at `end` itself counts as hidden: white after it begins at `end`
        // anyway.
        let hidden = before + count_below(&wall[before..], end + 1);
        is_wall ^= (hidden - before) % 2 == 1;
        wall = &wall[hidden..];
        if is_wall {
            toggle(end, width, out);
        }
    }
    out.extend_from_slice(wall);
}

/// Replaces `out` by a row of mesh together with a row of parts, all of which lie in its gaps.
pub(super) fn inlaid(mut mesh: &[u32], mut parts: &[u32], out: &mut Vec<u32>) {
    out.clear();
    while let Some(&next) = parts.first() {
        let before = count_below(mesh, next);
        out.extend_from_slice(&mesh[..before]);
        mesh = &mesh[before..];
        match mesh.first() {
            None => break,
            // White goes on where a part and a wall touch.
            Some(&column) if column == next => (mesh, parts) = (&mesh[1..], &parts[1..]),
            Some(&column) => {
                let within = count_below(parts, column);
                out.extend_from_slice(&parts[..within]);
                parts = &parts[within..];
            }
        }
    }
    out.extend_from_slice(parts);
    out.extend_from_slice(mesh);
}

/// Returns the number of transitions before a column. The search goes from the left: only some
/// transitions lie between two copies, while halving the row would read all over it.
fn count_below(row: &[u32], column: u32) -> usize {
    let (groups, _) = row.as_chunks::<16>();
    let before = 16 * groups.iter().take_while(|group| group[15] < column).count();
    let next = &row[before..row.len().min(before + 16)];
    before + next.iter().filter(|&&place| place < column).count()
}
