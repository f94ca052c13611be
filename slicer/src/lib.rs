//! Slices CAD parts into layer images, straight from facets to runs.
//!
//! A [`Part`] is an STL or STEP part as a source of facets; [`Slices`] iterates its
//! layers. No contour is linked and no pixel painted. Each facet's crossings with the
//! planes of layers and the rows of images go into a table of (layer, row), and sorting
//! a row's crossings gives its runs (002 section 2.3.4, algorithm 9).
//!
//! - [`Placement`] scales, turns and moves the part; [`PixelGrid`] places its pixels.
//! - [`LayerHeights`] defines layers of any thickness, [`Shading`] gray levels.
//! - [`Slices::trace`] finds the faulty edges behind stray rows.
//! - [`section`](fn@section) cuts one section without rounding to pixels, and
//!   [`FacetIndex`] finds facets by height.
//! - [`topology`] finds neighboring facets and shells.
//!
//! ```
//! use lamp_slicing::{Part, SliceOptions, Slices};
//! use lamp_stack::{Pitch, Image, Length};
//!
//! // A tetrahedron: four facets, counter-clockwise seen from outside.
//! let [o, x, y, z] = [[0.0; 3], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 10.0f32]];
//! let part = Part::from_facets("tetra", vec![[o, y, x], [o, x, z], [o, z, y], [x, y, z]]);
//! let options = SliceOptions {
//!     pitch: Pitch::of_dpi(254.0).unwrap(), // 0.1 mm pixels
//!     thickness: Length::from_mm(2.0),
//!     ..SliceOptions::default()
//! };
//! let areas_mm2: Vec<f64> = Slices::new(part, &options)?
//!     .map(|layer| match layer?.image.into_image() {
//!         Image::Mask(mask) => Ok(mask.white_pixels() as f64 * 0.01),
//!         Image::Gray(_) => unreachable!("slices are masks"),
//!     })
//!     .collect::<Result<_, lamp_slicing::SliceError>>()?;
//! // Sections at the layers' tops, 2, 4, ... 10 mm: half a square each.
//! for (area, side) in areas_mm2.iter().zip([8.0, 6.0, 4.0, 2.0, 0.0]) {
//!     assert!((area - side * side / 2.0).abs() < 0.5);
//! }
//! # Ok::<(), lamp_slicing::SliceError>(())
//! ```

mod archive;
mod ascii;
mod binary_stl;
mod bodies;
mod buckets;
mod closure;
mod contours;
mod crossing;
mod cut;
mod cutter;
mod decimal_mesh;
mod error;
pub mod exact;
mod facet;
mod facet_index;
mod file_blocks;
mod fill;
mod gray;
mod grid;
mod image_rows;
mod layer_share;
mod marks;
mod named_surface;
mod number;
mod obj;
mod obj_colors;
mod open;
mod paint;
mod part;
mod part_file;
mod piece;
mod placed_part;
mod placement;
mod planes;
mod prisms;
mod read_note;
pub mod scan;
mod section;
mod section_area;
mod slices;
mod stl;
mod survey;
mod table;
mod three_mf;
pub mod topology;
mod trace;
mod transform;
mod unpack;
mod utf8_text;
mod wild;
mod words;

/// B-rep models: kernels, and reports of what they read.
pub use lamp_brep as brep;
pub use lamp_brep::Color;

pub use bodies::{Bodies, BodyOverlap, FillDoubt, FillRule, Join, Position, Turn};
pub use contours::ContourFault;
pub use error::{AsciiFault, FileChange, ObjFault, SliceError};
pub use exact::Polished;
pub use facet::{Facet, PlacedFacet, Units, facet_heights};
pub use facet_index::FacetIndex;
pub use fill::Fill;
pub use gray::{LayerLevels, Shading, Side};
pub use grid::PixelGrid;
pub use named_surface::{SurfaceError, SurfaceName, SurfaceNames};
#[cfg(feature = "occt")]
pub use open::second_opinion;
pub use open::{KernelName, OpenOptions, body_name, read_step, step_bytes};
pub use paint::Paint;
pub use part::Part;
pub use placement::{Axis, Placement};
pub use planes::{LayerHeights, PLANE_TOLERANCE, PlaneRule};
pub use read_note::ReadNote;
pub use section::{Inside, SectionOptions, section};
pub use section_area::{Trapezoid, section_area};
pub use slices::{GridRule, SliceOptions, Slices};
pub use stl::write_stl;
pub use three_mf::{ModelFault, ThreeMfError};
pub use trace::{EdgeFacet, FaultyEdge, OpenEnd, StrayBand, Trace, TracedBand};
