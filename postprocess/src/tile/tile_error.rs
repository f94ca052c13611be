//! Why parts cannot be laid out.

use lamp_stack::{Dpi, Length, Size};
use thiserror::Error;

use super::PixelSize;

/// Why parts cannot be laid out on a build area.
///
/// Parts and layers are called by what people call them.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TileError {
    /// Not one copy fits.
    #[error(
        "{name}: the part's image is {part} pixels, larger than the build area of {area} ({area_mm}): give a larger --area, or --fit if the image is wider than the part"
    )]
    TooLarge {
        /// The part.
        name: String,
        /// Width and height of what is to be placed.
        part: PixelSize,
        /// Width and height of the area.
        area: PixelSize,
        /// The area as lengths.
        area_mm: Size,
    },
    /// Not all copies fit.
    #[error(
        "{name}: {asked} copies were asked for, but only {most} fit on the build area of {area_mm}: give a larger --area, a smaller --gap or fewer copies, or try --pack outline"
    )]
    TooMany {
        /// The part.
        name: String,
        /// The copies asked for.
        asked: u32,
        /// The copies for which a place was found.
        most: u32,
        /// The area as lengths.
        area_mm: Size,
    },
    /// The build area is larger than any reader of stacks takes.
    #[error("the build area of {area_mm} is more than 2^26 pixels wide or high")]
    AreaTooLarge {
        /// The area as lengths.
        area_mm: Size,
    },
    /// Cells without holes, or too small for pixels.
    #[error(
        "a mesh of cells {cell} apart with walls of {wall} has no holes: give a larger --cell or a smaller --wall"
    )]
    NoCells {
        /// From the middle of a cell to that of the next.
        cell: Length,
        /// The thickness of the walls.
        wall: Length,
    },
    /// A mesh that is an image without pixels.
    #[error("{name}: the mesh's image has no pixels")]
    NoTemplate {
        /// The image.
        name: String,
    },
    /// A mesh of more runs than an image can hold.
    #[error("the mesh has more runs than an image can hold: give it larger cells")]
    FineMesh,
    /// Break lines that leave no mesh.
    #[error(
        "there would be more than 10000 break lines: give a wider --break-pitch, or --break-width 0um"
    )]
    ManyBreaks,
    /// Moats by outlines that are not known.
    #[error("{name}: its outline is not known: moats by outline need --fit")]
    NoOutline {
        /// The part.
        name: String,
    },
    /// A moat that leaves no place for the mesh.
    #[error(
        "a clearance of {clearance} is wider than the build area of {area_mm}: give a smaller --clearance, or --mesh none"
    )]
    WideMoat {
        /// How far from a part the mesh would begin.
        clearance: Length,
        /// The area as lengths.
        area_mm: Size,
    },
    /// The copies have more runs than an image can hold.
    #[error("{copies} copies in {layer} have more runs than an image can hold: place fewer")]
    TooManyRuns {
        /// How many copies.
        copies: usize,
        /// The layer's name.
        layer: String,
    },
    /// The resolution is not known, so lengths have no meaning in pixels.
    #[error("{name}: {layer} has no resolution, so the build area has no size in pixels")]
    NoResolution {
        /// The part.
        name: String,
        /// The layer's name.
        layer: String,
    },
    /// A layer of another resolution than the first.
    #[error("{name}: {layer} has another resolution than the first layer: a stack has one")]
    OtherResolution {
        /// The part.
        name: String,
        /// The layer's name.
        layer: String,
    },
    /// A layer is not like the first.
    #[error(
        "{name}: {layer} is {found} pixels where the first layer is {expected}: a stack has one size"
    )]
    OtherSize {
        /// The part.
        name: String,
        /// The layer's name.
        layer: String,
        /// Its size.
        found: PixelSize,
        /// The first layer's size.
        expected: PixelSize,
    },
    /// Two parts of different resolutions.
    #[error(
        "{name} has {dpi} dpi and {first} has {first_dpi} dpi: slice them at one resolution to build them together"
    )]
    Resolutions {
        /// The first part.
        first: String,
        /// Its resolution.
        first_dpi: Dpi,
        /// The part that differs.
        name: String,
        /// Its resolution.
        dpi: Dpi,
    },
    /// There is nothing to find the extents of.
    #[error("{name}: all its layers are black, so there is no part to place")]
    Black {
        /// The part.
        name: String,
    },
    /// A layer is not within the extents that were found.
    #[error(
        "{name}: {layer} is not as it was when the part's extents were found: the stack was changed meanwhile; run tile again"
    )]
    Changed {
        /// The part.
        name: String,
        /// The layer's name.
        layer: String,
    },
    /// Two copies of a layout lie on each other.
    #[error(
        "{one} and {other} overlap near x {x_mm:.2} y {y_mm:.2} mm: move one of them, or give --fit if only their black margins do"
    )]
    Overlap {
        /// A copy.
        one: CopyName,
        /// Another.
        other: CopyName,
        /// Where on the build, from its lower left corner.
        x_mm: f64,
        /// Where on the build, from its lower left corner.
        y_mm: f64,
    },
    /// A copy of a layout is not on the build area.
    #[error(
        "{copy} reaches {beyond} beyond the build area of {area_mm}: move it, or give --fit if only its black margin does"
    )]
    OutOfArea {
        /// The copy.
        copy: CopyName,
        /// How far.
        beyond: Length,
        /// The area as lengths.
        area_mm: Size,
    },
    /// Stacks that start at different heights.
    #[error(
        "{name} starts at z {z:.3} mm and {first} at {first_z:.3} mm: slice them with the same first layer, or give --settle to set all on the platform"
    )]
    OtherStart {
        /// The first part.
        first: String,
        /// Its height in millimetres.
        first_z: f64,
        /// The part that differs.
        name: String,
        /// Its height in millimetres.
        z: f64,
    },
    /// A layer that does not match the build's.
    #[error(
        "{name}: {layer} spans z {} to {} mm where the build's layer spans {} to {}: slice it again with --thickness {}, or give --resample to take the layer at each height of {first}",
        mm(.spans[0]), mm(.spans[1]), mm(.build[0]), mm(.build[1]), thickness(.build)
    )]
    OtherHeights {
        /// The part.
        name: String,
        /// The layer's name.
        layer: String,
        /// The layer's bottom and top, in micrometres.
        spans: [f64; 2],
        /// Those of the build's layer.
        build: [f64; 2],
        /// The part whose heights are the build's.
        first: String,
    },
    /// A layer says nothing of its height.
    #[error(
        "{name}: {layer} does not say at which height it lies and how thick it is, as other stacks do: stacks are joined by their heights"
    )]
    NoHeight {
        /// The part.
        name: String,
        /// The layer's name.
        layer: String,
    },
    /// Parts that want different exposures in one layer.
    #[error(
        "in {layer}, {name} is to be exposed for {ms} ms and {first} for {first_ms} ms: a build's layer has one exposure; slice the parts for the same"
    )]
    Exposures {
        /// The layer's name.
        layer: String,
        /// A part.
        first: String,
        /// Its exposure.
        first_ms: f64,
        /// The part that differs.
        name: String,
        /// Its exposure.
        ms: f64,
    },
}

/// A copy of a part, as people call it: `blade.tif copy 3`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CopyName {
    /// The part.
    pub name: String,
    /// Which of the part's copies, from 1.
    pub number: u32,
}

impl std::fmt::Display for CopyName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} copy {}", self.name, self.number)
    }
}

/// Micrometres as millimetres, to the micrometre's tenth.
fn mm(um: f64) -> f64 {
    (um * 10.0).round() / 1e4
}

/// How thick a layer is, to the nanometre.
fn thickness([bottom, top]: &[f64; 2]) -> Length {
    Length::from_um(((top - bottom) * 1e3).round() / 1e3)
}
