//! The state of light and resin that all prints of a job show together.
//!
//! The state is how far the penetration depth, the dose of a second and the spread of light are
//! from the material's numbers, as logarithms. The most probable state has the least sum of squares,
//! of the measurements' residuals and of its own distance from the material, each in standard
//! deviations (Gauss and Newton, with Levenberg's and Marquardt's damping: Nocedal and Wright 2006,
//! section 10.3). States are then tried around it, as far as the sum's curvature says.

use std::collections::HashMap;
use std::rc::Rc;

use lamp_grayscale::material::{Given, Material};
use lamp_grayscale::resin::{Intensity, Quantity};
use lamp_stack::Length;
use serde::{Deserialize, Serialize};

use super::heights::height_of;
use crate::light::{IntensityOf, Light};
use crate::numeric::{dot, solve_positive};
use crate::speed::{PartError, Simulation, TimedPart};

/// The standard deviations of the numbers of a material that states no interval, as logarithms: how
/// far resins and lamps usually are from a table.
const UNSTATED: [f64; NUMBERS] = [0.25, 0.3, 0.3];
/// No number is known better than this before it is printed with: an interval is of the day when it
/// was measured.
const BEST_STATED: f64 = 0.05;
/// The numbers of a state: penetration depth, dose, spread.
const NUMBERS: usize = 3;
const DEPTH: usize = 0;
const DOSE: usize = 1;
const SPREAD: usize = 2;
/// The standard deviation of the change of the dose from print to print: lamps age and resins tire.
const DRIFT: f64 = 0.02;
/// The standard deviation of a counted area, as a share of it.
const COUNT_NOISE: f64 = 0.03;
/// The standard deviation, in pixels, of an edge that lies anywhere in its pixel: 1/√12.
const EDGE_PX: f64 = 0.289;
/// The range of doses over which a voxel is cured that is cured or not, and the standard deviation of
/// its edges in pixels: prints are not as sharp as their model.
const SHARP: f64 = 1e-4;
const SHARP_EDGE_PX: f64 = 0.005;
/// States are searched within these factors of the material's numbers, as logarithms.
const MOST: [f64; NUMBERS] = [1.2, 1.5, 1.2];

/// A number of the state, as a factor of the material's number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Factor {
    /// The mean over the probable states, of its logarithm.
    pub value: f64,
    /// The standard deviation of its natural logarithm.
    pub sd: f64,
}

impl Factor {
    /// Returns the ends of the 95 % interval.
    pub fn interval(self) -> [f64; 2] {
        [-1.96, 1.96].map(|sds| self.value * (sds * self.sd).exp())
    }
}

/// How far light and resin are from a material's numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct LightState {
    /// The penetration depth `D_p`.
    pub penetration_depth: Factor,
    /// The dose of a second in units of the critical dose, `I / E_c`, under a wide white field.
    pub dose: Factor,
    /// The spread of light `σ`.
    pub spread: Factor,
    /// The covariance of the three logarithms.
    covariance: [[f64; NUMBERS]; NUMBERS],
}

/// Two numbers that measurements cannot separate: their product or ratio is known better than either.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unseparated {
    /// The names of the numbers.
    pub names: [&'static str; 2],
    /// The correlation of their logarithms.
    pub correlation: f64,
}

