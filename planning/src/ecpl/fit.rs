//! Fits the rates of a reaction to measured films and lines (003 sections 4.1 and 4.4).

use lamp_grayscale::calibrate::{Estimate, t_95};
use lamp_grayscale::material::{Given, GivenRange, KineticNumbers, MeasuredRange};
use lamp_grayscale::resin::{Dose, ExposureTime, Intensity, Kinetics, ModelError, Quantity};
use lamp_stack::{Length, format_significant, named, round_significant};
use rayon::prelude::*;
use thiserror::Error;

use super::profile::Profile;
use super::samples::{KineticPoint, KineticSize};
use super::setting::{KineticSetting, SettingError};
use super::strips::Strip;
use crate::numeric::{dot, solve_positive};

/// A number of a reaction that heights may show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KineticRate {
    /// `k_p`. Heights show only its ratio to `-ln(1 - c)`, where `c` is the critical conversion.
    Propagation,
    /// `k_t`.
    Termination,
    /// `k_t,O2`.
    TerminationByOxygen,
    /// `D_O2`.
    OxygenDiffusion,
    /// `[O2]_0`.
    Oxygen,
    /// `ε`.
    Absorptivity,
}

named!(KineticRate {
    Propagation = "propagation",
    Termination = "termination",
    TerminationByOxygen = "termination-by-oxygen",
    OxygenDiffusion = "oxygen-diffusion",
    Oxygen = "oxygen",
    Absorptivity = "absorptivity",
});

/// A quantity of any unit.
trait AnyQuantity {
    fn number(&self) -> f64;
    fn unit(&self) -> &'static str;
    fn multiply(&mut self, by: f64);
}

impl<T: Quantity> AnyQuantity for T {
    fn number(&self) -> f64 {
        Quantity::number(*self)
    }

    fn unit(&self) -> &'static str {
        T::UNIT
    }

    fn multiply(&mut self, by: f64) {
        *self = T::of(by * Quantity::number(*self));
    }
}

/// A number of a material, of any unit.
trait AnyGiven {
    fn state(&mut self, number: [f64; 3], source: &str);
}

impl<T: Quantity> AnyGiven for Given<T> {
    fn state(&mut self, number: [f64; 3], source: &str) {
        let [value, low, high] = number.map(T::of);
        *self = Estimate { value, low, high }.given(source);
    }
}

impl KineticRate {
    fn quantity(self, kinetics: &mut Kinetics) -> &mut dyn AnyQuantity {
        match self {
            Self::Propagation => &mut kinetics.propagation,
            Self::Termination => &mut kinetics.termination,
            Self::TerminationByOxygen => &mut kinetics.termination_by_oxygen,
            Self::OxygenDiffusion => &mut kinetics.oxygen_diffusion,
            Self::Oxygen => &mut kinetics.oxygen,
            Self::Absorptivity => &mut kinetics.absorptivity,
        }
    }

    fn given(self, numbers: &mut KineticNumbers) -> &mut dyn AnyGiven {
        match self {
            Self::Propagation => &mut numbers.propagation,
            Self::Termination => &mut numbers.termination,
            Self::TerminationByOxygen => &mut numbers.termination_by_oxygen,
            Self::OxygenDiffusion => &mut numbers.oxygen_diffusion,
            Self::Oxygen => &mut numbers.oxygen,
            Self::Absorptivity => &mut numbers.absorptivity,
        }
    }
}

/// A rate that heights show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedRate {
    /// Which it is.
    pub rate: KineticRate,
    /// Its unit.
    pub unit: &'static str,
    /// Its most likely value, and the lower and the upper end of its 95% confidence interval.
    pub number: [f64; 3],
}

/// A film or a line, as the fitted rates cure it.
#[derive(Clone, Debug, PartialEq)]
pub struct CuredStrip {
    /// The mirrors across the line; `None` is a film.
    pub pixels: Option<u32>,
    /// The light of a wide white field.
    pub light: Intensity,
    /// Its exposure time.
    pub time: ExposureTime,
    /// The half of its section.
    pub profile: Profile,
}

