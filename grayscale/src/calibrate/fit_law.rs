//! Fits how cure depths or cure widths follow an ingredient or the lamp.

use std::marker::PhantomData;

use lamp_stack::Length;

use super::extent::Extent;
use super::matrix::{dot, inverse, product};
use super::measurements::{LawPoint, LawTable};
use super::regression::LineFit;
use super::student_t::t_95;
use super::{Estimate, FitError, least_squares};
use crate::material::{CurveNumbers, LawEnd, LawNumbers, LawVariable, WidthNumbers};
use crate::resin::{Dose, Quantity, WidthSensitivity};

/// A curve over the dose that begins at a critical dose, by what its sensitivity is.
pub trait LawCurve: Quantity {
    /// The unit of the inverse of the sensitivity.
    const INVERSE: &'static str;
    /// The unit of the sensitivity, as the slope over the dose.
    const SLOPE: &'static str;

    /// Returns the dose over which the curve is straight.
    #[doc(hidden)]
    fn straight(dose: f64) -> f64;

    /// Returns the curve for a sensitivity of 1, and its derivative over the critical dose.
    #[doc(hidden)]
    fn rise(dose: f64, critical: f64) -> [f64; 2];
}

/// The penetration depth `D_p^d` of the working curve (002 eq. 30).
impl LawCurve for Length {
    const INVERSE: &'static str = "1/um";
    const SLOPE: &'static str = "um for each e-fold of dose";

    fn straight(dose: f64) -> f64 {
        dose.ln()
    }

    fn rise(dose: f64, critical: f64) -> [f64; 2] {
        [(dose / critical).ln(), -1.0 / critical]
    }
}

/// The sensitivity `D_p^w` of the cure width (002 section 3.4.4).
impl LawCurve for WidthSensitivity {
    const INVERSE: &'static str = "(mJ/cm2)/um";
    const SLOPE: &'static str = "um for each mJ/cm2";

    fn straight(dose: f64) -> f64 {
        dose
    }

    fn rise(dose: f64, critical: f64) -> [f64; 2] {
        // Squares that did not grow say only that the critical dose is above theirs.
        if dose > critical { [dose - critical, -1.0] } else { [0.0, 0.0] }
    }
}

/// How a sensitivity `D`, [`Length`] or [`WidthSensitivity`], and its critical dose `E_c` follow a
/// quantity, found from measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct LawFit<D> {
    /// The quantity.
    pub over: LawVariable,
    /// Its measured values and the number of points at each, from the least.
    pub values: Vec<(f64, usize)>,
    /// The share of the scatter that the curves explain.
    pub r2: f64,
    /// `1/D` at the least and at the greatest value, and `E_c` there.
    ends: [f64; 4],
    /// Their covariance, times the square of Student's t.
    spread: [[f64; 4]; 4],
    sensitivity: PhantomData<D>,
}

/// A straight line: its value at zero, and its rise for each unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LawLine {
    /// The value at zero, with the ends of its 95% interval.
    pub at_zero: [f64; 3],
    /// The rise for each unit, likewise.
    pub rise: [f64; 3],
}

/// The fewest values of a quantity that show whether a law is straight.
const LEAST_VALUES: usize = 3;