impl LightState {
    /// The names of the three numbers.
    pub const NAMES: [&'static str; NUMBERS] = ["penetration depth", "dose", "spread"];

    /// Returns the state before any print: a material's numbers, as exact as it states.
    pub fn of_material(material: &Material) -> Self {
        let sds = prior_sds(material);
        let mut covariance = [[0.0; NUMBERS]; NUMBERS];
        (0..NUMBERS).for_each(|k| covariance[k][k] = sds[k] * sds[k]);
        Self::new(&[0.0; NUMBERS], covariance)
    }

    fn new(logs: &[f64], covariance: [[f64; NUMBERS]; NUMBERS]) -> Self {
        let factor = |k: usize| Factor { value: logs[k].exp(), sd: covariance[k][k].sqrt() };
        Self {
            penetration_depth: factor(DEPTH),
            dose: factor(DOSE),
            spread: factor(SPREAD),
            covariance,
        }
    }

    /// Returns the three numbers, in the order of [`NAMES`](Self::NAMES).
    pub fn factors(&self) -> [Factor; NUMBERS] {
        [self.penetration_depth, self.dose, self.spread]
    }

    fn logs(&self) -> [f64; NUMBERS] {
        self.factors().map(|factor| factor.value.ln())
    }

    /// Returns a material's light in this state.
    pub fn light(&self, light: &Light) -> Light {
        shifted(light, &self.logs())
    }

    /// Returns the numbers that the measurements cannot separate.
    pub fn unseparated(&self) -> Vec<Unseparated> {
        let mut pairs = Vec::new();
        for (a, b) in [(DEPTH, DOSE), (DEPTH, SPREAD), (DOSE, SPREAD)] {
            let own = self.covariance[a][a] * self.covariance[b][b];
            let correlation = self.covariance[a][b] / own.sqrt();
            if correlation.abs() > 0.9 {
                pairs.push(Unseparated { names: [Self::NAMES[a], Self::NAMES[b]], correlation });
            }
        }
        pairs
    }
}

/// Returns the standard deviation of a number's logarithm, if its file states an interval.
fn stated_sd<T: Quantity>(given: &Given<T>) -> Option<f64> {
    // An interval of 95 % reaches 1.96 standard deviations to each side.
    let half = given.plus_minus.as_ref()?.number();
    Some((half / (1.96 * given.value.number())).max(BEST_STATED))
}

/// Returns how exactly a material states its numbers, as standard deviations of logarithms.
fn prior_sds(material: &Material) -> [f64; NUMBERS] {
    let curve = material.working_curve.as_ref();
    let depth = curve.and_then(|curve| stated_sd(&curve.penetration_depth));
    let critical = curve.and_then(|curve| stated_sd(&curve.critical_dose));
    let intensity = material.intensity.as_ref().and_then(stated_sd);
    let spread = material.spread.as_ref();
    let sigma = spread.and_then(|spread| spread.sigma.as_ref().or(spread.sigma_across.as_ref()));
    let spread = sigma.and_then(stated_sd);
    let either = UNSTATED[DOSE] / 2.0_f64.sqrt();
    let dose = critical.unwrap_or(either).hypot(intensity.unwrap_or(either));
    [depth.unwrap_or(UNSTATED[DEPTH]), dose, spread.unwrap_or(UNSTATED[SPREAD])]
}

fn shifted(light: &Light, logs: &[f64]) -> Light {
    let scaled = |length: Length, log: f64| Length::from_um(length.um() * log.exp());
    // Where the intensity is of one pixel alone, a wider pixel gives a brighter field: the dose is
    // of the field.
    let of_pixel = match light.intensity_of {
        IntensityOf::Field => 0.0,
        IntensityOf::Pixel(_) => -2.0 * logs[SPREAD],
    };
    let brighter = (logs[DOSE] + of_pixel).exp();
    Light {
        intensity: Intensity::from_mw_per_cm2(light.intensity.mw_per_cm2() * brighter),
        penetration_depth: scaled(light.penetration_depth, logs[DEPTH]),
        spread: light.spread.map(|sigma| scaled(sigma, logs[SPREAD])),
        ..*light
    }
}

/// A print: its times in seconds, from the light on, and its measurements.
#[derive(Clone, Debug)]
pub(crate) struct MeasuredPrint {
    pub(crate) times: Vec<f64>,
    pub(crate) places: Vec<Measurement>,
}

/// A measurement, and the layer whose dose decides it, counted from the light.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Measurement {
    /// The wrong voxels of a layer: cured outside the part, and of the part but not cured.
    Counts { layer: usize, counts: [f64; 2] },
    /// The height down to which a face is cured, and its standard deviation, in micrometers.
    Height { layer: usize, pixel: [u32; 2], um: f64, sd_um: f64 },
}

/// How the model counts voxels at edges.
#[derive(Clone, Copy, PartialEq)]
enum Edges {
    /// A voxel's cured share rises as the edge passes through it, so that counts have slopes.
    Gradual,
    /// A voxel is cured or not, as prints are counted.
    Sharp,
}