/// The rates that films and lines show.
#[derive(Clone, Debug, PartialEq)]
pub struct KineticFit {
    /// The rates.
    pub rates: Vec<FittedRate>,
    /// Rates that were to be found, and that the points do not show, with the value that they keep and its
    /// unit.
    pub kept: Vec<(KineticRate, f64, &'static str)>,
    /// The root mean square of the distances of points from the cured parts.
    pub misfit: Length,
    /// The number of points.
    pub points: usize,
    /// The parts that the rates cure, sample by sample.
    pub cured: Vec<CuredStrip>,
    measured: MeasuredRange,
}

/// Why rates cannot be fitted to films and lines.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum KineticFitError {
    /// There are too few points for an interval.
    #[error("{points} points are too few for {rates} rates: {needed} that cured are the least")]
    TooFew {
        /// The number there is.
        points: usize,
        /// The number of rates.
        rates: usize,
        /// The least number.
        needed: usize,
    },
    /// The points show none of the rates.
    #[error(
        "the points show none of the rates: measure more times, from the shortest that cures, and lines \
         as well as films"
    )]
    NothingShown,
    /// No rates cure such parts.
    #[error(
        "no rates near the material's cure such parts: points are {} um off; check the light, the \
         material, and the columns",
        format_significant(*.0, 4)
    )]
    NoFit(f64),
    /// The samples cannot be exposed.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A fitted rate is not possible.
    #[error("the fitted rates are not possible: {0}")]
    Impossible(ModelError),
}

/// The fewest points more than rates.
const LEAST_MORE: usize = 3;
/// The widest interval of a rate that counts as shown: from the value over e to e times the value.
const WIDEST_LOG: f64 = 1.0;
/// The widest misfit, as a share of the greatest height: beyond it, other things made the parts.
const WIDEST_MISFIT: f64 = 0.1;
/// The change over which slopes are taken, as a logarithm: between cells, heights are not smooth, and a
/// small change would show the cells.
const CHANGE: f64 = 0.05;
/// The most steps of the search.
const MOST_STEPS: usize = 40;
/// The share of the sum of squares below which a step gains nothing.
const NO_GAIN: f64 = 1e-6;
/// The farthest a rate goes from the material's, as a logarithm.
const FARTHEST: f64 = 5.0;

/// Fits rates to films and lines, with all other numbers of the setting as they are: the least squares of
/// the distances of points from the parts that the reaction cures (Gauss and Newton, with Levenberg's and
/// Marquardt's damping: Nocedal and Wright 2006, section 10.3).
///
/// Intervals come from the covariance, by Student's t, on a logarithmic scale. A rate whose interval would
/// be wider than a factor of e is not shown by the points: the widest first, it keeps its value, and the
/// others are fitted again.
///
/// # Errors
/// Returns an error if there are too few points, if they show no rate, if no rates cure such parts, or if
/// the setting exposes nothing.
pub fn fit_kinetics(
    setting: &KineticSetting,
    points: &[KineticPoint],
    rates: &[KineticRate],
    source: &str,
) -> Result<KineticFit, KineticFitError> {
    let mut search = Search { samples: samples(setting, points)?, start: setting.kinetics };
    let (mut shown, mut kept) = (rates.to_vec(), Vec::new());
    let (found, halves, left) = loop {
        let needed = shown.len() + LEAST_MORE;
        if points.len() < needed {
            let (points, rates) = (points.len(), shown.len());
            return Err(KineticFitError::TooFew { points, rates, needed });
        }
        if shown.is_empty() {
            return Err(KineticFitError::NothingShown);
        }
        let (found, sum) = search.settle(&shown);
        let free = points.len() - shown.len();
        let times = t_95(free) * (sum.value / free as f64).sqrt();
        let halves = sum.deviations().into_iter().map(|sd| times * sd).collect::<Vec<_>>();
        let widest = (0..shown.len()).max_by(|&a, &b| halves[a].total_cmp(&halves[b]));
        let is_shown = |of: &usize| halves[*of] < WIDEST_LOG;
        match widest.filter(|widest| !is_shown(widest)) {
            None => break (found, halves, sum.value),
            Some(widest) => {
                let rate = shown.remove(widest);
                let quantity = rate.quantity(&mut search.start);
                kept.push((rate, quantity.number(), quantity.unit()));
            }
        }
    };
    let misfit = (left / points.len() as f64).sqrt();
    let highest = points.iter().map(|point| match point.size {
        KineticSize::Height { height, .. } => height.um(),
        KineticSize::Width(width) => width.um(),
    });
    let fits = misfit < WIDEST_MISFIT * highest.fold(0.0, f64::max);
    if !fits {
        return Err(KineticFitError::NoFit(misfit));
    }
    let kinetics = search.changed(&shown, &found);
    let kinetics = kinetics.checked().map_err(KineticFitError::Impossible)?;
    let fitted = |(&rate, half): (&KineticRate, &f64)| {
        let mut kinetics = kinetics;
        let quantity = rate.quantity(&mut kinetics);
        let number = [0.0, -half, *half].map(|half| quantity.number() * half.exp());
        FittedRate { rate, unit: quantity.unit(), number }
    };
    let depths = points.iter().filter_map(|point| match point.size {
        KineticSize::Height { height, .. } => Some(height),
        KineticSize::Width(_) => None,
    });
    let measured =
        MeasuredRange {
            source: source.to_owned(),
            // A product of light and time has more digits than either, and a range holds to nine.
            doses: GivenRange::of(points.iter().map(|point| {
                Dose::from_mj_per_cm2(round_significant(point.dose().mj_per_cm2(), 10))
            }))
            .ok_or(KineticFitError::NothingShown)?,
            depths: GivenRange::of(depths),
        };
    Ok(KineticFit {
        rates: shown.iter().zip(&halves).map(fitted).collect(),
        kept,
        misfit: Length::from_um(misfit),
        points: points.len(),
        cured: search.cured(&kinetics),
        measured,
    })
}

