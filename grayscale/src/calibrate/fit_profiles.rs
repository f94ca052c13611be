//! Fits how light spreads and fades, and how gray levels pass it, to measured profiles of squares.

use std::f64::consts::SQRT_2;

use lamp_stack::{Length, round_significant};

use super::extent::Extent;
use super::least_squares;
use super::matrix::inverse;
use super::measurements::ProfilePoint;
use super::student_t::t_95;
use super::{Estimate, FitError, given_number};
use crate::material::{CurveNumbers, GivenNumber, SpreadNumbers};
use crate::resin::{Dose, GrayLevel, Spread};

/// The spread and the depth of light, found from profiles.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileFit {
    /// `σ`, how far light spreads.
    pub sigma: Estimate<Length>,
    /// `D_p`, over which light fades to 1/e.
    pub penetration_depth: Estimate<Length>,
    /// `γ`, the exponent of light over the gray level: its value, and its interval from and to. `None`
    /// if all squares are white.
    pub gamma: Option<[f64; 3]>,
    /// `E_c`, the dose at the edge of the profile. `None` if the points have no doses.
    pub critical_dose: Option<Estimate<Dose>>,
    /// The root mean square of the distances of points from their profiles.
    pub misfit: Length,
    /// The number of points.
    pub points: usize,
    extent: Option<Extent>,
    model: ProfileModel,
}

/// The fewest points more than numbers.
const LEAST_MORE: usize = 3;
/// The widest interval: from the value over e to e times the value.
const WIDEST_LOG: f64 = 1.0;
/// The widest misfit, as a share of the deepest point: beyond it, other things made the profiles.
const WIDEST_MISFIT: f64 = 0.1;
/// The numbers that are fitted: `σ`, `D_p`, `E_c` and `γ`.
const NUMBERS: usize = 4;
/// The steps to the foot of a point. Each is nearer by as much as its profile is straight.
const FOOT_STEPS: usize = 4;
/// The number that only gray squares show.
const GAMMA: usize = 3;

