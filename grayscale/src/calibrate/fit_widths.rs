//! Fits the cure width to measured squares.

use lamp_stack::Length;

use super::measurements::WidthPoint;
use super::regression::LineFit;
use super::{Estimate, FitError, PointGroup};
use crate::material::WidthNumbers;
use crate::resin::{Dose, WidthSensitivity};

/// The cure width of squares of one size, found from measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WidthFit {
    /// The squares' side in the image.
    pub feature_size: Length,
    /// `E_c^w`, where the line meets width zero.
    pub critical_dose: Estimate<Dose>,
    /// `D_p^w`, the line's slope.
    pub sensitivity: Estimate<WidthSensitivity>,
    /// The share of the widths' scatter that the line explains.
    pub r2: f64,
    /// The number of points.
    pub points: usize,
    /// The number of further points below the critical dose.
    pub below: usize,
    line: LineFit,
}

/// Fits `C_w = D_p^w (E - E_c^w)` to the squares of each size, from the smallest,
/// by linear regression of the width on the dose, not on its logarithm (002
/// section 3.4.4).
///
/// Below the critical dose the width is zero and does not follow the line: squares that
/// are wider there by an error are left out.
///
/// Intervals are those of the working curve's fit, by Student's t and Fieller's
/// theorem.
///
/// # Errors
/// Returns an error if there are no points, if a size has fewer than three points or two
/// doses, or if its width does not clearly rise with the dose from a dose above zero.
pub fn fit_widths(points: &[WidthPoint]) -> Result<Vec<WidthFit>, FitError> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.feature_size.um().total_cmp(&b.feature_size.um()));
    if sorted.is_empty() {
        return Err(FitError::TooFew { points: 0, needed: 3 });
    }
    let groups = sorted.chunk_by(|a, b| a.feature_size == b.feature_size);
    let fit = |group: &[WidthPoint]| {
        let size = group[0].feature_size;
        fit_size(size, group).map_err(|error| error.within(PointGroup::Squares(size)))
    };
    groups.map(fit).collect()
}

fn fit_size(feature_size: Length, points: &[WidthPoint]) -> Result<WidthFit, FitError> {
    let pairs: Vec<_> = points.iter().map(|p| (p.dose.mj_per_cm2(), p.width.um())).collect();
    let line = line_above_zero(pairs)?;
    let [value, low, high] = line.zero();
    if !Dose::PLAUSIBLE.contains(&Dose::from_mj_per_cm2(value)) {
        return Err(FitError::NoCriticalDose(value));
    }
    Ok(WidthFit {
        feature_size,
        // No dose is below zero: without those the interval holds the truth as often.
        critical_dose: Estimate::new(value, low.max(0.0), high),
        sensitivity: Estimate::even(line.slope, line.slope_half()),
        r2: line.r2,
        points: line.points,
        below: points.len() - line.points,
        line,
    })
}

/// Fits a rising line, leaving out points to the left of its zero.
fn line_above_zero(mut points: Vec<(f64, f64)>) -> Result<LineFit, FitError> {
    loop {
        let line = LineFit::new(&points)?.rising("um for each mJ/cm2")?;
        let from = line.zero()[0];
        points.retain(|point| point.0 >= from);
        if points.len() == line.points {
            return Ok(line);
        }
    }
}

impl WidthFit {
    /// Returns the width at a dose, with its 95% interval. It is below zero up to the
    /// critical dose.
    pub fn width(&self, dose: Dose) -> Estimate<Length> {
        let mj = dose.mj_per_cm2();
        Estimate::even(self.line.at(mj), self.line.half_at(mj))
    }

