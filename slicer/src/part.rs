//! Provides parts as sources of facets, in files or in memory.

use std::io;
use std::ops::Range;
use std::sync::Arc;

use lamp_brep::Prepared;
use lamp_stack::{Length, digest_of, digest_of_digests};

use crate::bodies::{Bodies, FillRule, Join};
use crate::error::SliceError;
use crate::facet::Facet;
use crate::fill::Fill;
use crate::piece::{Facets, Piece};
use crate::placement::Placement;
use crate::planes::LayerHeights;
use crate::read_note::ReadNote;

/// A part: its name and its facets, from one or several files with one or many bodies. A binary STL
/// stays in its file; only a few of its blocks are read at a time. Clones share the facets.
#[derive(Clone, Debug)]
pub struct Part {
    name: String,
    /// The bodies. A block never has facets of two pieces.
    pieces: Vec<Piece>,
    /// The number of blocks up to the end of each piece.
    block_ends: Vec<usize>,
    digest: String,
    bodies: Bodies,
    notes: Vec<ReadNote>,
    trusts_extent: bool,
    /// The boundaries of the layers that its files state, in millimeters.
    layers_mm: Option<Vec<f64>>,
}

impl Part {
    /// Creates a part from some pieces of a file with this digest.
    pub(crate) fn new(name: &str, pieces: Vec<Piece>, digest: String) -> Self {
        let mut blocks = 0;
        let end = |piece: &Piece| {
            blocks += piece.facets.blocks();
            blocks
        };
        let block_ends = pieces.iter().map(end).collect();
        let name = name.to_owned();
        let (bodies, notes) = (Bodies::default(), Vec::new());
        let (trusts_extent, layers_mm) = (false, None);
        Self { name, pieces, block_ends, digest, bodies, notes, trusts_extent, layers_mm }
    }

    /// Adds the boundaries of the layers that its file states, in millimeters.
    pub(crate) fn with_layers(self, layers_mm: Option<Vec<f64>>) -> Self {
        Self { layers_mm, ..self }
    }

    /// Returns whether a file has polygons between heights: contours, or masks of a layout.
    pub(crate) fn is_drawing(&self, file: usize) -> bool {
        let mut of_file = self.pieces.iter().filter(|piece| piece.file == file);
        of_file.any(|piece| matches!(piece.facets, Facets::Prisms(_)))
    }

    /// Returns the layers that its files state, if it has a placement: the layers of contours, and
    /// the masks of layouts. Files with different layers state none together, nor does a part that
    /// is tilted or turned over.
    ///
    /// # Errors
    /// Returns an error if there are more layers than any machine builds.
    pub fn stated_layers(&self, placement: &Placement) -> Result<Option<LayerHeights>, SliceError> {
        let Some(layers_mm) = &self.layers_mm else { return Ok(None) };
        let Some(layers_mm) = placement.heights_mm(layers_mm) else { return Ok(None) };
        let um = layers_mm.into_iter().map(|mm| Length::from_mm(mm).um());
        LayerHeights::new(um.collect()).map(Some)
    }

    /// Adds notes on skipped contents of the file, and whether its extent is trusted.
    pub(crate) fn with(self, notes: Vec<ReadNote>, trusts_extent: bool) -> Self {
        Self { notes, trusts_extent, ..self }
    }

    /// Creates a part from facets in memory.
    pub fn from_facets(name: &str, facets: Vec<Facet>) -> Self {
        let numbers = facets.iter().flatten().flatten();
        // Little-endian, so that all machines get the same digest.
        let bytes: Vec<u8> = numbers.flat_map(|number| number.to_le_bytes()).collect();
        let digest = digest_of(&bytes[..]).expect("memory can be read");
        Self::new(name, vec![Piece::new(Facets::Memory(Arc::new(facets)))], digest)
    }

    /// Returns the prepared model of each STEP file.
    pub fn prepared(&self) -> impl Iterator<Item = &Prepared> {
        let of_files = self.pieces.chunk_by(|a, b| a.file == b.file);
        of_files.filter_map(|pieces| pieces[0].surfaces().map(Arc::as_ref))
    }

    /// Returns the prepared model of a file, if it is a STEP file. `file` is its index among the
    /// joined files, from 0.
    pub fn prepared_of(&self, file: usize) -> Option<&Prepared> {
        let piece = self.pieces.iter().find(|piece| piece.file == file)?;
        piece.surfaces().map(Arc::as_ref)
    }

    /// Sets how its files join other files; they unite by default. Parts that are subtracted or
    /// intersected add nothing to the box and the layers of the others.
    #[must_use]
    pub fn with_join(mut self, join: Join) -> Self {
        self.pieces.iter_mut().for_each(|piece| piece.join = join);
        self
    }

    /// Sets how the bodies of each file join under [`Fill::EvenOdd`]; they unite by default.
    #[must_use]
    pub fn with_bodies(self, bodies: Bodies) -> Self {
        Self { bodies, ..self }
    }

    /// Returns the rule that decides what is inside all files together.
    pub(crate) fn fill_rule(&self, fill: Fill) -> FillRule {
        let rules = self.pieces.iter().map(Piece::rule).collect();
        FillRule::new(fill, self.bodies, rules)
    }

