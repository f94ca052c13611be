//! Jobs of plans on a glass: a plan, its prints, and what their heights show.
//!
//! ```text
//! job.toml                what the job is for: its part, its settings
//! target.png              the wanted heights, or the target's file
//! material.toml           the resin
//! projector.toml          the projector
//! print-000.tif           the bitmaps of the first print
//! print-000.toml          their digest
//! print-000-measured.csv  the heights that were measured on it
//! print-001.tif           the bitmaps of the next
//! print-001.toml          their digest, and the state that they are planned for
//! ```

use std::fs;
use std::path::{Path, PathBuf};

use lamp_grayscale::material::Material;
use lamp_planning::ShownBitmap;
use lamp_planning::learn::{
    GlassFit, GlassModel, GlassState, HeightRow, JobError, JobFile, PrintMeasurements,
    digest_of_stack, measured_name, print_to_learn_from, requested_print, sealed_text, take_back,
};
use lamp_planning::projector::Projector;
use lamp_planning::target::{Grid, MapScale, Target, TargetOptions};
use lamp_stack::{Catalogued, Page, sealed};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::target::of_work;
use super::{GlassPlan, bitmaps_of};
use crate::documents::{open_stack, read_text};
use crate::error::Error;
use crate::watcher::Watcher;

const PROJECTOR: &str = "projector.toml";
/// Settings are texts of a few kilobytes.
const MAX_SETTINGS: u64 = 1 << 20;

/// The kinds of plans on a glass that a job can begin with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GlassKind {
    /// By doses of columns, as `lamp plan column-cure` plans.
    ColumnCure,
    /// By kinetics, as `lamp plan ecpl` plans.
    Ecpl,
}

/// The settings of a planner on a glass, from which its plan can be made again in another state of
/// light and resin.
pub trait GlassSettings: Clone + Serialize + DeserializeOwned {
    /// The model that the planner has of light and resin.
    type Model: GlassModel;

    /// The kind of its plans.
    const KIND: GlassKind;

    /// Returns the names of the files that are kept beside the settings, the target's first, with
    /// the folder that has them.
    fn kept_files(&mut self) -> Vec<&mut PathBuf>;

    /// Returns the model of a projector and a material.
    ///
    /// # Errors
    /// Returns an error if they lack what the model needs, or if the target cannot be read.
    fn model(&self, projector: &Projector, material: &Material) -> Result<Self::Model, Error>;

    /// Returns the light of bitmaps.
    ///
    /// # Errors
    /// Returns an error if the model cannot take these bitmaps.
    fn light(
        &self,
        model: &Self::Model,
        projector: &Projector,
        bitmaps: &[ShownBitmap],
    ) -> Result<<Self::Model as GlassModel>::Light, Error>;

    /// Returns plans for a state of light and resin, as the settings of a job ask: one or more, of
    /// which the best is printed.
    ///
    /// # Errors
    /// Returns an error if there is no plan.
    fn next(
        &self,
        job: &GlassJob<Self>,
        state: &GlassState,
        command: &str,
        watcher: &dyn Watcher,
    ) -> Result<Vec<GlassPlan>, Error>;
}

/// The settings of a plan, as its folder keeps them.
#[derive(Serialize, Deserialize)]
struct KeptSettings<S> {
    kind: GlassKind,
    #[serde(flatten)]
    settings: S,
}

/// The files of a plan's folder from which the plan can be made again.
#[derive(Clone, Debug)]
pub struct PlanInputs<S> {
    /// The settings, with the names of the other files.
    pub settings: S,
    /// The files that the settings name.
    pub files: Vec<(String, Vec<u8>)>,
}

/// The name of the settings in a plan's folder.
const SETTINGS: &str = "plan.toml";
const BITMAPS: &str = "bitmaps.tif";

impl<S: GlassSettings> PlanInputs<S> {
    /// Returns the files, by their names.
    ///
    /// # Errors
    /// Returns an error if a path of the settings is not text.
    pub(super) fn files(&self) -> Result<Vec<(String, Vec<u8>)>, Error> {
        let kept = KeptSettings { kind: S::KIND, settings: &self.settings };
        let settings = toml::to_string(&kept).map_err(of_work)?;
        let settings = (SETTINGS.to_owned(), settings.into_bytes());
        Ok(std::iter::once(settings).chain(self.files.iter().cloned()).collect())
    }
}

