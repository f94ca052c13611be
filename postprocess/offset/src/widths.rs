//! The distances that edges move, by the sizes of features.

/// Distances that edges move inwards, in pixels, by the size of the feature.
///
/// ```
/// use lamp_offset::Widths;
///
/// assert_eq!(Widths::uniform(1.5).range(), [1.5, 1.5]);
/// let by_size = Widths::by_size(&[20.0, 40.0], |size| size / 20.0);
/// assert_eq!(by_size.range(), [1.0, 2.0]);
/// ```
///
/// # Guarantees
/// There is a size; sizes increase. If there is more than one, no distance is below zero. Distances
/// along x and y that differ are of one size, and not on both sides of zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Widths {
    /// Sizes, and the distance of each.
    points: Vec<[f64; 2]>,
    /// The distances along x and y, if they differ.
    ellipse: Option<[f64; 2]>,
}

/// The straight lines that stand for the distances between two sizes.
const LINES: u32 = 32;

impl Widths {
    /// Returns one distance for all places; outwards if below zero.
    pub fn uniform(inwards: f64) -> Self {
        Self { points: vec![[0.0, inwards]], ellipse: None }
    }

    /// Returns distances along x and y for all places, between which edges at an angle move by an
    /// ellipse; outwards if below zero. Of distances on both sides of zero, the one below counts as
    /// zero.
    ///
    /// ```
    /// use lamp_offset::Widths;
    ///
    /// assert_eq!(Widths::elliptic([1.5, 2.5]).range(), [1.5, 2.5]);
    /// assert_eq!(Widths::elliptic([1.5, 1.5]), Widths::uniform(1.5));
    /// ```
    pub fn elliptic(inwards: [f64; 2]) -> Self {
        let [x, y] = if inwards.iter().any(|by| *by > 0.0) {
            inwards.map(|by| by.max(0.0))
        } else {
            inwards
        };
        Self { ellipse: (x != y).then_some([x, y]), ..Self::uniform(x) }
    }

    /// Returns the distances along x and y, if they differ.
    pub(super) fn ellipse(&self) -> Option<[f64; 2]> {
        self.ellipse
    }

    /// Returns the distance `width` for each size, in pixels, between the first and the last of
    /// `sizes`: smooth between two of these. Smaller features move like features of the first size,
    /// larger ones like features of the last.
    ///
    /// Distances below zero count as zero.
    pub fn by_size(sizes: &[f64], width: impl Fn(f64) -> f64) -> Self {
        let mut points = Vec::new();
        let mut push = |size: f64| points.push([size, width(size).max(0.0)]);
        sizes.first().into_iter().for_each(|&size| push(size));
        // Equal sizes would make `at` divide by zero.
        for pair in sizes.windows(2).filter(|pair| pair[0] < pair[1]) {
            let share = |line: u32| f64::from(line) / f64::from(LINES);
            (1..=LINES).for_each(|line| push(pair[0] + share(line) * (pair[1] - pair[0])));
        }
        if points.is_empty() { Self::uniform(0.0) } else { Self { points, ellipse: None } }
    }

    /// Returns the distance for features of a size.
    pub(super) fn at(&self, size: f64) -> f64 {
        let next = self.points.partition_point(|point| point[0] <= size);
        let [Some(&[from, low]), Some(&[to, high])] =
            [next.checked_sub(1).and_then(|before| self.points.get(before)), self.points.get(next)]
        else {
            return self.points[next.min(self.points.len() - 1)][1];
        };
        low + (size - from) / (to - from) * (high - low)
    }

    /// Returns the size from which on all features move alike.
    pub(super) fn largest_size(&self) -> f64 {
        self.points[self.points.len() - 1][0]
    }

    /// Returns the least and the greatest distance.
    pub fn range(&self) -> [f64; 2] {
        let by =
            || self.points.iter().map(|point| point[1]).chain(self.ellipse.into_iter().flatten());
        [by().fold(f64::INFINITY, f64::min), by().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// Returns whether no edge moves.
    pub fn are_zero(&self) -> bool {
        self.range() == [0.0, 0.0]
    }

    /// Returns whether all features move alike.
    pub(super) fn are_uniform(&self) -> bool {
        let [least, most] = self.range();
        least == most
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_sizes_it_changes_smoothly() {
        let widths = Widths::by_size(&[20.0, 40.0, 100.0], |size| (size / 20.0).powi(2));
        for (size, by) in [(0.0, 1.0), (20.0, 1.0), (33.0, 2.7225), (77.0, 14.8225), (400.0, 25.0)]
        {
            assert!((widths.at(size) - by).abs() < 0.003, "{size}");
        }
        assert_eq!((widths.largest_size(), widths.range()), (100.0, [1.0, 25.0]));
        assert!(!widths.are_uniform());
    }

    #[test]
    fn one_size_is_the_same_for_all() {
        for widths in [Widths::by_size(&[20.0], |_| 1.5), Widths::by_size(&[20.0, 30.0], |_| 1.5)] {
            assert!(widths.are_uniform() && !widths.are_zero());
            assert_eq!([0.0, 20.0, 25.0, 90.0].map(|size| widths.at(size)), [1.5; 4]);
        }
        assert!(Widths::by_size(&[20.0, 30.0], |size| -size).are_zero());
        assert!(Widths::by_size(&[], |size| size).are_zero());
    }
}
