//! Build layers cut into the fields that a projector exposes one after another.
//!
//! ```text
//!   columns of the build   0        W-v   W      2(W-v)
//!   swath 0                ##########\\\\\\
//!   swath 1                         //////####\\\\\\
//!   swath 2                                   //////##########
//! ```
//!
//! A swath is as wide as the projector has mirrors across its path, in columns. It shares some
//! columns with the next swath, so that no seam shows: there the dose of one falls as the dose of
//! the other rises, and their sum is the layer's dose. [`Seam`] gives the amounts.
//!
//! A projector that steps exposes fields: its swaths are divided in the same way into rows of
//! fields. A layer is first cut into rows of fields and each of them into columns, so that in a
//! corner four fields share a pixel. Each cut divides levels without a rest, so the shares of all
//! fields add up to the layer's level exactly. Strips are one row of fields, as high as the layer.

mod bands;
mod cut;
mod fields_error;
#[cfg(test)]
mod fields_tests;
mod form;
mod index;
mod join_swaths;
mod ramps;
mod read;
mod seam;
mod swaths;
mod write;

use std::ops::Range;

use lamp_stack::{FieldRecord, Frame, GrayMask, Image, Layer, LayerImage, PageInfo, StripRecord};

use crate::image_bounds::ImageBounds;
use crate::page_frame::frame_page;

pub use fields_error::FieldsError;
pub use form::{FieldFile, FieldForm, FieldKind, FieldPlace, field_files};
pub use index::IndexError;
pub use join_swaths::JoinSwathsError;
pub use read::{FieldDifference, is_fields, join_fields};
pub use seam::Seam;
pub use swaths::{Swaths, SwathsError};
pub use write::FieldWriter;

/// The fields that build layers are cut into, row by row from the top, each from the left.
///
/// ```
/// use lamp_build::{FieldForm, Seam};
/// use lamp_stack::{Image, Mask};
///
/// let form = FieldForm { width: 10, height: Some(8), overlap: 2, seam: Seam::Gray };
/// let fields = form.fields([22, 14])?;
/// assert_eq!(fields.count(), 6);
///
/// let layer = Image::Mask(Mask::black(22, 14).inverted());
/// let cut = fields.cut(&layer, 0, 0..6);
/// assert_eq!((cut[4].width(), cut[4].height()), (10, 8));
/// assert_eq!(fields.join(&cut)?, layer.to_gray().into_owned());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fields {
    form: FieldForm,
    across: Swaths,
    /// The rows of fields, as swaths of the layer's rows.
    down: Swaths,
}

impl Fields {
    /// Returns how they are cut.
    pub fn form(&self) -> FieldForm {
        self.form
    }

    /// Returns the width and height of the layer.
    pub fn layer_size(&self) -> [u32; 2] {
        [self.across.width, self.down.width]
    }

    /// Returns the width and height of a field.
    pub fn size(&self) -> [u32; 2] {
        [self.across.mirrors, self.down.mirrors]
    }

    /// Returns the number of columns and of rows of fields.
    pub fn grid(&self) -> [u32; 2] {
        [self.across.count(), self.down.count()]
    }

    /// Returns the number of fields: at least one.
    pub fn count(&self) -> u32 {
        // Before they are checked, there may be more than can be counted.
        self.across.count().saturating_mul(self.down.count())
    }

    /// Returns where a field lies in the grid.
    pub fn place(&self, field: u32) -> FieldPlace {
        let across = self.across.count();
        FieldPlace { row: field / across, column: field % across }
    }

    /// Returns the columns of the layer that a field exposes. Pixels of a field beyond the layer stay
    /// black.
    pub fn columns(&self, field: u32) -> Range<u32> {
        self.across.columns(self.place(field).column)
    }

    /// Returns the rows of the layer that a field exposes.
    pub fn rows(&self, field: u32) -> Range<u32> {
        self.down.columns(self.place(field).row)
    }

