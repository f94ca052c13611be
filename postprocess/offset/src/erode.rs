//! Erosion by a disc, exactly, on runs.
//!
//! A row is cut by one row of the disc after the other, so the cost follows runs and the disc's
//! height, not pixels.

use lamp_stack::Mask;

use super::row_runs::{RowRuns, Run, subtract};

/// A column that no image reaches.
const BEYOND: i32 = 1 << 29;
const EVERYTHING: [Run; 1] = [(-BEYOND, BEYOND)];

/// The color of the pixels that distances are measured from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SourceColour {
    /// Black. Outside the image all is black.
    Black,
    /// White.
    White,
}

/// The pixels that distances are measured from, center to center.
#[derive(Debug)]
pub(super) struct DistanceSources {
    colour: SourceColour,
    /// The runs of the other color. If black ones, they continue past the image's edges.
    between: RowRuns,
}

impl DistanceSources {
    pub(super) fn new(mask: &Mask, colour: SourceColour) -> Self {
        let white = RowRuns::white(mask);
        match colour {
            SourceColour::Black => Self { colour, between: white },
            SourceColour::White => Self::white_rows(white.rows()),
        }
    }

    /// Takes the runs of rows as white.
    pub(super) fn white_rows<'a>(rows: impl Iterator<Item = &'a [Run]>) -> Self {
        let mut between = RowRuns::new();
        let mut black = Vec::new();
        for row in rows {
            subtract(&EVERYTHING, row, &mut black);
            between.push(&black);
        }
        Self { colour: SourceColour::White, between }
    }

    pub(super) fn colour(&self) -> SourceColour {
        self.colour
    }

    /// Returns the runs without a source in a row, which may lie outside the image.
    pub(super) fn row(&self, row: i64) -> &[Run] {
        match u32::try_from(row) {
            Ok(row) if row < self.between.height() => self.between.row(row),
            _ if self.colour == SourceColour::Black => &[],
            _ => &EVERYTHING,
        }
    }

    /// Makes `out` the pixels of a region's runs in row `row` that lie in no source's disc.
    pub(super) fn erode(&self, disc: &Disc, row: u32, region: &[Run], out: &mut Erosion) {
        out.runs.clear();
        out.runs.extend_from_slice(region);
        for &away in &disc.order {
            let half = disc.halves[away as usize];
            let (row, away) = (i64::from(row), i64::from(away));
            out.narrow(self.row(row - away), half);
            if away > 0 {
                out.narrow(self.row(row + away), half);
            }
            if out.runs.is_empty() {
                return;
            }
        }
    }

    /// Returns the pixels of a region that lie in no source's disc.
    pub(super) fn erode_all(&self, disc: &Disc, region: &RowRuns) -> RowRuns {
        let mut rows = RowRuns::new();
        let mut out = Erosion::default();
        for row in 0..region.height() {
            self.erode(disc, row, region.row(row), &mut out);
            rows.push(&out.runs);
        }
        rows
    }
}

/// Runs as they are eroded, with a spare list so that no row allocates.
#[derive(Debug, Default)]
pub(super) struct Erosion {
    pub(super) runs: Vec<Run>,
    spare: Vec<Run>,
}

impl Erosion {
    /// Keeps only pixels more than `half` columns away from the ends of the runs `between`
    /// sources.
    fn narrow(&mut self, between: &[Run], half: i32) {
        let Some(first) = self.runs.first() else { return };
        self.spare.clear();
        let mut next = between.partition_point(|run| run.1 - half <= first.0);
        for &(start, end) in &self.runs {
            while let Some(&(from, to)) = between.get(next).filter(|run| run.0 + half < end) {
                let [from, to] = [from + half, to - half];
                if from.max(start) < to.min(end) {
                    self.spare.push((from.max(start), to.min(end)));
                }
                // This run between sources may hold the next run, too.
                if to > end {
                    break;
                }
                next += 1;
            }
        }
        std::mem::swap(&mut self.runs, &mut self.spare);
    }
}

/// The pixels nearer to a center than a distance.
#[derive(Debug)]
pub(super) struct Disc {
    /// The columns it reaches to each side, by the distance in rows from its center.
    halves: Vec<i32>,
    /// The distances in rows, in an order that is likely to show early that nothing stays.
    order: Vec<u32>,
}

