//! Thicknesses that a machine builds, and where layers of them may end.

use std::ops::RangeInclusive;

use lamp_stack::Length;

use crate::error::HeightsError;

/// With more, the step is a mistake.
const MAX_THICKNESSES: f64 = 10_000.0;

/// Thicknesses that a machine builds: whole steps between limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Thicknesses {
    step_um: f64,
    steps: RangeInclusive<usize>,
}

impl Thicknesses {
    /// Creates the thicknesses from `min` to `max` that are whole steps.
    ///
    /// ```
    /// use lamp_adaptive::Thicknesses;
    /// use lamp_stack::Length;
    ///
    /// let [min, max, step] = [30.0, 100.0, 20.0].map(Length::from_um);
    /// assert_eq!(Thicknesses::new(min, max, step)?.step(), step); // 40, 60, 80 and 100 um
    /// assert!(Thicknesses::new(max, min, step).is_err());
    /// # Ok::<(), lamp_adaptive::HeightsError>(())
    /// ```
    ///
    /// # Errors
    /// Returns an error if there is no thickness, or there are more than a search tries.
    pub fn new(min: Length, max: Length, step: Length) -> Result<Self, HeightsError> {
        let [min_um, max_um, step_um] = [min, max, step].map(Length::um);
        // Limits that are whole steps may miss them by rounding.
        let first = (min_um / step_um - 1e-6).ceil().max(1.0);
        let last = (max_um / step_um + 1e-6).floor();
        // Negated, so that a step of NaN fails, too.
        if !(step_um > 0.0 && min_um > 0.0 && first <= last && last.is_finite()) {
            return Err(HeightsError::NoThickness { min, max, step });
        }
        if last > MAX_THICKNESSES {
            let min_step = Length::from_um(max_um / MAX_THICKNESSES);
            let count = (last - first) as usize + 1;
            return Err(HeightsError::TooManySteps { count, step, min_step });
        }
        Ok(Self { step_um, steps: first as usize..=last as usize })
    }

    /// Returns the step between thicknesses.
    pub fn step(&self) -> Length {
        Length::from_um(self.step_um)
    }

    /// Returns the thicknesses, in steps.
    pub(crate) fn steps(&self) -> RangeInclusive<usize> {
        self.steps.clone()
    }

    /// Returns true if layers can fill a height, in steps, exactly.
    pub(crate) fn can_fill(&self, steps: usize) -> bool {
        // As few layers as the thickest allow fill it, unless even their thinnest are too thick.
        steps.div_ceil(*self.steps.end()) * self.steps.start() <= steps
    }

    /// Returns the thicknesses that a layer may have at `bottom`, below the next of `ends`, where
    /// layers are to end. After each of them, layers can fill the rest. Ends that cannot be reached
    /// are skipped. The last one, where the part ends, is then exceeded by as little as possible.
    /// All are in steps.
    pub(crate) fn choices(&self, bottom: usize, ends: &[usize]) -> Vec<usize> {
        let ahead = &ends[ends.partition_point(|&end| end <= bottom)..];
        let reached = ahead.iter().find(|&&end| self.can_fill(end - bottom));
        let Some(end) = reached.or(ahead.last()) else { return self.steps().collect() };
        let room = end - bottom;
        // Far below the end, all may be filled.
        if self.all_fill_from().is_some_and(|from| room >= self.steps.end() + from) {
            return self.steps().collect();
        }
        // A choice must not make the end worse than it has to be.
        let beyond = self.least_beyond(room);
        let leads_on = |step: &usize| match room.checked_sub(*step) {
            Some(rest) => self.least_beyond(rest) == beyond,
            None => step - room == beyond,
        };
        self.steps().filter(leads_on).collect()
    }

    /// Returns a height in steps from which on layers can fill any, if there is one.
    fn all_fill_from(&self) -> Option<usize> {
        let (start, end) = (self.steps.start(), self.steps.end());
        // From here on, the ranges of so many layers and of one more meet.
        let count = (start - 1).div_ceil((end - start).max(1)).max(1);
        (end > start || *start == 1).then_some(count * start)
    }