impl KineticFit {
    /// Returns a material's rates for its file, with the fitted ones in their place.
    pub fn numbers(&self, base: &KineticNumbers) -> KineticNumbers {
        let mut numbers = base.clone();
        for FittedRate { rate, number, .. } in &self.rates {
            rate.given(&mut numbers).state(*number, &self.measured.source);
        }
        numbers.measured = Some(self.measured.clone());
        numbers
    }
}

/// Points of films or lines that differ only in their time.
struct Sample {
    pixels: Option<u32>,
    light: Intensity,
    strip: Strip,
    /// The time of each point, as a number of the strip's, and its size.
    points: Vec<(usize, KineticSize)>,
}

fn samples(
    setting: &KineticSetting,
    points: &[KineticPoint],
) -> Result<Vec<Sample>, KineticFitError> {
    let mut kinds: Vec<(Option<u32>, Intensity)> = Vec::new();
    for KineticPoint { pixels, light, .. } in points {
        if !kinds.contains(&(*pixels, *light)) {
            kinds.push((*pixels, *light));
        }
    }
    let sample = |(pixels, light): (Option<u32>, Intensity)| {
        let of_kind = || points.iter().filter(move |it| (it.pixels, it.light) == (pixels, light));
        let times = of_kind().map(|point| point.time).collect();
        let strip = Strip::new(&KineticSetting { light, ..*setting }, pixels, times)?;
        let time = |time| strip.times.iter().position(|&it| it == time).unwrap_or(0);
        let points = of_kind().map(|point| (time(point.time), point.size)).collect();
        Ok(Sample { pixels, light, strip, points })
    };
    kinds.into_iter().map(sample).collect()
}

/// The search for the rates with the least sum of squares.
struct Search {
    samples: Vec<Sample>,
    /// The rates at logarithms of zero.
    start: Kinetics,
}

/// The sum of squares of rates, its slopes, and its curvature by Gauss and Newton, row by row.
struct Sum {
    value: f64,
    slopes: Vec<f64>,
    curvature: Vec<f64>,
}

impl Sum {
    /// Returns the standard deviation of each rate where points have a standard deviation of 1; beyond 1e9
    /// where the points show nothing of it.
    fn deviations(&self) -> Vec<f64> {
        let size = self.slopes.len();
        let deviation = |k: usize| {
            let unit = (0..size).map(|at| f64::from(u8::from(at == k))).collect();
            let sd = solve_positive(&mut self.curvature.clone(), unit)[k].sqrt();
            // Where the matrix is singular, the rate of least slope is widest.
            let alone = 1.0 / self.curvature[k * size + k].sqrt();
            if sd.is_finite() { sd } else { 1e9 + alone.min(1e9) }
        };
        (0..size).map(deviation).collect()
    }
}

impl Search {
    fn changed(&self, rates: &[KineticRate], logs: &[f64]) -> Kinetics {
        let mut kinetics = self.start;
        for (rate, log) in rates.iter().zip(logs) {
            rate.quantity(&mut kinetics).multiply(log.exp());
        }
        kinetics
    }

    fn cured(&self, kinetics: &Kinetics) -> Vec<CuredStrip> {
        let cured = |sample: &Sample| {
            let Sample { pixels, light, strip, .. } = sample;
            let profiles = strip.cured(kinetics);
            let cured =
                |(&time, profile)| CuredStrip { pixels: *pixels, light: *light, time, profile };
            strip.times.iter().zip(profiles).map(cured).collect::<Vec<_>>()
        };
        self.samples.iter().flat_map(cured).collect()
    }

