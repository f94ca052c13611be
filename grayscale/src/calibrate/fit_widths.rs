//! Fits the cure width to measured squares.

use lamp_stack::Length;

use super::extent::Extent;
use super::fit_scan::ScanDirection;
use super::hinge::HingeFit;
use super::matrix::inverse;
use super::measurements::WidthPoint;
use super::student_t::t_95;
use super::{Estimate, FitError, PointGroup, least_squares};
use crate::material::WidthNumbers;
use crate::resin::{Dose, WidthSensitivity, plausible};

/// The cure width of squares of one size, found from measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct WidthFit {
    /// The squares' side in the image.
    pub feature_size: Length,
    /// The direction of the widths, if they were measured along and across the scan apart.
    pub direction: Option<ScanDirection>,
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

/// Fits `C_w = D_p^w (E - E_c^w)`, and zero up to `E_c^w`, to all squares of one layer of each size and
/// direction, from the smallest, by least squares of the width over the dose, not over its logarithm (002 section
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
/// Returns an error if there are no points of one layer, if a size has fewer than three points or two doses, if
/// its width might not rise with the dose, or rises from no dose above zero or at the highest dose
/// alone.
pub fn fit_widths(points: &[WidthPoint]) -> Result<Vec<WidthFit>, FitError> {
    let mut sorted: Vec<_> = points.iter().filter(|point| point.layers == 1).copied().collect();
    let of_direction = |point: &WidthPoint| point.direction.map(|direction| direction as u8);
    sorted.sort_by(|a, b| {
        let sizes = a.feature_size.um().total_cmp(&b.feature_size.um());
        sizes.then(of_direction(a).cmp(&of_direction(b)))
    });
    if sorted.is_empty() && !points.is_empty() {
        return Err(FitError::NoSingleLayer);
    }
    if sorted.is_empty() {
        return Err(FitError::TooFew { points: 0, needed: 3 });
    }
    let groups =
        sorted.chunk_by(|a, b| (a.feature_size, a.direction) == (b.feature_size, b.direction));
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
    if !plausible::DOSE.contains(&Dose::from_mj_per_cm2(onset)) {
        return Err(FitError::NoCriticalDose(onset));
    }
    let [slope, least, most] = hinge.slope;
    Ok(WidthFit {
        feature_size,
        direction: points[0].direction,
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
            direction: self.direction,
            critical_dose: self.critical_dose.given(source),
            sensitivity: self.sensitivity.given(source),
            measured: self.extent.map(|extent| extent.measured(source)),
        }
    }
}

/// How much the doses of the layers above count for the cure width, found from measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ManyLayersFit {
    /// The share of their doses, with the ends of its 95% interval.
    pub share: [f64; 3],
    /// The size of the squares.
    pub feature_size: Length,
    /// The number of points, of one layer and of many.
    pub points: usize,
}

