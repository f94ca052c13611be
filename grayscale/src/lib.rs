//! Light and resin: how deep a dose cures ([`resin`], [`material`]), how to find
//! that from measurements ([`calibrate`]), and gray levels to dots: a machine that
//! can only expose or not realises a gray level as the share of its pixels that are
//! white (002 section 3.3.1).
//!
//! All dithering methods leave solid black and white alone, so their cost follows the
//! gray pixels, and no dot appears outside the part. [`homogeneity`] says whether the
//! resin averages dots of a size.
//!
//! ```
//! use lamp_grayscale::{DitherMethod, dither_image};
//! use lamp_stack::GrayMask;
//!
//! let mut gray = GrayMask::new(48);
//! for _ in 0..16 {
//!     gray.push_runs([(16, 0), (16, 64), (16, 255)]).unwrap();
//! }
//! let layer = 7;
//! let dots = dither_image(&gray, DitherMethod::Ordered, layer)?;
//! // A quarter of the 256 gray pixels, and all the white ones.
//! assert_eq!(dots.white_pixels(), 64 + 256);
//! # Ok::<_, lamp_grayscale::DitherError>(())
//! ```

mod blue_noise;
pub mod calibrate;
mod cured;
mod diffusion;
mod dither;
mod dots;
mod homogeneity;
pub mod material;
mod ordered;
pub mod resin;
mod screen;
pub mod target;
mod threshold;
#[cfg(test)]
mod void_and_cluster;

pub use cured::{CuredLine, PixelLine, SolidHeights, excess};
pub use dither::{DitherError, DitherMethod, dither, dither_image};
pub use homogeneity::{EVEN_DOTS, Homogeneity, UNEVEN_DOTS, homogeneity};