/// Fits `σ`, `D_p`, `γ` and `E_c` to the edges of squares that were cured, or of their light in the vat,
/// seen from the side: at the depth `z` and at `x` from the middle of a square of the side `w` and the
/// gray level `G`, light is `E G^γ S(x) exp(-z / D_p)`, with `S(x) = 1/2 (erf((w/2 - x) / √2 σ) +
/// erf((w/2 + x) / √2 σ)) erf(w / √8 σ)` in the plane through its middle, and the edge has `E_c` (001 eq. 1
/// to 5, 10 and section 5).
///
/// Least squares of distances of points from their profiles: both coordinates have errors. Intervals
/// come from the covariance, by Student's t, on a logarithmic scale. If points have no doses, all were
/// lit alike, and the critical dose stays unknown.
///
/// # Errors
/// Returns an error if there are too few points, if no square is white, if nothing fits, or if the points
/// do not show a number.
pub fn fit_profiles(points: &[ProfilePoint]) -> Result<ProfileFit, FitError> {
    let grays = points.iter().any(|point| point.gray != GrayLevel::WHITE);
    let needed = LEAST_MORE + if grays { NUMBERS } else { NUMBERS - 1 };
    if points.len() < needed {
        return Err(FitError::TooFewProfilePoints { points: points.len(), needed });
    }
    if points.iter().all(|point| point.gray != GrayLevel::WHITE) {
        return Err(FitError::NoWhiteProfile);
    }
    let with_doses = points.iter().filter(|point| point.dose.is_some()).count();
    if with_doses != 0 && with_doses != points.len() {
        return Err(FitError::SomeDoses { with: with_doses, all: points.len() });
    }
    // A table of one half of a square lies around 0.35 sides; from its left edge, around 0.5.
    let white = || points.iter().filter(|point| point.gray == GrayLevel::WHITE);
    let places = || white().map(|point| point.place.um());
    let middle =
        (places().fold(f64::INFINITY, f64::min) + places().fold(f64::NEG_INFINITY, f64::max)) / 2.0;
    let widest = white().map(|point| point.side.um()).fold(0.0, f64::max);
    if middle.abs() > 0.42 * widest {
        return Err(FitError::OffMiddle(middle));
    }
    let model = ProfileModel::starts(points, grays)
        .into_iter()
        .filter_map(|start| start.fitted(points))
        .min_by(|a, b| a.squares(points).total_cmp(&b.squares(points)))
        .ok_or(FitError::NoProfileFit)?;
    let left = model.squares(points);
    let free = points.len() + LEAST_MORE - needed;
    let times = t_95(free).powi(2) * left / free as f64;
    let (matrix, _) = model.normal(points);
    let vague =
        |what, unit, [low, high]: [f64; 2]| FitError::VagueProfiles { what, low, high, unit };
    let spreads = [0.0, Spread::WIDEST.um()];
    let covariance = inverse(matrix).ok_or_else(|| vague("the spread", "um", spreads))?;
    let half = |of: usize| (covariance[of][of] * times).max(0.0).sqrt();
    let names = ["the spread", "the penetration depth", "the critical dose", "gamma"];
    let units = ["um", "um", "mJ/cm2", ""];
    let numbers = model.logs.map(f64::exp);
    let mut ends = [[0.0; 2]; NUMBERS];
    for (of, value) in numbers.into_iter().enumerate() {
        let is_fitted = grays || of != GAMMA;
        let [low, high] = [-half(of), half(of)].map(|half| value * half.exp());
        ends[of] = [low, high];
        let is_known = half(of) < WIDEST_LOG;
        if is_fitted && !is_known {
            // Without doses, the third is the light over the edge's.
            let name = if of == 2 && with_doses == 0 { "the light" } else { names[of] };
            let unit = if of == 2 && with_doses == 0 { "" } else { units[of] };
            return Err(vague(name, unit, [low, high]));
        }
    }
    let misfit = (left / points.len() as f64).sqrt();
    let deepest = points.iter().map(|point| point.depth.um()).fold(0.0, f64::max);
    if misfit > WIDEST_MISFIT * deepest {
        return Err(FitError::NoProfileFit);
    }
    let length = |of: usize| Estimate::new(numbers[of], ends[of][0], ends[of][1]);
    Ok(ProfileFit {
        sigma: length(0),
        penetration_depth: length(1),
        gamma: grays.then_some([numbers[GAMMA], ends[GAMMA][0], ends[GAMMA][1]]),
        critical_dose: (with_doses > 0).then(|| Estimate::new(numbers[2], ends[2][0], ends[2][1])),
        misfit: Length::from_um(misfit),
        points: points.len(),
        extent: Extent::of_doses(points.iter().filter_map(|point| {
            // The dose behind the gray level.
            let passed = point.gray.get().powf(numbers[GAMMA]);
            point
                .dose
                .map(|dose| Dose::from_mj_per_cm2(round_significant(dose.mj_per_cm2() * passed, 6)))
        })),
        model,
    })
}

impl ProfileFit {
    /// Returns the depth of the edge below a place of a point's square, at a distance from its middle;
    /// `None` beyond the edge.
    pub fn depth(&self, point: &ProfilePoint, place: Length) -> Option<Length> {
        let (excess, _) =
            self.model.excess(&ProfilePoint { place, depth: Length::from_um(0.0), ..*point });
        let depth = excess * self.model.logs[1].exp();
        (depth > 0.0).then(|| Length::from_um(depth))
    }

    /// Returns the spread for a material file.
    pub fn spread(&self, source: &str) -> SpreadNumbers {
        SpreadNumbers { sigma: Some(self.sigma.given(source)), ..SpreadNumbers::default() }
    }

    /// Returns the exponent of light over the gray level for a material file, if it is known.
    pub fn gamma_number(&self, source: &str) -> Option<GivenNumber> {
        Some(given_number(self.gamma?, source))
    }