/// The purpose of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct GlassJobFile<S> {
    kind: GlassKind,
    /// The name of the part.
    part: String,
    /// The digest of the target's file.
    target_digest: String,
    /// The settings of the plan.
    plan: S,
}

/// The record of a print.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PrintFile {
    /// The digest of its bitmaps.
    bitmaps: String,
    /// The state that they are planned for, if prints had shown one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    state: Option<GlassState>,
}

/// A print of a job.
#[derive(Clone, Debug)]
pub struct GlassJobPrint<L> {
    /// The light of its bitmaps.
    pub light: L,
    /// How long all bitmaps take, in seconds.
    pub seconds: f64,
    /// The measurements, and their text.
    pub measured: Option<(PrintMeasurements, String)>,
    /// The state that it was planned for, if prints had shown one.
    pub state: Option<GlassState>,
}

/// A print of a job, by the job's settings.
type PrintOf<S> = GlassJobPrint<<<S as GlassSettings>::Model as GlassModel>::Light>;

/// A job of a plan on a glass that is open.
#[derive(Debug)]
pub struct GlassJob<S: GlassSettings> {
    folder: PathBuf,
    part: String,
    /// The settings of the plan, with the target in the job's folder.
    pub(super) settings: S,
    /// The settings as the plan's folder had them.
    pub(super) given: S,
    /// The projector at the start.
    pub projector: Projector,
    /// The resin at the start.
    pub material: Material,
    /// The target, and the light and resin at the start.
    pub model: S::Model,
    /// All prints, the last of which is to be measured.
    pub prints: Vec<PrintOf<S>>,
}

/// The state that the prints show, and the next plan.
#[derive(Debug)]
pub struct GlassLesson {
    /// The state before the print was measured.
    pub before: GlassState,
    /// The state after.
    pub fit: GlassFit,
    /// The standard deviation of the heights in micrometers, as their residuals show it.
    pub noise_um: f64,
    /// The next plan.
    pub next: GlassPlan,
    /// The root mean square error that the next print is expected to have, measured at the same
    /// places, in micrometers: its mean, and the ends of the interval of 95 % of the states.
    pub expected_um: [f64; 3],
}

/// The kind of a file of a job, or of settings.
#[derive(Deserialize)]
struct OfKind {
    kind: GlassKind,
}

/// Returns the kind of the plan on a glass that a folder has a job of, if it has one.
pub fn job_kind(folder: &Path) -> Option<GlassKind> {
    let text = sealed_text(&folder.join(JobFile::NAME), "a job's file").ok()?;
    toml::from_str::<OfKind>(&text).ok().map(|file| file.kind)
}

/// Returns the kind of the plan on a glass that a folder has.
///
/// # Errors
/// Returns an error if it has no settings.
pub fn plan_kind(plan: &Path) -> Result<GlassKind, Error> {
    let file = plan.join(SETTINGS);
    let text = settings_text(plan)?;
    let of_kind = toml::from_str::<OfKind>(&text);
    of_kind.map(|of| of.kind).map_err(|error| of_work(error).at(file.display().to_string()))
}

fn settings_text(plan: &Path) -> Result<String, Error> {
    let file = plan.join(SETTINGS);
    if !file.exists() {
        let plan = plan.display();
        return Err(Error::work(format!(
            "{plan}: there is no {SETTINGS}: plan again by lamp plan column-cure or lamp plan ecpl, \
             which write it"
        )));
    }
    read_text(&file, MAX_SETTINGS, "a plan's settings")
}

/// Reads a sealed file.
fn parsed<T: DeserializeOwned>(file: &Path, what: &'static str) -> Result<T, Error> {
    let text = sealed_text(file, what).map_err(of_work)?;
    toml::from_str(&text).map_err(|error| of_work(error).at(file.display().to_string()))
}

fn bitmaps_name(print: usize) -> String {
    format!("print-{print:03}.tif")
}

fn record_name(print: usize) -> String {
    format!("print-{print:03}.toml")
}

impl GlassLesson {
    /// The least deviation of a height map's pixels, in micrometers: the residuals of the fit raise
    /// it.
    pub const MAP_SD_UM: f64 = 0.1;
}

