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
//! [`erode`] cuts rows by the disc around each pixel of the other colour, row by
//! row of the disc; [`boundary_distance`] measures the pixels that are left in question
//! (of plain rows [`aligned_rows`] does both),
//! [`edge_map`] keeps them; [`skeleton`] keeps thin walls, where [`plain`] does not
//! tell that there is none, and [`walls`] tells of them;
//! [`components`] tells of those that are lost or break apart where walls are not
//! kept; [`local_thickness`] tells how wide places are; [`scale`] makes up for firing.

mod aligned_rows;
mod boundary_distance;
mod compensate;
mod components;
mod edge_map;
mod erode;
mod local_thickness;
mod plain;
mod row_runs;
mod scale;
mod skeleton;
mod walls;
mod widths;

use lamp_stack::{GrayMask, Mask};

use edge_map::{EdgeMap, EdgePixel, SizeClass};
use erode::{Disc, SourceColour, Sources};
use row_runs::RowRuns;
use skeleton::Cores;

pub use compensate::{CompensateError, CompensateOptions, Compensated, Shrinkage, compensate};
pub use components::Loss;
pub(crate) use components::without_holes;
pub use walls::ThinWall;
pub use widths::Widths;

/// Edges move by at most so many pixels; more counts as that.
const MAX_MOVE: f64 = 30_000.0;

/// Moves all edges of a mask inwards by so many pixels (outwards where below
/// zero; at most 30 000), with what is no whole pixel as gray.
pub fn offset(mask: &Mask, inwards: f64) -> GrayMask {
    let (sources, outside) = sides(inwards);
    let classes = [SizeClass { region: region(mask, sources), by: inwards.abs().min(MAX_MOVE) }];
    let edge = EdgeMap::new(&Sources::new(mask, sources), mask.width(), &classes, 1.0, false);
    gray_of(&edge, mask.width(), outside)
}

/// Moves all edges of a mask inwards by so many pixels (outwards where below
/// zero), to the nearest pixel.
pub fn offset_one_bit(mask: &Mask, inwards: f64) -> Mask {
    let (sources, _) = sides(inwards);
    let disc = Disc::below(erode::at_least(inwards.abs() + 0.5), mask.height());
    let left = Sources::new(mask, sources).erode_all(&disc, &region(mask, sources));
    let left = left.mask(mask.width());
    if sources == SourceColour::White { left.inverted() } else { left }
}

/// Moves the edges of a mask inwards by widths that depend on the places'
/// sizes, and keeps thin walls: those that were as wide as `min_feature` pixels
/// stay as wide, others as they are, and none breaks. What is nowhere half as
/// bright as white and cut off from the rest goes. Zero keeps nothing.
///
/// Where walls are kept, the cost follows the pixels along the edges, as deep
/// as they move and half of `min_feature`.
pub fn shrink(mask: &Mask, widths: &Widths, min_feature: f64) -> (GrayMask, Vec<ThinWall>) {
    let regions = local_thickness::by_size(mask, widths.sizes());
    let classes: Vec<SizeClass> = regions
        .into_iter()
        .zip(widths.by())
        .map(|(region, &by)| SizeClass { region, by })
        .collect();
    let sources = Sources::new(mask, SourceColour::Black);
    if min_feature > 0.0 {
        // Further inside, a wall is wide enough even when it has shrunk.
        let depth = f64::max(1.0, 0.5 + min_feature / 2.0);
        let mut edge = EdgeMap::new(&sources, mask.width(), &classes, depth, true);
        let cores = Cores::of(&edge, widths.range()[1] + depth);
        cores.widen(&mut edge, min_feature);
        let by = |pixel: &EdgePixel| {
            let holds = |class: &&SizeClass| class.region.holds(pixel.column, pixel.row);
            classes.iter().find(holds).map_or(0.0, |class| class.by)
        };
        let walls = cores.cores.iter().filter_map(|core| ThinWall::of(&edge, core, by)).collect();
        (components::without_specks(gray_of(&edge, mask.width(), 0)), walls)
    } else {
        let edge = EdgeMap::new(&sources, mask.width(), &classes, 1.0, false);
        (gray_of(&edge, mask.width(), 0), Vec::new())
    }
}

/// From where distances are measured, and the level beyond those pixels.
fn sides(inwards: f64) -> (SourceColour, u8) {
    if inwards < 0.0 { (SourceColour::White, 255) } else { (SourceColour::Black, 0) }
}

/// The pixels of the image that are no sources.
fn region(mask: &Mask, sources: SourceColour) -> RowRuns {
    match sources {
        SourceColour::Black => RowRuns::white(mask),
        SourceColour::White => RowRuns::white(&mask.inverted()),
    }
}

fn gray_of(edge: &EdgeMap, width: u32, outside: u8) -> GrayMask {
    let mut gray = GrayMask::new(width);
    let mut runs = Vec::new();
    for row in 0..edge.height() {
        edge.levels_of_row(row, width, outside, &mut runs);
        gray.push_runs(runs.iter().copied()).expect("runs as wide as the image");
    }
    gray
}

#[cfg(test)]
mod offset_tests;
