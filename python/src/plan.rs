//! Plans of exposures: times of layers, and gray levels of pixels.

use std::fmt;
use std::num::NonZeroU8;
use std::path::PathBuf;
use std::str::FromStr;

use lamp_grayscale::exposure::{LampLight, MeasuredDoses};
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::ExposureTime;
use lamp_pipeline::documents::document_and_word;
use lamp_pipeline::heights::parse_share;
use lamp_pipeline::watcher::Remark;
use lamp_pipeline::words::{option, optional, path, text};
use lamp_pipeline::{Error, ErrorKind, memory};
use lamp_planning::speed::{PartPages, Platform, Speed, SpeedOptions, Wrong, recorded_ms};
use lamp_planning::voxels::{DOSE_MARGIN, Options, VoxelCounts, VoxelObjective, VoxelPlanError};
use lamp_planning::{Light, SampleHeight, speed, voxels};
use lamp_stack::{Layer, Length, PassingLayer, quoted};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::chain::{Chain, Source};
use crate::error::{self, stopped};
use crate::layers::{PyLayers, chain_of};
use crate::settings::{given, settings};
use crate::work::{Flow, Work};

/// The resin, its light, and the target, as all planners of layers have them.
#[derive(Clone, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
struct PlanSettings {
    #[serde(with = "path")]
    material: PathBuf,
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    lamp_intensity: Option<LampLight>,
    #[serde(with = "text")]
    wanted: NonZeroU8,
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    dose_margin: Option<Share>,
    #[serde(with = "text")]
    search_gap: Share,
    #[serde(with = "text")]
    dose_at: SampleHeight,
}

impl Default for PlanSettings {
    fn default() -> Self {
        let Options { wanted, gap, .. } = Options::default();
        Self {
            material: PathBuf::new(),
            lamp_intensity: None,
            wanted,
            dose_margin: None,
            search_gap: Share(gap),
            dose_at: SampleHeight::Top,
        }
    }
}

/// Times of layers.
#[derive(Clone, Default, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
struct SpeedSettings {
    #[serde(flatten)]
    plan: PlanSettings,
    #[serde(with = "text")]
    speed: Speeds,
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    max_change: Option<Share>,
}

/// Gray levels of pixels.
#[derive(Clone, Default, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
struct VoxelSettings {
    #[serde(flatten)]
    plan: PlanSettings,
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    objective: Option<VoxelObjective>,
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    expose: Option<ExposureTime>,
    min_level: u8,
}

/// A share as a number or in percent.
#[derive(Clone, Copy)]
struct Share(f64);

impl FromStr for Share {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        parse_share(text).map(Self)
    }
}

impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// The slowest and the fastest speed of a platform: `5um/s..2mm/s`.
#[derive(Clone, Copy)]
struct Speeds(Speed, Speed);

impl Default for Speeds {
    fn default() -> Self {
        Self(5.0, 2000.0)
    }
}

impl FromStr for Speeds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is not a range of speeds: write 5um/s..2mm/s");
        let speed = |text: &str| -> Option<Speed> {
            text.trim().strip_suffix("/s")?.parse::<Length>().ok().map(Length::um)
        };
        let (slowest, fastest) = text.split_once("..").ok_or_else(wrong)?;
        let (slowest, fastest) = speed(slowest).zip(speed(fastest)).ok_or_else(wrong)?;
        if slowest > 0.0 && slowest < fastest && fastest <= 1e9 {
            Ok(Self(slowest, fastest))
        } else {
            Err(format!(
                "`{text}`: the first speed must be above zero, and the second above the first"
            ))
        }
    }
}

impl fmt::Display for Speeds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}um/s..{}um/s", self.0, self.1)
    }
}

/// The plans of layers.
#[derive(Clone)]
enum Planner {
    Speed(SpeedSettings),
    Voxels(VoxelSettings),
}

/// Layers, and what is planned for them.
pub(crate) struct PlanSource {
    chain: Chain,
    planner: Planner,
    memory: u64,
}