/// Fits the share `s` of the doses of the layers above that counts for the cure width, with the line of
/// the squares: `D_p^w (E (1 + s (S - 1)) - E_c^w)`, zero below. `summed` gives `S`, how many times
/// its own dose the lowest of so many layers gets ([`summed_doses`](crate::resin::summed_doses)). 002
/// section 3.4.8 a says only that parts of many layers grow slightly more: the model is assumed.
///
/// The interval is by the covariance of the fit and Student's t. Returns `None` if all squares have one
/// layer.
///
/// # Errors
/// Returns an error if squares of many layers have several sizes or a direction, if squares of one
/// layer and that size give no line, if there are too few points, or if more than the whole doses would
/// count.
pub fn fit_many_layers(
    points: &[WidthPoint],
    summed: impl Fn(u32) -> f64,
) -> Result<Option<ManyLayersFit>, FitError> {
    let Some(first) = points.iter().find(|point| point.layers > 1) else { return Ok(None) };
    let feature_size = first.feature_size;
    let others = |point: &WidthPoint| {
        point.layers > 1 && (point.feature_size != feature_size || point.direction.is_some())
    };
    if points.iter().any(others) {
        return Err(FitError::LayersOfSeveral);
    }
    let of_size =
        |point: &&WidthPoint| point.feature_size == feature_size && point.direction.is_none();
    let points: Vec<_> = points.iter().filter(of_size).copied().collect();
    let group = PointGroup::Squares(feature_size);
    let single: Vec<_> = points.iter().filter(|point| point.layers == 1).copied().collect();
    let start = fit_size(feature_size, &single).map_err(|error| error.within(group))?;
    if points.len() < 5 {
        return Err(FitError::TooFew { points: points.len(), needed: 5 }.within(group));
    }
    let measured: Vec<_> = points
        .iter()
        .map(|p| [p.dose.mj_per_cm2(), summed(p.layers) - 1.0, p.width.um()])
        .collect();
    // The slope, the critical dose and the share; and the derivatives of the width over them.
    let width = |[slope, critical, share]: &[f64; 3], [dose, above, _]: [f64; 3]| {
        let rise = dose * (1.0 + share * above) - critical;
        if rise > 0.0 {
            (slope * rise, [rise, -slope, slope * dose * above])
        } else {
            (0.0, [0.0; 3])
        }
    };
    let squares = |numbers: &[f64; 3]| -> f64 {
        measured.iter().map(|row| (row[2] - width(numbers, *row).0).powi(2)).sum()
    };
    let normal = |numbers: &[f64; 3]| {
        let (mut matrix, mut vector) = ([[0.0; 3]; 3], [0.0; 3]);
        for row in &measured {
            let (value, slopes) = width(numbers, *row);
            for i in 0..3 {
                vector[i] += slopes[i] * (row[2] - value);
                for j in 0..3 {
                    matrix[i][j] += slopes[i] * slopes[j];
                }
            }
        }
        (matrix, vector)
    };
    let starts = [0.0, 0.1, 0.3, 1.0].map(|share| {
        let critical = start.critical_dose.value.mj_per_cm2();
        [start.sensitivity.value.um_per_mj_per_cm2(), critical, share]
    });
    let found = starts.iter().filter_map(|start| {
        let moved =
            |numbers: &[f64; 3], step: [f64; 3]| std::array::from_fn(|i| numbers[i] + step[i]);
        least_squares::fitted(*start, squares, normal, moved)
    });
    let best = found.min_by(|a, b| squares(a).total_cmp(&squares(b))).ok_or(FitError::NoLines)?;
    let covariance = inverse(normal(&best).0).ok_or(FitError::NoLines)?;
    let freedom = measured.len() - 3;
    let half = t_95(freedom) * (covariance[2][2] * squares(&best) / freedom as f64).sqrt();
    let value = best[2];
    if value < 0.0 {
        let what = "the share of the doses of layers above";
        return Err(FitError::Vague { what, value, half, unit: "" }.within(group));
    }
    if value - half > 1.0 {
        return Err(FitError::LargeShare { value, half }.within(group));
    }
    // Errors of measurement alone may lead a little beyond the whole dose.
    let share = [value.min(1.0), value - half, value + half];
    Ok(Some(ManyLayersFit { share, feature_size, points: measured.len() }))
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
            WidthPoint { feature_size: truth.feature_size, dose, width, direction: None, layers: 1 }
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
                WidthPoint {
                    feature_size: truth.feature_size,
                    dose,
                    width,
                    direction: None,
                    layers: 1,
                }
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

    /// Squares of one layer and of twenty, at ten doses each.
    fn layers_of(share: f64, spread: f64, noise: &mut SplitMix) -> Vec<WidthPoint> {
        let truth = truth(8466.667, 100.0, 0.1);
        let mut points = Vec::new();
        for layers in [1, 20] {
            for i in 1..=10 {
                let dose = Dose::from_mj_per_cm2(50.0 * f64::from(i));
                let counts = dose.mj_per_cm2() * (1.0 + share * (twenty(layers) - 1.0));
                let um = truth.width(Dose::from_mj_per_cm2(counts)).um() + spread * noise.normal();
                let (feature_size, width) = (truth.feature_size, Length::from_um(um));
                points.push(WidthPoint { feature_size, dose, width, direction: None, layers });
            }
        }
        points
    }

    /// Layers of 100 um and light that fades over 211 um, layer by layer.
    fn twenty(layers: u32) -> f64 {
        (0..layers).map(|above| (-100.0 * f64::from(above) / 211.0).exp()).sum()
    }

    #[test]
    fn the_share_of_doses_above_comes_back() {
        let mut noise = SplitMix(20);
        let exact = fit_many_layers(&layers_of(0.2, 0.0, &mut noise), twenty).unwrap().unwrap();
        assert!((exact.share[0] - 0.2).abs() < 1e-6 && exact.points == 20, "{exact:?}");
        let fits = (0..400).map(|_| {
            let fit = fit_many_layers(&layers_of(0.2, 1.5, &mut noise), twenty)?;
            Ok(fit.unwrap())
        });
        let [held] = share_held(fits, |fit| [fit.share[1] <= 0.2 && 0.2 <= fit.share[2]]);
        // 95% +- 3.3% is three standard deviations of 400 trials.
        assert!((held - 0.95).abs() < 0.033, "{held}");
    }

    #[test]
    fn the_share_of_doses_above_is_at_most_one() {
        let mut noise = SplitMix(22);
        let whole = fit_many_layers(&layers_of(1.0, 0.5, &mut noise), twenty).unwrap().unwrap();
        let [share, low, high] = whole.share;
        assert!(share <= 1.0 && low <= 1.0 && high >= share, "{whole:?}");
        let more = fit_many_layers(&layers_of(1.4, 0.5, &mut noise), twenty).unwrap_err();
        assert!(more.to_string().contains("cannot be more than 1: check"), "{more}");
    }

    #[test]
    fn squares_of_several_layers_alone_ask_for_squares_of_one() {
        let points = layers_of(0.2, 0.5, &mut SplitMix(23));
        let error = fit_widths(&points[10..]).unwrap_err();
        assert_eq!(error, FitError::NoSingleLayer);
        assert_eq!(fit_widths(&[]), Err(FitError::TooFew { points: 0, needed: 3 }));
    }

    #[test]
    fn squares_of_many_layers_have_one_size_and_no_direction() {
        let mut noise = SplitMix(21);
        let points = layers_of(0.2, 0.5, &mut noise);
        assert_eq!(fit_many_layers(&points[..10], twenty), Ok(None));
        assert_eq!(fit_widths(&points).unwrap()[0].points, 10);
        let mut sizes = points.clone();
        sizes[15].feature_size = Length::from_um(500.0);
        assert_eq!(fit_many_layers(&sizes, twenty), Err(FitError::LayersOfSeveral));
        let mut along = points.clone();
        along[15].direction = Some(ScanDirection::Along);
        assert_eq!(fit_many_layers(&along, twenty), Err(FitError::LayersOfSeveral));
        let few = fit_many_layers(&points[8..], twenty).unwrap_err().to_string();
        assert!(few.contains("2 points are too few"), "{few}");
    }

    #[test]
    fn directions_have_lines_of_their_own() {
        let truths = [truth(8000.0, 140.0, 0.08), truth(8000.0, 90.0, 0.2)];
        let directions = ScanDirection::ALL;
        let of = |k: usize| {
            let points = points(truths[k], || 0.0).into_iter();
            points.map(move |point| WidthPoint { direction: Some(directions[k]), ..point })
        };
        let fits = fit_widths(&of(1).chain(of(0)).collect::<Vec<_>>()).unwrap();
        for ((fit, truth), direction) in fits.iter().zip(truths).zip(directions) {
            assert_eq!(fit.direction, Some(direction));
            let critical = truth.critical_dose.mj_per_cm2();
            assert!((fit.critical_dose.value.mj_per_cm2() - critical).abs() < 1e-9);
        }
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