/// The prediction of a model for a number that was measured.
#[derive(Clone, Copy)]
struct Predicted {
    /// The measured number less the model's, in standard deviations.
    residual: f64,
    /// The slope of the model's number by the logarithm of the dose, in standard deviations.
    slope: f64,
}

/// A part under lights that spread differently.
pub(crate) struct Model<'a> {
    part: &'a TimedPart,
    light: Light,
    memory: u64,
    edges_px: Rc<[f64]>,
    /// The last few spreads, with the light of measured pixels.
    known: Vec<Spreading<'a>>,
}

struct Spreading<'a> {
    log_spread: f64,
    simulation: Simulation<'a>,
    pixels: HashMap<[u32; 2], Vec<f32>>,
}

/// The spreads whose light is kept: enough for a state and the states around it.
const KEPT: usize = 6;

impl<'a> Model<'a> {
    pub(crate) fn new(part: &'a TimedPart, light: &Light, memory: u64) -> Self {
        let edges_px = part.edges_px().into();
        Self { part, light: *light, memory, edges_px, known: Vec::new() }
    }

    /// Returns the part under the light of a state.
    fn at(&mut self, logs: &[f64]) -> Result<&mut Spreading<'a>, PartError> {
        let light = shifted(&self.light, logs);
        let found = self.known.iter().position(|known| known.log_spread == logs[SPREAD]);
        let mut known = match found {
            Some(at) => self.known.remove(at),
            None => {
                self.known.truncate(KEPT - 1);
                let simulation = Simulation::new(self.part, &light, self.memory)?;
                Spreading { log_spread: logs[SPREAD], simulation, pixels: HashMap::new() }
            }
        };
        known.simulation.relight(self.part, &light)?;
        // The latest is first.
        self.known.insert(0, known);
        Ok(&mut self.known[0])
    }

    /// Returns the part under the light of a state.
    pub(crate) fn simulation(&mut self, state: &LightState) -> Result<&Simulation<'a>, PartError> {
        Ok(&self.at(&state.logs())?.simulation)
    }

    /// Returns the doses by which the light changes over half a pixel at an upright wall, as a
    /// logarithm: at the edge of a wide field it has half its light and the slope of a Gaussian.
    fn half_pixel(&self, logs: &[f64]) -> f64 {
        let [x, y] = self.part.spread_pixels(&shifted(&self.light, logs));
        let slope = 2.0 / ((2.0 * std::f64::consts::PI).sqrt() * (x * y).sqrt());
        (0.5 * slope).clamp(0.02, 0.3)
    }

    fn predict(
        &mut self,
        logs: &[f64],
        print: &MeasuredPrint,
        edges: Edges,
    ) -> Result<Vec<Predicted>, PartError> {
        let (half_range, edge_px) = match edges {
            Edges::Gradual => (self.half_pixel(logs), EDGE_PX),
            Edges::Sharp => (SHARP, SHARP_EDGE_PX),
        };
        let edges_px = Rc::clone(&self.edges_px);
        let light = shifted(&self.light, logs);
        let part = self.part;
        let known = self.at(logs)?;
        let sampled = f64::from(known.simulation.sampled());
        let has_counts = |place: &Measurement| matches!(place, Measurement::Counts { .. });
        let wrong = if print.places.iter().any(has_counts) {
            known.simulation.gradual_wrong(&print.times, half_range)
        } else {
            Vec::new()
        };
        let mut all = Vec::new();
        for place in &print.places {
            match place {
                Measurement::Counts { layer, counts } => {
                    let of_layer = &wrong[*layer];
                    let modeled = of_layer.counts.iter().zip(&of_layer.slopes);
                    for (counted, (modeled, slope)) in counts.iter().zip(modeled) {
                        // A sample's columns stand for many pixels each, and are Poisson counts.
                        let sampling = if sampled > 1.0 { counted * sampled } else { 0.0 };
                        let variance = (COUNT_NOISE * counted).powi(2)
                            + (edge_px * edges_px[*layer]).powi(2)
                            + sampling
                            + 1.0;
                        let sd = variance.sqrt();
                        all.push(Predicted {
                            residual: (counted - modeled) / sd,
                            slope: slope / sd,
                        });
                    }
                }
                Measurement::Height { layer, pixel, um, sd_um } => {
                    let simulation = &known.simulation;
                    let lights =
                        known.pixels.entry(*pixel).or_insert_with(|| simulation.light_at(*pixel));
                    let doses = simulation.doses_of(lights, &print.times);
                    all.push(match height_of(part, &doses, &light, *layer) {
                        Some(height) => Predicted {
                            residual: (um - height.um()) / sd_um,
                            // More dose cures deeper, by D_p for each logarithm.
                            slope: -light.penetration_depth.um() / sd_um,
                        },
                        // Where nothing is cured, the resin begins at the part's top.
                        None => {
                            let top = part.layers()[0];
                            let top_um = top.z.um() + top.thickness.um();
                            Predicted { residual: (um - top_um) / sd_um, slope: 0.0 }
                        }
                    });
                }
            }
        }
        Ok(all)
    }
}

