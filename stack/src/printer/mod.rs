//! Files of printers with a panel: layers as images of the panel's size, with times and moves.
//!
//! Readers give the layers as any stack's, with the images as seen from above. Writers turn and
//! mirror them as the printer shows them, and add up what the files state of the whole print.

pub(crate) mod archive;
pub(crate) mod ctb;
pub(crate) mod fault;
pub(crate) mod fields;
pub(crate) mod goo;
pub(crate) mod panel;
pub(crate) mod preview;
pub(crate) mod runs;
#[cfg(test)]
pub(crate) mod testing;
pub(crate) mod total;
pub(crate) mod write;
