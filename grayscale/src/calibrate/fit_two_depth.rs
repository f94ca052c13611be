//! Fits the two-depth model to measured cure depths.

use lamp_stack::Length;

use super::extent::Extent;
use super::matrix::{dot, inverse, product};
use super::measurements::DepthPoint;
use super::student_t::t_95;
use super::two_depth_curve::TwoDepthCurve;
use super::{Estimate, FitError};
use crate::material::TwoDepthNumbers;
use crate::resin::Dose;

/// A two-depth model found from measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoDepthFit {
    /// `E_c`.
    pub critical_dose: Estimate<Dose>,
    /// `D_pL`.
    pub liquid_depth: Estimate<Length>,
    /// `D_pS`. If the points lie on a straight line over the dose or bend the other way, it
    /// is 10 000 times the deepest point; larger values make no difference.
    pub solid_depth: Estimate<Length>,
    /// Whether the points are straight or bend the other way.
    pub straight: bool,
    /// The share of the depths' scatter that the curve explains.
    pub r2: f64,
    /// The number of points.
    pub points: usize,
    extent: Option<Extent>,
    curve: TwoDepthCurve,
    /// The parameters' covariance, times the square of Student's t.
    spread: [[f64; 3]; 3],
}

/// The penetration depth of a solid, in times the deepest point, from which on it changes
/// depths by less than a 20 000th.
const CLEAR: f64 = 1e4;

/// Fits `z = D_pS ln(D_pL/D_pS (E/E_c - 1) + 1)` (000 eq. 3.8, 003 eq. 2) by
/// nonlinear least squares (Levenberg and Marquardt).
///
/// It is fitted in `E_c`, the initial slope `D_pL/E_c` and the bend `1/D_pS`, in which it
/// is nearest to linear. Intervals come from their covariance, by Student's t: directly for
/// `E_c`, on a logarithmic scale for `D_pL`, and over the inverse for `D_pS`, so that the
/// interval has no upper end if the solid may be clear.
///
/// # Errors
/// Returns an error if there are fewer than four points or three doses, the depth does not rise
/// with the dose, no positive numbers fit, or the interval of `E_c` or `D_pL`
/// reaches zero.
pub fn fit_two_depth(points: &[DepthPoint]) -> Result<TwoDepthFit, FitError> {
    let data: Vec<_> = points.iter().map(|p| (p.arriving().mj_per_cm2(), p.depth.um())).collect();
    check(&data)?;
    let deepest = data.iter().map(|point| point.1).fold(0.0, f64::max);
    // The squares may have several least values over the bend: searches start from a straight line
    // and from curves that bend up to ten times over the deepest point.
    let bends = [0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0].map(|times| times / deepest);
    let fits =
        bends.iter().filter_map(|&bend| TwoDepthCurve::from_line(&data, bend)?.fitted(&data));
    let best = fits.min_by(|a, b| a.squares(&data).total_cmp(&b.squares(&data)));
    let curve = best.filter(|curve| curve.onset > 0.0).ok_or(FitError::NoFit)?;
    let fit = TwoDepthFit::of(curve, &data, deepest).ok_or(FitError::NoFit)?;
    TwoDepthFit { extent: Extent::of_depths(points), ..fit }.above_zero()
}

fn check(data: &[(f64, f64)]) -> Result<(), FitError> {
    if data.len() < 4 {
        return Err(FitError::TooFew { points: data.len(), needed: 4 });
    }
    let mut doses: Vec<f64> = data.iter().map(|point| point.0).collect();
    doses.sort_by(f64::total_cmp);
    doses.dedup();
    if doses.len() < 3 {
        return Err(FitError::TooFewDoses { doses: doses.len(), needed: 3 });
    }
    super::regression::LineFit::new(data)?.rising("um for each mJ/cm2")?;
    Ok(())
}

