//! Converts B-spline surfaces to polynomials along v, for fast evaluation.

use super::polynomials::{PolynomialBasis, horner};
use super::spline::{Knots, WeightedPoint};
use crate::kernel::Jet;
use crate::vector::Vec3;

/// A surface as polynomials along v, and the basis along u.
///
/// They take up to (degree of v + 1) times the memory of the control points. Polynomials
/// along both parameters would be faster but multiply that by (degree of u + 1).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PolynomialStrips {
    u: PolynomialBasis,
    v: PolynomialBasis,
    /// The number of control points along u.
    rows: usize,
    /// The coefficients, by piece along v, row of control points, and power, highest first.
    powers: Vec<WeightedPoint>,
    /// Whether weights differ from 1.
    is_rational: bool,
}

impl PolynomialStrips {
    /// Returns the strips, or `None` for high degrees.
    pub(super) fn new(u: &Knots, v: &Knots, points: &[WeightedPoint]) -> Option<Self> {
        let is_rational = points.iter().any(|point| point[3] != 1.0);
        let (rows, columns) = (u.count(), v.count());
        let (u, v) = (PolynomialBasis::new(u)?, PolynomialBasis::new(v)?);
        let mut powers = Vec::with_capacity(v.count() * rows * (v.degree() + 1));
        for piece in 0..v.count() {
            points.chunks(columns).for_each(|row| powers.extend(v.summed(piece, row)));
        }
        Some(Self { u, v, rows, powers, is_rational })
    }

    /// Evaluates many parameters at once.
    pub(super) fn evaluate(&self, uv: &[[f64; 2]], jets: &mut [Jet]) {
        match self.u.degree() {
            1 => self.along_v::<2>(uv, jets),
            2 => self.along_v::<3>(uv, jets),
            3 => self.along_v::<4>(uv, jets),
            4 => self.along_v::<5>(uv, jets),
            5 => self.along_v::<6>(uv, jets),
            6 => self.along_v::<7>(uv, jets),
            // `PolynomialBasis::new` refuses degrees above 7.
            _ => self.along_v::<8>(uv, jets),
        }
    }

    /// Evaluates with `M` and `N`, each one more than a degree: loops of constant length are fast.
    fn along_v<const M: usize>(&self, uv: &[[f64; 2]], jets: &mut [Jet]) {
        match self.v.degree() {
            1 => self.each::<M, 2>(uv, jets),
            2 => self.each::<M, 3>(uv, jets),
            3 => self.each::<M, 4>(uv, jets),
            4 => self.each::<M, 5>(uv, jets),
            5 => self.each::<M, 6>(uv, jets),
            6 => self.each::<M, 7>(uv, jets),
            _ => self.each::<M, 8>(uv, jets),
        }
    }

    fn each<const M: usize, const N: usize>(&self, uv: &[[f64; 2]], jets: &mut [Jet]) {
        for (jet, uv) in jets.iter_mut().zip(uv) {
            let sums = self.sums::<M, N>(*uv);
            *jet = if self.is_rational { divided(&sums) } else { plain(&sums) };
        }
    }

    /// Returns the point and the derivatives along u and v, all with weights.
    #[inline(always)]
    fn sums<const M: usize, const N: usize>(&self, [u, v]: [f64; 2]) -> [WeightedPoint; 3] {
        let (along_u, along_v) = (self.u.basis::<M>(u), self.v.local(v));
        let first = (along_v.number * self.rows + along_u.first) * N;
        let (rows, _) = self.powers[first..][..M * N].as_chunks::<N>();
        let mut sums = [[0.0; 4]; 3];
        for (i, row) in rows.iter().enumerate() {
            let (value, slope) = horner(row, along_v.t);
            for c in 0..4 {
                sums[0][c] += value[c] * along_u.values[i];
                sums[1][c] += value[c] * along_u.slopes[i];
                sums[2][c] += slope[c] * along_u.values[i];
            }
        }
        let [point, du, dv] = sums;
        [point, du, dv.map(|slope| slope * along_v.scale)]
    }
}

fn position([x, y, z, _]: WeightedPoint) -> Vec3 {
    [x, y, z]
}

#[inline(always)]
fn plain(sums: &[WeightedPoint; 3]) -> Jet {
    let [point, du, dv] = sums.map(position);
    Jet { point, du, dv }
}

/// Divides by the weight, with derivatives by the quotient rule.
#[inline(always)]
fn divided(sums: &[WeightedPoint; 3]) -> Jet {
    // One division instead of nine.
    let per_weight = 1.0 / sums[0][3];
    let point = position(sums[0]).map(|x| x * per_weight);
    let slope = |d: WeightedPoint| [0, 1, 2].map(|k| (d[k] - d[3] * point[k]) * per_weight);
    Jet { point, du: slope(sums[1]), dv: slope(sums[2]) }
}
