//! Vertical sections of the resin that a stack cures, each layer alone or with doses that add up,
//! their areas, and its sizes at named places.

mod areas;
mod error;
mod exposures;
mod line;
mod places;

pub use areas::{CuredPanel, PartAreas, SectionAreas, ShownSection};
pub use error::{CureSectionError, PlacesError, UnknownPlane};
pub use exposures::{CureRule, CureSection};
pub use line::{SectionLine, SectionPlane};
pub(crate) use places::Shape;
pub use places::{CuredPlaces, CuredSizes, Place, PlaceSize, Places};
