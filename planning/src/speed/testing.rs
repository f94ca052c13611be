//! Shared parts of the tests of times.

use lamp_fixtures::Voxels;
use lamp_grayscale::resin::{Dose, Intensity};
use lamp_stack::Length;

use super::part::{PartPages, TimedPart};
use super::{Platform, SpeedOptions};
use crate::light::{IntensityOf, Light, SampleHeight};

/// The resin of 004 with a Gaussian of this standard deviation.
pub(crate) fn pegda(spread_um: f64) -> Light {
    Light {
        intensity: Intensity::from_mw_per_cm2(7.394),
        intensity_of: IntensityOf::Field,
        critical_dose: Dose::from_mj_per_cm2(7.266),
        penetration_depth: Length::from_um(185.0 / -f64::ln(0.81)),
        spread: [Length::from_um(spread_um); 2],
        gamma: 1.0,
        at: SampleHeight::Top,
    }
}

pub(crate) fn part(voxels: &Voxels) -> TimedPart {
    let mut pages = PartPages::new(128);
    voxels.layers().for_each(|layer| pages.push(layer).unwrap());
    pages.finish().unwrap()
}

pub(crate) fn options(light: Light, max_change: Option<f64>) -> SpeedOptions {
    SpeedOptions {
        light,
        platform: Platform { slowest: 5.0, fastest: 2000.0, max_change },
        margin: 0.05,
        gap: 0.01,
        memory: 1 << 30,
    }
}
