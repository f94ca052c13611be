//! Layers as thick as the part allows.
//!
//! A layer is built as the part's section at its top, swept down. A
//! [`LayeredPart`] compares such [`SweptLayer`]s with the part, for all tops that a
//! layer may have at once. A [`Criterion`] measures a layer's error. A
//! [`HeightSearch`] takes as few layers whose error is within a bound, which may differ by height,
//! as it finds from the bottom up, or the most accurate ones within a budget (002 section 3.2), and
//! places them where they err least together. [`WantedHeights`] names the criterion and what
//! decides the bound.
//!
//! ```
//! use lamp_adaptive::{HeightSearch, LayeredPart, Thicknesses, VolumeDeviation, Watch};
//! use lamp_slicing::{FacetIndex, Fill, Part, Placement, Units};
//! use lamp_stack::Length;
//!
//! // A tetrahedron, 1 mm high.
//! let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0f32]];
//! let model = Part::from_facets("tetra", vec![[o, y, x], [o, x, z], [o, z, y], [x, y, z]]);
//! let facets = FacetIndex::new(model, &Placement::default(), Units::Millimetres)?;
//! let part = LayeredPart::new(facets, Length::from_um(10.0), Fill::EvenOdd)?;
//! let [min, max, step] = [10.0, 100.0, 1.0].map(Length::from_um);
//! let thicknesses = Thicknesses::new(min, max, step)?;
//! let criterion = &VolumeDeviation;
//! let search = HeightSearch {
//!     part: &part,
//!     thicknesses: &thicknesses,
//!     criterion,
//!     snap: false,
//!     watch: Watch::default(),
//! };
//! let heights = search.heights(0.05)?;
//! // Sections shrink faster towards the tip, and layers with them.
//! assert_eq!(heights.layers[0].thickness_um, 43.0);
//! let last = heights.layers.last().unwrap();
//! assert!(last.thickness_um < 30.0);
//! assert_eq!(last.top_um(), 1000.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod budget;
mod by_height;
mod closed;
mod criterion;
mod error;
mod facets;
mod known;
mod layered_part;
mod overlaps;
mod placement;
mod profile;
mod range_max;
mod row_cuts;
mod search;
mod sweep;
mod swept_layer;
mod table;
mod thicknesses;
mod uniform;
mod wanted;

pub use by_height::{ByHeight, ByHeightError, HeightRange, Share};
pub use criterion::{AreaDeviation, Criterion, CuspHeight, Roughness, VolumeDeviation};
pub use error::HeightsError;
pub use layered_part::LayeredPart;
pub use search::{HeightSearch, Heights, Watch};
pub use swept_layer::{SweptLayer, SweptLayers};
pub use thicknesses::Thicknesses;
pub use uniform::uniform_heights;
pub use wanted::{FoundHeights, Goal, HeightsDoubt, Measure, WantedHeights, row_pitch};
