//! Jobs of column cure: a plan, its prints, and what their heights show.
//!
//! ```text
//! job.toml                what the job is for: its part, its settings
//! target.png              the wanted heights
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
use lamp_grayscale::resin::ExposureTime;
use lamp_planning::column::Setup;
use lamp_planning::learn::{
    ColumnFit, ColumnLight, Columns, HeightRow, JobError, JobFile, LightState, PrintMeasurements,
    digest_of_stack, measured_name, print_to_learn_from, requested_print, sealed_text, take_back,
};
use lamp_planning::projector::Projector;
use lamp_planning::target::{Grid, HeightMap, MapScale, Target, TargetOptions};
use lamp_planning::{MirrorSeconds, ShownBitmap};
use lamp_stack::{Catalogued, Length, Page, sealed};
use serde::{Deserialize, Serialize};

use super::column_cure::{ColumnCure, ColumnCureSettings, PlanInputs, flat_field};
use super::target::of_work;
use crate::documents::open_stack;
use crate::error::Error;
use crate::watcher::Watcher;

const PROJECTOR: &str = "projector.toml";

/// The purpose of a job of column cure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ColumnJobFile {
    kind: Kind,
    /// The name of the part.
    part: String,
    /// The digest of the target's file.
    target_digest: String,
    /// The settings of the plan.
    plan: ColumnCureSettings,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    ColumnCure,
}

/// The record of a print.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PrintFile {
    /// The digest of its bitmaps.
    bitmaps: String,
    /// The state that they are planned for, if prints had shown one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    state: Option<LightState>,
}

/// A print of a job.
#[derive(Clone, Debug)]
pub struct ColumnJobPrint {
    /// The light of its bitmaps.
    pub light: ColumnLight,
    /// How long all bitmaps take, in seconds.
    pub seconds: f64,
    /// The measurements, and their text.
    pub measured: Option<(PrintMeasurements, String)>,
    /// The state that it was planned for, if prints had shown one.
    pub state: Option<LightState>,
}

/// A job of column cure that is open.
#[derive(Debug)]
pub struct ColumnJob {
    folder: PathBuf,
    file: ColumnJobFile,
    /// The target, the projector and the resin at the start.
    pub columns: Columns,
    /// All prints, the last of which is to be measured.
    pub prints: Vec<ColumnJobPrint>,
}

/// The state that the prints show, and the next plan.
#[derive(Debug)]
pub struct ColumnLesson {
    /// The state before the print was measured.
    pub before: LightState,
    /// The state after.
    pub fit: ColumnFit,
    /// The standard deviation of the heights in micrometers, as their residuals show it.
    pub noise_um: f64,
    /// The next plan.
    pub next: ColumnCure,
    /// The root mean square error that the next print is expected to have, measured at the same
    /// places, in micrometers: its mean, and the ends of the interval of 95 % of the states.
    pub expected_um: [f64; 3],
}

/// Returns true if a folder has a job of column cure.
pub fn is_column_job(folder: &Path) -> bool {
    read_job_file(folder).is_ok()
}

fn read_job_file(folder: &Path) -> Result<ColumnJobFile, Error> {
    let file = folder.join(JobFile::NAME);
    if !file.exists() {
        return Err(of_work(JobError::NoJob(folder.to_owned())));
    }
    parsed(&file, "a job's file")
}

/// Reads a sealed file.
fn parsed<T: serde::de::DeserializeOwned>(file: &Path, what: &'static str) -> Result<T, Error> {
    let text = sealed_text(file, what).map_err(of_work)?;
    toml::from_str(&text).map_err(|error| of_work(error).at(file.display().to_string()))
}

fn bitmaps_name(print: usize) -> String {
    format!("print-{print:03}.tif")
}

fn record_name(print: usize) -> String {
    format!("print-{print:03}.toml")
}

impl ColumnJob {
    /// The least deviation of a height map's pixels, in micrometers: the residuals of the fit raise
    /// it.
    pub const MAP_SD_UM: f64 = 0.1;

