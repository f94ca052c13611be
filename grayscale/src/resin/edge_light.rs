//! Where lines, gaps and edges cure in light that spreads sideways.

use std::f64::consts::{SQRT_2, TAU};

use lamp_stack::Length;

use super::model::ModelError;
use super::plausible;
use super::spread::Spread;
use super::units::Dose;

/// Light that spreads as a Gaussian, and the dose at the surface from which on it cures.
///
/// A wide edge gets `E/2 erfc(d / √2 σ)` at the distance `d` outside of it, and cures up to where
/// that is `E_c` (002 section 3.4.2.1 for one beam, summed over the pixels beside each other). An
/// edge in the direction of the normal `n` has `σ² = σ_x² n_x² + σ_y² n_y²`, so all edges together
/// move by an ellipse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeLight {
    spread: Spread,
    critical_dose: Dose,
}

impl EdgeLight {
    /// Creates the light of a spread for a resin that cures from `critical_dose` on.
    ///
    /// # Errors
    /// Returns an error if the dose is not above zero.
    pub fn new(spread: Spread, critical_dose: Dose) -> Result<Self, ModelError> {
        plausible::DOSE.check("critical-dose", critical_dose)?;
        Ok(Self { spread, critical_dose })
    }

    /// Returns the dose from which on resin cures.
    pub const fn critical_dose(&self) -> Dose {
        self.critical_dose
    }

    /// Returns how far outside their image edges of wide white cure along x and y, below zero if
    /// inside; `None` for a dose that cures nothing.
    ///
    /// ```
    /// use lamp_grayscale::resin::{Dose, EdgeLight, Spread};
    /// use lamp_stack::Length;
    ///
    /// let [across, along] = [20.0, 30.0].map(Length::from_um);
    /// let spread = Spread::of_scan(across, along, None)?;
    /// let light = EdgeLight::new(spread, Dose::from_mj_per_cm2(15.865_525))?;
    /// // A normal distribution has 15.87 % beyond one standard deviation.
    /// let [x, y] = light.edges(Dose::from_mj_per_cm2(100.0)).unwrap();
    /// assert_eq!([x.um().round(), y.um().round()], [20.0, 30.0]);
    /// # Ok::<(), lamp_grayscale::resin::ModelError>(())
    /// ```
    pub fn edges(&self, dose: Dose) -> Option<[Length; 2]> {
        let threshold = self.critical_dose.mj_per_cm2() / dose.mj_per_cm2();
        let sigmas_away = sigmas_away(threshold)?;
        let edge = |sigma: Length| Length::from_um(sigmas_away * sigma.um());
        Some([self.spread.across(), self.spread.along()].map(edge))
    }
}

/// Returns at how many `σ` outside of a wide edge its light has fallen to a share above zero and
/// below one.
fn sigmas_away(share: f64) -> Option<f64> {
    if !(share > 0.0 && share < 1.0) {
        return None;
    }
    let [mut inside, mut outside] = [-40.0, 40.0];
    loop {
        let middle = f64::midpoint(inside, outside);
        if middle <= inside || middle >= outside {
            return Some(middle);
        }
        // The light falls from white to black.
        if below(-middle) > share { inside = middle } else { outside = middle }
    }
}

/// The width of a line after curing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CuredLineWidth {
    pub(crate) width: f64,
    /// By how much it grows with `σ`.
    pub(crate) by_sigma: f64,
    /// By how much it grows with the threshold; below zero.
    pub(crate) by_threshold: f64,
}

