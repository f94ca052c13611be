//! Codes the rows of an image against the rows of the layer below, or against the rows above.

mod decode;
mod encode;

pub(super) use decode::decode;
pub(super) use encode::encode;

use super::predict::{Like, Predictor};
use crate::image::mask::Mask;

/// The rows that an image's rows are coded against.
#[derive(Clone, Copy)]
pub(super) enum Reference<'a> {
    /// The rows of the layer below, an image of the same size.
    Below(&'a Mask),
    /// The image's own rows, each above the next.
    Above,
}

impl<'a> Reference<'a> {
    /// Returns the reference row of a row, given the image's rows so far.
    #[inline]
    fn row<'i>(self, image: &'i Mask, row: u32) -> &'i [u32]
    where
        'a: 'i,
    {
        match (self, row) {
            (Self::Below(below), row) => below.row(row),
            (Self::Above, 0) => &[],
            (Self::Above, row) => image.row(row - 1),
        }
    }

    /// Returns it with the rows around it.
    #[inline]
    fn like<'i>(self, image: &'i Mask, row: u32) -> Like<'i>
    where
        'a: 'i,
    {
        match (self, row) {
            (Self::Below(below), row) => Like::new(below, row, true),
            (Self::Above, 0) => Like::default(),
            (Self::Above, row) => Like::new(image, row - 1, false),
        }
    }

    /// Goes on to a row that is coded against `like`, given the image's rows above it.
    #[inline]
    fn start(
        self,
        predictor: &mut Predictor,
        like: &Like<'_>,
        image: &Mask,
        row: u32,
        step: usize,
    ) {
        let before = || row.checked_sub(1).map_or(&[][..], |before| self.row(image, before));
        predictor.start(like, before, step);
    }
}
