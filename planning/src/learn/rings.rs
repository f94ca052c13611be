//! Round parts that cure on a glass by the kinetics of resin and oxygen, in a state of both (003).

use lamp_grayscale::material::{KineticNumbers, Material};
use lamp_grayscale::resin::{Absorptivity, Concentration, Intensity, Quantity};

use super::error::LearnError;
use super::glass::GlassModel;
use super::glass_state::{GlassNumber, GlassState};
use super::state::{sd_of, stated_sd};
use crate::ecpl::{
    KineticSetting, Profile, RingExposure, RingPlanError, RingSimulation, WantedProfile,
};
use crate::projector::Projector;
use crate::target::{Grid, Round};

/// The least width of the columns around a part, in micrometers; for large parts they are wider.
const FINEST_UM: f64 = 2.0;
const MOST_ROWS: f64 = 1000.0;
/// The highest conversion that a critical one is moved to.
const MOST_CONVERSION: f64 = 0.99;

/// A round target on a glass, and the kinetics that cure it.
#[derive(Clone, Debug)]
pub struct Rings {
    /// The light, the chamber and the rates of the resin.
    pub setting: KineticSetting,
    /// The wanted height over the distance from the axis.
    pub round: Round,
    /// Columns that hold the target, and the light next to it.
    grid: Grid,
    prior: GlassState,
}

/// How a machine and its resin differ from a projector and a material, as factors of their numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RingChange {
    /// Of the depth over which light fades by e in fresh resin, at the same rate of splitting.
    pub depth: f64,
    /// Of the light.
    pub light: f64,
    /// Of the dissolved oxygen.
    pub oxygen: f64,
    /// Of the critical conversion, which stays below 1.
    pub critical_conversion: f64,
    /// Of the standard deviation of the light's blur.
    pub spread: f64,
}

impl Rings {
    /// Takes the setting of a projector and a material, which state how exact their numbers are.
    pub fn new(
        setting: KineticSetting,
        projector: &Projector,
        material: &Material,
        round: Round,
    ) -> Self {
        let numbers = material.kinetics.as_ref();
        let of_numbers = |sd: fn(&KineticNumbers) -> Option<f64>| numbers.and_then(sd);
        let absorbed = [
            of_numbers(|numbers| stated_sd(&numbers.absorptivity)),
            of_numbers(|numbers| stated_sd(&numbers.photoinitiator)),
        ];
        let depth = match absorbed {
            [None, None] => None,
            [one, other] => Some(one.unwrap_or(0.0).hypot(other.unwrap_or(0.0))),
        };
        let conversion = of_numbers(|numbers| {
            let number = &numbers.critical_conversion;
            Some(sd_of(number.plus_minus?, number.value))
        });
        let sds = [
            (GlassNumber::PenetrationDepth, depth),
            (GlassNumber::Light, projector.light.as_ref().and_then(stated_sd)),
            (GlassNumber::Oxygen, of_numbers(|numbers| stated_sd(&numbers.oxygen))),
            (GlassNumber::CriticalConversion, conversion),
            (GlassNumber::Spread, projector.spread.sigma.as_ref().and_then(stated_sd)),
        ];
        let sds = sds.map(|(number, sd)| (number, sd.unwrap_or(number.unstated_sd())));
        // Two deviations outside, a wide field's light is 2 % of full.
        let reach_um = round.radius_um() + 2.0 * setting.sigma_um + 10.0;
        let pitch_um = (2.0 * reach_um / MOST_ROWS).max(FINEST_UM);
        // An odd number puts a column on the axis.
        let columns = 2 * (reach_um / pitch_um).ceil() as usize + 1;
        let grid = Grid { columns, rows: columns, pitch_um };
        Self { setting, round, grid, prior: GlassState::of_sds(&sds) }
    }

    /// Returns the same target where projector and material differ.
    #[must_use]
    pub fn changed(&self, change: &RingChange) -> Self {
        let mut other = self.clone();
        let setting = &mut other.setting;
        setting.light = Intensity::from_mw_per_cm2(setting.light.mw_per_cm2() * change.light);
        setting.sigma_um *= change.spread;
        let kinetics = &mut setting.kinetics;
        // 003 eq. 4: light fades by the absorptivity, and splits by its product with the quantum
        // efficiency.
        kinetics.absorptivity = Absorptivity::of(kinetics.absorptivity.number() / change.depth);
        kinetics.quantum_efficiency *= change.depth;
        kinetics.oxygen = Concentration::of(kinetics.oxygen.number() * change.oxygen);
        let conversion = kinetics.critical_conversion * change.critical_conversion;
        kinetics.critical_conversion = conversion.min(MOST_CONVERSION);
        other
    }

    /// Checks that a display can show bitmaps in the chamber.
    ///
    /// # Errors
    /// Returns an error if it cannot, or if the chamber is too large.
    pub fn check(&self, light: &[RingExposure]) -> Result<(), RingPlanError> {
        self.simulation(light).map(|_| ())
    }

    /// Returns the profile that bitmaps cure.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn cured(&self, light: &[RingExposure]) -> Result<Profile, RingPlanError> {
        Ok(self.simulation(light)?.cure(light))
    }

    fn simulation(&self, light: &[RingExposure]) -> Result<RingSimulation, RingPlanError> {
        RingSimulation::of_plan(self.setting, light, self.round.radius_um())
    }
}

impl GlassModel for Rings {
    type Light = Vec<RingExposure>;

    // Over shorter changes, the first cell of a column that cures would be a step.
    const CHANGE: f64 = 1e-2;

    fn prior(&self) -> GlassState {
        self.prior.clone()
    }

    fn shifted(&self, logs: &[f64]) -> Self {
        let [depth, light, oxygen, critical_conversion, spread] =
            [logs[0], logs[1], logs[2], logs[3], logs[4]].map(f64::exp);
        self.changed(&RingChange { depth, light, oxygen, critical_conversion, spread })
    }

    fn grid(&self) -> Grid {
        self.grid
    }

    fn wanted_um(&self, [x_mm, y_mm]: [f64; 2]) -> Option<f64> {
        let grid = self.grid;
        let half_mm = grid.columns as f64 * grid.pitch_um / 2000.0;
        let is_inside = x_mm.abs() <= half_mm && y_mm.abs() <= half_mm;
        is_inside.then(|| self.round.height_um(1000.0 * x_mm.hypot(y_mm)))
    }

    fn cured_um(
        &self,
        light: &Vec<RingExposure>,
        places_mm: &[[f64; 2]],
    ) -> Result<Vec<f64>, LearnError> {
        let cured = self.cured(light)?;
        let height = |[x_mm, y_mm]: &[f64; 2]| cured.height_um(1000.0 * x_mm.hypot(*y_mm));
        Ok(places_mm.iter().map(height).collect())
    }

    fn rms_um(&self, light: &Vec<RingExposure>) -> Result<f64, LearnError> {
        let cured = self.cured(light)?;
        let wanted = WantedProfile::new(&cured.cells, |radius_um| self.round.height_um(radius_um));
        Ok(wanted.rms_um(&cured))
    }
}
