//! The most accurate layers that a budget allows.

use crate::error::HeightsError;
use crate::search::{Budget, HeightSearch, Heights};

/// Bounds are found to one part in so many.
const PRECISION: f64 = 100.0;

impl HeightSearch<'_> {
    /// Finds the smallest bound, to one percent, whose layers cost at most `most`
    /// together, and these layers: each costs least for its thickness among those
    /// within the bound. `cost` says what a layer of so many micrometres costs: one
    /// for each where layers are counted.
    ///
    /// The bound is infinite where layers keep the budget only if some may be as far
    /// off as they like.
    ///
    /// # Errors
    /// Where layers without any bound cost more, or would be too many.
    pub fn within_budget(
        &self,
        cost: impl Fn(f64) -> f64,
        most: f64,
    ) -> Result<(f64, Heights), HeightsError> {
        let budget = Budget { cost: &cost, most };
        let within = |bound| self.heights_within(bound, Some(budget));
        let free = Budget { most: f64::INFINITY, ..budget };
        let cheapest = self.heights_within(f64::INFINITY, Some(free))?.expect("it may cost all");
        let least = free.of_all(&cheapest.slabs);
        if least > most {
            return Err(HeightsError::Budget { least, budget: most });
        }
        if let Some(heights) = within(0.0)? {
            return Ok((0.0, heights));
        }
        let measures = cheapest.slabs.iter().map(|slab| self.criterion.measure(slab));
        let mut high = measures.filter(|measure| measure.is_finite()).fold(0.0, f64::max);
        let Some(mut best) = within(high)? else { return Ok((f64::INFINITY, cheapest)) };
        let mut low = 0.0;
        // By ratios, once the bound is known from below.
        while high > low * (1.0 + 1.0 / PRECISION) && high > f64::MIN_POSITIVE {
            let middle = if low > 0.0 { f64::sqrt(low * high) } else { high / 8.0 };
            match within(middle)? {
                Some(heights) => (high, best) = (middle, heights),
                None => low = middle,
            }
        }
        Ok((high, best))
    }
}
