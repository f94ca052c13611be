//! Light and resin: cure depths, calibration and dithering.
//!
//! - [`material`] reads a resin's numbers from TOML files, some of which are built in.
//! - [`resin`] has the cure models: depth and width for a dose or gray level, and back.
//! - [`exposure`] says how long layers are exposed, by a material or a table of times.
//! - [`calibrate`] finds a material's numbers from measurements, of images that [`target`]
//!   makes.
//! - [`dither`] turns gray layers into dots, for machines that expose a pixel or not: a gray level
//!   becomes the share of white pixels (002 section 3.3.1). Black and white stay as they are, so no
//!   dot appears outside the part. [`homogeneity`] reports whether the resin averages dots of a
//!   size; a [`CoarseScreen`] has cells that it does not average.
//! - [`CuredLine`] simulates what a stack cures, layer by layer, [`SummedLine`] where doses add up
//!   down each [`ColumnDose`]. [`shared_height`] compares that with a part.
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
mod coarse;
mod column_dose;
mod cured;
mod diffusion;
mod dither;
mod dots;
pub mod exposure;
mod homogeneity;
pub mod material;
mod ordered;
mod outline;
pub mod resin;
mod screen;
mod summed;
pub mod target;
mod threshold;
#[cfg(test)]
mod void_and_cluster;

pub use coarse::CoarseScreen;
pub use column_dose::{ColumnDose, Fades, ResinDepths};
pub use cured::{CuredLine, LineRun, PixelLine, SolidHeights, add_below, excess};
pub use dither::{DitherError, DitherMethod, dither, dither_image};
pub use homogeneity::{EVEN_DOTS, Homogeneity, UNEVEN_DOTS, homogeneity};
pub use outline::{OutlinePiece, shared_height};
pub use summed::SummedLine;
