//! Turns measurements into the times of the next print.

use lamp_stack::Length;

use super::convergence::{Convergence, convergence, largest_safe_gain};
use super::error::LearnError;
use super::heights::{FaceError, face_at};
use super::job::Job;
use super::law::Law;
use super::measured::{AreaRow, HeightRow, PrintMeasurements, sd_of_place};
use super::place::PlacePixels;
use super::response::Response;
use super::state::{Forecast, LightState, MeasuredPrint, Measurement, Model};
use super::state::{ProbableStates, states_of};
use crate::cure_section::PlaceSize;
use crate::speed::{Simulation, SpeedOptions, times_of};

/// The gap of a plan, as a share of the unplanned error: as `lamp plan speed` has it, since a state is
/// not known any better.
const GAP: f64 = 0.01;
/// The penetration depths, as shares of the model's, for which the decay of a law's errors is
/// reported.
const DEPTHS: [f64; 3] = [1.0, 0.7, 1.3];
/// The shares of the way to the planned times, as logarithms, that a step may go.
const SHARES: [f64; 7] = [1.0, 0.75, 0.5, 0.35, 0.2, 0.1, 0.0];
/// The memory that helps: a state is known from thousands of columns as well as from millions.
const MOST_MEMORY: u64 = 64 << 20;
/// The measured prints that a state is learned from, the latest ones: light and resin drift.
const LATEST: usize = 4;
/// Counts may be this multiple of what there can be, since they have noise.
const SLACK: f64 = 1.1;
/// The most wrong pixels that a layer may have, as a multiple of an image's pixels: light cures
/// beyond the image, too.
const MOST_WRONG: f64 = 9.0;

/// How measurements change times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// By the state of light and resin that all prints show, for which the times are planned again.
    State,
    /// By a law of 004, from the last print's wrong pixels.
    Law(Law),
}

/// The next print, and the lesson behind it.
#[derive(Clone, Debug)]
pub struct Learned {
    /// The times in seconds, from the light on.
    pub times: Vec<f64>,
    /// The lesson.
    pub lesson: Lesson,
}

/// The lesson of a print.
#[derive(Clone, Debug)]
pub enum Lesson {
    /// The state of light and resin.
    State(Box<StateLesson>),
    /// The decay of errors by a law.
    Law {
        /// The decay with each print, for each of some penetration depths, as shares of the model's.
        decay: Vec<(f64, Convergence)>,
        /// The largest gain with which no print's errors grow, in seconds a pixel. It is zero if
        /// no gain is safe.
        safe_gain: f64,
    },
}

/// The state that the prints show, and what is expected of the next one.
#[derive(Clone, Debug, PartialEq)]
pub struct StateLesson {
    /// The state before the print was measured.
    pub before: LightState,
    /// The state after.
    pub after: LightState,
    /// The root mean square of the distances of the measurements from the state's, in standard
    /// deviations: about 1 if the state explains them.
    pub misfit: f64,
    /// The print with the least error so far, from whose times the step begins.
    pub from: usize,
    /// The share of the way from there to the planned times, as logarithms, that leaves the fewest
    /// wrong voxels at all states that the measurements allow.
    pub share: f64,
    /// The wrong voxels of the next print that are expected: their mean, and the ends of the interval of
    /// 95 % of the states.
    pub expected: [f64; 3],
    /// The indices of the layers that no time of the platform cures, bottom first.
    pub uncurable: Vec<u32>,
}

/// Learns from the measurements of a print of a job, in `memory` bytes.
///
/// # Errors
/// Returns an error if the stack lacks a measured layer or face, if a count is impossible, if the
/// model cannot plan the part, or if a law is to learn from heights.
pub fn learn(
    job: &Job,
    print: usize,
    measured: &PrintMeasurements,
    method: Method,
    memory: u64,
) -> Result<Learned, LearnError> {
    match (method, measured) {
        (Method::State, _) => from_state(job, print, measured, memory.min(MOST_MEMORY)),
        (Method::Law(law), PrintMeasurements::Areas(rows)) => {
            from_law(job, print, rows, &law, memory)
        }
        (Method::Law(_), PrintMeasurements::Heights(_) | PrintMeasurements::Places { .. }) => {
            Err(LearnError::LawOfHeights)
        }
    }
}

