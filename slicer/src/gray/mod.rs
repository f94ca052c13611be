//! Gray layers: each pixel cures as deep as the part below it.
//!
//! A layer is exposed with its section at its top. Where the part's underside slopes
//! away within the layer, full exposure cures too deep. The vertical line through a
//! pixel's center leaves the part at the first facet below the section
//! ([`sheet`](self::sheet)). The depth there has a gray level
//! ([`DepthLevels`](lamp_stack::DepthLevels)), and neighboring pixels of one level
//! make a run ([`shade`](self::shade)).
//!
//! Vertical lines meet facets as rows do in a section: whether a line is left or right of an edge
//! follows from the edge's ends alone. So a line through a closed sheet of facets meets exactly one
//! facet.
//!
//! Where only edges are gray ([`coverage`](self::coverage)), levels are shares of pixels' areas, and
//! facets below do not count.
//!
//! Where the stack is to lie inside the part, or to contain it, no pixel is gray: it is white if its
//! vertical line is inside the part all the way through the layer, or anywhere in it.
//!
//! Where doses add up ([`print_through`](self::print_through)), rows keep the depths instead, and
//! levels are chosen down columns ([`columns`](self::columns)).
//!
//! Source: 002 section 3.3.10, algorithm 15, but with depths of the facets themselves
//! instead of a solid cut out for each layer.

mod above;
mod band;
mod below;
mod columns;
mod coverage;
mod depth_span;
mod levels;
mod print_through;
mod row_lists;
mod rows;
mod shade;
mod shading;
mod sheet;
mod solid;
mod stretch;

pub(crate) use columns::Columns;
pub(crate) use coverage::{Edge, covered};
pub(crate) use depth_span::DepthSpan;
pub use levels::LayerLevels;
pub(crate) use print_through::PrintThrough;
pub(crate) use rows::{DepthRows, LevelRows, ShadedRows, SideRows};
pub(crate) use shade::Shader;
pub(crate) use shading::PlacedShading;
pub use shading::{Shading, Side};
pub(crate) use sheet::Sheet;