    /// Returns the numbers for a material file.
    pub fn numbers(&self, source: &str) -> WidthNumbers {
        WidthNumbers {
            feature_size: self.feature_size,
            critical_dose: self.critical_dose.given(source),
            sensitivity: self.sensitivity.given(source),
        }
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::SplitMix;

    use super::super::made_up::share_held;
    use super::*;
    use crate::resin::WidthLine;

    const DOSES: [f64; 8] = [150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 450.0, 500.0];

    fn truth(size: f64, critical: f64, slope: f64) -> WidthLine {
        WidthLine {
            feature_size: Length::from_um(size),
            critical_dose: Dose::from_mj_per_cm2(critical),
            sensitivity: WidthSensitivity::from_um_per_mj_per_cm2(slope),
        }
    }

    fn points(truth: WidthLine, mut error: impl FnMut() -> f64) -> Vec<WidthPoint> {
        let point = |mj| {
            let dose = Dose::from_mj_per_cm2(mj);
            let width = Length::from_um(truth.width(dose).um() + error());
            WidthPoint { feature_size: truth.feature_size, dose, width }
        };
        DOSES.map(point).to_vec()
    }

    #[test]
    fn exact_points_give_each_size_back() {
        let truths = [truth(423.0, 140.0, 0.08), truth(7620.0, 90.0, 0.2)];
        let [small, large] = truths.map(|truth| points(truth, || 0.0));
        let fits = fit_widths(&[large, small].concat()).unwrap();
        assert_eq!(fits.len(), 2);
        for (fit, truth) in fits.iter().zip(truths) {
            assert_eq!((fit.feature_size, fit.points), (truth.feature_size, 8));
            let critical = truth.critical_dose.mj_per_cm2();
            assert!((fit.critical_dose.value.mj_per_cm2() - critical).abs() < 1e-9);
            let slope = truth.sensitivity.um_per_mj_per_cm2();
            assert!((fit.sensitivity.value.um_per_mj_per_cm2() - slope).abs() < 1e-12);
            let dose = Dose::from_mj_per_cm2(333.0);
            assert!((fit.width(dose).value.um() - truth.width(dose).um()).abs() < 1e-9);
        }
    }

    #[test]
    fn of_100_intervals_95_hold_the_truth() {
        let truth = truth(423.0, 100.0, 0.1);
        let mut noise = SplitMix(11);
        let fits = std::iter::from_fn(|| {
            let points = points(truth, || 2.0 * noise.normal());
            Some(fit_widths(&points).map(|fits| fits[0]))
        });
        let held = share_held(fits.take(4000), |fit| {
            [fit.critical_dose.holds(truth.critical_dose), fit.sensitivity.holds(truth.sensitivity)]
        });
        assert!(held.iter().all(|share| (share - 0.95).abs() < 0.0104), "{held:?}");
    }

    #[test]
    fn squares_below_the_critical_dose_do_not_bend_the_line() {
        // Half of those that do not grow are measured as wider, by an error.
        let truth = truth(423.0, 240.0, 0.1);
        let mut noise = SplitMix(13);
        let fits = std::iter::from_fn(|| {
            let mut points = points(truth, || 1.0 * noise.normal());
            points.retain(|point| point.width.um() > 0.0);
            Some(fit_widths(&points).map(|fits| fits[0]))
        });
        let held = share_held(fits.take(4000), |fit| {
            [fit.critical_dose.holds(truth.critical_dose), fit.sensitivity.holds(truth.sensitivity)]
        });
        assert!(held.iter().all(|share| (share - 0.95).abs() < 0.0104), "{held:?}");
    }

    #[test]
    fn errors_name_the_size() {
        let few = &points(truth(423.0, 100.0, 0.1), || 0.0)[..2];
        let error = fit_widths(few).unwrap_err().to_string();
        assert!(error.starts_with("squares of 423um: 2 points are too few"), "{error}");
        // A line that begins left of no dose at all.
        let mut early = points(truth(423.0, 100.0, 0.1), || 0.0);
        for point in &mut early {
            point.width = Length::from_um(point.width.um() + 50.0);
        }
        let error = fit_widths(&early).unwrap_err().to_string();
        assert!(error.contains("begins at a dose of -400.0 mJ/cm2"), "{error}");
        assert_eq!(fit_widths(&[]), Err(FitError::TooFew { points: 0, needed: 3 }));
    }
}