/// Returns the layer of a row, counted from the light.
fn layer_of(job: &Job, row: &AreaRow) -> Result<usize, LearnError> {
    let layers = job.part.layers();
    let most = MOST_WRONG * job.part.size().map(f64::from).iter().product::<f64>();
    let at = layers.iter().position(|layer| layer.index == row.layer).ok_or_else(|| {
        let [first, last] = [layers.last(), layers.first()].map(|of| of.map_or(0, |l| l.index));
        LearnError::NoLayer { line: row.line, layer: row.layer, first, last }
    })?;
    let wanted = job.part.wanted_px(at) as f64;
    for (count, most, column) in [(row.over, most, "over_px"), (row.under, wanted, "under_px")] {
        if count > SLACK * most {
            return Err(LearnError::TooMany { line: row.line, column, count, most });
        }
    }
    Ok(at)
}

fn from_law(
    job: &Job,
    print: usize,
    rows: &[AreaRow],
    law: &Law,
    memory: u64,
) -> Result<Learned, LearnError> {
    // Layers that are not listed count as right.
    let mut errors = vec![0.0; job.part.layers().len()];
    for row in rows {
        errors[layer_of(job, row)?] = row.under - row.over;
    }
    let now = &job.prints[print];
    let [low, high] = job.platform().bounds(job.part.layers())?;
    let times = law.next(&now.times, &errors, [&low, &high]);
    let times = job.platform().nearest(job.part.layers(), &times)?;
    let simulation = Simulation::new(&job.part, &job.light, memory)?;
    let response = Response::of(&simulation, &now.times);
    let mut decay = Vec::new();
    for share in DEPTHS {
        let real = response.at_depth(&job.part, &job.light, share)?;
        decay.push((share, convergence(law, &errors, &real)));
    }
    let safe_gain = law.gain() * largest_safe_gain(law, &errors, &response);
    Ok(Learned { times, lesson: Lesson::Law { decay, safe_gain } })
}

fn from_state(
    job: &Job,
    print: usize,
    measured: &PrintMeasurements,
    memory: u64,
) -> Result<Learned, LearnError> {
    let earlier = job.prints[..print].iter().filter_map(|print| {
        let (measured, _) = print.measured.as_ref()?;
        Some((&print.times, measured))
    });
    let all: Vec<_> = earlier.chain([(&job.prints[print].times, measured)]).collect();
    let prints = all[all.len().saturating_sub(LATEST)..]
        .iter()
        .map(|(times, measured)| {
            let places = places_of(job, measured)?;
            Ok(MeasuredPrint { times: (*times).clone(), places })
        })
        .collect::<Result<Vec<_>, LearnError>>()?;
    let mut model = Model::new(&job.part, &job.light, memory);
    let states = states_of(&mut model, &job.material, &prints)?;
    // A step begins at the best of all prints that were measured in the same way.
    let error = |measured: &PrintMeasurements| measured.error().number();
    let measured_prints = (0..print)
        .filter_map(|number| Some((number, &job.prints[number].measured.as_ref()?.0)))
        .chain([(print, measured)])
        .filter(|(_, other)| other.is_comparable(measured));
    let from = measured_prints
        .min_by(|a, b| error(a.1).total_cmp(&error(b.1)))
        .map_or(print, |best| best.0);
    let NextTimes { times, share, expected } =
        next_times(job, &mut model, &states, &job.prints[from].times)?;
    let layers = job.part.layers();
    let [_, longest] = job.platform().bounds(layers)?;
    let [all_cured] = model.simulation(&states.mean)?.estimate([&longest]);
    let uncurable = layers
        .iter()
        .enumerate()
        .rev()
        .filter(|(at, _)| 2 * all_cured.layers[*at].under > all_cured.wanted[*at]);
    let uncurable = uncurable.map(|(_, layer)| layer.index).collect();
    let before = job.prints[print].state.clone();
    let before = before.unwrap_or_else(|| LightState::of_material(&job.material));
    let ProbableStates { mean: after, misfit, .. } = states;
    let lesson = StateLesson { before, after, misfit, from, share, expected, uncurable };
    Ok(Learned { times, lesson: Lesson::State(Box::new(lesson)) })
}

/// The times of the next print.
pub(super) struct NextTimes {
    pub(super) times: Vec<f64>,
    /// The share of the way to the planned times, and the wrong voxels, as in [`StateLesson`].
    share: f64,
    pub(super) expected: [f64; 3],
}

