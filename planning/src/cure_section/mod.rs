//! Vertical sections of the resin that a stack cures, each layer alone or with doses that add up,
//! and their areas.

mod areas;
mod error;
mod exposures;
mod line;

pub use areas::{CuredPanel, PartAreas, SectionAreas, ShownSection};
pub use error::{CureSectionError, UnknownPlane};
pub use exposures::{CureRule, CureSection};
pub use line::{SectionLine, SectionPlane};