/// A fit of the three numbers.
struct Fit<'m, 'a> {
    model: &'m mut Model<'a>,
    prints: &'m [MeasuredPrint],
    /// The standard deviations of the numbers before any print.
    prior_sds: [f64; NUMBERS],
}

/// The sum of squares of a state, its slopes, and its curvature by Gauss and Newton, row by row.
struct Sum {
    value: f64,
    slopes: [f64; NUMBERS],
    curvature: [f64; NUMBERS * NUMBERS],
}

/// Returns the states that all prints allow that were measured, the first one first.
pub(crate) fn states_of(
    model: &mut Model<'_>,
    material: &Material,
    prints: &[MeasuredPrint],
) -> Result<ProbableStates, PartError> {
    let mut fit = Fit { model, prints, prior_sds: prior_sds(material) };
    let mut x = fit.start()?;
    let mut sum = fit.sum(&x, true)?;
    let mut damping = 1e-3;
    for _ in 0..MOST_STEPS {
        let mut damped = sum.curvature;
        (0..NUMBERS).for_each(|k| damped[k * NUMBERS + k] *= 1.0 + damping);
        let step = solve_positive(&mut damped, sum.slopes.map(|slope| -slope).to_vec());
        let next = std::array::from_fn(|k| (x[k] + step[k]).clamp(-MOST[k], MOST[k]));
        let tried = fit.sum(&next, false)?;
        if tried.value < sum.value {
            let fall = sum.value - tried.value;
            x = next;
            sum = fit.sum(&x, true)?;
            damping = (damping / 10.0).max(1e-6);
            if fall < 1e-3 {
                break;
            }
        } else if damping > 1e4 {
            break;
        } else {
            damping *= 10.0;
        }
    }
    fit.states_around(&x, &sum.curvature)
}

/// The most steps of the search. Most need about six.
const MOST_STEPS: usize = 25;
/// The changes over which slopes are taken, as logarithms.
const CHANGES: [f64; 2] = [0.02, 0.03];

impl Fit<'_, '_> {
    /// Returns the standard deviation of the change of the dose from a print to the last one: a random
    /// walk.
    fn drift(&self, print: usize) -> f64 {
        DRIFT * ((self.prints.len() - 1 - print) as f64).sqrt()
    }

