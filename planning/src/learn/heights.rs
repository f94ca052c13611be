//! Learns from the measured heights of down-facing faces.
//!
//! Light that passes a face cures below it, down to the depth where its dose is the critical one. A
//! dose larger by a factor reaches deeper by the factor's logarithm times the penetration depth. So
//! heights give the logarithm of the ratio between the doses and the model's. A step ω of the
//! correction leaves 1 - ω D_true / D_model of the errors.

use lamp_stack::Length;
use thiserror::Error;

use crate::light::{Light, SampleHeight};
use crate::numeric::solve_positive;
use crate::speed::{Simulation, TimedPart};

/// A measured height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Height {
    /// The column and row of the pixel where it was measured.
    pub pixel: [u32; 2],
    /// The height that the part has there.
    pub z: Length,
    /// The height that was measured.
    pub measured: Length,
    /// The standard deviation of the measurement.
    pub sd: Length,
}

/// Why a height gives no information.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum FaceError {
    /// The part has no down-facing face at the place.
    #[error("the part has no face there that looks down")]
    NoFace,
    /// By the model, nothing is cured above the face.
    #[error("according to the model, nothing above that face is cured")]
    NothingCured,
}

/// Returns the layer, counted from the light, whose bottom is a down-facing face of the part.
///
/// # Errors
/// Returns an error if no such face is within half a layer.
pub fn face_at(part: &TimedPart, pixel: [u32; 2], z: Length) -> Result<usize, FaceError> {
    let is_face = |layer: &usize| {
        let below = layer + 1;
        let ends = below == part.layers().len() || !part.is_wanted(below, pixel);
        part.is_wanted(*layer, pixel) && ends
    };
    let away = |layer: usize| {
        let layer = &part.layers()[layer];
        (layer.z.um() - z.um()).abs() / layer.thickness.um()
    };
    let faces = (0..part.layers().len()).filter(is_face);
    let nearest = faces.min_by(|&a, &b| away(a).total_cmp(&away(b)));
    nearest.filter(|&layer| away(layer) <= 0.5).ok_or(FaceError::NoFace)
}

/// Returns the heights down to which the resin is cured at down-facing faces, each given by its
/// pixel and the layer above it. Times are in seconds, from the light on.
///
/// # Errors
/// Returns an error if nothing is cured above a face.
pub fn heights_of(
    part: &TimedPart,
    simulation: &Simulation<'_>,
    light: &Light,
    times: &[f64],
    faces: &[([u32; 2], usize)],
) -> Result<Vec<Length>, FaceError> {
    let height = |&(pixel, layer): &([u32; 2], usize)| {
        let doses = simulation.doses_at(pixel, times);
        let down = doses[layer..].iter().take_while(|&&dose| dose >= 1.0).count();
        let last = match down {
            0 => doses[..layer].iter().rposition(|&dose| dose >= 1.0),
            cured => Some(layer + cured - 1),
        };
        let last = last.ok_or(FaceError::NothingCured)?;
        let of_last = &part.layers()[last];
        let above = match light.at {
            SampleHeight::Top => 1.0,
            SampleHeight::Middle => 0.5,
            SampleHeight::Bottom => 0.0,
        };
        let told_um = of_last.z.um() + above * of_last.thickness.um();
        Ok(Length::from_um(told_um - light.penetration_depth.um() * doses[last].ln()))
    };
    faces.iter().map(height).collect()
}

/// The correction that measurements add to the logarithm of each layer's dose: smooth over the
/// height.
#[derive(Clone, Debug, PartialEq)]
pub struct LogDoses {
    z_um: Vec<f64>,
    values: Vec<f64>,
}

/// The standard deviation of doses before any measurement, as a logarithm: the uncertainty of light
/// and resin about their material's numbers.
const UNSURE: f64 = 0.5;
/// The correlation length of dose errors, as a share of the part's height.
const ALIKE_OVER: f64 = 0.25;

impl LogDoses {
    /// Begins with the model's doses.
    pub fn none(part: &TimedPart) -> Self {
        let z_um: Vec<_> = part.layers().iter().map(|layer| layer.z.um()).collect();
        Self { values: vec![0.0; z_um.len()], z_um }
    }

    /// Continues with known corrections, from the light on.
    ///
    /// # Panics
    /// Panics if the number of corrections is not the number of layers.
    pub fn known(part: &TimedPart, values: Vec<f64>) -> Self {
        assert_eq!(values.len(), part.layers().len(), "each layer has a correction");
        Self { values, ..Self::none(part) }
    }

