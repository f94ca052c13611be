//! Edges moved by a distance: cure-width compensation.
//!
//! Source: 002 section 3.4: every cured region is wider than its image.
//!
//! The distance of a white pixel is that of its centre from the nearest black
//! pixel's centre; its square is a whole number, so nothing is lost. Outside the
//! image all is black. An edge that shrinks by `r` leaves of a pixel at distance
//! `D` the share `D - r`, from 0 to 1: a straight edge moves by exactly `r`, and
//! what is no whole pixel is a gray one. Growing is the shrinking of what is
//! black, within the image. In 1-bit form a pixel is white whose share is a half
//! or more.
//!
//! [`far`] cuts rows by the disc around each pixel of the other colour, row by
//! row of the disc; [`ring`] measures the pixels that are left in question
//! (of plain rows [`along`] does both),
//! [`edge`] keeps them; [`thin`] keeps thin walls, where [`plain`] does not
//! tell that there is none, and [`walls`] tells of them;
//! [`pieces`] tells of those that are lost or break apart where walls are not
//! kept; [`size`] tells how wide places are; [`scale`] makes up for firing.

mod along;
mod edge;
mod far;
mod levels;
mod pieces;
mod plain;
mod ring;
mod rows;
mod scale;
mod size;
mod stage;
mod thin;
mod walls;
mod widths;

use lamp_stack::{GrayMask, Mask};

use edge::{Class, Edge, EdgePixel};
use far::{Disc, Field, Sources};
use rows::Rows;
use thin::Cores;

pub use pieces::Loss;
pub(crate) use pieces::without_holes;
pub use stage::{CompensateError, CompensateOptions, Compensated, Shrinkage, compensate};
pub use walls::ThinWall;
pub use widths::Widths;

/// Edges move by at most so many pixels; more counts as that.
const FURTHEST: f64 = 30_000.0;

/// Moves all edges of a mask inwards by so many pixels (outwards where below
/// zero; at most 30 000), with what is no whole pixel as gray.
pub fn offset(mask: &Mask, inwards: f64) -> GrayMask {
    let (sources, outside) = sides(inwards);
    let classes = [Class { region: region(mask, sources), by: inwards.abs().min(FURTHEST) }];
    let edge = Edge::new(&Field::new(mask, sources), mask.width(), &classes, 1.0, false);
    gray_of(&edge, mask.width(), outside)
}

/// Moves all edges of a mask inwards by so many pixels (outwards where below
/// zero), to the nearest pixel.
pub fn offset_one_bit(mask: &Mask, inwards: f64) -> Mask {
    let (sources, _) = sides(inwards);
    let disc = Disc::below(far::at_least(inwards.abs() + 0.5), mask.height());
    let left = Field::new(mask, sources).all_outside(&disc, &region(mask, sources));
    let left = left.mask(mask.width());
    if sources == Sources::White { left.inverted() } else { left }
}

/// Moves the edges of a mask inwards by widths that depend on the places'
/// sizes, and keeps thin walls: those that were as wide as `min_feature` pixels
/// stay as wide, others as they are, and none breaks. What is nowhere half as
/// bright as white and cut off from the rest goes. Zero keeps nothing.
///
/// Where walls are kept, the cost follows the pixels along the edges, as deep
/// as they move and half of `min_feature`.
pub fn shrink(mask: &Mask, widths: &Widths, min_feature: f64) -> (GrayMask, Vec<ThinWall>) {
    let regions = size::by_size(mask, widths.sizes());
    let classes: Vec<Class> =
        regions.into_iter().zip(widths.by()).map(|(region, &by)| Class { region, by }).collect();
    let field = Field::new(mask, Sources::Black);
    if min_feature > 0.0 {
        // Further inside, a wall is wide enough even when it has shrunk.
        let depth = f64::max(1.0, 0.5 + min_feature / 2.0);
        let mut edge = Edge::new(&field, mask.width(), &classes, depth, true);
        let cores = Cores::of(&edge, widths.range()[1] + depth);
        cores.widen(&mut edge, min_feature);
        let by = |pixel: &EdgePixel| {
            let holds = |class: &&Class| class.region.holds(pixel.column, pixel.row);
            classes.iter().find(holds).map_or(0.0, |class| class.by)
        };
        let walls = cores.cores.iter().filter_map(|core| ThinWall::of(&edge, core, by)).collect();
        (pieces::without_specks(gray_of(&edge, mask.width(), 0)), walls)
    } else {
        let edge = Edge::new(&field, mask.width(), &classes, 1.0, false);
        (gray_of(&edge, mask.width(), 0), Vec::new())
    }
}

/// From where distances are measured, and the level beyond those pixels.
fn sides(inwards: f64) -> (Sources, u8) {
    if inwards < 0.0 { (Sources::White, 255) } else { (Sources::Black, 0) }
}

/// The pixels of the image that are no sources.
fn region(mask: &Mask, sources: Sources) -> Rows {
    match sources {
        Sources::Black => Rows::white(mask),
        Sources::White => Rows::white(&mask.inverted()),
    }
}

fn gray_of(edge: &Edge, width: u32, outside: u8) -> GrayMask {
    let mut gray = GrayMask::new(width);
    let mut runs = Vec::new();
    for row in 0..edge.height() {
        edge.levels_of_row(row, width, outside, &mut runs);
        gray.push_runs(runs.iter().copied()).expect("runs as wide as the image");
    }
    gray
}

#[cfg(test)]
mod tests;
