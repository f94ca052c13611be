//! Errors of laying parts out and building their layers.

use std::fmt;

use lamp_stack::{Length, NotSquare, Pitch, Size};
use thiserror::Error;

use super::PixelSize;

/// Why parts cannot be laid out on a build area, or their layers not be built.
///
/// `name` is always a part as the caller named it, `layer` a layer as its page
/// names it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TileError {
    /// Not a single copy fits.
    #[error(
        "{name}: the part's image is {part} pixels, larger than the build area of {area} ({area_mm})"
    )]
    TooLarge {
        /// The part.
        name: String,
        /// The size of what would be placed.
        part: PixelSize,
        /// The size of the area.
        area: PixelSize,
        /// The area as lengths.
        area_mm: Size,
    },
    /// Not all copies fit.
    #[error("{name}: {} on the build area of {area_mm}", fewer(*asked, *most))]
    TooMany {
        /// The part.
        name: String,
        /// The number of copies asked for.
        asked: u32,
        /// The number of copies that found a place.
        most: u32,
        /// The area as lengths.
        area_mm: Size,
    },
    /// The build area is larger than the largest image.
    #[error("the build area of {area_mm} is more than 2^26 pixels wide or high")]
    AreaTooLarge {
        /// The area as lengths.
        area_mm: Size,
    },
    /// The walls leave no holes, or cells are smaller than a few pixels.
    #[error("a mesh of cells {cell} apart with walls of {wall} has no holes")]
    NoCells {
        /// The distance between the centers of neighboring cells.
        cell: Length,
        /// The thickness of the walls.
        wall: Length,
    },
    /// The image to repeat as a mesh has no pixels.
    #[error("{name}: the mesh's image has no pixels")]
    NoTemplate {
        /// The image.
        name: String,
    },
    /// The mesh has more runs than an image can hold.
    #[error("the mesh has more runs than an image can hold")]
    FineMesh,
    /// Break lines would leave nothing of the mesh.
    #[error("there would be more than 10000 break lines")]
    ManyBreaks,
    /// The moat is to follow outlines, but a part was read without its outline.
    #[error("{name}: its outline is not known, which moats by outline and turns need")]
    NoOutline {
        /// The part.
        name: String,
    },
    /// A part is to be turned, but where it is in its images is not known.
    #[error("{name}: its pages do not say where they are on the part (origin_mm)")]
    NoPlace {
        /// The part.
        name: String,
    },
    /// The gap to the area's edges leaves no pixel of it.
    #[error("an edge gap of {edge_gap} leaves nothing of the build area of {area_mm}")]
    WideEdgeGap {
        /// The least distance from copies to the area's edges.
        edge_gap: Length,
        /// The area as lengths.
        area_mm: Size,
    },
    /// The moat leaves no room for the mesh.
    #[error("a clearance of {clearance} is wider than the build area of {area_mm}")]
    WideMoat {
        /// The distance between a part and the mesh.
        clearance: Length,
        /// The area as lengths.
        area_mm: Size,
    },
    /// No piece of mesh can be so large.
    #[error("a least piece of {least_mm2} mm2 of mesh is larger than the build area of {area_mm}")]
    LargePiece {
        /// The area of the least piece that is wanted, in square millimeters.
        least_mm2: f64,
        /// The area as lengths.
        area_mm: Size,
    },
    /// The copies have more runs than an image can hold.
    #[error("{copies} copies in {layer} have more runs than an image can hold")]
    TooManyRuns {
        /// The number of copies.
        copies: usize,
        /// The layer.
        layer: String,
    },
    /// The resolution is unknown, so lengths mean nothing in pixels.
    #[error("{name}: {layer} has no resolution, so the build area has no size in pixels")]
    NoResolution {
        /// The part.
        name: String,
        /// The layer.
        layer: String,
    },
    /// A layer's resolution differs from the first layer's.
    #[error("{name}: {layer} differs in resolution from the first layer: a stack has one")]
    OtherResolution {
        /// The part.
        name: String,
        /// The layer.
        layer: String,
    },
    /// The pixels of a part are not square.
    #[error("{name}: {why}")]
    NotSquare {
        /// The part.
        name: String,
        /// Its pitch.
        why: NotSquare,
    },
    /// A layer's size differs from the first layer's.
    #[error(
        "{name}: {layer} is {found} pixels where the first layer is {expected}: a stack has one size"
    )]
    OtherSize {
        /// The part.
        name: String,
        /// The layer.
        layer: String,
        /// Its size.
        found: PixelSize,
        /// The first layer's size.
        expected: PixelSize,
    },
    /// Two parts have different resolutions.
    #[error("{name} has {pitch:#} and {first} has {first_pitch:#}: a build has one resolution")]
    Resolutions {
        /// The first part.
        first: String,
        /// Its resolution.
        first_pitch: Box<Pitch>,
        /// The part that differs.
        name: String,
        /// Its resolution.
        pitch: Box<Pitch>,
    },
    /// A part is black in all layers.
    #[error("{name}: all its layers are black, so there is no part to place")]
    Black {
        /// The part.
        name: String,
    },
    /// A layer is white outside the outline that was found before.
    #[error(
        "{name}: {layer} is not as it was when the part's extents were found: the stack was changed meanwhile"
    )]
    Changed {
        /// The part.
        name: String,
        /// The layer.
        layer: String,
    },
    /// Two copies of a layout overlap.
    #[error("{one} and {other} overlap near x {:.2} y {:.2} mm", at_mm[0], at_mm[1])]
    Overlap {
        /// A copy.
        one: CopyName,
        /// Another copy.
        other: CopyName,
        /// A point of both, from the build area's lower left corner.
        at_mm: [f64; 2],
    },
    /// A copy of a layout reaches beyond the build area.
    #[error("{copy} reaches {beyond} beyond the build area of {area_mm}")]
    OutOfArea {
        /// The copy.
        copy: CopyName,
        /// The distance.
        beyond: Length,
        /// The area as lengths.
        area_mm: Size,
    },
    /// Two stacks start at different heights.
    #[error("{name} starts at z {:.3} mm and {first} at {:.3} mm", z.mm(), first_z.mm())]
    OtherStart {
        /// The first part.
        first: String,
        /// The bottom of its first layer.
        first_z: Length,
        /// The part that differs.
        name: String,
        /// The bottom of its first layer.
        z: Length,
    },
    /// A layer does not span the heights of the build's layer.
    #[error(
        "{name}: {layer} spans z {} to {} mm where the build's layer spans {} to {}",
        mm(.spans[0]), mm(.spans[1]), mm(.build[0]), mm(.build[1])
    )]
    OtherHeights {
        /// The part.
        name: String,
        /// The layer.
        layer: String,
        /// The layer's bottom and top.
        spans: [Length; 2],
        /// The bottom and top of the build's layer.
        build: [Length; 2],
        /// The part whose heights are the build's.
        first: String,
    },
    /// A layer does not say its height or thickness.
    #[error(
        "{name}: {layer} does not state its height and thickness, but other stacks do: stacks are joined by height"
    )]
    NoHeight {
        /// The part.
        name: String,
        /// The layer.
        layer: String,
    },
    /// The first stack's layers give the build its heights, and one has none itself.
    #[error(
        "{name}: {layer} is {} um thick, too thin to take layers of other stacks by", thickness.um()
    )]
    TooThin {
        /// The first part.
        name: String,
        /// The layer.
        layer: String,
        /// Its thickness.
        thickness: Length,
    },
    /// Two parts have different exposures in one layer.
    #[error(
        "in {layer}, {name} is to be exposed for {ms} ms and {first} for {first_ms} ms: a build's layer has one exposure"
    )]
    Exposures {
        /// The layer.
        layer: String,
        /// A part.
        first: String,
        /// Its exposure in milliseconds.
        first_ms: f64,
        /// The part that differs.
        name: String,
        /// Its exposure in milliseconds.
        ms: f64,
    },
}

/// A copy of a part as messages name it: `blade.tif copy 3`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CopyName {
    /// The part.
    pub name: String,
    /// The copy's number among the copies of the part, from 1.
    pub number: u32,
}

impl fmt::Display for CopyName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} copy {}", self.name, self.number)
    }
}

/// Says that fewer copies fit than were asked for.
fn fewer(asked: u32, most: u32) -> String {
    match most {
        0 => "no copy found a place".to_owned(),
        _ => format!("{asked} copies were asked for, but only {most} fit"),
    }
}

/// Returns a length in millimeters, rounded to a tenth of a micrometer.
fn mm(length: Length) -> f64 {
    (length.um() * 10.0).round() / 1e4
}
