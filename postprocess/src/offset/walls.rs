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
    /// Returns the wall of a core whose sides should move by `by` each, if they moved less.
    pub(super) fn of(
        edge: &EdgeMap,
        core: &[EdgePixel],
        by: impl Fn(&EdgePixel) -> f64,
    ) -> Option<Self> {
        let mut places: Vec<&EdgePixel> = core.iter().collect();
        places.sort_by_key(|pixel| edge.squares[pixel.index as usize]);
        let middle = places[places.len() / 2];
        let (width, made) = across(edge, middle);
        let asked = (width - 2.0 * by(middle)).max(0.0);
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

/// Returns the width of a wall at a pixel, along the shortest of four ways across, and how much
/// of that is exposed.
fn across(edge: &EdgeMap, pixel: &EdgePixel) -> (f64, f64) {
    let radius = f64::from(edge.squares[pixel.index as usize]).sqrt();
    let most = (3.0 * radius) as i64 + 2;
    let ways = [(1, 0), (0, 1), (1, 1), (1, -1)].map(|(right, down)| {
        let place = |step: i64| {
            let column = i64::from(pixel.column) + right * step;
            let place = edge.at(column as i32, i64::from(pixel.row) + down * step)?;
            Some(place.map_or(255, |index| edge.levels[index as usize]))
        };
        let ahead = (0..most).map_while(place);
        let levels: Vec<u8> = ahead.chain((1..most).map_while(|step| place(-step))).collect();
        let step = ((right * right + down * down) as f64).sqrt();
        let sum: f64 = levels.iter().copied().map(f64::from).sum();
        (levels.len() as f64 * step, sum / 255.0 * step)
    });
    let shortest = ways.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let (width, made) = shortest.expect("there are four");
    let true_width = width.min(2.0 * radius);
    (true_width, made * true_width / width)
}