/// Returns how wide a white line of a width cures, in the unit of `σ`: where its light, `(erf((w/2 -
/// x) / √2 σ) + erf((w/2 + x) / √2 σ)) / 2`, is at least `threshold` times white's. `None` if it
/// does not cure. A black gap in white stays open as wide as a line cures whose threshold is one
/// less that threshold.
///
/// `σ` must be above zero.
pub(crate) fn cured_line(drawn: f64, sigma: f64, threshold: f64) -> Option<CuredLineWidth> {
    let ends = |x: f64| [(drawn / 2.0 - x) / sigma, (drawn / 2.0 + x) / sigma];
    // Written so that nothing cancels far outside the line.
    let light = |[near, far]: [f64; 2]| below(near) - below(-far);
    if !(threshold > 0.0 && light(ends(0.0)) > threshold) {
        return None;
    }
    let slope = |[near, far]: [f64; 2]| (density(far) - density(near)) / sigma;
    let (mut inside, mut outside) = (0.0, drawn / 2.0 + 40.0 * sigma);
    let mut x = drawn / 2.0;
    // Newton's steps double the digits, and halving keeps them within bounds.
    for _ in 0..200 {
        let at = ends(x);
        let over = light(at) - threshold;
        if over > 0.0 {
            inside = x;
        } else {
            outside = x;
        }
        let step = x - over / slope(at);
        let next =
            if step > inside && step < outside { step } else { f64::midpoint(inside, outside) };
        let is_found = (next - x).abs() <= 1e-13 * (drawn + sigma);
        x = next;
        if is_found {
            break;
        }
    }
    let at @ [near, far] = ends(x);
    // The place x of one light moves by -(∂light/∂σ) / (∂light/∂x).
    let by_sigma = (near * density(near) + far * density(far)) / sigma / slope(at);
    Some(CuredLineWidth { width: 2.0 * x, by_sigma: 2.0 * by_sigma, by_threshold: 2.0 / slope(at) })
}

/// The share of a normal distribution below a number of standard deviations.
fn below(z: f64) -> f64 {
    0.5 * libm::erfc(-z / SQRT_2)
}

/// The density of the normal distribution.
fn density(z: f64) -> f64 {
    (-0.5 * z * z).exp() / TAU.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The light of a line by its definition: the Gaussians of a thousand slices.
    fn summed(drawn: f64, sigma: f64, x: f64) -> f64 {
        let slices = 4000;
        let slice = |k: i32| {
            let at = drawn * ((f64::from(k) + 0.5) / f64::from(slices) - 0.5);
            (-0.5 * ((x - at) / sigma).powi(2)).exp()
        };
        (0..slices).map(slice).sum::<f64>() * drawn / f64::from(slices) / sigma / TAU.sqrt()
    }

    #[test]
    fn a_line_ends_where_its_summed_light_is_the_threshold() {
        for (drawn, sigma) in [(34.0, 20.0), (50.8, 20.0), (100.0, 7.0), (1000.0, 40.0)] {
            for threshold in [0.05, 0.3, 0.5, 0.7, 0.93] {
                let peak = summed(drawn, sigma, 0.0);
                let Some(cured) = cured_line(drawn, sigma, threshold) else {
                    assert!(peak <= threshold + 1e-6, "{drawn} {sigma} {threshold}");
                    continue;
                };
                let end = summed(drawn, sigma, cured.width / 2.0);
                assert!((end - threshold).abs() < 1e-5, "{drawn} {sigma} {threshold}: {end}");
                // Slopes against differences.
                let step = 1e-5;
                let width = |sigma, threshold| cured_line(drawn, sigma, threshold).unwrap().width;
                let by_sigma =
                    (width(sigma + step, threshold) - width(sigma - step, threshold)) / 2.0 / step;
                let by_threshold =
                    (width(sigma, threshold + step) - width(sigma, threshold - step)) / 2.0 / step;
                assert!((by_sigma - cured.by_sigma).abs() < 1e-4 * (1.0 + by_sigma.abs()));
                let off = by_threshold - cured.by_threshold;
                assert!(off.abs() < 1e-4 * by_threshold.abs(), "{drawn} {sigma} {threshold}");
            }
        }
        assert_eq!(cured_line(20.0, 20.0, 0.5), None);
        assert_eq!(cured_line(20.0, 20.0, f64::NAN), None);
    }

    #[test]
    fn wide_lines_have_wide_edges() {
        for threshold in [0.01, 0.2, 0.5, 0.8] {
            let away = sigmas_away(threshold).unwrap();
            let line = cured_line(900.0, 20.0, threshold).unwrap();
            assert!((line.width - 900.0 - 40.0 * away).abs() < 1e-9, "{threshold}");
        }
        assert_eq!([0.0, 1.0, -1.0, f64::NAN].map(sigmas_away), [None; 4]);
        let light = EdgeLight::new(Spread::NONE, Dose::from_mj_per_cm2(50.0)).unwrap();
        assert_eq!(light.edges(Dose::from_mj_per_cm2(50.0)), None);
        let edges = light.edges(Dose::from_mj_per_cm2(90.0)).unwrap();
        assert_eq!(edges.map(Length::um), [0.0; 2]);
    }
}
