//! Holds a placed part: its facets, block by block, and its exact surfaces.

use std::io;

use lamp_brep::Prepared;

use crate::exact::PlacedSurfaces;
use crate::facet::{PlacedFacet, Units};
use crate::file_blocks::FileBlock;
use crate::part::Part;
use crate::piece::Piece;
use crate::placement::{Placement, affine};
use crate::transform::{Transform, placed, scaled};

/// A part placed on the machine.
#[derive(Debug)]
pub(crate) struct PlacedPart {
    pub(crate) model: Part,
    /// The transforms of the pieces, each once.
    transforms: Vec<Transform>,
    /// The exact surfaces of each file that has any.
    surfaces: Vec<PlacedSurfaces>,
    pieces: Vec<PlacedPiece>,
}

/// A piece of a placed part.
#[derive(Debug)]
struct PlacedPiece {
    /// The index of its transform.
    transform: usize,
    /// The index of its file's surfaces, if it has any.
    surfaces: Option<usize>,
}

impl PlacedPart {
    /// Places a part. Files that do not state a unit are in `units`.
    pub(crate) fn new(model: Part, placement: &Placement, units: Units) -> Self {
        let (mut transforms, mut surfaces) = (Vec::new(), Vec::new());
        let mut file_before = None;
        let mut place = |(body, piece): (u32, &Piece)| {
            let units = piece.units.unwrap_or(units);
            let from_corner =
                Placement::default().translated(piece.offset.map(|offset| offset * units.mm()));
            // Offsets are in the file's coordinates, so they come first.
            let placement = from_corner.then(&piece.placement).then(placement);
            let transform = Transform::new(&placement, units);
            // Pieces with the same placement follow each other.
            if transforms.last() != Some(&transform) {
                transforms.push(transform);
            }
            // Bodies of one file share their surfaces.
            let is_of_next_file = file_before.replace(piece.file) != Some(piece.file);
            if let Some(prepared) = piece.surfaces().filter(|_| is_of_next_file) {
                let Prepared { kernel, mesh, .. } = &**prepared;
                let rows = placement.rows_of(units);
                let placed = PlacedSurfaces::new(kernel.clone(), mesh.clone(), rows);
                surfaces.push(placed.numbered_from(body));
            }
            let surfaces = piece.surfaces().map(|_| surfaces.len() - 1);
            PlacedPiece { transform: transforms.len() - 1, surfaces }
        };
        let pieces = (0..).zip(model.pieces()).map(&mut place).collect();
        Self { model, transforms, surfaces, pieces }
    }

    /// Drops the surfaces, so that only facets are left.
    pub(crate) fn on_facets(mut self) -> Self {
        self.pieces.iter_mut().for_each(|piece| piece.surfaces = None);
        self.surfaces.clear();
        self
    }

    /// Returns the surfaces of all files.
    pub(crate) fn surfaces(&self) -> &[PlacedSurfaces] {
        &self.surfaces
    }

    /// Returns the surfaces of a block's piece, if it has any, and the number there of the block's
    /// first facet.
    pub(crate) fn surfaces_of_block(&self, block: usize) -> Option<(&PlacedSurfaces, u32)> {
        let (piece, facets) = self.model.place_of(block);
        let surfaces = &self.surfaces[self.pieces[piece].surfaces?];
        let first = self.model.pieces()[piece].first_facet + facets.start;
        Some((surfaces, first as u32))
    }

    /// Returns the data collected from a block when its file was opened, and the scales of its axes
    /// from file units to the placed part. Returns `None` if the placement does more than scale.
    pub(crate) fn seen_block(&self, block: usize) -> Option<(&FileBlock, [f64; 3])> {
        let (piece, facets) = self.model.place_of(block);
        let Transform::Scale(scale) = self.transform_of(piece) else { return None };
        Some((self.model.pieces()[piece].facets.seen_block(facets.start)?, scale))
    }

    /// Calls `each` with every facet of a block.
    pub(crate) fn for_each_in_block(
        &self,
        block: usize,
        mut each: impl FnMut(&PlacedFacet),
    ) -> io::Result<()> {
        // Two separate loops avoid a test at every facet.
        let (piece, _) = self.model.place_of(block);
        match self.transform_of(piece) {
            Transform::Scale(scale) => self.model.for_each_in_block(block, |facet| {
                each(&placed(facet, |corner| scaled(&scale, corner)));
            }),
            Transform::Affine(rows) => self.model.for_each_in_block(block, |facet| {
                each(&placed(facet, |corner| rows.map(|row| affine(&row, corner))));
            }),
        }
    }

    /// Returns the transform of a piece.
    pub(crate) fn transform_of(&self, piece: usize) -> Transform {
        self.transforms[self.pieces[piece].transform]
    }
}
