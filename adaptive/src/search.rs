//! Searches for layer heights from the bottom of a part up.

use std::fmt;

use lamp_slicing::{LayerHeights, PLANE_TOLERANCE, SliceError};
use lamp_stack::Length;

use crate::by_height::ByHeight;
use crate::criterion::Criterion;
use crate::error::HeightsError;
use crate::known::{KnownLayers, guessed, know};
use crate::layered_part::LayeredPart;
use crate::overlaps::Overlaps;
use crate::placement::{LayerPlacement, cost_of};
use crate::swept_layer::SweptLayer;
use crate::table::HeightTable;
use crate::thicknesses::Thicknesses;

/// More than any machine builds.
pub(crate) const MAX_LAYERS: f64 = 1e6;

/// A search for a part's layer heights.
#[derive(Debug)]
pub struct HeightSearch<'a> {
    /// The part.
    pub part: &'a LayeredPart,
    /// The thicknesses that the machine builds.
    pub thicknesses: &'a Thicknesses,
    /// The measure of a layer's error.
    pub criterion: &'a dyn Criterion,
    /// Makes layers end at flat faces.
    pub snap: bool,
    /// Is called for each layer found.
    pub watch: Watch<'a>,
}

/// The report of a layer that a search finds. A search that tries several bounds begins again at
/// the bottom for each.
#[derive(Clone, Copy)]
pub struct Watch<'a>(pub &'a dyn Fn(&SweptLayer));

impl Default for Watch<'_> {
    fn default() -> Self {
        Self(&|_| ())
    }
}

impl fmt::Debug for Watch<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Watch")
    }
}

/// A part's layers, bottom first.
#[derive(Clone, Debug, PartialEq)]
pub struct Heights {
    /// The layers.
    pub layers: Vec<SweptLayer>,
    /// The part's volume above the last layer, in cubic millimeters: heights are
    /// rounded to whole layers or steps.
    pub unbuilt_mm3: f64,
}

impl Heights {
    pub(crate) fn of(part: &LayeredPart, layers: Vec<SweptLayer>) -> Self {
        let (end_um, top_um) =
            (layers.last().map_or(0.0, SweptLayer::top_um), part.heights_um()[1]);
        let is_left = !layers.is_empty() && end_um < top_um;
        let unbuilt_mm3 =
            if is_left { part.layers(end_um, &[top_um]).each[0].volume_mm3 } else { 0.0 };
        Self { layers, unbuilt_mm3 }
    }

    /// Returns the layers' heights, as the slicer takes them.
    ///
    /// # Errors
    /// Returns an error if there are too many layers.
    pub fn layer_heights(&self) -> Result<LayerHeights, SliceError> {
        let ends = self.layers.iter().map(SweptLayer::top_um);
        LayerHeights::new(
            self.layers.iter().take(1).map(|layer| layer.bottom_um).chain(ends).collect(),
        )
    }

    /// Returns the volume lost (and not built), the volume gained and the part's
    /// volume, in cubic millimeters.
    pub fn volumes_mm3(&self) -> [f64; 3] {
        let sum = |of: fn(&SweptLayer) -> f64| self.layers.iter().map(of).sum::<f64>();
        let [lost, gained, volume] = [
            sum(|layer| layer.lost_mm3),
            sum(|layer| layer.gained_mm3),
            sum(|layer| layer.volume_mm3),
        ];
        [lost + self.unbuilt_mm3, gained, volume + self.unbuilt_mm3]
    }
}

/// A limit on the cost of all layers together.
#[derive(Clone, Copy)]
pub(crate) struct Budget<'a> {
    /// Returns the cost of a layer by its thickness.
    pub(crate) cost: &'a dyn Fn(Length) -> f64,
    pub(crate) max: f64,
}

impl Budget<'_> {
    pub(crate) fn of(&self, layer: &SweptLayer) -> f64 {
        (self.cost)(Length::from_um(layer.thickness_um))
    }

    pub(crate) fn of_all(&self, layers: &[SweptLayer]) -> f64 {
        layers.iter().map(|layer| self.of(layer)).sum()
    }
}

/// Up to this share of the thickest layer, looking at lower tops alone costs less.
const NEAR: f64 = 0.6;

/// Where layers may end: whole steps above the part's bottom.
pub(crate) struct StepGrid<'a> {
    bottom_um: f64,
    step_um: f64,
    /// Where layers are to end; the last is the part's top.
    ends: Vec<usize>,
    pub(crate) table: Option<HeightTable>,
    /// The differences of layers from the table, if they are known without looking at all rows of
    /// the layers.
    overlaps: Option<Overlaps<'a>>,
}