/// Fits `1/D` and `E_c`, straight over a quantity, to all points at once by nonlinear least squares:
/// depths `D ln(E/E_c)`, or widths `D (E - E_c)`, zero up to `E_c` (002 sections 3.4.5 to 3.4.7).
/// `E_c` is straight over the inverse of a photoinitiator.
///
/// Intervals are by the covariance of the fit and Student's t; `D` has the inverse of the interval of
/// `1/D`.
///
/// # Errors
/// Returns an error if there are fewer than three values or five points, if points do not rise with
/// the dose, or if they do not determine all numbers to be above zero.
pub fn fit_law<D: LawCurve>(over: LawVariable, points: &[LawPoint]) -> Result<LawFit<D>, FitError> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.at.total_cmp(&b.at));
    let values: Vec<_> =
        sorted.chunk_by(|a, b| a.at == b.at).map(|group| (group[0].at, group.len())).collect();
    if values.len() < LEAST_VALUES {
        return Err(FitError::TooFewValues { over, values: values.len(), needed: LEAST_VALUES });
    }
    let needed = 5;
    if points.len() < needed {
        return Err(FitError::TooFew { points: points.len(), needed });
    }
    let range = [values[0].0, values[values.len() - 1].0];
    let place = |point: &LawPoint| PlacedPoint {
        shares: shares(over, range, point.at),
        dose: point.dose.mj_per_cm2(),
        measured: point.measured.um(),
    };
    let placed: Vec<_> = sorted.iter().map(place).collect();
    let straight: Vec<_> = placed.iter().map(|p| (D::straight(p.dose), p.measured)).collect();
    let line = LineFit::new(&straight)?.rising(D::SLOPE)?;
    let ends = best::<D>(&placed, line.slope).ok_or(FitError::NoLines)?;
    let left = squares::<D>(&ends, &placed);
    let freedom = placed.len() - 4;
    let times = t_95(freedom).powi(2) * left / freedom as f64;
    let covariance = inverse(normal::<D>(&ends, &placed).0).ok_or(FitError::NoLines)?;
    let spread = covariance.map(|row| row.map(|product| product * times));
    let mean = straight.iter().map(|point| point.1).sum::<f64>() / straight.len() as f64;
    let scatter: f64 = straight.iter().map(|point| (point.1 - mean).powi(2)).sum();
    for (k, &value) in ends.iter().enumerate() {
        let half = spread[k][k].sqrt();
        if half >= value {
            let (what, unit) = match k {
                0 | 1 => ("the inverse of the sensitivity", D::INVERSE),
                _ => ("the critical dose", Dose::UNIT),
            };
            return Err(FitError::Vague { what, value, half, unit });
        }
    }
    Ok(LawFit { over, values, r2: 1.0 - left / scatter, ends, spread, sensitivity: PhantomData })
}

impl<D: LawCurve> LawFit<D> {
    /// Returns the sensitivity at a value of the quantity.
    pub fn sensitivity(&self, at: f64) -> Estimate<D> {
        let [inverse, half] = self.combined(self.of_inverse(at));
        Estimate::new(1.0 / inverse, 1.0 / (inverse + half), 1.0 / (inverse - half))
    }

    /// Returns the critical dose at a value of the quantity.
    pub fn critical_dose(&self, at: f64) -> Estimate<Dose> {
        let [dose, half] = self.combined(self.of_critical_dose(at));
        Estimate::even(dose, half)
    }

    /// Returns the line of `1/D`, in [`LawCurve::INVERSE`], over the quantity.
    pub fn inverse_line(&self) -> LawLine {
        let [from, to] = self.range();
        self.line([0, 1], from, to)
    }

    /// Returns the line of `E_c`, in mJ/cm², over the quantity, or over the inverse of a
    /// photoinitiator.
    pub fn critical_dose_line(&self) -> LawLine {
        let [from, to] = self.range().map(|at| self.over.of_critical_dose(at));
        self.line([2, 3], from, to)
    }

    /// Returns the depth or width of a dose at a value of the quantity, with its 95% interval.
    pub fn measure(&self, at: f64, dose: Dose) -> Estimate<Length> {
        let shares = shares(self.over, self.range(), at);
        let (value, slopes) = curve::<D>(&self.ends, shares, dose.mj_per_cm2());
        let half = self.half(slopes);
        Estimate::even(value, half)
    }

    /// Returns the least and the greatest value of the quantity.
    pub fn range(&self) -> [f64; 2] {
        [self.values[0].0, self.values[self.values.len() - 1].0]
    }

    fn of_inverse(&self, at: f64) -> [f64; 4] {
        let [share, _] = shares(self.over, self.range(), at);
        [1.0 - share, share, 0.0, 0.0]
    }