/// Chooses the time of each layer.
#[pyfunction]
#[pyo3(signature = (layers, keywords, *, memory_bytes))]
pub(crate) fn plan_speed(
    layers: &Bound<'_, PyAny>,
    keywords: &Bound<'_, PyDict>,
    memory_bytes: Option<u64>,
) -> PyResult<PyLayers> {
    let settings: SpeedSettings = settings(layers.py(), &given(keywords)?, probe)?;
    planned(layers, Planner::Speed(settings), memory_bytes)
}

/// Chooses the gray level of each pixel.
#[pyfunction]
#[pyo3(signature = (layers, keywords, *, memory_bytes))]
pub(crate) fn plan_voxels(
    layers: &Bound<'_, PyAny>,
    keywords: &Bound<'_, PyDict>,
    memory_bytes: Option<u64>,
) -> PyResult<PyLayers> {
    let settings: VoxelSettings = settings(layers.py(), &given(keywords)?, probe)?;
    planned(layers, Planner::Voxels(settings), memory_bytes)
}

fn probe(key: &str, text: &str) -> Result<(), String> {
    match (key, parse_share(text)) {
        ("search-gap" | "max-change", Ok(0.0)) => Err("the share must be above zero".to_owned()),
        ("expose", _) => match text.parse::<ExposureTime>() {
            Ok(time) if time.ms() > 0.0 => Ok(()),
            Ok(_) => Err("an exposure takes some time".to_owned()),
            Err(error) => Err(error.to_string()),
        },
        _ => Ok(()),
    }
}

fn planned(
    layers: &Bound<'_, PyAny>,
    planner: Planner,
    memory_bytes: Option<u64>,
) -> PyResult<PyLayers> {
    if planner.settings().material.as_os_str().is_empty() {
        return Err(error::settings(layers.py(), "give material, a built-in one's name or a file"));
    }
    let memory = memory_bytes.unwrap_or_else(|| memory::available() / 4);
    let source = PlanSource { chain: chain_of(layers)?, planner, memory };
    Ok(PyLayers::new(Chain::of(Source::Plan(Box::new(source)))))
}

/// An error of a stage or of a plan.
struct Failure(Error);

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self(error)
    }
}

impl From<VoxelPlanError> for Failure {
    fn from(error: VoxelPlanError) -> Self {
        Self(of_work(error))
    }
}

fn of_work(error: impl std::error::Error + Send + Sync + 'static) -> Error {
    Error::new(ErrorKind::Work, error)
}

impl Planner {
    fn settings(&self) -> &PlanSettings {
        match self {
            Self::Speed(settings) => &settings.plan,
            Self::Voxels(settings) => &settings.plan,
        }
    }

    /// Returns the plan as words of a command, as pages record it.
    fn words(&self, resin: &str) -> String {
        let PlanSettings { wanted, dose_margin, search_gap, dose_at, .. } = self.settings();
        let usual = match self {
            Self::Voxels(VoxelSettings { objective: Some(VoxelObjective::Boundary), .. }) => 0.0,
            _ => DOSE_MARGIN,
        };
        let margin = 100.0 * dose_margin.map_or(usual, |margin| margin.0);
        let gap = 100.0 * search_gap.0;
        let shared = format!(
            "--wanted {wanted} --dose-margin {margin}% --search-gap {gap}% --dose-at {dose_at}"
        );
        match self {
            Self::Speed(SpeedSettings { speed, max_change, .. }) => {
                let change = max_change
                    .map(|Share(change)| option("max-change", &format!("{}%", 100.0 * change)));
                let change = change.unwrap_or_default();
                format!("lamp plan speed {resin} {shared} --speed {speed}{change}")
            }
            Self::Voxels(VoxelSettings { objective, min_level, .. }) => {
                let objective = objective.unwrap_or(VoxelObjective::Wrong);
                let level = match min_level {
                    0 => String::new(),
                    level => format!(" --min-level {level}"),
                };
                format!("lamp plan voxels {resin} --objective {objective} {shared}{level}")
            }
        }
    }
}

