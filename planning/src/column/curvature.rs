//! The second derivatives of the squared differences between doses and the wanted doses.

use super::light::{GlassLight, product};
use super::taps::Taps;
use crate::numeric::CurvatureMatrix;

/// The product of H's transpose with H, or its mean over shifts: a matrix for each axis.
pub(super) struct Normal<'a> {
    light: &'a GlassLight,
    taps: [Taps; 2],
}

impl<'a> Normal<'a> {
    /// Creates the mean of the products for `light` shifted by each of some lengths along x, and by
    /// each of them along y.
    pub(super) fn mean(light: &'a GlassLight, shifts_um: &[f64]) -> Self {
        let shifted: Vec<_> = shifts_um.iter().map(|&um| light.shifted([um; 2])).collect();
        let mean = |axis: usize| {
            let normals: Vec<_> = shifted.iter().map(|light| light.taps()[axis].normal()).collect();
            Taps::mean(&normals)
        };
        Self { light, taps: [mean(0), mean(1)] }
    }
}

impl CurvatureMatrix for Normal<'_> {
    fn apply(&self, mirrors: &[f64]) -> Vec<f64> {
        let square = self.light.setup().irradiance.powi(2);
        let mut weighed: Vec<_> = mirrors.iter().map(|number| number * square).collect();
        self.light.weigh(&mut weighed);
        let mut out = product(&self.taps, &weighed);
        self.light.weigh(&mut out);
        out
    }
}

/// A matrix with a number added along its diagonal, which makes numbers small and even (A. N. Tikhonov,
/// Soviet Math. Dokl. 4 (1963)).
pub(super) struct Even<'a, C> {
    pub(super) of: &'a C,
    pub(super) evenness: f64,
}

impl<C: CurvatureMatrix> CurvatureMatrix for Even<'_, C> {
    fn apply(&self, numbers: &[f64]) -> Vec<f64> {
        let mut product = self.of.apply(numbers);
        product.iter_mut().zip(numbers).for_each(|(out, number)| *out += self.evenness * number);
        product
    }

    fn least(&self) -> f64 {
        self.of.least() + self.evenness
    }
}

/// The sum of these products over some lights, with a weight for each column voxel.
pub(super) struct Weighted<'a> {
    pub(super) lights: &'a [GlassLight],
    pub(super) weights: &'a [&'a [f64]],
}

impl CurvatureMatrix for Weighted<'_> {
    fn apply(&self, mirrors: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; mirrors.len()];
        for (light, weights) in self.lights.iter().zip(self.weights) {
            let mut doses = light.doses(mirrors);
            doses.iter_mut().zip(*weights).for_each(|(dose, weight)| *dose *= weight);
            let back = light.back(&doses);
            sum.iter_mut().zip(back).for_each(|(sum, back)| *sum += back);
        }
        sum
    }
}