impl<S: GlassSettings> GlassJob<S> {
    /// Returns the files of a new job of a plan's folder, by their names, for a projector and a
    /// material.
    ///
    /// # Errors
    /// Returns an error if the folder lacks a file, or if projector and material lack what the
    /// model needs.
    pub fn begun(
        plan: &Path,
        projector: &Projector,
        material: &Material,
    ) -> Result<Vec<(String, Vec<u8>)>, Error> {
        let read = |file: &Path| {
            fs::read(file).map_err(|error| Error::from(error).at(file.display().to_string()))
        };
        let kept: KeptSettings<S> = toml::from_str(&settings_text(plan)?)
            .map_err(|error| of_work(error).at(plan.join(SETTINGS).display().to_string()))?;
        let mut there = kept.settings.clone();
        let (mut files, mut target_digest) = (Vec::new(), None);
        for path in there.kept_files() {
            let name = path.to_string_lossy().into_owned();
            // A name may neither lead out of the folder nor replace another file of the job.
            let is_kept = path.file_name() == Some(path.as_os_str())
                && (name.starts_with("target") || name.starts_with("flat-field"));
            if !is_kept {
                let settings = plan.join(SETTINGS);
                let text = format!("`{name}` is not a file of a plan's folder: plan again");
                return Err(Error::work(text).at(settings.display().to_string()));
            }
            *path = plan.join(&*path);
            if target_digest.is_none() {
                target_digest = Some(digest_of_stack(path).map_err(of_work)?);
            }
            files.push((name, read(path)?));
        }
        there.model(projector, material)?;
        let bitmaps = plan.join(BITMAPS);
        let file = GlassJobFile {
            kind: S::KIND,
            part: part_of(&bitmaps)?,
            target_digest: target_digest.unwrap_or_default(),
            plan: kept.settings,
        };
        let record =
            PrintFile { bitmaps: digest_of_stack(&bitmaps).map_err(of_work)?, state: None };
        let text = |text: Result<String, toml::ser::Error>| -> Result<Vec<u8>, Error> {
            Ok(sealed(&text.map_err(of_work)?).into_bytes())
        };
        files.extend([
            (JobFile::NAME.to_owned(), text(toml::to_string(&file))?),
            (JobFile::MATERIAL.to_owned(), text(toml::to_string(material))?),
            (PROJECTOR.to_owned(), text(toml::to_string(projector))?),
            (bitmaps_name(0), read(&bitmaps)?),
            (record_name(0), text(toml::to_string(&record))?),
        ]);
        Ok(files)
    }

    /// Opens a job's folder.
    ///
    /// # Errors
    /// Returns an error if a file of the job is missing, was changed or does not fit the others.
    pub fn open(folder: &Path) -> Result<Self, Error> {
        let file = folder.join(JobFile::NAME);
        if !file.exists() {
            return Err(of_work(JobError::NoJob(folder.to_owned())));
        }
        let file: GlassJobFile<S> = parsed(&file, "a job's file")?;
        let mut settings = file.plan.clone();
        for (number, path) in settings.kept_files().into_iter().enumerate() {
            *path = folder.join(&*path);
            if number == 0 {
                check_digest(path, &file.target_digest)?;
            }
        }
        let material = catalogued::<Material>(&folder.join(JobFile::MATERIAL), "a material file")?;
        let projector = catalogued::<Projector>(&folder.join(PROJECTOR), "a projector file")?;
        let model = settings.model(&projector, &material)?;
        let mut job = Self {
            folder: folder.to_owned(),
            part: file.part,
            settings,
            given: file.plan,
            projector,
            material,
            model,
            prints: Vec::new(),
        };
        while job.folder.join(record_name(job.prints.len())).exists() {
            let print = job.read_print(job.prints.len())?;
            job.prints.push(print);
        }
        if job.prints.is_empty() {
            let (folder, name) = (folder.to_owned(), record_name(0));
            return Err(of_work(JobError::NoPrint { folder, name }));
        }
        Ok(job)
    }

    fn read_print(&self, number: usize) -> Result<PrintOf<S>, Error> {
        let at = |name: String| self.folder.join(name);
        let record: PrintFile = parsed(&at(record_name(number)), "the record of a print")?;
        let bitmaps = at(bitmaps_name(number));
        check_digest(&bitmaps, &record.bitmaps)?;
        let (light, seconds) = self.shown(&bitmaps)?;
        let measured = at(measured_name(number));
        // Without a next print, the measurements were kept by a run that did not end.
        let is_learnt_from = measured.exists() && at(record_name(number + 1)).exists();
        let read = || -> Result<_, Error> {
            let text = sealed_text(&measured, "a table of measurements").map_err(of_work)?;
            let table = PrintMeasurements::parse(&text);
            let table = table.map_err(|error| of_work(error).at(measured.display().to_string()))?;
            Ok((table, text))
        };
        let measured = is_learnt_from.then(read).transpose()?;
        Ok(GlassJobPrint { light, seconds, measured, state: record.state })
    }

