//! Supports of undersides that are flatter than an angle, on an even grid.

use std::collections::BTreeMap;
use std::ops::Range;

use lamp_stack::{Mask, white_runs};

use super::divide::{IslandPiece, WhiteRuns, piece};
use super::fit::IslandSurroundings;
use super::free::{WhiteBelow, remote};
use super::plan::{MOST_SUPPORTS, SupportPlanner};
use super::window::SupportWindow;
use super::{HeldPlace, SupportError};
use crate::check::{Metric, Region, Standing};

/// The fewest pixels of an overhang in a cell: fewer may come of rounding to pixels.
const LEAST_AREA: u64 = 9;

/// The least distance of supports as a share of the spacing: pieces of neighboring cells may be
/// nearer than the cells.
const NEAREST: f64 = 0.75;

/// How deep the tips of pillars may meet the slope below them. Along the normal of a slope of
/// 45 degrees, a tip of PrusaSlicer's sizes leaves it after 0.3 mm, and a pixel.
const CONTACT_DEPTH_MM: f64 = 0.4;

impl SupportPlanner<'_> {
    /// Plans supports of the overhangs of a layer, given the image below it: white that reaches
    /// farther beyond the white below than an underside of the angle does. An even grid divides
    /// them, and each piece that is not near a support gets one.
    pub(super) fn overhangs(
        &mut self,
        layer: u32,
        under: &Mask,
        standing: &Standing,
        window: &SupportWindow,
        below: &WhiteBelow,
    ) -> Result<Vec<HeldPlace>, SupportError> {
        let Some(angle) = self.options.overhangs else { return Ok(Vec::new()) };
        let limit_mm = self.thickness_mm(layer) / angle.to_radians().tan();
        let limit = limit_mm / self.raster.width_mm();
        // Smaller cells than pieces need pixels would leave all without a support.
        let cell =
            self.raster.pitch.pixels(self.options.spacing).map(|pixels| pixels.max(3.0) as u32);
        let mut places = Vec::new();
        for piece in pieces(standing.mask(), under, limit, cell, self.raster.metric()) {
            let [column, row] = piece.middle.map(|place| place as u32);
            let component = standing.component_at([column, row]);
            let [x, y] = self.raster.place_mm(piece.middle);
            let at = [x, y, self.bottom_mm(layer)];
            let is_held = self.is_near_place(at, NEAREST * self.options.spacing.mm());
            // White that rests on nothing is an island.
            if is_held || standing.support(component)[0] == 0 {
                continue;
            }
            self.places_mm.push(at);
            if self.places_mm.len() > MOST_SUPPORTS {
                return Err(SupportError::TooMany);
            }
            let around = IslandSurroundings {
                raster: self.raster,
                layers: &self.found.layers,
                window,
                lowest: self.lowest(layer),
                layer,
                island: &piece.runs,
                contact_depth_mm: CONTACT_DEPTH_MM,
            };
            let region = region_of(&piece.runs);
            let (near, ground) = (self.near(&region, layer), self.ground(&region, below));
            let place = self.place(&piece, &near, &around, ground.as_ref());
            place.supports.first().into_iter().for_each(|support| self.build(support));
            places.push(place);
        }
        Ok(places)
    }
}

/// Divides the white that is farther than `limit` from the white of the image under it by cells of
/// an even grid, of so many columns and rows.
fn pieces(
    mask: &Mask,
    under: &Mask,
    limit: f64,
    [wide, high]: [u32; 2],
    metric: Metric,
) -> Vec<IslandPiece> {
    let mut cells: BTreeMap<[u32; 2], WhiteRuns> = BTreeMap::new();
    let mut far: Vec<Range<u32>> = Vec::new();
    // A pixel at just the limit is held.
    let limit = limit * (1.0 + 1e-6) + 1e-6;
    for row in 0..mask.height() {
        far.clear();
        far.extend(white_runs(mask.row(row), mask.width()).map(|(start, end)| start..end));
        remote(under, row, limit, metric, &mut far);
        for run in &far {
            for column in run.start / wide..=(run.end - 1) / wide {
                let part = run.start.max(column * wide)..run.end.min((column + 1) * wide);
                cells.entry([row / high, column]).or_default().push((row, part));
            }
        }
    }
    let pieces = cells.into_values().map(|runs| piece(runs, metric));
    pieces.filter(|piece| piece.area >= LEAST_AREA).collect()
}

fn region_of(runs: &WhiteRuns) -> Region {
    let region =
        |(row, run): &(u32, Range<u32>)| Region { columns: run.clone(), rows: *row..row + 1 };
    let all = runs.iter().map(region).reduce(|mut all, run| {
        all.unite(&run);
        all
    });
    all.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use lamp_stack::{MaskBuilder, Pitch};
    use proptest::prelude::*;

    use super::*;

    const SIZE: u32 = 30;

    fn image(boxes: &[(u32, u32, u32, u32)]) -> Mask {
        let mut mask = MaskBuilder::new(SIZE);
        let is_white = |column: u32, row: u32| {
            let holds = |&(x, y, w, h): &(u32, u32, u32, u32)| {
                (x..x + w).contains(&column) && (y..y + h).contains(&row)
            };
            boxes.iter().any(holds)
        };
        for row in 0..SIZE {
            let changes =
                |column: &u32| is_white(*column, row) != (*column > 0 && is_white(column - 1, row));
            mask.push_row(&(0..SIZE).filter(changes).collect::<Vec<_>>()).unwrap();
        }
        mask.finish()
    }

    fn boxes() -> impl Strategy<Value = Vec<(u32, u32, u32, u32)>> {
        prop::collection::vec((0u32..20, 0u32..20, 1u32..9, 1u32..9), 1..4)
    }

    proptest! {
        #[test]
        fn pieces_hold_the_pixels_that_are_far_from_white(
            (above, below) in (boxes(), boxes()),
            limit in 0.5f64..6.0,
            cell in prop::array::uniform2(1u32..12),
            pitch in prop::sample::select(vec!["14um", "14x19um", "19x14um"]),
        ) {
            let pitch: Pitch = pitch.parse().unwrap();
            let [x_um, y_um] = pitch.um();
            for limit in [limit, limit.floor()] {
                let (mask, under) = (image(&above), image(&below));
                let mut cells = std::collections::BTreeMap::new();
                for (row, column) in (0..SIZE).flat_map(|row| (0..SIZE).map(move |column| (row, column))) {
                    let is_near = (0..SIZE).any(|y| (0..SIZE).any(|x| {
                        let away_um = (f64::from(x.abs_diff(column)) * x_um)
                            .hypot(f64::from(y.abs_diff(row)) * y_um);
                        under.is_white(x, y) && away_um <= limit * x_um + 1e-9
                    }));
                    if mask.is_white(column, row) && !is_near {
                        *cells.entry([row / cell[1], column / cell[0]]).or_insert(0) += 1;
                    }
                }
                let found = pieces(&mask, &under, limit, cell, Metric::of(Some(pitch)));
                let areas: Vec<u64> = cells.into_values().filter(|area| *area >= LEAST_AREA).collect();
                prop_assert_eq!(found.iter().map(|piece| piece.area).collect::<Vec<_>>(), areas);
            }
        }
    }
}
