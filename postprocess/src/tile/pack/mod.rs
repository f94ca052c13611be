//! Packs copies: finds places for as many as fit, or as are asked for.
//!
//! Simple strategies come first: a grid, then boxes wherever they fit, then outlines,
//! each before and after parts may be turned, and lattices of one part. A later strategy is
//! taken only if it places more copies. Several parts are then brought closer by a search.

mod greedy;
mod grid;
mod lattice;
mod mix;
mod no_fit;

use lamp_stack::{Length, MAX_SIDE, Orientation, Size};

use super::{CopyPlacement, Layout, PixelSize, TileError};
use greedy::PlacingRule;
use no_fit::NoFitRegions;

/// Options to find places.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pack {
    /// What keeps the gap from other parts.
    pub by: PackBy,
    /// How parts may be turned.
    pub turns: Turns,
    /// The least distance from the copies to the area's edges.
    pub edge_gap: Length,
}

/// What of a part keeps the gap from other parts.
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

    /// Returns the strategies to try, in order.
    fn strategies(self, alone: bool) -> Vec<Strategy> {
        let mut all = Vec::new();
        let quarters = self.turns == Turns::Quarters;
        if alone {
            all.extend(
                [Some(Strategy::Grid(0)), quarters.then_some(Strategy::Grid(1))]
                    .into_iter()
                    .flatten(),
            );
        } else {
            all.extend(
                PlacingRule::ALL.map(|order| Strategy::Greedy(PackBy::Boxes, Turns::None, order)),
            );
        }
        if quarters {
            all.extend(
                PlacingRule::ALL
                    .map(|order| Strategy::Greedy(PackBy::Boxes, Turns::Quarters, order)),
            );
        }
        if self.by == PackBy::Outlines {
            let allowed = Turns::ALL.into_iter().filter(|turns| *turns <= self.turns);
            for turns in allowed {
                all.extend(
                    PlacingRule::ALL.map(|order| Strategy::Greedy(PackBy::Outlines, turns, order)),
                );
            }
            all.extend(alone.then_some(Strategy::Lattice(self.turns)));
        }
        all
    }
}

/// A way to find places.
#[derive(Clone, Copy, Debug)]
enum Strategy {
    /// Puts all copies of the only part in rows and columns, after these quarter turns.
    Grid(u32),
    /// Puts copy after copy where there is room.
    Greedy(PackBy, Turns, PlacingRule),
    /// Puts copies of the only part on a lattice, and more where there is room.
    Lattice(Turns),
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
    let mut placements = pack_within(&within, counts, gap, how)?;
    for at in &mut placements {
        (at.left, at.top) = (at.left + edge, at.top + edge);
    }
    Ok(placements)
}

/// Returns a distance in pixels, rounded up. One as wide as the area leaves room for one copy,
/// and so does a wider one.
pub(super) fn pixels_across(gap: Length, layout: &Layout) -> u32 {
    let pixels = (gap.pixels(layout.dpi()).max(0.0) - 1e-6).ceil().max(0.0) as u32;
    pixels.min(MAX_SIDE)
}

fn pack_within(
    layout: &Layout,
    counts: &[Option<u32>],
    gap: u32,
    how: Pack,
) -> Result<Vec<CopyPlacement>, TileError> {
    let alone = counts.len() == 1;
    for part in 0..counts.len() {
        check_fits(layout, part, how.turns)?;
    }
    // Without a count, a single part gets more copies than fit.
    let wanted: Vec<u32> = counts
        .iter()
        .map(|count| count.unwrap_or(if alone { u32::MAX } else { 1 }).min(MAX_COPIES))
        .collect();
    let all = wanted.iter().map(|&count| count as usize).fold(0, usize::saturating_add);
    let mut best: Vec<CopyPlacement> = Vec::new();
    let mut regions: Option<NoFitRegions> = None;
    for strategy in how.strategies(alone) {
        let found = match strategy {
            Strategy::Grid(quarters) => {
                grid::grid(layout, Orientation::new(quarters, false), wanted[0], gap)
            }
            Strategy::Greedy(by, turns, order) => {
                let current = regions.take().filter(|regions| regions.are_by(by));
                let regions =
                    regions.insert(current.unwrap_or_else(|| NoFitRegions::new(layout, gap, by)));
                greedy::place(layout, regions, &wanted, turns, order)
            }
            Strategy::Lattice(turns) => lattice::place(layout, gap, wanted[0], turns),
        };
        if found.len() > best.len() {
            best = found;
        }
        if best.len() >= all {
            break;
        }
    }
    if !alone && how.by == PackBy::Outlines {
        best = shortened(layout, &wanted, gap, how.turns, best);
    }
    let short = (0..counts.len()).find_map(|part| {
        let most = best.iter().filter(|placement| placement.part == part).count() as u32;
        let asked = counts[part].or((!alone).then_some(1))?;
        let least = if alone { asked } else { 1 };
        (most < least).then_some((part, asked, most))
    });
    match short {
        None => Ok(best),
        Some((part, asked, most)) => {
            let name = layout.parts()[part].name().to_owned();
            Err(TileError::TooMany { name, asked, most, area_mm: layout.area() })
        }
    }
}

/// Returns the copies of several parts on fewer rows, or all of them where some were left out, if
/// that is found.
fn shortened(
    layout: &Layout,
    wanted: &[u32],
    gap: u32,
    turns: Turns,
    best: Vec<CopyPlacement>,
) -> Vec<CopyPlacement> {
    let all = wanted.iter().map(|&count| count as usize).fold(0, usize::saturating_add);
    if all > mix::MOST_COPIES {
        return best;
    }
    // Where some were left out, they are placed below the area first.
    let mut tall = layout.clone();
    let longest = |part: usize| {
        let PixelSize { width, height } = layout.parts()[part].size(Orientation::default());
        (width.max(height).saturating_add(gap)).saturating_mul(wanted[part])
    };
    let rows = (0..wanted.len()).map(longest).fold(layout.pixels().height, u32::saturating_add);
    tall.pixels.height = rows.min(MAX_SIDE);
    let mut start = (best.len() == all).then(|| best.clone());
    let mut regions = NoFitRegions::new(layout, gap, PackBy::Outlines);
    for order in PlacingRule::ALL {
        let found = greedy::place(&tall, &mut regions, wanted, turns, order);
        let is_lower = |start: &Vec<_>| mix::height(&tall, &found) < mix::height(&tall, start);
        if found.len() == all && start.as_ref().is_none_or(is_lower) {
            start = Some(found);
        }
    }
    let Some(start) = start else { return best };
    let mut found = mix::shorten(&tall, gap, &turns.orientations(), start);
    if mix::height(layout, &found) > layout.pixels().height {
        return best;
    }
    greedy::centre(layout, &mut found);
    found.sort_by_key(|at| (at.part, at.top, at.left));
    found
}

fn check_fits(layout: &Layout, part: usize, turns: Turns) -> Result<(), TileError> {
    let area = layout.pixels();
    let fits = turns.quarters().iter().any(|&quarters| {
        let size = layout.parts()[part].size(Orientation::new(quarters, false));
        size.width <= area.width && size.height <= area.height
    });
    if fits {
        return Ok(());
    }
    let name = layout.parts()[part].name().to_owned();
    let size = layout.parts()[part].size(Orientation::default());
    Err(TileError::TooLarge { name, part: size, area, area_mm: layout.area() })
}

#[cfg(test)]
mod pack_tests;
