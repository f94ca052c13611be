//! Fills the empty places of a build area with a mesh.
//!
//! Its walls keep the uncured suspension from sloshing when the next layer is spread
//! (002 section 2.4.2, figure 30). A moat around each part, and all that it encloses,
//! stays free; break lines cut through the mesh so that parts come free of it. The
//! first layers are mesh alone: the parts stand on them and break off (section 1.1.3).

mod base_layers;
mod break_lines;
mod lattice;
mod mesh_options;
#[cfg(test)]
mod mesh_tests;

use lamp_stack::{Frame, Image, Length, Mask, MaskBuilder, Op, place_row, white_runs};

use self::break_lines::{BreakLines, Rect};
use self::lattice::{Lattice, toggle};
use super::part_stack::white_of;
use super::{Layout, PartStack, PixelSize, TileError};
use crate::offset::{offset_one_bit, without_holes};

pub(super) use base_layers::on_base;
pub use mesh_options::{CellShape, MeshOptions, MeshPattern, Moat};

/// The mesh of a layout. Lengths are in pixels.
#[derive(Clone, Debug)]
pub(super) struct BuildMesh {
    lattice: Lattice,
    breaks: BreakLines,
    clearance: f64,
    /// The moats of all layers, if they follow outlines.
    pub(super) fixed_moats: Option<Mask>,
    pub(super) base_layers: u32,
    build: PixelSize,
    /// The number of transitions in all rows, estimated.
    changes: usize,
}

impl Layout {
    /// Surrounds the copies with a mesh.
    ///
    /// # Errors
    /// Returns an error if the mesh would have no holes, no room beside the moats or
    /// more runs than an image can hold, or if moats are to follow outlines and a part
    /// was read without its outline.
    pub fn with_mesh(mut self, options: &MeshOptions) -> Result<Self, TileError> {
        let pixels = |length: Length| length.pixels(self.dpi).max(0.0);
        let clearance = pixels(options.clearance);
        let longest = self.pixels.width.max(self.pixels.height);
        if clearance > f64::from(longest) {
            return Err(TileError::WideMoat { clearance: options.clearance, area_mm: self.area });
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
        let mut mesh = BuildMesh {
            lattice,
            breaks,
            clearance,
            fixed_moats: None,
            base_layers: options.base_layers,
            build: self.pixels,
            changes: 0,
        };
        mesh.changes = mesh.count_changes();
        if options.moat == Moat::Outline {
            let outline = |(index, part): (usize, &PartStack)| match part.outline() {
                Some(outline) => Ok((index, Image::Mask(outline.clone()))),
                None => Err(TileError::NoOutline { name: part.name().to_owned() }),
            };
            let outlines = self.parts.iter().enumerate().map(outline);
            let moats = self.moats(&mesh, &outlines.collect::<Result<Vec<_>, _>>()?);
            mesh.fixed_moats = Some(moats.ok_or(TileError::FineMesh)?);
        }
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

    fn count_changes(&self) -> usize {
        // Neighbouring rows are alike: one in eight is counted.
        let mut row = Vec::new();
        let mut count = |index: u32| {
            self.wall_row(index, &mut row);
            8 * row.len()
        };
        (0..self.build.height).step_by(8).map(&mut count).sum()
    }

    /// Returns the number of pixels that a moat may reach beyond its part.
    pub(super) fn reach(&self) -> u32 {
        self.clearance.ceil() as u32 + 1
    }

    /// Returns the moat around a part's image, on an image that is larger by the
    /// [`reach`](Self::reach) on every side. Cavities belong to it, as mesh in them
    /// would not come out.
    pub(super) fn moat(&self, image: &Image) -> Mask {
        let reach = self.reach();
        let frame = Frame {
            left: -i64::from(reach),
            top: -i64::from(reach),
            width: image.width() + 2 * reach,
            height: image.height() + 2 * reach,
        };
        // Offsets round to whole pixels: half a pixel more leaves no less than the
        // clearance between the last pixel of the part and the first of the mesh.
        let moat = offset_one_bit(&white_of(image).framed(frame), -(self.clearance + 0.5));
        without_holes(&moat)
    }

    /// Returns the parts, and outside the moats and break lines the mesh. The moats
    /// hold the parts, on an image that is larger than the build by the
    /// [`reach`](Self::reach) on every side.
    pub(super) fn around(&self, parts: &Mask, moats: &Mask) -> Mask {
        let PixelSize { width, height } = self.build;
        let reach = self.reach();
        let mut mask = MaskBuilder::new(width);
        mask.reserve(height as usize, self.changes + parts.change_count());
        let (mut wall, mut moat, mut free) = (Vec::new(), Vec::new(), Vec::new());
        let mut row = Vec::new();
        for index in 0..height {
            self.wall_row(index, &mut wall);
            moat.clear();
            let transitions = moats.row(index + reach);
            place_row(transitions, moats.width(), -i64::from(reach), width, &mut moat);
            Op::Union.rows(&moat, self.breaks.row(index), &mut free);
            inlaid(&wall, &free, parts.row(index), width, &mut row);
            mask.push_row(&row).expect("columns rise");
        }
        mask.finish()
    }

    /// Returns the mesh without moats and break lines.
    fn whole(&self) -> Mask {
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

/// Replaces `out` by a row of walls, with its `free` columns cut out and the parts, all
/// of which lie in these, put in.
fn inlaid(mut wall: &[u32], free: &[u32], mut part: &[u32], width: u32, out: &mut Vec<u32>) {
    out.clear();
    // Whether the rest of the walls begins white.
    let mut is_wall = false;
    for (start, end) in white_runs(free, width) {
        let before = wall.partition_point(|&column| column < start);
        out.extend_from_slice(&wall[..before]);
        wall = &wall[before..];
        is_wall ^= before % 2 == 1;
        if is_wall {
            toggle(start, width, out);
        }
        if end == width {
            part.iter().for_each(|&column| toggle(column, width, out));
            return;
        }
        let within = part.partition_point(|&column| column <= end);
        part[..within].iter().for_each(|&column| toggle(column, width, out));
        part = &part[within..];
        let hidden = wall.partition_point(|&column| column <= end);
        wall = &wall[hidden..];
        is_wall ^= hidden % 2 == 1;
        if is_wall {
            toggle(end, width, out);
        }
    }
    out.extend_from_slice(wall);
}