    /// Returns the light of bitmaps, and how long all take, in seconds.
    fn shown(&self, path: &Path) -> Result<(<S::Model as GlassModel>::Light, f64), Error> {
        let named = |error: Error| error.at(path.display().to_string());
        let bitmaps = bitmaps_of(path, &self.projector)?;
        let seconds = bitmaps.iter().map(|bitmap| bitmap.time.ms()).sum::<f64>() / 1000.0;
        let light = self.settings.light(&self.model, &self.projector, &bitmaps).map_err(named)?;
        Ok((light, seconds))
    }

    /// Returns the job's model for another material.
    ///
    /// # Errors
    /// Returns an error if the material lacks what the model needs.
    pub fn model_of(&self, material: &Material) -> Result<S::Model, Error> {
        self.settings.model(&self.projector, material)
    }

    /// Returns the settings of the plan.
    pub fn settings(&self) -> &S {
        &self.settings
    }

    /// Returns the name of the part.
    pub fn part(&self) -> &str {
        &self.part
    }

    /// Returns the print that is requested: the last one, if none is.
    ///
    /// # Errors
    /// Returns an error if it was never planned.
    pub fn print_of(&self, asked: Option<usize>) -> Result<usize, JobError> {
        requested_print(&self.folder, self.prints.len(), asked)
    }

    /// Returns the print that was measured: the last one, unless another is requested.
    ///
    /// # Errors
    /// Returns an error if it is not the last.
    pub fn print_to_learn_from(&self, asked: Option<usize>) -> Result<usize, JobError> {
        print_to_learn_from(&self.folder, self.prints.len(), asked)
    }

    /// Goes back to the state before the last print was learned from, if these are its
    /// measurements. Returns its number.
    pub fn take_back(&mut self, text: &str) -> Option<usize> {
        take_back(&mut self.prints, text, |print| &mut print.measured)
    }

    /// Returns the measurements of a height map, a PNG: each of its pixels on the columns.
    ///
    /// # Errors
    /// Returns an error if it is not a gray PNG, or is all black.
    pub fn measured_map(&self, path: &Path, scale: MapScale) -> Result<PrintMeasurements, Error> {
        let named = |error: Error| error.at(path.display().to_string());
        let options = TargetOptions { scale: Some(scale), ..TargetOptions::default() };
        let map = Target::open(path, &options).map_err(|error| named(of_work(error)))?;
        if !map.is_picture() {
            return Err(named(Error::work("a height map is a gray PNG of 8 or 16 bits")));
        }
        let grid = Grid::over(map.size(), scale.pixel);
        let map = map.heights(&grid).map_err(|error| named(of_work(error)))?;
        let rounded_mm = |um: f64| (1000.0 * um).round() / 1e6;
        let mut rows = Vec::new();
        for (at, um) in map.heights_um.iter().enumerate() {
            let place_mm = [
                rounded_mm(grid.x_um(at % grid.columns)),
                rounded_mm(grid.y_um(at / grid.columns)),
            ];
            // Light reaches no pixel beyond the model's grid.
            let Some(wanted_um) = self.model.wanted_um(place_mm) else { continue };
            rows.push(HeightRow {
                line: rows.len() + 2,
                place_mm,
                z_mm: rounded_mm(wanted_um),
                measured_mm: rounded_mm(*um),
                sd_um: GlassLesson::MAP_SD_UM,
            });
        }
        Ok(PrintMeasurements::Heights(rows))
    }

