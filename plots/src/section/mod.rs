//! Draws vertical sections of what a stack cures.

mod painter;
mod picture;

pub use picture::SectionPicture;
