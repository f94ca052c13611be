//! Holds facets of a file with the same placement: the facets of an item or a body.

use std::io;
use std::ops::Range;
use std::sync::Arc;

use lamp_brep::Prepared;

use crate::binary_stl::{FACET_BYTES, HEADER_BYTES, parse};
use crate::bodies::{BodyRole, BodyRule, Join};
use crate::facet::{Facet, Units, rounded};
use crate::file_blocks::{BLOCK_FACETS, FileBlock};
use crate::fill::Fill;
use crate::marks::FacetMarks;
use crate::part_file::OpenPartFile;
use crate::placement::Placement;
use crate::prisms::Prisms;

/// Facets of surfaces are fewer and cost more, and every thread should have some.
const BLOCK_SURFACE_FACETS: usize = 128;

/// The facets of a file with the same placement: all facets, or the facets of one of its items or
/// bodies.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub(crate) facets: Facets,
    /// The index of the file among the joined files, from 0.
    pub(crate) file: usize,
    /// The number of its first facet in the file.
    pub(crate) first_facet: usize,
    /// The unit that the file states, if it does.
    pub(crate) units: Option<Units>,
    /// The point to which its facets are relative, in units of the file. It is the origin, except
    /// for a mesh so far away that 32 bits would move its corners.
    pub(crate) offset: [f64; 3],
    /// Its placement among the other pieces.
    pub(crate) placement: Placement,
    /// The number of its object in the file. It adds to the object's volume, or subtracts from it.
    pub(crate) object: usize,
    pub(crate) role: BodyRole,
    /// How its file joins the other files.
    pub(crate) join: Join,
    /// The rule of its format, which counts in place of [`Fill::Solid`].
    pub(crate) fill: Option<Fill>,
    /// The marks of its facets, if they were read.
    pub(crate) marks: Option<Arc<FacetMarks>>,
}

impl Piece {
    pub(crate) fn new(facets: Facets) -> Self {
        let placement = Placement::default();
        Self {
            facets,
            file: 0,
            first_facet: 0,
            units: None,
            offset: [0.0; 3],
            placement,
            object: 0,
            role: BodyRole::default(),
            join: Join::default(),
            fill: None,
            marks: None,
        }
    }

    /// Returns the rule by which it counts.
    pub(crate) fn rule(&self) -> BodyRule {
        let Self { file, object, role, join, fill, .. } = *self;
        BodyRule { file, object, role, join, is_even_odd: fill == Some(Fill::EvenOdd) }
    }

    /// Returns true if the facets are read from their file again at each use.
    pub(crate) fn is_in_file(&self) -> bool {
        matches!(self.facets, Facets::Binary { .. })
    }

    /// Creates the pieces of a STEP file: its bodies.
    pub(crate) fn of_bodies(prepared: Prepared) -> Vec<Self> {
        let prepared = Arc::new(prepared);
        let piece = |facets: Range<usize>| Self {
            first_facet: facets.start,
            units: Some(Units::Millimetres),
            ..Self::new(Facets::Surfaces { prepared: prepared.clone(), facets })
        };
        // Facets are sorted by face, so a body's range of faces is a range of facets.
        let before = |face| prepared.mesh.facets.partition_point(|facet| facet.face < face);
        let bodies = prepared.kernel.bodies().iter();
        bodies.map(|body| piece(before(body.faces.start)..before(body.faces.end))).collect()
    }

    /// Returns the exact surfaces of the facets, if they have any. Bodies of one file share them.
    pub(crate) fn surfaces(&self) -> Option<&Arc<Prepared>> {
        match &self.facets {
            Facets::Surfaces { prepared, .. } => Some(prepared),
            _ => None,
        }
    }

    /// Calls `each` with every facet of a range, counterclockwise seen from outside once it is
    /// placed.
    pub(crate) fn for_each(
        &self,
        range: Range<usize>,
        mut each: impl FnMut(&Facet),
    ) -> io::Result<()> {
        // A mirror turns facets over. Swapping two corners turns them back.
        if self.placement.is_mirror() {
            self.facets.for_each(range, |&[a, b, c]| each(&[a, c, b]))
        } else {
            self.facets.for_each(range, each)
        }
    }
}

/// Facets in file units.
#[derive(Clone, Debug)]
pub(crate) enum Facets {
    Binary {
        file: Arc<OpenPartFile>,
        count: usize,
    },
    Memory(Arc<Vec<Facet>>),
    /// The facets of polygons between heights.
    Prisms(Arc<Prisms>),
    /// The facets of a body.
    Surfaces {
        prepared: Arc<Prepared>,
        facets: Range<usize>,
    },
}

impl Facets {
    pub(crate) fn count(&self) -> usize {
        match self {
            Self::Binary { count, .. } => *count,
            Self::Memory(facets) => facets.len(),
            Self::Prisms(prisms) => prisms.count(),
            Self::Surfaces { facets, .. } => facets.len(),
        }
    }

    pub(crate) fn blocks(&self) -> usize {
        self.count().div_ceil(self.per_block())
    }

    pub(crate) fn per_block(&self) -> usize {
        match self {
            Self::Surfaces { .. } => BLOCK_SURFACE_FACETS,
            _ => BLOCK_FACETS,
        }
    }

    /// Returns the data collected when the file was opened from the block that begins with a facet.
    pub(crate) fn seen_block(&self, first: usize) -> Option<&FileBlock> {
        match self {
            Self::Binary { file, .. } => file.seen_blocks().get(first / BLOCK_FACETS),
            _ => None,
        }
    }

    /// Calls `each` with every facet of a range, as it stands in the file.
    pub(crate) fn for_each(
        &self,
        range: Range<usize>,
        mut each: impl FnMut(&Facet),
    ) -> io::Result<()> {
        match self {
            Self::Memory(facets) => facets[range].iter().for_each(each),
            Self::Prisms(prisms) => prisms.for_each(range, each),
            Self::Surfaces { prepared, facets } => {
                let mesh = &prepared.mesh;
                let facets = &mesh.facets[facets.clone()][range];
                facets.iter().for_each(|facet| each(&rounded(mesh.corners(facet))));
            }
            Self::Binary { file, .. } => {
                let at = |facet: usize| HEADER_BYTES + (facet * FACET_BYTES) as u64;
                let bytes = at(range.start)..at(range.end);
                file.for_each_record(bytes, |record| each(&parse(record)))?;
            }
        }
        Ok(())
    }
}
