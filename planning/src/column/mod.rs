//! Column cure (000): times of mirrors that cure each column of a part to its height, without
//! layers, through a glass.

mod bitmaps;
mod clusters;
mod curvature;
mod curve;
mod heights;
mod levels;
mod light;
mod measures;
mod plan;
mod spread;
mod taps;
mod times;

pub use bitmaps::Bitmap;
pub use clusters::{Clusters, TooFewTimes};
pub use curve::{HeightCurve, NoHeights};
pub use light::{GlassLight, GridError, Setup};
pub use measures::Measures;
pub use plan::{ColumnError, ColumnObjective, ColumnOptions, ColumnPlan, plan};
pub use spread::{MirrorSpread, NoTracing, Tracing};
pub use times::{Allowed, MirrorTimes, Stop, nearest_times};
