//! `lamp doctor`: describes the program and its machine, for a report of a fault.

use std::env;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Instant;

use anyhow::{Context, anyhow};
use clap::Args;
use lamp_pipeline::memory::{available, in_words};
use serde::Serialize;

use crate::commands::config::ConfigAnswer;
use crate::exit::Exit;
use crate::output::json_report::{print_answer, schemas};
use crate::started;
use crate::streams::print;
use crate::terminal::help::LONG_VERSION;
use crate::terminal::progress::printable;

/// Describe this program and machine: versions, memory, disks, browser, schedulers
///
/// Put its text into a report of a fault. It writes small files into the current folder and the
/// folder of temporary files, tries their disks, and removes the files.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp doctor
  lamp doctor > doctor.txt
  lamp doctor --json

Exit status: 0 if all that commands need works, 1 otherwise.")]
pub(crate) struct DoctorArgs {
    /// Print JSON, as docs/json.md describes it
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &DoctorArgs) -> Result<(), Exit> {
    let (found, faults) = DoctorAnswer::found();
    match args.json {
        true => print_answer("lamp-doctor-1", &found)?,
        false => print(&found.text())?,
    }
    match faults {
        0 => Ok(()),
        1 => Err(Exit::Failed(anyhow!("1 fault"))),
        _ => Err(Exit::Failed(anyhow!("{faults} faults"))),
    }
}

/// The program and its machine, by `lamp doctor --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct DoctorAnswer {
    /// Version of the program.
    version: &'static str,
    /// Commit that it was built from.
    commit: &'static str,
    /// Target that it was built for.
    target: &'static str,
    /// Features that it was built with.
    features: &'static str,
    /// File of the program; null if the system does not name it.
    program: Option<String>,
    /// The operating system, as it names itself.
    system: String,
    /// Processors that the program may use.
    processors: usize,
    /// Memory that the program may use, in bytes.
    memory_bytes: u64,
    /// Kernels that read STEP files.
    step_kernels: &'static [&'static str],
    /// Folders in which it tried what commands do with files.
    folders: Vec<TriedFolder>,
    /// File of the browser that `lamp view --open` starts; null if none is found.
    browser: Option<String>,
    /// Files of schedulers' programs, if they are found.
    schedulers: Schedulers,
    /// Where options, machines, materials and projectors come from.
    config: ConfigAnswer,
}

/// Schedulers that run tasks of batches.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Schedulers {
    /// File of `sbatch`; null if it is not found.
    slurm: Option<String>,
    /// File of `hq`; null if it is not found.
    hyperqueue: Option<String>,
}

/// A folder and its disk.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct TriedFolder {
    /// `current folder` or `temporary files`.
    name: &'static str,
    /// Its path; null if it is not known.
    path: Option<String>,
    /// Properties of its disk; null with a fault.
    disk: Option<TriedDisk>,
    /// The fault, as a sentence.
    fault: Option<String>,
}

/// Properties of a disk.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct TriedDisk {
    /// Free space, in bytes.
    free_bytes: u64,
    /// Whether locks of files work.
    locks_work: bool,
    /// Whether a file can be replaced while a program has it open.
    replaces_open_files: bool,
    /// Time in which 64 KiB reach the disk, in milliseconds.
    sync_ms: f64,
}

schemas! { "lamp-doctor-1": DoctorAnswer; }

impl DoctorAnswer {
    /// Returns what is found, and the number of faults.
    fn found() -> (Self, usize) {
        let named = |program| in_path(Path::new(program)).map(|path| lossy(&path));
        let browsers = open::commands("http://localhost");
        let browser = browsers.iter().find_map(|command| in_path(Path::new(command.get_program())));
        let (config, fault) = ConfigAnswer::found();
        let folders =
            [("current folder", env::current_dir()), ("temporary files", Ok(env::temp_dir()))];
        let folders = folders.map(|(name, folder)| TriedFolder::new(name, folder));
        let faults = folders.iter().filter(|folder| folder.fault.is_some()).count();
        let found = Self {
            version: env!("CARGO_PKG_VERSION"),
            commit: env!("LAMP_COMMIT_OF_BUILD"),
            target: env!("LAMP_TARGET"),
            features: env!("LAMP_FEATURES"),
            program: started::program().ok().map(|path| lossy(&path)),
            system: system(),
            processors: thread::available_parallelism().map_or(1, usize::from),
            memory_bytes: available(),
            step_kernels: if cfg!(feature = "occt") { &["lamp", "occt"] } else { &["lamp"] },
            folders: folders.into(),
            browser: browser.map(|path| lossy(&path)),
            schedulers: Schedulers { slurm: named("sbatch"), hyperqueue: named("hq") },
            config,
        };
        (found, faults + usize::from(fault.is_some()))
    }

