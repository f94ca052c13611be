//! Fills the empty places of a build area with a mesh.
//!
//! Its walls keep the uncured suspension from sloshing when the next layer is spread
//! (002 section 2.4.2, figure 30). A moat around each part, and all that it encloses,
//! stays free; break lines cut through the mesh so that parts come free of it. The
//! first layers are mesh alone: the parts stand on them and break off (section 1.1.3).
//! Pieces of mesh that would float or are small are left out.

mod base_layers;
mod break_lines;
mod build_mesh;
#[cfg(test)]
mod hanging_tests;
mod kept;
mod lattice;
mod mesh_options;
mod mesh_rows;
#[cfg(test)]
mod mesh_tests;
mod pieces;
mod with_mesh;

pub(super) use base_layers::{base_page, on_base};
pub(super) use build_mesh::BuildMesh;
pub(super) use kept::{KeptMesh, LayerMesh};
pub use mesh_options::{CellShape, MeshOptions, MeshPattern, Moat};
pub(super) use mesh_rows::{MeshRows, inlaid};