impl PlanSource {
    /// Returns the name of what is planned, for messages.
    pub(crate) fn name(&self) -> String {
        self.chain.name()
    }

    /// Returns the plan as words of a command.
    pub(crate) fn words(&self) -> String {
        let material = self.planner.settings().material.display().to_string();
        let words = self.planner.words(&format!("--material {}", quoted(&material)));
        format!("{} | {words}", self.chain.words())
    }

    /// Plans, and gives the layers with their times or levels to `then`.
    pub(crate) fn run(
        self,
        work: &Work,
        then: &mut dyn FnMut(Flow<'_>) -> Result<(), Error>,
    ) -> Result<Vec<Value>, Error> {
        let shared = self.planner.settings();
        let (material, word) = document_and_word::<Material>(&shared.material)?;
        let lamp = shared.lamp_intensity;
        let (material, doubt) = match lamp {
            Some(light) => light.material(&material).map_err(of_work)?,
            None => (material, None),
        };
        let light = Light::of(&material, shared.dose_at).map_err(of_work)?;
        let lamp = lamp.map(|light| option("lamp-intensity", &light.to_string()));
        let resin = format!("--material {}{}", quoted(&word), lamp.unwrap_or_default());
        let command = self.planner.words(&resin);
        let resin = Resin { material, light, command };
        doubt.into_iter().for_each(|doubt| work.say("plan", Remark::note(doubt)));
        let Self { chain, planner, memory } = self;
        match planner {
            Planner::Speed(settings) => plan_times(chain, &settings, memory, &resin, work, then),
            Planner::Voxels(settings) => plan_levels(chain, &settings, memory, &resin, work, then),
        }
    }
}

/// A resin under its lamp, and the command that pages record.
struct Resin {
    material: Material,
    light: Light,
    command: String,
}

impl Resin {
    /// Says where the material was not measured at the doses of some times.
    fn say_doubts(
        &self,
        times: impl Iterator<Item = ExposureTime>,
        work: &Work,
    ) -> Result<(), Error> {
        let doses = MeasuredDoses::of_working_curve(&self.material);
        if let Some(light) = self.material.light().map_err(of_work)? {
            times.for_each(|time| doses.see(light * time));
        }
        let doubt = doses.doubt("layers");
        doubt.into_iter().for_each(|doubt| work.say("plan", Remark::note(doubt)));
        Ok(())
    }

