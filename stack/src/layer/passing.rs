//! Defines layers whose pages are decoded only where their image is needed.

use crate::codec::tiff::{EncodedPage, Page, PassedCode};
use crate::error::StackError;
use crate::image::Image;
use crate::layer::Layer;
use crate::layer::check::rows_that_end_white;
use crate::layer::page_info::PageInfo;
use crate::ordered::MemorySize;
use crate::pitch::Pitch;

/// A layer on its way to another stack: decoded, or as its page has it. Stages take either, so that
/// a caller with whole layers hands them over as they are.
///
/// A page passes as it is if its code is the one that its check was made of, as stages write it: then
/// its image is that, too. Any other page is decoded, and its image is checked.
///
/// ```
/// use lamp_stack::{
///     Destination, Format, Layer, Mask, PageInfo, Pages, PassingLayer, StackError, write_stack,
/// };
/// # fn main() -> Result<(), StackError> {
/// # let folder = tempfile::tempdir()?;
/// # let [from, to] = ["a.tif", "b.tif"].map(|name| folder.path().join(name));
/// let layer = Layer { info: PageInfo::default(), pitch: None, image: Mask::black(8, 2).into() };
/// let layers = std::iter::once(Ok::<_, StackError>(layer));
/// write_stack(layers, Destination::File(from.clone()), Format::Big)?;
///
/// let pages = Pages::open(&from)?.map(|page| PassingLayer::of_page(page?, "a.tif"));
/// write_stack(pages, Destination::File(to.clone()), Format::Big)?;
/// assert_eq!(std::fs::read(from)?, std::fs::read(to)?);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct PassingLayer(PassingState);

#[derive(Clone, Debug)]
enum PassingState {
    Decoded(Box<Layer>),
    /// The page's code is the one that was written. The text names the page's stack.
    Coded(Box<Page>, PassedCode, Box<str>),
}

impl PassingLayer {
    /// Creates a layer from a page, which is decoded if it cannot pass as it is. `stack` is the name
    /// for the errors of decoding it later.
    ///
    /// # Errors
    /// Returns the errors of [`Page::decode`], of pages that are decoded.
    pub fn of_page(page: Page, stack: &str) -> Result<Self, StackError> {
        Ok(Self(match page.passed() {
            Some(passed) => PassingState::Coded(Box::new(page), passed, stack.into()),
            None => PassingState::Decoded(Box::new(page.decode()?)),
        }))
    }

    /// Returns the content of the page's JSON line.
    pub fn info(&self) -> &PageInfo {
        match &self.0 {
            PassingState::Decoded(layer) => &layer.info,
            PassingState::Coded(page, ..) => page.info(),
        }
    }

    /// Returns the content of the page's JSON line, to be changed.
    pub fn info_mut(&mut self) -> &mut PageInfo {
        match &mut self.0 {
            PassingState::Decoded(layer) => &mut layer.info,
            PassingState::Coded(page, ..) => page.info_mut(),
        }
    }

    /// Returns the resolution, if the page states one in inches or centimeters.
    pub fn pitch(&self) -> Option<Pitch> {
        match &self.0 {
            PassingState::Decoded(layer) => layer.pitch,
            PassingState::Coded(page, ..) => page.pitch(),
        }
    }

    /// Returns the image's width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        match &self.0 {
            PassingState::Decoded(layer) => [layer.image.width(), layer.image.height()],
            PassingState::Coded(page, ..) => page.size(),
        }
    }

    /// Returns whether the image is gray, not a mask.
    pub fn is_gray(&self) -> bool {
        match &self.0 {
            PassingState::Decoded(layer) => matches!(*layer.image, Image::Gray(_)),
            PassingState::Coded(page, ..) => page.is_gray(),
        }
    }

    /// Returns whether the last pixel of every row is black.
    pub fn rows_end_black(&self) -> bool {
        match &self.0 {
            PassingState::Decoded(layer) => rows_that_end_white(&layer.image) == 0,
            PassingState::Coded(_, passed, _) => passed.code.ends_white == 0,
        }
    }

    /// Returns the layer, if it is decoded.
    pub fn as_decoded(&self) -> Option<&Layer> {
        match &self.0 {
            PassingState::Decoded(layer) => Some(layer),
            PassingState::Coded(..) => None,
        }
    }

    /// Decodes the layer.
    ///
    /// # Errors
    /// Returns the errors of [`Page::decode`], in the stack that was named, unless the layer is
    /// decoded already.
    pub fn decode(self) -> Result<Layer, StackError> {
        match self.0 {
            PassingState::Decoded(layer) => Ok(*layer),
            PassingState::Coded(page, _, file) => page.decode().map_err(|source| {
                StackError::InFile { file: file.into(), source: Box::new(source) }
            }),
        }
    }
}

impl From<Layer> for PassingLayer {
    fn from(layer: Layer) -> Self {
        Self(PassingState::Decoded(Box::new(layer)))
    }
}

impl From<PassingLayer> for EncodedPage {
    fn from(layer: PassingLayer) -> Self {
        match layer.0 {
            PassingState::Decoded(layer) => Self::new(&layer),
            PassingState::Coded(page, passed, _) => Self::passed(*page, passed),
        }
    }
}

impl MemorySize for PassingLayer {
    fn bytes(&self) -> usize {
        match &self.0 {
            PassingState::Decoded(layer) => layer.bytes(),
            PassingState::Coded(page, ..) => page.bytes(),
        }
    }
}
