//! The settings of column cure, and the plan that they ask for.

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use lamp_grayscale::material::Material;
use lamp_grayscale::resin::ExposureTime;
use lamp_planning::column::{
    ColumnObjective, ColumnOptions, ColumnPlan, GlassLight, HeightCurve, Setup, Stop, Tracing, plan,
};
use lamp_planning::learn::{ColumnLight, Columns, GlassModel, GlassState};
use lamp_planning::projector::{FieldPicture, Projector};
use lamp_planning::target::{Grid, HeightMap};
use lamp_planning::{MirrorSeconds, ShownBitmap};
use lamp_stack::{Length, quoted};
use serde::{Deserialize, Serialize};

use super::column_measures::unmeasured_heights;
use super::column_report::report_of;
use super::job::{GlassJob, GlassKind, GlassSettings, PlanInputs};
use super::target::{GivenTarget, TargetSettings, of_work};
use super::{GlassPlan, field_picture, json_of};
use crate::documents::document_and_word;
use crate::error::Error;
use crate::heights::parse_share;
use crate::watcher::{Remark, Watcher};
use crate::words::{option, optional, optional_path, path, text};

/// Bitmaps where none are asked for, as in 000.
const BITMAPS: usize = 25;
/// The share to which doses are known where the material does not say it.
const DOSE_ERROR: f64 = 0.03;
/// No resin is exposed for longer.
const A_DAY_S: f64 = 86_400.0;
/// Steps after which a search ends, however near it is.
const MOST_STEPS: usize = 20_000;

/// A target, a projector and a resin, and how to plan the bitmaps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct ColumnCureSettings {
    /// The part to cure.
    #[serde(flatten)]
    pub target: TargetSettings,
    /// A built-in projector's name or a file.
    #[serde(with = "path")]
    pub projector: PathBuf,
    /// A built-in material's name or a file.
    #[serde(with = "path")]
    pub material: PathBuf,
    /// Number of bitmaps; `None` is 25, or the number of distinct times if it is smaller.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub bitmaps: Option<BitmapCount>,
    /// Makes 8-bit bitmaps, for displays that show gray levels.
    pub gray: bool,
    /// The quantity to bring nearest to the target's.
    #[serde(with = "text")]
    pub optimize: ColumnObjective,
    /// The longest time of a mirror; `None` is three times the flood exposure time of the highest
    /// column.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub max_time: Option<LongestTime>,
    /// The share by which doses may be off where that makes times shorter and more even; `None` is what
    /// the material's `plus-minus` allows, or 3%.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub dose_error: Option<DoseError>,
    /// How far the glass may be off along each axis.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub robust: Option<Length>,
    /// How light is computed.
    #[serde(with = "text")]
    pub rays: Tracing,
    /// A gray PNG of the display's size, the light of each mirror relative to its mean.
    #[serde(with = "optional_path", skip_serializing_if = "Option::is_none")]
    pub flat_field: Option<PathBuf>,
    /// The side of a column; `None` is the side in the projector's file.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub voxel: Option<Length>,
    /// How near the best times a search ends.
    #[serde(with = "text")]
    pub search_gap: SearchGap,
}

/// A number of bitmaps, from 1 to 1000.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitmapCount(usize);

impl FromStr for BitmapCount {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim().parse() {
            Ok(count @ 1..=1000) => Ok(Self(count)),
            _ => Err(format!("`{text}` is not a number of bitmaps: write 1 to 1000")),
        }
    }
}

impl fmt::Display for BitmapCount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// The longest time of a mirror: above zero, and a day at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LongestTime(ExposureTime);

impl FromStr for LongestTime {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.parse::<ExposureTime>() {
            Ok(time) if time.ms() > 0.0 && time.ms() <= 1000.0 * A_DAY_S => Ok(Self(time)),
            Ok(_) => Err("a mirror must be allowed some time, and a day at most".to_owned()),
            Err(error) => Err(error.to_string()),
        }
    }
}

impl fmt::Display for LongestTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A share of a dose, below 100%.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoseError(f64);

impl FromStr for DoseError {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match parse_share(text)? {
            share if share < 1.0 => Ok(Self(share)),
            _ => Err(format!("`{text}` is not below 100%: write 3%")),
        }
    }
}

impl fmt::Display for DoseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.2}%", 100.0 * self.0)
    }
}

/// The distance from the best times at which a search ends, as a share of the error; above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchGap(f64);

impl Default for SearchGap {
    fn default() -> Self {
        Self(1e-6)
    }
}

impl FromStr for SearchGap {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match parse_share(text)? {
            0.0 => Err("the best is never reached: write 1e-6".to_owned()),
            gap => Ok(Self(gap)),
        }
    }
}

impl fmt::Display for SearchGap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Small shares with an exponent, as people write them.
        write!(f, "{:?}", self.0)
    }
}

