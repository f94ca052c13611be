//! A job: a folder that keeps a stack and what was learnt from its prints.
//!
//! ```text
//! job.toml                what the job is for
//! stack.tif               the stack
//! material.toml           its resin
//! print-000.csv           the times of the first print
//! print-000-measured.csv  what was measured on it
//! print-001-doses.csv     by what measured heights correct the doses
//! print-001.csv           the times of the next
//! ```

use std::fs::File;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use lamp_grayscale::calibrate::{CsvTable, NumberRow};
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::ExposureTime;
use lamp_planning::speed::{PartLayer, PartPages, Platform, TimedPart};
use lamp_planning::{Light, SampleHeight};
use lamp_stack::{digest_of, sealed, unsealed};
use serde::{Deserialize, Serialize};

use super::measured::Measured;
use super::step::Learned;
use crate::catalogue::read_text;
use crate::commands::plan::profile_of;
use crate::exit::Exit;
use crate::progress::Progress;
use crate::streams::{read_beside, write_file};
use lamp_pipeline::documents::read_file;
use lamp_pipeline::words;

pub(super) const JOB: &str = "job.toml";
pub(super) const STACK: &str = "stack.tif";
pub(super) const MATERIAL: &str = "material.toml";
/// Tables of times have a line for each layer.
const MAX_TABLE: u64 = 64 << 20;
const PROFILE: [&str; 5] = ["layer", "z_um", "thickness_um", "exposure_ms", "speed_um_per_s"];
const DOSES: [&str; 2] = ["layer", "log_dose"];

/// What a job is for.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JobFile {
    pub(super) part: String,
    /// The digest of the stack's file.
    pub(super) digest: String,
    /// The images' top left corner in part coordinates, if the pages state it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) origin_mm: Option<[f64; 2]>,
    pub(super) wanted: u8,
    #[serde(with = "words::text")]
    pub(super) at: SampleHeight,
    pub(super) margin: f64,
    pub(super) slowest_um_per_s: f64,
    pub(super) fastest_um_per_s: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) max_change: Option<f64>,
}

/// A print of a job.
#[derive(Clone, Debug)]
pub(super) struct Print {
    /// The times in seconds, from the light on.
    pub(super) times: Vec<f64>,
    /// What was measured, and its text.
    pub(super) measured: Option<(Measured, String)>,
    /// What heights had taught before, from the light on.
    pub(super) log_doses: Vec<f64>,
}

/// A job that is open.
pub(super) struct Job {
    folder: PathBuf,
    file: JobFile,
    pub(super) part: TimedPart,
    pub(super) material: String,
    pub(super) light: Light,
    pub(super) prints: Vec<Print>,
}

pub(super) fn profile_name(print: usize) -> String {
    format!("print-{print:03}.csv")
}

pub(super) fn digest_of_file(file: &Path) -> Result<String, Exit> {
    let digest = File::open(file).and_then(digest_of);
    Ok(digest.with_context(|| file.display().to_string())?)
}

/// Reads a text that this command sealed.
fn read_sealed(file: &Path, max: u64, what: &str) -> anyhow::Result<String> {
    let text = read_text(file, max, what)?;
    unsealed(&text).map(ToOwned::to_owned).ok_or_else(|| {
        let name = file.file_name().unwrap_or_default().display();
        anyhow!("{name} is not as lamp learn wrote it: bring it back, or begin another job")
    })
}

pub(super) fn read_job(folder: &Path) -> Result<JobFile, Exit> {
    let file = folder.join(JOB);
    let read = || -> anyhow::Result<JobFile> {
        if !file.exists() {
            return Err(anyhow!("there is no job: begin it with --start STACK --material M"));
        }
        Ok(toml::from_str(&read_sealed(&file, 1 << 20, "a job's file")?)?)
    };
    Ok(read().with_context(|| folder.display().to_string())?)
}

