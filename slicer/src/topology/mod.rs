//! Describes the connections of a mesh: vertices, edges, neighbors, shells.
//!
//! A [`CornerTable`] finds the structure that a list of unconnected facets lacks: the corners that
//! are one vertex, and the facets that meet at an edge (002 section 2.3.2.1). A corner is a number:
//! facet t has the corners 3t, 3t + 1 and 3t + 2, and this number indexes flat arrays.
//!
//! ```
//! use lamp_slicing::topology::{CornerTable, MeshCheck, Shells, facet_of, next, previous};
//! use lamp_slicing::{Part, Placement, Units};
//!
//! let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0f32]];
//! let part = Part::from_facets("tetra", vec![[o, y, x], [o, x, z], [o, z, y], [x, y, z]]);
//! let table = CornerTable::of_part(&part, &Placement::default(), Units::Millimetres)?;
//! assert_eq!((table.facet_count(), table.points().len(), table.edge_count()), (4, 4, 6));
//!
//! // Across the edge opposite to corner 0 lies the facet that has no corner at the origin.
//! let across = table.opposite(0).unwrap();
//! assert_eq!(facet_of(across), 3);
//! // Its other two corners are the two ends of that edge.
//! let mut ends = [next(across), previous(across)].map(|corner| table.point(corner));
//! ends.sort_by(|a, b| a.partial_cmp(b).unwrap());
//! assert_eq!(ends, [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]);
//!
//! assert_eq!(Shells::new(&table).count(), 1);
//!
//! let check = MeshCheck::new(&table);
//! assert!(check.is_clean());
//! assert!((check.lumps[0].mass.unwrap().volume_mm3 - 1.0 / 6.0).abs() < 1e-12);
//! # Ok::<(), lamp_slicing::SliceError>(())
//! ```

mod around_edge;
mod check;
mod corner_table;
mod crossings;
mod edges;
mod faults;
mod lumps;
mod mass;
mod minima;
mod nest;
mod overlaps;
mod read;
mod repair;
mod rims;
mod shell_report;
mod shells;
mod slivers;
mod step;
#[cfg(test)]
mod testing;
mod weld;
mod winding;

pub use check::MeshCheck;
pub use corner_table::{CornerTable, facet_of, next, previous};
pub use crossings::Crossings;
pub use faults::Doubled;
pub use lumps::Lump;
pub use mass::Mass;
pub use minima::{Minimum, MinimumKind, Relief, minima};
pub use overlaps::ShellOverlap;
pub use repair::{Deed, RepairOptions, Repaired, Touched, repair};
pub use rims::RimLoop;
pub use shell_report::ShellReport;
pub use shells::Shells;
pub use step::{NoSolid, StepSolids};
