//! Plans of bitmaps on a fixed glass, from the words of a command: column cure (000), and round parts
//! by kinetics (003).

mod column_cure;
mod column_measures;
mod column_report;
mod ecpl;
mod kinetics_report;
mod target;

use lamp_planning::target::HeightMap;
use lamp_planning::{PlanPages, ShownBitmap};
use lamp_stack::Length;
use serde_json::Value;

pub use column_cure::{BitmapCount, ColumnCure, ColumnCureSettings, LongestTime, SearchGap};
pub use column_measures::{measures_fields, measures_line, unmeasured_heights};
pub use ecpl::{EcplSettings, RingCure, kinetic_setting, map_grid};
pub use kinetics_report::CuredRings;
pub use target::{GivenTarget, TargetSettings};

/// Bitmaps, and the part that they cure, as the folder of a plan has them.
#[derive(Clone, Debug)]
pub struct GlassPlan {
    /// The target's name, or another for the cured part.
    pub part: String,
    /// The command that made the plan.
    pub command: String,
    /// The distance from the image of a mirror to the image of the next.
    pub pitch: Length,
    /// The bitmaps, in the order in which they are displayed.
    pub bitmaps: Vec<ShownBitmap>,
    /// The report, as docs/json.md describes it.
    pub report: Value,
    /// The wanted heights, if known.
    pub wanted: Option<HeightMap>,
    /// The cured heights, on the same columns.
    pub cured: HeightMap,
}

impl GlassPlan {
    /// Returns the bitmaps with the data of their pages.
    pub fn pages(&self) -> PlanPages<'_> {
        let Self { part, command, pitch, bitmaps, .. } = self;
        PlanPages { part, command, pitch: *pitch, bitmaps }
    }
}
