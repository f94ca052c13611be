//! Thin walls: their width before and after edges moved.

use std::ops::Range;

use super::edge_map::{EdgeMap, EdgePixel};

/// A wall that was narrowed less than asked, as it would have become too thin or vanished.
///
/// Widths are in pixels and medians along the wall's core.
#[derive(Clone, Debug, PartialEq)]
pub struct ThinWall {
    /// The columns of its core.
    pub columns: Range<u32>,
    /// The rows of its core.
    pub rows: Range<u32>,
    /// The width before.
    pub width: f64,
    /// The width asked for; zero if nothing should have been left.
    pub asked: f64,
    /// The width made.
    pub made: f64,
}

/// The least difference of widths in pixels that is reported: smaller ones come from the raster.
const MIN_DIFFERENCE: f64 = 0.25;

impl ThinWall {
    /// Returns the wall at some places of a core, if its sides moved less than asked.
    pub(super) fn of(edge: &EdgeMap, core: &[EdgePixel]) -> Option<Self> {
        let mut places: Vec<&EdgePixel> = core.iter().collect();
        places.sort_by_key(|pixel| edge.depth(pixel.index));
        let Across { width, asked, made } = Across::at(edge, places[places.len() / 2]);
        if made - asked < MIN_DIFFERENCE {
            return None;
        }
        let range = |of: fn(&EdgePixel) -> u32| {
            let [low, high] = [core.iter().map(of).min()?, core.iter().map(of).max()?];
            Some(low..high + 1)
        };
        let columns = range(|pixel| pixel.column as u32)?;
        Some(Self { columns, rows: range(|pixel| pixel.row)?, width, asked, made })
    }
}

/// A wall at one place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Across {
    /// The width before.
    width: f64,
    /// The width asked for, not below zero.
    pub(super) asked: f64,
    /// The width that is exposed.
    made: f64,
}

/// Ways across a wall, (right, down). One of them is within 14 degrees of its normal.
const WAYS: [(i64, i64); 8] = [(1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (2, -1), (1, 2), (1, -2)];

impl Across {
    /// Returns the wall at a pixel of its core, along the shortest of eight ways.
    pub(super) fn at(edge: &EdgeMap, pixel: &EdgePixel) -> Self {
        let ways = WAYS.map(|way| Self::along(edge, pixel, way));
        let shortest = ways.into_iter().min_by(|a, b| a.width.total_cmp(&b.width));
        shortest.expect("there are eight")
    }

    fn along(edge: &EdgeMap, pixel: &EdgePixel, (right, down): (i64, i64)) -> Self {
        let most = 3 * i64::from(edge.depth(pixel.index)) / 16 + 2;
        let step = ((right * right + down * down) as f64).sqrt();
        let at = |steps: i64| {
            let column = i64::from(pixel.column) + right * steps;
            edge.at(column as i32, i64::from(pixel.row) + down * steps)
        };
        // The length between the pixels at the ends, and beyond them up to the edges.
        let own = edge.near(pixel.index);
        let mut sum = f64::from(edge.levels[pixel.index as usize]);
        let mut sides = 0.0;
        let mut moved = 0.0;
        for sign in [1, -1] {
            let mut last = own;
            for place in (1..most).map_while(|steps| at(sign * steps)) {
                sides += step;
                match place {
                    Some(index) => {
                        last = edge.near(index);
                        sum += f64::from(edge.levels[index as usize]);
                    }
                    None => sum += 255.0,
                }
            }
            sides += f64::from(last.distance);
            moved += f64::from(last.by);
        }
        let width = sides.max(0.5);
        let made = (sum / 255.0 * step).min(width);
        Self { width, asked: (width - moved).max(0.0), made }
    }
}
