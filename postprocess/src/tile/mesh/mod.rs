//! The mesh around the parts of a build.
//!
//! Walls fill the empty places of the build area, so that the uncured suspension
//! there does not slosh when the next layer is spread (002 section 2.4.2, figure
//! 30). Around each part a moat that follows its outline, layer by layer, stays
//! free, with all that it encloses, and break lines cut the mesh through, so that
//! parts come free of it. The
//! first layers are mesh alone: what the parts stand on, and break from (section
//! 1.1.3).

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

/// The mesh of a layout, in pixels.
#[derive(Clone, Debug)]
pub(super) struct BuildMesh {
    lattice: Lattice,
    breaks: BreakLines,
    clearance: f64,
    /// The moats around outlines, which are the same in all layers.
    pub(super) fixed_moats: Option<Mask>,
    pub(super) base_layers: u32,
    build: PixelSize,
    /// How many changes of colour its rows have together, about.
    changes: usize,
}

impl Layout {
    /// Surrounds the copies with a mesh.
    ///
    /// # Errors
    /// Where the mesh would have no holes, or more runs than an image can hold.
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

    /// The places of the copies, with what stays free around them.
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
    /// How many bytes its image takes, about.
    pub(super) fn bytes(&self) -> usize {
        (self.changes + self.build.height as usize) * size_of::<u32>()
    }

    fn count_changes(&self) -> usize {
        // Rows are alike for long: one in eight tells.
        let mut row = Vec::new();
        let mut count = |index: u32| {
            self.wall_row(index, &mut row);
            8 * row.len()
        };
        (0..self.build.height).step_by(8).map(&mut count).sum()
    }

    /// How many pixels a moat may reach beyond its part.
    pub(super) fn reach(&self) -> u32 {
        self.clearance.ceil() as u32 + 1
    }

    /// What stays free around a part's image, and in its cavities, from which no
    /// mesh would come free: an image that is larger by the [`reach`](Self::reach) on
    /// every side.
    pub(super) fn moat(&self, image: &Image) -> Mask {
        let reach = self.reach();
        let frame = Frame {
            left: -i64::from(reach),
            top: -i64::from(reach),
            width: image.width() + 2 * reach,
            height: image.height() + 2 * reach,
        };
        // Edges round to whole pixels: half of one more leaves no less than the
        // clearance between the part's last pixel and the mesh's first.
        let moat = offset_one_bit(&white_of(image).framed(frame), -(self.clearance + 0.5));
        without_holes(&moat)
    }

    /// The parts, and around them the mesh without the moats and the break lines. The
    /// moats hold the parts, and are on a build that is larger by the
    /// [`reach`](Self::reach) on every side.
    pub(super) fn around(&self, parts: &Mask, moats: &Mask) -> Mask {
        let PixelSize { width, height } = self.build;
        let reach = self.reach();
        let mut mask = MaskBuilder::new(width);
        mask.reserve(height as usize, self.changes + parts.transition_count());
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

    /// The mesh alone.
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

    /// A row of walls. The last column is black: a row that ends white would be
    /// taken for a stray one.
    fn wall_row(&self, index: u32, row: &mut Vec<u32>) {
        let last = self.build.width - 1;
        self.lattice.row(index, last, row);
        if row.len() % 2 == 1 {
            row.push(last);
        }
    }
}

/// Makes `out` a row of walls with what is free of them cut out, and the parts, which
/// lie in what is free, put in.
fn inlaid(mut wall: &[u32], free: &[u32], mut part: &[u32], width: u32, out: &mut Vec<u32>) {
    out.clear();
    // Whether the walls that are left begin white.
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
