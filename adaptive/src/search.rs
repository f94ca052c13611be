//! Searches for layer heights from the bottom of a part up.

use lamp_slicer::{LayerHeights, SliceError};
use lamp_stack::Length;

use crate::criterion::Criterion;
use crate::error::HeightsError;
use crate::layered_part::LayeredPart;
use crate::swept_layer::SweptLayer;
use crate::thicknesses::Thicknesses;

/// More than any machine builds.
const MAX_LAYERS: f64 = 1e6;

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
}

/// A part's layers, bottom first.
#[derive(Clone, Debug, PartialEq)]
pub struct Heights {
    /// The layers.
    pub layers: Vec<SweptLayer>,
    /// The part's volume above the last layer, in cubic millimetres: heights are
    /// rounded to whole layers or steps.
    pub unbuilt_mm3: f64,
}

impl Heights {
    fn of(part: &LayeredPart, layers: Vec<SweptLayer>) -> Self {
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
    /// volume, in cubic millimetres.
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

/// A limit to what layers cost together.
#[derive(Clone, Copy)]
pub(crate) struct Budget<'a> {
    /// Returns the cost of a layer by its thickness.
    pub(crate) cost: &'a dyn Fn(Length) -> f64,
    pub(crate) max: f64,
}

impl Budget<'_> {
    fn of(&self, layer: &SweptLayer) -> f64 {
        (self.cost)(Length::from_um(layer.thickness_um))
    }

    pub(crate) fn of_all(&self, layers: &[SweptLayer]) -> f64 {
        layers.iter().map(|layer| self.of(layer)).sum()
    }
}

/// Up to this share of the thickest layer, looking at lower tops alone costs less.
const NEAR: f64 = 0.6;

impl HeightSearch<'_> {
    /// Finds the layers from the bottom up: each is the thickest whose measure is at most
    /// `bound`, or the thinnest if there is none. They end at the part's top, rounded to
    /// whole steps.
    ///
    /// Source: 002 section 3.2.3, algorithms 12 and 13. These bisect; but thicker layers
    /// are not always worse, so here all thicknesses are tried that the criterion does
    /// not rule out.
    ///
    /// # Errors
    /// Returns an error if there would be too many layers.
    pub fn heights(&self, bound: f64) -> Result<Heights, HeightsError> {
        let found = self.heights_within(bound, None)?;
        Ok(found.expect("layers that cost nothing are within any budget"))
    }

    /// Finds the layers as [`heights`](Self::heights) does. With a budget, each is the
    /// one that costs least for its thickness among those within the bound. Returns
    /// `None` once they exceed the budget.
    pub(crate) fn heights_within(
        &self,
        bound: f64,
        budget: Option<Budget<'_>>,
    ) -> Result<Option<Heights>, HeightsError> {
        let [bottom_um, top_um] = self.part.heights_um();
        let step_um = self.thicknesses.step().um();
        let at = |step: usize| bottom_um + step as f64 * step_um;
        let end = ((top_um - bottom_um) / step_um).round().max(1.0);
        if end / *self.thicknesses.steps().start() as f64 > MAX_LAYERS {
            return Err(too_high([bottom_um, top_um]));
        }
        let end = end as usize;
        let ends = self.ends(end);
        let (mut step, mut spent, mut layers) = (0, 0.0, Vec::new());
        let mut last_um = f64::INFINITY;
        while step < end {
            let choices = self.thicknesses.choices(step, &ends);
            let tops: Vec<f64> = choices.iter().map(|choice| at(step + choice)).collect();
            let found = self.layers(at(step), &tops, last_um, bound);
            let chosen = self.choose(&found, bound, budget);
            step += choices[chosen];
            last_um = found[chosen].thickness_um;
            spent += budget.map_or(0.0, |budget| budget.of(&found[chosen]));
            if budget.is_some_and(|budget| spent > budget.max) {
                return Ok(None);
            }
            layers.push(found[chosen]);
        }
        Ok(Some(Heights::of(self.part, layers)))
    }

    /// Returns the layers of all tops, or of the lower ones if no other can be within the
    /// bound. The thickness of the layer before hints at how many these are.
    fn layers(&self, bottom_um: f64, tops_um: &[f64], last_um: f64, bound: f64) -> Vec<SweptLayer> {
        let max_um = tops_um[tops_um.len() - 1] - bottom_um;
        // These suffice where errors grow as the thickness squared.
        let near_um = 1.2 * (2.0 * last_um * max_um).sqrt();
        if near_um < NEAR * max_um {
            let near = tops_um.partition_point(|top| top - bottom_um <= near_um).max(1);
            let layers = self.part.layers(bottom_um, &tops_um[..near]);
            if self.criterion.rules_out_thicker(&layers, max_um, bound) {
                return layers.each;
            }
        }
        self.part.layers(bottom_um, tops_um).each
    }

    fn choose(&self, layers: &[SweptLayer], bound: f64, budget: Option<Budget<'_>>) -> usize {
        let measures: Vec<f64> = layers.iter().map(|layer| self.criterion.measure(layer)).collect();
        let mut good = (0..layers.len()).rev().filter(|&k| measures[k] <= bound);
        let cheapest = match budget {
            None => good.next(),
            Some(budget) => {
                let per_um = |k: &usize| budget.of(&layers[*k]) / layers[*k].thickness_um;
                // The thickest of those that cost the same.
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

/// Returns a part's layers of one thickness, as the slicer makes them.
///
/// # Errors
/// Returns an error if there would be too many layers, or they have no thickness.
pub fn uniform_heights(part: &LayeredPart, thickness: Length) -> Result<Heights, HeightsError> {
    let [bottom_um, top_um] = part.heights_um();
    let thickness_um = thickness.um();
    let count = ((top_um - bottom_um) / thickness_um).round().max(1.0);
    // Negated, so that a thickness of NaN fails, too.
    if !(thickness_um > 0.0 && count <= MAX_LAYERS) {
        return Err(too_high([bottom_um, top_um]));
    }
    let at = |k: u32| bottom_um + f64::from(k) * thickness_um;
    let layer = |k: u32| part.layers(at(k), &[at(k + 1)]).each[0];
    Ok(Heights::of(part, (0..count as u32).map(layer).collect()))
}

fn too_high([bottom_um, top_um]: [f64; 2]) -> HeightsError {
    HeightsError::TooHigh { height: Length::from_um(top_um - bottom_um).to_whole_nm() }
}
