//! The ways in which copies may lie, and how deep each two of them overlap.

use std::collections::HashMap;

use lamp_stack::Orientation;

use super::super::super::{CopyPlacement, Layout, PixelSize};
use super::super::Way;
use super::super::no_fit::{NoFitRegion, NoFitRegions};
use super::depth::DepthMap;

/// The cells along the longest part, and what all depths may take.
const CELLS: u32 = 160;
const MOST_DEPTHS: f64 = 6e7;

/// All ways of all parts.
pub(in super::super) struct Ways {
    all: Vec<(Way, PixelSize)>,
    /// The ways of each part.
    pub(super) of_part: Vec<Vec<usize>>,
    /// How deep one is in another, by both.
    depths: Vec<DepthMap>,
    /// Pixels on a side of a cell, and of the finer ones of the outlines.
    pub(super) cell: u32,
    pub(super) fine: u32,
}

impl Ways {
    pub(in super::super) fn new(layout: &Layout, gap: u32, ways: &[Vec<Way>]) -> Self {
        let (all, of_part) = distinct(layout, ways);
        let (cell, fine) = cells(layout, &all);
        let every = cell / fine;
        let mut regions = NoFitRegions::in_cells(layout, gap, fine);
        let count = all.len();
        let pairs =
            (0..count).flat_map(|moving| (moving..count).map(move |placed| [moving, placed]));
        let no_fits: Vec<_> = pairs
            .map(|pair| (pair, regions.no_fit_every(layout, pair.map(|way| all[way].0), every)))
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

    pub(super) fn way(&self, way: usize) -> Way {
        self.all[way].0
    }

    pub(super) fn size(&self, way: usize) -> [u32; 2] {
        let PixelSize { width, height } = self.all[way].1;
        [width, height]
    }

    /// Returns how deep a way is in another, by the displacement between them.
    pub(super) fn depths(&self, moving: usize, placed: usize) -> &DepthMap {
        &self.depths[moving * self.all.len() + placed]
    }

    /// Returns the part of a placement, and its way.
    pub(super) fn of(&self, layout: &Layout, at: &CopyPlacement) -> (usize, usize) {
        let all = || {
            let parts = self.of_part.iter().enumerate();
            parts.flat_map(|(part, ways)| ways.iter().map(move |&way| (part, way)))
        };
        let same = all().find(|&(_, way)| self.way(way) == (at.part, at.turn));
        let alike = || {
            let outline = layout.parts()[at.part].silhouette(at.turn);
            let is_alike = |(stack, turn): Way| {
                stack == at.part && layout.parts()[stack].silhouette(turn) == outline
            };
            all().find(|&(_, way)| is_alike(self.way(way)))
        };
        // Of ways with equal outlines, `distinct` keeps one.
        same.or_else(alike).expect("it was made of them")
    }
}

/// Returns the pixels on a side of a cell, and on a side of the finer cells that divide it.
fn cells(layout: &Layout, all: &[(Way, PixelSize)]) -> (u32, u32) {
    let sides = all.iter().map(|(_, size)| size.width.max(size.height));
    // Regions cost the square of the runs in a row, and depths the square of the ways.
    let runs = layout.parts().iter().map(|part| {
        let outline = part.silhouette(Orientation::default());
        outline.change_count() / (2 * outline.height().max(1) as usize)
    });
    let cells = f64::from(CELLS) / runs.max().unwrap_or(0).max(1) as f64;
    // Outlines n cells long have (2 n)² depths for each two of w ways: n <= √(most / 4) / w.
    let cells = cells.min((MOST_DEPTHS / 4.0).sqrt() / all.len().max(1) as f64).max(1.0);
    let least = (f64::from(sides.max().unwrap_or(1)) / cells).ceil().max(1.0) as u32;
    let divided = (least..).find_map(|cell| match cell {
        ..=8 => Some((cell, 1)),
        _ => (4..=8).rev().find(|parts| cell % parts == 0).map(|parts| (cell, cell / parts)),
    });
    divided.expect("every fourth number has four parts")
}

/// Returns the ways that differ, and the ways of each part.
fn distinct(layout: &Layout, ways: &[Vec<Way>]) -> (Vec<(Way, PixelSize)>, Vec<Vec<usize>>) {
    let mut all = Vec::new();
    let of_part = ways.iter().map(|ways| {
        let mut outlines = Vec::new();
        let mut own = Vec::new();
        for &way in ways {
            let stack = &layout.parts()[way.0];
            let size = stack.size(way.1);
            let PixelSize { width, height } = layout.pixels();
            let outline = stack.silhouette(way.1);
            if size.width <= width && size.height <= height && !outlines.contains(&outline) {
                outlines.push(outline);
                own.push(all.len());
                all.push((way, size));
            }
        }
        own
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
