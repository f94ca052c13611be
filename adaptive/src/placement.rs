//! Places as many layers as were found where they err least together.

use crate::criterion::Criterion;
use crate::known::Known;
use crate::search::Heights;
use crate::swept_layer::SweptLayer;
use crate::table::HeightTable;
use crate::thicknesses::Thicknesses;

/// More ways than this are not compared: with wide limits and small steps, they would take
/// longer than the search.
const MAX_WAYS: usize = 50_000_000;

/// What layers cost: how many are past the bound, and the volume that they lose and gain, in
/// cubic millimetres.
type Cost = (u32, f64);

/// All ways to place layers between whole steps.
pub(crate) struct Placement<'a> {
    pub(crate) table: &'a HeightTable,
    pub(crate) thicknesses: &'a Thicknesses,
    pub(crate) criterion: &'a dyn Criterion,
    pub(crate) ends: &'a [usize],
    pub(crate) bound: f64,
    /// Layers that are known better than the table does.
    pub(crate) known: &'a Known,
}

/// A layer that may be taken.
struct Way {
    steps: usize,
    cost: Cost,
}

impl Placement<'_> {
    /// Returns the thicknesses, in steps, of the layers that cost least, of as many as end in
    /// `tops`. Returns nothing if none cost less than `worthwhile`, or too many are to compare.
    ///
    /// Each layer is to end above where the layer before was found to end, and no higher than
    /// it was found to end itself. Where thicker layers are worse, no others are of use: those
    /// found reach as high as so many can, and from lower down it takes more to the end.
    pub(crate) fn least_error(&self, tops: &[usize], worthwhile: Cost) -> Option<Vec<usize>> {
        let end = *tops.last()?;
        if end.saturating_mul(self.thicknesses.steps().count()) > MAX_WAYS {
            return None;
        }
        let mut layers_below = vec![0; end + 1];
        for (layer, top) in tops.iter().enumerate() {
            let below = if layer == 0 { 0 } else { tops[layer - 1] };
            layers_below[below + 1..=*top].fill(layer + 1);
        }
        // The least cost up to each step, and the thickness of the layer below it.
        let mut best: Vec<Option<(Cost, usize)>> = vec![None; end + 1];
        best[0] = Some(((0, 0.0), 0));
        for step in 0..end {
            let Some((so_far, _)) = best[step] else { continue };
            for Way { steps, cost } in self.ways(step) {
                let top = step + steps;
                if layers_below.get(top) != Some(&(layers_below[step] + 1)) {
                    continue;
                }
                let cost = (so_far.0 + cost.0, so_far.1 + cost.1);
                if best[top].is_none_or(|(least, _)| cost < least) {
                    best[top] = Some((cost, steps));
                }
            }
        }
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
        let known = self.known.get(&step)?;
        let place = known.binary_search_by_key(&steps, |(steps, _)| *steps).ok()?;
        Some(known[place].1)
    }

    /// Returns the layers that the search may take from a step: those within the bound, or
    /// the thinnest.
    fn ways(&self, step: usize) -> Vec<Way> {
        let choices = self.thicknesses.choices(step, self.ends);
        let layers = choices.iter().zip(self.table.layers(step, &choices));
        let layers =
            layers.map(|(&steps, layer)| (steps, self.known(step, steps).unwrap_or(layer)));
        let mut thinnest = None;
        let mut ways = Vec::new();
        for (steps, layer) in layers {
            let past = u32::from(self.criterion.measure(&layer) > self.bound);
            let way = Way { steps, cost: (past, layer.lost_mm3 + layer.gained_mm3) };
            if past == 0 {
                ways.push(way);
            } else if thinnest.is_none() && ways.is_empty() {
                thinnest = Some(way);
            }
        }
        if ways.is_empty() { thinnest.into_iter().collect() } else { ways }
    }
}

/// Returns how many layers are past a bound, and the volume lost and gained.
pub(crate) fn cost_of(heights: &Heights, criterion: &dyn Criterion, bound: f64) -> Cost {
    let past = heights.layers.iter().filter(|layer| criterion.measure(layer) > bound).count();
    let [lost, gained, _] = heights.volumes_mm3();
    (past as u32, lost + gained)
}