impl StepGrid<'_> {
    pub(crate) fn at(&self, step: usize) -> f64 {
        self.bottom_um + step as f64 * self.step_um
    }

    /// Returns the steps where layers are to end.
    pub(crate) fn ends(&self) -> &[usize] {
        &self.ends
    }

    pub(crate) fn end(&self) -> usize {
        self.ends[self.ends.len() - 1]
    }
}

/// Layers found from the bottom up.
pub(crate) struct Climb {
    pub(crate) heights: Heights,
    /// The steps in which layers end.
    tops: Vec<usize>,
}

/// A placement is looked at only if it promises to err less than this share of the found layers'
/// error.
const WORTHWHILE: f64 = 0.99;

impl HeightSearch<'_> {
    /// Finds the layers within bounds: as many as are found from the bottom up, where each is the
    /// thickest whose measure is at most its bound, or the thinnest if no measure is. A layer that
    /// meets several bounds keeps the least of them. Of all ways to place as many, this is the one
    /// that loses and gains least. They end at the part's top, rounded to whole steps.
    ///
    /// Source: 002 section 3.2.3, algorithms 12 and 13. These bisect; but thicker layers
    /// are not always worse, so here all thicknesses are tried that the criterion does
    /// not rule out.
    ///
    /// # Errors
    /// Returns an error if there would be too many layers.
    pub fn heights(&self, bounds: impl Into<ByHeight<f64>>) -> Result<Heights, HeightsError> {
        let bounds = bounds.into();
        if let Some([from, to]) = bounds.missing(self.part.heights_um()) {
            return Err(HeightsError::NoBound { from, to });
        }
        let grid = self.grid()?;
        let mut known = KnownLayers::new();
        let climb = self.climb(&grid, &bounds, None, &mut known);
        let climb = climb.expect("layers that cost nothing are within any budget");
        Ok(self.placed(&grid, climb, &known, &bounds, None))
    }

    /// Returns the steps where layers may end, and the table of the facets.
    pub(crate) fn grid(&self) -> Result<StepGrid<'_>, HeightsError> {
        let [bottom_um, top_um] = self.part.heights_um();
        let step_um = self.thicknesses.step().um();
        let (height, step) = (Length::from_um(top_um - bottom_um), self.thicknesses.step());
        let end = self.part.side().whole_layers(height, step, PLANE_TOLERANCE);
        if end / *self.thicknesses.steps().start() as f64 > MAX_LAYERS {
            return Err(too_high([bottom_um, top_um]));
        }
        let end = end as usize;
        let table = HeightTable::new(self.part, step_um, end + self.thicknesses.steps().end());
        let overlaps = self.part.overlaps(*self.thicknesses.steps().end() as f64 * step_um);
        Ok(StepGrid { bottom_um, step_um, ends: self.ends(end), table, overlaps })
    }

    /// Finds the layers from the bottom up: each is the thickest within the bound. With a
    /// budget, each is the one that costs least for its thickness among those within the
    /// bound. Returns `None` once they exceed the budget. All layers that it asks about
    /// are known then.
    pub(crate) fn climb(
        &self,
        grid: &StepGrid<'_>,
        bounds: &ByHeight<f64>,
        budget: Option<Budget<'_>>,
        known: &mut KnownLayers,
    ) -> Option<Climb> {
        let (mut step, mut spent, mut layers, mut ended) = (0, 0.0, Vec::new(), Vec::new());
        let mut last_um = f64::INFINITY;
        while step < grid.end() {
            let choices = self.thicknesses.choices(step, &grid.ends);
            let found = self.layers(grid, step, &choices, last_um, bounds);
            let chosen = self.choose(&found, bounds, budget);
            let layer = found[chosen];
            know(known, step, choices.iter().copied().zip(found).collect());
            step += choices[chosen];
            last_um = layer.thickness_um;
            spent += budget.map_or(0.0, |budget| budget.of(&layer));
            if budget.is_some_and(|budget| spent > budget.max) {
                return None;
            }
            (self.watch.0)(&layer);
            layers.push(layer);
            ended.push(step);
        }
        Some(Climb { heights: Heights::of(self.part, layers), tops: ended })
    }

    /// Finds the layers from the bottom up by facets alone and known layers nearby.
    pub(crate) fn guess(
        &self,
        grid: &StepGrid<'_>,
        table: &HeightTable,
        bounds: &ByHeight<f64>,
        budget: Budget<'_>,
        known: &KnownLayers,
    ) -> Option<Vec<SweptLayer>> {
        let (mut step, mut spent, mut layers) = (0, 0.0, Vec::new());
        while step < grid.end() {
            let choices = self.thicknesses.choices(step, &grid.ends);
            let found = guessed(table, known, step, &choices);
            let chosen = self.choose(&found, bounds, Some(budget));
            step += choices[chosen];
            spent += budget.of(&found[chosen]);
            if spent > budget.max {
                return None;
            }
            layers.push(found[chosen]);
        }
        Some(layers)
    }

    /// Returns as many layers as were found from the bottom up, where they err least.
    pub(crate) fn placed(
        &self,
        grid: &StepGrid<'_>,
        climb: Climb,
        known: &KnownLayers,
        bounds: &ByHeight<f64>,
        budget: Option<Budget<'_>>,
    ) -> Heights {
        let Climb { heights: found, tops } = climb;
        let Some(table) = &grid.table else { return found };
        let (thicknesses, criterion, ends) = (self.thicknesses, self.criterion, &grid.ends[..]);
        let placement = LayerPlacement { table, thicknesses, criterion, ends, bounds, known };
        let cost = cost_of(&found, criterion, bounds);
        let worthwhile = (cost.0, WORTHWHILE * (cost.1 - found.unbuilt_mm3));
        let Some(best) = placement.least_error(&tops, worthwhile) else { return found };
        let mut step = 0;
        let layers = best.iter().map(|&steps| {
            let layer = placement.known(step, steps);
            let layer = layer
                .unwrap_or_else(|| self.layers(grid, step, &[steps], f64::INFINITY, bounds)[0]);
            step += steps;
            layer
        });
        let better = Heights { layers: layers.collect(), ..found };
        let is_within = budget.is_none_or(|budget| budget.of_all(&better.layers) <= budget.max);
        if is_within && cost_of(&better, criterion, bounds) < cost { better } else { found }
    }

    /// Returns the layers of all thicknesses, in steps, or of the lower ones if no other can be
    /// within the bound. The thickness of the layer before hints at how many these are.
    fn layers(
        &self,
        grid: &StepGrid<'_>,
        bottom: usize,
        choices: &[usize],
        last_um: f64,
        bounds: &ByHeight<f64>,
    ) -> Vec<SweptLayer> {
        if let (Some(table), Some(overlaps)) = (&grid.table, &grid.overlaps) {
            return overlaps.layers(table, bottom, choices);
        }
        let bottom_um = grid.at(bottom);
        let tops_um: Vec<f64> = choices.iter().map(|choice| grid.at(bottom + choice)).collect();
        let max_um = tops_um[tops_um.len() - 1] - bottom_um;
        // These suffice where errors grow as the thickness squared.
        let near_um = 1.2 * (2.0 * last_um * max_um).sqrt();
        if near_um < NEAR * max_um {
            let near = tops_um.partition_point(|top| top - bottom_um <= near_um).max(1);
            let layers = self.part.layers(bottom_um, &tops_um[..near]);
            // Thicker layers meet the same bounds, and maybe lesser ones.
            let bound = layers.each.last().map_or(0.0, |last| bounds.of_layer(last));
            if self.criterion.rules_out_thicker(&layers, max_um, bound) {
                return layers.each;
            }
        }
        self.part.layers(bottom_um, &tops_um).each
    }

    pub(crate) fn choose(
        &self,
        layers: &[SweptLayer],
        bounds: &ByHeight<f64>,
        budget: Option<Budget<'_>>,
    ) -> usize {
        let is_good = |layer: &SweptLayer| self.criterion.measure(layer) <= bounds.of_layer(layer);
        let is_good: Vec<bool> = layers.iter().map(is_good).collect();
        let mut good = (0..layers.len()).rev().filter(|&k| is_good[k]);
        let cheapest = match budget {
            None => good.next(),
            Some(budget) => {
                let per_um = |k: &usize| budget.of(&layers[*k]) / layers[*k].thickness_um;
                // The thickest of the layers that cost the same.
                good.min_by(|a, b| per_um(a).total_cmp(&per_um(b)))
            }
        };
        cheapest.unwrap_or(0)
    }

    /// Returns the heights where layers are to end, in steps: flat faces, rounded down
    /// so that sections lie below them, and the part's top. Faces too close below the
    /// top for a layer between them are left out.
    fn ends(&self, end: usize) -> Vec<usize> {
        let bottom_um = self.part.heights_um()[0];
        let step_um = self.thicknesses.step().um();
        let mut ends = vec![end];
        if self.snap {
            for face in self.part.flat_faces_um() {
                let steps = ((face - bottom_um) / step_um).floor() as usize;
                let is_above = bottom_um + steps as f64 * step_um > face;
                ends.push(steps.saturating_sub(usize::from(is_above)));
            }
        }
        ends.retain(|step| (1..=end).contains(step) && self.thicknesses.can_fill(end - step));
        ends.sort_unstable();
        ends.dedup();
        ends
    }
}

pub(crate) fn too_high([bottom_um, top_um]: [f64; 2]) -> HeightsError {
    HeightsError::TooHigh { height: Length::from_um(top_um - bottom_um).to_whole_nm() }
}
