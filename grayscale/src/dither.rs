//! Dithering as a stage.

use lamp_stack::{GrayMask, Image, Layer, Mask, map_in_order};

use crate::diffusion::diffuse;
use crate::ordered::order;

/// How gray becomes dots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// A fixed pattern of 16 x 16 thresholds: the same dots wherever the same
    /// level stands at the same place, in every layer.
    #[default]
    Ordered,
    /// Each pixel's error goes to the gray pixels right of and below it.
    FloydSteinberg,
}

impl Method {
    /// The method's name in options and metadata.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ordered => "ordered",
            Self::FloydSteinberg => "floyd-steinberg",
        }
    }
}

/// Turns gray layers into masks; their pages then name the method. Masks pass
/// unchanged.
pub fn dither<E: Send>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    method: Method,
) -> impl Iterator<Item = Result<Layer, E>> {
    map_in_order(layers, move |mut layer| {
        if let Image::Gray(gray) = &layer.image {
            layer.image = Image::Mask(dither_image(gray, method));
            layer.info.other.insert("dither".to_owned(), method.name().into());
        }
        Ok(layer)
    })
}

/// Turns a gray image into dots. Level 0 stays black and level 255 white.
pub fn dither_image(gray: &GrayMask, method: Method) -> Mask {
    match method {
        Method::Ordered => order(gray),
        Method::FloydSteinberg => diffuse(gray),
    }
}
