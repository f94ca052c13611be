//! Turns measurements into the times of the next print.

use lamp_stack::Length;

use super::convergence::{Convergence, convergence, largest_safe_gain};
use super::error::LearnError;
use super::heights::{FaceError, LogDoses, face_at, heights_of};
use super::job::Job;
use super::law::Law;
use super::measured::{AreaRow, HeightRow, PrintMeasurements};
use super::response::Response;
use crate::speed::{Simulation, SpeedOptions, plan_corrected};

/// The gap of a corrected plan, as a share of the unplanned error.
const GAP: f64 = 0.001;
/// The penetration depths, as shares of the model's, for which the decay of errors is reported.
const DEPTHS: [f64; 3] = [1.0, 0.7, 1.3];

/// The next print, and its properties.
#[derive(Clone, Debug)]
pub struct Learned {
    /// The times in seconds, from the light on.
    pub times: Vec<f64>,
    /// The corrections of doses from heights, from the light on.
    pub log_doses: Vec<f64>,
    /// The decay of errors with each print, for each penetration depth.
    pub shrink: Vec<(f64, Convergence)>,
    /// The largest gain with which no print's errors grow, if the law has a gain.
    pub safe_gain: Option<f64>,
    /// The distances by which measured heights are below the model's heights, in micrometers.
    pub deeper_um: Vec<f64>,
}

/// Learns from the measurements of a print of a job. `law` turns wrong pixels into times. `step` is
/// the share of the measured correction that is applied to the doses.
///
/// # Errors
/// Returns an error if the stack lacks a measured layer or face, or if the model cannot plan
/// the part.
pub fn learn(
    job: &Job,
    print: usize,
    measured: &PrintMeasurements,
    law: &Law,
    step: f64,
    memory: u64,
) -> Result<Learned, LearnError> {
    match measured {
        PrintMeasurements::Areas(rows) => from_areas(job, print, rows, law, memory),
        PrintMeasurements::Heights(rows) => from_heights(job, print, rows, step, memory),
    }
}

/// Returns the errors of each layer from the light on; the errors of layers that are not listed are
/// zero.
fn errors_by_layer(job: &Job, rows: &[AreaRow]) -> Result<Vec<f64>, LearnError> {
    let layers = job.part.layers();
    let mut errors = vec![0.0; layers.len()];
    for row in rows {
        let at = layers.iter().position(|layer| layer.index == row.layer).ok_or_else(|| {
            let [first, last] = [layers.last(), layers.first()].map(|of| of.map_or(0, |l| l.index));
            LearnError::NoLayer { line: row.line, layer: row.layer, first, last }
        })?;
        errors[at] = row.under - row.over;
    }
    Ok(errors)
}

fn from_areas(
    job: &Job,
    print: usize,
    rows: &[AreaRow],
    law: &Law,
    memory: u64,
) -> Result<Learned, LearnError> {
    let errors = errors_by_layer(job, rows)?;
    let now = &job.prints[print];
    let simulation = Simulation::corrected(&job.part, &job.light, &now.log_doses, memory)?;
    let response = Response::of(&simulation, &now.times);
    let [low, high] = job.platform().bounds(job.part.layers())?;
    let times = law.next(&now.times, &errors, &response, [&low, &high]);
    let times = job.platform().nearest(job.part.layers(), &times)?;
    let mut shrink = Vec::new();
    for share in DEPTHS {
        let real = response.at_depth(&job.part, &job.light, share)?;
        shrink.push((share, convergence(law, &now.times, &errors, [&response, &real])));
    }
    let gain = match law {
        Law::Single { gain } => Some(*gain),
        Law::Multi(law) => Some(law.gain),
        Law::Model(_) => None,
    };
    let safe = |gain| gain * largest_safe_gain(law, &now.times, &errors, &response);
    Ok(Learned {
        times,
        log_doses: now.log_doses.clone(),
        shrink,
        safe_gain: gain.map(safe),
        deeper_um: Vec::new(),
    })
}

fn from_heights(
    job: &Job,
    print: usize,
    rows: &[HeightRow],
    step: f64,
    memory: u64,
) -> Result<Learned, LearnError> {
    let now = &job.prints[print];
    let faces = rows.iter().map(|row| face_of(job, row)).collect::<Result<Vec<_>, _>>()?;
    let simulation = Simulation::corrected(&job.part, &job.light, &now.log_doses, memory)?;
    let mut deeper = Vec::new();
    for (row, face) in rows.iter().zip(&faces) {
        let expected = heights_of(&job.part, &simulation, &job.light, &now.times, &[*face]);
        let expected = expected.map_err(|problem| of_face(row, problem))?;
        deeper.push((face.1, expected[0].um() - 1000.0 * row.measured_mm, row.sd_um));
    }
    let mut log_doses = LogDoses::known(&job.part, now.log_doses.clone());
    log_doses.step(&deeper, &job.light, step);
    let options = SpeedOptions {
        light: job.light,
        platform: job.platform(),
        margin: job.margin(),
        gap: GAP,
        memory,
    };
    let plan = plan_corrected(&job.part, &options, log_doses.values())?;
    let left = |share: f64| {
        let left = (1.0 - step * share).abs();
        (share, Convergence { radius: left, norm: left })
    };
    Ok(Learned {
        times: plan.times.iter().map(|time| time.ms() / 1000.0).collect(),
        log_doses: log_doses.values().to_vec(),
        shrink: DEPTHS.map(left).to_vec(),
        safe_gain: None,
        deeper_um: deeper.iter().map(|deeper| deeper.1).collect(),
    })
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
