//! Draws vertical sections of what a stack cures.

mod painter;
mod picture;

pub(crate) use picture::SectionPicture;
