//! Fits the working curve to measured cure depths.

use lamp_stack::Length;

use super::extent::Extent;
use super::measurements::DepthPoint;
use super::regression::LineFit;
use super::{Estimate, FitError};
use crate::material::CurveNumbers;
use crate::resin::{Dose, plausible};

/// A working curve found from measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveFit {
    /// `E_c`, where the line meets depth zero.
    pub critical_dose: Estimate<Dose>,
    /// `D_p`, the line's slope.
    pub penetration_depth: Estimate<Length>,
    /// The share of the depths' scatter that the line explains.
    pub r2: f64,
    /// The number of points.
    pub points: usize,
    extent: Option<Extent>,
    line: LineFit,
}

/// Fits the working curve `C_d = D_p ln(E/E_c)` by linear regression of the depth
/// on the logarithm of the dose that arrives (002 section 3.3.5).
///
/// The interval of `D_p` is the slope's, by Student's t; the interval of `E_c` comes from Fieller's
/// theorem, and is not symmetric.
///
/// # Errors
/// Returns an error if there are fewer than three points or two doses, if the depth does
/// not clearly rise with the dose, or if the critical dose is not plausible.
pub fn fit_curve(points: &[DepthPoint]) -> Result<CurveFit, FitError> {
    let log = |p: &DepthPoint| (p.arriving().mj_per_cm2().ln(), p.depth.um());
    let logs: Vec<_> = points.iter().map(log).collect();
    let line = LineFit::new(&logs)?.rising("um for each e-fold of dose")?;
    // 002 eq. 30 over ln E is a line of slope D_p that meets zero at ln E_c.
    let [value, low, high] = line.zero().map(f64::exp);
    if !plausible::DOSE.contains(&Dose::from_mj_per_cm2(value)) {
        return Err(FitError::NoCriticalDose(value));
    }
    Ok(CurveFit {
        critical_dose: Estimate::new(value, low, high),
        penetration_depth: Estimate::even(line.slope, line.slope_half()),
        r2: line.r2,
        points: points.len(),
        extent: Extent::of_depths(points),
        line,
    })
}

impl CurveFit {
    /// Returns the depth of a dose that arrives, with its 95% interval. It is below zero up
    /// to the critical dose.
    pub fn depth(&self, dose: Dose) -> Estimate<Length> {
        let log = dose.mj_per_cm2().ln();
        Estimate::even(self.line.at(log), self.line.half_at(log))
    }

    /// Returns the numbers for a material file.
    pub fn numbers(&self, source: &str) -> CurveNumbers {
        CurveNumbers {
            critical_dose: self.critical_dose.given(source),
            penetration_depth: self.penetration_depth.given(source),
            measured: self.extent.map(|extent| extent.measured(source)),
        }
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::SplitMix;

    use super::super::made_up::{depth_points, share_held};
    use super::*;
    use crate::resin::{CureModel, WorkingCurve};

    const DOSES: [f64; 6] = [320.0, 480.0, 640.0, 960.0, 1280.0, 1920.0];

    fn lamp() -> WorkingCurve {
        WorkingCurve::new(Dose::from_mj_per_cm2(131.5), Length::from_um(211.0)).unwrap()
    }

    #[test]
    fn exact_points_give_the_curve_back() {
        let fit = fit_curve(&depth_points(&lamp(), &DOSES, |_| 0.0)).unwrap();
        assert!((fit.critical_dose.value.mj_per_cm2() - 131.5).abs() < 1e-9);
        assert!((fit.penetration_depth.value.um() - 211.0).abs() < 1e-9);
        assert!(fit.r2 > 1.0 - 1e-12 && fit.points == 6);
        assert!(fit.critical_dose.plus_minus().mj_per_cm2() < 1e-6);
        let dose = Dose::from_mj_per_cm2(500.0);
        assert!((fit.depth(dose).value.um() - lamp().depth(dose).um()).abs() < 1e-9);
    }

    #[test]
    fn of_100_intervals_95_hold_the_truth() {
        // Depths to 5 um as in 002 section 3.3.5, and far coarser ones, for which the
        // interval of E_c is lopsided.
        for spread in [5.0, 40.0] {
            let mut noise = SplitMix(7);
            let fits = std::iter::from_fn(|| {
                Some(fit_curve(&depth_points(&lamp(), &DOSES, |_| spread * noise.normal())))
            });
            let held = share_held(fits.take(4000), |fit| {
                let ec = fit.critical_dose.holds(Dose::from_mj_per_cm2(131.5));
                [ec, fit.penetration_depth.holds(Length::from_um(211.0))]
            });
            // 95% +- 1% is three standard deviations of 4000 trials.
            assert!(held.iter().all(|share| (share - 0.95).abs() < 0.0104), "{spread}: {held:?}");
        }
    }

    #[test]
    fn a_critical_dose_that_no_resin_has_is_refused() {
        let errors = [0.001, -0.001, 0.001, -0.001, 0.001, -0.001];
        let rows = DOSES.iter().zip(errors).map(|(&mj, error)| DepthPoint {
            gray: crate::resin::GrayLevel::WHITE,
            dose: Dose::from_mj_per_cm2(mj),
            depth: Length::from_um(100.0 + 0.01 * mj.ln() + error),
        });
        let error = fit_curve(&rows.collect::<Vec<_>>()).unwrap_err();
        assert!(matches!(error, FitError::NoCriticalDose(_)), "{error}");
    }

    #[test]
    fn intervals_reach_farther_with_more_scatter_and_fewer_points() {
        let half = |doses: &[f64], spread: f64| {
            let mut noise = SplitMix(3);
            let fit = fit_curve(&depth_points(&lamp(), doses, |_| spread * noise.normal()));
            fit.unwrap().penetration_depth.plus_minus().um()
        };
        assert!(half(&DOSES, 10.0) > 1.9 * half(&DOSES, 5.0));
        assert!(half(&DOSES, 5.0) > half(&DOSES.repeat(10), 5.0));
    }
}
