//! Stages between slicing and the machine: images in, images out, all on runs.
//!
//! - [`fix`] corrects stray rows.
//! - [`compensate`] narrows images by the cure width and makes up for firing shrinkage.
//! - [`edit`] changes a design without slicing it again.
//! - [`tile`] lays copies of parts out on a build area; a [`Layout`] says where copies of several
//!   parts stand, a [`Machine`](machine::Machine) how large a build may be. A [`Composer`] makes any
//!   layer of a build by its [`Recipe`].
//! - [`StripWriter`] cuts build layers into [`Swaths`] for a projector that scans, and
//!   [`join_strips`] joins them again.
//!
//! Stages are adaptors from layers to layers, so they can be chained:
//!
//! ```
//! use lamp_postprocess::{FixOptions, TileError, TileOptions, fix, tile};
//! use lamp_stack::{Dpi, Image, Layer, Mask, PageInfo};
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

mod edit;
mod fix;
pub mod machine;
mod offset;
mod strips;
mod tile;

pub use edit::{
    EditError, EditProblem, Edits, ImageBounds, LabelList, LayerProblem, ListProblem, OtherLayers,
    OtherPicture, edit, edit_passing,
};
pub use fix::{
    Band, BandKind, BandKinds, BandOutcome, FIX_REACH, FixMethod, FixOptions, Fixed, fix,
    fix_passing,
};
pub use offset::{
    CompensateError, CompensateOptions, CompensateProblem, Compensated, Loss, Shrinkage, ThinWall,
    Widths, beyond_tolerance, compensate, offset, offset_one_bit, shrink,
};
pub use strips::{
    IndexError, JoinSwathsError, Seam, StripDifference, StripFile, StripForm, StripWriter,
    StripsError, Swaths, SwathsError, check_number, is_strips, join_strips, strip_files,
};
pub use tile::{
    BuildFinding, BuildWanted, CellShape, Composer, CopyEntry, CopyName, CopyPlacement,
    CuredPixels, FreeTurns, FreeTurnsError, HeightOptions, LayerAreas, Layout, LayoutError,
    LayoutFile, LoosePieces, MeshOptions, MeshPattern, Moat, Pack, PackBy, PartStack, PixelSize,
    PlannedStack, Recipe, RecipeError, RecipePart, StrayRows, TILE_CODE, TileError, TileOptions,
    TurnedPlan, TurnedSlicing, Turns, tile,
};
