//! Meshes of arbitrary facets.

use lamp_slicing::topology::{
    CornerTable, Crossings, MeshCheck, RepairOptions, facet_of, minima, repair,
};
use lamp_slicing::{Facet, SliceError};

use super::one_line;

/// The most facets of a mesh.
const MOST_FACETS: usize = 80;

/// Joins, checks and repairs the facets that bytes stand for: the distances to weld and to close,
/// then nine coordinates a facet, of few values, so that corners meet. Neighbors are mutual; a mesh
/// without faults stays as it is, and so does a repaired mesh.
///
/// # Panics
/// If that does not hold.
pub fn facets(bytes: &[u8]) {
    let [weld, close, coordinates @ ..] = bytes else { return };
    let mesh: Vec<Facet> = coordinates.chunks_exact(9).take(MOST_FACETS).map(facet).collect();
    let options = RepairOptions { weld: f64::from(weld % 4) / 4.0, close: f64::from(close % 16) };
    if let Err(error) = try_mesh(&mesh, &options) {
        one_line(&error);
    }
}

fn facet(bytes: &[u8]) -> Facet {
    let coordinate = |byte: u8| match byte {
        0xFF => f32::NAN,
        0xFE => f32::INFINITY,
        0xFD => f32::MAX,
        0xFC => f32::MIN_POSITIVE,
        byte => f32::from(byte % 32) / 4.0,
    };
    [0, 3, 6].map(|corner| [0, 1, 2].map(|axis| coordinate(bytes[corner + axis])))
}

fn try_mesh(facets: &[Facet], options: &RepairOptions) -> Result<(), SliceError> {
    let table = CornerTable::of_facets(facets)?;
    for corner in 0..table.corner_count() {
        if let Some(across) = table.opposite(corner) {
            assert_eq!(table.opposite(across), Some(corner));
            assert_ne!(facet_of(across), facet_of(corner));
            assert_eq!(table.edge(across), table.edge(corner));
        }
    }
    let check = MeshCheck::new(&table);
    Crossings::new(&table, MOST_FACETS);
    for up in [[0.0, 0.0, 1.0], [0.6, 0.0, -0.8]] {
        let minima = minima(&table, up);
        assert!(minima.iter().all(|minimum| minimum.depth_mm >= 0.0), "{minima:?}");
    }
    let repaired = repair(facets.to_vec(), options)?;
    if check.is_clean() {
        assert!(repaired.touched.is_empty(), "{:?}", repaired.touched);
        assert_eq!(repaired.facets, facets);
    }
    let again = repair(repaired.facets.clone(), options)?;
    assert!(again.touched.is_empty(), "{:?}", again.touched);
    assert_eq!(again.facets, repaired.facets);
    Ok(())
}
