//! Folders of jobs: the job, its tables, and the machine that it was made for.

use std::fs;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

use lamp_machine::{LightTable, Machine, Scan, ScanLight};
use lamp_stack::{Catalogued, FolderBeside};

use crate::error::GantryError;
use crate::job::{Job, JobLayer};
use crate::mirrors::MirrorArray;
use crate::source::BuildPages;

const JOB: &str = "job.json";
const MACHINE: &str = "machine.toml";
const LIGHT: &str = "light.csv";

/// The greatest size of a job's file: 2000 layers of 10,000 swaths take about 4 GB as text, and no
/// machine has so many.
const MAX_JOB_BYTES: u64 = 1 << 30;

/// A job that was read from its folder.
#[derive(Debug)]
pub struct JobFolder {
    /// The job.
    pub job: Job,
    /// The machine that it was made for.
    pub machine: Machine,
    /// The machine's mirrors.
    pub mirrors: MirrorArray,
    path: PathBuf,
}

impl JobFolder {
    /// Writes a job, its tables `layers.csv` and `swaths.csv`, the machine's file as it was read, and
    /// the light of the mirrors. The folder gets its name when it is complete.
    ///
    /// # Errors
    /// Returns an error if a file cannot be written.
    pub fn write(
        folder: FolderBeside,
        job: &Job,
        machine: &str,
        light: Option<&LightTable>,
    ) -> Result<(), GantryError> {
        let add = |name: &str, text: &str| {
            folder.add::<io::Error>(name, |out| out.write_all(text.as_bytes()))
        };
        folder.add::<io::Error>(JOB, |out| {
            serde_json::to_writer(&mut *out, job)?;
            writeln!(out)
        })?;
        add("layers.csv", &job.layers_csv())?;
        add("swaths.csv", &job.swaths_csv())?;
        add(MACHINE, machine)?;
        if let Some(light) = light {
            folder.add::<io::Error>(LIGHT, |out| {
                for row in light.values.chunks(light.mirrors[0] as usize) {
                    let row: Vec<String> = row.iter().map(ToString::to_string).collect();
                    writeln!(out, "{}", row.join(","))?;
                }
                Ok(())
            })?;
        }
        Ok(folder.persist()?)
    }

    /// Reads a job from its folder.
    ///
    /// # Errors
    /// Returns an error if a file is missing, or is not as a job's.
    pub fn open(path: &Path) -> Result<Self, GantryError> {
        let failed =
            |name: &str, problem: String| GantryError::Job { path: path.join(name), problem };
        if !Self::is_job(path) {
            let problem = "this is no folder of lamp job: it has no job.json".to_owned();
            return Err(GantryError::Job { path: path.to_owned(), problem });
        }
        let text = |name: &str, most: u64| -> Result<String, GantryError> {
            let mut text = String::new();
            let read = fs::File::open(path.join(name))
                .and_then(|file| file.take(most + 1).read_to_string(&mut text));
            match read {
                Ok(bytes) if bytes as u64 <= most => Ok(text),
                Ok(_) => Err(failed(name, format!("it has more than {most} bytes"))),
                Err(error) => Err(failed(name, error.to_string())),
            }
        };
        let job = Job::read(&text(JOB, MAX_JOB_BYTES)?, &path.join(JOB))?;
        let machine = Machine::from_toml(&text(MACHINE, 1 << 20)?)
            .map_err(|error| failed(MACHINE, error.to_string()))?;
        let Some(scan) = &machine.scan else {
            return Err(GantryError::NoScan { machine: machine.name });
        };
        if scan.mirrors() != job.mirrors {
            return Err(failed(JOB, format!("its mirrors differ from the mirrors of {MACHINE}")));
        }
        let light = match &scan.light {
            None => None,
            Some(light) => {
                let copy = ScanLight { file: LIGHT.into(), source: light.source.clone() };
                let read = copy.read(path, job.mirrors);
                Some(read.map_err(|error| failed(LIGHT, error.to_string()))?)
            }
        };
        let mirrors = MirrorArray::of(scan, light.as_ref())?;
        Ok(Self { job, machine, mirrors, path: path.to_owned() })
    }

    /// Returns whether a folder holds a job.
    pub fn is_job(path: &Path) -> bool {
        path.join(JOB).is_file()
    }

    /// Opens the build that the job was made for, and proves it by its digest.
    ///
    /// # Errors
    /// Returns an error if the build cannot be read, or is another one.
    pub fn build(&self) -> Result<BuildPages, GantryError> {
        let path = self.path.join(&self.job.build);
        let pages = BuildPages::open(&path)
            .map_err(|error| GantryError::Build { path: path.clone(), error: error.into() })?;
        if pages.digest()? != self.job.build_digest {
            return Err(GantryError::OtherBuild { path });
        }
        match self.difference(&pages) {
            None => Ok(pages),
            Some(problem) => Err(GantryError::Job { path: self.path.join(JOB), problem }),
        }
    }

    /// Returns how the job's facts of the build differ from the build, if they do.
    fn difference(&self, pages: &BuildPages) -> Option<String> {
        let job = &self.job;
        if job.pixels != pages.size() {
            return Some(format!(
                "its pixels are {:?}, and the build has {:?}",
                job.pixels,
                pages.size()
            ));
        }
        let pitch_um = pages.dpi().pitch().um();
        if (job.pitch_um - pitch_um).abs() > 1e-6 * pitch_um {
            return Some(format!(
                "its pitch is {} um, and the build has {pitch_um} um",
                job.pitch_um
            ));
        }
        let usual_ms = self
            .machine
            .times
            .as_ref()
            .and_then(|times| times.expose_s)
            .map(|seconds| seconds * 1000.0);
        job.layers.iter().find_map(|layer| {
            let JobLayer { layer: index, page, exposure_ms, .. } = *layer;
            let header = pages.headers().get(page).filter(|header| header.info.index == index);
            let Some(header) = header else {
                return Some(format!("page {page} of the build is not layer {index}"));
            };
            let wanted_ms = header.info.exposure_ms.or(usual_ms);
            wanted_ms.filter(|wanted| (wanted - exposure_ms).abs() > 1e-6 * wanted).map(|wanted| {
                format!("layer {index} has {exposure_ms} ms, and the build states {wanted} ms")
            })
        })
    }
}

impl MirrorArray {
    /// Returns the mirrors of a scan, with the light that was read from its file.
    ///
    /// # Errors
    /// Returns an error if a column has no light that can be switched.
    pub fn of(scan: &Scan, light: Option<&LightTable>) -> Result<Self, GantryError> {
        let [across, along] = scan.mirrors();
        let (dead, stuck) = match &scan.faults {
            Some(faults) => (&faults.dead[..], &faults.stuck[..]),
            None => (&[][..], &[][..]),
        };
        if light.is_none() && dead.is_empty() && stuck.is_empty() {
            return Ok(Self::even(across, along));
        }
        let even;
        let light = match light {
            Some(light) => &light.values[..],
            None => {
                even = vec![1.0; across as usize * along as usize];
                &even
            }
        };
        Ok(Self::uneven([across, along], light, dead, stuck)?)
    }
}

/// Returns the name of a file or folder as seen from another folder, both of which exist.
///
/// # Errors
/// Returns an error if one of them cannot be looked up.
pub fn seen_from(folder: &Path, path: &Path) -> io::Result<PathBuf> {
    let (folder, path) = (folder.canonicalize()?, path.canonicalize()?);
    let same = folder.components().zip(path.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(same).map(|_| Component::ParentDir);
    Ok(up.chain(path.components().skip(same)).collect())
}
