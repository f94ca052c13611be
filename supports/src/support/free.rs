//! Where nothing is white from the platform up to an island.

use std::ops::Range;

use lamp_stack::{Mask, Op, white_runs};

use super::divide::WhiteRuns;
use crate::check::{Metric, Region, without};

/// The white of the layers so far, seen from below.
#[derive(Debug, Default)]
pub(super) struct WhiteBelow {
    all: Option<Mask>,
    /// The same of the layers that bases of pillars reach.
    low: Option<Mask>,
}

impl WhiteBelow {
    /// Adds a layer; `is_low` if bases reach it. Returns `None` if there are too many runs.
    pub(super) fn add(&mut self, mask: &Mask, is_low: bool) -> Option<()> {
        let united = |white: Option<Mask>| match white {
            Some(white) => white.combined(Op::Union, mask),
            None => Some(mask.clone()),
        };
        self.all = Some(united(self.all.take())?);
        if is_low {
            self.low = Some(united(self.low.take())?);
        }
        Some(())
    }

    /// Returns the pixels of a region whose centers are not within a distance of the center of a
    /// pixel that is white in some layer.
    pub(super) fn free_columns(
        &self,
        region: &Region,
        distance: f64,
        metric: Metric,
    ) -> FreeColumns {
        let mut runs = WhiteRuns::new();
        let mut left = Vec::new();
        for row in region.rows.clone() {
            left.clear();
            left.push(region.columns.clone());
            if let Some(white) = &self.all {
                remote(white, row, distance, metric, &mut left);
            }
            runs.extend(left.drain(..).map(|run| (row, run)));
        }
        FreeColumns { runs }
    }

    /// Returns whether no white of the lowest layers is within a distance of a pixel.
    pub(super) fn is_base_free(
        &self,
        [column, row]: [u32; 2],
        distance: f64,
        metric: Metric,
    ) -> bool {
        let run = column..column + 1;
        self.low.as_ref().is_none_or(|white| !is_white_near(white, row, &run, distance, metric))
    }
}

/// The pixels that columns may stand on, as runs by row and column.
#[derive(Debug)]
pub(super) struct FreeColumns {
    runs: WhiteRuns,
}

impl FreeColumns {
    /// Returns the runs that a run of a row shares with them.
    pub(super) fn within(&self, row: u32, run: &Range<u32>) -> impl Iterator<Item = Range<u32>> {
        let first = self.runs.partition_point(|(at, free)| (*at, free.end) <= (row, run.start));
        let (start, end) = (run.start, run.end);
        let met = self.runs[first..].iter();
        let met = met.take_while(move |(at, free)| *at == row && free.start < end);
        met.map(move |(_, free)| free.start.max(start)..free.end.min(end))
    }

    /// Returns whether a column may stand on a pixel.
    pub(super) fn holds(&self, [column, row]: [u32; 2]) -> bool {
        self.within(row, &(column..column + 1)).next().is_some()
    }
}

/// Keeps what of runs of a row is not nearer to white than a distance.
pub(super) fn remote(
    white: &Mask,
    row: u32,
    distance: f64,
    metric: Metric,
    runs: &mut Vec<Range<u32>>,
) {
    let mut next = Vec::new();
    for (near, reach) in rows_within(white, row, distance, metric) {
        if runs.is_empty() {
            return;
        }
        next.clear();
        runs.iter().for_each(|run| without(run, white.row(near), white.width(), reach, &mut next));
        std::mem::swap(runs, &mut next);
    }
}

/// Returns whether white is nearer to a run of a row than a distance.
pub(super) fn is_white_near(
    white: &Mask,
    row: u32,
    run: &Range<u32>,
    distance: f64,
    metric: Metric,
) -> bool {
    rows_within(white, row, distance, metric).any(|(near, reach)| {
        let run = run.start.saturating_sub(reach)..run.end.saturating_add(reach);
        let mut others = white_runs(white.row(near), white.width());
        others.any(|(start, end)| start < run.end && run.start < end)
    })
}

/// Returns the rows that hold pixels nearer than a distance, and how many columns aside.
fn rows_within(
    white: &Mask,
    row: u32,
    distance: f64,
    metric: Metric,
) -> impl Iterator<Item = (u32, u32)> {
    // The margin takes up the rounding of a distance of whole pixels.
    let limit = distance * distance * (1.0 - 1e-9);
    let [_, most] = metric.pixels(distance).map(|pixels| pixels.ceil() as u32);
    let rows = row.saturating_sub(most)..row.saturating_add(most + 1).min(white.height());
    rows.filter_map(move |near| {
        let square = limit - metric.squared(0, near.abs_diff(row));
        let reach = square.max(0.0).sqrt();
        // A pixel at just the distance is not nearer.
        let whole = if reach.fract() == 0.0 { reach - 1.0 } else { reach.floor() };
        (square > 0.0).then_some((near, whole.max(0.0) as u32))
    })
}

#[cfg(test)]
mod tests {
    use lamp_stack::{MaskBuilder, Pitch};
    use proptest::prelude::*;

    use super::*;

    const SIZE: u32 = 24;

    fn image(pixels: &[[u32; 2]]) -> Mask {
        let mut mask = MaskBuilder::new(SIZE);
        for row in 0..SIZE {
            let is_white = |column: u32| pixels.contains(&[column, row]);
            let changes = |column: &u32| is_white(*column) != (*column > 0 && is_white(column - 1));
            let row: Vec<u32> = (0..SIZE).filter(changes).collect();
            mask.push_row(&row).unwrap();
        }
        mask.finish()
    }

    proptest! {
        #[test]
        fn columns_are_free_if_no_white_is_near(
            layers in prop::collection::vec(prop::collection::vec([0..SIZE, 0..SIZE], 0..4), 1..4),
            distance in 0.2f64..6.0,
            pitch in prop::sample::select(vec!["14um", "14x19um", "19x14um"]),
        ) {
            let pitch: Pitch = pitch.parse().unwrap();
            let (metric, [x_um, y_um]) = (Metric::of(Some(pitch)), pitch.um());
            for distance in [distance, distance.ceil()] {
                let mut below = WhiteBelow::default();
                layers.iter().for_each(|pixels| below.add(&image(pixels), true).unwrap());
                let region = Region { columns: 2..20, rows: 1..23 };
                let free = below.free_columns(&region, distance, metric);
                for (row, column) in (1..23).flat_map(|row| (2..20).map(move |column| (row, column))) {
                    let far = |[x, y]: &[u32; 2]| {
                        let x_um = f64::from(x.abs_diff(column)) * x_um;
                        let y_um = f64::from(y.abs_diff(row)) * y_um;
                        x_um.hypot(y_um) >= distance * pitch.um()[0] * (1.0 - 1e-9)
                    };
                    let is_free = layers.iter().flatten().all(far);
                    prop_assert_eq!(free.holds([column, row]), is_free, "{} {}", column, row);
                    prop_assert_eq!(below.is_base_free([column, row], distance, metric), is_free);
                }
            }
        }
    }
}
