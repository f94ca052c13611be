//! Images in, images out: what happens to layers between slicing and the
//! machine. Everything works on runs.
//!
//! [`fix`] corrects stray rows, [`tile`] lays copies of a part out on a build
//! area. Both are adaptors from layers to layers.
//!
//! ```
//! use lamp_postprocess::{TileError, TileOptions, fix, tile};
//! use lamp_stack::{Dpi, Image, Layer, Mask, PageInfo};
//!
//! // Row 1 missed its second crossing and runs to the image's edge.
//! let mask = Mask::new(8, vec![0, 2, 3, 5], vec![2, 5, 2, 2, 5]).unwrap();
//! let layer =
//!     Layer { info: PageInfo::default(), dpi: Dpi::new(100.0), image: Image::Mask(mask) };
//!
//! let fixed = fix(std::iter::once(Ok::<_, TileError>(layer)), |info, bands| {
//!     assert_eq!((info.index, bands[0].first_row, bands[0].pixels), (0, 1, 3));
//! });
//! let options = TileOptions { area: "0.2x0.1in".parse()?, ..TileOptions::default() };
//! let mut build = tile(fixed, options);
//! let Image::Mask(build) = build.next().unwrap()?.image else { unreachable!() };
//! assert_eq!((build.width(), build.height()), (20, 10));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod fix;
mod majority;
mod tile;

pub use fix::{Band, fix, fix_mask};
pub use tile::{TileError, TileOptions, tile};
