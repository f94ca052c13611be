//! The search for layer heights.

use lamp_slicer::{LayerHeights, SliceError};

use crate::criterion::Criterion;
use crate::error::HeightsError;
use crate::machine::Machine;
use crate::part::Part;
use crate::slab::Slab;

/// How heights are searched for.
#[derive(Debug)]
pub struct Search<'a> {
    /// The part.
    pub part: &'a Part,
    /// The machine.
    pub machine: &'a Machine,
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
}

impl Heights {
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

    /// The volume lost, the volume gained and the part's volume, in cubic
    /// millimetres.
    pub fn volumes_mm3(&self) -> [f64; 3] {
        let sum = |of: fn(&Slab) -> f64| self.slabs.iter().map(of).sum::<f64>();
        [sum(|slab| slab.lost_mm3), sum(|slab| slab.gained_mm3), sum(|slab| slab.volume_mm3)]
    }
}

impl Search<'_> {
    /// Finds the layers from the bottom: each the thickest whose measure is at most
    /// `bound`, or the thinnest where none is. They end at the part's top, rounded
    /// to whole steps.
    ///
    /// Thicker layers are not always worse, so all thicknesses are looked at.
    /// Source: 002 section 3.2.3, algorithms 12 and 13, which bisect.
    ///
    /// # Errors
    /// Where the layers would be too many.
    pub fn heights(&self, bound: f64) -> Result<Heights, HeightsError> {
        let found = self.heights_within(bound, |_| f64::NEG_INFINITY, 0.0)?;
        Ok(found.expect("layers that cost nothing are within any budget"))
    }

    /// As [`heights`](Self::heights); `None` once the layers cost more than `most`.
    pub(crate) fn heights_within(
        &self,
        bound: f64,
        cost: impl Fn(f64) -> f64,
        most: f64,
    ) -> Result<Option<Heights>, HeightsError> {
        let [bottom_um, top_um] = self.part.heights_um();
        let step_um = self.machine.step_um();
        let at = |step: usize| bottom_um + step as f64 * step_um;
        let end = ((top_um - bottom_um) / step_um).round().max(1.0);
        if end / *self.machine.steps().start() as f64 > 1e6 {
            return Err(HeightsError::TooHigh { height_mm: (top_um - bottom_um) / 1000.0 });
        }
        let end = end as usize;
        let ends = self.ends(end);
        let (mut step, mut spent, mut slabs) = (0, 0.0, Vec::new());
        while step < end {
            let choices = self.machine.choices(step, &ends);
            let tops: Vec<f64> = choices.iter().map(|choice| at(step + choice)).collect();
            let found = self.part.slabs(at(step), &tops);
            let good = found.iter().rposition(|slab| self.criterion.measure(slab) <= bound);
            let chosen = good.unwrap_or(0);
            step += choices[chosen];
            slabs.push(found[chosen]);
            spent += cost(found[chosen].thickness_um);
            if spent > most {
                return Ok(None);
            }
        }
        Ok(Some(Heights { slabs }))
    }

    /// The heights where layers are to end, in steps: flat faces, rounded down so
    /// that sections lie below them, and the part's top. Faces so close below the
    /// top that no layer fits between are left out.
    fn ends(&self, end: usize) -> Vec<usize> {
        let bottom_um = self.part.heights_um()[0];
        let step_um = self.machine.step_um();
        let mut ends = vec![end];
        if self.snap {
            for face in self.part.flat_faces_um() {
                let steps = ((face - bottom_um) / step_um).floor() as usize;
                let is_above = bottom_um + steps as f64 * step_um > face;
                ends.push(steps.saturating_sub(usize::from(is_above)));
            }
        }
        ends.retain(|step| (1..=end).contains(step) && self.machine.can_fill(end - step));
        ends.sort_unstable();
        ends.dedup();
        ends
    }
}

/// The layers of a part that are all of one thickness, as the slicer has them.
///
/// # Panics
/// Where the thickness is not above zero.
pub fn uniform_heights(part: &Part, thickness_um: f64) -> Heights {
    let [bottom_um, top_um] = part.heights_um();
    let count = ((top_um - bottom_um) / thickness_um).round().max(1.0) as u32;
    let at = |k: u32| bottom_um + f64::from(k) * thickness_um;
    let slab = |k: u32| part.slabs(at(k), &[at(k + 1)])[0];
    Heights { slabs: (0..count).map(slab).collect() }
}