    /// Learns from the measurements of a print, and plans the next.
    ///
    /// # Errors
    /// Returns an error if these are not heights, or if there is no plan.
    pub fn learn(
        &self,
        print: usize,
        measured: &PrintMeasurements,
        watcher: &dyn Watcher,
    ) -> Result<GlassLesson, Error> {
        let PrintMeasurements::Heights(rows) = measured else {
            return Err(Error::work("a plan on a glass learns from heights alone"));
        };
        // A height in micrometers where millimeters are meant would make a state that no print has.
        let highest_mm = rows.iter().map(|row| row.z_mm).fold(0.0, f64::max);
        let most_mm = 10.0 * highest_mm + 1.0;
        if let Some(row) = rows.iter().find(|row| row.measured_mm > most_mm) {
            return Err(Error::work(format!(
                "line {}: {} mm is too high for a print of {highest_mm} mm: heights are in \
                 millimeters, at most {most_mm:.3} here",
                row.line, row.measured_mm
            )));
        }
        let earlier = self.prints[..print].iter().filter_map(|print| match &print.measured {
            Some((PrintMeasurements::Heights(rows), _)) => Some((&print.light, &rows[..])),
            _ => None,
        });
        let all: Vec<_> = earlier.chain([(&self.prints[print].light, &rows[..])]).collect();
        let fit = self.model.fit(&all).map_err(of_work)?;
        let command = format!("lamp learn --print {print}");
        let plans = self.settings.next(self, &fit.state, &command, watcher)?;
        let mut best: Option<(GlassPlan, [f64; 3])> = None;
        for plan in plans {
            let light = self.settings.light(&self.model, &self.projector, &plan.bitmaps)?;
            let expected_um = self.model.expected_um(&fit, &light, rows).map_err(of_work)?;
            if best.as_ref().is_none_or(|(_, least_um)| expected_um[0] < least_um[0]) {
                best = Some((plan, expected_um));
            }
        }
        let Some((next, expected_um)) = best else { return Err(Error::work("there is no plan")) };
        let squares: f64 = rows.iter().map(|row| row.sd_um * row.sd_um).sum();
        let noise_um = fit.misfit * (squares / rows.len().max(1) as f64).sqrt();
        let before = self.prints[print].state.clone().unwrap_or_else(|| self.model.prior());
        Ok(GlassLesson { before, fit, noise_um, next, expected_um })
    }

    /// Returns the file of a print's bitmaps.
    pub fn bitmaps_file(&self, print: usize) -> PathBuf {
        self.folder.join(bitmaps_name(print))
    }

    /// Returns the files that keep the measurements and results of a print, in the order in which
    /// they must be written, after the bitmaps of the next one.
    ///
    /// # Errors
    /// Returns an error if these bitmaps cannot be read.
    pub fn files_to_keep(
        &self,
        print: usize,
        text: &str,
        lesson: &GlassLesson,
    ) -> Result<Vec<(PathBuf, String)>, Error> {
        let bitmaps = digest_of_stack(&self.bitmaps_file(print + 1)).map_err(of_work)?;
        let record = PrintFile { bitmaps, state: Some(lesson.fit.state.clone()) };
        let record = toml::to_string(&record).map_err(of_work)?;
        let end = if text.ends_with('\n') { "" } else { "\n" };
        Ok(vec![
            (self.folder.join(measured_name(print)), sealed(&format!("{text}{end}"))),
            // The print exists once its record does.
            (self.folder.join(record_name(print + 1)), sealed(&record)),
        ])
    }

    /// Checks that the repeated results for a print equal the earlier ones.
    ///
    /// # Errors
    /// Returns an error if they differ.
    pub fn check_again(&self, print: usize, lesson: &GlassLesson) -> Result<(), Error> {
        let name = record_name(print + 1);
        let record: PrintFile = parsed(&self.folder.join(&name), "the record of a print")?;
        match record.state.as_ref() == Some(&lesson.fit.state) {
            true => Ok(()),
            false => {
                let folder = self.folder.clone();
                Err(of_work(JobError::OtherOptions { folder, print, name }))
            }
        }
    }
}

/// Returns the part of a plan's bitmaps.
fn part_of(bitmaps: &Path) -> Result<String, Error> {
    let named = |error: Error| error.at(bitmaps.display().to_string());
    match open_stack(bitmaps)?.next() {
        Some(page) => {
            let layer = page.and_then(Page::decode).map_err(|error| named(error.into()))?;
            Ok(layer.info.stack.map(|stack| stack.part).unwrap_or_default())
        }
        None => Err(named(Error::work("there are no bitmaps"))),
    }
}

fn check_digest(file: &Path, digest: &str) -> Result<(), Error> {
    if digest_of_stack(file).map_err(of_work)? == digest {
        return Ok(());
    }
    let differs = "it differs from the file of the job: bring it back, or begin another job";
    Err(Error::work(differs).at(file.display().to_string()))
}

fn catalogued<T: Catalogued>(file: &Path, what: &'static str) -> Result<T, Error>
where
    T::CheckError: std::error::Error + Send + Sync + 'static,
{
    let text = sealed_text(file, what).map_err(of_work)?;
    T::from_toml(&text).map_err(|error| of_work(error).at(file.display().to_string()))
}
