//! Defines layers that pass from one stack to another, decoded only where their image is needed.

use crate::error::StackError;
use crate::layer::{Layer, PageInfo};
use crate::length::Dpi;
use crate::ordered::MemorySize;
use crate::tiff::{EncodedPage, Page};

/// A layer on its way to another stack: decoded, or as its page has it.
///
/// A page passes as it is if it has a check and is coded as stages write it. Its code and its check
/// then pass together, and neither is looked at: an image that is damaged fails in the first reader
/// that decodes it, now or after it was written anew.
///
/// ```
/// use lamp_stack::{
///     Destination, Format, Layer, Mask, PageInfo, Pages, PassingLayer, StackError, write_stack,
/// };
/// # fn main() -> Result<(), StackError> {
/// # let folder = tempfile::tempdir()?;
/// # let [from, to] = ["a.tif", "b.tif"].map(|name| folder.path().join(name));
/// let layer = Layer { info: PageInfo::default(), dpi: None, image: Mask::black(8, 2).into() };
/// let layers = std::iter::once(Ok::<_, StackError>(layer));
/// write_stack(layers, Destination::File(from.clone()), Format::Big)?;
///
/// let pages = Pages::open(&from)?.map(|page| PassingLayer::of_page(page?));
/// write_stack(pages, Destination::File(to.clone()), Format::Big)?;
/// assert_eq!(std::fs::read(from)?, std::fs::read(to)?);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct PassingLayer(State);

#[derive(Clone, Debug)]
enum State {
    Decoded(Box<Layer>),
    /// The page has a check and one strip in a compression that is written.
    Coded(Box<Page>),
}

impl PassingLayer {
    /// Creates a layer from a page, which is decoded if it cannot pass as it is.
    ///
    /// # Errors
    /// Returns the errors of [`Page::decode`], of pages that are decoded.
    pub fn of_page(page: Page) -> Result<Self, StackError> {
        Ok(Self(if page.passed().is_some() {
            State::Coded(Box::new(page))
        } else {
            State::Decoded(Box::new(page.decode()?))
        }))
    }

    /// Returns the content of the page's JSON line.
    pub fn info(&self) -> &PageInfo {
        match &self.0 {
            State::Decoded(layer) => &layer.info,
            State::Coded(page) => page.info(),
        }
    }

    /// Returns the content of the page's JSON line, to be changed.
    pub fn info_mut(&mut self) -> &mut PageInfo {
        match &mut self.0 {
            State::Decoded(layer) => &mut layer.info,
            State::Coded(page) => page.info_mut(),
        }
    }

    /// Returns the resolution, if the page states one in inches or centimetres.
    pub fn dpi(&self) -> Option<Dpi> {
        match &self.0 {
            State::Decoded(layer) => layer.dpi,
            State::Coded(page) => page.dpi(),
        }
    }

    /// Returns the image's width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        match &self.0 {
            State::Decoded(layer) => [layer.image.width(), layer.image.height()],
            State::Coded(page) => page.size(),
        }
    }

    /// Decodes the layer.
    ///
    /// # Errors
    /// Returns the errors of [`Page::decode`], unless it is decoded already.
    pub fn decode(self) -> Result<Layer, StackError> {
        match self.0 {
            State::Decoded(layer) => Ok(*layer),
            State::Coded(page) => page.decode(),
        }
    }
}

impl From<Layer> for PassingLayer {
    fn from(layer: Layer) -> Self {
        Self(State::Decoded(Box::new(layer)))
    }
}

impl From<PassingLayer> for EncodedPage {
    fn from(layer: PassingLayer) -> Self {
        match layer.0 {
            State::Decoded(layer) => Self::new(&layer),
            State::Coded(page) => Self::passed(*page),
        }
    }
}

impl MemorySize for PassingLayer {
    fn bytes(&self) -> usize {
        match &self.0 {
            State::Decoded(layer) => layer.bytes(),
            State::Coded(page) => page.bytes(),
        }
    }
}
