//! The state of light and resin that all prints of a job show together.
//!
//! The state is how far the penetration depth, the dose of a second and the spread of light are
//! from the material's numbers, as logarithms. The most probable state has the least sum of squares,
//! of the measurements' residuals and of its own distance from the material, each in standard
//! deviations (Gauss and Newton, with Levenberg's and Marquardt's damping: Nocedal and Wright 2006,
//! section 10.3). Pairs of a depth and a spread are then tried around it, as far as the sum's curvature
//! says, each with all doses: one pass over the part counts its voxels at every dose.

use std::collections::HashMap;
use std::rc::Rc;

use lamp_grayscale::material::{Given, Material};
use lamp_grayscale::resin::{Intensity, Quantity};
use lamp_stack::Length;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::heights::{height_of, height_with};
use super::place::PlacePixels;
use crate::light::{IntensityOf, Light};
use crate::numeric::{OF_95_PERCENT, dot, solve_positive};
use crate::speed::{DoseGrid, PartError, Simulation, TimedPart};

/// The standard deviations of the numbers of a material that states no interval, as logarithms: how
/// far resins and lamps usually are from a table.
pub(super) const UNSTATED: [f64; NUMBERS] = [0.25, 0.3, 0.3];
/// No number is known better than this before it is printed with: an interval is of the day when it
/// was measured.
const BEST_STATED: f64 = 0.05;
/// The numbers of a state: penetration depth, dose, spread.
pub(super) const NUMBERS: usize = 3;
pub(super) const DEPTH: usize = 0;
pub(super) const DOSE: usize = 1;
pub(super) const SPREAD: usize = 2;
/// The standard deviation of the change of the dose from print to print: lamps age and resins tire.
const DRIFT: f64 = 0.02;
/// The standard deviation of a counted area, as a share of it.
const COUNT_NOISE: f64 = 0.03;
/// The standard deviation, in pixels, of an edge that lies anywhere in its pixel: 1/√12.
const EDGE_PX: f64 = 0.289;
/// The same where each voxel of the model is cured or not: prints are not as sharp as their model.
const SHARP_EDGE_PX: f64 = 0.005;
/// States are searched within these factors of the material's numbers, as logarithms.
pub(super) const MOST: [f64; NUMBERS] = [1.2, 1.5, 1.2];

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
        [-OF_95_PERCENT, OF_95_PERCENT].map(|sds| self.value * (sds * self.sd).exp())
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

    pub(super) fn new(logs: &[f64], covariance: [[f64; NUMBERS]; NUMBERS]) -> Self {
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

    pub(super) fn logs(&self) -> [f64; NUMBERS] {
        self.factors().map(|factor| factor.value.ln())
    }

    /// Returns a material's light in this state.
    pub fn light(&self, light: &Light) -> Light {
        shifted(light, &self.logs())
    }

    /// Returns the numbers that the measurements cannot separate.
    pub fn unseparated(&self) -> Vec<Unseparated> {
        unseparated(&Self::NAMES, &self.covariance)
    }
}