/// Plans times for the mean of some states, and takes the share of the way there, from some times, that
/// leaves the fewest wrong voxels on average.
pub(super) fn next_times(
    job: &Job,
    model: &mut Model<'_>,
    states: &ProbableStates,
    from: &[f64],
) -> Result<NextTimes, LearnError> {
    let layers = job.part.layers();
    let options = SpeedOptions {
        light: states.mean.light(&job.light),
        platform: job.platform(),
        margin: job.margin(),
        gap: GAP,
        memory: MOST_MEMORY,
    };
    let planned = times_of(model.simulation(&states.mean)?, layers, &options)?;
    let mut steps = Vec::new();
    for share in SHARES {
        let between = |(from, to): (&f64, &f64)| from.powf(1.0 - share) * to.powf(share);
        let times: Vec<_> = from.iter().zip(&planned).map(between).collect();
        steps.push(job.platform().nearest(layers, &times)?);
    }
    let forecasts = states.forecasts(model, &steps)?;
    // Of equal steps, the longest is first.
    let by_scaled =
        |a: &usize, b: &usize| forecasts[*a].wrong_scaled.total_cmp(&forecasts[*b].wrong_scaled);
    let step = (0..steps.len()).min_by(by_scaled).unwrap_or(0);
    let times: Vec<_> = steps[step].iter().map(|time| forecasts[step].scale * time).collect();
    let times = job.platform().nearest(layers, &times)?;
    let of_scaled = states.forecasts(model, std::slice::from_ref(&times))?;
    let mean = |forecast: &Forecast| forecast.wrong[0];
    // The platform's limits may keep some times from their scale.
    let better = of_scaled.into_iter().find(|scaled| mean(scaled) < mean(&forecasts[step]));
    let (times, forecast) = match better {
        Some(forecast) => (times, forecast),
        None => (steps.swap_remove(step), forecasts[step]),
    };
    Ok(NextTimes { times, share: SHARES[step], expected: forecast.wrong })
}

/// Returns the measured numbers with their layers.
fn places_of(job: &Job, measured: &PrintMeasurements) -> Result<Vec<Measurement>, LearnError> {
    match measured {
        PrintMeasurements::Areas(rows) => rows
            .iter()
            .map(|row| {
                let counts = [row.over, row.under];
                Ok(Measurement::Counts { layer: layer_of(job, row)?, counts })
            })
            .collect(),
        PrintMeasurements::Heights(rows) => rows
            .iter()
            .map(|row| {
                let (pixel, layer) = face_of(job, row)?;
                let um = 1000.0 * row.measured_mm;
                Ok(Measurement::Height { layer, pixel, um, sd_um: row.sd_um })
            })
            .collect(),
        PrintMeasurements::Places { places, table } => {
            let corner = job.origin_mm().ok_or(LearnError::NoPosition)?;
            let mut all = table.as_ref().map_or(Ok(Vec::new()), |table| places_of(job, table))?;
            for place in places.all() {
                let beside = |problem| LearnError::Place { name: place.name.clone(), problem };
                let pixels = PlacePixels::of(place, &job.part, corner).map_err(beside)?;
                let size = place.measured.map_or(0.0, PlaceSize::number);
                all.push(Measurement::Size { place: pixels, size, sd: sd_of_place(place, size) });
            }
            Ok(all)
        }
    }
}

/// Returns the pixel and the layer of a measured face.
fn face_of(job: &Job, row: &HeightRow) -> Result<([u32; 2], usize), LearnError> {
    let corner = job.origin_mm().ok_or(LearnError::NoPosition)?;
    let [width, height] = job.part.pitch().mm();
    let [x, y] = row.place_mm;
    let place = [(x - corner[0]) / width, (corner[1] - y) / height].map(f64::floor);
    let outside =
        place.iter().zip(job.part.size()).any(|(at, size)| !(0.0..f64::from(size)).contains(at));
    if outside {
        let HeightRow { line, z_mm, place_mm, .. } = *row;
        return Err(LearnError::Outside { line, z_mm, place_mm });
    }
    let pixel = place.map(|at| at as u32);
    let face = face_at(&job.part, pixel, Length::from_mm(row.z_mm));
    face.map(|layer| (pixel, layer)).map_err(|problem| of_face(row, problem))
}

fn of_face(row: &HeightRow, problem: FaceError) -> LearnError {
    LearnError::Face { line: row.line, z_mm: row.z_mm, problem }
}
