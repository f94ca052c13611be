//! CAD parts to the layer images of large-area projection photopolymerization.
//!
//! LAMP slices a part into one image for each layer, corrects what a faulty mesh left in
//! them, makes dots of gray, and lays copies out on a machine's build area. This crate has
//! all stages under one name, a module for each room:
//!
//! - [`slicer`] opens STL and STEP parts and cuts them into layers.
//! - [`adaptive`] finds how thick each layer may be.
//! - [`grayscale`] knows resins: cure depths, calibration, dithering.
//! - [`fix`] corrects stray rows, [`offset`] moves edges, and [`edit`] changes designs.
//! - [`build`] lays copies of parts out on the area of a [`machine`].
//! - [`supports`] finds what floats or is trapped, and holds it.
//! - [`stack`] has what they share: images as runs, layers, lengths, files and streams.
//!
//! A stage takes and gives an iterator over `Result<Layer, E>`, so stages are chained
//! without coding images in between:
//!
//! ```
//! use std::error::Error;
//!
//! use lamp::fix::{FixOptions, fix};
//! use lamp::slicer::{OpenOptions, Part, SliceOptions, Slices};
//! use lamp::stack::{Destination, Dpi, Format, Length, Pages, write_stack};
//!
//! # let folder = tempfile::tempdir()?;
//! # let stl = folder.path().join("wedge.stl");
//! # let facets = [[[0, 0, 0], [0, 9, 0], [9, 0, 0]], [[0, 0, 0], [9, 0, 0], [0, 0, 9]],
//! #     [[0, 0, 0], [0, 0, 9], [0, 9, 0]], [[9, 0, 0], [0, 9, 0], [0, 0, 9]]];
//! # let corner = |[x, y, z]: &[i32; 3]| format!("vertex {x} {y} {z}\n");
//! # let facet = |facet: &[[i32; 3]; 3]| {
//! #     let corners: String = facet.iter().map(corner).collect();
//! #     format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
//! # };
//! # let facets: String = facets.iter().map(facet).collect();
//! # std::fs::write(&stl, format!("solid wedge\n{facets}endsolid wedge\n"))?;
//! // wedge.stl is 9 mm high.
//! let part = Part::open(&stl, &OpenOptions::default())?;
//! let options = SliceOptions {
//!     dpi: Dpi::new(600.0).expect("it is positive"),
//!     thickness: Length::from_um(100.0),
//!     ..SliceOptions::default()
//! };
//! let layers = Slices::new(part, &options)?;
//! let fixed = fix(layers, FixOptions::default(), |fixed| {
//!     println!("layer {}: {} bands corrected", fixed.before.info.index, fixed.bands.len());
//! });
//! let tiff = folder.path().join("wedge.tif");
//! let fixed = fixed.map(|layer| layer.map_err(Box::<dyn Error + Send + Sync>::from));
//! write_stack(fixed, Destination::File(tiff.clone()), Format::Big)?;
//!
//! assert_eq!(Pages::open(&tiff)?.layers().count(), 90);
//! # Ok::<(), Box<dyn Error + Send + Sync>>(())
//! ```
//!
//! Stages are adaptors, so a build of corrected layers is a chain of two:
//!
//! ```
//! use lamp::build::{TileError, TileOptions, tile};
//! use lamp::fix::{FixOptions, fix};
//! use lamp::stack::{Dpi, Image, Layer, Mask, PageInfo};
//!
//! // Row 1 missed its second crossing and runs to the image's edge.
//! let mask = Mask::new(8, vec![0, 2, 3, 5], vec![2, 5, 2, 2, 5]).unwrap();
//! let layer = Layer { info: PageInfo::default(), dpi: Dpi::new(100.0), image: mask.into() };
//!
//! let layers = std::iter::once(Ok::<_, TileError>(layer));
//! let fixed = fix(layers, FixOptions::default(), |fixed| {
//!     let band = &fixed.bands[0];
//!     assert_eq!((band.first_row, band.pixels, band.gap.clone()), (1, 3, Some(5..6)));
//! });
//! let options = TileOptions { area: "0.2x0.1in".parse()?, ..TileOptions::default() };
//! let mut build = tile(fixed, options);
//! let Image::Mask(build) = build.next().unwrap()?.image.into_image() else { unreachable!() };
//! assert_eq!((build.width(), build.height()), (20, 10));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

pub use lamp_adaptive as adaptive;
pub use lamp_build as build;
pub use lamp_edit as edit;
pub use lamp_fix as fix;
pub use lamp_grayscale as grayscale;
pub use lamp_machine as machine;
pub use lamp_offset as offset;
pub use lamp_slicer as slicer;
pub use lamp_stack as stack;
pub use lamp_supports as supports;
