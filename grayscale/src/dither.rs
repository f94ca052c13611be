//! The dithering stage: gray layers to dots.

use lamp_stack::{
    CellsRecord, DitherRecord, GrayMask, Image, Layer, MAX_RUNS, Mask, PassingLayer, StackError,
    map_in_order,
};
use thiserror::Error;

use crate::diffusion::{FLOYD_STEINBERG, SIERRA_LITE};
use crate::dots::TooManyRuns;
use crate::{blue_noise, ordered, threshold};

/// A method that turns gray into dots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DitherMethod {
    /// A mask of 128 x 128 thresholds that keeps dots apart, in no regular pattern. It moves
    /// from layer to layer.
    #[default]
    BlueNoise,
    /// Bayer's pattern of 16 x 16 thresholds. It moves from layer to layer.
    Ordered,
    /// Error diffusion: each pixel's error goes to the gray pixels right of and below it. The
    /// thresholds are the blue-noise mask's.
    FloydSteinberg,
    /// Error diffusion in rows that turn, with thresholds that hardly differ: the most even gray
    /// within a layer.
    SierraLite,
    /// No dots: pixels of at least half the full level (128 of 255) are white.
    Threshold,
}

lamp_stack::named!(DitherMethod {
    BlueNoise = "blue-noise",
    Ordered = "ordered",
    FloydSteinberg = "floyd-steinberg",
    SierraLite = "sierra-lite",
    Threshold = "threshold",
});

/// Why a layer cannot be dithered.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum DitherError {
    /// The dots make more runs than any reader of stacks takes.
    #[error(
        "layer {layer}: its dots make more than {MAX_RUNS} runs, too many for any reader of the \
         stack: expose part of the area at a time, or make fewer pixels gray"
    )]
    TooManyRuns {
        /// The layer's index.
        layer: u32,
    },
}

/// Turns gray layers into masks, and records the method in their pages. Masks pass
/// unchanged, and are not decoded. A layer's dots depend on its image and its index only.
///
/// # Errors
/// Returns the errors of `layers`, of decoding them and of [`dither_image`].
pub fn dither<E: From<DitherError> + From<StackError> + Send>(
    layers: impl Iterator<Item = Result<impl Into<PassingLayer>, E>>,
    method: DitherMethod,
) -> impl Iterator<Item = Result<PassingLayer, E>> {
    let layers = layers.map(|layer| layer.map(Into::into));
    map_in_order(layers, move |layer: PassingLayer| {
        Ok(if layer.is_gray() { dither_layer(layer.decode()?, method)?.into() } else { layer })
    })
}

fn dither_layer(mut layer: Layer, method: DitherMethod) -> Result<Layer, DitherError> {
    if let Image::Gray(gray) = &*layer.image {
        layer.image = dither_image(gray, method, layer.info.index)?.into();
        let method = method.name().to_owned();
        layer.info.forget_areas();
        layer.info.renew_record(|before| match before {
            Some(DitherRecord::Cells(cells)) => {
                DitherRecord::Cells(CellsRecord { method: Some(method), ..cells })
            }
            _ => DitherRecord::Dots(method),
        });
    }
    Ok(layer)
}

/// Turns the gray image of a layer into dots. Level 0 stays black and level 255 white.
///
/// The layer's index shifts the pattern, so that the holes of consecutive layers do not align.
///
/// # Errors
/// Returns an error if the dots make more runs than [`MAX_RUNS`].
pub fn dither_image(
    gray: &GrayMask,
    method: DitherMethod,
    layer: u32,
) -> Result<Mask, DitherError> {
    let dots = match method {
        DitherMethod::BlueNoise => blue_noise::SCREEN.dither(gray, blue_noise::shift(layer)),
        DitherMethod::Ordered => ordered::SCREEN.dither(gray, ordered::shift(layer)),
        DitherMethod::FloydSteinberg => FLOYD_STEINBERG.dither(gray, blue_noise::shift(layer)),
        DitherMethod::SierraLite => SIERRA_LITE.dither(gray, blue_noise::shift(layer)),
        DitherMethod::Threshold => threshold::threshold(gray),
    };
    dots.map_err(|TooManyRuns| DitherError::TooManyRuns { layer })
}