    /// Returns states around the one with the least sum of squares, each with its weight (population
    /// Monte Carlo: Cappé et al. 2004). Counts have steps where the edges of many layers pass the
    /// middle of pixels: states on both sides of a step see where a print was, and slopes do not.
    fn states_around(
        &mut self,
        x: &[f64; NUMBERS],
        curvature: &[f64],
    ) -> Result<ProbableStates, PartError> {
        let mut mean = *x;
        let mut covariance: [[f64; NUMBERS]; NUMBERS] = std::array::from_fn(|column| {
            let unit = (0..NUMBERS).map(|k| f64::from(u8::from(k == column))).collect();
            let solved = solve_positive(&mut curvature.to_vec(), unit);
            std::array::from_fn(|row| solved[row])
        });
        // The dose may be anywhere between two steps. Other numbers make up for it: where light spreads
        // over a pixel or two, gradual counts lead far from the truth.
        let half_pixel = self.model.half_pixel(x);
        (0..NUMBERS).for_each(|k| covariance[k][k] += half_pixel * half_pixel / 3.0);
        let mut normal = normal_deviates();
        let mut round = 1;
        loop {
            let root = root_of(&covariance);
            let mut states = Vec::new();
            for spread in SPREADS {
                for _ in 0..STATES_OF_SPREAD {
                    let z = [spread, normal(), normal()];
                    let logs: [f64; NUMBERS] = std::array::from_fn(|k| {
                        (mean[k] + WIDER * dot(&root[k], &z)).clamp(-MOST[k], MOST[k])
                    });
                    // The density of the proposal is divided out; spreads are proposed evenly.
                    let proposed = dot(&z[1..], &z[1..]);
                    let other = 0.5 * (proposed - self.prior_squares(&logs));
                    states.push(Tried { logs, half_squares: 0.5 * self.squares(&logs)?, other });
                }
            }
            let (weights, share) = weights_of(&states);
            let sum = |of: &dyn Fn(&[f64; NUMBERS]) -> f64| {
                let weighted = weights.iter().zip(&states);
                weighted.map(|(weight, state)| weight * of(&state.logs)).sum::<f64>()
            };
            mean = std::array::from_fn(|k| sum(&|logs| logs[k]));
            covariance = std::array::from_fn(|a| {
                std::array::from_fn(|b| sum(&|logs| (logs[a] - mean[a]) * (logs[b] - mean[b])))
            });
            if share == 1.0 || round == MOST_ROUNDS {
                let misfit = self.misfit(&mean)?;
                let mean = LightState::new(&mean, covariance);
                let members = states.iter().map(|state| state.logs).zip(weights).collect();
                return Ok(ProbableStates { mean, misfit, members });
            }
            round += 1;
        }
    }

    /// Returns the sum of squares of the measurements, where a voxel is cured or not.
    fn squares(&mut self, logs: &[f64; NUMBERS]) -> Result<f64, PartError> {
        let mut squares = 0.0;
        for (number, print) in self.prints.iter().enumerate() {
            // Of earlier prints, nobody knows on which side of a step the drift left them.
            let is_last = number + 1 == self.prints.len();
            let edges = if is_last { Edges::Sharp } else { Edges::Gradual };
            squares += squares_of(&self.model.predict(logs, print, edges)?, self.drift(number));
        }
        Ok(squares)
    }

    /// Returns the root mean square of the residuals at a state.
    fn misfit(&mut self, logs: &[f64; NUMBERS]) -> Result<f64, PartError> {
        let (mut squares, mut count) = (0.0, 0);
        for (number, print) in self.prints.iter().enumerate() {
            let predicted = self.model.predict(logs, print, Edges::Gradual)?;
            squares += squares_of(&predicted, self.drift(number));
            count += predicted.len();
        }
        Ok((squares / count as f64).sqrt())
    }

    /// Returns the sum of squares of the numbers themselves.
    fn prior_squares(&self, logs: &[f64; NUMBERS]) -> f64 {
        logs.iter().zip(self.prior_sds).map(|(log, sd)| (log / sd).powi(2)).sum()
    }

    /// Returns the best of some states far from each other, from where the search begins.
    fn start(&mut self) -> Result<[f64; NUMBERS], PartError> {
        let mut best = (f64::INFINITY, [0.0; NUMBERS]);
        for spread in [0.0, -0.3, 0.35] {
            for depth in [0.0, -0.25, 0.25] {
                for dose in [0.0, -0.2, 0.2, -0.4, 0.4] {
                    let mut logs = [0.0; NUMBERS];
                    (logs[DEPTH], logs[DOSE], logs[SPREAD]) = (depth, dose, spread);
                    let value = self.sum(&logs, false)?.value;
                    if value < best.0 {
                        best = (value, logs);
                    }
                }
            }
        }
        Ok(best.1)
    }

