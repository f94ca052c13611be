//! A job: a folder that keeps a stack and the results of learning from its prints.
//!
//! ```text
//! job.toml                what the job is for
//! stack.tif               the stack
//! material.toml           its resin
//! print-000.csv           the times of the first print
//! print-000-measured.csv  what was measured on it
//! print-001-state.toml    the state of light and resin that the next print is planned for
//! print-001.csv           the times of the next
//! ```

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use lamp_grayscale::calibrate::{CsvTable, NumberRow};
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::ExposureTime;
use lamp_stack::{Catalogued, Layer, digest_of, sealed, unsealed};
use serde::{Deserialize, Serialize};

use super::error::{JobError, JobFileError};
use super::measured::PrintMeasurements;
use super::state::LightState;
use super::step::{Learned, Lesson};
use crate::light::{Light, SampleHeight};
use crate::speed::{PartPages, Platform, TimedLayer, TimedPart, times_table};

/// Materials and job files are texts of a few kilobytes.
const MAX_FILE: u64 = 1 << 20;
/// Tables of times have a line for each layer.
const MAX_TABLE: u64 = 64 << 20;
const PROFILE: [&str; 5] = ["layer", "z_um", "thickness_um", "exposure_ms", "speed_um_per_s"];

/// The purpose of a job: its stack, and how to plan its prints.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct JobFile {
    /// The name of the part.
    pub part: String,
    /// The digest of the stack's file.
    pub digest: String,
    /// The images' top left corner in part coordinates, if the pages state it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin_mm: Option<[f64; 2]>,
    /// The lowest gray level of pixels that are wanted.
    pub wanted: u8,
    /// The height in each layer at which a voxel's dose is computed.
    pub at: SampleHeight,
    /// The distance from the critical dose that plans keep voxels at, as a share of it.
    pub margin: f64,
    /// The slowest speed of the platform.
    pub slowest_um_per_s: f64,
    /// The fastest speed of the platform.
    pub fastest_um_per_s: f64,
    /// By which share the speeds of neighboring layers may differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_change: Option<f64>,
}

/// A print of a job.
#[derive(Clone, Debug)]
pub struct JobPrint {
    /// The times in seconds, from the light on.
    pub times: Vec<f64>,
    /// The measurements, and their text.
    pub measured: Option<(PrintMeasurements, String)>,
    /// The state of light and resin that it was planned for, if prints had shown one.
    pub state: Option<LightState>,
}

/// A job that is open.
#[derive(Debug)]
pub struct Job {
    folder: PathBuf,
    file: JobFile,
    /// The stack as the model sees it.
    pub part: TimedPart,
    /// The resin at the start.
    pub material: Material,
    /// The model of light and resin.
    pub light: Light,
    /// All prints, the last of which is to be measured.
    pub prints: Vec<JobPrint>,
}

/// Returns the name of the file that has the times of a print.
pub fn profile_name(print: usize) -> String {
    format!("print-{print:03}.csv")
}