    fn of_critical_dose(&self, at: f64) -> [f64; 4] {
        let [_, share] = shares(self.over, self.range(), at);
        [0.0, 0.0, 1.0 - share, share]
    }

    fn line(&self, [first, last]: [usize; 2], from: f64, to: f64) -> LawLine {
        let number = |of_first: f64, of_last: f64| {
            let mut weights = [0.0; 4];
            (weights[first], weights[last]) = (of_first, of_last);
            let [value, half] = self.combined(weights);
            [value, value - half, value + half]
        };
        let over = to - from;
        LawLine { at_zero: number(to / over, -from / over), rise: number(-1.0 / over, 1.0 / over) }
    }

    /// Returns a sum of the ends by weights, and half of its interval.
    fn combined(&self, weights: [f64; 4]) -> [f64; 2] {
        [dot(&weights, &self.ends), self.half(weights)]
    }

    fn half(&self, slopes: [f64; 4]) -> f64 {
        dot(&slopes, &product(&self.spread, &slopes)).max(0.0).sqrt()
    }
}

impl LawFit<Length> {
    /// Returns the numbers at a value for a material file, without a range.
    pub fn numbers(&self, at: f64, source: &str) -> CurveNumbers {
        CurveNumbers {
            critical_dose: self.critical_dose(at).given(source),
            penetration_depth: self.sensitivity(at).given(source),
            measured: None,
        }
    }

    /// Returns the broadening depth `B_d = D_p^d ln(E_c^w/E_c^d)` at a value (002 eq. 61, figures 89
    /// and 94), with its 95% interval by the errors of both fits. It is below zero where edges grow
    /// before anything cures in depth.
    pub fn broadening_depth(&self, widths: &LawFit<WidthSensitivity>, at: f64) -> Estimate<Length> {
        let depth = self.sensitivity(at).value.um();
        let critical = self.critical_dose(at).value.mj_per_cm2();
        let broad = widths.critical_dose(at).value.mj_per_cm2();
        let folds = (broad / critical).ln();
        // Over 1/D and both doses; films and squares are measured apart.
        let mut slopes = self.of_inverse(at).map(|weight| -depth * depth * folds * weight);
        for (slope, weight) in slopes.iter_mut().zip(self.of_critical_dose(at)) {
            *slope -= depth / critical * weight;
        }
        let of_width = widths.of_critical_dose(at).map(|weight| depth / broad * weight);
        Estimate::even(depth * folds, self.half(slopes).hypot(widths.half(of_width)))
    }
}

impl LawFit<WidthSensitivity> {
    /// Returns the numbers of squares of a size at a value for a material file, without a range.
    pub fn numbers(&self, at: f64, feature_size: Length, source: &str) -> WidthNumbers {
        WidthNumbers {
            feature_size,
            direction: None,
            critical_dose: self.critical_dose(at).given(source),
            sensitivity: self.sensitivity(at).given(source),
            measured: None,
        }
    }
}

/// Returns the law that fits of depths and of widths make, for a material file. With both, it holds
/// where both were measured.
///
/// # Errors
/// Returns an error if films and squares have no two values in common.
pub fn law_numbers(
    table: &LawTable,
    films: Option<&LawFit<Length>>,
    squares: Option<&LawFit<WidthSensitivity>>,
    source: &str,
) -> Result<LawNumbers, FitError> {
    let ranges = films.map(LawFit::range).into_iter().chain(squares.map(LawFit::range));
    let [from, to] = ranges.fold([0.0, f64::INFINITY], |[from, to], [least, most]| {
        [f64::max(from, least), f64::min(to, most)]
    });
    if from >= to {
        return Err(FitError::TooFewValues { over: table.over, values: 0, needed: LEAST_VALUES });
    }
    // Points at other values determine the lines, too, but the law does not reach there.
    let range = |points: &[LawPoint], films| {
        let within = points.iter().filter(|point| (from..=to).contains(&point.at)).copied();
        let extent = Extent::of_law(&within.collect::<Vec<_>>(), films);
        extent.map(|extent| extent.measured(source))
    };
    let [of_films, of_squares] = [(&table.films, true), (&table.squares, false)]
        .map(|(points, is_films)| range(points, is_films));
    let end = |at| LawEnd {
        at,
        depth: films
            .map(|fit| CurveNumbers { measured: of_films.clone(), ..fit.numbers(at, source) }),
        width: squares.zip(table.feature_size).map(|(fit, size)| WidthNumbers {
            measured: of_squares.clone(),
            ..fit.numbers(at, size, source)
        }),
    };
    Ok(LawNumbers { over: table.over, held: table.held, least: end(from), most: end(to) })
}

