//! Builds: copies of parts on the area of a machine.
//!
//! - A [`PartStack`] is what is known of a stack before it is placed, a [`Layout`] says where
//!   copies stand: [`Layout::packed`] finds places, a [`LayoutFile`] has them. [`TurnedPlan`] turns
//!   parts by any angle before they are sliced.
//! - [`Layout::build`] reads the stacks together, by height, and makes the build's layers. It
//!   orients a layer once for each way in which copies lie, and merges shifted rows into the
//!   build's. [`tile`] does all of this for one part.
//! - [`MeshOptions`] says which mesh holds copies together.
//! - A [`Composer`] makes any layer of a build by its [`Recipe`].
//! - [`FieldWriter`] cuts build layers into [`Swaths`] for a projector that scans, or into
//!   [`Fields`] for one that steps, and [`join_fields`] joins them again.
//!
//! Source: 002 section 2.4.2.

mod areas;
mod black_parts;
mod build_page;
mod compose;
mod fields;
mod image_bounds;
mod layout;
mod layout_file;
mod lockstep;
mod mesh;
mod overlap;
mod pack;
mod page_frame;
mod part_stack;
mod pixel_size;
mod placed;
mod recipe;
#[cfg(test)]
mod testing;
mod tile;
mod tile_error;
#[cfg(test)]
mod tile_tests;
mod turned;

pub use areas::{CuredPixels, LayerAreas};
pub use build_page::StrayRows;
pub use compose::{ComposeError, PlacedImage, united};
pub use fields::{
    FieldDifference, FieldFile, FieldForm, FieldKind, FieldPlace, FieldWriter, Fields, FieldsError,
    IndexError, JoinSwathsError, Seam, Swaths, SwathsError, field_files, is_fields, join_fields,
};
pub use image_bounds::ImageBounds;
pub use layout::{CopyPlacement, Layout};
pub use layout_file::{CopyEntry, LayoutError, LayoutFile};
pub use lockstep::HeightOptions;
pub use mesh::{CellShape, MeshOptions, MeshPattern, Moat};
pub use pack::{Pack, PackBy, Turns};
pub use page_frame::frame_page;
pub use part_stack::PartStack;
pub use pixel_size::PixelSize;
pub use recipe::{Composer, LoosePieces, Recipe, RecipeError, RecipePart, TILE_CODE};
pub use tile::{BuildFinding, BuildWanted, TileOptions, tile};
pub use tile_error::{CopyName, TileError};
pub use turned::{FreeTurns, FreeTurnsError, PlannedStack, TurnedPlan, TurnedSlicing};
