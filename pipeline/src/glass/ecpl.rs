//! The settings of plans by kinetics, and the plan that they ask for.

use std::path::PathBuf;

use lamp_grayscale::material::Material;
use lamp_grayscale::resin::Intensity;
use lamp_planning::ShownBitmap;
use lamp_planning::ecpl::{
    KineticSetting, Method, Profile, RingExposure, RingPlan, RingPlanError, RingSimulation,
    WantedProfile, plan,
};
use lamp_planning::learn::{GlassModel, GlassState, Rings};
use lamp_planning::projector::Projector;
use lamp_planning::target::{Grid, Round};
use lamp_stack::{Image, quoted};
use serde::{Deserialize, Serialize};

use super::job::{GlassJob, GlassKind, GlassSettings, PlanInputs};
use super::kinetics_report::{CuredRings, RingsReport};
use super::target::{GivenTarget, TargetSettings, of_work};
use super::{GlassPlan, json_of};
use crate::documents::document;
use crate::error::Error;
use crate::watcher::Watcher;
use crate::words::{path, text};

/// The shares of a state's light that the next print is planned for. The search among whole steps of
/// the display ends in one of many minima, whose errors differ by more than the state's: the best of
/// a few plans is better than one.
const LIGHTS: [f64; 5] = [1.0, 0.985, 1.015, 0.97, 1.03];

/// A round target, a projector and a resin, and how to plan the bitmaps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct EcplSettings {
    /// The part to cure, round about the axis.
    #[serde(flatten)]
    pub target: TargetSettings,
    /// A built-in projector's name or a file; it states the chamber's height.
    #[serde(with = "path")]
    pub projector: PathBuf,
    /// A built-in material's name or a file; it has the rates of the reaction.
    #[serde(with = "path")]
    pub material: PathBuf,
    /// How bitmaps and times are found.
    #[serde(with = "text")]
    pub method: Method,
}

/// A plan by kinetics, and what it was for.
#[derive(Clone, Debug)]
pub struct RingCure {
    /// The target's name.
    pub target: String,
    /// The target's heights over the distance from the axis.
    pub round: Round,
    /// The projector.
    pub projector: Projector,
    /// The material's name.
    pub material: String,
    /// The command, as the bitmaps record it.
    pub command: String,
    /// How bitmaps and times were found.
    pub method: Method,
    /// The bitmaps, and the profile that they cure.
    pub plan: RingPlan,
    /// Files from which the plan can be made again, if the target's can be kept.
    pub inputs: Option<PlanInputs<EcplSettings>>,
}

/// Plan of rings by kinetics, by `lamp plan ecpl`.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct EcplReport<'a> {
    schema: &'static str,
    /// Name of the target.
    target: &'a str,
    /// Name of the projector.
    projector: &'a str,
    /// Name of the material.
    material: &'a str,
    /// How bitmaps and times were found, by `--method`.
    method: String,
    #[serde(flatten)]
    rings: RingsReport,
}

impl EcplSettings {
    /// Plans the bitmaps. `watcher` takes notes about the target's file.
    ///
    /// # Errors
    /// Returns an error if the target, projector or resin cannot be read, lacks what kinetics need,
    /// or if there is no plan.
    pub fn plan(&self, watcher: &dyn Watcher) -> Result<RingCure, Error> {
        let projector: Projector = document(&self.projector)?;
        let material: Material = document(&self.material)?;
        let setting = kinetic_setting(&projector, &material)?;
        let target = self.target.open(&projector, watcher)?;
        self.plan_for(setting, projector, material.name, &target, watcher)
    }

    /// Plans the bitmaps for the light and the kinetics of a setting.
    fn plan_for(
        &self,
        setting: KineticSetting,
        projector: Projector,
        material: String,
        target: &GivenTarget,
        watcher: &dyn Watcher,
    ) -> Result<RingCure, Error> {
        let round = target.profile()?;
        let height_um = |radius_um| round.height_um(radius_um);
        let is_stopped = || watcher.is_stopped();
        let plan = plan(setting, round.radius_um(), height_um, self.method, is_stopped)
            .map_err(|error| of_work(error).at(self.target.given()))?;
        Ok(RingCure {
            target: target.name().to_owned(),
            command: self.command(target.name(), &projector.name, &material),
            inputs: self.inputs()?,
            round,
            projector,
            material,
            method: self.method,
            plan,
        })
    }

    /// The command, as the bitmaps record it.
    fn command(&self, target: &str, projector: &str, material: &str) -> String {
        format!(
            "lamp plan ecpl {} --projector {} --material {} --method {}",
            quoted(target),
            quoted(projector),
            quoted(material),
            self.method
        )
    }

    /// Returns the files from which the plan can be made again, if the target's can be kept.
    fn inputs(&self) -> Result<Option<PlanInputs<Self>>, Error> {
        let Some((name, bytes)) = self.target.kept()? else { return Ok(None) };
        let mut settings = self.clone();
        settings.target.target = name.clone().into();
        Ok(Some(PlanInputs { settings, files: vec![(name, bytes)] }))
    }
}

impl GlassSettings for EcplSettings {
    type Model = Rings;

    const KIND: GlassKind = GlassKind::Ecpl;

    fn kept_files(&mut self) -> Vec<&mut PathBuf> {
        vec![&mut self.target.target]
    }

    fn model(&self, projector: &Projector, material: &Material) -> Result<Rings, Error> {
        let setting = kinetic_setting(projector, material)?;
        let round = self.target.open_again(projector)?.profile()?;
        Ok(Rings::new(setting, projector, material, round))
    }