    /// Returns the working curve for a material file, if the critical dose is known.
    pub fn curve(&self, source: &str) -> Option<CurveNumbers> {
        Some(CurveNumbers {
            critical_dose: self.critical_dose?.given(source),
            penetration_depth: self.penetration_depth.given(source),
            measured: self.extent.map(|extent| extent.measured(source)),
        })
    }
}

/// `σ` and `D_p` in um, `E_c` in mJ/cm² or as a share of white's light, and `γ`, as logarithms.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ProfileModel {
    logs: [f64; NUMBERS],
    /// Whether gray levels show `γ`.
    grays: bool,
}

impl ProfileModel {
    /// Returns the most promising places to search from.
    fn starts(points: &[ProfilePoint], grays: bool) -> Vec<Self> {
        let greatest = |of: fn(&ProfilePoint) -> f64| points.iter().map(of).fold(0.0, f64::max);
        let (side, depth) = (greatest(|it| it.side.um()), greatest(|it| it.depth.um()));
        let mut starts = Vec::new();
        for sigma in [0.01, 0.03, 0.1, 0.3, 1.0] {
            for fading in [0.15, 0.3, 0.6, 1.2] {
                for gamma in if grays { &[0.7_f64, 1.5, 3.0][..] } else { &[1.0] } {
                    let [sigma, fading] = [(sigma * side).ln(), (fading * depth).ln()];
                    let mut start = Self { logs: [sigma, fading, 0.0, gamma.ln()], grays };
                    // The critical dose that leaves no excess on the mean of points in light.
                    let excesses = points.iter().map(|point| start.excess(point).0);
                    let all: Vec<f64> = excesses.filter(|excess| *excess > -20.0).collect();
                    start.logs[2] = all.iter().sum::<f64>() / all.len().max(1) as f64;
                    starts.push(start);
                }
            }
        }
        // The first step to the foot of each point orders them well enough.
        let near = |start: &Self| {
            let squares = points.iter().map(|point| {
                let (excess, slope) = start.excess(point);
                (excess / slope.hypot((-start.logs[1]).exp())).powi(2)
            });
            squares.sum::<f64>()
        };
        starts.sort_by(|a, b| near(a).total_cmp(&near(b)));
        starts.truncate(3);
        starts
    }

    /// Returns the logarithm of the light at a point over the edge's, and its slope over the place in 1/um.
    fn excess(&self, point: &ProfilePoint) -> (f64, f64) {
        let [sigma, fading, critical, gamma] = self.logs;
        let (sigma, fading, gamma) = (sigma.exp(), fading.exp(), gamma.exp());
        let ProfilePoint { gray, side, place, depth, dose } = point;
        let (half, place) = (side.um() / 2.0, place.um());
        let [near, far] = [half - place, half + place].map(|at| at / (SQRT_2 * sigma));
        // erfc keeps the digits of what is far outside.
        let share = if near < 0.0 {
            0.5 * (libm::erfc(-near) - libm::erfc(far))
        } else if far < 0.0 {
            0.5 * (libm::erfc(-far) - libm::erfc(near))
        } else {
            0.5 * (libm::erf(near) + libm::erf(far))
        };
        let share = share.max(f64::MIN_POSITIVE);
        let across = libm::erf(half / (SQRT_2 * sigma)).max(f64::MIN_POSITIVE);
        let bell = |at: f64| (-at * at).exp() / (SQRT_2 * sigma * std::f64::consts::PI.sqrt());
        let slope = (bell(far) - bell(near)) / share;
        let dose = dose.map_or(1.0, Dose::mj_per_cm2);
        let light = dose.ln() + gamma * gray.get().ln() + (share * across).ln();
        (light - critical - depth.um() / fading, slope)
    }

