//! The search for layer heights.

use lamp_slicer::{LayerHeights, SliceError};

use crate::criterion::Criterion;
use crate::error::HeightsError;
use crate::layered_part::LayeredPart;
use crate::slab::Slab;
use crate::thicknesses::Thicknesses;

/// More than any machine builds.
const MOST_LAYERS: f64 = 1e6;

/// How heights are searched for.
#[derive(Debug)]
pub struct HeightSearch<'a> {
    /// The part.
    pub part: &'a LayeredPart,
    /// The thicknesses that the machine builds.
    pub thicknesses: &'a Thicknesses,
    /// The measure of how far a layer is off.
    pub criterion: &'a dyn Criterion,
    /// Whether layers end at flat faces.
    pub snap: bool,
}

/// A part's layers, bottom first.
#[derive(Clone, Debug, PartialEq)]
pub struct Heights {
    /// The layers.
    pub slabs: Vec<Slab>,
    /// What of the part lies above the last layer, in cubic millimetres: heights are
    /// rounded to whole layers or steps.
    pub unbuilt_mm3: f64,
}

impl Heights {
    fn of(part: &LayeredPart, slabs: Vec<Slab>) -> Self {
        let (end_um, top_um) = (slabs.last().map_or(0.0, Slab::top_um), part.heights_um()[1]);
        let is_left = !slabs.is_empty() && end_um < top_um;
        let unbuilt_mm3 =
            if is_left { part.slabs(end_um, &[top_um]).each[0].volume_mm3 } else { 0.0 };
        Self { slabs, unbuilt_mm3 }
    }

    /// The layers' heights, as the slicer takes them.
    ///
    /// # Errors
    /// Where the layers are too many.
    pub fn layer_heights(&self) -> Result<LayerHeights, SliceError> {
        let ends = self.slabs.iter().map(Slab::top_um);
        LayerHeights::new(
            self.slabs.iter().take(1).map(|slab| slab.bottom_um).chain(ends).collect(),
        )
    }

    /// The volume lost (and not built), the volume gained and the part's volume, in
    /// cubic millimetres.
    pub fn volumes_mm3(&self) -> [f64; 3] {
        let sum = |of: fn(&Slab) -> f64| self.slabs.iter().map(of).sum::<f64>();
        let [lost, gained, volume] =
            [sum(|slab| slab.lost_mm3), sum(|slab| slab.gained_mm3), sum(|slab| slab.volume_mm3)];
        [lost + self.unbuilt_mm3, gained, volume + self.unbuilt_mm3]
    }
}

/// What layers may cost together.
#[derive(Clone, Copy)]
pub(crate) struct Budget<'a> {
    /// What a layer of so many micrometres costs.
    pub(crate) cost: &'a dyn Fn(f64) -> f64,
    pub(crate) most: f64,
}

impl Budget<'_> {
    pub(crate) fn of_all(&self, slabs: &[Slab]) -> f64 {
        slabs.iter().map(|slab| (self.cost)(slab.thickness_um)).sum()
    }
}

/// Up to this share of the thickest layer, a look at lower tops alone costs less.
const NEAR: f64 = 0.6;

