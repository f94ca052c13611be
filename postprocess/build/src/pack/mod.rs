//! Packs copies: finds places for as many as fit, or as are asked for.
//!
//! Simple strategies come first: a grid, then boxes wherever they fit, then outlines,
//! each before and after parts may be turned, and lattices of one part. A later strategy is
//! taken only if it places more copies. Several parts are then brought closer by a search.

mod greedy;
mod grid;
mod job;
mod lattice;
mod mix;
mod no_fit;
mod shares;

use lamp_stack::{Length, MAX_SIDE, Orientation, Size};

use super::{CopyPlacement, Layout, PixelSize, TileError};
use job::Job;

/// How a copy may lie: the stack that it takes its images from, and their turn.
type Way = (usize, Orientation);

/// Options to find places.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pack {
    /// The extent of a part that keeps the gap from other parts.
    pub by: PackBy,
    /// How parts may be turned.
    pub turns: Turns,
    /// The least distance from the copies to the area's edges.
    pub edge_gap: Length,
    /// Whether the numbers of copies of several parts are shares: as many copies as fit are placed,
    /// and each part's number is within one of its share.
    pub shares: bool,
}

/// The extent of a part that keeps the gap from other parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PackBy {
    /// The box around it.
    #[default]
    Boxes,
    /// Its outline, if boxes do not place all copies or parts are several.
    Outlines,
}

lamp_stack::named!(PackBy { Boxes = "box", Outlines = "outline" });

/// How parts may be turned if that places more copies. None is mirrored, as that would
/// be another part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Turns {
    /// Not at all.
    #[default]
    None,
    /// By 180 degrees.
    Half,
    /// By 90, 180 and 270 degrees.
    Quarters,
}

lamp_stack::named!(Turns { None = "none", Half = "half", Quarters = "quarters" });

impl Turns {
    /// Returns the quarter turns that are allowed, in the order in which they are tried.
    fn quarters(self) -> &'static [u32] {
        match self {
            Self::None => &[0],
            Self::Half => &[0, 2],
            Self::Quarters => &[0, 2, 1, 3],
        }
    }

    /// Returns them as orientations.
    fn orientations(self) -> Vec<Orientation> {
        self.quarters().iter().map(|&quarters| Orientation::new(quarters, false)).collect()
    }
}

impl Pack {
    /// Returns the options that ask for it, for the command on the build's first page.
    pub(super) fn options(self) -> String {
        let mut options = String::new();
        if self.by != PackBy::default() {
            options += &format!(" --pack {}", self.by);
        }
        if self.turns != Turns::default() {
            options += &format!(" --turns {}", self.turns);
        }
        if self.edge_gap > Length::default() {
            options += &format!(" --edge-gap {}", self.edge_gap);
        }
        options
    }
}

/// More copies than anyone builds. Parts of a pixel would otherwise fill the area with
/// billions of them.
const MAX_COPIES: u32 = 1 << 20;

/// Finds places for all copies, or for as many of several parts as fit, with so many pixels
/// between them, and the gap of the options to the area's edges.
///
/// # Errors
/// Returns an error if a part is larger than the area within its edges, if not all copies of a
/// single part find a place, or not one of several.
pub(super) fn pack(
    layout: &Layout,
    counts: &[Option<u32>],
    gap: u32,
    how: Pack,
) -> Result<Vec<CopyPlacement>, TileError> {
    within_edges(layout, how, |within| Job::new(within, gap, how).pack(counts))
}

/// Finds places as [`pack`] does, by outlines alone. Copies of each part may have their images from
/// any of some of the layout's stacks, the first of which is its own.
pub(super) fn pack_turned(
    layout: &Layout,
    counts: &[Option<u32>],
    gap: u32,
    how: Pack,
    stacks: &[Vec<usize>],
) -> Result<Vec<CopyPlacement>, TileError> {
    within_edges(layout, how, |within| Job::turned(within, gap, how, stacks).pack(counts))
}

/// Finds places on the area without its edges.
fn within_edges(
    layout: &Layout,
    how: Pack,
    pack: impl FnOnce(&Layout) -> Result<Vec<CopyPlacement>, TileError>,
) -> Result<Vec<CopyPlacement>, TileError> {
    let edge = pixels_across(how.edge_gap, layout);
    let mut within = layout.clone();
    let side = |pixels: u32| pixels.saturating_sub(edge.saturating_mul(2));
    let length = |side: Length| {
        Length::from_um((side.um() - 2.0 * how.edge_gap.um().max(0.0)).max(0.0)).to_whole_nm()
    };
    let PixelSize { width, height } = layout.pixels();
    within.pixels = PixelSize { width: side(width), height: side(height) };
    let Size { width, height } = layout.area();
    within.area = Size { width: length(width), height: length(height) };
    let mut placements = pack(&within)?;
    for at in &mut placements {
        (at.left, at.top) = (at.left + edge, at.top + edge);
    }
    Ok(placements)
}

/// Returns a distance in pixels, rounded up. One that no two places of the area are apart leaves
/// room for one copy, and so does a wider one.
pub(super) fn pixels_across(gap: Length, layout: &Layout) -> u32 {
    let pixels = (gap.pixels(layout.dpi()).max(0.0) - 1e-6).ceil().max(0.0) as u32;
    // Nothing on the area is farther apart.
    let PixelSize { width, height } = layout.pixels();
    pixels.min(width.saturating_add(height)).min(MAX_SIDE)
}

#[cfg(test)]
mod pack_tests;
