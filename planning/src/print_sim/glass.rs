//! A print by bitmaps on a glass, and its measured heights.

use lamp_grayscale::resin::{Concentration, Dose, Intensity, Quantity};
use lamp_stack::Length;

use super::error::PrintSimError;
use super::truth::{TrueNumber, Truth};
use crate::column::NoHeights;
use crate::learn::{
    Columns, GlassChange, GlassModel, HeightRow, PrintMeasurements, RingChange, Rings,
};
use crate::light::LightError;
use crate::numeric::Random;

/// Places are chosen by the seed alone, so that each print is measured at the same ones.
const PLACES: u64 = u64::MAX;

impl Truth {
    /// Returns how a machine differs from a projector and a material in a print of columns, from 0.
    ///
    /// # Errors
    /// Returns an error if a number is impossible or not of columns, or if the material does not
    /// state how deep a dose cures.
    pub fn on_columns(&self, of: &Columns, print: usize) -> Result<GlassChange, PrintSimError> {
        self.check_doses()?;
        self.check_no_layer()?;
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
        Ok(GlassChange {
            depth: factor::<Length>(self.penetration_depth, depth, "the penetration depth")?,
            critical_dose: factor::<Dose>(self.critical_dose, critical, "the critical dose")?,
            light: self.light_factor(of.projector.irradiance(), print)?,
            spread: factor::<Length>(self.spread, spread, "the spread of light")?,
        })
    }

    /// Returns how a machine differs from a projector and a material in a print of rings, from 0.
    ///
    /// # Errors
    /// Returns an error if a number is impossible, or not of kinetics.
    pub fn on_rings(&self, of: &Rings, print: usize) -> Result<RingChange, PrintSimError> {
        self.check_kinetics()?;
        self.check_no_layer()?;
        if self.flat_field.is_some() {
            return Err(PrintSimError::OtherModel("flat-field"));
        }
        let (setting, kinetics) = (&of.setting, &of.setting.kinetics);
        // Light fades by e over the inverse of its fading in fresh resin.
        let depth_um = 1.0 / (kinetics.fading() * kinetics.photoinitiator.number());
        let oxygen = kinetics.oxygen.number();
        Ok(RingChange {
            depth: factor::<Length>(self.penetration_depth, depth_um, "the penetration depth")?,
            light: self.light_factor(setting.light, print)?,
            oxygen: match self.oxygen.of(Concentration::of(oxygen)).number() {
                // Degassed resin has none.
                0.0 => 0.0,
                _ => factor::<Concentration>(self.oxygen, oxygen, "the oxygen")?,
            },
            critical_conversion: self.critical_conversion.factor(),
            spread: factor::<Length>(self.spread, setting.sigma_um, "the spread of light")?,
        })
    }

    /// Refuses the picture of a layer: bitmaps on a glass differ from one to the next.
    fn check_no_layer(&self) -> Result<(), PrintSimError> {
        match self.layer_picture {
            Some(_) => Err(PrintSimError::OtherModel("layer-picture")),
            None => Ok(()),
        }
    }

    fn light_factor(&self, light: Intensity, print: usize) -> Result<f64, PrintSimError> {
        let drifted = self.drift.factor().powf(print as f64);
        Ok(drifted * factor::<Intensity>(self.light, light.mw_per_cm2(), "the light")?)
    }
}

/// Returns the factor by which a true number differs from a model's.
fn factor<T: Quantity>(
    truth: TrueNumber<T>,
    of: f64,
    name: &'static str,
) -> Result<f64, PrintSimError> {
    let factor = match truth {
        TrueNumber::Changed(change) => change.factor(),
        TrueNumber::Value(value) => value.number() / of,
    };
    let is_possible = factor > 0.0 && factor.is_finite();
    is_possible.then_some(factor).ok_or(PrintSimError::Truth(LightError::NotPositive(name)))
}

/// The measured heights of a print on a glass.
#[derive(Clone, Debug)]
pub struct GlassPrint {
    /// The measurements.
    pub measured: PrintMeasurements,
    /// The number of measured places.
    pub places: usize,
}

impl GlassPrint {
    /// Shows bitmaps where projector and resin are as `truth` has them, and measures the heights of
    /// `count` random columns of its grid, or of all. `sd` is the standard deviation of the
    /// measurements; a seed has the same places in every print.
    ///
    /// # Errors
    /// Returns an error if `sd` is not above zero, or if the light cannot be computed.
    pub fn new<M: GlassModel>(
        truth: &M,
        light: &M::Light,
        print: usize,
        count: Option<usize>,
        sd: Length,
        seed: u64,
    ) -> Result<Self, PrintSimError> {
        if !(sd.um() > 0.0 && sd.um().is_finite()) {
            return Err(PrintSimError::Deviation(sd));
        }
        let grid = truth.grid();
        let mut columns: Vec<usize> = (0..grid.count()).collect();
        if let Some(count) = count.filter(|count| *count < columns.len()) {
            let mut random = Random::sequence(seed, PLACES);
            // The first steps of Fisher and Yates's shuffle, as Durstenfeld has it (1964).
            for at in 0..count {
                let other = at + random.below((columns.len() - at) as u64) as usize;
                columns.swap(at, other);
            }
            columns.truncate(count);
            columns.sort_unstable();
        }
        // To the nanometer, as tables have lengths.
        let rounded_mm = |um: f64| (1000.0 * um).round() / 1e6;
        let place = |at: &usize| {
            [grid.x_um(at % grid.columns), grid.y_um(at / grid.columns)].map(rounded_mm)
        };
        let places_mm: Vec<_> = columns.iter().map(place).collect();
        let cured_um = truth.cured_um(light, &places_mm)?;
        let mut random = Random::sequence(seed, print as u64);
        let row = |(number, (place_mm, um)): (usize, (&[f64; 2], &f64))| HeightRow {
            line: number + 2,
            place_mm: *place_mm,
            z_mm: rounded_mm(truth.wanted_um(*place_mm).unwrap_or(0.0)),
            measured_mm: rounded_mm(um + sd.um() * random.normal()),
            sd_um: sd.um(),
        };
        let rows: Vec<_> = places_mm.iter().zip(&cured_um).enumerate().map(row).collect();
        Ok(Self { places: rows.len(), measured: PrintMeasurements::Heights(rows) })
    }
}