impl HeightSearch<'_> {
    /// Finds the layers from the bottom: each the thickest whose measure is at most
    /// `bound`, or the thinnest where none is. They end at the part's top, rounded to
    /// whole steps.
    ///
    /// Thicker layers are not always worse, so all thicknesses are looked at, except
    /// those that a criterion rules out.
    /// Source: 002 section 3.2.3, algorithms 12 and 13, which bisect.
    ///
    /// # Errors
    /// Where the layers would be too many.
    pub fn heights(&self, bound: f64) -> Result<Heights, HeightsError> {
        let found = self.heights_within(bound, None)?;
        Ok(found.expect("layers that cost nothing are within any budget"))
    }

    /// As [`heights`](Self::heights); with a budget each the layer that costs least
    /// for its thickness among those within the bound, and `None` once they cost more
    /// than they may.
    pub(crate) fn heights_within(
        &self,
        bound: f64,
        budget: Option<Budget<'_>>,
    ) -> Result<Option<Heights>, HeightsError> {
        let [bottom_um, top_um] = self.part.heights_um();
        let step_um = self.thicknesses.step_um();
        let at = |step: usize| bottom_um + step as f64 * step_um;
        let end = ((top_um - bottom_um) / step_um).round().max(1.0);
        if end / *self.thicknesses.steps().start() as f64 > MOST_LAYERS {
            return Err(HeightsError::TooHigh { height_mm: (top_um - bottom_um) / 1000.0 });
        }
        let end = end as usize;
        let ends = self.ends(end);
        let (mut step, mut spent, mut slabs) = (0, 0.0, Vec::new());
        let mut last_um = f64::INFINITY;
        while step < end {
            let choices = self.thicknesses.choices(step, &ends);
            let tops: Vec<f64> = choices.iter().map(|choice| at(step + choice)).collect();
            let found = self.slabs(at(step), &tops, last_um, bound);
            let chosen = self.choose(&found, bound, budget);
            step += choices[chosen];
            last_um = found[chosen].thickness_um;
            spent += budget.map_or(0.0, |budget| (budget.cost)(last_um));
            if budget.is_some_and(|budget| spent > budget.most) {
                return Ok(None);
            }
            slabs.push(found[chosen]);
        }
        Ok(Some(Heights::of(self.part, slabs)))
    }

    /// The slabs of all tops, or of the lower ones where no other can be within the
    /// bound. The layer before is a hint how many these are.
    fn slabs(&self, bottom_um: f64, tops_um: &[f64], last_um: f64, bound: f64) -> Vec<Slab> {
        let most_um = tops_um[tops_um.len() - 1] - bottom_um;
        // So many suffice where errors grow as the thickness squared.
        let near_um = 1.2 * (2.0 * last_um * most_um).sqrt();
        if near_um < NEAR * most_um {
            let near = tops_um.partition_point(|top| top - bottom_um <= near_um).max(1);
            let slabs = self.part.slabs(bottom_um, &tops_um[..near]);
            if self.criterion.rules_out_thicker(&slabs, most_um, bound) {
                return slabs.each;
            }
        }
        self.part.slabs(bottom_um, tops_um).each
    }

    fn choose(&self, slabs: &[Slab], bound: f64, budget: Option<Budget<'_>>) -> usize {
        let measures: Vec<f64> = slabs.iter().map(|slab| self.criterion.measure(slab)).collect();
        let mut good = (0..slabs.len()).rev().filter(|&k| measures[k] <= bound);
        let cheapest = match budget {
            None => good.next(),
            Some(Budget { cost, .. }) => {
                let per_um = |k: &usize| cost(slabs[*k].thickness_um) / slabs[*k].thickness_um;
                // The thickest of those that cost the same.
                good.min_by(|a, b| per_um(a).total_cmp(&per_um(b)))
            }
        };
        cheapest.unwrap_or(0)
    }

    /// The heights where layers are to end, in steps: flat faces, rounded down so
    /// that sections lie below them, and the part's top. Faces so close below the
    /// top that no layer fits between are left out.
    fn ends(&self, end: usize) -> Vec<usize> {
        let bottom_um = self.part.heights_um()[0];
        let step_um = self.thicknesses.step_um();
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

/// The layers of a part that are all of one thickness, as the slicer has them.
///
/// # Errors
/// Where the layers would be too many, or have no thickness.
pub fn uniform_heights(part: &LayeredPart, thickness_um: f64) -> Result<Heights, HeightsError> {
    let [bottom_um, top_um] = part.heights_um();
    let count = ((top_um - bottom_um) / thickness_um).round().max(1.0);
    // Written so that a thickness of NaN or below zero fails, too.
    if !(thickness_um > 0.0 && count <= MOST_LAYERS) {
        return Err(HeightsError::TooHigh { height_mm: (top_um - bottom_um) / 1000.0 });
    }
    let at = |k: u32| bottom_um + f64::from(k) * thickness_um;
    let slab = |k: u32| part.slabs(at(k), &[at(k + 1)]).each[0];
    Ok(Heights::of(part, (0..count as u32).map(slab).collect()))
}