/// A point and its shares of the way from the least to the greatest value, for `1/D` and `E_c`.
#[derive(Clone, Copy)]
struct PlacedPoint {
    shares: [f64; 2],
    dose: f64,
    measured: f64,
}

fn shares(over: LawVariable, [from, to]: [f64; 2], at: f64) -> [f64; 2] {
    let share = |of: &dyn Fn(f64) -> f64| (of(at) - of(from)) / (of(to) - of(from));
    [share(&|at| at), share(&|at| over.of_critical_dose(at))]
}

/// Returns the curve's value, and its derivatives over the ends.
fn curve<D: LawCurve>(ends: &[f64; 4], shares: [f64; 2], dose: f64) -> (f64, [f64; 4]) {
    let at = |[first, last]: [f64; 2], share: f64| first + share * (last - first);
    let inverse = at([ends[0], ends[1]], shares[0]);
    let critical = at([ends[2], ends[3]], shares[1]);
    let [rise, by_critical] = D::rise(dose, critical);
    let value = rise / inverse;
    let [by_inverse, by_critical] = [-value / inverse, by_critical / inverse];
    let slopes = [
        (1.0 - shares[0]) * by_inverse,
        shares[0] * by_inverse,
        (1.0 - shares[1]) * by_critical,
        shares[1] * by_critical,
    ];
    (value, slopes)
}

/// Returns the sum of squared residuals, infinite where an end is not above zero.
fn squares<D: LawCurve>(ends: &[f64; 4], points: &[PlacedPoint]) -> f64 {
    if !ends.iter().all(|end| *end > 0.0) {
        return f64::INFINITY;
    }
    let residual = |p: &PlacedPoint| p.measured - curve::<D>(ends, p.shares, p.dose).0;
    let sum: f64 = points.iter().map(|point| residual(point).powi(2)).sum();
    if sum.is_finite() { sum } else { f64::INFINITY }
}

fn normal<D: LawCurve>(ends: &[f64; 4], points: &[PlacedPoint]) -> ([[f64; 4]; 4], [f64; 4]) {
    let (mut matrix, mut vector) = ([[0.0; 4]; 4], [0.0; 4]);
    for point in points {
        let (value, slopes) = curve::<D>(ends, point.shares, point.dose);
        for i in 0..4 {
            vector[i] += slopes[i] * (point.measured - value);
            for j in 0..4 {
                matrix[i][j] += slopes[i] * slopes[j];
            }
        }
    }
    (matrix, vector)
}

