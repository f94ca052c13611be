//! The ways in which copies may lie, and how deep each two of them overlap.

use std::collections::HashMap;

use lamp_stack::Orientation;

use super::super::super::{CopyPlacement, Layout, PixelSize};
use super::super::no_fit::{NoFitRegion, NoFitRegions};
use super::depth::DepthMap;

/// The cells along the longest part, and what all depths may take.
const CELLS: u32 = 160;
const MOST_DEPTHS: f64 = 6e7;

/// An oriented part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    pub(super) part: usize,
    pub(super) turn: Orientation,
    size: PixelSize,
}

/// All ways of all parts.
pub(super) struct Ways {
    all: Vec<Way>,
    /// The ways of each part.
    pub(super) of_part: Vec<Vec<usize>>,
    /// How deep one is in another, by both.
    depths: Vec<DepthMap>,
    /// Pixels on a side of a cell, and of the finer ones of the outlines.
    pub(super) cell: u32,
    pub(super) fine: u32,
}

impl Ways {
    pub(super) fn new(layout: &Layout, gap: u32, turns: &[Orientation]) -> Self {
        let (all, of_part) = distinct(layout, turns);
        let (cell, fine) = cells(layout, &all);
        let every = cell / fine;
        let mut regions = NoFitRegions::in_cells(layout, gap, fine);
        let keys: Vec<_> = all.iter().map(|way| (way.part, way.turn)).collect();
        let count = all.len();
        let pairs =
            (0..count).flat_map(|moving| (moving..count).map(move |placed| [moving, placed]));
        let no_fits: Vec<_> = pairs
            .map(|pair| (pair, regions.no_fit_every(layout, pair.map(|way| keys[way]), every)))
            .collect();
        let maps: Vec<_> = no_fits
            .iter()
            .map(|([moving, placed], region)| {
                // Either of two equal outlines is the one that moves.
                let both = (moving == placed).then(|| region.with_opposites());
                DepthMap::new(both.as_ref().unwrap_or(region))
            })
            .collect();
        let mut depths: HashMap<[usize; 2], DepthMap> = HashMap::new();
        for (([moving, placed], _), map) in no_fits.iter().zip(maps) {
            if moving != placed {
                depths.insert([*placed, *moving], map.reversed());
            }
            depths.insert([*moving, *placed], map);
        }
        let in_order = (0..count * count)
            .map(|k| depths.remove(&[k / count, k % count]).expect("all pairs have a map"));
        Self { depths: in_order.collect(), all, of_part, cell, fine }
    }

    pub(super) fn way(&self, way: usize) -> &Way {
        &self.all[way]
    }

    pub(super) fn size(&self, way: usize) -> [u32; 2] {
        let PixelSize { width, height } = self.all[way].size;
        [width, height]
    }

    /// Returns how deep a way is in another, by how far it is from it.
    pub(super) fn depths(&self, moving: usize, placed: usize) -> &DepthMap {
        &self.depths[moving * self.all.len() + placed]
    }

    /// Returns the way of a placement.
    pub(super) fn of(&self, layout: &Layout, at: &CopyPlacement) -> usize {
        let ways = &self.of_part[at.part];
        let same = ways.iter().find(|&&way| self.all[way].turn == at.turn);
        let outline = || layout.parts()[at.part].silhouette(at.turn);
        let alike = || {
            let outline = outline();
            ways.iter()
                .find(|&&way| layout.parts()[at.part].silhouette(self.all[way].turn) == outline)
        };
        *same.or_else(alike).expect("it was made of them")
    }
}

/// Returns the pixels on a side of a cell, and of those that divide it.
fn cells(layout: &Layout, all: &[Way]) -> (u32, u32) {
    let sides = all.iter().map(|way| way.size.width.max(way.size.height));
    // Regions cost the square of the runs in a row, and depths that of the ways.
    let runs = layout.parts().iter().map(|part| {
        let outline = part.silhouette(Orientation::default());
        outline.change_count() / (2 * outline.height().max(1) as usize)
    });
    let cells = f64::from(CELLS) / runs.max().unwrap_or(0).max(1) as f64;
    let cells = cells.min((MOST_DEPTHS / 4.0).sqrt() / all.len().max(1) as f64).max(1.0);
    let least = (f64::from(sides.max().unwrap_or(1)) / cells).ceil().max(1.0) as u32;
    let divided = (least..).find_map(|cell| match cell {
        ..=8 => Some((cell, 1)),
        _ => (4..=8).rev().find(|parts| cell % parts == 0).map(|parts| (cell, cell / parts)),
    });
    divided.expect("every fourth number has four parts")
}

/// Returns the ways that differ, and those of each part.
fn distinct(layout: &Layout, turns: &[Orientation]) -> (Vec<Way>, Vec<Vec<usize>>) {
    let mut all = Vec::new();
    let of_part = (0..layout.parts().len()).map(|part| {
        let stack = &layout.parts()[part];
        let mut outlines = Vec::new();
        let mut ways = Vec::new();
        for &turn in turns {
            let size = stack.size(turn);
            let PixelSize { width, height } = layout.pixels();
            let outline = stack.silhouette(turn);
            if size.width <= width && size.height <= height && !outlines.contains(&outline) {
                outlines.push(outline);
                ways.push(all.len());
                all.push(Way { part, turn, size });
            }
        }
        ways
    });
    let of_part = of_part.collect();
    (all, of_part)
}

impl NoFitRegion {
    /// Adds the opposite of each displacement.
    fn with_opposites(&self) -> Self {
        let rows = self.rows.iter().rev();
        let turned =
            rows.map(|runs| runs.iter().rev().map(|(from, to)| (1 - to, 1 - from)).collect());
        let opposite = Self::new(self.rows.len() as i32 - 1 - self.top, turned.collect());
        Self::united(&[(self, [0, 0]), (&opposite, [0, 0])])
    }
}
