//! Places for as many copies as fit, or as are wanted.
//!
//! What is simple comes first: a grid, then boxes wherever they fit, then
//! outlines, each without turning parts before turning them. A later way is
//! taken only if it places more copies.

mod greedy;
mod grid;
mod no_fit;

use lamp_stack::Orientation;

use super::{CopyPlacement, Layout, TileError};
use greedy::PlacingRule;
use no_fit::NoFitRegions;

/// How places are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pack {
    /// By what parts keep apart.
    pub by: PackBy,
    /// Which ways parts may be turned.
    pub turns: Turns,
}

/// By what parts keep apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PackBy {
    /// The boxes around them.
    #[default]
    Boxes,
    /// Their outlines, where boxes do not place all.
    Outlines,
}

lamp_stack::named!(PackBy { Boxes = "box", Outlines = "outline" });

/// Which ways parts may be turned, where that places more. None is mirrored,
/// which would be another part.
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
    fn all(self) -> &'static [u32] {
        match self {
            Self::None => &[0],
            Self::Half => &[0, 2],
            Self::Quarters => &[0, 2, 1, 3],
        }
    }
}

impl Pack {
    /// The options that ask for it, as a command has them.
    pub(super) fn options(self) -> String {
        let mut options = String::new();
        if self.by != PackBy::default() {
            options += &format!(" --pack {}", self.by);
        }
        if self.turns != Turns::default() {
            options += &format!(" --turns {}", self.turns);
        }
        options
    }

    /// The ways to try, each with the turns that it may use.
    fn ways(self, alone: bool) -> Vec<Strategy> {
        let mut ways = Vec::new();
        let quarters = self.turns == Turns::Quarters;
        if alone {
            ways.extend(
                [Some(Strategy::Grid(0)), quarters.then_some(Strategy::Grid(1))]
                    .into_iter()
                    .flatten(),
            );
        } else {
            ways.extend(
                PlacingRule::ALL.map(|order| Strategy::Greedy(PackBy::Boxes, Turns::None, order)),
            );
        }
        if quarters {
            ways.extend(
                PlacingRule::ALL
                    .map(|order| Strategy::Greedy(PackBy::Boxes, Turns::Quarters, order)),
            );
        }
        if self.by == PackBy::Outlines {
            let allowed = Turns::ALL.into_iter().filter(|turns| *turns <= self.turns);
            for turns in allowed {
                ways.extend(
                    PlacingRule::ALL.map(|order| Strategy::Greedy(PackBy::Outlines, turns, order)),
                );
            }
        }
        ways
    }
}

/// One way to find places.
#[derive(Clone, Copy, Debug)]
enum Strategy {
    /// All copies of the one part in rows and columns, turned by so many right
    /// angles.
    Grid(u32),
    /// Copy by copy, where there is room.
    Greedy(PackBy, Turns, PlacingRule),
}

/// More copies than anyone builds: of a part of a pixel, that is how many are
/// as many as fit.
const MAX_COPIES: u32 = 1 << 20;

/// Finds places for all copies, or says how many found one.
pub(super) fn pack(
    layout: &Layout,
    counts: &[Option<u32>],
    gap: u32,
    how: Pack,
) -> Result<Vec<CopyPlacement>, TileError> {
    let alone = counts.len() == 1;
    for part in 0..counts.len() {
        check_fits(layout, part, how.turns)?;
    }
    // As many as fit is more than all.
    let wanted: Vec<u32> = counts
        .iter()
        .map(|count| count.unwrap_or(if alone { u32::MAX } else { 1 }).min(MAX_COPIES))
        .collect();
    let all = wanted.iter().map(|&count| count as usize).fold(0, usize::saturating_add);
    let mut best: Vec<CopyPlacement> = Vec::new();
    let mut shapes: Option<NoFitRegions> = None;
    for way in how.ways(alone) {
        let found = match way {
            Strategy::Grid(quarters) => {
                grid::grid(layout, Orientation::new(quarters, false), wanted[0], gap)
            }
            Strategy::Greedy(by, turns, order) => {
                let current = shapes.take().filter(|shapes| shapes.are_by(by));
                let shapes =
                    shapes.insert(current.unwrap_or_else(|| NoFitRegions::new(layout, gap, by)));
                greedy::place(layout, shapes, &wanted, turns, order)
            }
        };
        if found.len() > best.len() {
            best = found;
        }
        if best.len() >= all {
            break;
        }
    }
    let short = (0..counts.len()).find_map(|part| {
        let most = best.iter().filter(|placement| placement.part == part).count() as u32;
        counts[part]
            .or((!alone).then_some(1))
            .filter(|&asked| most < asked)
            .map(|asked| (part, asked, most))
    });
    match short {
        None => Ok(best),
        Some((part, asked, most)) => {
            let name = layout.parts()[part].name().to_owned();
            Err(TileError::TooMany { name, asked, most, area_mm: layout.area() })
        }
    }
}

fn check_fits(layout: &Layout, part: usize, turns: Turns) -> Result<(), TileError> {
    let area = layout.pixels();
    let fits = turns.all().iter().any(|&quarters| {
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