/// A plan of column cure, and what it was for.
#[derive(Clone, Debug)]
pub struct ColumnCure {
    /// The target's name.
    pub target: String,
    /// The projector.
    pub projector: Projector,
    /// The material's name.
    pub material: String,
    /// The command, as the bitmaps record it.
    pub command: String,
    /// How the bitmaps were planned.
    pub options: ColumnOptions,
    /// The light of the mirrors on the columns.
    pub light: GlassLight,
    /// The wanted height of each column.
    pub wanted: HeightMap,
    /// The height that each dose cures.
    pub curve: HeightCurve,
    /// The bitmaps, their times and doses.
    pub plan: ColumnPlan,
    /// Files from which the plan can be made again.
    pub inputs: PlanInputs<ColumnCureSettings>,
}

/// The name of the target in a plan's folder.
const TARGET: &str = "target.png";
/// The name of the flat field.
const FLAT_FIELD: &str = "flat-field.png";

impl GlassSettings for ColumnCureSettings {
    type Model = Columns;

    const KIND: GlassKind = GlassKind::ColumnCure;

    fn kept_files(&mut self) -> Vec<&mut PathBuf> {
        std::iter::once(&mut self.target.target).chain(&mut self.flat_field).collect()
    }

    fn model(&self, projector: &Projector, material: &Material) -> Result<Columns, Error> {
        HeightCurve::of(material).map_err(of_work)?;
        let target = self.target.open_again(projector)?;
        let wanted = self.wanted(projector, &target)?;
        let (projector, material) = (projector.clone(), material.clone());
        Ok(Columns { projector, material, wanted, tracing: self.rays })
    }

    fn light(
        &self,
        model: &Columns,
        projector: &Projector,
        bitmaps: &[ShownBitmap],
    ) -> Result<ColumnLight, Error> {
        let shown = MirrorSeconds::of(bitmaps, |level| projector.share(level));
        let of_display = Setup::of(projector, &model.wanted.grid, self.rays);
        let setup = Setup { mirrors: shown.mirrors, ..of_display };
        Ok(ColumnLight { shown, flat_field: self.flat_field(&setup)? })
    }

    fn next(
        &self,
        job: &GlassJob<Self>,
        state: &GlassState,
        command: &str,
        watcher: &dyn Watcher,
    ) -> Result<Vec<GlassPlan>, Error> {
        let Columns { projector, material, .. } = job.model.in_state(state);
        let words = (projector.name.clone(), material.name.clone());
        let mut next = self.plan_for((projector, words.0), (material, words.1), watcher)?;
        next.target = job.part().to_owned();
        command.clone_into(&mut next.command);
        // The next plan's folder is one that a job can begin with.
        next.inputs.settings.projector.clone_from(&job.given.projector);
        next.inputs.settings.material.clone_from(&job.given.material);
        Ok(vec![next.glass_plan()?])
    }
}

impl ColumnCureSettings {
    /// Plans the bitmaps. `watcher` takes doubts about the resin, the target and the plan.
    ///
    /// # Errors
    /// Returns an error if the target, projector, resin or flat field cannot be read, if settings
    /// contradict them, or if there is no plan.
    pub fn plan(&self, watcher: &dyn Watcher) -> Result<ColumnCure, Error> {
        let projector = document_and_word::<Projector>(&self.projector)?;
        let material = document_and_word::<Material>(&self.material)?;
        self.plan_for(projector, material, watcher)
    }

    /// Plans the bitmaps for a projector and a material, each with its word for the command.
    ///
    /// # Errors
    /// As [`plan`](Self::plan).
    pub fn plan_for(
        &self,
        (projector, projector_word): (Projector, String),
        (material, material_word): (Material, String),
        watcher: &dyn Watcher,
    ) -> Result<ColumnCure, Error> {
        let curve = HeightCurve::of(&material).map_err(of_work)?;
        let target = self.target.open(&projector, watcher)?;
        let wanted = self.wanted(&projector, &target)?;
        let mut setup = Setup::of(&projector, &wanted.grid, self.rays);
        setup.flat_field = self.flat_field(&setup)?;
        let light = GlassLight::new(setup);
        if let Some(text) = unmeasured_heights(&wanted, &curve, &material) {
            watcher.remark(Remark::warning(text));
        }
        let options = self.options(&projector, &material, &wanted, &curve)?;
        let plan = plan(&light, &wanted, curve, &options, || watcher.is_stopped())
            .map_err(|error| of_work(error).at(self.target.given()))?;
        let cure = ColumnCure {
            target: target.name().to_owned(),
            command: self.command(target.name(), &projector_word, &material_word, &options),
            inputs: self.inputs(&target, &projector, &wanted)?,
            material: material.name,
            projector,
            options,
            light,
            wanted,
            curve,
            plan,
        };
        if cure.plan.doses.iter().all(|&dose| curve.height_um(dose) <= 0.0) {
            let why = "the plan cures no column: allow a longer --max-time, or take more light";
            watcher.remark(Remark::warning(why.to_owned()));
        }
        cure.doubts().into_iter().for_each(|doubt| watcher.remark(Remark::note(doubt)));
        Ok(cure)
    }