    /// Returns the foot of a point on its profile, and its distance in um, inside above zero.
    fn foot(&self, point: &ProfilePoint) -> (ProfilePoint, f64) {
        let fall = -(-self.logs[1]).exp();
        let mut away = [0.0; 2];
        let mut foot = *point;
        let mut inside = 0.0;
        // Each step goes to where the profile would be if it were straight.
        for step in 0..FOOT_STEPS {
            let (excess, slope) = self.excess(&foot);
            if step == 0 {
                inside = excess;
            }
            let along = (excess - slope * away[0] - fall * away[1]) / (slope * slope + fall * fall);
            away = [-slope * along, -fall * along];
            foot.place = Length::from_um(point.place.um() + away[0]);
            foot.depth = Length::from_um(point.depth.um() + away[1]);
        }
        (foot, away[0].hypot(away[1]).copysign(inside))
    }

    fn squares(&self, points: &[ProfilePoint]) -> f64 {
        let sum: f64 = points.iter().map(|point| self.foot(point).1.powi(2)).sum();
        if sum.is_nan() { f64::INFINITY } else { sum }
    }

    /// Returns the normal equations. Numbers that are not fitted have a one.
    ///
    /// A number moves a profile at the foot of a point by the slope of the light's logarithm over the
    /// number, divided by its gradient over the place.
    fn normal(&self, points: &[ProfilePoint]) -> ([[f64; NUMBERS]; NUMBERS], [f64; NUMBERS]) {
        const STEP: f64 = 1e-5;
        let [less, more] = [-STEP, STEP].map(|by| {
            let mut other = *self;
            other.logs[0] += by;
            other
        });
        let fall = (-self.logs[1]).exp();
        let (mut matrix, mut vector) = ([[0.0; NUMBERS]; NUMBERS], [0.0; NUMBERS]);
        for point in points {
            let (foot, distance) = self.foot(point);
            let gradient = self.excess(&foot).1.hypot(fall);
            let of_gray = self.logs[GAMMA].exp() * foot.gray.get().ln();
            let slopes = [
                (more.excess(&foot).0 - less.excess(&foot).0) / (2.0 * STEP),
                foot.depth.um() * fall,
                -1.0,
                if self.grays { of_gray } else { 0.0 },
            ]
            .map(|slope| slope / gradient);
            for i in 0..NUMBERS {
                vector[i] -= slopes[i] * distance;
                for j in 0..NUMBERS {
                    matrix[i][j] += slopes[i] * slopes[j];
                }
            }
        }
        if !self.grays {
            matrix[GAMMA][GAMMA] = 1.0;
        }
        (matrix, vector)
    }

