//! The settings of plans by kinetics, and the plan that they ask for.

use std::path::PathBuf;

use lamp_grayscale::material::Material;
use lamp_planning::ShownBitmap;
use lamp_planning::ecpl::{KineticSetting, Method, Profile, RingExposure, RingPlan, plan};
use lamp_planning::projector::Projector;
use lamp_planning::target::{Grid, Round};
use lamp_stack::quoted;
use serde::{Deserialize, Serialize};

use super::kinetics_report::{CuredRings, RingsReport};
use super::target::{TargetSettings, of_work};
use super::{GlassPlan, json_of};
use crate::documents::document;
use crate::error::Error;
use crate::watcher::Watcher;
use crate::words::{path, text};

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
    /// How bitmaps and times were found.
    pub method: Method,
    /// The bitmaps, and the profile that they cure.
    pub plan: RingPlan,
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
        let round = target.profile()?;
        let height_um = |radius_um| round.height_um(radius_um);
        let is_stopped = || watcher.is_stopped();
        let plan = plan(setting, round.radius_um(), height_um, self.method, is_stopped)
            .map_err(|error| of_work(error).at(self.target.given()))?;
        Ok(RingCure {
            target: target.name().to_owned(),
            round,
            projector,
            material: material.name,
            method: self.method,
            plan,
        })
    }
}

impl RingCure {
    /// Returns the cured part, for its report.
    pub fn cured(&self) -> CuredRings<'_> {
        let RingPlan { simulation, wanted, exposures, cured } = &self.plan;
        CuredRings { simulation, exposures, cured, wanted: Some(wanted) }
    }

    /// Returns the bitmaps with their report, and what they cure.
    pub fn glass_plan(&self) -> GlassPlan {
        let Self { target, round, projector, material, method, plan } = self;
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
        GlassPlan {
            part: target.clone(),
            command: format!(
                "lamp plan ecpl {} --projector {} --material {} --method {method}",
                quoted(target),
                quoted(&projector.name),
                quoted(material),
            ),
            pitch: projector.pitch.value,
            bitmaps: plan.exposures.iter().map(bitmap).collect(),
            report: json_of(&report),
            wanted: Some(grid.round(|radius_um| round.height_um(radius_um))),
            cured: plan.cured.on(&grid),
            inputs: Vec::new(),
        }
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