    /// Returns half the sum of squares, with its slopes if asked.
    fn sum(&mut self, logs: &[f64; NUMBERS], with_slopes: bool) -> Result<Sum, PartError> {
        let mut sum = Sum {
            value: 0.5 * self.prior_squares(logs),
            slopes: std::array::from_fn(|k| logs[k] / self.prior_sds[k].powi(2)),
            curvature: [0.0; NUMBERS * NUMBERS],
        };
        (0..NUMBERS).for_each(|k| sum.curvature[k * NUMBERS + k] = self.prior_sds[k].powi(-2));
        for (number, print) in self.prints.iter().enumerate() {
            let drift = self.drift(number);
            let here = self.model.predict(logs, print, Edges::Gradual)?;
            sum.value += 0.5 * squares_of(&here, drift);
            if !with_slopes {
                continue;
            }
            let mut moved = |number: usize, by: f64| {
                let mut moved = *logs;
                moved[number] += by;
                let there = self.model.predict(&moved, print, Edges::Gradual)?;
                let slope =
                    |(there, here): (&Predicted, &Predicted)| (here.residual - there.residual) / by;
                Ok::<Vec<f64>, PartError>(there.iter().zip(&here).map(slope).collect())
            };
            let mut lines: [Vec<f64>; NUMBERS] = std::array::from_fn(|_| Vec::new());
            lines[DEPTH] = moved(DEPTH, CHANGES[0])?;
            lines[SPREAD] = moved(SPREAD, CHANGES[1])?;
            lines[DOSE] = here.iter().map(|place| place.slope).collect();
            let residuals: Vec<_> = here.iter().map(|place| place.residual).collect();
            // The inverse of I + d² s sᵀ is I - d² s sᵀ / (1 + d² sᵀ s), with the slopes s by the dose
            // and its drift d (Sherman and Morrison 1950).
            let square = dot(&lines[DOSE], &lines[DOSE]);
            let known = drift * drift / (1.0 + drift * drift * square);
            let between = |a: &[f64], b: &[f64]| {
                dot(a, b) - known * dot(a, &lines[DOSE]) * dot(b, &lines[DOSE])
            };
            for a in 0..NUMBERS {
                sum.slopes[a] -= between(&lines[a], &residuals);
                for b in 0..NUMBERS {
                    sum.curvature[a * NUMBERS + b] += between(&lines[a], &lines[b]);
                }
            }
        }
        Ok(sum)
    }
}

/// Returns the sum of squares of a print whose dose may have drifted: `rᵀ (I + d² s sᵀ)⁻¹ r`, with the
/// residuals r, the slopes s by the dose and the standard deviation d of its logarithm.
fn squares_of(predicted: &[Predicted], drift: f64) -> f64 {
    let [mut squares, mut with_slopes, mut slopes] = [0.0; 3];
    for place in predicted {
        squares += place.residual * place.residual;
        with_slopes += place.residual * place.slope;
        slopes += place.slope * place.slope;
    }
    squares - drift * drift * with_slopes * with_slopes / (1.0 + drift * drift * slopes)
}

/// Returns a root of a covariance, whose first column alone changes the spread: light of columns is
/// computed for each spread.
fn root_of(covariance: &[[f64; NUMBERS]; NUMBERS]) -> [[f64; NUMBERS]; NUMBERS] {
    let order = [SPREAD, DEPTH, DOSE];
    let mut factor: Vec<_> =
        order.iter().flat_map(|&row| order.map(|column| covariance[row][column])).collect();
    (0..NUMBERS).for_each(|k| factor[k * NUMBERS + k] += LEAST_VARIANCE);
    // The solver leaves the Cholesky factor in its matrix.
    solve_positive(&mut factor, vec![0.0; NUMBERS]);
    let mut root = [[0.0; NUMBERS]; NUMBERS];
    for (row, number) in order.into_iter().enumerate() {
        root[number][..=row].copy_from_slice(&factor[row * NUMBERS..=row * NUMBERS + row]);
    }
    root
}