    fn record(&self, layer: &mut Layer) {
        if let Some(stack) = &mut layer.info.stack {
            stack.commands.push(self.command.clone());
        }
    }
}

fn plan_times(
    chain: Chain,
    settings: &SpeedSettings,
    memory: u64,
    resin: &Resin,
    work: &Work,
    then: &mut dyn FnMut(Flow<'_>) -> Result<(), Error>,
) -> Result<Vec<Value>, Error> {
    let name = chain.name();
    let at_name = |error: Error| error.at(name.clone());
    // Read twice: a plan needs all layers, and their images may not fit in memory together.
    let (chain, again, mut reports) = chain.twice(work)?;
    let mut pages = Some(PartPages::new(settings.plan.wanted.get()));
    reports.extend(chain.run(work, true, &mut |mut layers| {
        let pages = pages.as_mut().ok_or_else(stopped)?;
        layers.try_for_each(|layer| {
            pages.push(layer?.decode()?).map_err(|error| at_name(of_work(error)))
        })
    })?);
    let part = pages.take().ok_or_else(stopped)?.finish();
    let part = part.map_err(|error| at_name(of_work(error)))?;
    let Speeds(slowest, fastest) = settings.speed;
    let max_change = settings.max_change.map(|Share(change)| change);
    let options = SpeedOptions {
        light: resin.light,
        platform: Platform { slowest, fastest, max_change },
        margin: settings.plan.dose_margin.map_or(DOSE_MARGIN, |margin| margin.0),
        gap: settings.plan.search_gap.0,
        memory,
    };
    let plan = speed::plan(&part, &options).map_err(|error| at_name(of_work(error)))?;
    resin.say_doubts(plan.times.iter().copied(), work)?;
    // Times count from the light.
    let times_ms: Vec<f64> = plan.times.iter().rev().map(|&time| recorded_ms(time)).collect();
    again.run(work, true, &mut |layers| {
        let timed = layers.zip(&times_ms).map(|(layer, &ms)| {
            let mut layer: Layer = layer?.decode()?;
            layer.info.exposure_ms = Some(ms);
            resin.record(&mut layer);
            Ok(layer.into())
        });
        then(Box::new(timed))
    })?;
    let wrong = |Wrong { over, under }| json!({ "overcured": over, "undercured": under });
    let last = plan.stages.last();
    reports.push(json!({
        "stage": "plan speed",
        "material": resin.material.name,
        "layers": times_ms.len(),
        "single_ms": recorded_ms(plan.single),
        "times_ms": times_ms,
        "before": wrong(plan.before.wrong()),
        "after": wrong(plan.after.wrong()),
        "error": last.map(|last| last.error),
        "bound": last.map(|last| last.bound),
        "gap": plan.gap(),
    }));
    Ok(reports)
}

fn plan_levels(
    chain: Chain,
    settings: &VoxelSettings,
    memory: u64,
    resin: &Resin,
    work: &Work,
    then: &mut dyn FnMut(Flow<'_>) -> Result<(), Error>,
) -> Result<Vec<Value>, Error> {
    let name = chain.name();
    let PlanSettings { wanted, dose_margin, search_gap, .. } = settings.plan;
    let options = Options {
        wanted,
        objective: settings.objective.unwrap_or(VoxelObjective::Wrong),
        margin: dose_margin.map(|margin| margin.0),
        gap: search_gap.0,
        min_level: settings.min_level,
        memory: Some(memory),
        ..Options::default()
    };
    let (mut plan, mut times) = (None, Vec::new());
    let mut reports = chain.run(work, true, &mut |layers| {
        let layers = layers.map(|layer| {
            let mut layer = layer?.decode().map_err(Error::from)?;
            let given_ms = settings.expose.map(ExposureTime::ms);
            layer.info.exposure_ms = given_ms.or(layer.info.exposure_ms);
            times.extend(layer.info.exposure_ms.map(ExposureTime::from_ms));
            resin.record(&mut layer);
            Ok(layer)
        });
        let made = voxels::plan::<Failure>(layers, &resin.light, &options, |_| ());
        plan = Some(made.map_err(|Failure(error)| match error.cause::<VoxelPlanError>() {
            Some(_) => error.at(name.clone()),
            None => error,
        })?);
        Ok(())
    })?;
    let mut plan = plan.ok_or_else(stopped)?;
    resin.say_doubts(times.into_iter(), work)?;
    let levels = plan.by_ref().map(|layer| layer.map(PassingLayer::from).map_err(of_work));
    then(work.watched(Box::new(levels)))?;
    let outcome = plan.outcome();
    let uncurable = outcome.uncurable();
    if outcome.cures_nothing() {
        let why = format!("{name}: the plan cures no wanted voxel");
        work.say("plan", Remark::warning(why));
    } else if uncurable > 0 {
        let why = format!("{name}: white light cannot cure {uncurable} wanted voxels");
        work.say("plan", Remark::warning(why));
    }
    let counts = |VoxelCounts { overcured, undercured, .. }: VoxelCounts| json!({ "overcured": overcured, "undercured": undercured });
    reports.push(json!({
        "stage": "plan voxels",
        "material": resin.material.name,
        "layers": outcome.layers.len(),
        "before": counts(outcome.before.counts),
        "after": counts(outcome.after.counts),
        "cost": outcome.after.cost,
        "bound": outcome.bound,
        "uncurable": uncurable,
    }));
    Ok(reports)
}