    /// Returns the target's columns, with room for light around it.
    fn wanted(&self, projector: &Projector, target: &GivenTarget) -> Result<HeightMap, Error> {
        let voxel = self.voxel.or(projector.voxel.as_ref().map(|voxel| voxel.value));
        let Some(voxel) = voxel else {
            let name = self.projector.display();
            let most = projector.pitch.value.to_whole_nm();
            return Err(Error::work(format!(
                "{name} does not state how wide columns are: give --voxel, at most {most}"
            )));
        };
        let grid = Setup::grid_around(projector, target.size(), voxel)
            .map_err(|error| of_work(error).at(self.target.given()))?;
        target.heights(&grid, projector)
    }

    /// Returns the light of the mirrors that a setup uses. Empty: all are alike.
    fn flat_field(&self, setup: &Setup) -> Result<Vec<f64>, Error> {
        let Some(path) = &self.flat_field else { return Ok(Vec::new()) };
        let picture = field_picture(path)?;
        mirror_shares(&picture, setup).map_err(|error| error.at(path.display().to_string()))
    }

    /// Returns bitmaps' light in the flat field of a picture of the display, which replaces the settings'
    /// own.
    ///
    /// # Errors
    /// Returns an error if the picture cannot be read, or has another size than the display.
    pub fn in_field(
        &self,
        model: &Columns,
        light: &ColumnLight,
        picture: &Path,
    ) -> Result<ColumnLight, Error> {
        let of_display = Setup::of(&model.projector, &model.wanted.grid, self.rays);
        let setup = Setup { mirrors: light.shown.mirrors, ..of_display };
        let there = Self { flat_field: Some(picture.to_owned()), ..self.clone() };
        Ok(ColumnLight { shown: light.shown.clone(), flat_field: there.flat_field(&setup)? })
    }

    /// Returns the files from which the plan can be made again.
    fn inputs(
        &self,
        target: &GivenTarget,
        projector: &Projector,
        wanted: &HeightMap,
    ) -> Result<PlanInputs<Self>, Error> {
        let voxel = Length::from_um(wanted.grid.pitch_um);
        // The room for light around the target depends on the projector.
        let heights = target.heights(&Grid::over(target.size(), voxel), projector)?;
        let (png, scale) = heights.to_png().map_err(of_work)?;
        let settings = Self {
            target: TargetSettings {
                target: TARGET.into(),
                pixel: Some(scale.pixel),
                full: Some(scale.full),
                ..TargetSettings::default()
            },
            voxel: Some(voxel),
            flat_field: self.flat_field.as_ref().map(|_| FLAT_FIELD.into()),
            ..self.clone()
        };
        let flat_field = self.flat_field.as_ref().map(fs::read).transpose()?;
        let flat_field = flat_field.map(|bytes| (FLAT_FIELD.to_owned(), bytes));
        let files = std::iter::once((TARGET.to_owned(), png)).chain(flat_field).collect();
        Ok(PlanInputs { settings, files })
    }

    fn options(
        &self,
        projector: &Projector,
        material: &Material,
        wanted: &HeightMap,
        curve: &HeightCurve,
    ) -> Result<ColumnOptions, Error> {
        let max_s = match self.max_time {
            Some(LongestTime(time)) => time.ms() / 1000.0,
            None => self.usual_max_s(projector, wanted, curve)?,
        };
        let reach = Setup::reach(projector);
        if let Some(robust) = self.robust.filter(|robust| *robust > reach) {
            // Rounded down, so that the length in the message is accepted.
            let reach = Length::from_um(reach.um().floor());
            return Err(Error::settings(format!(
                "--robust {robust}: a mirror's light is about {reach} wide: give less"
            )));
        }
        let shares: [f64; 256] = std::array::from_fn(|level| projector.share(level as u8));
        if self.gray && !shares.is_sorted() {
            let name = self.projector.display();
            return Err(Error::work(format!(
                "{name}: the light of gray levels must rise for gray bitmaps"
            )));
        }
        Ok(ColumnOptions {
            objective: self.optimize,
            bitmaps: self.bitmaps.map_or(BITMAPS, |BitmapCount(count)| count),
            // A number that was asked for is kept. By default, fewer distinct times need fewer
            // bitmaps.
            fewer: self.bitmaps.is_none(),
            gray: self.gray.then(|| Box::new(shares)),
            max_s,
            dose_error: match self.dose_error {
                Some(DoseError(share)) => share,
                None => HeightCurve::dose_deviation(material, wanted.highest_um())
                    .map_or(DOSE_ERROR, |share| share.min(0.1)),
            },
            robust: self.robust.unwrap_or_default(),
            step_s: projector.step.value.ms() / 1000.0,
            stop: Stop { gap: self.search_gap.0, steps: MOST_STEPS },
        })
    }

