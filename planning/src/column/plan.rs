//! From a target to bitmaps (000 figure 5.1).

use lamp_stack::Length;
use thiserror::Error;

use super::bitmaps::{Bitmap, Mirrors, black_and_white, gray};
use super::clusters::{Clusters, TooFewTimes};
use super::curve::HeightCurve;
use super::heights::{HeightMisfit, nearest_heights};
use super::levels::{WantedDoses, best_seconds};
use super::light::GlassLight;
use super::spread::Tracing;
use super::times::{Allowed, MirrorTimes, Stop, nearest_times};
use crate::target::{HeightMap, Place};

/// The quantity that should be nearest to the target's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColumnObjective {
    /// Doses: 000's "optimize E".
    #[default]
    Dose,
    /// Heights: 000's "optimize z". Light that cures nothing costs nothing.
    Height,
}

lamp_stack::named!(ColumnObjective { Dose = "dose", Height = "height" });

/// How to plan.
#[derive(Clone, Debug)]
pub struct ColumnOptions {
    /// The quantity that should be nearest to the target's.
    pub objective: ColumnObjective,
    /// How many bitmaps are shown.
    pub bitmaps: usize,
    /// Whether fewer are enough where mirrors have fewer distinct times.
    pub fewer: bool,
    /// For gray bitmaps: the light of each level as a share of white's, rising.
    pub gray: Option<Box<[f64; 256]>>,
    /// The longest time for which a mirror may be on, in seconds.
    pub max_s: f64,
    /// The share by which doses may be off where that makes times shorter and more even: the standard
    /// deviation to which the dose that a height needs is known. 0 asks for the nearest doses alone.
    pub dose_error: f64,
    /// The distance by which the glass may be displaced along each axis: errors are means over no
    /// displacement and this displacement in both directions.
    pub robust: Length,
    /// The display's step, in seconds: all times are multiples of it.
    pub step_s: f64,
    /// When the search for times ends.
    pub stop: Stop,
}

/// Why a target has no plan.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ColumnError {
    /// A column has a height that no mirror reaches.
    #[error("no light reaches {0}: the target is wider than what the display lights")]
    Dark(Place),
    /// A column has a height and receives light, but not at the points where light is counted.
    #[error("no ray reaches {0}: count more rays of each mirror")]
    NoRay(Place),
    /// A height that no dose cures.
    #[error("the dose that would cure {0} is too large a number")]
    NoDose(Length),
    /// More bitmaps than there are times.
    #[error(transparent)]
    TooFewTimes(#[from] TooFewTimes),
    /// All times are shorter than the display can show.
    #[error(
        "the longest time, {:.3} ms, is under the display's step of {:.3} ms: less light, or a \
         resin that is slower, makes it longer", 1000.0 * longest_s, 1000.0 * step_s
    )]
    UnderAStep {
        /// The longest time.
        longest_s: f64,
        /// The display's step.
        step_s: f64,
    },
    /// Nobody wants the plan anymore.
    #[error("the search was stopped")]
    Stopped,
}

/// A plan of bitmaps.
#[derive(Clone, Debug)]
pub struct ColumnPlan {
    /// The times without clusters. No bitmaps can have an error smaller than theirs by more than
    /// their price.
    pub best: MirrorTimes,
    /// Doses of the best times, in mJ/cm2.
    pub best_doses: Vec<f64>,
    /// The bitmaps, in the order of their display.
    pub bitmaps: Vec<Bitmap>,
    /// The time for which each mirror is on, in seconds of white light.
    pub seconds: Vec<f64>,
    /// The error of the bitmaps, as [`MirrorTimes::error`].
    pub error: f64,
    /// Doses of the bitmaps, in mJ/cm2.
    pub doses: Vec<f64>,
}

impl ColumnPlan {
    /// Returns the excess of the bitmaps' error over the least error, as a share of the least
    /// error.
    pub fn excess(&self) -> f64 {
        if self.error > self.best.error { self.error / self.best.error - 1.0 } else { 0.0 }
    }
}