    /// Returns the files of a new job of a plan's folder, by their names, for a projector and a
    /// material.
    ///
    /// # Errors
    /// Returns an error if the folder lacks a file, or if the material does not state how deep a
    /// dose cures.
    pub fn begun(
        plan: &Path,
        projector: &Projector,
        material: &Material,
    ) -> Result<Vec<(String, Vec<u8>)>, Error> {
        let at = |name: &str| plan.join(name);
        let read = |name: &str| {
            let file = at(name);
            fs::read(&file).map_err(|error| Error::from(error).at(file.display().to_string()))
        };
        lamp_planning::column::HeightCurve::of(material).map_err(of_work)?;
        let settings = at(PlanInputs::SETTINGS);
        if !settings.exists() {
            let (plan, file) = (plan.display(), PlanInputs::SETTINGS);
            return Err(Error::work(format!(
                "{plan}: there is no {file}: plan again by lamp plan column-cure, which writes it"
            )));
        }
        let text = crate::documents::read_text(&settings, 1 << 20, "a plan's settings")?;
        let settings: ColumnCureSettings = toml::from_str(&text)
            .map_err(|error| of_work(error).at(settings.display().to_string()))?;
        let bitmaps = at("bitmaps.tif");
        let part = part_of(&bitmaps)?;
        let target = read(PlanInputs::TARGET)?;
        let file = ColumnJobFile {
            kind: Kind::ColumnCure,
            part,
            target_digest: digest_of_stack(&at(PlanInputs::TARGET)).map_err(of_work)?,
            plan: settings,
        };
        let record =
            PrintFile { bitmaps: digest_of_stack(&bitmaps).map_err(of_work)?, state: None };
        let mut files = vec![(PlanInputs::TARGET.to_owned(), target)];
        if file.plan.flat_field.is_some() {
            files.push((PlanInputs::FLAT_FIELD.to_owned(), read(PlanInputs::FLAT_FIELD)?));
        }
        let text = |text: Result<String, toml::ser::Error>| -> Result<Vec<u8>, Error> {
            Ok(sealed(&text.map_err(of_work)?).into_bytes())
        };
        files.extend([
            (JobFile::NAME.to_owned(), text(toml::to_string(&file))?),
            (JobFile::MATERIAL.to_owned(), text(toml::to_string(material))?),
            (PROJECTOR.to_owned(), text(toml::to_string(projector))?),
            (bitmaps_name(0), read("bitmaps.tif")?),
            (record_name(0), text(toml::to_string(&record))?),
        ]);
        Ok(files)
    }

    /// Opens a job's folder.
    ///
    /// # Errors
    /// Returns an error if a file of the job is missing, was changed or does not fit the others.
    pub fn open(folder: &Path) -> Result<Self, Error> {
        let mut file = read_job_file(folder)?;
        let at = |name: &str| folder.join(name);
        let target = at(PlanInputs::TARGET);
        check_digest(&target, &file.target_digest)?;
        let material = catalogued::<Material>(&at(JobFile::MATERIAL), "a material file")?;
        let projector = catalogued::<Projector>(&at(PROJECTOR), "a projector file")?;
        file.plan.target.target = target;
        if file.plan.flat_field.is_some() {
            file.plan.flat_field = Some(at(PlanInputs::FLAT_FIELD));
        }
        let wanted = wanted_of(&file.plan, &projector)?;
        let columns = Columns { projector, material, wanted, tracing: file.plan.rays };
        let mut job = Self { folder: folder.to_owned(), file, columns, prints: Vec::new() };
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

    fn read_print(&self, number: usize) -> Result<ColumnJobPrint, Error> {
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
        Ok(ColumnJobPrint { light, seconds, measured, state: record.state })
    }

    /// Returns the light of bitmaps, and how long all take, in seconds.
    fn shown(&self, path: &Path) -> Result<(ColumnLight, f64), Error> {
        let named = |error: Error| error.at(path.display().to_string());
        let mut bitmaps: Vec<ShownBitmap> = Vec::new();
        let display = &self.columns.projector.display;
        for page in open_stack(path)? {
            let layer = page.and_then(Page::decode).map_err(|error| named(error.into()))?;
            let time = ExposureTime::from_ms(layer.info.exposure_ms.unwrap_or_default());
            let image = layer.image.into_image();
            if [image.width(), image.height()] != [display.columns, display.rows] {
                let (width, height) = (image.width(), image.height());
                return Err(named(Error::work(format!(
                    "{width} x {height} pixels, but the display of {} has {} x {} mirrors",
                    self.columns.projector.name, display.columns, display.rows
                ))));
            }
            bitmaps.push(ShownBitmap { image, time });
        }
        let seconds = bitmaps.iter().map(|bitmap| bitmap.time.ms()).sum::<f64>() / 1000.0;
        let projector = &self.columns.projector;
        let shown = MirrorSeconds::of(&bitmaps, |level| projector.share(level));
        let flat_field = match &self.file.plan.flat_field {
            Some(path) => {
                let of_display =
                    Setup::of(projector, &self.columns.wanted.grid, self.columns.tracing);
                let setup = Setup { mirrors: shown.mirrors, ..of_display };
                flat_field(path, &setup).map_err(|error| error.at(path.display().to_string()))?
            }
            None => Vec::new(),
        };
        Ok((ColumnLight { shown, flat_field }, seconds))
    }

    /// Returns the name of the part.
    pub fn part(&self) -> &str {
        &self.file.part
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
            // Light reaches no pixel beyond the columns.
            let Some(column) = self.columns.column_at(place_mm) else { continue };
            rows.push(HeightRow {
                line: rows.len() + 2,
                place_mm,
                z_mm: rounded_mm(self.columns.wanted.heights_um[column]),
                measured_mm: rounded_mm(*um),
                sd_um: Self::MAP_SD_UM,
            });
        }
        Ok(PrintMeasurements::Heights(rows))
    }

