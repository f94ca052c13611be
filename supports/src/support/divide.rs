//! Divides wide islands into pieces that one support holds each.

use std::ops::Range;

use crate::check::Metric;

/// White pixels as runs: rows, from the top, and columns.
pub(super) type WhiteRuns = Vec<(u32, Range<u32>)>;

/// A piece of an island.
#[derive(Debug, PartialEq)]
pub(super) struct IslandPiece {
    pub(super) runs: WhiteRuns,
    pub(super) area: u64,
    /// The point to hold, as column and row: the centroid, or else the center of the pixel that is
    /// nearest to it. The first pixel's center is at (0.5, 0.5).
    pub(super) middle: [f64; 2],
}

/// Divides an island by an even grid over its box into pieces up to `hold` wide and high. Pieces of fewer than `least` pixels are left out, unless there is no other. Returns `None` if
/// the grid has more than `most` cells.
pub(super) fn divided(
    runs: &WhiteRuns,
    hold: f64,
    least: f64,
    most: usize,
    metric: Metric,
) -> Option<Vec<IslandPiece>> {
    let rows = bounds(runs.iter().map(|(row, _)| *row..row + 1));
    let columns = bounds(runs.iter().map(|(_, run)| run.clone()));
    let [wide, high] = metric.pixels(hold);
    let (across, down) = (cells(&columns, wide, most)?, cells(&rows, high, most)?);
    if across.len().saturating_mul(down.len()) > most {
        return None;
    }
    let within = |cell: (&Range<u32>, &Range<u32>)| -> WhiteRuns {
        let in_rows = runs.iter().filter(|(row, _)| cell.0.contains(row));
        let clipped =
            in_rows.map(|(row, run)| (*row, run.start.max(cell.1.start)..run.end.min(cell.1.end)));
        // Clipping leaves an empty or a reversed range of a run outside the cell.
        clipped.filter(|(_, run)| !run.is_empty()).collect()
    };
    let grid = down.iter().flat_map(|rows| across.iter().map(move |columns| (rows, columns)));
    let pieces: Vec<IslandPiece> =
        grid.map(within).filter(|runs| !runs.is_empty()).map(|runs| piece(runs, metric)).collect();
    let is_large = |piece: &IslandPiece| piece.area as f64 >= least;
    Some(match pieces.iter().any(is_large) {
        true => pieces.into_iter().filter(is_large).collect(),
        false => vec![piece(runs.clone(), metric)],
    })
}

/// Returns the width or the height of an island, whichever is greater.
pub(super) fn extent(runs: &WhiteRuns, metric: Metric) -> f64 {
    let rows = bounds(runs.iter().map(|(row, _)| *row..row + 1));
    let columns = bounds(runs.iter().map(|(_, run)| run.clone()));
    let [width, height] = metric.place([columns.len() as f64, rows.len() as f64]);
    width.max(height)
}

fn bounds(ranges: impl Iterator<Item = Range<u32>>) -> Range<u32> {
    ranges.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end)).unwrap_or_default()
}

/// Divides a range evenly into parts up to `hold` pixels long, if they are not too many.
fn cells(range: &Range<u32>, hold: f64, most: usize) -> Option<Vec<Range<u32>>> {
    let length = u64::from(range.end - range.start);
    // A cell is never narrower than a pixel.
    let count = (length as f64 / hold).ceil().clamp(1.0, length.max(1) as f64) as u64;
    let at = |k: u64| range.start + (length * k / count) as u32;
    (count <= most as u64).then(|| (0..count).map(|k| at(k)..at(k + 1)).collect())
}

/// Returns all of an island as one piece.
pub(super) fn piece(runs: WhiteRuns, metric: Metric) -> IslandPiece {
    let area: u64 = runs.iter().map(|(_, run)| u64::from(run.end - run.start)).sum();
    let count = |run: &Range<u32>| f64::from(run.end - run.start);
    let columns = |run: &Range<u32>| count(run) * f64::midpoint(run.start.into(), run.end.into());
    let x = runs.iter().map(|(_, run)| columns(run)).sum::<f64>() / area as f64;
    let y = runs.iter().map(|(row, run)| (f64::from(*row) + 0.5) * count(run));
    let y = y.sum::<f64>() / area as f64;
    let pixel = [x, y].map(|place| place as u32);
    // The centroid of a ring or a hook may be outside of it.
    if runs.iter().any(|(row, run)| *row == pixel[1] && run.contains(&pixel[0])) {
        return IslandPiece { runs, area, middle: [x, y] };
    }
    let nearest = runs.iter().map(|(row, run)| {
        let column = pixel[0].clamp(run.start, run.end - 1);
        let middle = [column, *row].map(|place| f64::from(place) + 0.5);
        let away = metric.place([middle[0] - x, middle[1] - y]);
        (away[0].powi(2) + away[1].powi(2), middle)
    });
    let nearest = nearest.min_by(|a, b| a.0.total_cmp(&b.0));
    let (_, middle) = nearest.expect("a piece has pixels");
    IslandPiece { runs, area, middle }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_is_held_at_its_nearest_pixel() {
        let ring: WhiteRuns = vec![(3, 4..9), (4, 4..5), (4, 8..9), (5, 4..9)];
        assert_eq!(
            divided(&ring, 9.0, 1.0, 1, Metric::of(None)),
            Some(vec![IslandPiece { runs: ring.clone(), area: 12, middle: [6.5, 3.5] }])
        );
    }

    #[test]
    fn wide_islands_are_divided_evenly() {
        // An L: a bar of 12 x 2 pixels, and one of 2 x 7 below its left end.
        let mut runs: WhiteRuns = (0..2).map(|row| (row, 10..22)).collect();
        runs.extend((2..9).map(|row| (row, 10..12)));
        let square = Metric::of(None);
        let divided = |hold, least| divided(&runs, hold, least, 108, square).unwrap();
        let pieces = divided(5.0, 1.0);
        let places: Vec<_> = pieces.iter().map(|piece| (piece.area, piece.middle)).collect();
        assert_eq!(
            places,
            [(12, [35.0 / 3.0, 5.0 / 3.0]), (8, [16.0, 1.0]), (8, [20.0, 1.0]), (10, [11.0, 6.5])]
        );
        assert_eq!(pieces.iter().map(|piece| piece.area).sum::<u64>(), 38);
        assert_eq!(divided(5.0, 9.0).len(), 2);
        assert_eq!(divided(5.0, 99.0), [piece(runs.clone(), square)]);
        assert_eq!(divided(1e9, 1.0).len(), 1);
        assert_eq!(divided(1e-9, 1.0).len(), 38);
        assert_eq!(super::divided(&runs, 1e-9, 1.0, 107, square), None);
        // Of pixels twice as high, the same hold has half as many rows.
        let high = Metric::of("10x20um".parse().ok());
        let areas: Vec<_> =
            super::divided(&runs, 5.0, 1.0, 108, high).unwrap().iter().map(|it| it.area).collect();
        assert_eq!(areas, [8, 8, 8, 4, 4, 6]);
        assert_eq!([square, high].map(|metric| extent(&runs, metric)), [12.0, 18.0]);
    }
}