    /// Returns the file of a body, and the body's number there, from 0.
    pub(crate) fn body_in_file(&self, body: u32) -> (usize, usize) {
        let file = self.pieces[body as usize].file;
        // Pieces are in the order of their files.
        let first = self.pieces.partition_point(|piece| piece.file < file);
        (file, body as usize - first)
    }

    pub(crate) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Joins parts into one, each where its own placement puts it. Its name joins their names with
    /// `+`, without the names of parts that only cut; its digest is the digest of all their digests
    /// in order. A single part stays unchanged.
    pub fn joined(models: Vec<Self>) -> Self {
        let is_cutter = |model: &Self| model.pieces.iter().all(|piece| piece.rule().is_cutter());
        let names: Vec<&str> =
            models.iter().filter(|model| !is_cutter(model)).map(Self::name).collect();
        let name = names.join("+");
        let digest = digest_of_digests(models.iter().map(Self::digest));
        let notes = models.iter().flat_map(|model| model.notes.clone()).collect();
        let trusts_extent = models.iter().any(|model| model.trusts_extent);
        let bodies = models.first().map_or_else(Bodies::default, |model| model.bodies);
        let layers_mm = models.first().and_then(|model| model.layers_mm.clone());
        let layers_mm = layers_mm.filter(|first| {
            models.iter().all(|model| is_cutter(model) || model.layers_mm.as_ref() == Some(first))
        });
        let mut pieces = Vec::new();
        for model in models {
            // Files are numbered from 0 in each part.
            let files = pieces.last().map_or(0, |last: &Piece| last.file + 1);
            let of_model = model.pieces.into_iter();
            pieces.extend(of_model.map(|piece| Piece { file: files + piece.file, ..piece }));
        }
        let part = Self::new(&name, pieces, digest).with(notes, trusts_extent);
        part.with_bodies(bodies).with_layers(layers_mm)
    }

    /// Places the part among others, after its file's units were applied. Slicing scales, turns and
    /// moves all parts together afterward.
    #[must_use]
    pub fn placed(mut self, placement: &Placement) -> Self {
        for piece in &mut self.pieces {
            piece.placement = piece.placement.then(placement);
        }
        self.layers_mm = self.layers_mm.and_then(|layers| placement.heights_mm(&layers));
        self
    }

    /// Returns the part's name: the file's, without folder and extension.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the number of facets.
    pub fn facet_count(&self) -> usize {
        self.pieces.iter().map(|piece| piece.facets.count()).sum()
    }

    /// Returns the digest of the file, `blake3:` and 64 hexadecimal digits. Without a file, it is
    /// the digest of the coordinates; with several files, the digest of their digests.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// Returns true if the files state the unit of their coordinates.
    pub fn states_unit(&self) -> bool {
        self.pieces.iter().all(|piece| piece.units.is_some())
    }

    /// Returns notes on the contents of its files besides the solids that are sliced.
    pub fn notes(&self) -> &[ReadNote] {
        &self.notes
    }

    /// Returns true if the part's extent is trusted.
    pub(crate) fn trusts_extent(&self) -> bool {
        self.trusts_extent
    }

    /// Checks that no file was written to or replaced since it was opened. Readers of a part call
    /// this after the last access to its facets.
    ///
    /// # Errors
    /// Returns an error if a file was changed or cannot be read.
    pub fn check_unchanged(&self) -> Result<(), SliceError> {
        for piece in &self.pieces {
            if let Facets::Binary { file, .. } = &piece.facets
                && let Some(change) = file.change()?
            {
                return Err(SliceError::Changed { file: piece.file, change });
            }
        }
        Ok(())
    }

    /// Returns true if its facets are not its surface, because volumes are cut out of it.
    pub fn is_cut(&self) -> bool {
        self.pieces.iter().any(|piece| piece.rule().is_cutter())
    }

    /// Refuses a part whose facets are not its surface.
    pub(crate) fn refuse_cut(&self) -> Result<(), SliceError> {
        if self.is_cut() { Err(SliceError::Cut) } else { Ok(()) }
    }

    /// Returns the reason for an error: if reading failed, the change of a file.
    pub(crate) fn reason(&self, error: SliceError) -> SliceError {
        // A file that changed shows as damage of any kind.
        self.check_unchanged().err().unwrap_or(error)
    }

    pub(crate) fn block_count(&self) -> usize {
        self.block_ends.last().copied().unwrap_or(0)
    }

    /// Returns the piece of a block, and the block's facets among the piece's.
    pub(crate) fn place_of(&self, block: usize) -> (usize, Range<usize>) {
        let piece = self.block_ends.partition_point(|&end| end <= block);
        let facets = &self.pieces[piece].facets;
        // Added first: block numbers are unsigned, and the end is above this one.
        let in_piece = block + facets.blocks() - self.block_ends[piece];
        let start = in_piece * facets.per_block();
        (piece, start..facets.count().min(start + facets.per_block()))
    }

    /// Returns a facet of a piece.
    pub(crate) fn facet(&self, piece: usize, facet: usize) -> io::Result<Facet> {
        let mut found = Facet::default();
        self.pieces[piece].for_each(facet..facet + 1, |facet| found = *facet)?;
        Ok(found)
    }

    /// Calls `each` with every facet of a block.
    pub(crate) fn for_each_in_block(
        &self,
        block: usize,
        each: impl FnMut(&Facet),
    ) -> io::Result<()> {
        let (piece, facets) = self.place_of(block);
        self.pieces[piece].for_each(facets, each)
    }
}
