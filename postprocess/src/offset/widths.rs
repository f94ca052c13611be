//! The distances that edges move, by the sizes of places.

/// Distances that edges move inwards, in pixels, by the size of the place.
///
/// ```
/// use lamp_postprocess::Widths;
///
/// assert_eq!(Widths::uniform(1.5).range(), [1.5, 1.5]);
/// let by_size = Widths::by_size(&[20.0, 40.0], |size| size / 20.0);
/// assert_eq!(by_size.range(), [1.0, 2.0]);
/// ```
///
/// # Guarantees
/// Sizes increase. There is one more distance than sizes; the first is for places smaller than
/// all. If there are sizes, no distance is below zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Widths {
    sizes: Vec<f64>,
    by: Vec<f64>,
}

/// The greatest change of distance from one class of sizes to the next, in pixels.
const STEP: f64 = 0.25;
/// The greatest number of classes between two sizes, as each costs as much as one distance.
const MAX_STEPS: f64 = 32.0;

impl Widths {
    /// Returns one distance for all places; outwards if below zero.
    pub fn uniform(inwards: f64) -> Self {
        Self { sizes: Vec::new(), by: vec![inwards] }
    }

    /// Returns the distance `width` for each size, in pixels: that of the first of `sizes` for
    /// smaller places, and that of the last for larger ones.
    ///
    /// Between two of `sizes` the distance changes in steps of up to a quarter of a pixel.
    /// Distances below zero count as zero.
    pub fn by_size(sizes: &[f64], width: impl Fn(f64) -> f64) -> Self {
        let width = |size: f64| width(size).max(0.0);
        let mut widths = Self::uniform(sizes.first().map_or(0.0, |&size| width(size)));
        for pair in sizes.windows(2) {
            let [from, to] = [pair[0], pair[1]];
            let change = (width(to) - width(from)).abs();
            let steps = (change / STEP).ceil().clamp(1.0, MAX_STEPS);
            let size = |step: f64| from + (to - from) * step / steps;
            for step in 0..steps as u32 {
                let step = f64::from(step);
                widths.push(size(step), width(size(step + 0.5)));
            }
        }
        if let Some(&last) = sizes.last() {
            widths.push(last, width(last));
        }
        widths
    }

    /// Adds a class of larger places, unless their edges move like those of the class before.
    fn push(&mut self, size: f64, by: f64) {
        if self.by.last() != Some(&by) {
            self.sizes.push(size);
            self.by.push(by);
        }
    }

    /// Returns the sizes at which classes begin.
    pub(super) fn sizes(&self) -> &[f64] {
        &self.sizes
    }

    /// Returns the distance of each class.
    pub(super) fn by(&self) -> &[f64] {
        &self.by
    }

    /// Returns the least and the greatest distance.
    pub fn range(&self) -> [f64; 2] {
        let least = self.by.iter().copied().fold(f64::INFINITY, f64::min);
        [least, self.by.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// Returns whether no edge moves.
    pub fn are_zero(&self) -> bool {
        self.by.iter().all(|&by| by == 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_two_sizes_it_changes_in_small_steps() {
        let widths = Widths::by_size(&[20.0, 40.0], |size| size / 20.0);
        assert_eq!(widths.sizes(), [20.0, 25.0, 30.0, 35.0, 40.0]);
        assert_eq!(widths.by(), [1.0, 1.125, 1.375, 1.625, 1.875, 2.0]);
        assert_eq!(widths.range(), [1.0, 2.0]);
    }

    #[test]
    fn one_size_is_the_same_for_all() {
        assert_eq!(Widths::by_size(&[20.0], |_| 1.5), Widths::uniform(1.5));
        assert_eq!(Widths::by_size(&[20.0, 30.0], |_| 1.5), Widths::uniform(1.5));
        assert!(Widths::by_size(&[20.0, 30.0], |size| -size).are_zero());
    }
}