    /// Returns how far each point is outside the cured part, in micrometers.
    fn residuals(&self, kinetics: &Kinetics) -> Vec<f64> {
        let of_sample = |sample: &Sample| {
            let profiles = sample.strip.cured(kinetics);
            let outlines: Vec<Outline> = profiles.iter().map(Outline::of).collect();
            let residual = |&(time, size): &(usize, KineticSize)| match size {
                KineticSize::Width(width) => width.um() - 2.0 * profiles[time].base_um,
                KineticSize::Height { height, place } => {
                    outlines[time].distance_um([place.um(), height.um()])
                }
            };
            sample.points.iter().map(residual).collect::<Vec<_>>()
        };
        self.samples.par_iter().flat_map_iter(of_sample).collect()
    }

    fn value(&self, rates: &[KineticRate], logs: &[f64]) -> f64 {
        let residuals = self.residuals(&self.changed(rates, logs));
        dot(&residuals, &residuals)
    }

    fn sum(&self, rates: &[KineticRate], logs: &[f64]) -> Sum {
        let size = rates.len();
        // The middle, then each rate less and more.
        let places = (0..=2 * size).into_par_iter().map(|place| {
            let mut logs = logs.to_vec();
            if let Some(beside) = place.checked_sub(1) {
                logs[beside / 2] += if beside % 2 == 0 { -CHANGE } else { CHANGE };
            }
            self.residuals(&self.changed(rates, &logs))
        });
        let places: Vec<Vec<f64>> = places.collect();
        let middle = &places[0];
        let slopes: Vec<Vec<f64>> = places[1..]
            .chunks(2)
            .map(|pair| {
                let slope = |(less, more): (&f64, &f64)| (more - less) / (2.0 * CHANGE);
                pair[0].iter().zip(&pair[1]).map(slope).collect()
            })
            .collect();
        let pairs = slopes.iter().flat_map(|a| slopes.iter().map(|b| dot(a, b)));
        Sum {
            value: dot(middle, middle),
            slopes: slopes.iter().map(|slope| dot(slope, middle)).collect(),
            curvature: pairs.collect(),
        }
    }

    /// Returns the logarithms of rates over the start's with the least sum, and the sum.
    fn settle(&self, rates: &[KineticRate]) -> (Vec<f64>, Sum) {
        let size = rates.len();
        let mut logs = vec![0.0; size];
        let mut sum = self.sum(rates, &logs);
        let mut damping = 1e-3;
        for _ in 0..MOST_STEPS {
            let mut damped = sum.curvature.clone();
            (0..size).for_each(|k| damped[k * size + k] *= 1.0 + damping);
            let step = solve_positive(&mut damped, sum.slopes.iter().map(|it| -it).collect());
            let moved = logs.iter().zip(&step);
            let next: Vec<f64> = moved
                .map(|(log, step)| (log + step.clamp(-1.0, 1.0)).clamp(-FARTHEST, FARTHEST))
                .collect();
            let value = if next.iter().all(|log| log.is_finite()) {
                self.value(rates, &next)
            } else {
                f64::INFINITY
            };
            if value < sum.value {
                let gains = sum.value - value > NO_GAIN * sum.value;
                logs = next;
                sum = self.sum(rates, &logs);
                damping = (damping / 10.0).max(1e-6);
                if !gains {
                    break;
                }
            } else if damping > 1e3 {
                break;
            } else {
                damping *= 10.0;
            }
        }
        (logs, sum)
    }
}

/// The outline of a cured part, from above its middle to its edge on the glass, in micrometers.
struct Outline {
    corners: Vec<[f64; 2]>,
    /// Whether it is a film, without an edge.
    is_film: bool,
}

impl Outline {
    fn of(profile: &Profile) -> Self {
        let heights = &profile.heights_um;
        let solid = heights.iter().take_while(|height| **height > 0.0).count();
        let mut corners = vec![[0.0, profile.sag_um()]];
        corners.extend((0..solid).map(|x| [profile.cells.middle_um(x), heights[x]]));
        if profile.cells.across > 1 {
            corners.push([profile.base_um, 0.0]);
        }
        Self { corners, is_film: profile.cells.across == 1 }
    }