/// The radius of the largest disc in pixels: more than any image is wide.
const MAX_RADIUS: f64 = (1 << 27) as f64;

/// Squared lengths in pixels this close to a whole number are whole: lengths come from
/// micrometers and are rounded.
pub(super) const ROUNDING: f64 = 1e-7;

/// Returns the squared distance from which on pixels are at least `radius` away.
pub(super) fn at_least(radius: f64) -> u64 {
    let radius = radius.clamp(0.0, MAX_RADIUS);
    (radius * radius - ROUNDING).ceil() as u64
}

/// Returns the squared distance from which on pixels are more than `radius` away.
pub(super) fn more_than(radius: f64) -> u64 {
    let radius = radius.clamp(0.0, MAX_RADIUS);
    (radius * radius + ROUNDING).floor() as u64 + 1
}

/// Returns the half widths of an ellipse by the distance in rows from its center, as far as an image
/// of `height` rows needs them. Its half axes are along the row and across it, in pixels; their
/// squares are larger by `rounding`.
pub(super) fn half_widths(axes: [f64; 2], rounding: f64, height: u32) -> Vec<f64> {
    let [along, across] = axes.map(|pixels| pixels.clamp(0.0, MAX_RADIUS));
    // The height of a pixel in widths. An ellipse without a size has its center alone.
    let aspect = if across > 0.0 { along / across } else { 1.0 };
    let left = |away: u32| along * along + rounding - (f64::from(away) * aspect).powi(2);
    let rows = (0..height + 1).map(left).take_while(|left| *left >= 0.0);
    rows.map(f64::sqrt).collect()
}

impl Disc {
    /// Returns the columns it reaches to each side, by the distance in rows from its center.
    pub(super) fn halves(&self) -> &[i32] {
        &self.halves
    }

    /// Returns the pixels whose squared distance from the center is below `square`, as far as an
    /// image of `height` rows needs them.
    pub(super) fn below(square: u64, height: u32) -> Self {
        let rows = (0..u64::from(height) + 1).take_while(|away| away * away < square);
        // Squared distances are whole numbers, so the greatest below `square` is `square` - 1. The
        // limit keeps sums with a column within an i32.
        let half = |away: u64| (square - 1 - away * away).isqrt().min(BEYOND as u64 / 2) as i32;
        Self::of_halves(rows.map(half).collect())
    }

    /// Returns the pixels within a distance of the center, given in pixels along the row and across
    /// it, as far as an image of `height` rows needs them.
    pub(super) fn within(distance: [f64; 2], height: u32) -> Self {
        Self::of_widths(&half_widths(distance, ROUNDING, height))
    }

    /// Returns the pixels of half widths that are not rounded.
    pub(super) fn of_widths(widths: &[f64]) -> Self {
        // The limit keeps sums with a column within an i32.
        Self::of_halves(
            widths.iter().map(|width| width.min(f64::from(BEYOND / 2)) as i32).collect(),
        )
    }

    /// Returns the pixels that lie in an ellipse of these half axes, along the row and across it,
    /// around a point up to `margin` pixels away along either, as far as an image of `height` rows
    /// needs them.
    pub(super) fn ellipse([along, across]: [f64; 2], margin: f64, height: u32) -> Self {
        let rows = (0..height + 1).map(f64::from).take_while(|away| *away <= across + margin);
        let half = |away: f64| {
            let share = ((away - margin).max(0.0) / across).min(1.0);
            (along * (1.0 - share * share).sqrt() + margin) as i32
        };
        Self::of_halves(rows.map(half).collect())
    }

    fn of_halves(halves: Vec<i32>) -> Self {
        let count = halves.len() as u32;
        let strides = std::iter::successors(Some(1), |away| Some(away * 2));
        let mut order: Vec<u32> = (0..count.min(1)).collect();
        // Rows at very different distances first: close rows cut nearly alike.
        order.extend(strides.take_while(|&away| away < count));
        order.extend((1..count).filter(|away| !away.is_power_of_two()));
        Self { halves, order }
    }
}
