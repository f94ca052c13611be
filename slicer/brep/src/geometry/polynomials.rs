//! Converts B-spline basis functions to polynomials between knots, for fast evaluation.

use super::spline::{BasisValues, Knots, WeightedPoint, add_times};

/// The highest degree of the polynomials: higher ones would lose precision.
const MAX_DEGREE: usize = 7;

/// The basis functions between each pair of knots, as polynomials.
///
/// The parameter of a piece goes from −1 to 1. There the functions are at least 0 and sum
/// to 1 for any knots, so the coefficients stay small and Horner's scheme is accurate.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PolynomialBasis {
    degree: usize,
    /// The knots of the domain, each once.
    breaks: Vec<f64>,
    pieces: Vec<KnotInterval>,
    /// The coefficients of all functions that are not zero, by interval and power, highest
    /// power first.
    coefficients: Vec<f64>,
    /// For each of the equal parts of the domain, the index of the piece in which the part begins;
    /// then the index of the last piece.
    parts: Vec<u32>,
    parts_per_unit: f64,
}

/// The interval between two knots.
#[derive(Clone, Copy, Debug, PartialEq)]
struct KnotInterval {
    /// The first control point that affects it.
    first: usize,
    middle: f64,
    /// The reciprocal of half its length.
    scale: f64,
}

/// A parameter within its piece.
pub(super) struct LocalParameter {
    pub(super) number: usize,
    /// From −1 to 1.
    pub(super) t: f64,
    /// The derivative of `t` with respect to the parameter.
    pub(super) scale: f64,
}

impl PolynomialBasis {
    /// Returns the polynomials, or `None` for high degrees or knots that are too close.
    pub(super) fn new(knots: &Knots) -> Option<Self> {
        if knots.degree() > MAX_DEGREE {
            return None;
        }
        let breaks = knots.breaks();
        let count = breaks.len() - 1;
        let mut pieces = Vec::with_capacity(count);
        let mut coefficients = Vec::with_capacity(count * (knots.degree() + 1).pow(2));
        for pair in breaks.windows(2) {
            // Halved before adding, so that huge knots do not overflow.
            let (middle, half) = (pair[0] / 2.0 + pair[1] / 2.0, pair[1] / 2.0 - pair[0] / 2.0);
            let span = knots.span(pair[0]);
            pieces.push(KnotInterval { first: span - knots.degree(), middle, scale: 1.0 / half });
            coefficients.extend(polynomials(knots, span, middle, half));
        }
        // As many parts as pieces: between even knots, a part leads straight to its piece.
        let parts_per_unit = count as f64 / (breaks[count] - breaks[0]);
        if pieces.iter().any(|piece| !piece.scale.is_finite()) {
            return None;
        }
        let mut made = Self {
            degree: knots.degree(),
            breaks,
            pieces,
            coefficients,
            parts: Vec::new(),
            parts_per_unit,
        };
        made.parts = made.first_pieces();
        Some(made)
    }

    pub(super) fn degree(&self) -> usize {
        self.degree
    }

    /// Returns the polynomials in a piece of the spline with these control points, highest
    /// power first.
    pub(super) fn summed(&self, piece: usize, points: &[WeightedPoint]) -> Vec<WeightedPoint> {
        let points = &points[self.pieces[piece].first..];
        let size = self.degree + 1;
        let powers = self.coefficients[piece * size * size..].chunks(size).take(size);
        let sum = |shares: &[f64]| {
            let mut sum = [0.0; 4];
            shares.iter().zip(points).for_each(|(by, point)| add_times(&mut sum, point, *by));
            sum
        };
        powers.map(sum).collect()
    }

    pub(super) fn count(&self) -> usize {
        self.pieces.len()
    }

    /// Returns the equal part of the domain in which a parameter lies.
    #[inline(always)]
    fn part(&self, t: f64) -> usize {
        // Parameters before the first, and `NaN`, become 0.
        let part = ((t - self.breaks[0]) * self.parts_per_unit) as usize;
        part.min(self.pieces.len() - 1)
    }

    /// Returns, for each part of the domain, the first piece that does not end before it.
    fn first_pieces(&self) -> Vec<u32> {
        let last = self.pieces.len() - 1;
        let ends: Vec<usize> = self.breaks[1..].iter().map(|&end| self.part(end)).collect();
        let first = |part| ends.partition_point(|&end| end < part).min(last) as u32;
        (0..=last + 1).map(first).collect()
    }

    /// Returns the piece of a parameter; outside the domain, the first or the last.
    #[inline(always)]
    fn find(&self, t: f64) -> usize {
        // Knots and parameters are rounded to parts alike, so the piece is always right.
        let part = self.part(t);
        let (low, high) = (self.parts[part] as usize, self.parts[part + 1] as usize);
        low + self.breaks[low + 1..=high].partition_point(|&knot| knot <= t)
    }