impl Job {
    /// Opens a job's folder.
    pub(super) fn open(folder: &Path, progress: &Progress) -> Result<Self, Exit> {
        let file = read_job(folder)?;
        let stack = folder.join(STACK);
        if digest_of_file(&stack)? != file.digest {
            let text = "this is not the stack that the job was begun with: begin another job";
            return Err(Exit::Failed(anyhow!(text)).at(stack.display().to_string()));
        }
        let (material, text) = read_file::<Material>(&folder.join(MATERIAL))?;
        if unsealed(&text).is_none() {
            let text = "this is not the resin that the job was begun with: begin another job";
            return Err(Exit::Failed(anyhow!(text)).at(folder.join(MATERIAL).display().to_string()));
        }
        let light = Light::of(&material, file.at)?;
        let mut pages = PartPages::new(file.wanted);
        for layer in read_beside(&stack)? {
            let place = || stack.display().to_string();
            pages.push(layer?).map_err(|error| Exit::from(error).at(place()))?;
        }
        progress.done();
        let part = pages.finish()?;
        let material = material.name.clone();
        let mut job =
            Self { folder: folder.to_owned(), file, part, material, light, prints: Vec::new() };
        while job.folder.join(profile_name(job.prints.len())).exists() {
            let print = job.read_print(job.prints.len())?;
            job.prints.push(print);
        }
        if job.prints.is_empty() {
            let text = format!("there is no {}: begin the job again", profile_name(0));
            return Err(Exit::Failed(anyhow!(text)).at(folder.display().to_string()));
        }
        Ok(job)
    }

    fn read_print(&self, number: usize) -> Result<Print, Exit> {
        let times = self.read_column(&profile_name(number), &PROFILE, 3)?;
        let doses = doses_name(number);
        let log_doses = if self.folder.join(&doses).exists() {
            self.read_column(&doses, &DOSES, 1)?
        } else {
            vec![0.0; times.len()]
        };
        let measured = self.folder.join(measured_name(number));
        // Without a next print, what was measured was kept by a run that did not end.
        let next = self.folder.join(profile_name(number + 1));
        let is_learnt_from = measured.exists() && next.exists();
        let read = || -> anyhow::Result<_> {
            let text = read_sealed(&measured, MAX_TABLE, "a table of measurements")?;
            Ok((Measured::parse(&text)?, text))
        };
        let measured = is_learnt_from.then(read).transpose();
        let measured = measured.map_err(|error| self.failed(&measured_name(number), error))?;
        if times.iter().any(|ms| *ms <= 0.0) {
            let text = "exposure_ms must be above zero".to_owned();
            return Err(self.failed(&profile_name(number), anyhow!(text)));
        }
        Ok(Print { times: times.iter().map(|ms| ms / 1000.0).collect(), measured, log_doses })
    }

