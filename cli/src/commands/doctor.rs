//! `lamp doctor`: describes the program and its machine, for a report of a fault.

use std::env;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Instant;

use anyhow::{Context, anyhow};
use clap::Args;
use lamp_pipeline::memory::{available, in_words};

use crate::commands::config::listing;
use crate::exit::Exit;
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

Exit status: 0 if all that commands need works, 1 otherwise.")]
pub(crate) struct DoctorArgs {}

pub(crate) fn run() -> Result<(), Exit> {
    let mut faults = 0;
    let program = started::program().map_or_else(|error| error.to_string(), |path| shown(&path));
    let processors = thread::available_parallelism().map_or(1, usize::from);
    let mut text = format!("lamp {LONG_VERSION}\nprogram: {program}\n");
    text += &format!("system: {}\n", system());
    text += &format!("processors: {processors}\nmemory: {}\n", in_words(available()));
    text += &format!("STEP kernels: {}\n", kernels());
    for (name, folder) in
        [("current folder", env::current_dir()), ("temporary files", Ok(env::temp_dir()))]
    {
        let (path, tried) = match folder {
            Ok(folder) => (shown(&folder), try_disk(&folder)),
            Err(error) => (String::new(), Err(error.into())),
        };
        let found = tried.unwrap_or_else(|error| {
            faults += 1;
            format!("fault: {error:#}")
        });
        text += &format!("{name}: {path}: {found}\n");
    }
    let browsers = open::commands("http://localhost");
    let browser = browsers.iter().find_map(|command| in_path(Path::new(command.get_program())));
    text += &format!("browser of lamp view --open: {}\n", found(browser));
    for (scheduler, program) in [("Slurm", "sbatch"), ("HyperQueue", "hq")] {
        text += &format!("{scheduler}: {}\n", found(in_path(Path::new(program))));
    }
    let (options, fault) = listing();
    faults += usize::from(fault.is_some());
    text += &options;
    print(&text)?;
    match faults {
        0 => Ok(()),
        1 => Err(Exit::Failed(anyhow!("1 fault"))),
        _ => Err(Exit::Failed(anyhow!("{faults} faults"))),
    }
}

fn shown(path: &Path) -> String {
    printable(&path.to_string_lossy()).into_owned()
}

fn found(program: Option<PathBuf>) -> String {
    program.map_or_else(|| "not found".to_owned(), |path| shown(&path))
}

/// Returns the name of the system, as it names itself.
fn system() -> String {
    let release = fs::read_to_string("/etc/os-release").unwrap_or_default();
    let name = release.lines().find_map(|line| line.strip_prefix("PRETTY_NAME="));
    let name = name.map_or(env::consts::OS, |name| name.trim_matches('"'));
    let kernel = fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    format!("{} {} {}", printable(name), env::consts::ARCH, kernel.trim()).trim_end().to_owned()
}

/// Returns the names of the kernels that read STEP files.
fn kernels() -> &'static str {
    if cfg!(feature = "occt") { "lamp, occt" } else { "lamp" }
}

/// Tries what commands do with files in a folder, and returns its free space and speed.
fn try_disk(folder: &Path) -> anyhow::Result<String> {
    let free = fs4::available_space(folder).context("its free space")?;
    let beside = tempfile::Builder::new().prefix(".lamp-doctor-").tempdir_in(folder);
    let beside = beside.context("a folder cannot be made")?;
    let [from, to] = ["new", "old"].map(|name| beside.path().join(name));
    let mut file = File::create(&from).context("a file cannot be made")?;
    let started = Instant::now();
    file.write_all(&[0; 1 << 16]).and_then(|()| file.sync_all()).context("writing fails")?;
    let milliseconds = started.elapsed().as_secs_f64() * 1000.0;
    let is_locked = file.try_lock().is_ok() && File::open(&from)?.try_lock().is_err();
    drop(file);
    fs::write(&to, "old").context("a second file cannot be made")?;
    // Its reader keeps what it opened.
    let reader = File::open(&to)?;
    let replaced = if fs::rename(&from, &to).is_ok() {
        "open files can be replaced"
    } else {
        drop(reader);
        fs::rename(&from, &to).context("a file cannot be replaced")?;
        "open files cannot be replaced"
    };
    let locks = if is_locked { "locks work" } else { "no locks" };
    let free = in_words(free);
    Ok(format!("{free} free, {locks}, {replaced}, 64 KiB reach the disk in {milliseconds:.1} ms"))
}

/// Returns the file of a program that the shell would find.
fn in_path(program: &Path) -> Option<PathBuf> {
    let folders = env::var_os("PATH").unwrap_or_default();
    let name = program.with_extension(env::consts::EXE_EXTENSION);
    env::split_paths(&folders).map(|folder| folder.join(&name)).find(|path| path.is_file())
}
