//! Reads a part into a corner table, and merges equal corners into one vertex.

use std::hash::BuildHasher;

use hashbrown::{DefaultHashBuilder, HashTable};

use crate::error::SliceError;
use crate::facet::{Facet, Units, rounded};
use crate::part::Part;
use crate::placed_part::PlacedPart;
use crate::placement::Placement;
use crate::topology::CornerTable;
use crate::topology::corner_table::NONE;

impl CornerTable {
    /// Reads a placed part. Corners are one vertex if their coordinates have the same bits (0 and
    /// -0 are the same) and they belong to one body. Vertices are numbered in order of appearance.
    ///
    /// Facets are numbered through all bodies, so that for one file with one body they have the
    /// same numbers as in error messages.
    ///
    /// # Errors
    /// Returns an error if there are no facets, or more than 1431655764, if some facets belong to
    /// negative volumes, or if they cannot be read.
    pub fn of_part(part: &Part, placement: &Placement, units: Units) -> Result<Self, SliceError> {
        check_count(part.facet_count())?;
        part.refuse_cut()?;
        let table = Self::read(&PlacedPart::new(part.clone(), placement, units).on_facets());
        let table = table.map_err(|error| part.reason(error))?;
        part.check_unchanged()?;
        Ok(table)
    }

    /// Creates the table of facets of one body, with points in the facets' unit.
    ///
    /// # Errors
    /// Returns an error if there are no facets, or too many.
    pub fn of_facets(facets: &[Facet]) -> Result<Self, SliceError> {
        check_count(facets.len())?;
        let mut welder = Welder::new(facets.len());
        welder.start_body(facets.len());
        let corners = facets.as_flattened().iter();
        let vertices = corners.map(|corner| welder.vertex(corner.map(f64::from))).collect();
        Ok(Self::new(welder.points, vertices))
    }

    fn read(part: &PlacedPart) -> Result<Self, SliceError> {
        let mut welder = Welder::new(part.model.facet_count());
        let mut vertices = Vec::with_capacity(3 * part.model.facet_count());
        let mut body_ends = vec![0; part.model.pieces().len()];
        let mut body = None;
        for block in 0..part.model.block_count() {
            let (piece, _) = part.model.place_of(block);
            if body.replace(piece) != Some(piece) {
                welder.start_body(part.model.pieces()[piece].facets.count());
            }
            part.for_each_in_block(block, |facet| {
                let vertex = |&[x, y, z_um]: &[f64; 3]| welder.vertex([x, y, z_um / 1000.0]);
                vertices.extend(facet.iter().map(vertex));
            })?;
            body_ends[piece] = (vertices.len() / 3) as u32;
        }
        // Bodies without facets have no blocks.
        for body in 1..body_ends.len() {
            body_ends[body] = body_ends[body].max(body_ends[body - 1]);
        }
        let mut points = welder.points;
        points.shrink_to_fit();
        Ok(Self::of_bodies(points, vertices, body_ends))
    }
}

impl Part {
    /// Returns all facets, as one body: in file units, or in millimeters where the file states its
    /// unit. Facets of several items or files are placed as these are.
    ///
    /// # Errors
    /// Returns an error if some facets belong to negative volumes, or if they cannot be read.
    pub fn facets(&self) -> Result<Vec<Facet>, SliceError> {
        self.refuse_cut()?;
        let placed = PlacedPart::new(self.clone(), &Placement::default(), Units::Millimetres);
        let mut facets = Vec::with_capacity(self.facet_count());
        for block in 0..self.block_count() {
            let in_block = placed.for_each_in_block(block, |facet| {
                facets.push(rounded(facet.map(|[x, y, z_um]| [x, y, z_um / 1000.0])));
            });
            in_block.map_err(|error| self.reason(error.into()))?;
        }
        self.check_unchanged()?;
        Ok(facets)
    }
}

fn check_count(facets: usize) -> Result<(), SliceError> {
    match facets {
        0 => Err(SliceError::NoFacets),
        _ if facets >= NONE as usize / 3 => Err(SliceError::TooManyFacets { facets }),
        _ => Ok(()),
    }
}

