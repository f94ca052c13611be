//! The curve of the two-depth model, in parameters suited to fitting.

use super::least_squares;

/// `z = ln(1 + k a (E - E_c))/k`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TwoDepthCurve {
    /// `E_c`.
    pub(super) onset: f64,
    /// `ln a`, where `a` is `D_pL/E_c`.
    pub(super) log_rate: f64,
    /// `k`, `1/D_pS`; zero is a straight line.
    pub(super) bend: f64,
}

impl TwoDepthCurve {
    /// Fits the curve of a given bend by linear regression of `(exp(k z) - 1)/k`, which is
    /// `a (E - E_c)`.
    pub(super) fn from_line(data: &[(f64, f64)], bend: f64) -> Option<Self> {
        let straight = |z: f64| if bend > 0.0 { (bend * z).exp_m1() / bend } else { z };
        let n = data.len() as f64;
        let mean_x = data.iter().map(|point| point.0).sum::<f64>() / n;
        let mean_y = data.iter().map(|point| straight(point.1)).sum::<f64>() / n;
        let xx: f64 = data.iter().map(|point| (point.0 - mean_x).powi(2)).sum();
        let xy: f64 = data.iter().map(|point| (point.0 - mean_x) * straight(point.1)).sum();
        let rate = xy / xx;
        let onset = mean_x - mean_y / rate;
        // The curve has to reach the lowest dose.
        let lowest = data.iter().map(|point| point.0).fold(f64::INFINITY, f64::min);
        // 1 + k a (E - E_c) must be above zero at the lowest dose.
        let onset = if bend > 0.0 { onset.min(lowest + 0.5 / (bend * rate)) } else { onset };
        (rate > 0.0).then_some(Self { onset, log_rate: rate.ln(), bend })
    }

    /// Returns the depth of a dose and its derivatives over the three parameters. They are
    /// NaN below the pole of the logarithm.
    pub(super) fn at(&self, dose: f64) -> (f64, [f64; 3]) {
        let (rate, k) = (self.log_rate.exp(), self.bend);
        let u = rate * (dose - self.onset);
        let ku = k * u;
        let grows = 1.0 / (1.0 + ku);
        // Near a straight line the quotients lose their digits: their series has them.
        let (depth, over_bend) = if ku.abs() < 1e-4 {
            (u * (1.0 - ku / 2.0 + ku * ku / 3.0), u * u * (-0.5 + 2.0 / 3.0 * ku))
        } else {
            (ku.ln_1p() / k, (ku * grows - ku.ln_1p()) / (k * k))
        };
        (depth, [-rate * grows, u * grows, over_bend])
    }

    /// Returns the sum of squared residuals; infinite if the curve does not reach a point.
    pub(super) fn squares(&self, data: &[(f64, f64)]) -> f64 {
        let sum: f64 = data.iter().map(|&(dose, z)| (z - self.at(dose).0).powi(2)).sum();
        if sum.is_nan() { f64::INFINITY } else { sum }
    }

    /// Returns the normal equations: the products of the derivatives with each other and
    /// with the residuals.
    pub(super) fn normal(&self, data: &[(f64, f64)]) -> ([[f64; 3]; 3], [f64; 3]) {
        let (mut matrix, mut vector) = ([[0.0; 3]; 3], [0.0; 3]);
        for &(dose, z) in data {
            let (depth, slopes) = self.at(dose);
            for i in 0..3 {
                vector[i] += slopes[i] * (z - depth);
                for j in 0..3 {
                    matrix[i][j] += slopes[i] * slopes[j];
                }
            }
        }
        (matrix, vector)
    }

    /// Improves the parameters until no step helps.
    pub(super) fn fitted(self, data: &[(f64, f64)]) -> Option<Self> {
        least_squares::fitted(
            self,
            |curve| curve.squares(data),
            |curve| curve.normal(data),
            |curve, step: [f64; 3]| Self {
                onset: curve.onset + step[0],
                log_rate: curve.log_rate + step[1],
                // A negative bend would be a solid that adds light.
                bend: (curve.bend + step[2]).max(0.0),
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bend_of_nothing_is_a_line() {
        for bend in [0.0, 1e-9, 1e-6, 9e-7, 2e-6] {
            let curve = TwoDepthCurve { onset: 4.0, log_rate: 3.0, bend };
            let slopes = curve.at(9.0).1;
            let moved = |onset, log_rate, bend: f64| {
                let other = TwoDepthCurve {
                    onset: curve.onset + onset,
                    log_rate: curve.log_rate + log_rate,
                    bend: curve.bend + bend,
                };
                other.at(9.0).0
            };
            let differences = [
                (moved(1e-5, 0.0, 0.0) - moved(-1e-5, 0.0, 0.0)) / 2e-5,
                (moved(0.0, 1e-5, 0.0) - moved(0.0, -1e-5, 0.0)) / 2e-5,
                (moved(0.0, 0.0, 1e-7) - moved(0.0, 0.0, -1e-7)) / 2e-7,
            ];
            for (slope, difference) in slopes.iter().zip(differences) {
                assert!((slope - difference).abs() < 1e-3 * slope.abs(), "{bend}: {slopes:?}");
            }
        }
    }
}