/// Returns the ends of least squares. Widths bend, so that there may be several places to end at: the
/// search begins at critical doses of several sizes on both ends.
fn best<D: LawCurve>(points: &[PlacedPoint], slope: f64) -> Option<[f64; 4]> {
    let least = points.iter().map(|point| point.dose).fold(f64::INFINITY, f64::min);
    let most = points.iter().map(|point| point.dose).fold(0.0, f64::max);
    let criticals = [0.1, 0.3, 0.5, 0.7].map(|share| least * (most / least).powf(share));
    let criticals = [0.5 * least].into_iter().chain(criticals);
    let starts = criticals.clone().flat_map(|a| criticals.clone().map(move |b| [a, b]));
    let mut starts: Vec<_> = starts.map(|[a, b]| [1.0 / slope, 1.0 / slope, a, b]).collect();
    starts.sort_by(|a, b| squares::<D>(a, points).total_cmp(&squares::<D>(b, points)));
    let ends = starts.iter().take(6).filter_map(|start| {
        least_squares::fitted(
            *start,
            |ends| squares::<D>(ends, points),
            |ends| normal::<D>(ends, points),
            |ends, step: [f64; 4]| std::array::from_fn(|i| ends[i] + step[i]),
        )
    });
    ends.min_by(|a, b| squares::<D>(a, points).total_cmp(&squares::<D>(b, points)))
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::SplitMix;

    use super::super::made_up::share_held;
    use super::*;

    /// The concentrations of 002 tables 8 and 9.
    const ABSORBER: [f64; 5] = [0.0, 0.0625, 0.125, 0.1875, 0.25];
    const INITIATOR: [f64; 5] = [2.0, 4.0, 6.0, 8.0, 10.0];

    /// Made-up truths: `1/D` and `E_c` at zero, and their rise.
    struct Truth {
        over: LawVariable,
        inverse: [f64; 2],
        critical: [f64; 2],
    }

    impl Truth {
        fn at(&self, at: f64) -> [f64; 2] {
            let line = |[zero, rise]: [f64; 2], x: f64| zero + rise * x;
            let x = if self.over == LawVariable::Photoinitiator { 1.0 / at } else { at };
            [1.0 / line(self.inverse, at), line(self.critical, x)]
        }

        fn points(
            &self,
            values: &[f64],
            doses: &[f64],
            spread: f64,
            noise: &mut SplitMix,
            width: bool,
        ) -> Vec<LawPoint> {
            let mut points = Vec::new();
            for &at in values {
                let [sensitivity, critical] = self.at(at);
                for &mj in doses {
                    let rise = if width { (mj - critical).max(0.0) } else { (mj / critical).ln() };
                    let um = sensitivity * rise + spread * noise.normal();
                    // Films that do not cure are not measured.
                    if width || sensitivity * rise > 5.0 * spread {
                        let (dose, measured) = (Dose::from_mj_per_cm2(mj), Length::from_um(um));
                        points.push(LawPoint { at, dose, measured });
                    }
                }
            }
            points
        }
    }

    const FILMS: [f64; 6] = [150.0, 250.0, 400.0, 600.0, 900.0, 1400.0];
    const SQUARES: [f64; 10] =
        [60.0, 120.0, 180.0, 240.0, 300.0, 360.0, 420.0, 480.0, 540.0, 600.0];

    fn truths() -> [(Truth, Truth, [f64; 5]); 2] {
        let over = LawVariable::UvAbsorber;
        let absorber = (
            Truth { over, inverse: [0.0016, 0.016], critical: [40.0, 240.0] },
            Truth { over, inverse: [5.0, 30.0], critical: [80.0, 600.0] },
            ABSORBER,
        );
        let over = LawVariable::Photoinitiator;
        let initiator = (
            Truth { over, inverse: [0.0011, 0.00012], critical: [20.0, 100.0] },
            Truth { over, inverse: [4.0, 0.4], critical: [60.0, 400.0] },
            INITIATOR,
        );
        [absorber, initiator]
    }

    fn near(found: f64, wanted: f64) {
        assert!((found - wanted).abs() < 1e-6 * wanted.abs(), "{found} for {wanted}");
    }

    #[test]
    fn a_law_states_the_range_of_the_measurements_within_it() {
        let mut noise = SplitMix(2);
        let [(depth, width, values), _] = truths();
        let mut films = depth.points(&values, &FILMS, 0.0, &mut noise, false);
        // Beyond the squares: more dose than any other film got, and the deepest film.
        let dose = Dose::from_mj_per_cm2(5000.0);
        films.push(LawPoint { at: 0.0, dose, measured: Length::from_um(3000.0) });
        let squares = width.points(&values[1..], &SQUARES, 0.0, &mut noise, true);
        let table = LawTable {
            over: depth.over,
            held: None,
            films: films.clone(),
            squares: squares.clone(),
            feature_size: Some(Length::from_um(8000.0)),
        };
        let of_films = fit_law::<Length>(depth.over, &films).unwrap();
        let of_squares = fit_law::<WidthSensitivity>(width.over, &squares).unwrap();
        let both = law_numbers(&table, Some(&of_films), Some(&of_squares), "a").unwrap();
        let alone = law_numbers(&table, Some(&of_films), None, "a").unwrap();
        let doses = |law: &LawNumbers| {
            let measured = law.least.depth.as_ref().unwrap().measured.as_ref().unwrap();
            let deepest = measured.depths.as_ref().unwrap().to;
            ([measured.doses.from, measured.doses.to].map(Dose::mj_per_cm2), deepest)
        };
        let within = films.iter().filter(|film| film.at >= values[1]);
        let deepest = within.clone().map(|film| film.measured.um()).fold(0.0, f64::max);
        let least = within.map(|film| film.dose.mj_per_cm2()).fold(f64::INFINITY, f64::min);
        assert_eq!(both.least.at, values[1]);
        let (range, depth) = doses(&both);
        assert_eq!((range, depth.um()), ([least, 1400.0], deepest));
        assert_eq!((doses(&alone).0[1], doses(&alone).1.um()), (5000.0, 3000.0));
    }

    #[test]
    fn exact_points_give_slopes_and_intercepts_back() {
        let mut noise = SplitMix(1);
        for (depth, width, values) in truths() {
            let films = depth.points(&values, &FILMS, 0.0, &mut noise, false);
            let squares = width.points(&values, &SQUARES, 0.0, &mut noise, true);
            let films = fit_law::<Length>(depth.over, &films).unwrap();
            let squares = fit_law::<WidthSensitivity>(width.over, &squares).unwrap();
            for (line, truth) in [
                (films.inverse_line(), depth.inverse),
                (films.critical_dose_line(), depth.critical),
                (squares.inverse_line(), width.inverse),
                (squares.critical_dose_line(), width.critical),
            ] {
                near(line.at_zero[0], truth[0]);
                near(line.rise[0], truth[1]);
            }
            for at in values {
                let [[dp, ec], [slope, broad]] = [depth.at(at), width.at(at)];
                near(films.sensitivity(at).value.um(), dp);
                near(squares.sensitivity(at).value.um_per_mj_per_cm2(), slope);
                // 002 eq. 61.
                let bd = films.broadening_depth(&squares, at).value.um();
                near(bd, dp * (broad / ec).ln());
            }
        }
    }

    #[test]
    fn broadening_depths_fall_over_both_ingredients() {
        // 002 figures 89 and 94: B_d falls over the absorber and over the photoinitiator.
        let mut noise = SplitMix(2);
        for (depth, width, values) in truths() {
            let films = depth.points(&values, &FILMS, 3.0, &mut noise, false);
            let squares = width.points(&values, &SQUARES, 1.0, &mut noise, true);
            let films = fit_law::<Length>(depth.over, &films).unwrap();
            let squares = fit_law::<WidthSensitivity>(width.over, &squares).unwrap();
            let depths = values.map(|at| films.broadening_depth(&squares, at).value.um());
            assert!(depths.is_sorted_by(|a, b| a > b), "{depths:?}");
        }
    }

    #[test]
    fn of_400_trials_95_percent_of_the_intervals_hold_the_truth() {
        for (depth, width, values) in truths() {
            let mut noise = SplitMix(41);
            let fits = (0..400).map(|_| {
                let films = depth.points(&values, &FILMS, 5.0, &mut noise, false);
                let squares = width.points(&values, &SQUARES, 2.0, &mut noise, true);
                Ok((
                    fit_law::<Length>(depth.over, &films)?,
                    fit_law::<WidthSensitivity>(width.over, &squares)?,
                ))
            });
            let held = share_held(fits, |(films, squares)| {
                let holds = |[_, low, high]: [f64; 3], truth: f64| low <= truth && truth <= high;
                let middle = values[1];
                let [dp, ec] = depth.at(middle);
                let [slope, broad] = width.at(middle);
                let bd = films.broadening_depth(squares, middle);
                [
                    holds(films.inverse_line().at_zero, depth.inverse[0]),
                    holds(films.inverse_line().rise, depth.inverse[1]),
                    holds(films.critical_dose_line().at_zero, depth.critical[0]),
                    holds(films.critical_dose_line().rise, depth.critical[1]),
                    holds(squares.inverse_line().at_zero, width.inverse[0]),
                    holds(squares.inverse_line().rise, width.inverse[1]),
                    holds(squares.critical_dose_line().at_zero, width.critical[0]),
                    holds(squares.critical_dose_line().rise, width.critical[1]),
                    films.sensitivity(middle).holds(Length::from_um(dp)),
                    films.critical_dose(middle).holds(Dose::from_mj_per_cm2(ec)),
                    squares
                        .sensitivity(middle)
                        .holds(WidthSensitivity::from_um_per_mj_per_cm2(slope)),
                    squares.critical_dose(middle).holds(Dose::from_mj_per_cm2(broad)),
                    bd.holds(Length::from_um(dp * (broad / ec).ln())),
                ]
            });
            // 95% +- 3.3% is three standard deviations of 400 trials.
            assert!(held.iter().all(|share| (share - 0.95).abs() < 0.033), "{held:?}");
        }
    }

    #[test]
    fn derivatives_are_differences() {
        let ends = [0.002, 0.006, 50.0, 120.0];
        let differences = |of: &dyn Fn(&[f64; 4]) -> f64| -> [f64; 4] {
            std::array::from_fn(|i| {
                let moved = |by: f64| {
                    let mut moved = ends;
                    moved[i] *= 1.0 + by;
                    of(&moved)
                };
                (moved(1e-5) - moved(-1e-5)) / (2e-5 * ends[i])
            })
        };
        let depth = |ends: &[f64; 4]| curve::<Length>(ends, [0.3, 0.6], 400.0);
        let width = |ends: &[f64; 4]| curve::<WidthSensitivity>(ends, [0.3, 0.6], 400.0);
        for (slopes, found) in [
            (depth(&ends).1, differences(&|ends| depth(ends).0)),
            (width(&ends).1, differences(&|ends| width(ends).0)),
        ] {
            for (slope, found) in slopes.iter().zip(found) {
                assert!((slope - found).abs() < 1e-6 * slope.abs(), "{slope} {found}");
            }
        }
    }

    #[test]
    fn points_that_show_no_law_are_refused() {
        let (depth, _, values) = &truths()[0];
        let mut noise = SplitMix(5);
        let mut films = |values: &[f64], spread: f64| {
            let films = depth.points(values, &FILMS, 0.0, &mut noise, false);
            let spread = films.into_iter().map(|film| {
                let um = film.measured.um() + spread * noise.normal();
                LawPoint { measured: Length::from_um(um), ..film }
            });
            fit_law::<Length>(depth.over, &spread.collect::<Vec<_>>())
        };
        let two = films(&values[..2], 1.0).unwrap_err();
        assert_eq!(two.to_string(), "2 values of uv-absorber are too few: 3 are the least");
        let scattered = films(values, 800.0).unwrap_err().to_string();
        assert!(scattered.contains("scatter") || scattered.contains("determine"), "{scattered}");
        let none = fit_law::<Length>(depth.over, &[]).unwrap_err();
        assert!(none.to_string().starts_with("0 values of uv-absorber are"), "{none}");
    }
}
