//! The stages from a part to layers, in one process: their settings, what stacks record of them,
//! and the keys of their results.
//!
//! A stage is its settings, a plain struct that serde knows, and its work between a reader and a
//! writer. [`StageChain`] runs slicing and the stages after it for a range of layers; ranges
//! that are joined have the bytes of the pipeline typed by hand.

#![cfg_attr(not(windows), forbid(unsafe_code))]

pub mod build_copies;
pub mod build_findings;
pub mod check;
pub mod compensate;
pub mod dither;
pub mod documents;
pub mod edit;
pub mod exposure;
pub mod fix;
pub mod glass;
pub mod heights;
pub mod memory;
pub mod panel;
pub mod part_file;
pub mod placement;
pub mod size;
pub mod slice;
pub mod solid;
pub mod step;
pub mod support;
pub mod tile;
pub mod watcher;
pub mod words;

mod chain;
mod error;
mod fallback;
mod findings;
mod fix_report;
mod inside;
mod names;
mod overlaps;
mod pixel_location;
mod ranges;
mod recorded_part;
mod slice_settings;
mod sliced_part;
mod stack_light;
mod survey;
mod wall_report;

pub use chain::{Stage, StageChain, Working, named};
pub use error::{Error, ErrorKind};
pub use findings::RangeFindings;
pub use fix_report::{FixHead, FixReport, ReportedBand, whereabouts};
pub use names::{Names, stored_name};
pub use ranges::ranges;
pub use recorded_part::RecordedSlicing;
pub use slice_settings::{GrayRule, SliceFrame, SliceSettings, SlicingRecord, Thickness};
pub use sliced_part::{LayersOfPart, SlicedPart, check_slicing};
pub use stack_light::{NoLight, StackLight};
pub use survey::Survey;
pub use wall_report::{NarrowedWall, WallHead, WallReport};