impl TwoDepthFit {
    fn of(curve: TwoDepthCurve, data: &[(f64, f64)], deepest: f64) -> Option<Self> {
        let straight = curve.bend * deepest < 1.0 / CLEAR;
        let mean = data.iter().map(|point| point.1).sum::<f64>() / data.len() as f64;
        let scatter: f64 = data.iter().map(|point| (point.1 - mean).powi(2)).sum();
        let squares = curve.squares(data);
        let free = data.len() - 3;
        // Covariance is (JᵀJ)⁻¹ s², and an interval t times its root.
        let times = t_95(free).powi(2) * squares / free as f64;
        let (matrix, _) = curve.normal(data);
        let spread = inverse(matrix)?.map(|row| row.map(|part| part * times));
        let half = |slopes: [f64; 3]| dot(&slopes, &product(&spread, &slopes)).max(0.0).sqrt();
        let liquid = curve.log_rate.exp() * curve.onset;
        // ln D_pL = ln E_c + ln a: its derivatives over onset and log rate are 1 / E_c and 1.
        let ratio = half([1.0 / curve.onset, 1.0, 0.0]).exp();
        let bend_half = half([0.0, 0.0, 1.0]);
        let solid = if straight { CLEAR * deepest } else { 1.0 / curve.bend };
        // If a bend of zero is within the interval, D_pS has no upper end.
        let high = if straight || bend_half >= curve.bend {
            f64::INFINITY
        } else {
            1.0 / (curve.bend - bend_half)
        };
        Some(Self {
            critical_dose: Estimate::even(curve.onset, half([1.0, 0.0, 0.0])),
            liquid_depth: Estimate::new(liquid, liquid / ratio, liquid * ratio),
            solid_depth: Estimate::new(solid, (1.0 / (curve.bend + bend_half)).min(solid), high),
            straight,
            r2: 1.0 - squares / scatter,
            points: data.len(),
            extent: None,
            curve,
            spread,
        })
    }

    /// Checks that no interval reaches zero. The interval of `D_pL` is on a logarithmic scale,
    /// where a half width of one counts as reaching zero.
    fn above_zero(self) -> Result<Self, FitError> {
        let vague = |what, value, half, unit| Err(FitError::Vague { what, value, half, unit });
        let onset = self.critical_dose;
        if onset.low.mj_per_cm2() <= 0.0 {
            let half = onset.plus_minus().mj_per_cm2();
            return vague("the critical dose", onset.value.mj_per_cm2(), half, "mJ/cm2");
        }
        let liquid = self.liquid_depth;
        let half = (liquid.high.um() / liquid.value.um()).ln();
        if half >= 1.0 {
            let um = liquid.value.um();
            return vague("the liquid's penetration depth", um, um * half, "um");
        }
        Ok(self)
    }

    /// Returns the depth of a dose that arrives, with its 95% interval. It is below zero up
    /// to the critical dose, and NaN far below.
    pub fn depth(&self, dose: Dose) -> Estimate<Length> {
        let (depth, slopes) = self.curve.at(dose.mj_per_cm2());
        let half = dot(&slopes, &product(&self.spread, &slopes)).max(0.0).sqrt();
        Estimate::even(depth, half)
    }

