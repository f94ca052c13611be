//! The mesh of a layout, before moats are cut out of it.

use lamp_stack::{Frame, Mask, MaskBuilder, Op};

use super::super::PixelSize;
use super::Moat;
use super::break_lines::BreakLines;
use super::lattice::Lattice;
use super::mesh_rows::MeshRows;
use lamp_offset::{grow_one_bit, without_holes};

/// The mesh of a layout. Lengths are in pixels.
#[derive(Clone, Debug)]
pub(crate) struct BuildMesh {
    pub(super) lattice: Lattice,
    /// The walls that break lines leave.
    pub(super) standing: MeshRows,
    /// Along x and y.
    pub(super) clearance: [f64; 2],
    pub(crate) moat: Moat,
    /// The least number of pixels that a piece of mesh has.
    pub(super) least_piece: u64,
    pub(crate) base_layers: u32,
    pub(super) build: PixelSize,
    /// The number of transitions in all rows, without moats.
    pub(super) changes: usize,
}

impl BuildMesh {
    /// Returns the memory that its image takes, estimated in bytes.
    pub(crate) fn bytes(&self) -> usize {
        (self.changes + self.build.height as usize) * size_of::<u32>()
    }

    /// Returns whether pieces that are not small may hang on nothing. Other moats only grow, so the
    /// mesh of each layer is inside the mesh of the layer below.
    pub(crate) fn tells_loose(&self) -> bool {
        self.moat == Moat::Layer
    }

    /// Makes the walls that break lines leave.
    pub(super) fn stand(&mut self, breaks: &BreakLines) {
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
        self.clearance[0].max(self.clearance[1]).ceil() as u32 + 1
    }

    /// Returns the moat around the white pixels, on an image that is larger by the
    /// [`reach`](Self::reach) on every side. Cavities belong to it, because mesh in them could not
    /// be removed.
    pub(super) fn moat(&self, white: &Mask) -> Mask {
        let reach = self.reach();
        let frame = Frame {
            left: -i64::from(reach),
            top: -i64::from(reach),
            width: white.width() + 2 * reach,
            height: white.height() + 2 * reach,
        };
        // Offsets round to whole pixels: half a pixel more leaves no less than the
        // clearance between the last pixel of the part and the first of the mesh.
        without_holes(&grow_one_bit(&white.framed(frame), self.clearance.map(|by| by + 0.5)))
    }

    /// Returns the mesh without moats and break lines.
    pub(crate) fn whole(&self) -> Mask {
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