    /// Three times what a wide white field takes for the highest column.
    fn usual_max_s(
        &self,
        projector: &Projector,
        wanted: &HeightMap,
        curve: &HeightCurve,
    ) -> Result<f64, Error> {
        let highest = Length::from_um(wanted.highest_um());
        // A height that no dose cures takes forever, and is refused below.
        let dose = curve.dose(highest.um()).unwrap_or(f64::INFINITY);
        let wide_s = dose / projector.irradiance().mw_per_cm2();
        if wide_s > A_DAY_S {
            let name = self.target.given();
            return Err(Error::work(format!(
                "{name}: a column of {highest} takes more than a day of white light"
            )));
        }
        Ok((3.0 * wide_s).min(A_DAY_S))
    }

    /// The command, as the bitmaps record it.
    fn command(
        &self,
        target: &str,
        projector: &str,
        material: &str,
        options: &ColumnOptions,
    ) -> String {
        // Values that were used, not given: defaults may change, and the command must not.
        let mut command = format!(
            "lamp plan column-cure {} --projector {} --material {} --bitmaps {} --optimize {} \
             --max-time {:.3}s --dose-error {} --search-gap {}",
            quoted(target),
            quoted(projector),
            quoted(material),
            options.bitmaps,
            self.optimize,
            options.max_s,
            DoseError(options.dose_error),
            self.search_gap
        );
        if self.gray {
            command += " --gray";
        }
        if self.rays != Tracing::Exact {
            command += &format!(" --rays {}", self.rays);
        }
        if let Some(robust) = self.robust {
            command += &format!(" --robust {robust}");
        }
        if let Some(voxel) = self.voxel {
            command += &format!(" --voxel {voxel}");
        }
        if let Some(name) = self.flat_field.as_deref().and_then(Path::file_name) {
            command += &option("flat-field", &name.to_string_lossy());
        }
        command
    }
}

impl ColumnCure {
    /// Returns the bitmaps with their report, and what they cure.
    ///
    /// # Errors
    /// Returns an error if a path of the settings is not text.
    pub fn glass_plan(&self) -> Result<GlassPlan, Error> {
        let step_ms = self.projector.step.value.ms();
        let bitmaps = self.plan.bitmaps.iter().map(|bitmap| ShownBitmap {
            image: bitmap.image.clone(),
            time: ExposureTime::from_ms(step_ms * bitmap.steps as f64),
        });
        let heights_um = self.plan.doses.iter().map(|&dose| self.curve.height_um(dose)).collect();
        Ok(GlassPlan {
            part: self.target.clone(),
            command: self.command.clone(),
            pitch: self.projector.pitch.value,
            bitmaps: bitmaps.collect(),
            report: json_of(&report_of(self)),
            cured: HeightMap { grid: self.wanted.grid, heights_um },
            wanted: Some(self.wanted.clone()),
            inputs: self.inputs.files()?,
        })
    }

    /// Returns what is doubtful about the times.
    fn doubts(&self) -> Vec<String> {
        let (best, options) = (&self.plan.best, &self.options);
        let late = (best.relative_gap() > options.stop.gap).then(|| {
            format!(
                "the search stopped after {} steps, before it was within {:.1e}: a shorter \
                 --max-time or a wider --search-gap ends sooner",
                best.steps, options.stop.gap
            )
        });
        // Times within the usual limit are no doubt: it keeps scattered mirrors short.
        let at_max = self.inputs.settings.max_time.map_or(0, |_| best.at_most(options.max_s));
        let held = (at_max > 0).then(|| {
            format!("{at_max} mirrors are on for all of --max-time {:.3}s", options.max_s)
        });
        late.into_iter().chain(held).collect()
    }
}

/// Returns the light of the mirrors that a setup uses.
fn mirror_shares(picture: &FieldPicture, setup: &Setup) -> Result<Vec<f64>, Error> {
    let [columns, rows] = setup.display;
    if picture.size() != [columns, rows] {
        let [width, height] = picture.size();
        return Err(Error::work(format!(
            "{width} x {height} pixels, but the display has {columns} x {rows} mirrors"
        )));
    }
    // The mirrors in use are the middle of the display.
    let [left, top] = [0, 1].map(|axis| (setup.display[axis] - setup.mirrors[axis]) / 2);
    let row = |row: usize| &picture.row(row)[left..][..setup.mirrors[0]];
    Ok((top..top + setup.mirrors[1]).flat_map(row).copied().collect())
}