    /// Returns the numbers for a material file.
    pub fn numbers(&self, source: &str) -> TwoDepthNumbers {
        let clear = "; the points do not bend: clear once solid";
        let of_solid = format!("{source}{}", if self.straight { clear } else { "" });
        TwoDepthNumbers {
            critical_dose: self.critical_dose.given(source),
            liquid_depth: self.liquid_depth.given(source),
            solid_depth: self.solid_depth.given(&of_solid),
            depths: None,
            measured: self.extent.map(|extent| extent.measured(source)),
        }
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::SplitMix;

    use super::super::made_up::{depth_points, share_held};
    use super::*;
    use crate::resin::{DepthRange, ExposureTime, GrayLevel, Intensity, TwoDepth, model_laws};

    const DOSES: [f64; 10] = [5.0, 6.0, 8.0, 10.0, 14.0, 20.0, 30.0, 45.0, 70.0, 100.0];

    fn truth() -> TwoDepth {
        let um = Length::from_um;
        TwoDepth::new(Dose::from_mj_per_cm2(4.0), um(80.0), um(150.0), DepthRange::ALL).unwrap()
    }

    #[test]
    fn exact_points_give_the_model_back() {
        let fit = fit_two_depth(&depth_points(&truth(), &DOSES, |_| 0.0)).unwrap();
        assert!((fit.critical_dose.value.mj_per_cm2() - 4.0).abs() < 1e-6, "{fit:?}");
        assert!((fit.liquid_depth.value.um() - 80.0).abs() < 1e-5, "{fit:?}");
        assert!((fit.solid_depth.value.um() - 150.0).abs() < 1e-5, "{fit:?}");
        assert!(!fit.straight && fit.r2 > 1.0 - 1e-9 && fit.points == 10);
    }

    #[test]
    fn it_agrees_with_another_program() {
        // scipy.optimize.curve_fit of E_c, ln(D_pL/E_c) and 1/D_pS.
        let errors = [2.0, -1.5, 0.5, 3.0, -2.5, 1.0, -0.5, -2.0, 2.5, -1.0];
        let mut error = errors.into_iter();
        let fit = fit_two_depth(&depth_points(&truth(), &DOSES, |_| error.next().unwrap()));
        let fit = fit.unwrap();
        for (found, wanted) in [
            (fit.critical_dose.value.mj_per_cm2(), 3.936045),
            (fit.critical_dose.plus_minus().mj_per_cm2(), 0.252660),
            (fit.liquid_depth.value.um(), 77.975147),
            (fit.liquid_depth.high.um(), 87.695740),
            (fit.solid_depth.value.um(), 150.777529),
            (fit.solid_depth.low.um(), 144.567360),
            (fit.solid_depth.high.um(), 157.545185),
        ] {
            assert!((found - wanted).abs() < 1e-4 * wanted, "{found} for {wanted}");
        }
    }

    #[test]
    fn of_100_intervals_95_hold_the_truth() {
        let mut noise = SplitMix(5);
        let fits = std::iter::from_fn(|| {
            Some(fit_two_depth(&depth_points(&truth(), &DOSES, |_| 3.0 * noise.normal())))
        });
        let held = share_held(fits.take(2000), |fit| {
            [
                fit.critical_dose.holds(Dose::from_mj_per_cm2(4.0)),
                fit.liquid_depth.holds(Length::from_um(80.0)),
                fit.solid_depth.holds(Length::from_um(150.0)),
            ]
        });
        // 95% +- 1.5% is three standard deviations of 2000 trials.
        assert!(held.iter().all(|share| (share - 0.95).abs() < 0.0147), "{held:?}");
    }

    #[test]
    fn the_points_of_appendix_a_are_straight() {
        // Appendix E has E_c 11.593,
        // D_pL 302.8253 and a D_pS of 100 m for them.
        let points = model_laws::APPENDIX_A.map(|(seconds, um)| {
            let dose = Intensity::from_mw_per_cm2(0.2064) * ExposureTime::from_ms(1000.0 * seconds);
            DepthPoint { gray: GrayLevel::WHITE, dose, depth: Length::from_um(um) }
        });
        let fit = fit_two_depth(&points).unwrap();
        assert!(fit.straight, "{fit:?}");
        assert!((fit.critical_dose.value.mj_per_cm2() - 11.593).abs() < 0.01, "{fit:?}");
        assert!((fit.liquid_depth.value.um() - 302.8253).abs() < 0.1, "{fit:?}");
        assert_eq!(fit.solid_depth.high.um(), f64::INFINITY);
        let numbers = fit.numbers("a test");
        assert!(numbers.solid_depth.plus_minus.is_none());
        assert!(numbers.solid_depth.source.contains("do not bend"), "{numbers:?}");
    }

    #[test]
    fn an_interval_that_reaches_zero_is_refused() {
        let rows = [(320.0, 100.0), (640.0, 169.31), (1280.0, 238.63), (2560.0, 300.0)];
        let points = rows.map(|(mj, um)| DepthPoint {
            gray: GrayLevel::WHITE,
            dose: Dose::from_mj_per_cm2(mj),
            depth: Length::from_um(um),
        });
        let error = fit_two_depth(&points).unwrap_err();
        assert!(matches!(error, FitError::Vague { what: "the critical dose", .. }), "{error}");
        let text = error.to_string();
        assert!(text.contains("142.7 +- 250.8 mJ/cm2 reaches zero"), "{text}");
    }

    #[test]
    fn too_little_is_refused() {
        let points = depth_points(&truth(), &DOSES, |_| 0.0);
        assert_eq!(fit_two_depth(&points[..3]), Err(FitError::TooFew { points: 3, needed: 4 }));
        let two = depth_points(&truth(), &[5.0, 5.0, 9.0, 9.0], |_| 0.0);
        assert_eq!(fit_two_depth(&two), Err(FitError::TooFewDoses { doses: 2, needed: 3 }));
        let falls = depth_points(&truth(), &DOSES, |mj| -8.0 * mj);
        assert!(matches!(fit_two_depth(&falls), Err(FitError::Falls { .. })));
    }
}
