//! Vertical sections of what a stack cures: exposures layer by layer, or added up.

mod exposures;
mod line;
mod picture;

pub(crate) use exposures::Exposures;
pub(crate) use line::{SectionLine, SectionPlane, parse_along};
pub(crate) use picture::SectionPicture;
