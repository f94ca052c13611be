//! Finds the most accurate layers within a budget.

use lamp_stack::Length;

use crate::error::HeightsError;
use crate::known::KnownLayers;
use crate::search::{Budget, Climb, HeightSearch, Heights, StepGrid};
use crate::swept_layer::SweptLayer;
use crate::table::HeightTable;

/// The relative precision to which bounds are found.
const PRECISION: f64 = 0.01;

/// The relative precision of guesses, which cost little.
const GUESS_PRECISION: f64 = 0.001;

/// Bounds below this one are rounding.
const NOTHING: f64 = 1e-9;

impl HeightSearch<'_> {
    /// Finds the smallest bound, to one percent, whose layers together cost at most `max`, and
    /// these layers. Each layer is the one within the bound that costs least for its thickness. Of
    /// all ways to place as many layers at the same cost or less, these lose and gain least. `cost`
    /// returns the cost of a layer by its thickness; a cost of 1 counts layers.
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
        let grid = self.grid()?;
        let least = self.least_cost(&grid, budget);
        // Without any bound, layers cost as little as they can.
        if least > max {
            return Err(HeightsError::Budget { least, budget: max });
        }
        let mut known = KnownLayers::new();
        let (bound, climb) = self.smallest_bound(&grid, budget, &mut known);
        Ok((bound, self.placed(&grid, climb, &known, &bound.into(), Some(budget))))
    }

    /// Returns the cost of the layers if no error is too large.
    fn least_cost(&self, grid: &StepGrid<'_>, budget: Budget<'_>) -> f64 {
        let (mut step, mut cost, unbounded) = (0, 0.0, f64::INFINITY.into());
        while step < grid.end() {
            let choices = self.thicknesses.choices(step, grid.ends());
            let layers: Vec<SweptLayer> = choices
                .iter()
                .map(|choice| SweptLayer {
                    thickness_um: grid.at(step + choice) - grid.at(step),
                    ..SweptLayer::default()
                })
                .collect();
            let chosen = self.choose(&layers, &unbounded, Some(budget));
            cost += budget.of(&layers[chosen]);
            step += choices[chosen];
        }
        cost
    }

    /// Finds the smallest bound whose layers are within the budget, and these.
    fn smallest_bound(
        &self,
        grid: &StepGrid<'_>,
        budget: Budget<'_>,
        known: &mut KnownLayers,
    ) -> (f64, Climb) {
        let (mut low, mut found) = self.guessed_bound(grid, budget, known);
        let mut within = |bound: f64| self.climb(grid, &bound.into(), Some(budget), known);
        let was_guessed = found.is_some();
        if low == 0.0
            && !was_guessed
            && let Some(climb) = within(0.0)
        {
            return (0.0, climb);
        }
        let (mut high, mut best) = match found.take() {
            Some(found) => found,
            None => {
                let cheapest = within(f64::INFINITY).expect("its cost was looked at");
                let high = self.worst(&cheapest.heights.layers);
                // The worst error of the cheapest layers is a bound that they keep, unless an error
                // is infinite.
                let Some(climb) = within(high) else { return (f64::INFINITY, cheapest) };
                (high, climb)
            }
        };
        // Steps down that grow, since bounds span decades.
        let mut ratio = if was_guessed { 1.0 + PRECISION } else { 8.0 };
        while high > low * (1.0 + PRECISION) && high > NOTHING {
            // Bounds are positive and span decades: halve their logarithm.
            let middle = if low > 0.0 { f64::sqrt(low * high) } else { high / ratio };
            match within(middle) {
                Some(climb) => (high, best) = (middle, climb),
                None => low = middle,
            }
            ratio = (ratio * ratio).min(8.0);
        }
        (high, best)
    }

    /// Looks at the bounds that facets alone lead to, and then at the one that the first search
    /// leads to, so that few searches are left. Returns a bound that is too small, and one
    /// within the budget with its layers, if they were found.
    fn guessed_bound(
        &self,
        grid: &StepGrid<'_>,
        budget: Budget<'_>,
        known: &mut KnownLayers,
    ) -> (f64, Option<(f64, Climb)>) {
        let (mut low, mut found) = (0.0, None);
        let Some(table) = &grid.table else { return (low, found) };
        // The second guess is close: by aiming a little too high, one search confirms it.
        for aim in [1.0, 1.0 + 0.4 * PRECISION] {
            let bound = aim * self.guess_bound(grid, table, budget, known);
            let high = found.as_ref().map_or(f64::INFINITY, |(high, _)| *high);
            if !(low..high / (1.0 + PRECISION)).contains(&bound) {
                break;
            }
            match self.climb(grid, &bound.into(), Some(budget), known) {
                Some(climb) => found = Some((bound, climb)),
                None => low = bound,
            }
        }
        (low, found)
    }

    /// Guesses the smallest bound within the budget: infinite if no bound is.
    fn guess_bound(
        &self,
        grid: &StepGrid<'_>,
        table: &HeightTable,
        budget: Budget<'_>,
        known: &KnownLayers,
    ) -> f64 {
        let within = |bound: f64| self.guess(grid, table, &bound.into(), budget, known);
        if within(0.0).is_some() {
            return 0.0;
        }
        let Some(cheapest) = within(f64::INFINITY) else { return f64::INFINITY };
        let (mut low, mut high) = (0.0, self.worst(&cheapest));
        if within(high).is_none() {
            return f64::INFINITY;
        }
        while high > low * (1.0 + GUESS_PRECISION) && high > NOTHING {
            let middle = if low > 0.0 { f64::sqrt(low * high) } else { high / 8.0 };
            match within(middle) {
                Some(_) => high = middle,
                None => low = middle,
            }
        }
        high
    }

    /// Returns the greatest finite error of some layers.
    fn worst(&self, layers: &[SweptLayer]) -> f64 {
        let measures = layers.iter().map(|layer| self.criterion.measure(layer));
        measures.filter(|measure| measure.is_finite()).fold(0.0, f64::max)
    }
}
