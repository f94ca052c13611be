//! The greatest of the numbers that are given for ranges.

use std::ops::Range;

/// For each place, the greatest number of all ranges that hold it. A range costs as much as two
/// places, however long it is.
#[derive(Debug)]
pub(crate) struct RangeMax {
    /// The greatest known number of the 2^k places from each on.
    levels: Vec<Vec<f64>>,
}

impl RangeMax {
    /// Creates places with the number 0.
    pub(crate) fn new(count: usize) -> Self {
        Self { levels: vec![vec![0.0; count]] }
    }

    /// Raises the numbers of the places of a range to at least `number`.
    ///
    /// # Panics
    /// Panics if the range is empty, or not within the places.
    pub(crate) fn raise(&mut self, range: Range<usize>, number: f64) {
        let level = range.len().ilog2() as usize;
        while self.levels.len() <= level {
            self.levels.push(vec![0.0; self.levels[0].len()]);
        }
        // Two ranges of the same power of two cover any range; that they overlap does not matter to
        // a greatest number.
        for place in [range.start, range.end - (1 << level)] {
            let known = &mut self.levels[level][place];
            *known = known.max(number);
        }
    }

    /// Returns the number of each place.
    pub(crate) fn finish(mut self) -> Vec<f64> {
        while let Some(upper) = self.levels.pop() {
            let half = 1 << self.levels.len().saturating_sub(1);
            let Some(lower) = self.levels.last_mut() else { return upper };
            for (place, number) in upper.into_iter().enumerate().filter(|(_, number)| *number > 0.0)
            {
                // A number of 2^k places is one of both halves.
                for place in [place, place + half] {
                    lower[place] = lower[place].max(number);
                }
            }
        }
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_raise_their_places() {
        let ranges = [(3..4, 0.5), (0..20, 0.1), (5..16, 0.7), (10..13, 0.2), (12..20, 0.6)];
        let mut max = RangeMax::new(20);
        ranges.iter().for_each(|(range, number)| max.raise(range.clone(), *number));
        let of = |place: usize| {
            let of_place = ranges.iter().filter(|(range, _)| range.contains(&place));
            of_place.map(|(_, number)| *number).fold(0.0, f64::max)
        };
        assert_eq!(max.finish(), (0..20).map(of).collect::<Vec<_>>());
    }
}
