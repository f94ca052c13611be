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
//! - [`planning`] chooses exposures, [`pipeline`] runs stages from their settings, [`batch`] plans,
//!   does and delivers nights, [`plots`] draws curves and maps, and [`view`] shows layers in a browser.
//! - [`stack`] has what they share: images as runs, layers, lengths, files and streams.
//!
//! A stage takes and gives an iterator of layers, so stages are chained without coding images in
//! between. `fix`, `edit` and `dither` take whole layers or [`stack::PassingLayer`], whose page is
//! decoded only where its image is needed, and give the latter. [`Error`] takes the errors of all.
//!
//! # Slice, fix and write
//!
//! ```
//! use lamp_slicer::fix::{FixOptions, fix};
//! use lamp_slicer::slicer::{OpenOptions, Part, SliceOptions, Slices};
//! use lamp_slicer::stack::{Destination, Pitch, Format, Length, Pages, write_stack};
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
//!     pitch: Pitch::of_dpi(600.0).expect("it is positive"),
//!     thickness: Length::from_um(100.0),
//!     ..SliceOptions::default()
//! };
//! let layers = Slices::new(part, &options)?.map(|layer| Ok::<_, lamp_slicer::Error>(layer?));
//! let fixed = fix(layers, FixOptions::default(), |fixed| {
//!     println!("layer {}: {} bands corrected", fixed.before.info.index, fixed.bands.len());
//! });
//! let tiff = folder.path().join("wedge.tif");
//! write_stack(fixed, Destination::File(tiff.clone()), Format::Big)?;
//!
//! assert_eq!(Pages::open(&tiff)?.layers().count(), 90);
//! # Ok::<(), lamp_slicer::Error>(())
//! ```
//!
//! # Lay out a build
//!
//! Stages are adaptors, so a build of corrected layers is a chain of two:
//!
//! ```
//! use lamp_slicer::build::{TileOptions, tile};
//! use lamp_slicer::fix::{FixOptions, fix};
//! use lamp_slicer::stack::{Pitch, Image, Layer, Mask, PageInfo};
//!
//! // Row 1 missed its second crossing and runs to the image's edge.
//! let mask = Mask::new(8, vec![0, 2, 3, 5], vec![2, 5, 2, 2, 5]).unwrap();
//! let layer = Layer { info: PageInfo::default(), pitch: Pitch::of_dpi(100.0), image: mask.into() };
//!
//! let layers = std::iter::once(Ok::<_, lamp_slicer::Error>(layer));
//! let fixed = fix(layers, FixOptions::default(), |fixed| {
//!     let band = &fixed.bands[0];
//!     assert_eq!((band.first_row, band.pixels, band.gap.clone()), (1, 3, Some(5..6)));
//! });
//! let options = TileOptions { area: "0.2x0.1in".parse()?, ..TileOptions::default() };
//! let fixed = fixed.map(|layer| Ok::<_, lamp_slicer::Error>(layer?.decode()?));
//! let mut build = tile(fixed, options);
//! let Image::Mask(build) = build.next().unwrap()?.image.into_image() else { unreachable!() };
//! assert_eq!((build.width(), build.height()), (20, 10));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Check for what floats
//!
//! ```
//! use lamp_slicer::stack::{Pitch, Layer, Mask, PageInfo};
//! use lamp_slicer::supports::{CheckOptions, check};
//!
//! let layer = |index: u32, changes: Vec<u32>| {
//!     // All ten rows are alike: white from each first column to the second.
//!     let rows = (0..=10).map(|row| row * changes.len() as u32).collect();
//!     let image = Mask::new(20, rows, changes.repeat(10)).unwrap().into();
//!     let z_um = Some(100.0 * f64::from(index));
//!     let info = PageInfo { index, z_um, thickness_um: Some(100.0), ..PageInfo::default() };
//!     Layer { info, pitch: Pitch::of_dpi(254.0), image }
//! };
//! // The second piece of layer 1 stands on nothing.
//! let layers = [layer(0, vec![2, 8]), layer(1, vec![2, 8, 12, 18])];
//! let layers = layers.into_iter().map(Ok::<_, lamp_slicer::Error>);
//! let findings = check(layers, Ok, &CheckOptions::default())?;
//! assert_eq!(findings.islands.count(), 1);
//! # Ok::<(), lamp_slicer::Error>(())
//! ```
//!
//! # Plan exposures
//!
//! ```
//! use lamp_slicer::grayscale::exposure::Exposure;
//! use lamp_slicer::grayscale::material::Material;
//! use lamp_slicer::stack::{Catalogued, Length};
//!
//! // White cures half as deep again as a layer.
//! let material = Material::builtin("lamp-suspension").expect("it is built in");
//! let exposure = Exposure::by_material(material, None, 1.5)?;
//! assert_eq!(exposure.time(Length::from_um(100.0))?.ms().round(), 172.0);
//! # Ok::<(), lamp_slicer::Error>(())
//! ```
//!
//! [`planning`] chooses times and gray levels where the light of many layers adds up.
//!
//! # Run a pipeline from its settings
//!
//! ```
//! use lamp_slicer::pipeline::fix::FixSettings;
//! use lamp_slicer::pipeline::{SliceSettings, Stage};
//!
//! // Settings are plain structs; equal texts mean equal results, whatever the spelling was.
//! let slice: SliceSettings = Default::default();
//! assert!(slice.canonical().starts_with(" --dpi 1500"));
//! let fix = Stage::Fix(FixSettings { use_neighbours: true, ..FixSettings::default() });
//! assert!(fix.canonical().ends_with("--use-neighbours"));
//! ```
//!
//! # Read a night
//!
//! ```
//! use std::path::Path;
//!
//! use lamp_slicer::batch::Night;
//!
//! let text = "parts = \"parts/*.stl\"\nstages = \"slice --dpi 600 | fix\"\n";
//! let error = Night::parse(text, Path::new("night.toml")).unwrap_err();
//! // One sentence, with its line and column.
//! assert!(error.to_string().starts_with("line "));
//! ```

#![forbid(unsafe_code)]

mod error;

pub use error::Error;

pub use lamp_adaptive as adaptive;
pub use lamp_batch as batch;
pub use lamp_build as build;
pub use lamp_edit as edit;
pub use lamp_fix as fix;
pub use lamp_gantry as gantry;
pub use lamp_grayscale as grayscale;
pub use lamp_machine as machine;
pub use lamp_offset as offset;
pub use lamp_pipeline as pipeline;
pub use lamp_planning as planning;
pub use lamp_plots as plots;
pub use lamp_slicing as slicer;
pub use lamp_stack as stack;
pub use lamp_supports as supports;
pub use lamp_view as view;
