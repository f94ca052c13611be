//! Vertical sections of what a stack cures: exposures layer by layer, or added up.

mod exposures;
mod line;
mod painter;
mod picture;

pub(crate) use exposures::{CureRule, Exposures};
pub(crate) use line::{SectionLine, SectionPlane, parse_along};
pub(crate) use picture::SectionPicture;