/// Returns the pairs of numbers that measurements cannot separate, by the covariance of their
/// logarithms.
pub(super) fn unseparated(
    names: &[&'static str],
    covariance: &[impl AsRef<[f64]>],
) -> Vec<Unseparated> {
    let at = |row: usize, column: usize| covariance[row].as_ref()[column];
    let pairs = (0..names.len()).flat_map(|a| (a + 1..names.len()).map(move |b| (a, b)));
    pairs
        .map(|(a, b)| Unseparated {
            names: [names[a], names[b]],
            correlation: at(a, b) / (at(a, a) * at(b, b)).sqrt(),
        })
        .filter(|pair| pair.correlation.abs() > 0.9)
        .collect()
}

/// Returns the standard deviation of a number's logarithm, if its file states an interval.
pub(super) fn stated_sd<T: Quantity>(given: &Given<T>) -> Option<f64> {
    Some(sd_of(given.plus_minus.as_ref()?.number(), given.value.number()))
}

/// Returns the standard deviation of a number's logarithm, given half of its interval.
pub(super) fn sd_of(half: f64, value: f64) -> f64 {
    (half / (OF_95_PERCENT * value)).max(BEST_STATED)
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
#[derive(Clone, Debug)]
pub(crate) enum Measurement {
    /// The wrong voxels of a layer: cured outside the part, and of the part but not cured.
    Counts { layer: usize, counts: [f64; 2] },
    /// The height down to which a face is cured, and its standard deviation, in micrometers.
    Height { layer: usize, pixel: [u32; 2], um: f64, sd_um: f64 },
    /// The size of a place and its standard deviation, in micrometers or mm³.
    Size { place: PlacePixels, size: f64, sd: f64 },
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
    /// The pixels that each column stood for the last time.
    sampled: u32,
    /// The last few spreads, with the light of measured pixels.
    known: Vec<Spreading<'a>>,
}

struct Spreading<'a> {
    log_spread: f64,
    simulation: Simulation<'a>,
    pixels: HashMap<[u32; 2], Vec<f32>>,
}

/// Returns the logarithms of the doses of a place's pixels in each layer.
fn logs_of(
    place: &PlacePixels,
    simulation: &Simulation<'_>,
    lights: &mut HashMap<[u32; 2], Vec<f32>>,
    times: &[f64],
) -> Vec<Vec<f64>> {
    let of_pixel = |pixel: &[u32; 2]| {
        let lights = lights.entry(*pixel).or_insert_with(|| simulation.light_at(*pixel));
        simulation.doses_of(lights, times).into_iter().map(f64::ln).collect()
    };
    place.pixels().iter().map(of_pixel).collect()
}

/// The spreads whose light is kept: enough for a state and the states around it.
const KEPT: usize = 6;
/// The most of them that are kept where their light takes little memory.
const MOST_KEPT: usize = 48;

impl<'a> Model<'a> {
    pub(crate) fn new(part: &'a TimedPart, light: &Light, memory: u64) -> Self {
        let edges_px = part.edges_px().into();
        Self { part, light: *light, memory, edges_px, sampled: 1, known: Vec::new() }
    }

    /// Returns the part under the light of a state.
    fn at(&mut self, logs: &[f64]) -> Result<&mut Spreading<'a>, PartError> {
        let light = shifted(&self.light, logs);
        let found = self.known.iter().position(|known| known.log_spread == logs[SPREAD]);
        let mut known = match found {
            Some(at) => self.known.remove(at),
            None => {
                let bytes =
                    self.known.first().map_or(0, |known| known.simulation.columns().bytes());
                let fit = (self.memory / bytes.max(1)).min(MOST_KEPT as u64) as usize;
                self.known.truncate(fit.max(KEPT) - 1);
                let (memory, least) = (self.memory, self.sampled);
                let simulation = Simulation::rounded(self.part, &light, memory, least)?;
                self.sampled = simulation.sampled();
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
    ) -> Result<Vec<Predicted>, PartError> {
        let half_range = self.half_pixel(logs);
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
                        let sd = variance_of(*counted, EDGE_PX * edges_px[*layer], sampled).sqrt();
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
                        None => Predicted { residual: (um - top_um(part)) / sd_um, slope: 0.0 },
                    });
                }
                Measurement::Size { place, size, sd } => {
                    let Spreading { simulation, pixels, .. } = &mut *known;
                    let doses = logs_of(place, simulation, pixels, &print.times);
                    let modeled = |more| place.size(part, &light, &doses, more);
                    let slope =
                        (modeled(SIZE_CHANGE) - modeled(-SIZE_CHANGE)) / (2.0 * SIZE_CHANGE);
                    let residual = (size - modeled(0.0)) / sd;
                    all.push(Predicted { residual, slope: slope / sd });
                }
            }
        }
        Ok(all)
    }
}

/// The change of the dose's logarithm over which the slope of a size is taken.
const SIZE_CHANGE: f64 = 0.02;