    /// Returns the corrections, from the light on.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Takes a Kalman step: a share `step` of the way to the measured values. Each of `deeper` has
    /// the layer of a face, the distance by which the resin is cured deeper there than in the
    /// model, and the standard deviation of that distance, both in micrometers.
    pub fn step(&mut self, deeper: &[(usize, f64, f64)], light: &Light, step: f64) {
        let depth_um = light.penetration_depth.um();
        // Measurements of one layer are combined into one, as exact as all of them together.
        let mut layers: Vec<(usize, f64, f64)> = Vec::new();
        let mut sorted = deeper.to_vec();
        sorted.sort_by_key(|measured| measured.0);
        for same in sorted.chunk_by(|a, b| a.0 == b.0) {
            // Measurements of one layer are weighted by their precision, 1 / sd².
            let precision: f64 = same.iter().map(|(_, _, sd)| sd.powi(-2)).sum();
            let mean = same.iter().map(|(_, um, sd)| um * sd.powi(-2)).sum::<f64>() / precision;
            layers.push((same[0].0, mean / depth_um, precision.recip() / (depth_um * depth_um)));
        }
        let size = layers.len();
        let mut covariance = vec![0.0; size * size];
        for (row, a) in layers.iter().enumerate() {
            for (column, b) in layers.iter().enumerate() {
                // The noise of different layers is independent.
                let noise = if row == column { a.2 } else { 0.0 };
                covariance[row * size + column] = self.covariance(a.0, b.0) + noise;
            }
        }
        // Regression by a Gaussian process (Rasmussen and Williams 2006, eq. 2.25): the mean is
        // k(·, x) (K + noise)⁻¹ y.
        let weights = solve_positive(&mut covariance, layers.iter().map(|layer| layer.1).collect());
        let gained: Vec<f64> = (0..self.values.len())
            .map(|k| layers.iter().zip(&weights).map(|(a, w)| self.covariance(k, a.0) * w).sum())
            .collect();
        self.values.iter_mut().zip(gained).for_each(|(value, gained)| *value += step * gained);
    }

    /// The covariance of two layers' deviations from the model: a Matérn covariance of once
    /// differentiable functions.
    fn covariance(&self, a: usize, b: usize) -> f64 {
        let ends = self.z_um[0] - self.z_um[self.z_um.len() - 1];
        let range = (ALIKE_OVER * ends).max(f64::MIN_POSITIVE);
        // Matérn with ν = 3/2 (Rasmussen and Williams 2006, eq. 4.17): (1 + √3 r/l) exp(-√3 r/l).
        let away = 3.0_f64.sqrt() * (self.z_um[a] - self.z_um[b]).abs() / range;
        UNSURE * UNSURE * (1.0 + away) * (-away).exp()
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::cavity_staircase;

    use super::*;
    use crate::speed::testing::{part, pegda};

    #[test]
    fn a_face_is_cured_down_to_the_critical_dose() {
        let (part, light) = (part(&cavity_staircase(1)), pegda(0.0));
        let simulation = Simulation::new(&part, &light, 1 << 30).unwrap();
        // One flash of the topmost layer: it reaches D_p ln(E / E_c) below the top.
        let mut times = vec![0.0; 60];
        times[0] = 100.0 * 7.266 / 7.394;
        let top = 60.0 * 100.0;
        let face = ([40, 7], face_at(&part, [40, 7], Length::from_um(4500.0)).unwrap());
        assert_eq!(face.1, 14);
        let [height] = heights_of(&part, &simulation, &light, &times, &[face]).unwrap()[..] else {
            panic!("there is one height")
        };
        let expected = top - light.penetration_depth.um() * 100.0_f64.ln();
        assert!((height.um() - expected).abs() < 0.01, "{height} {expected}");
        times[0] = 0.1;
        let nothing = heights_of(&part, &simulation, &light, &times, &[face]);
        assert_eq!(nothing, Err(FaceError::NothingCured));
        for (pixel, z_um) in [([40, 7], 4400.0), ([2, 7], 4500.0), ([99, 7], 4500.0)] {
            let face = face_at(&part, pixel, Length::from_um(z_um));
            assert_eq!(face, Err(FaceError::NoFace), "{pixel:?}");
        }
    }

    #[test]
    fn a_step_goes_its_share_of_the_way_and_smoothly() {
        let part = part(&cavity_staircase(1));
        let mut learned = LogDoses::none(&part);
        let light = pegda(50.0);
        let deeper = |layer| (layer, 0.2 * light.penetration_depth.um(), 5.0);
        learned.step(&[deeper(10), deeper(10), deeper(40)], &light, 0.5);
        let values = learned.values();
        assert!((values[10] - 0.1).abs() < 1e-3 && (values[40] - 0.1).abs() < 1e-3);
        assert!(values.windows(2).all(|pair| (pair[0] - pair[1]).abs() < 0.01));
        assert!(values[25] > 0.02 && values[25] < 0.1);
    }
}
