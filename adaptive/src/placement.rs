//! Places as many layers as were found where they err least together.

use crate::by_height::ByHeight;
use crate::criterion::Criterion;
use crate::known::KnownLayers;
use crate::search::Heights;
use crate::swept_layer::SweptLayer;
use crate::table::HeightTable;
use crate::thicknesses::Thicknesses;

/// More ways than this are not compared: with wide limits and small steps, they would take
/// longer than the search.
const MAX_WAYS: usize = 50_000_000;

/// The cost of layers: how many are past the bound, and the volume that they lose and gain, in
/// cubic millimeters.
type PlacementCost = (u32, f64);

/// All ways to place layers between whole steps.
pub(crate) struct LayerPlacement<'a> {
    pub(crate) table: &'a HeightTable,
    pub(crate) thicknesses: &'a Thicknesses,
    pub(crate) criterion: &'a dyn Criterion,
    pub(crate) ends: &'a [usize],
    pub(crate) bounds: &'a ByHeight<f64>,
    /// Layers that are known better than from the table.
    pub(crate) known: &'a KnownLayers,
}

/// A layer that may be taken.
struct LayerChoice {
    steps: usize,
    cost: PlacementCost,
}

impl LayerPlacement<'_> {
    /// Returns the thicknesses, in steps, of the layers that cost least, as many as `tops` has.
    /// Returns nothing if none cost less than `worthwhile`, or too many are to compare.
    ///
    /// Each layer is to end above the found end of the layer before, and no higher than its own
    /// found end. Where thicker layers are worse, no other ways are of use: the layers found reach
    /// as high as so many can, and from lower down it takes more to the end.
    pub(crate) fn least_error(
        &self,
        tops: &[usize],
        worthwhile: PlacementCost,
    ) -> Option<Vec<usize>> {
        let end = *tops.last()?;
        // Dynamic programming looks at every end with every thickness.
        if end.saturating_mul(self.thicknesses.steps().count()) > MAX_WAYS {
            return None;
        }
        // For each step, how many layers end at or below it.
        let mut layers_below = vec![0; end + 1];
        for (layer, top) in tops.iter().enumerate() {
            let below = if layer == 0 { 0 } else { tops[layer - 1] };
            layers_below[below + 1..=*top].fill(layer + 1);
        }
        // Where a layer must end at least, so that those left reach the end.
        let max = *self.thicknesses.steps().end();
        let least = |layers: usize| end.saturating_sub((tops.len() - layers) * max);
        // Ways with the same number of layers alone are compared: `layers_below` says how many end
        // at or below a step.
        let may_end = |top: usize, layers: usize| {
            layers_below.get(top) == Some(&layers) && top >= least(layers)
        };
        // The least cost up to each step, and the thickness of the layer below it.
        let mut best: Vec<Option<(PlacementCost, usize)>> = vec![None; end + 1];
        best[0] = Some(((0, 0.0), 0));
        for step in 0..end {
            let Some((so_far, _)) = best[step] else { continue };
            let layers = layers_below[step] + 1;
            for LayerChoice { steps, cost } in self.ways(step, |top| may_end(top, layers)) {
                let top = step + steps;
                // Pairs compare by layers past the bound first: no gain of volume makes up for one.
                let cost = (so_far.0 + cost.0, so_far.1 + cost.1);
                if best[top].is_none_or(|(least, _)| cost < least) {
                    best[top] = Some((cost, steps));
                }
            }
        }
        // The search's own layers are kept where others are no better.
        best[end].filter(|(cost, _)| *cost < worthwhile)?;
        let mut thicknesses = Vec::new();
        let mut top = end;
        while top > 0 {
            let (_, steps) = best[top].expect("the best way leads here");
            thicknesses.push(steps);
            top -= steps;
        }
        thicknesses.reverse();
        Some(thicknesses)
    }

    /// Returns a layer that rows were asked about, if they were.
    pub(crate) fn known(&self, step: usize, steps: usize) -> Option<SweptLayer> {
        known_of(self.known.get(&step)?, steps)
    }

    /// Returns the layers that the search may take from a step and that may end where they do: the
    /// layers within the bound, or the thinnest if no layer is.
    fn ways(&self, step: usize, may_end: impl Fn(usize) -> bool) -> Vec<LayerChoice> {
        let choices = self.thicknesses.choices(step, self.ends);
        let known = self.known.get(&step);
        let of = |(&steps, layer): (&usize, SweptLayer)| {
            let layer = known.and_then(|known| known_of(known, steps)).unwrap_or(layer);
            let past = u32::from(self.criterion.measure(&layer) > self.bounds.of_layer(&layer));
            LayerChoice { steps, cost: (past, layer.lost_mm3 + layer.gained_mm3) }
        };
        let ends = |steps: &usize| may_end(step + steps);
        let Some(last) = choices.iter().rposition(ends) else { return Vec::new() };
        let layers = choices.iter().zip(self.table.layers(step, &choices[..=last]));
        let mut ways: Vec<LayerChoice> = layers.filter(|(steps, _)| ends(steps)).map(of).collect();
        let is_thinnest_of_all = |way: &LayerChoice| {
            let layers = || choices.iter().zip(self.table.layers(step, &choices));
            way.steps == choices[0] && layers().all(|layer| of(layer).cost.0 > 0)
        };
        let has_good = ways.iter().any(|way| way.cost.0 == 0);
        if !has_good && ways.first().is_some_and(is_thinnest_of_all) {
            ways.truncate(1);
        } else {
            ways.retain(|way| way.cost.0 == 0);
        }
        ways
    }
}

/// Among the layers known from one step, returns the layer of a thickness in steps.
fn known_of(known: &[(usize, SweptLayer)], steps: usize) -> Option<SweptLayer> {
    let place = known.binary_search_by_key(&steps, |(steps, _)| *steps).ok()?;
    Some(known[place].1)
}

/// Returns how many layers are past their bounds, and the volume lost and gained.
pub(crate) fn cost_of(
    heights: &Heights,
    criterion: &dyn Criterion,
    bounds: &ByHeight<f64>,
) -> PlacementCost {
    let is_past = |layer: &&SweptLayer| criterion.measure(layer) > bounds.of_layer(layer);
    let past = heights.layers.iter().filter(is_past).count();
    let [lost, gained, _] = heights.volumes_mm3();
    (past as u32, lost + gained)
}
