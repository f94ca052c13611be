//! Light and resin: how deep a dose cures ([`resin`], [`material`]), and gray
//! levels to dots: a machine that can only expose or not realises a gray level as
//! the share of its pixels that are white (002 section 3.3.1).
//!
//! Both dithering methods leave solid black and white alone, so their cost follows the
//! gray pixels, and no dot appears outside the part.
//!
//! ```
//! use lamp_grayscale::{Method, dither_image};
//! use lamp_stack::GrayMask;
//!
//! let mut gray = GrayMask::new(48);
//! for _ in 0..16 {
//!     gray.push_runs([(16, 0), (16, 64), (16, 255)]).unwrap();
//! }
//! let dots = dither_image(&gray, Method::Ordered);
//! // A quarter of the 256 gray pixels, and all the white ones.
//! assert_eq!(dots.white_pixels(), 64 + 256);
//! ```

mod diffusion;
mod dither;
pub mod material;
mod ordered;
pub mod resin;
mod row;

pub use dither::{Method, dither, dither_image};