    /// Returns the images of some of the fields, each as large as a field. Where fields overlap,
    /// their levels add up to the layer's exactly. A comb's teeth depend on the index of the layer.
    ///
    /// # Panics
    /// Panics if the image is not as large as the layers, or there are no such fields.
    pub fn cut(&self, image: &Image, layer: u32, fields: Range<u32>) -> Vec<Image> {
        assert!(fields.end <= self.count());
        let across = self.across.count();
        let mut cut = Vec::with_capacity(fields.len());
        let mut next = fields.start;
        while next < fields.end {
            let FieldPlace { row, column } = self.place(next);
            let end = across.min(column + fields.end - next);
            let band = self.down.cut_down(image, layer, row);
            let first_row = self.down.columns(row).start;
            cut.extend(self.across.cut_from(&band, layer, first_row, column..end));
            next += end - column;
        }
        cut
    }

    /// Adds up the levels of all fields, which gives the layer that they were cut from.
    ///
    /// # Errors
    /// Returns an error if the fields do not make a layer, or add up to more than full exposure.
    pub fn join(&self, fields: &[Image]) -> Result<GrayMask, JoinSwathsError> {
        let across = self.across.count() as usize;
        if fields.len() != self.count() as usize {
            return Err(JoinSwathsError::Unlike);
        }
        let bands = fields.chunks(across).zip(0..).map(|(band, row)| {
            self.across.join(band).map_err(|error| error.below(self.down.columns(row).start))
        });
        self.down.join_down(bands.collect::<Result<_, _>>()?, self.across.width)
    }

    /// Returns some of a layer's fields. Their pages say under `strip` or `field` which field they
    /// are, the pixels of the build that it exposes, and the bits of the build's pixels.
    ///
    /// # Panics
    /// Panics if [`cut`](Self::cut) does.
    pub fn cut_layer<'a>(
        &self,
        layer: &'a Layer,
        fields: Range<u32>,
    ) -> impl Iterator<Item = Layer> + use<'a> {
        let this = *self;
        let images: Vec<LayerImage> = match *layer.image {
            // One field is the layer itself: nothing is to be encoded again.
            Image::Mask(_) if self.size() == self.layer_size() => vec![layer.image.clone()],
            _ => {
                let cut = self.cut(&layer.image, layer.info.index, fields.clone());
                cut.into_iter().map(LayerImage::from).collect()
            }
        };
        let page = move |(image, field)| Layer {
            info: this.page(layer, field),
            pitch: layer.pitch,
            image,
        };
        images.into_iter().zip(fields).map(page)
    }

    /// Returns the page of a layer's field.
    fn page(&self, layer: &Layer, field: u32) -> PageInfo {
        let (columns, rows) = (self.columns(field), self.rows(field));
        let ([width, height], layer_size) = (self.size(), self.layer_size());
        let mut info = layer.info.clone();
        // The first strip's image lies where the build's does.
        if field > 0 || height < layer_size[1] {
            let (left, top) = (columns.start.into(), rows.start.into());
            let frame = Frame { left, top, width, height };
            let bounds = ImageBounds::of(&info, layer.pitch, layer_size);
            frame_page(&mut info, frame, &bounds.framed(frame));
        }
        let bits = if matches!(*layer.image, Image::Mask(_)) { 1 } else { 8 };
        let (columns, rows) = ([columns.start, columns.end], [rows.start, rows.end]);
        let place = self.place(field);
        match self.form.kind() {
            FieldKind::Strip => {
                info.set_record(&StripRecord { number: field, of: self.count(), columns, bits });
            }
            FieldKind::Field => {
                let of = [self.down.count(), self.across.count()];
                let FieldPlace { row, column } = place;
                info.set_record(&FieldRecord { row, column, of, columns, rows, bits });
            }
        }
        if let Some(stack) = &mut info.stack {
            stack.commands.push(self.form.command(place));
        }
        info
    }
}
