//! Columns that doses cure on a glass, in a state of light and resin.

use lamp_grayscale::material::{Given, Material};
use lamp_grayscale::resin::{Intensity, Quantity};

use super::error::LearnError;
use super::glass::GlassModel;
use super::glass_state::{GlassNumber, GlassState};
use super::state::stated_sd;
use crate::MirrorSeconds;
use crate::column::{GlassLight, HeightCurve, NoHeights, Setup, Tracing};
use crate::projector::Projector;
use crate::target::{Grid, HeightMap};

/// A target on a glass, the projector and the resin.
#[derive(Clone, Debug)]
pub struct Columns {
    /// The projector.
    pub projector: Projector,
    /// The resin.
    pub material: Material,
    /// The wanted height of each column, with room for light around the target.
    pub wanted: HeightMap,
    /// How light is computed.
    pub tracing: Tracing,
}

/// The light of a print's bitmaps.
#[derive(Clone, Debug)]
pub struct ColumnLight {
    /// How long each mirror is on.
    pub shown: MirrorSeconds,
    /// The light of each of these mirrors as a share of a white one's. Empty: all are alike.
    pub flat_field: Vec<f64>,
}

/// How a machine and its resin differ from a projector and a material, as factors of their numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlassChange {
    /// Of the penetration depths, of liquid and solid alike.
    pub depth: f64,
    /// Of the critical dose.
    pub critical_dose: f64,
    /// Of the light.
    pub light: f64,
    /// Of the spread of light.
    pub spread: f64,
}

fn times<T: Quantity>(given: &mut Given<T>, factor: f64) {
    given.value = T::of(given.value.number() * factor);
    given.plus_minus = None;
}

impl Columns {
    /// Returns the same target where projector and material differ.
    #[must_use]
    pub fn changed(&self, change: &GlassChange) -> Self {
        let mut other = self.clone();
        let irradiance = self.projector.irradiance().mw_per_cm2() * change.light;
        other.projector.light = Some(Given {
            value: Intensity::from_mw_per_cm2(irradiance),
            plus_minus: None,
            source: "the state of light".to_owned(),
        });
        let spread = &mut other.projector.spread;
        for length in spread.cone.iter_mut().chain(&mut spread.sigma) {
            times(length, change.spread);
        }
        if let Some(two) = &mut other.material.two_depth {
            times(&mut two.critical_dose, change.critical_dose);
            times(&mut two.liquid_depth, change.depth);
            times(&mut two.solid_depth, change.depth);
        }
        if let Some(curve) = &mut other.material.working_curve {
            times(&mut curve.critical_dose, change.critical_dose);
            times(&mut curve.penetration_depth, change.depth);
        }
        other
    }

    /// Returns the heights that bitmaps cure.
    ///
    /// # Errors
    /// Returns an error if the material does not state how deep a dose cures.
    pub fn cured(&self, light: &ColumnLight) -> Result<HeightMap, NoHeights> {
        let curve = HeightCurve::of(&self.material)?;
        let (grid, mirrors) = (self.wanted.grid, light.shown.mirrors);
        let setup = Setup {
            mirrors,
            display: mirrors,
            flat_field: light.flat_field.clone(),
            ..Setup::of(&self.projector, &grid, self.tracing)
        };
        let doses = GlassLight::new(setup).doses(&light.shown.seconds);
        let heights_um = doses.iter().map(|&dose| curve.height_um(dose)).collect();
        Ok(HeightMap { grid, heights_um })
    }

    /// Returns the column that holds a place, in millimeters from the axis.
    pub fn column_at(&self, [x_mm, y_mm]: [f64; 2]) -> Option<usize> {
        let grid = self.wanted.grid;
        let (columns, rows) = (grid.columns as f64, grid.rows as f64);
        let column = (1000.0 * x_mm / grid.pitch_um + columns / 2.0 + 1e-9).floor();
        let row = (rows / 2.0 - 1000.0 * y_mm / grid.pitch_um + 1e-9).floor();
        let is_inside = (0.0..columns).contains(&column) && (0.0..rows).contains(&row);
        is_inside.then(|| row as usize * grid.columns + column as usize)
    }
}

impl GlassModel for Columns {
    type Light = ColumnLight;

    const CHANGE: f64 = 1e-3;

    fn prior(&self) -> GlassState {
        let (two, curve) = (&self.material.two_depth, &self.material.working_curve);
        let (depth, critical) = match (two, curve) {
            (Some(two), _) => (stated_sd(&two.liquid_depth), stated_sd(&two.critical_dose)),
            (None, Some(curve)) => {
                (stated_sd(&curve.penetration_depth), stated_sd(&curve.critical_dose))
            }
            (None, None) => (None, None),
        };
        let light = self.projector.light.as_ref().and_then(stated_sd);
        // Light and critical dose count only as their ratio.
        let light = light.unwrap_or(GlassNumber::Light.unstated_sd());
        let dose = critical.unwrap_or(GlassNumber::Light.unstated_sd()).hypot(light);
        let spread = self.projector.spread.cone.as_ref().or(self.projector.spread.sigma.as_ref());
        let stated = [
            (GlassNumber::PenetrationDepth, depth),
            (GlassNumber::Dose, Some(dose)),
            (GlassNumber::Spread, spread.and_then(stated_sd)),
        ];
        GlassState::of_sds(&stated.map(|(number, sd)| (number, sd.unwrap_or(number.unstated_sd()))))
    }

    fn shifted(&self, logs: &[f64]) -> Self {
        let [depth, light, spread] = [logs[0], logs[1], logs[2]].map(f64::exp);
        self.changed(&GlassChange { depth, critical_dose: 1.0, light, spread })
    }

    fn grid(&self) -> Grid {
        self.wanted.grid
    }

    fn wanted_um(&self, place_mm: [f64; 2]) -> Option<f64> {
        self.column_at(place_mm).map(|column| self.wanted.heights_um[column])
    }

    fn cured_um(
        &self,
        light: &ColumnLight,
        places_mm: &[[f64; 2]],
    ) -> Result<Vec<f64>, LearnError> {
        let cured = self.cured(light)?;
        let height = |place: &[f64; 2]| {
            // Places were checked to be on the columns.
            self.column_at(*place).map_or(0.0, |column| cured.heights_um[column])
        };
        Ok(places_mm.iter().map(height).collect())
    }

    fn rms_um(&self, light: &ColumnLight) -> Result<f64, LearnError> {
        let off = self.cured(light)?.less(&self.wanted);
        let squares: f64 = off.iter().map(|off| off * off).sum();
        Ok((squares / off.len() as f64).sqrt())
    }
}