    fn text(&self) -> String {
        let shown = |path: &Option<String>, else_: &str| {
            path.as_ref().map_or_else(|| else_.to_owned(), |path| printable(path).into_owned())
        };
        let Self { processors, browser, schedulers, .. } = self;
        let mut text = format!("lamp {LONG_VERSION}\n");
        text += &format!("program: {}\n", shown(&self.program, "not known"));
        text += &format!("system: {}\n", self.system);
        text += &format!("processors: {processors}\nmemory: {}\n", in_words(self.memory_bytes));
        text += &format!("STEP kernels: {}\n", self.step_kernels.join(", "));
        for TriedFolder { name, path, disk, fault } in &self.folders {
            let found = match (disk, fault) {
                (Some(disk), _) => disk.text(),
                (None, fault) => format!("fault: {}", fault.as_deref().unwrap_or_default()),
            };
            text += &format!("{name}: {}: {found}\n", shown(path, ""));
        }
        text += &format!("browser of lamp view --open: {}\n", shown(browser, "not found"));
        text += &format!("Slurm: {}\n", shown(&schedulers.slurm, "not found"));
        text += &format!("HyperQueue: {}\n", shown(&schedulers.hyperqueue, "not found"));
        text + &self.config.text()
    }
}

impl TriedFolder {
    fn new(name: &'static str, folder: io::Result<PathBuf>) -> Self {
        let path = folder.as_ref().ok().map(|path| lossy(path));
        let tried = folder.map_err(anyhow::Error::from).and_then(|folder| TriedDisk::of(&folder));
        let (disk, fault) = match tried {
            Ok(disk) => (Some(disk), None),
            Err(error) => (None, Some(format!("{error:#}"))),
        };
        Self { name, path, disk, fault }
    }
}

impl TriedDisk {
    /// Tries what commands do with files in a folder.
    fn of(folder: &Path) -> anyhow::Result<Self> {
        let free_bytes = fs4::available_space(folder).context("its free space")?;
        let beside = tempfile::Builder::new().prefix(".lamp-doctor-").tempdir_in(folder);
        let beside = beside.context("a folder cannot be made")?;
        let [from, to] = ["new", "old"].map(|name| beside.path().join(name));
        let mut file = File::create(&from).context("a file cannot be made")?;
        let started = Instant::now();
        file.write_all(&[0; 1 << 16]).and_then(|()| file.sync_all()).context("writing fails")?;
        let sync_ms = started.elapsed().as_secs_f64() * 1000.0;
        let locks_work = file.try_lock().is_ok() && File::open(&from)?.try_lock().is_err();
        drop(file);
        fs::write(&to, "old").context("a second file cannot be made")?;
        // Its reader keeps what it opened.
        let reader = File::open(&to)?;
        let replaces_open_files = fs::rename(&from, &to).is_ok();
        if !replaces_open_files {
            drop(reader);
            fs::rename(&from, &to).context("a file cannot be replaced")?;
        }
        Ok(Self { free_bytes, locks_work, replaces_open_files, sync_ms })
    }

    fn text(&self) -> String {
        let free = in_words(self.free_bytes);
        let locks = if self.locks_work { "locks work" } else { "no locks" };
        let replaced = if self.replaces_open_files { "can" } else { "cannot" };
        let ms = self.sync_ms;
        format!(
            "{free} free, {locks}, open files {replaced} be replaced, 64 KiB reach the disk in {ms:.1} ms"
        )
    }
}

fn lossy(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// Returns the name of the system, as it names itself.
fn system() -> String {
    let release = fs::read_to_string("/etc/os-release").unwrap_or_default();
    let name = release.lines().find_map(|line| line.strip_prefix("PRETTY_NAME="));
    let name = name.map_or(env::consts::OS, |name| name.trim_matches('"'));
    let kernel = fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    format!("{} {} {}", printable(name), env::consts::ARCH, kernel.trim()).trim_end().to_owned()
}

/// Returns the file of a program that the shell would find.
fn in_path(program: &Path) -> Option<PathBuf> {
    let folders = env::var_os("PATH").unwrap_or_default();
    let name = program.with_extension(env::consts::EXE_EXTENSION);
    env::split_paths(&folders).map(|folder| folder.join(&name)).find(|path| path.is_file())
}