    /// Learns from the measurements of a print, and plans the next.
    ///
    /// # Errors
    /// Returns an error if these are not heights of columns, or if there is no plan.
    pub fn learn(
        &self,
        print: usize,
        measured: &PrintMeasurements,
        watcher: &dyn Watcher,
    ) -> Result<ColumnLesson, Error> {
        let PrintMeasurements::Heights(rows) = measured else {
            return Err(Error::work("a plan of columns learns from heights, not from layers"));
        };
        let earlier = self.prints[..print].iter().filter_map(|print| match &print.measured {
            Some((PrintMeasurements::Heights(rows), _)) => Some((&print.light, &rows[..])),
            _ => None,
        });
        let all: Vec<_> = earlier.chain([(&self.prints[print].light, &rows[..])]).collect();
        let fit = self.columns.fit(&all).map_err(of_work)?;
        let Columns { projector, material, .. } = self.columns.in_state(&fit.state);
        let words = (projector.name.clone(), material.name.clone());
        let mut next =
            self.file.plan.plan_for((projector, words.0), (material, words.1), watcher)?;
        next.target.clone_from(&self.file.part);
        next.command = format!("lamp learn --print {print}");
        // The next plan's folder is one that a job can begin with.
        next.inputs.settings.projector.clone_from(&self.file.plan.projector);
        next.inputs.settings.material.clone_from(&self.file.plan.material);
        let setup = next.light.setup();
        let shown = MirrorSeconds { mirrors: setup.mirrors, seconds: next.plan.seconds.clone() };
        let light = ColumnLight { shown, flat_field: setup.flat_field.clone() };
        let expected_um = self.columns.expected_um(&fit, &light, rows).map_err(of_work)?;
        let squares: f64 = rows.iter().map(|row| row.sd_um * row.sd_um).sum();
        let noise_um = fit.misfit * (squares / rows.len().max(1) as f64).sqrt();
        let before = self.prints[print].state.clone();
        let before = before.unwrap_or_else(|| {
            LightState::of_glass(&self.columns.projector, &self.columns.material)
        });
        Ok(ColumnLesson { before, fit, noise_um, next, expected_um })
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
        lesson: &ColumnLesson,
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
    pub fn check_again(&self, print: usize, lesson: &ColumnLesson) -> Result<(), Error> {
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

/// Returns the target's columns, with room for the projector's light around it.
fn wanted_of(plan: &ColumnCureSettings, projector: &Projector) -> Result<HeightMap, Error> {
    let scale = plan.target.pixel.zip(plan.target.full);
    let scale = scale.map(|(pixel, full)| MapScale { pixel, full });
    let options = TargetOptions { scale, ..TargetOptions::default() };
    let named = |error: Error| error.at(plan.target.target.display().to_string());
    let target =
        Target::open(&plan.target.target, &options).map_err(|error| named(of_work(error)))?;
    let voxel = plan.voxel.unwrap_or_else(|| Length::from_um(projector.pitch.value.um()));
    let grid = Setup::grid_around(projector, target.size(), voxel)
        .map_err(|error| named(of_work(error)))?;
    target.heights(&grid).map_err(|error| named(of_work(error)))
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