/// Returns the variance of a count, given the standard deviation of its edges and the pixels that each
/// column of the model stands for.
fn variance_of(counted: f64, edges_sd: f64, sampled: f64) -> f64 {
    // A sample's columns stand for many pixels each, and are Poisson counts.
    let sampling = if sampled > 1.0 { counted * sampled } else { 0.0 };
    (COUNT_NOISE * counted).powi(2) + edges_sd * edges_sd + sampling + 1.0
}

/// The sums of squares of a print's measurements at all doses of a grid.
struct SquaresByDose {
    /// Where each voxel is cured or not.
    sharp: Vec<f64>,
    /// Where an edge lies anywhere in its pixel.
    loose: Vec<f64>,
}

impl Model<'_> {
    /// Returns the sums of squares of a print, at a depth and a spread, and at all doses of a grid.
    fn squares_by_dose(
        &mut self,
        [depth, spread]: [f64; 2],
        print: &MeasuredPrint,
        grid: &DoseGrid,
    ) -> Result<SquaresByDose, PartError> {
        let logs = at_unit_dose([depth, spread]);
        let (edges_px, part) = (Rc::clone(&self.edges_px), self.part);
        let light = shifted(&self.light, &logs);
        let Spreading { simulation, pixels, .. } = self.at(&logs)?;
        let sampled = f64::from(simulation.sampled());
        let has_counts = |place: &Measurement| matches!(place, Measurement::Counts { .. });
        let curves = print
            .places
            .iter()
            .any(has_counts)
            .then(|| simulation.dose_curves(&print.times, grid, true));
        let [mut sharp, mut loose] = [(); 2].map(|()| vec![0.0; grid.count()]);
        for place in &print.places {
            match place {
                Measurement::Counts { layer, counts } => {
                    let Some(curves) = &curves else { continue };
                    for (counted, modeled) in counts.iter().zip(curves.row(*layer)) {
                        let weight = |edge_px: f64| {
                            variance_of(*counted, edge_px * edges_px[*layer], sampled).recip()
                        };
                        let (of_sharp, of_loose) = (weight(SHARP_EDGE_PX), weight(EDGE_PX));
                        for (number, modeled) in modeled.iter().enumerate() {
                            let square = (counted - *modeled as f64).powi(2);
                            sharp[number] += of_sharp * square;
                            loose[number] += of_loose * square;
                        }
                    }
                }
                Measurement::Height { layer, pixel, um, sd_um } => {
                    let lights =
                        pixels.entry(*pixel).or_insert_with(|| simulation.light_at(*pixel));
                    let doses = simulation.doses_of(lights, &print.times);
                    let top_um = top_um(part);
                    for number in 0..grid.count() {
                        let factor = grid.log(number).exp();
                        let height = height_with(part, &doses, factor, &light, *layer);
                        let height_um = height.map_or(top_um, Length::um);
                        let square = ((um - height_um) / sd_um).powi(2);
                        sharp[number] += square;
                        loose[number] += square;
                    }
                }
                Measurement::Size { place, size, sd } => {
                    let doses = logs_of(place, simulation, pixels, &print.times);
                    let square = |number: usize| {
                        let modeled = place.size(part, &light, &doses, grid.log(number));
                        ((size - modeled) / sd).powi(2)
                    };
                    let squares: Vec<_> = (0..grid.count()).into_par_iter().map(square).collect();
                    for (number, square) in squares.into_iter().enumerate() {
                        sharp[number] += square;
                        loose[number] += square;
                    }
                }
            }
        }
        Ok(SquaresByDose { sharp, loose })
    }
}

/// Returns a state's logarithms where the dose is the material's.
fn at_unit_dose([depth, spread]: [f64; 2]) -> [f64; NUMBERS] {
    let mut logs = [0.0; NUMBERS];
    (logs[DEPTH], logs[SPREAD]) = (depth, spread);
    logs
}