    /// Returns the least excess, in steps, of layers that cover a height.
    fn least_beyond(&self, steps: usize) -> usize {
        (steps.div_ceil(*self.steps.end()) * self.steps.start()).saturating_sub(steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thicknesses(min: f64, max: f64, step: f64) -> Result<Thicknesses, HeightsError> {
        let [min, max, step] = [min, max, step].map(Length::from_um);
        Thicknesses::new(min, max, step)
    }

    #[test]
    fn thicknesses_are_whole_steps() {
        assert_eq!(thicknesses(25.0, 100.0, 1.0).unwrap().steps(), 25..=100);
        assert_eq!(thicknesses(25.4, 2540.0, 25.4).unwrap().steps(), 1..=100);
        assert_eq!(thicknesses(30.0, 100.0, 20.0).unwrap().steps(), 2..=5);
        for (min, max, step) in
            [(50.0, 25.0, 1.0), (41.0, 59.0, 20.0), (1.0, 2.0, 0.0), (f64::NAN, 9.0, 1.0)]
        {
            assert!(thicknesses(min, max, step).is_err(), "{min} {max} {step}");
        }
        assert!(matches!(thicknesses(1.0, 1e6, 1.0), Err(HeightsError::TooManySteps { .. })));
    }

    #[test]
    fn layers_leave_room_for_the_rest() {
        let thicknesses = thicknesses(3.0, 10.0, 1.0).unwrap();
        assert_eq!(thicknesses.choices(0, &[100]), (3..=10).collect::<Vec<_>>());
        // Two steps could not be filled.
        assert_eq!(thicknesses.choices(0, &[12]), [3, 4, 5, 6, 7, 8, 9]);
        assert_eq!(thicknesses.choices(0, &[7]), [3, 4, 7]);
        assert_eq!(thicknesses.choices(0, &[5]), [5]);
        // The first end cannot be reached, the second can.
        assert_eq!(thicknesses.choices(10, &[5, 10, 12, 15]), [5]);
        assert_eq!(thicknesses.choices(10, &[12, 100]), (3..=10).collect::<Vec<_>>());
        assert_eq!(thicknesses.choices(10, &[12]), [3]);
        assert_eq!(thicknesses.choices(10, &[]), (3..=10).collect::<Vec<_>>());
    }

    #[test]
    fn layers_exceed_the_last_end_by_as_little_as_possible() {
        let thicknesses = thicknesses(60.0, 100.0, 1.0).unwrap();
        // Two of 60 are nearer to 110 than one of 100 and one of 60.
        assert_eq!(thicknesses.choices(0, &[110]), [60]);
        assert_eq!(thicknesses.choices(60, &[110]), [60]);
        assert_eq!(thicknesses.choices(0, &[119]), [60]);
        assert_eq!(thicknesses.choices(0, &[50, 110]), [60]);
    }

    #[test]
    fn narrow_limits_leave_gaps() {
        for (min, max, from) in
            [(6.0, 10.0, 12), (25.0, 100.0, 25), (10.0, 11.0, 90), (1.0, 1.0, 1)]
        {
            let thicknesses = thicknesses(min, max, 1.0).unwrap();
            assert_eq!(thicknesses.all_fill_from(), Some(from));
            assert!((from..500).all(|steps| thicknesses.can_fill(steps)));
            assert!(from == 1 || !thicknesses.can_fill(from - 1));
        }
        assert_eq!(thicknesses(5.0, 5.0, 1.0).unwrap().all_fill_from(), None);
        let thicknesses = thicknesses(6.0, 10.0, 1.0).unwrap();
        assert!(!thicknesses.can_fill(11) && thicknesses.can_fill(12) && thicknesses.can_fill(0));
        assert_eq!(thicknesses.choices(0, &[17]), [7, 8, 9, 10]);
    }
}