    /// Returns a parameter within its piece. Outside the domain, the first or last piece is
    /// continued.
    #[inline(always)]
    pub(super) fn local(&self, t: f64) -> LocalParameter {
        let number = self.find(t);
        let piece = &self.pieces[number];
        LocalParameter { number, t: (t - piece.middle) * piece.scale, scale: piece.scale }
    }

    /// Returns the basis at `t`; `N` is one more than the degree.
    #[inline(always)]
    pub(super) fn basis<const N: usize>(&self, t: f64) -> BasisValues<N> {
        let place = self.local(t);
        let (values, slopes) = horner(self.powers::<N>(place.number), place.t);
        let slopes = slopes.map(|slope| slope * place.scale);
        BasisValues { first: self.pieces[place.number].first, values, slopes }
    }

    /// Returns the coefficients of a piece.
    #[inline(always)]
    fn powers<const N: usize>(&self, piece: usize) -> &[[f64; N]] {
        self.coefficients[piece * N * N..][..N * N].as_chunks().0
    }
}

/// Evaluates several polynomials of degree 1 or more and their derivatives, highest power
/// first.
#[inline(always)]
pub(super) fn horner<const C: usize>(powers: &[[f64; C]], t: f64) -> ([f64; C], [f64; C]) {
    let (mut values, mut slopes) = (powers[1], powers[0]);
    for c in 0..C {
        values[c] += powers[0][c] * t;
    }
    for power in &powers[2..] {
        for c in 0..C {
            // Horner's scheme of the derivative takes the value before this power is added.
            slopes[c] = slopes[c] * t + values[c];
            values[c] = values[c] * t + power[c];
        }
    }
    (values, slopes)
}

/// Returns the coefficients of the functions between two knots, highest power first, by the
/// recursion of [`Knots::basis`] on polynomials.
fn polynomials(knots: &Knots, span: usize, middle: f64, half: f64) -> Vec<f64> {
    let (degree, k) = (knots.degree(), knots.list());
    let mut functions = vec![vec![1.0]];
    for degree in 1..=degree {
        let mut next = vec![vec![0.0; degree + 1]; degree + 1];
        for (r, function) in functions.iter().enumerate() {
            let (low, high) = (k[span + r + 1 - degree], k[span + r + 1]);
            // The factors of Cox and de Boor's recursion, with the parameter as middle + half t.
            let slope = half / (high - low);
            let falling = [(high - middle) / (high - low), -slope];
            let rising = [(middle - low) / (high - low), slope];
            for (power, by) in function.iter().enumerate() {
                for j in 0..2 {
                    next[r][power + j] += by * falling[j];
                    next[r + 1][power + j] += by * rising[j];
                }
            }
        }
        functions = next;
    }
    let power = |power: usize| functions.iter().map(move |function| function[power]);
    (0..=degree).rev().flat_map(power).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_lie_between_their_knots() {
        // Very uneven knots, so that a part of the domain holds many knots or none.
        let knots = [0.0, 0.0, 1e-9, 2e-9, 3e-9, 0.1, 0.1, 0.3, 0.7, 0.7000001, 5.0, 5.0];
        let pieces = PolynomialBasis::new(&Knots::new(1, knots.to_vec(), 10).unwrap()).unwrap();
        let breaks = &pieces.breaks;
        assert_eq!(breaks.len(), 9);
        for (number, pair) in breaks.windows(2).enumerate() {
            for t in [pair[0], pair[0] / 2.0 + pair[1] / 2.0, pair[1].next_down()] {
                assert_eq!(pieces.find(t), number, "{t}");
            }
        }
        let beyond = [f64::NEG_INFINITY, -1.0, f64::NAN, 5.0, 7.0, f64::INFINITY];
        assert_eq!(beyond.map(|t| pieces.find(t)), [0, 0, 0, 7, 7, 7]);
    }

    #[test]
    fn degrees_that_lose_digits_are_left_out() {
        let knots = |degree: usize| {
            let ends = [0.0, 1.0].map(|end| vec![end; degree + 1]);
            PolynomialBasis::new(&Knots::new(degree, ends.concat(), degree + 1).unwrap())
        };
        assert!(knots(MAX_DEGREE).is_some() && knots(MAX_DEGREE + 1).is_none());
        // The reciprocal of half the length overflows.
        let narrow = Knots::new(1, vec![0.0, 0.0, 1e-310, 1e-310], 2).unwrap();
        assert_eq!(PolynomialBasis::new(&narrow), None);
    }
}
