//! Layers: an image, the metadata of its page, and the check of both.

pub(crate) mod check;
pub(crate) mod page_info;
pub(crate) mod pairing;
pub(crate) mod passing;
pub(crate) mod totals;

use crate::codec::compression::Compression;
use crate::codec::packbits;
use crate::image::Image;
use crate::layer::check::ImageCheck;
use crate::layer::page_info::PageInfo;
use crate::ordered::MemorySize;
use crate::pitch::Pitch;

/// The exposure at one height: an image and its metadata.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// The content of the page's JSON line.
    pub info: PageInfo,
    /// The image's resolution, if the page states one in inches or centimeters.
    pub pitch: Option<Pitch>,
    /// The image.
    pub image: LayerImage,
}

impl MemorySize for Layer {
    fn bytes(&self) -> usize {
        self.image.bytes()
    }
}

/// A layer's image. An image that was read may keep its page's strip and its check, so that a
/// stage that does not change it need not make them again.
///
/// It dereferences to its [`Image`]. To change it, replace it with another image converted
/// by `into`, which has neither.
///
/// ```
/// use lamp_stack::{Image, Layer, Mask, PageInfo};
///
/// let image = Mask::black(8, 2).into();
/// let mut layer = Layer { info: PageInfo::default(), pitch: None, image };
/// if let Image::Mask(mask) = &*layer.image {
///     layer.image = mask.inverted().into();
/// }
/// assert_eq!(layer.image.change_count(), 2);
/// ```
#[derive(Clone, Debug)]
pub struct LayerImage {
    image: Image,
    strip: Option<Strip>,
    check: Option<ImageCheck>,
}

/// An image as a page holds it, in one of the compressions that are written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Strip {
    pub(crate) compression: Compression,
    pub(crate) bytes: Box<[u8]>,
}

impl LayerImage {
    /// Creates an image as it was read.
    pub(crate) fn of_page(image: Image, strip: Option<Strip>, check: Option<ImageCheck>) -> Self {
        Self { image, strip, check }
    }

    pub(crate) fn strip(&self) -> Option<&Strip> {
        self.strip.as_ref()
    }

    /// Codes a gray image as PackBits, for readers without Deflate. The page takes several times as
    /// many bytes. A mask stays as it is.
    #[must_use]
    pub fn as_packbits(mut self) -> Self {
        if let Image::Gray(gray) = &self.image {
            let bytes = packbits::encode(gray).into();
            self.strip = Some(Strip { compression: Compression::PackBits, bytes });
        }
        self
    }

    /// Returns the check that the image was read with, or computes it.
    pub(crate) fn check(&self) -> ImageCheck {
        self.check.unwrap_or_else(|| ImageCheck::of(&self.image))
    }

    /// Returns the image without its strip and check.
    pub fn into_image(self) -> Image {
        self.image
    }
}

impl std::ops::Deref for LayerImage {
    type Target = Image;

    fn deref(&self) -> &Image {
        &self.image
    }
}

impl PartialEq for LayerImage {
    fn eq(&self, other: &Self) -> bool {
        self.image == other.image
    }
}

impl<I: Into<Image>> From<I> for LayerImage {
    fn from(image: I) -> Self {
        Self { image: image.into(), strip: None, check: None }
    }
}