/// The target, light and options of a plan.
struct ColumnProblem<'a> {
    light: &'a GlassLight,
    /// The light at each displacement that the plan must tolerate.
    lights: Vec<GlassLight>,
    heights_um: &'a [f64],
    wanted: Vec<f64>,
    curve: HeightCurve,
    options: &'a ColumnOptions,
}

/// Plans the bitmaps that cure a target through a glass. The search asks `is_stopped` every few
/// steps whether to end without a plan.
///
/// # Errors
/// Returns an error if light does not reach a column that has a height, if no dose cures it, if
/// there are fewer distinct times than bitmaps, if all are too short, or if the search is stopped.
pub fn plan(
    light: &GlassLight,
    target: &HeightMap,
    curve: HeightCurve,
    options: &ColumnOptions,
    is_stopped: impl Fn() -> bool,
) -> Result<ColumnPlan, ColumnError> {
    let problem = ColumnProblem::new(light, target, curve, options)?;
    let best = problem.best_times(&is_stopped);
    if is_stopped() {
        return Err(ColumnError::Stopped);
    }
    let longest_s = best.seconds.iter().copied().fold(0.0, f64::max);
    if longest_s < options.step_s {
        return Err(ColumnError::UnderAStep { longest_s, step_s: options.step_s });
    }
    let (bitmaps, steps) = problem.bitmaps(&best)?;
    let seconds: Vec<_> = steps.iter().map(|steps| steps * options.step_s).collect();
    Ok(ColumnPlan {
        best_doses: light.doses(&best.seconds),
        doses: light.doses(&seconds),
        error: problem.error(&seconds),
        best,
        bitmaps,
        seconds,
    })
}

impl<'a> ColumnProblem<'a> {
    fn new(
        light: &'a GlassLight,
        target: &'a HeightMap,
        curve: HeightCurve,
        options: &'a ColumnOptions,
    ) -> Result<Self, ColumnError> {
        let heights_um = &target.heights_um;
        let lit = light.doses(&vec![1.0; light.setup().mirrors.iter().product()]);
        let is_dark = |(height, light): (&f64, &f64)| *height > 0.0 && *light <= 0.0;
        if let Some(column) = heights_um.iter().zip(&lit).position(is_dark) {
            let place = Place::of(&target.grid, column);
            // A ray may miss a column that light reaches.
            let exact = light.by(Tracing::Exact);
            let seconds = vec![1.0; light.setup().mirrors.iter().product()];
            let is_missed = exact.doses(&seconds)[column] > 0.0;
            return Err(if is_missed {
                ColumnError::NoRay(place)
            } else {
                ColumnError::Dark(place)
            });
        }
        let dose = |&um: &f64| curve.dose(um).ok_or(ColumnError::NoDose(Length::from_um(um)));
        let wanted = heights_um.iter().map(dose).collect::<Result<_, _>>()?;
        let shifts = options.shifts_um();
        let shifts = shifts.iter().flat_map(|&y| shifts.iter().map(move |&x| [x, y]));
        let lights = shifts.map(|shift| light.shifted(shift)).collect();
        Ok(Self { light, lights, heights_um, wanted, curve, options })
    }