    /// Returns how far a point is from the outline: above zero outside, below zero inside.
    fn distance_um(&self, [place, height]: [f64; 2]) -> f64 {
        if self.is_film {
            return height - self.corners[0][1];
        }
        let mut nearest = f64::INFINITY;
        let mut roof = None;
        for pair in self.corners.windows(2) {
            let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
            let [along_x, along_y] = [x1 - x0, y1 - y0];
            let length = along_x * along_x + along_y * along_y;
            let at = ((place - x0) * along_x + (height - y0) * along_y) / length;
            let at = if length > 0.0 { at.clamp(0.0, 1.0) } else { 0.0 };
            let off = (x0 + at * along_x - place).hypot(y0 + at * along_y - height);
            nearest = nearest.min(off);
            if (x0..x1).contains(&place) {
                roof = Some(y0 + (place - x0) / along_x * along_y);
            }
        }
        if roof.is_some_and(|roof| height < roof) { -nearest } else { nearest }
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::SplitMix;
    use lamp_grayscale::material::Material;
    use lamp_stack::Catalogued;

    use super::*;
    use crate::projector::Projector;

    /// A chamber of 80 um, which takes less than half the time of 003's.
    fn setting() -> KineticSetting {
        let kinetics = tmpta().kinetics().unwrap().unwrap();
        let setting = KineticSetting::of(&Projector::builtin("jariwala").unwrap(), kinetics);
        KineticSetting { chamber_um: 80.0, ..setting.unwrap() }
    }

    fn tmpta() -> Material {
        Material::builtin("tmpta").unwrap()
    }

    fn changed(setting: &KineticSetting, changes: &[(KineticRate, f64)]) -> KineticSetting {
        let mut other = *setting;
        changes.iter().for_each(|(rate, by)| rate.quantity(&mut other.kinetics).multiply(*by));
        other
    }

    /// The cured parts of a resin: films, and sections and widths of lines, without errors.
    fn points(
        setting: &KineticSetting,
        lines: &[Option<u32>],
        seconds: &[f64],
    ) -> Vec<KineticPoint> {
        let mut points = Vec::new();
        for &pixels in lines {
            let times = seconds.iter().map(|seconds| ExposureTime::from_ms(1000.0 * seconds));
            let strip = Strip::new(setting, pixels, times.collect()).unwrap();
            for (&time, profile) in strip.times.iter().zip(strip.cured(&setting.kinetics)) {
                let light = setting.light;
                let mut push = |size| points.push(KineticPoint { pixels, light, time, size });
                for (x, &um) in profile.heights_um.iter().enumerate().step_by(3) {
                    let place = Length::from_um(profile.cells.middle_um(x));
                    let height = Length::from_um(um);
                    if um > 0.0 {
                        push(KineticSize::Height { height, place });
                    }
                }
                if pixels.is_some() && profile.base_um > 0.0 {
                    push(KineticSize::Width(Length::from_um(2.0 * profile.base_um)));
                }
            }
        }
        points
    }

    fn noisy(exact: &[KineticPoint], noise: &mut SplitMix, sd: f64) -> Vec<KineticPoint> {
        let mut off = |length: Length| Length::from_um(length.um() + sd * noise.normal());
        let mut noisy = exact.to_vec();
        for point in &mut noisy {
            match &mut point.size {
                KineticSize::Height { height, .. } => *height = off(*height),
                KineticSize::Width(width) => *width = off(*width),
            }
        }
        noisy
    }

    const SECONDS: [f64; 5] = [0.8, 1.1, 1.6, 2.2, 3.0];

    #[test]
    fn films_and_lines_give_their_rates_back() {
        let changes = [
            (KineticRate::Propagation, 1.4),
            (KineticRate::TerminationByOxygen, 0.7),
            (KineticRate::OxygenDiffusion, 1.5),
            (KineticRate::Oxygen, 1.3),
        ];
        let start = setting();
        let points = points(&changed(&start, &changes), &[None, Some(10)], &SECONDS);
        let rates = changes.map(|(rate, _)| rate);
        let fit = fit_kinetics(&start, &points, &rates, "a test").unwrap();
        assert!(fit.kept.is_empty() && fit.misfit.um() < 0.02, "{:?} {:?}", fit.misfit, fit.rates);
        for (fitted, (rate, by)) in fit.rates.iter().zip(changes) {
            let mut kinetics = start.kinetics;
            let truth = by * rate.quantity(&mut kinetics).number();
            assert!((fitted.number[0] / truth - 1.0).abs() < 0.01, "{fitted:?} for {truth}");
        }
        // A material gets the rates, and keeps the others.
        let base = tmpta().kinetics.unwrap();
        let numbers = fit.numbers(&base);
        assert_eq!(
            (&numbers.termination, &numbers.wavelength),
            (&base.termination, &base.wavelength)
        );
        let oxygen = numbers.oxygen;
        assert!((oxygen.value.mol_per_m3() - 1.365).abs() < 0.014, "{oxygen:?}");
        assert!(oxygen.plus_minus.is_some() && oxygen.source == "a test");
        let measured = numbers.measured.unwrap();
        assert!((measured.doses.to.mj_per_cm2() - 3.0 * 2.57).abs() < 1e-9);
        let material = Material { kinetics: Some(fit.numbers(&base)), ..tmpta() };
        assert_eq!(Material::from_toml(&material.to_toml().unwrap()), Ok(material));
    }

    /// 003's three rates: how radicals end each other hardly matters where oxygen ends them.
    #[test]
    fn rates_that_heights_do_not_show_are_kept() {
        let start = setting();
        let exact = points(&start, &[None, Some(10)], &SECONDS);
        let points = noisy(&exact, &mut SplitMix(5), 1.0);
        let rates =
            [KineticRate::Propagation, KineticRate::Termination, KineticRate::TerminationByOxygen];
        let fit = fit_kinetics(&start, &points, &rates, "a test").unwrap();
        assert_eq!(fit.kept, [(KineticRate::Termination, 1.31, "m3/(mol s)")]);
        let found: Vec<KineticRate> = fit.rates.iter().map(|it| it.rate).collect();
        assert_eq!(found, [rates[0], rates[2]]);
        // One film at one time, measured badly.
        let film = noisy(&[exact[0]; 4], &mut SplitMix(5), 3.0);
        let alone = fit_kinetics(&start, &film, &rates[1..2], "a test").unwrap_err();
        assert_eq!(alone, KineticFitError::NothingShown);
        let few = fit_kinetics(&start, &points[..4], &rates[..2], "a test").unwrap_err();
        assert_eq!(few, KineticFitError::TooFew { points: 4, rates: 2, needed: 5 });
        // Heights that fall with time: no rates do that.
        let mut wrong = exact;
        let times: Vec<ExposureTime> = wrong.iter().rev().map(|it| it.time).collect();
        wrong.iter_mut().zip(times).for_each(|(point, time)| point.time = time);
        let error = fit_kinetics(&start, &wrong, &[KineticRate::Oxygen], "a test").unwrap_err();
        assert!(matches!(error, KineticFitError::NoFit(_)), "{error}");
    }

    #[test]
    fn with_errors_the_intervals_hold_the_truth() {
        let start = setting();
        let rates = [KineticRate::Oxygen, KineticRate::Absorptivity];
        let films = points(&start, &[None], &SECONDS);
        let exact = [&films[..], &films, &films].concat();
        let mut noise = SplitMix(17);
        let mut held = [0; 2];
        for _ in 0..150 {
            let points = noisy(&exact, &mut noise, 2.0);
            let fit = fit_kinetics(&start, &points, &rates, "a test").unwrap();
            for (held, fitted) in held.iter_mut().zip(&fit.rates) {
                let mut kinetics = start.kinetics;
                let truth = fitted.rate.quantity(&mut kinetics).number();
                *held += i32::from((fitted.number[1]..=fitted.number[2]).contains(&truth));
            }
        }
        // 1.8 % is a standard deviation here, and these are three.
        assert!(held.iter().all(|held| (135..150).contains(held)), "{held:?}");
    }

    #[test]
    fn distances_are_those_of_the_nearest_place_of_the_outline() {
        let setting = setting();
        let time = ExposureTime::from_ms(3000.0);
        let strip = Strip::new(&setting, Some(20), vec![time]).unwrap();
        let profile = &strip.cured(&setting.kinetics)[0];
        let outline = Outline::of(profile);
        for (place, height, is_inside) in
            [(0.0, 70.0, false), (40.0, 20.0, true), (55.0, 60.0, false), (90.0, 5.0, false)]
        {
            let mut nearest = f64::INFINITY;
            for pair in outline.corners.windows(2) {
                for step in 0..=1000 {
                    let share = f64::from(step) / 1000.0;
                    let at = [0, 1].map(|k| pair[0][k] + share * (pair[1][k] - pair[0][k]));
                    nearest = nearest.min((at[0] - place).hypot(at[1] - height));
                }
            }
            let found = outline.distance_um([place, height]);
            assert!((found.abs() - nearest).abs() < 0.02, "{place} {height}: {found} {nearest}");
            assert_eq!(found < 0.0, is_inside, "{place} {height}");
        }
    }
}
