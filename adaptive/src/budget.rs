//! The most accurate layers that a budget allows.

use crate::error::HeightsError;
use crate::heights::{Heights, Search};

/// Bounds are found to one part in so many.
const PRECISION: f64 = 100.0;

impl Search<'_> {
    /// Finds the smallest bound, to one percent, whose layers cost at most `most`
    /// together, and these layers. `cost` says what a layer of so many micrometres
    /// costs: one for each where layers are counted.
    ///
    /// # Errors
    /// Where even the thickest layers cost more, or the layers would be too many.
    pub fn within_budget(
        &self,
        cost: impl Fn(f64) -> f64,
        most: f64,
    ) -> Result<(f64, Heights), HeightsError> {
        let thickest = self.heights(f64::INFINITY)?;
        let least = thickest.slabs.iter().map(|slab| cost(slab.thickness_um)).sum();
        if least > most {
            return Err(HeightsError::Budget { least, budget: most });
        }
        if let Some(heights) = self.heights_within(0.0, &cost, most)? {
            return Ok((0.0, heights));
        }
        let measures = thickest.slabs.iter().map(|slab| self.criterion.measure(slab));
        let mut high = measures.filter(|measure| measure.is_finite()).fold(0.0, f64::max);
        let (mut low, mut best) = (0.0, thickest);
        // By ratios, once the bound is known from below.
        while high > low * (1.0 + 1.0 / PRECISION) && high > f64::MIN_POSITIVE {
            let middle = if low > 0.0 { (low * high).sqrt() } else { high / 8.0 };
            match self.heights_within(middle, &cost, most)? {
                Some(heights) => (high, best) = (middle, heights),
                None => low = middle,
            }
        }
        Ok((high, best))
    }
}
