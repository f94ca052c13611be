//! What is far from a colour: erosion by a disc, exactly, on runs.

use lamp_stack::Mask;

use super::row_runs::{RowRuns, Run, subtract};

/// Columns that no image reaches.
const BEYOND: i32 = 1 << 29;
const EVERYTHING: [Run; 1] = [(-BEYOND, BEYOND)];

/// From which pixels distances are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SourceColour {
    /// Black ones. Outside the image all is black.
    Black,
    /// White ones.
    White,
}

/// An image as the pixels that distances are measured from, centre to centre.
#[derive(Debug)]
pub(super) struct Sources {
    colour: SourceColour,
    /// The runs of the other colour. Those that black ones end beside the
    /// image's edges go on for ever.
    between: RowRuns,
}

impl Sources {
    pub(super) fn new(mask: &Mask, colour: SourceColour) -> Self {
        let white = RowRuns::white(mask);
        if colour == SourceColour::Black {
            return Self { colour, between: white };
        }
        let mut between = RowRuns::new();
        let mut black = Vec::new();
        for row in 0..white.height() {
            subtract(&EVERYTHING, white.row(row), &mut black);
            between.push(&black);
        }
        Self { colour, between }
    }

    /// The runs without a source in a row, which may lie outside the image.
    pub(super) fn row(&self, row: i64) -> &[Run] {
        match u32::try_from(row) {
            Ok(row) if row < self.between.height() => self.between.row(row),
            _ if self.colour == SourceColour::Black => &[],
            _ => &EVERYTHING,
        }
    }

    /// Makes `out` what is left of a region's runs in row `row` without the
    /// pixels that lie in the disc of a source.
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

    /// What is left of all rows of a region.
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

/// Runs as they are narrowed.
#[derive(Debug, Default)]
pub(super) struct Erosion {
    pub(super) runs: Vec<Run>,
    spare: Vec<Run>,
}

impl Erosion {
    /// Leaves what is further than `half` columns inside the runs `between`
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
                if to > end {
                    break;
                }
                next += 1;
            }
        }
        std::mem::swap(&mut self.runs, &mut self.spare);
    }
}

/// The pixels nearer to a centre than some distance.
#[derive(Debug)]
pub(super) struct Disc {
    /// How many columns it reaches to each side, so many rows from its centre.
    halves: Vec<i32>,
    /// The rows from the centre, those first that are likely to show that
    /// nothing is left.
    order: Vec<u32>,
}

/// The radius of the largest disc, in pixels: more than any image is wide.
const MAX_RADIUS: f64 = (1 << 27) as f64;

/// Squares of lengths in pixels that are whole but for rounding are whole.
const ROUNDING: f64 = 1e-7;

/// The squared distance from which on pixels are at least `radius` away.
pub(super) fn at_least(radius: f64) -> u64 {
    let radius = radius.clamp(0.0, MAX_RADIUS);
    (radius * radius - ROUNDING).ceil() as u64
}

/// The squared distance from which on pixels are more than `radius` away.
pub(super) fn more_than(radius: f64) -> u64 {
    let radius = radius.clamp(0.0, MAX_RADIUS);
    (radius * radius + ROUNDING).floor() as u64 + 1
}

impl Disc {
    /// How many columns it reaches to each side, so many rows from its centre.
    pub(super) fn halves(&self) -> &[i32] {
        &self.halves
    }

    /// The pixels whose squared distance from the centre is below `square`. An
    /// image of `height` rows needs no more.
    pub(super) fn below(square: u64, height: u32) -> Self {
        let rows = (0..u64::from(height) + 1).take_while(|away| away * away < square);
        let half = |away: u64| (square - 1 - away * away).isqrt().min(BEYOND as u64 / 2) as i32;
        let halves: Vec<i32> = rows.map(half).collect();
        let count = halves.len() as u32;
        let strides = std::iter::successors(Some(1), |away| Some(away * 2));
        let mut order: Vec<u32> = (0..count.min(1)).collect();
        order.extend(strides.take_while(|&away| away < count));
        order.extend((1..count).filter(|away| !away.is_power_of_two()));
        Self { halves, order }
    }
}