    /// Reads a number of each layer, from the light on.
    fn read_column<const N: usize>(
        &self,
        name: &str,
        columns: &'static [&'static str; N],
        column: usize,
    ) -> Result<Vec<f64>, Exit> {
        let read = || -> anyhow::Result<Vec<f64>> {
            let text = read_sealed(&self.folder.join(name), MAX_TABLE, "a table of times")?;
            let rows = CsvTable::parse(&text)?.numbers(columns, column + 1)?;
            let layers = self.part.layers();
            let is_layer = |(row, layer): (&NumberRow<N>, &PartLayer)| {
                row.numbers[0] == Some(f64::from(layer.index))
            };
            if rows.len() != layers.len() || !rows.iter().rev().zip(layers).all(is_layer) {
                return Err(anyhow!("its layers are not those of the job's stack"));
            }
            Ok(rows.iter().rev().filter_map(|row| row.numbers[column]).collect())
        };
        read().map_err(|error| self.failed(name, error))
    }

    fn failed(&self, name: &str, error: anyhow::Error) -> Exit {
        Exit::Failed(error).at(self.folder.join(name).display().to_string())
    }

    /// Returns the print that was measured.
    pub(super) fn print_to_learn_from(&self, asked: Option<usize>) -> Result<usize, Exit> {
        let last = self.prints.len() - 1;
        let number = asked.unwrap_or(last);
        let place = self.folder.display();
        if number > last {
            return Err(Exit::Failed(anyhow!(
                "{place}: print {number} was never planned, and so not printed: the last is {last}"
            )));
        }
        if number < last {
            return Err(Exit::Failed(anyhow!(
                "{place}: print {number} was learnt from already: print {last} is the last"
            )));
        }
        Ok(number)
    }

    /// Refuses what was given for an earlier print, word for word.
    pub(super) fn refuse_known(&self, print: usize, text: &str) -> Result<(), Exit> {
        let same =
            |print: &Print| print.measured.as_ref().is_some_and(|(_, known)| is_same(known, text));
        match self.prints.iter().position(same) {
            Some(earlier) => Err(Exit::Failed(anyhow!(
                "{}: these are the measurements of print {earlier}, given twice: measure print \
                 {print}",
                self.folder.display()
            ))),
            None => Ok(()),
        }
    }

    /// Keeps what was measured and learnt.
    pub(super) fn keep(&self, print: usize, text: &str, learned: &Learned) -> Result<(), Exit> {
        let put = |name: String, text: &str| {
            write_file(&self.folder.join(name), |out| out.write_all(text.as_bytes()))
        };
        if learned.log_doses.iter().any(|&log| log != 0.0) {
            put(doses_name(print + 1), &sealed(&self.doses(learned)))?;
        }
        let end = if text.ends_with('\n') { "" } else { "\n" };
        put(measured_name(print), &sealed(&format!("{text}{end}")))?;
        // The print is there once its times are.
        put(profile_name(print + 1), &sealed(&self.profile(&learned.times)))
    }

    fn doses(&self, learned: &Learned) -> String {
        let layers = self.part.layers().iter().zip(&learned.log_doses).rev();
        let lines = layers.map(|(layer, log_dose)| format!("{},{log_dose}\n", layer.index));
        format!("{}\n{}", DOSES.join(","), lines.collect::<String>())
    }

    /// Goes back to where the last print was still to be learnt from, if these are its measurements.
    /// Returns its number.
    ///
    /// So the same call again, after one that did not end, gives the same.
    pub(super) fn take_back(&mut self, text: &str) -> Option<usize> {
        let print = self.prints.len().checked_sub(2)?;
        let (_, known) = self.prints[print].measured.as_ref()?;
        if !is_same(known, text) {
            return None;
        }
        self.prints.truncate(print + 1);
        self.prints[print].measured = None;
        Some(print)
    }

    /// Checks that what is learnt from a print again is what was learnt before.
    pub(super) fn check_again(&self, print: usize, learned: &Learned) -> Result<(), Exit> {
        let name = profile_name(print + 1);
        let before = read_sealed(&self.folder.join(&name), MAX_TABLE, "a table of times");
        let before = before.map_err(|error| self.failed(&name, error))?;
        if before == self.profile(&learned.times) {
            return Ok(());
        }
        let text = anyhow!(
            "print {print} was learnt from with other options: {name} is there already, and print \
             {} is the next to be measured",
            print + 1
        );
        Err(Exit::Failed(text).at(self.folder.display().to_string()))
    }

    /// Returns the table of times.
    pub(super) fn profile(&self, times: &[f64]) -> String {
        let times: Vec<_> = times.iter().map(|s| ExposureTime::from_ms(s * 1000.0)).collect();
        profile_of(&self.part, &times)
    }

    pub(super) fn platform(&self) -> Platform {
        let JobFile { slowest_um_per_s, fastest_um_per_s, max_change, .. } = self.file;
        Platform { slowest: slowest_um_per_s, fastest: fastest_um_per_s, max_change }
    }

    pub(super) fn margin(&self) -> f64 {
        self.file.margin
    }

    pub(super) fn origin_mm(&self) -> Option<[f64; 2]> {
        self.file.origin_mm
    }
}

/// Returns true if two tables are the same, except for blank lines at the end.
fn is_same(a: &str, b: &str) -> bool {
    a.trim_end() == b.trim_end()
}

fn measured_name(print: usize) -> String {
    format!("print-{print:03}-measured.csv")
}

fn doses_name(print: usize) -> String {
    format!("print-{print:03}-doses.csv")
}