/// Returns the height of the part's top, where resin begins.
fn top_um(part: &TimedPart) -> f64 {
    let top = part.layers()[0];
    top.z.um() + top.thickness.um()
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

    /// Returns states around the one with the least sum of squares, each with its weight: a lattice of
    /// spreads and depths in the directions of their covariance, with all doses at each point. A
    /// lattice is laid again around the last one's states until it is as close as they are.
    ///
    /// Counts have steps where the edges of many layers pass the middle of pixels: all doses together
    /// show on which side of a step a print was.
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
        let places: usize = self.prints.iter().map(|print| print.places.len()).sum();
        let (mut lattices, mut tried) = (Vec::new(), Vec::new());
        loop {
            let lattice = Lattice::of(&mean, &covariance);
            let grid = grid_around(&mean, &covariance);
            for pair in lattice.pairs() {
                let squares = |print| self.model.squares_by_dose(pair, print, &grid);
                let prints = self.prints.iter().map(squares).collect::<Result<_, PartError>>()?;
                tried.push(Tried { pair, lattice: lattices.len(), grid, prints });
            }
            lattices.push(lattice);
            let least = |of: fn(&SquaresByDose) -> &[f64]| {
                let of_tried = |tried: &Tried| {
                    let of_print = |print| of(print).iter().copied().fold(f64::INFINITY, f64::min);
                    tried.prints.iter().map(of_print).sum::<f64>()
                };
                tried.iter().map(of_tried).fold(f64::INFINITY, f64::min) / places as f64
            };
            // Measurements that no state explains are less exact than they should be (Birge 1932).
            let birge = self.variance_shown(least(|print| &print.sharp), places);
            let doses: Vec<_> = tried.iter().map(|tried| self.doses_of(tried, birge)).collect();
            // A state stands for the area around it, where lattices overlap for less of it (the mixture
            // of Owen and Zhou 2000).
            let logs = tried.iter().zip(&doses).map(|(tried, (log_sum, _))| {
                let of_lattice = |(number, lattice): (usize, &Lattice)| {
                    if number == tried.lattice || lattice.holds(tried.pair) {
                        lattice.density()
                    } else {
                        0.0
                    }
                };
                let density: f64 = lattices.iter().enumerate().map(of_lattice).sum();
                [log_sum - 0.5 * self.pair_prior_squares(tried.pair), density.ln()]
            });
            let (weights, share) = weights_of(&logs.collect::<Vec<_>>());
            let members: Vec<_> = tried
                .iter()
                .zip(&weights)
                .zip(doses)
                .map(|((tried, &weight), (_, doses))| {
                    (Member { pair: tried.pair, weight, doses }, tried.grid)
                })
                .collect();
            (mean, covariance) = moments_of(&members);
            lattices[lattices.len() - 1].add_cells(&mut covariance);
            let count = dot(&weights, &weights).recip();
            if share == 1.0 && count >= ENOUGH || lattices.len() == MOST_ROUNDS {
                let misfit = least(|print| &print.loose).sqrt();
                let grid = grid_around(&mean, &covariance);
                let members = resampled(members).into_iter().map(|(member, own)| {
                    let doses = regridded(&member.doses, &own, &grid);
                    Member { doses, ..member }
                });
                let members = members.collect();
                let mean = LightState::new(&mean, covariance);
                return Ok(ProbableStates { mean, misfit, grid, members });
            }
        }
    }

    /// Returns the variance of measurements as a multiple of the assumed one, given the mean square of
    /// the best state's distances. A count states no variance, and may be more exact than assumed: the
    /// variance is the mean of an inverse gamma distribution whose prior is worth some measurements
    /// (Gelman et al. 2013, section 2.6).
    fn variance_shown(&self, mean_square: f64, places: usize) -> f64 {
        let is_counted = |place: &Measurement| matches!(place, Measurement::Counts { .. });
        if mean_square >= 1.0 || !self.prints.iter().all(|p| p.places.iter().all(is_counted)) {
            return mean_square.max(1.0);
        }
        (PRIOR_PLACES + places as f64 * mean_square) / (PRIOR_PLACES + places as f64)
    }

    /// Returns the logarithm of how probable a depth and a spread make the measurements, and the
    /// probabilities of the doses of the last print (a filter of a random walk: Särkkä 2013, section
    /// 4.1).
    fn doses_of(&self, tried: &Tried, birge: f64) -> (f64, Vec<f64>) {
        let grid = &tried.grid;
        let prior = |number| 0.5 * (grid.log(number) / self.prior_sds[DOSE]).powi(2);
        let mut logs: Vec<_> = (0..grid.count()).map(|number| -prior(number)).collect();
        let (mut log_sum, mut doses) = (0.0, Vec::new());
        for (number, print) in tried.prints.iter().enumerate() {
            if number > 0 {
                let drifted = drifted(&doses, grid.step, 0);
                logs = drifted.into_iter().map(|dose| dose.max(f64::MIN_POSITIVE).ln()).collect();
            }
            logs.iter_mut()
                .zip(&print.sharp)
                .for_each(|(log, squares)| *log -= 0.5 * squares / birge);
            let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            doses = logs.iter().map(|log| (log - most).exp()).collect();
            let sum: f64 = doses.iter().sum();
            doses.iter_mut().for_each(|dose| *dose /= sum);
            log_sum += most + sum.ln();
        }
        // Sums over doses are integrals once multiplied by the grid's step.
        (log_sum + grid.step.ln(), doses)
    }

    /// Returns the sum of squares of a depth and a spread themselves.
    fn pair_prior_squares(&self, pair: [f64; 2]) -> f64 {
        self.prior_squares(&at_unit_dose(pair))
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
            let here = self.model.predict(logs, print)?;
            sum.value += 0.5 * squares_of(&here, drift);
            if !with_slopes {
                continue;
            }
            let mut moved = |number: usize, by: f64| {
                let mut moved = *logs;
                moved[number] += by;
                let there = self.model.predict(&moved, print)?;
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

/// Returns the probabilities of doses after the drift to the next print, `more` steps beyond both ends.
fn drifted(doses: &[f64], step: f64, more: usize) -> Vec<f64> {
    let reach = drift_steps(step) as isize;
    let weight = |away: isize| (-0.5 * (away as f64 * step / DRIFT).powi(2)).exp();
    let weights: Vec<_> = (-reach..=reach).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    let mut after = vec![0.0; doses.len() + 2 * more];
    for (from, dose) in doses.iter().enumerate().filter(|(_, dose)| **dose > 0.0) {
        let first = from as isize + more as isize - reach;
        for (away, weight) in weights.iter().enumerate() {
            let to = usize::try_from(first + away as isize).ok().and_then(|to| after.get_mut(to));
            if let Some(to) = to {
                *to += dose * weight / sum;
            }
        }
    }
    after
}

/// Returns the steps that a drift reaches.
fn drift_steps(step: f64) -> usize {
    (3.5 * DRIFT / step).ceil() as usize
}

/// A depth and a spread that were tried, with the sums of squares of each print.
struct Tried {
    pair: [f64; 2],
    /// The number of its lattice.
    lattice: usize,
    grid: DoseGrid,
    prints: Vec<SquaresByDose>,
}

/// Returns the doses to try around a mean.
fn grid_around(mean: &[f64; NUMBERS], covariance: &[[f64; NUMBERS]; NUMBERS]) -> DoseGrid {
    let half_width = (WIDTH_SDS * covariance[DOSE][DOSE].sqrt()).clamp(LEAST_WIDTH, MOST[DOSE]);
    DoseGrid { middle: mean[DOSE], step: half_width / DOSES as f64, half: DOSES }
}

/// Returns the probabilities of doses of a grid at the doses of another one: each is shared by its two
/// neighbors. Doses beyond the other grid are left out.
fn regridded(doses: &[f64], from: &DoseGrid, to: &DoseGrid) -> Vec<f64> {
    let mut all = vec![0.0; to.count()];
    for (number, dose) in doses.iter().enumerate() {
        let place = (from.log(number) - to.log(0)) / to.step;
        let below = place.floor();
        for (at, share) in [(below, below + 1.0 - place), (below + 1.0, place - below)] {
            if at >= 0.0 && at < to.count() as f64 {
                all[at as usize] += share * dose;
            }
        }
    }
    all
}

/// Returns a few members, of equal weights, which stand for all (systematic resampling: Kitagawa 1996).
/// Spreads are in order: light of columns is computed for each.
fn resampled(mut members: Vec<(Member, DoseGrid)>) -> Vec<(Member, DoseGrid)> {
    members.sort_by(|(a, _), (b, _)| a.pair[1].total_cmp(&b.pair[1]));
    let (mut sum, mut taken) = (0.0, 0_u32);
    let mut few = Vec::new();
    for (member, grid) in members {
        sum += f64::from(FEW) * member.weight;
        // Places are at the middles of equal parts of the weight.
        let upto = ((sum + 0.5) as u32).min(FEW);
        if upto > taken {
            let weight = f64::from(upto - taken) / f64::from(FEW);
            few.push((Member { weight, ..member }, grid));
            taken = upto;
        }
    }
    few
}

/// Returns the mean and the covariance of states.
fn moments_of(members: &[(Member, DoseGrid)]) -> ([f64; NUMBERS], [[f64; NUMBERS]; NUMBERS]) {
    let own = |(member, grid): &(Member, DoseGrid)| {
        let logs = || member.doses.iter().enumerate().map(|(at, dose)| (grid.log(at), dose));
        let mean = logs().map(|(log, dose)| log * dose).sum::<f64>();
        let variance = logs().map(|(log, dose)| (log - mean).powi(2) * dose).sum::<f64>();
        let mut logs = at_unit_dose(member.pair);
        logs[DOSE] = mean;
        // A dose stands for all doses within a step.
        (member.weight, logs, variance + grid.step * grid.step / 12.0)
    };
    let all: Vec<_> = members.iter().map(own).collect();
    let mean: [f64; NUMBERS] =
        std::array::from_fn(|k| all.iter().map(|(weight, logs, _)| weight * logs[k]).sum());
    // Distances from a mean of few states are too small.
    let few = 1.0 / (1.0 - all.iter().map(|(weight, ..)| weight * weight).sum::<f64>()).max(0.5);
    let covariance = std::array::from_fn(|a| {
        std::array::from_fn(|b| {
            let within = |variance: f64| if (a, b) == (DOSE, DOSE) { variance } else { 0.0 };
            let of = |(weight, logs, variance): &(f64, [f64; NUMBERS], f64)| {
                weight * (few * (logs[a] - mean[a]) * (logs[b] - mean[b]) + within(*variance))
            };
            all.iter().map(of).sum()
        })
    });
    (mean, covariance)
}

/// Returns the weights of states, whose sum is 1, and the share of their logarithms that is taken. The
/// states have the logarithm of their probability, and of the density of states at their place.
///
/// Few states are left of measurements that are more exact than the states are close. Weights are
/// evened out then, until enough states are left.
fn weights_of(logs: &[[f64; 2]]) -> (Vec<f64>, f64) {
    let most = logs.iter().map(|log| log[0]).fold(f64::NEG_INFINITY, f64::max);
    let densest = logs.iter().map(|log| log[1]).fold(f64::NEG_INFINITY, f64::max);
    let at = |share: f64| {
        let weight = |log: &[f64; 2]| (share * (log[0] - most) - (log[1] - densest)).exp();
        let weights: Vec<_> = logs.iter().map(weight).collect();
        let sum: f64 = weights.iter().sum();
        weights.into_iter().map(|weight| weight / sum).collect::<Vec<_>>()
    };
    // The effective number of states (Kong 1992).
    let is_enough = |weights: &[f64]| dot(weights, weights).recip() >= LEAST_COUNT;
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

/// A lattice of spreads and depths around a mean: the steps of both.
struct Lattice {
    mean: [f64; 2],
    /// The step of the spread, and how far the depth changes with it.
    spread_step: f64,
    along_step: f64,
    depth_step: f64,
}

/// The steps of a lattice to each side of its mean, and their length in standard deviations.
const SPREAD_STEPS: i32 = 2;
const SPREAD_STEP_SDS: f64 = 1.2;
const DEPTH_STEPS: i32 = 4;
const DEPTH_STEP_SDS: f64 = 0.65;
/// The least variance of a direction in which states are tried.
const LEAST_VARIANCE: f64 = 1e-8;

impl Lattice {
    /// The root's first column alone changes the spread: light of columns is computed for each.
    fn of(mean: &[f64; NUMBERS], covariance: &[[f64; NUMBERS]; NUMBERS]) -> Self {
        let spread_sd = (covariance[SPREAD][SPREAD] + LEAST_VARIANCE).sqrt();
        let along = covariance[DEPTH][SPREAD] / spread_sd;
        let across = (covariance[DEPTH][DEPTH] - along * along).max(0.0) + LEAST_VARIANCE;
        Self {
            mean: [mean[DEPTH], mean[SPREAD]],
            spread_step: SPREAD_STEP_SDS * spread_sd,
            along_step: SPREAD_STEP_SDS * along,
            depth_step: DEPTH_STEP_SDS * across.sqrt(),
        }
    }

    /// Returns the number of its states in a unit of area.
    fn density(&self) -> f64 {
        1.0 / (self.spread_step * self.depth_step)
    }

    /// Returns whether a depth and a spread are within half a step of its states.
    fn holds(&self, [depth, spread]: [f64; 2]) -> bool {
        let of_spread = (spread - self.mean[1]) / self.spread_step;
        let of_depth = (depth - self.mean[0] - self.along_step * of_spread) / self.depth_step;
        let is_within = |at: f64, steps: i32| at.abs() <= f64::from(steps) + 0.5;
        is_within(of_spread, SPREAD_STEPS) && is_within(of_depth, DEPTH_STEPS)
    }

    /// Returns the depths and spreads.
    fn pairs(&self) -> impl Iterator<Item = [f64; 2]> {
        (-SPREAD_STEPS..=SPREAD_STEPS).flat_map(move |spread| {
            (-DEPTH_STEPS..=DEPTH_STEPS).map(move |depth| {
                let [spread, depth] = [spread, depth].map(f64::from);
                let along = self.along_step * spread + self.depth_step * depth;
                [
                    (self.mean[0] + along).clamp(-MOST[DEPTH], MOST[DEPTH]),
                    (self.mean[1] + self.spread_step * spread).clamp(-MOST[SPREAD], MOST[SPREAD]),
                ]
            })
        })
    }

    /// Adds what lies between the states to their covariance: each stands for all within half a step.
    /// Without that, states of one spread alone may look probable, and the next lattice is as narrow.
    fn add_cells(&self, covariance: &mut [[f64; NUMBERS]; NUMBERS]) {
        covariance[SPREAD][SPREAD] += self.spread_step.powi(2) / 12.0;
        covariance[DEPTH][DEPTH] += (self.along_step.powi(2) + self.depth_step.powi(2)) / 12.0;
        let both = self.spread_step * self.along_step / 12.0;
        covariance[DEPTH][SPREAD] += both;
        covariance[SPREAD][DEPTH] += both;
    }
}

/// The doses on each side of the mean.
const DOSES: usize = 150;
/// The distance from the mean to the last of them, in standard deviations.
const WIDTH_SDS: f64 = 6.0;
/// The least distance, as a logarithm: earlier prints had other doses.
const LEAST_WIDTH: f64 = 0.1;
/// The measurements that the assumed variance of counts is worth.
const PRIOR_PLACES: f64 = 10.0;
/// The most lattices, each around the states of the last one.
const MOST_ROUNDS: usize = 8;
/// The members by which the next print is expected.
const FEW: u32 = 40;
/// Weights are evened out until this many states count. If as many count as `ENOUGH`
/// without that, they are close enough: of states as far apart as its covariance says, 16 do.
const LEAST_COUNT: f64 = 8.0;
const ENOUGH: f64 = 16.0;

/// States that the measurements allow.
pub(crate) struct ProbableStates {
    /// Their mean and covariance.
    pub(crate) mean: LightState,
    /// The root mean square of the measurements' distances from the best state's, in standard
    /// deviations.
    pub(crate) misfit: f64,
    /// The doses of the members.
    grid: DoseGrid,
    members: Vec<Member>,
}

/// A depth and a spread with all doses.
struct Member {
    pair: [f64; 2],
    /// The weights of members sum to 1.
    weight: f64,
    /// How probable each dose of the last print is.
    doses: Vec<f64>,
}

/// The wrong voxels of the next print at some times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Forecast {
    /// The mean over all states, and the ends of the interval of 95 % of them.
    pub(crate) wrong: [f64; 3],
    /// The factor of all times that leaves the fewest on average, and how many.
    pub(crate) scale: f64,
    pub(crate) wrong_scaled: f64,
}

impl ProbableStates {
    /// Returns the states of a light that is known.
    #[cfg(test)]
    pub(super) fn known(factors: [f64; NUMBERS]) -> Self {
        let logs = factors.map(f64::ln);
        let grid = DoseGrid { middle: logs[DOSE], step: LEAST_WIDTH / DOSES as f64, half: DOSES };
        let mut doses = vec![0.0; grid.count()];
        doses[DOSES] = 1.0;
        let members = vec![Member { pair: [logs[DEPTH], logs[SPREAD]], weight: 1.0, doses }];
        let mean = LightState::new(&logs, [[0.0; NUMBERS]; NUMBERS]);
        Self { mean, misfit: 0.0, grid, members }
    }

    /// Returns the wrong voxels that each of some times would leave in the next print, whose dose
    /// drifts on.
    pub(crate) fn forecasts(
        &self,
        model: &mut Model<'_>,
        times: &[Vec<f64>],
    ) -> Result<Vec<Forecast>, PartError> {
        let step = self.grid.step;
        let (drift, scales) = (drift_steps(step), (MOST_SCALE / step).ceil() as usize);
        let wider = DoseGrid { half: self.grid.half + drift + scales, ..self.grid };
        let least = LEAST_WEIGHT / self.members.len() as f64;
        let count = || self.members.iter().filter(|member| member.weight > least);
        let total: f64 = count().map(|member| member.weight).sum();
        // Expected voxels by scale, and all voxels with their probabilities, for each of the times.
        let mut by_scale = vec![vec![0.0; 2 * scales + 1]; times.len()];
        let mut all = vec![Vec::new(); times.len()];
        for member in count() {
            let doses = drifted(&member.doses, step, drift);
            let simulation = &model.at(&at_unit_dose(member.pair))?.simulation;
            for ((by_scale, all), times) in by_scale.iter_mut().zip(&mut all).zip(times) {
                let curves = simulation.dose_curves(times, &wider, false);
                let [over, under] = curves.row(0);
                let wrong: Vec<_> = over.iter().zip(under).map(|(a, b)| (a + b) as f64).collect();
                let probable = doses.iter().enumerate().filter(|(_, dose)| **dose > 1e-9);
                for (at, dose) in probable {
                    let weight = dose * member.weight / total;
                    all.push((wrong[at + scales], weight));
                    let scaled = &wrong[at..=at + 2 * scales];
                    by_scale.iter_mut().zip(scaled).for_each(|(sum, wrong)| *sum += weight * wrong);
                }
            }
        }
        let forecast = |(by_scale, mut all): (Vec<f64>, Vec<(f64, f64)>)| {
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            let quantile = |share: f64| {
                let mut sum = 0.0;
                let found = all.iter().find(|(_, weight)| {
                    sum += weight;
                    sum >= share
                });
                found.or(all.last()).map_or(0.0, |(wrong, _)| *wrong)
            };
            let best = (0..by_scale.len()).min_by(|&a, &b| by_scale[a].total_cmp(&by_scale[b]));
            let best = best.unwrap_or(scales);
            Forecast {
                wrong: [by_scale[scales], quantile(0.025), quantile(0.975)],
                scale: ((best as f64 - scales as f64) * step).exp(),
                wrong_scaled: by_scale[best],
            }
        };
        Ok(by_scale.into_iter().zip(all).map(forecast).collect())
    }
}

/// States of less weight than this share of the mean weight are left out of what is expected.
const LEAST_WEIGHT: f64 = 0.1;
/// The largest logarithm of the factor of all times that is tried: a plan for one state may lie near a
/// step of its counts.
const MOST_SCALE: f64 = 0.06;
