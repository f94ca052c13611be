//! Gray layers: each pixel cures as deep as the part below it.
//!
//! A layer is exposed with its section at its top. Where the part's underside slopes
//! away within the layer, full exposure cures too deep. The vertical line through a
//! pixel's centre leaves the part at the first facet below the section
//! ([`sheet`](self::sheet)). The depth there has a gray level
//! ([`DepthLevels`](lamp_stack::DepthLevels)), and neighbouring pixels of one level
//! make a run ([`shade`](self::shade)).
//!
//! Vertical lines meet facets as rows do in a section: whether a line is left or right
//! of an edge follows from the edge's ends alone. So a line through a closed sheet of
//! facets meets exactly one of them.
//!
//! Source: 002 section 3.3.10, algorithm 15, but with depths of the facets themselves
//! instead of a solid cut out for each layer.

mod levels;
mod shade;
mod sheet;

pub use levels::LayerLevels;
pub(crate) use shade::Shader;
pub(crate) use sheet::{DepthSpan, Sheet};
