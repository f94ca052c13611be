//! Provides meshes for the tests of topology.

use crate::facet::{Facet, Units};
use crate::part::Part;
use crate::placement::Placement;
use crate::topology::CornerTable;

/// Returns the table of facets in millimeters.
pub(crate) fn table_of(facets: &[Facet]) -> CornerTable {
    let part = Part::from_facets("test", facets.to_vec());
    CornerTable::of_part(&part, &Placement::default(), Units::Millimetres).unwrap()
}

/// Returns the twelve facets of a block between two corners, facing outward.
pub(crate) fn block(low: [f32; 3], high: [f32; 3]) -> Vec<Facet> {
    let corner = |k: usize| [0, 1, 2].map(|axis| [low, high][k >> axis & 1][axis]);
    let sides =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let halves = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]];
    sides.into_iter().flat_map(halves).map(|facet| facet.map(corner)).collect()
}

/// Returns facets turned over.
pub(crate) fn turned(facets: &[Facet]) -> Vec<Facet> {
    facets.iter().map(|&[a, b, c]| [a, c, b]).collect()
}