/// Assigns one number to equal points.
struct Welder {
    points: Vec<[f64; 3]>,
    /// The numbers of this body's points. Its order has no effect.
    known: HashTable<u32>,
    /// The first point of this body.
    first: u32,
    /// The last requested points, by some bits of their hashes: in most files facets follow their
    /// neighbors.
    recent: Box<[u32; RECENT]>,
    hasher: DefaultHashBuilder,
}

/// Few enough to stay in a processor's cache.
const RECENT: usize = 1 << 13;

impl Welder {
    /// Prepares for a number of facets of all bodies.
    fn new(facets: usize) -> Self {
        Self {
            points: Vec::with_capacity(usual_vertices(facets)),
            known: HashTable::new(),
            first: 0,
            recent: Box::new([NONE; RECENT]),
            hasher: DefaultHashBuilder::default(),
        }
    }

    /// Starts a body of so many facets. Later points are different vertices from all points before.
    fn start_body(&mut self, facets: usize) {
        self.known = HashTable::with_capacity(usual_vertices(facets));
        self.first = self.points.len() as u32;
    }

    fn vertex(&mut self, point: [f64; 3]) -> u32 {
        // Changes -0 to 0.
        let point = point.map(|c| c + 0.0);
        let Self { points, known, first, recent, hasher } = self;
        let bits = |[x, y, z]: &[f64; 3]| (x.to_bits(), y.to_bits(), z.to_bits());
        let is_same = |&known: &u32| bits(&points[known as usize]) == bits(&point);
        let hash = hasher.hash_one(bits(&point));
        let place = &mut recent[hash as usize % RECENT];
        // An equal point of an earlier body is another vertex.
        if (*first..NONE).contains(place) && is_same(place) {
            return *place;
        }
        let hash_of = |&known: &u32| hasher.hash_one(bits(&points[known as usize]));
        let next = points.len() as u32;
        let vertex = *known.entry(hash, is_same, hash_of).or_insert(next).get();
        if vertex == next {
            points.push(point);
        }
        *place = vertex;
        vertex
    }
}

/// A closed mesh has slightly more than half as many vertices as facets.
fn usual_vertices(facets: usize) -> usize {
    // Euler's formula for a sphere: V - E + F = 2, and three sides a facet give E = 3/2 F.
    facets / 2 + 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topology::testing::{block, table_of};

    #[test]
    fn zero_has_no_sign() {
        let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0f32]];
        let minus = [-0.0, 0.0, -0.0];
        let table = table_of(&[[minus, y, x], [o, x, z], [minus, z, y], [x, y, z]]);
        assert_eq!((table.points().len(), table.edge_count()), (4, 6));
    }

    #[test]
    fn points_are_those_of_the_file_to_the_bit() {
        let facets = lamp_fixtures::sphere(5.0, 2_000).facets;
        let table = table_of(&facets);
        for (facet, corners) in (0..).zip(&facets) {
            assert_eq!(table.facet(facet), corners.map(|corner| corner.map(f64::from)));
        }
        let part = Part::from_facets("sphere", facets.clone());
        assert_eq!(part.facets().unwrap(), facets);
    }

    #[test]
    fn bodies_share_no_vertex() {
        let lower = Part::from_facets("lower", block([0.0; 3], [1.0; 3]));
        let upper = Part::from_facets("upper", block([0.0, 0.0, 1.0], [1.0, 1.0, 2.0]));
        let part = Part::joined(vec![lower, upper]);
        let placement = Placement::default().scaled([2.0; 3]);
        let table = CornerTable::of_part(&part, &placement, Units::Millimetres).unwrap();
        assert_eq!(table.bodies().collect::<Vec<_>>(), [0..12, 12..24]);
        assert_eq!((table.points().len(), table.crowded().len()), (16, 0));
        assert_eq!(table.points()[15][2], 4.0);
    }

    #[test]
    fn a_part_without_facets_has_no_table() {
        let part = Part::from_facets("none", Vec::new());
        let table = CornerTable::of_part(&part, &Placement::default(), Units::Millimetres);
        assert!(matches!(table, Err(SliceError::NoFacets)));
    }
}
