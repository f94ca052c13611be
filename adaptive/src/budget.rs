//! Finds the most accurate layers within a budget.

use lamp_stack::Length;

use crate::error::HeightsError;
use crate::search::{Budget, HeightSearch, Heights};

/// The inverse of the relative precision to which bounds are found.
const PRECISION: f64 = 100.0;

impl HeightSearch<'_> {
    /// Finds the smallest bound, to one percent, whose layers together cost at most
    /// `max`, and these layers. Each is the one that costs least for its thickness among
    /// those within the bound. `cost` returns the cost of a layer by its thickness; a
    /// cost of 1 counts layers.
    ///
    /// The bound is infinite if the budget needs layers whose error is infinite.
    ///
    /// # Errors
    /// Returns an error if layers without any bound cost more, or would be too many.
    pub fn within_budget(
        &self,
        cost: impl Fn(Length) -> f64,
        max: f64,
    ) -> Result<(f64, Heights), HeightsError> {
        let budget = Budget { cost: &cost, max };
        let within = |bound| self.heights_within(bound, Some(budget));
        let free = Budget { max: f64::INFINITY, ..budget };
        let cheapest = self.heights_within(f64::INFINITY, Some(free))?.expect("it may cost all");
        let least = free.of_all(&cheapest.layers);
        if least > max {
            return Err(HeightsError::Budget { least, budget: max });
        }
        if let Some(heights) = within(0.0)? {
            return Ok((0.0, heights));
        }
        let measures = cheapest.layers.iter().map(|layer| self.criterion.measure(layer));
        let mut high = measures.filter(|measure| measure.is_finite()).fold(0.0, f64::max);
        let Some(mut best) = within(high)? else { return Ok((f64::INFINITY, cheapest)) };
        let mut low = 0.0;
        // By ratios once there is a lower limit, since bounds span decades.
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
