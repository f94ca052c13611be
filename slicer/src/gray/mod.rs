//! Gray layers: each pixel as deep as the part below it.
//!
//! A layer is exposed with its section at its top. Where the part's underside
//! slopes away within the layer, full exposure cures too deep. The vertical line
//! through a pixel's centre leaves the part where it meets the first facet
//! below the section ([`sheet`](self::sheet)); the depth there, counted from the
//! layer's top, has a gray level ([`DepthLevels`](lamp_stack::DepthLevels)), and the others in its row
//! make runs of it ([`shade`](self::shade)).
//!
//! Source: 002 section 3.3.10, algorithm 15, with the depth from the facets
//! themselves instead of from a solid cut out for each layer.
//!
//! Facets meet the vertical lines as they meet rows in a section: whether a line
//! is left or right of an edge follows from the edge's ends alone, so that a line
//! through a closed sheet of facets meets exactly one of them.

mod levels;
mod shade;
mod sheet;

pub use levels::LayerLevels;
pub(crate) use shade::Shader;
pub(crate) use sheet::{DepthSpan, Sheet};