    fn light(
        &self,
        model: &Rings,
        _: &Projector,
        bitmaps: &[ShownBitmap],
    ) -> Result<Vec<RingExposure>, Error> {
        let exposures = rings_shown(bitmaps)?;
        // Before a model computes them: the display may not be able to show them.
        model.check(&exposures).map_err(of_work)?;
        Ok(exposures)
    }

    fn next(
        &self,
        job: &GlassJob<Self>,
        state: &GlassState,
        command: &str,
        watcher: &dyn Watcher,
    ) -> Result<Vec<GlassPlan>, Error> {
        let setting = job.model.in_state(state).setting;
        let target = self.target.open_again(&job.projector)?;
        let mut plans = Vec::new();
        for times in LIGHTS {
            let light = Intensity::from_mw_per_cm2(times * setting.light.mw_per_cm2());
            let (projector, material) = (job.projector.clone(), job.material.name.clone());
            let other = KineticSetting { light, ..setting };
            let planned = self.plan_for(other, projector, material, &target, watcher);
            let mut next = match planned {
                Ok(next) => next,
                // The first plan is for the state itself.
                Err(error) if plans.is_empty() || watcher.is_stopped() => return Err(error),
                Err(_) => continue,
            };
            job.part().clone_into(&mut next.target);
            command.clone_into(&mut next.command);
            // The next plan's folder is one that a job can begin with.
            if let Some(inputs) = &mut next.inputs {
                inputs.settings.projector.clone_from(&job.given.projector);
                inputs.settings.material.clone_from(&job.given.material);
            }
            next.cure_in(setting, job.model.round.radius_um()).map_err(of_work)?;
            plans.push(next.glass_plan()?);
        }
        Ok(plans)
    }
}

/// Returns the rings that bitmaps show.
///
/// # Errors
/// Returns an error if a bitmap has gray levels, or is not round about the middle of its image.
pub fn rings_shown(bitmaps: &[ShownBitmap]) -> Result<Vec<RingExposure>, Error> {
    let rings = |(of, bitmap): (usize, &ShownBitmap)| {
        let Image::Mask(mask) = &bitmap.image else {
            return Err(Error::work(format!(
                "bitmap {of} has gray levels: kinetics take black and white ones"
            )));
        };
        RingExposure::shown(mask, bitmap.time)
            .map_err(|error| of_work(error).at(format!("bitmap {of}")))
    };
    (1..).zip(bitmaps).map(rings).collect()
}

impl RingCure {
    /// Computes what the bitmaps cure in another setting.
    fn cure_in(&mut self, setting: KineticSetting, radius_um: f64) -> Result<(), RingPlanError> {
        let RingPlan { simulation, wanted, exposures, cured } = &mut self.plan;
        *simulation = RingSimulation::of_plan(setting, exposures, radius_um)?;
        let cells = simulation.reaction().cells();
        *wanted = WantedProfile::new(cells, |radius_um| self.round.height_um(radius_um));
        *cured = simulation.cure(exposures);
        Ok(())
    }

    /// Returns the cured part, for its report.
    pub fn cured(&self) -> CuredRings<'_> {
        let RingPlan { simulation, wanted, exposures, cured } = &self.plan;
        CuredRings { simulation, exposures, cured, wanted: Some(wanted) }
    }

    /// Returns the bitmaps with their report, and what they cure.
    ///
    /// # Errors
    /// Returns an error if a path of the settings is not text.
    pub fn glass_plan(&self) -> Result<GlassPlan, Error> {
        let Self { target, command, round, projector, material, method, plan, inputs } = self;
        let report = EcplReport {
            schema: "lamp-plan-ecpl-1",
            target,
            projector: &projector.name,
            material,
            method: method.to_string(),
            rings: self.cured().report(),
        };
        let grid = map_grid(&plan.cured, round.radius_um());
        let display = &projector.display;
        let bitmap = |exposure: &RingExposure| ShownBitmap {
            image: exposure.drawn(display.columns, display.rows).into(),
            time: exposure.time,
        };
        Ok(GlassPlan {
            part: target.clone(),
            command: command.clone(),
            pitch: projector.pitch.value,
            bitmaps: plan.exposures.iter().map(bitmap).collect(),
            report: json_of(&report),
            wanted: Some(grid.round(|radius_um| round.height_um(radius_um))),
            cured: plan.cured.on(&grid),
            inputs: inputs.as_ref().map_or(Ok(Vec::new()), PlanInputs::files)?,
        })
    }
}

/// Returns what a projector exposes a resin to.
///
/// # Errors
/// Returns an error if the resin lacks the rates of its reaction, or the projector a number that
/// kinetics need.
pub fn kinetic_setting(
    projector: &Projector,
    material: &Material,
) -> Result<KineticSetting, Error> {
    let Some(kinetics) = material.kinetics().map_err(of_work)? else {
        let name = &material.name;
        return Err(Error::work(format!("{name} lacks the rates of its reaction: add [kinetics]")));
    };
    KineticSetting::of(projector, kinetics).map_err(|error| of_work(error).at(&projector.name))
}

/// The least width of columns of maps, in micrometers; for large parts they are wider.
const FINEST_UM: f64 = 2.0;
const MOST_ROWS: f64 = 1000.0;

/// Returns columns that hold all of a part, with room around it.
pub fn map_grid(cured: &Profile, radius_um: f64) -> Grid {
    // A cured part may be wider than its target.
    let radius_um = 1.1 * radius_um.max(cured.base_um) + 10.0;
    let pitch_um = (2.0 * radius_um / MOST_ROWS).max(FINEST_UM);
    // An odd number puts a column on the axis.
    let columns = 2 * (radius_um / pitch_um).ceil() as usize + 1;
    Grid { columns, rows: columns, pitch_um }
}