/// Reads a text that is short enough to read at once.
fn read_text(file: &Path, max: u64, what: &'static str) -> Result<String, JobFileError> {
    let mut bytes = Vec::new();
    File::open(file)?.take(max + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > max {
        return Err(JobFileError::TooLong { mib: max >> 20, what });
    }
    String::from_utf8(bytes)
        .map_err(|error| JobFileError::NotText(error.utf8_error().valid_up_to()))
}

/// Reads a text of a job that was sealed when it was written. `what` names such texts.
///
/// # Errors
/// Returns an error if it cannot be read, or was changed.
pub fn sealed_text(file: &Path, what: &'static str) -> Result<String, JobError> {
    read_sealed(file, MAX_TABLE, what).map_err(at(file))
}

/// Reads a text that was sealed when it was written.
fn read_sealed(file: &Path, max: u64, what: &'static str) -> Result<String, JobFileError> {
    let text = read_text(file, max, what)?;
    unsealed(&text).map(ToOwned::to_owned).ok_or_else(|| {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        JobFileError::Changed(name.into_owned())
    })
}

/// Returns an error that names a file.
fn at(file: &Path) -> impl Fn(JobFileError) -> JobError {
    move |problem| JobError::File { file: file.to_owned(), problem }
}

impl JobFile {
    /// The name of its file.
    pub const NAME: &'static str = "job.toml";
    /// The name of the job's stack.
    pub const STACK: &'static str = "stack.tif";
    /// The name of the job's material.
    pub const MATERIAL: &'static str = "material.toml";

    /// Reads the purpose of a job's folder.
    ///
    /// # Errors
    /// Returns an error if there is no job, or its file was changed.
    pub fn read(folder: &Path) -> Result<Self, JobError> {
        let file = folder.join(Self::NAME);
        if !file.exists() {
            return Err(JobError::NoJob(folder.to_owned()));
        }
        let text = read_sealed(&file, MAX_FILE, "a job's file");
        let read = text.and_then(|text| Ok(toml::from_str(&text)?));
        read.map_err(at(folder))
    }

    /// Returns the text of its file.
    ///
    /// # Panics
    /// Never: texts and numbers are TOML.
    pub fn to_text(&self) -> String {
        sealed(&toml::to_string(self).expect("texts and numbers are TOML"))
    }
}

/// Returns the digest of a job's stack.
///
/// # Errors
/// Returns an error if it cannot be read.
pub fn digest_of_stack(stack: &Path) -> Result<String, JobError> {
    let digest = File::open(stack).and_then(digest_of);
    digest.map_err(|error: io::Error| at(stack)(error.into()))
}

impl Job {
    /// Opens a job's folder; `layers` reads the layers of a stack.
    ///
    /// # Errors
    /// Returns the errors of `layers`, or an error if a file of the job is missing, was changed or
    /// does not fit the others.
    pub fn open<I, E: From<JobError>>(
        folder: &Path,
        layers: impl FnOnce(&Path) -> Result<I, E>,
    ) -> Result<Self, E>
    where
        I: IntoIterator<Item = Result<Layer, E>>,
    {
        let file = JobFile::read(folder)?;
        let stack = folder.join(JobFile::STACK);
        if digest_of_stack(&stack)? != file.digest {
            return Err(at(&stack)(JobFileError::OtherStack).into());
        }
        let material = read_material(&folder.join(JobFile::MATERIAL))?;
        let light = Light::of(&material, file.at).map_err(JobError::from)?;
        let mut pages = PartPages::new(file.wanted);
        for layer in layers(&stack)? {
            pages.push(layer?).map_err(|error| at(&stack)(error.into()))?;
        }
        let part = pages.finish().map_err(JobError::from)?;
        let mut job =
            Self { folder: folder.to_owned(), file, part, material, light, prints: Vec::new() };
        while job.folder.join(profile_name(job.prints.len())).exists() {
            let print = job.read_print(job.prints.len())?;
            job.prints.push(print);
        }
        if job.prints.is_empty() {
            let (folder, name) = (folder.to_owned(), profile_name(0));
            return Err(JobError::NoPrint { folder, name }.into());
        }
        Ok(job)
    }

    /// Returns a job that is not in a folder.
    #[cfg(test)]
    pub(crate) fn of_part(
        part: TimedPart,
        light: Light,
        material: Material,
        platform: &Platform,
        times: Vec<f64>,
    ) -> Self {
        let file = JobFile {
            part: "a test".to_owned(),
            digest: String::new(),
            origin_mm: Some([0.0; 2]),
            wanted: 128,
            at: light.at,
            margin: 0.05,
            slowest_um_per_s: platform.slowest,
            fastest_um_per_s: platform.fastest,
            max_change: platform.max_change,
        };
        let prints = vec![JobPrint { times, measured: None, state: None }];
        Self { folder: PathBuf::new(), file, part, material, light, prints }
    }

    fn read_print(&self, number: usize) -> Result<JobPrint, JobError> {
        let profile = self.folder.join(profile_name(number));
        let table = read_sealed(&profile, MAX_TABLE, "a table of times").map_err(at(&profile))?;
        let times = self.column_of(&table, &PROFILE, 3).map_err(at(&profile))?;
        let state = self.folder.join(state_name(number));
        let needs_state = table.lines().any(|line| line == planned_for(number));
        if needs_state && !state.exists() {
            return Err(at(&state)(JobFileError::Missing));
        }
        let read_state = || -> Result<_, JobFileError> {
            let text = read_sealed(&state, MAX_TABLE, "a state of light and resin")?;
            Ok(toml::from_str::<LightState>(&text)?)
        };
        let planned_for = state.exists().then(read_state).transpose().map_err(at(&state))?;
        let measured = self.folder.join(measured_name(number));
        // Without a next print, the measurements were kept by a run that did not end.
        let next = self.folder.join(profile_name(number + 1));
        let is_learnt_from = measured.exists() && next.exists();
        let read = || -> Result<_, JobFileError> {
            let text = read_sealed(&measured, MAX_TABLE, "a table of measurements")?;
            Ok((PrintMeasurements::parse(&text)?, text))
        };
        let measured_and_text = is_learnt_from.then(read).transpose().map_err(at(&measured))?;
        if times.iter().any(|ms| *ms <= 0.0) {
            return Err(at(&profile)(JobFileError::NoTime));
        }
        Ok(JobPrint {
            times: times.iter().map(|ms| ms / 1000.0).collect(),
            measured: measured_and_text,
            state: planned_for,
        })
    }

    /// Returns a number of each layer of a table, from the light on.
    fn column_of<const N: usize>(
        &self,
        table: &str,
        columns: &'static [&'static str; N],
        column: usize,
    ) -> Result<Vec<f64>, JobFileError> {
        let rows = CsvTable::parse(table)?.numbers(columns, column + 1)?;
        let layers = self.part.layers();
        let is_layer = |(row, layer): (&NumberRow<N>, &TimedLayer)| {
            row.numbers[0] == Some(f64::from(layer.index))
        };
        if rows.len() != layers.len() || !rows.iter().rev().zip(layers).all(is_layer) {
            return Err(JobFileError::OtherLayers);
        }
        Ok(rows.iter().rev().filter_map(|row| row.numbers[column]).collect())
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

    /// Returns the earlier print whose measurements were the same, word for word.
    pub fn print_measured_as(&self, text: &str) -> Option<usize> {
        let same = |print: &JobPrint| {
            print.measured.as_ref().is_some_and(|(_, known)| is_same_table(known, text))
        };
        self.prints.iter().position(same)
    }

    /// Returns the files that keep the measurements and results, in the order in which they must be
    /// written.
    pub fn files_to_keep(
        &self,
        print: usize,
        text: &str,
        learned: &Learned,
    ) -> Vec<(PathBuf, String)> {
        let file = |name: String, text: &str| (self.folder.join(name), sealed(text));
        let mut files = Vec::new();
        if let Lesson::State(lesson) = &learned.lesson {
            let text = toml::to_string(&lesson.after).expect("numbers are TOML");
            files.push(file(state_name(print + 1), &text));
        }
        let end = if text.ends_with('\n') { "" } else { "\n" };
        files.push(file(measured_name(print), &format!("{text}{end}")));
        // The print exists once its times do.
        files.push(file(profile_name(print + 1), &self.kept_profile(print + 1, learned)));
        files
    }

    /// Returns the table of times that the job keeps. It names the state, so that a missing one is
    /// noticed.
    fn kept_profile(&self, print: usize, learned: &Learned) -> String {
        let table = self.profile(&learned.times);
        match learned.lesson {
            Lesson::State(_) => format!("{table}{}\n", planned_for(print)),
            Lesson::Law { .. } => table,
        }
    }

    /// Goes back to the state before the last print was learned from, if these are its
    /// measurements. Returns its number.
    ///
    /// So a repeated call, after one that did not end, gives the same result.
    pub fn take_back(&mut self, text: &str) -> Option<usize> {
        take_back(&mut self.prints, text, |print| &mut print.measured)
    }

    /// Checks that the repeated results for a print equal the earlier ones.
    ///
    /// # Errors
    /// Returns an error if they differ.
    pub fn check_again(&self, print: usize, learned: &Learned) -> Result<(), JobError> {
        let name = profile_name(print + 1);
        let file = self.folder.join(&name);
        let before = read_sealed(&file, MAX_TABLE, "a table of times").map_err(at(&file))?;
        if before == self.kept_profile(print + 1, learned) {
            return Ok(());
        }
        Err(JobError::OtherOptions { folder: self.folder.clone(), print, name })
    }

    /// Returns the table of times.
    pub fn profile(&self, times: &[f64]) -> String {
        let times: Vec<_> = times.iter().map(|s| ExposureTime::from_ms(s * 1000.0)).collect();
        times_table(&self.part, &times)
    }

    pub(super) fn platform(&self) -> Platform {
        let JobFile { slowest_um_per_s, fastest_um_per_s, max_change, .. } = self.file;
        Platform { slowest: slowest_um_per_s, fastest: fastest_um_per_s, max_change }
    }

    pub(super) fn margin(&self) -> f64 {
        self.file.margin
    }

    /// Returns the name of the part.
    pub(crate) fn part_name(&self) -> &str {
        &self.file.part
    }

    /// Returns the digest of the stack's file.
    pub(crate) fn digest(&self) -> &str {
        &self.file.digest
    }

    pub(crate) fn origin_mm(&self) -> Option<[f64; 2]> {
        self.file.origin_mm
    }
}

fn read_material(file: &Path) -> Result<Material, JobError> {
    let read = || -> Result<Material, JobFileError> {
        let text = read_text(file, MAX_FILE, "a material file")?;
        let material = Material::from_toml(&text)?;
        unsealed(&text).map(|_| material).ok_or(JobFileError::OtherResin)
    };
    read().map_err(at(file))
}

/// Returns the print of a job in a folder that is requested: the last one of `count`, if none is.
///
/// # Errors
/// Returns an error if it was never planned.
pub fn requested_print(
    folder: &Path,
    count: usize,
    asked: Option<usize>,
) -> Result<usize, JobError> {
    let last = count - 1;
    let print = asked.unwrap_or(last);
    match print > last {
        true => Err(JobError::NotPlanned { folder: folder.to_owned(), print, last }),
        false => Ok(print),
    }
}

/// Returns the print of a job in a folder that was measured: the last one of `count`, unless another is
/// requested.
///
/// # Errors
/// Returns an error if it is not the last.
pub fn print_to_learn_from(
    folder: &Path,
    count: usize,
    asked: Option<usize>,
) -> Result<usize, JobError> {
    let (print, last) = (requested_print(folder, count, asked)?, count - 1);
    match print < last {
        true => Err(JobError::LearntFrom { folder: folder.to_owned(), print, last }),
        false => Ok(print),
    }
}

/// Goes back to the prints before the last one was learned from, if these are its measurements. Returns
/// its number.
pub fn take_back<P>(
    prints: &mut Vec<P>,
    text: &str,
    measured: impl Fn(&mut P) -> &mut Option<(PrintMeasurements, String)>,
) -> Option<usize> {
    let print = prints.len().checked_sub(2)?;
    let of_print = measured(&mut prints[print]);
    if !is_same_table(&of_print.as_ref()?.1, text) {
        return None;
    }
    *of_print = None;
    prints.truncate(print + 1);
    Some(print)
}

/// Returns true if two tables are the same, except for blank lines at the end.
fn is_same_table(a: &str, b: &str) -> bool {
    a.trim_end() == b.trim_end()
}

/// Returns the name of the file that has the measurements of a print.
pub fn measured_name(print: usize) -> String {
    format!("print-{print:03}-measured.csv")
}

/// Returns the line of a table of times that were planned for a state.
fn planned_for(print: usize) -> String {
    format!("# planned for {}", state_name(print))
}

fn state_name(print: usize) -> String {
    format!("print-{print:03}-state.toml")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_that_was_changed_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let none = JobFile::read(folder.path());
        assert!(matches!(none, Err(JobError::NoJob(_))));
        let job = JobFile {
            part: "blade".to_owned(),
            digest: "blake3:00".to_owned(),
            origin_mm: None,
            wanted: 128,
            at: SampleHeight::Middle,
            margin: 0.05,
            slowest_um_per_s: 5.0,
            fastest_um_per_s: 2000.0,
            max_change: Some(0.2),
        };
        let (file, text) = (folder.path().join(JobFile::NAME), job.to_text());
        assert!(text.contains("at = \"middle\""), "{text}");
        std::fs::write(&file, &text).unwrap();
        assert_eq!(JobFile::read(folder.path()).unwrap(), job);
        std::fs::write(&file, text.replace("128", "100")).unwrap();
        let changed = JobFile::read(folder.path()).unwrap_err().to_string();
        assert!(changed.ends_with("bring it back, or begin another job"), "{changed}");
    }
}
