//! A print by bitmaps on a glass, and its height map.

use lamp_grayscale::resin::{Dose, Intensity};
use lamp_stack::Length;

use super::error::PrintSimError;
use super::truth::{TrueNumber, Truth};
use crate::column::NoHeights;
use crate::learn::{ColumnLight, Columns, GlassChange, HeightRow, PrintMeasurements};
use crate::light::LightError;
use crate::numeric::Random;
use crate::target::HeightMap;

/// Places are chosen by the seed alone, so that each print is measured at the same ones.
const PLACES: u64 = u64::MAX;

impl Truth {
    /// Returns how a machine differs from a projector and a material in a print, from 0.
    ///
    /// # Errors
    /// Returns an error if a number is impossible, or if the material does not state how deep a
    /// dose cures.
    pub fn on_glass(&self, of: &Columns, print: usize) -> Result<GlassChange, PrintSimError> {
        let (two, curve) = (&of.material.two_depth, &of.material.working_curve);
        let [depth, critical] = match (two, curve) {
            (Some(two), _) => [two.liquid_depth.value.um(), two.critical_dose.value.mj_per_cm2()],
            (None, Some(curve)) => {
                [curve.penetration_depth.value.um(), curve.critical_dose.value.mj_per_cm2()]
            }
            (None, None) => return Err(NoHeights::Curve(of.material.name.clone()).into()),
        };
        let spread = &of.projector.spread;
        let spread = spread.cone.as_ref().or(spread.sigma.as_ref());
        let spread = spread.map_or(0.0, |length| length.value.um());
        let light = of.projector.irradiance().mw_per_cm2();
        let drifted = self.drift.factor().powf(print as f64);
        let factor = |number, of: fn(&Self, f64) -> f64, name| {
            let factor = of(self, number) / number;
            let is_possible = factor > 0.0 && factor.is_finite();
            let wrong = PrintSimError::Truth(LightError::NotPositive(name));
            is_possible.then_some(factor).ok_or(wrong)
        };
        Ok(GlassChange {
            depth: factor(
                depth,
                |truth, um| truth.penetration_depth.of(Length::from_um(um)).um(),
                "the penetration depth",
            )?,
            critical_dose: factor(
                critical,
                |truth, mj| truth.critical_dose.of(Dose::from_mj_per_cm2(mj)).mj_per_cm2(),
                "the critical dose",
            )?,
            light: drifted
                * factor(
                    light,
                    |truth, mw| truth.light.of(Intensity::from_mw_per_cm2(mw)).mw_per_cm2(),
                    "the light",
                )?,
            spread: match self.spread {
                TrueNumber::Changed(change) => change.factor(),
                TrueNumber::Value(_) => factor(
                    spread,
                    |truth, um| truth.spread.of(Length::from_um(um)).um(),
                    "the spread of light",
                )?,
            },
        })
    }
}

/// The heights of cured columns, as they are and as they are measured.
#[derive(Clone, Debug)]
pub struct PrintedColumns {
    /// All columns, exactly.
    pub cured: HeightMap,
    /// The measurements.
    pub measured: PrintMeasurements,
}

impl PrintedColumns {
    /// Shows bitmaps where projector and resin are as `truth` has them, and measures the heights of
    /// `count` random columns, or of all. `sd` is the standard deviation of the measurements; a seed
    /// has the same places in every print.
    ///
    /// # Errors
    /// Returns an error if `sd` is not above zero, or if the material does not state how deep a
    /// dose cures.
    pub fn new(
        truth: &Columns,
        light: &ColumnLight,
        print: usize,
        count: Option<usize>,
        sd: Length,
        seed: u64,
    ) -> Result<Self, PrintSimError> {
        if !(sd.um() > 0.0 && sd.um().is_finite()) {
            return Err(PrintSimError::Deviation(sd));
        }
        let cured = truth.cured(light)?;
        let grid = cured.grid;
        let mut places: Vec<usize> = (0..grid.count()).collect();
        if let Some(count) = count.filter(|count| *count < places.len()) {
            let mut random = Random::sequence(seed, PLACES);
            // The first steps of Fisher and Yates's shuffle, as Durstenfeld has it (1964).
            for at in 0..count {
                let other = at + random.below((places.len() - at) as u64) as usize;
                places.swap(at, other);
            }
            places.truncate(count);
            places.sort_unstable();
        }
        let mut random = Random::sequence(seed, print as u64);
        // To the nanometer, as tables have lengths.
        let rounded_mm = |um: f64| (1000.0 * um).round() / 1e6;
        let row = |(number, at): (usize, &usize)| HeightRow {
            line: number + 2,
            place_mm: [
                rounded_mm(grid.x_um(at % grid.columns)),
                rounded_mm(grid.y_um(at / grid.columns)),
            ],
            z_mm: rounded_mm(truth.wanted.heights_um[*at]),
            measured_mm: rounded_mm(cured.heights_um[*at] + sd.um() * random.normal()),
            sd_um: sd.um(),
        };
        let rows = places.iter().enumerate().map(row).collect();
        Ok(Self { measured: PrintMeasurements::Heights(rows), cured })
    }
}