    fn fitted(self, points: &[ProfilePoint]) -> Option<Self> {
        least_squares::fitted(
            self,
            |model| model.squares(points),
            |model| model.normal(points),
            |model, step: [f64; NUMBERS]| Self {
                logs: std::array::from_fn(|of| model.logs[of] + step[of].clamp(-1.0, 1.0)),
                ..*model
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::SplitMix;
    use lamp_stack::Catalogued;

    use super::super::made_up::share_held;
    use super::*;
    use crate::material::Material;

    /// The light of a square over a wide field's in the plane through its middle, by brute force: the sum
    /// of Gaussians of small cells.
    fn share(side: f64, x: f64, sigma: f64) -> f64 {
        let cells = 4000;
        let cell = side / f64::from(cells);
        let sum = |at: f64| -> f64 {
            let of_cell = |k: i32| {
                let away = (f64::from(k) + 0.5) * cell - side / 2.0 - at;
                (-away * away / (2.0 * sigma * sigma)).exp()
            };
            let norm = cell / (sigma * (2.0 * std::f64::consts::PI).sqrt());
            (0..cells).map(of_cell).sum::<f64>() * norm
        };
        sum(x) * sum(0.0)
    }

    /// The edges of squares of four gray levels (001 figure 5), at 12 places each, without errors.
    fn squares(
        [sigma, fading, critical, gamma]: [f64; 4],
        dose: f64,
        side: f64,
    ) -> Vec<ProfilePoint> {
        let mut points = Vec::new();
        for gray in [1.0, 0.75, 0.5, 0.25] {
            for step in -6..6 {
                let place = f64::from(step) * 1.4 * side / 12.0;
                let light = dose * f64::powf(gray, gamma) * share(side, place, sigma);
                let depth = fading * (light / critical).ln();
                if depth > 0.0 {
                    points.push(ProfilePoint {
                        gray: GrayLevel::new(gray).unwrap(),
                        side: Length::from_um(side),
                        place: Length::from_um(place),
                        depth: Length::from_um(depth),
                        dose: Some(Dose::from_mj_per_cm2(dose)),
                    });
                }
            }
        }
        points
    }

    fn values(fit: &ProfileFit) -> [f64; 4] {
        let critical = fit.critical_dose.map_or(f64::NAN, |dose| dose.value.mj_per_cm2());
        let [sigma, fading] = [fit.sigma, fit.penetration_depth].map(|it| it.value.um());
        [sigma, fading, critical, fit.gamma.map_or(f64::NAN, |gamma| gamma[0])]
    }

    #[test]
    fn profiles_give_their_light_back() {
        for (truth, dose, side) in [
            ([146.0, 125.0, 1.0, 2.404], 40.0, 900.0),
            ([25.0, 210.0, 100.0, 1.0], 2000.0, 400.0),
            ([80.0, 60.0, 30.0, 1.7], 4000.0, 250.0),
        ] {
            let points = squares(truth, dose, side);
            let fit = fit_profiles(&points).unwrap();
            for (found, truth) in values(&fit).into_iter().zip(truth) {
                assert!((found / truth - 1.0).abs() < 1e-5, "{found} of {truth}: {fit:?}");
            }
            for point in &points {
                let depth = fit.depth(point, point.place).unwrap();
                assert!((depth.um() - point.depth.um()).abs() < 1e-3);
            }
            // Without doses, all but the critical dose is the same.
            let undosed: Vec<_> =
                points.iter().map(|it| ProfilePoint { dose: None, ..*it }).collect();
            let bare = fit_profiles(&undosed).unwrap();
            assert_eq!((bare.critical_dose, bare.curve("a test")), (None, None));
            assert!((bare.sigma.value.um() / truth[0] - 1.0).abs() < 1e-5, "{bare:?}");
            // White squares alone show no gamma.
            let white: Vec<_> =
                points.iter().filter(|it| it.gray == GrayLevel::WHITE).copied().collect();
            let white = fit_profiles(&white).unwrap();
            assert_eq!((white.gamma, white.gamma_number("a test")), (None, None));
            assert!((white.sigma.value.um() / truth[0] - 1.0).abs() < 1e-5, "{white:?}");
        }
    }

    /// 001 section 5: four squares give the numbers of its resin.
    #[test]
    fn squares_of_the_source_give_its_resin() {
        let resin = Material::builtin("zsg-amber").unwrap();
        let sigma = resin.spread.as_ref().unwrap().sigma.as_ref().unwrap().value.um();
        let curve = resin.working_curve.as_ref().unwrap();
        let [fading, critical] =
            [curve.penetration_depth.value.um(), curve.critical_dose.value.mj_per_cm2()];
        let gamma = resin.gamma.as_ref().unwrap().value;
        assert_eq!(gamma, 2.404);
        let truth = [sigma, fading, critical, gamma];
        let fit = fit_profiles(&squares(truth, 60.0 * critical, 8.0 * sigma)).unwrap();
        for (found, truth) in values(&fit).into_iter().zip(truth) {
            assert!((found / truth - 1.0).abs() < 1e-4, "{found} of {truth}");
        }
    }

    #[test]
    fn with_errors_the_intervals_hold_the_truth() {
        let truth = [60.0, 125.0, 20.0, 1.8];
        let exact = squares(truth, 600.0, 500.0);
        let mut noise = SplitMix(7);
        let mut fit = || {
            let mut off = |length: Length| Length::from_um(length.um() + 4.0 * noise.normal());
            let measured = exact.iter().map(|it| ProfilePoint {
                place: off(it.place),
                depth: off(it.depth),
                ..*it
            });
            fit_profiles(&measured.collect::<Vec<_>>())
        };
        let fits: Vec<_> = (0..400).map(|_| fit()).collect();
        let held = share_held(fits.iter().cloned(), |fit| {
            let [low, high] = [1, 2].map(|end| fit.gamma.unwrap()[end]);
            [
                fit.sigma.holds(Length::from_um(truth[0])),
                fit.penetration_depth.holds(Length::from_um(truth[1])),
                fit.critical_dose.unwrap().holds(Dose::from_mj_per_cm2(truth[2])),
                (low..=high).contains(&truth[3]),
            ]
        });
        // 1.1 % is a standard deviation here, and these are three.
        assert!(held.iter().all(|share| (0.917..=0.983).contains(share)), "{held:?}");
    }

    #[test]
    fn profiles_that_show_too_little_are_refused() {
        let all = squares([60.0, 125.0, 20.0, 1.8], 600.0, 500.0);
        let refused = |points: &[ProfilePoint]| fit_profiles(points).unwrap_err().to_string();
        assert!(refused(&all[..5]).ends_with("from the middle of squares to beyond their edges"));
        let gray: Vec<_> = all.iter().filter(|it| it.gray != GrayLevel::WHITE).copied().collect();
        assert_eq!(refused(&gray), "no square is white: measure one of gray level 1 too");
        let mut some = all.clone();
        some[3].dose = None;
        assert!(refused(&some).ends_with("points have a dose: give all of them one, or none"));
        // The middles of wide squares are as deep under any spread.
        let mut noise = SplitMix(3);
        let mut middles: Vec<_> =
            all.iter().filter(|it| it.place.um().abs() < 60.0).copied().collect();
        middles.extend(middles.clone());
        for point in &mut middles {
            point.depth = Length::from_um(point.depth.um() + 4.0 * noise.normal());
        }
        let vague = refused(&middles);
        assert!(vague.starts_with("the profiles do not determine the spread"), "{vague}");
        let mut broken = all.clone();
        broken[3].depth = Length::from_um(f64::NAN);
        assert_eq!(fit_profiles(&broken), Err(FitError::NoProfileFit));
        // Places from the left edge, and not from the middle.
        let moved: Vec<_> = all
            .iter()
            .map(|it| ProfilePoint { place: Length::from_um(it.place.um() + 250.0), ..*it })
            .collect();
        assert!(refused(&moved).ends_with("measure x_um from the middle of the square"));
        // One half of each square is enough.
        let half: Vec<_> = all.iter().filter(|it| it.place.um() >= 0.0).copied().collect();
        assert!((values(&fit_profiles(&half).unwrap())[0] / 60.0 - 1.0).abs() < 1e-4);
    }

    /// The distance of a point from a profile, by brute force over the profile.
    #[test]
    fn distances_are_those_of_the_nearest_place_of_the_profile() {
        let model = ProfileModel { logs: [60.0_f64, 125.0, 20.0, 1.8].map(f64::ln), grays: true };
        for point in squares([60.0, 125.0, 20.0, 1.8], 600.0, 500.0) {
            for (right, down) in [(5.0, 3.0), (-6.0, 4.0), (3.0, -9.0), (-8.0, -2.0)] {
                let place = Length::from_um(point.place.um() + right);
                let off = ProfilePoint {
                    place,
                    depth: Length::from_um(point.depth.um() + down),
                    ..point
                };
                let mut nearest = f64::INFINITY;
                for step in -4000..=4000 {
                    let at = Length::from_um(place.um() + f64::from(step) * 0.005);
                    let flat = ProfilePoint { place: at, depth: Length::from_um(0.0), ..point };
                    let depth = 125.0 * model.excess(&flat).0;
                    nearest = nearest.min((at.um() - place.um()).hypot(depth - off.depth.um()));
                }
                let found = model.foot(&off).1.abs();
                assert!((found - nearest).abs() < 0.05, "{off:?}: {found} for {nearest}");
            }
        }
    }
}