/// A state that was tried.
struct Tried {
    logs: [f64; NUMBERS],
    /// Half the sum of squares of the measurements.
    half_squares: f64,
    /// The logarithm of its weight without measurements.
    other: f64,
}

/// Returns the weights of states, whose sum is 1, and the share of them that is taken, as logarithms.
///
/// Few states are left of measurements that are more exact than the states are close. Weights are
/// evened out then, until enough states are left.
fn weights_of(states: &[Tried]) -> (Vec<f64>, f64) {
    let at = |share: f64| {
        let log = |state: &Tried| share * (state.other - state.half_squares);
        let most = states.iter().map(log).fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<_> = states.iter().map(|state| (log(state) - most).exp()).collect();
        let sum: f64 = weights.iter().sum();
        weights.into_iter().map(|weight| weight / sum).collect::<Vec<_>>()
    };
    // The effective number of states (Kong 1992).
    let is_enough =
        |weights: &[f64]| dot(weights, weights).recip() >= (states.len() / LEAST_SHARE) as f64;
    let all = at(1.0);
    if is_enough(&all) {
        return (all, 1.0);
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        *(if is_enough(&at(middle)) { &mut low } else { &mut high }) = middle;
    }
    (at(low), low)
}

/// The spreads that are tried around the best one, in standard deviations, and the states of each.
const SPREADS: [f64; 5] = [0.0, -0.8, 0.8, -1.6, 1.6];
const STATES_OF_SPREAD: usize = 24;
/// States are tried over this multiple of the standard deviations that are known of them.
const WIDER: f64 = 1.3;
/// The most rounds, each around the states that the last one found. Exact measurements need several.
const MOST_ROUNDS: usize = 8;
/// The least variance of a direction in which states are tried.
const LEAST_VARIANCE: f64 = 1e-8;
/// At least one in this many of the states must count.
const LEAST_SHARE: usize = 6;

/// States that the measurements allow.
pub(crate) struct ProbableStates {
    /// Their mean and covariance.
    pub(crate) mean: LightState,
    /// The root mean square of the measurements' distances from the mean's, in standard deviations.
    pub(crate) misfit: f64,
    /// Each with its weight; the weights sum to 1.
    members: Vec<([f64; NUMBERS], f64)>,
}

impl ProbableStates {
    /// Returns the wrong voxels that each of some times would leave in the next print: their mean,
    /// and the fewest and most of the states that count.
    pub(crate) fn expected<const N: usize>(
        &self,
        model: &mut Model<'_>,
        times: [&[f64]; N],
    ) -> Result<[[f64; 3]; N], PartError> {
        let mut all = [[0.0, f64::INFINITY, 0.0]; N];
        let least = LEAST_WEIGHT / self.members.len() as f64;
        let count = self.members.iter().filter(|(_, weight)| *weight > least);
        let total: f64 = count.clone().map(|member| member.1).sum();
        for (number, (logs, weight)) in count.enumerate() {
            let mut logs = *logs;
            // The dose drifts until the next print, to either side.
            logs[DOSE] += if number.is_multiple_of(2) { DRIFT } else { -DRIFT };
            let tallies = model.at(&logs)?.simulation.estimate(times);
            for (sum, tally) in all.iter_mut().zip(tallies) {
                let wrong = tally.wrong().sum() as f64;
                sum[0] += weight / total * wrong;
                (sum[1], sum[2]) = (sum[1].min(wrong), sum[2].max(wrong));
            }
        }
        Ok(all)
    }
}

/// States of less weight than this share of the mean weight are left out of what is expected.
const LEAST_WEIGHT: f64 = 0.1;

/// Returns normal deviates, the same in every run (Box and Muller 1958).
fn normal_deviates() -> impl FnMut() -> f64 {
    let mut state = 0_u64;
    let mut uniform = move || {
        // SplitMix64 (Steele, Lea and Flood 2014).
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mix = state;
        mix = (mix ^ (mix >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mix = (mix ^ (mix >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((mix ^ (mix >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    move || {
        let radius = (-2.0 * (1.0 - uniform()).ln()).sqrt();
        radius * (2.0 * std::f64::consts::PI * uniform()).cos()
    }
}
