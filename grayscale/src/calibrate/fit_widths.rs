//! Fits the cure width to measured squares.

use lamp_stack::Length;

use super::extent::Extent;
use super::hinge::HingeFit;
use super::measurements::WidthPoint;
use super::{Estimate, FitError, PointGroup};
use crate::material::WidthNumbers;
use crate::resin::{Dose, WidthSensitivity};

/// The cure width of squares of one size, found from measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct WidthFit {
    /// The squares' side in the image.
    pub feature_size: Length,
    /// `E_c^w`, from which dose on they grow.
    pub critical_dose: Estimate<Dose>,
    /// `D_p^w`, the line's slope.
    pub sensitivity: Estimate<WidthSensitivity>,
    /// The share of the widths' scatter that the line explains.
    pub r2: f64,
    /// The number of points.
    pub points: usize,
    /// The number of points up to the critical dose.
    pub below: usize,
    extent: Option<Extent>,
    hinge: HingeFit,
}

/// Fits `C_w = D_p^w (E - E_c^w)`, and zero up to `E_c^w`, to all squares of each size, from the
/// smallest, by least squares of the width over the dose, not over its logarithm (002 section
/// 3.4.4).
///
/// Squares that did not grow show where growth begins, as squares that grew do. Without them, only
/// the squares that errors of measurement make wider would remain, and the critical dose would be
/// too low.
///
/// Intervals hold all numbers whose least squares exceed the best ones by no more than Student's t
/// allows. Where all squares grew, the intervals equal a straight line's by Fieller's theorem.
///
/// # Errors
/// Returns an error if there are no points, if a size has fewer than three points or two doses, if
/// its width might not rise with the dose, or rises from no dose above zero or at the highest dose
/// alone.
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
    let hinge = HingeFit::new(&pairs, "um for each mJ/cm2")?;
    let [onset, low, high] = hinge.onset;
    if !Dose::PLAUSIBLE.contains(&Dose::from_mj_per_cm2(onset)) {
        return Err(FitError::NoCriticalDose(onset));
    }
    let [slope, least, most] = hinge.slope;
    Ok(WidthFit {
        feature_size,
        critical_dose: Estimate::new(onset, low, high),
        sensitivity: Estimate::new(slope, least, most),
        r2: hinge.r2,
        points: points.len(),
        below: pairs.iter().filter(|point| point.0 <= onset).count(),
        extent: Extent::of_doses(points.iter().map(|point| point.dose)),
        hinge,
    })
}

impl WidthFit {
    /// Returns the width at a dose, with its 95% interval. Beyond the highest dose it has no upper
    /// end if growth may begin just below that.
    pub fn width(&self, dose: Dose) -> Estimate<Length> {
        let [width, low, high] = self.hinge.at(dose.mj_per_cm2());
        Estimate::new(width, low, high)
    }

    /// Returns the numbers for a material file.
    pub fn numbers(&self, source: &str) -> WidthNumbers {
        WidthNumbers {
            feature_size: self.feature_size,
            critical_dose: self.critical_dose.given(source),
            sensitivity: self.sensitivity.given(source),
            measured: self.extent.map(|extent| extent.measured(source)),
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

    /// Fits of 3000 series of ten squares at 60 to 600 mJ/cm², whose growth of 0.1 um for each
    /// mJ/cm² from `critical` on is measured to `spread` um. Some determine no line.
    fn fits(critical: f64, spread: f64) -> Vec<Result<WidthFit, FitError>> {
        let truth = truth(423.0, critical, 0.1);
        let mut noise = SplitMix(17);
        let mut fit = || {
            let point = |i: u32| {
                let dose = Dose::from_mj_per_cm2(60.0 * f64::from(i));
                let width = Length::from_um(truth.width(dose).um() + spread * noise.normal());
                WidthPoint { feature_size: truth.feature_size, dose, width }
            };
            let points: Vec<_> = (1..=10).map(point).collect();
            fit_widths(&points).map(|mut fits| fits.remove(0))
        };
        (0..3000).map(|_| fit()).collect()
    }

    #[test]
    fn the_critical_dose_has_no_bias_and_its_interval_holds_it() {
        for (critical, spread) in [(200.0, 2.0), (200.0, 5.0), (100.0, 3.0), (330.0, 5.0)] {
            let fits = fits(critical, spread);
            let refused = fits.iter().filter(|fit| fit.is_err()).count();
            assert!(refused <= 30, "{critical} {spread}: {refused} refused");
            let found: Vec<_> = fits.into_iter().flatten().collect();
            let truth = truth(423.0, critical, 0.1);
            let mut doses: Vec<_> =
                found.iter().map(|fit| fit.critical_dose.value.mj_per_cm2()).collect();
            doses.sort_by(f64::total_cmp);
            let middle = doses[doses.len() / 2];
            assert!((middle - critical).abs() < 4.0, "{critical} {spread}: {middle}");
            let held = share_held(found.into_iter().map(Ok), |fit| {
                [
                    fit.critical_dose.holds(truth.critical_dose),
                    fit.sensitivity.holds(truth.sensitivity),
                ]
            });
            // A bend has no exact interval: 93 to 97%, and 0.4% is a standard deviation here.
            let right = held.iter().all(|share| (0.93..=0.97).contains(share));
            assert!(right, "{critical} {spread}: {held:?}");
        }
    }

    #[test]
    fn squares_that_did_not_grow_say_so() {
        let truth = truth(423.0, 240.0, 0.1);
        let mut noise = SplitMix(13);
        let all = points(truth, || 1.0 * noise.normal());
        let fit = fit_widths(&all).unwrap().remove(0);
        assert_eq!((fit.points, fit.below), (8, 2));
        assert!(fit.critical_dose.holds(truth.critical_dose));
        let width = fit.width(Dose::from_mj_per_cm2(200.0));
        assert_eq!((width.value.um(), width.low.um()), (0.0, 0.0));
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