    fn height_error(&self) -> HeightMisfit<'_> {
        HeightMisfit { lights: &self.lights, heights_um: self.heights_um, curve: self.curve }
    }

    fn best_times(&self, is_stopped: &dyn Fn() -> bool) -> MirrorTimes {
        let ColumnOptions { objective, max_s, stop, .. } = *self.options;
        let allowed = Allowed { max_s, evenness: self.evenness() };
        match objective {
            ColumnObjective::Dose => {
                let shifts_um = self.options.shifts_um();
                nearest_times(self.light, &self.wanted, allowed, &shifts_um, stop, is_stopped)
            }
            ColumnObjective::Height => {
                nearest_heights(&self.height_error(), allowed, stop, is_stopped)
            }
        }
    }

    /// Returns the weight of half the squared times against half the squared errors.
    ///
    /// The times are the most probable ones if the wanted doses E are known to a share s of a dose, and
    /// times are around T, the time in which a wide field gives it: |H t - E|²/(s I T)² + n |t|²/T², where
    /// n is the number of columns to a mirror, so that finer columns change nothing. In heights, the
    /// difference of a dose counts by the curve's slope at that dose.
    fn evenness(&self) -> f64 {
        let setup = self.light.setup();
        let columns = (setup.pitch_um / setup.voxel_um).powi(2);
        let dose = self.options.dose_error * setup.irradiance;
        let slope = match self.options.objective {
            ColumnObjective::Dose => 1.0,
            ColumnObjective::Height => {
                let highest = self.wanted.iter().copied().fold(0.0, f64::max);
                self.curve.straight_below(highest).1
            }
        };
        columns * (dose * slope).powi(2)
    }

    /// Returns the bitmaps for the times, and the number of steps for which each mirror is on.
    fn bitmaps(&self, best: &MirrorTimes) -> Result<(Vec<Bitmap>, Vec<f64>), ColumnError> {
        let setup = self.light.setup();
        let mirrors = Mirrors { count: setup.mirrors, display: setup.display };
        let times: Vec<_> = best.seconds.iter().map(|s| s / self.options.step_s).collect();
        let whole: Vec<_> = times.iter().map(|steps| steps.round() as u64).collect();
        let clusters = self.clusters(&whole)?;
        if let Some(shares) = &self.options.gray {
            return Ok(gray(mirrors, &times, &clusters, shares));
        }
        let of: Vec<_> = whole.iter().map(|&time| clusters.of_time(time) as u16).collect();
        let seconds = self.best_seconds(best, &of, clusters.lowest.len());
        let mut end = 0.0;
        let ends: Vec<_> = seconds
            .iter()
            .map(|seconds| {
                // Ends are rounded, not durations, so that rounding errors do not add up from
                // bitmap to bitmap.
                end += seconds;
                (end / self.options.step_s).round() as u64
            })
            .collect();
        Ok(black_and_white(mirrors, &of, &ends))
    }

    /// Returns the clusters of times in steps.
    fn clusters(&self, steps: &[u64]) -> Result<Clusters, ColumnError> {
        let ColumnOptions { bitmaps, fewer, .. } = *self.options;
        match Clusters::of(steps, bitmaps) {
            Err(TooFewTimes { distinct: distinct @ 1.., .. }) if fewer => {
                Ok(Clusters::of(steps, distinct)?)
            }
            clusters => Ok(clusters?),
        }
    }

    /// Returns the best times of bitmaps.
    fn best_seconds(&self, best: &MirrorTimes, clusters: &[u16], count: usize) -> Vec<f64> {
        let ColumnOptions { objective, max_s, .. } = *self.options;
        let wishes: Vec<_> = match objective {
            ColumnObjective::Dose => Vec::new(),
            ColumnObjective::Height => {
                let error = self.height_error();
                self.lights.iter().map(|light| error.squares(&light.doses(&best.seconds))).collect()
            }
        };
        let wishes: Vec<_> = match objective {
            ColumnObjective::Dose => self
                .lights
                .iter()
                .map(|light| WantedDoses { light, wanted: &self.wanted, weights: &[] })
                .collect(),
            ColumnObjective::Height => self
                .lights
                .iter()
                .zip(&wishes)
                .map(|(light, to)| WantedDoses { light, wanted: &to.wanted, weights: &to.weights })
                .collect(),
        };
        best_seconds(&wishes, clusters, count, max_s)
    }

    /// Returns the error of times.
    fn error(&self, seconds: &[f64]) -> f64 {
        match self.options.objective {
            ColumnObjective::Height => self.height_error().at(seconds),
            ColumnObjective::Dose => {
                let of = |light: &GlassLight| -> f64 {
                    let doses = light.doses(seconds);
                    doses.iter().zip(&self.wanted).map(|(dose, want)| (dose - want).powi(2)).sum()
                };
                0.5 * self.lights.iter().map(of).sum::<f64>() / self.lights.len() as f64
            }
        }
    }
}

impl ColumnOptions {
    /// Returns the displacements of the light along an axis.
    fn shifts_um(&self) -> Vec<f64> {
        let um = self.robust.um();
        if um > 0.0 { vec![-um, 0.0, um] } else { vec![0.0] }
    }
}
