//! Judges STEP files of other programs, where present: each must be right or rejected with a
//! reason, within limits of time and memory.
//!
//! The folders `step` and `step2` next to the project are judged, or the folder that
//! `LAMP_STEP_FOLDER` names, each by the file `..._oracle.json` next to it. Arguments name kernels
//! (`own`, `occt`) and parts of file names. Every file is read in a separate process.

mod figures;
mod one_file;
mod verdict;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use lamp_brep::ReadFn;

use crate::kernels::OTHERS;
use figures::Figures;
use one_file::{Answer, TASK};
use verdict::Verdict;

/// A process that takes longer than this is killed.
const LIMIT: Duration = Duration::from_secs(120);
/// The interval for checking whether a process has ended.
const POLL: Duration = Duration::from_millis(5);

/// A kernel, its name for selection, and the share of files that it must read right; it may reject
/// the rest.
struct Judged {
    name: &'static str,
    read: ReadFn,
    least_right: f64,
}

fn all() -> Vec<Judged> {
    let own = Judged { name: "own", read: lamp_brep::read_step, least_right: 47.0 / 52.0 };
    let other = |&(name, read): &_| Judged { name, read, least_right: 49.0 / 52.0 };
    [own].into_iter().chain(OTHERS.iter().map(other)).collect()
}

/// Judges all files, or one of them in a separate process, as the arguments specify.
pub(crate) fn run() -> ExitCode {
    let all = all();
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let [task, kernel, path, size_mm, heights_mm] = &words[..]
        && task == TASK
    {
        let judged = all.iter().find(|judged| judged.name == kernel).expect("a kernel");
        one_file::answer(judged.read, Path::new(path), size_mm, heights_mm);
        return ExitCode::SUCCESS;
    }
    if words.iter().any(|word| word == "--list") {
        list_tests(&all, &words);
        return ExitCode::SUCCESS;
    }
    let is_kernel = |word: &String| all.iter().any(|judged| judged.name == word);
    // Words with a dash belong to libtest, such as `--nocapture`.
    let words = words.into_iter().filter(|word| !word.starts_with('-'));
    let (kernels, files): (Vec<_>, Vec<_>) = words.partition(is_kernel);
    let is_asked =
        |judged: &&Judged| kernels.is_empty() || kernels.iter().any(|k| k == judged.name);
    let is_good = |judged| judge(judged, &files);
    // Not `all`, which would stop at the first.
    match all.iter().filter(is_asked).filter(|judged| !is_good(judged)).count() {
        0 => ExitCode::SUCCESS,
        _ => ExitCode::FAILURE,
    }
}

/// Prints the names of tests as libtest does for `cargo nextest`: none is ignored.
fn list_tests(all: &[Judged], words: &[String]) {
    if !words.iter().any(|word| word == "--ignored") {
        all.iter().for_each(|judged| println!("{}: test", judged.name));
    }
}

/// Returns the folders to judge.
fn folders() -> Vec<PathBuf> {
    match std::env::var_os("LAMP_STEP_FOLDER") {
        Some(folder) => vec![folder.into()],
        None => {
            let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
            ["step", "step2"].map(|folder| data.join(folder)).into()
        }
    }
}

/// Judges all files, prints a table and returns whether they pass.
fn judge(kernel: &Judged, wanted: &[String]) -> bool {
    let folders = folders();
    let files = folders.iter().flat_map(|folder| figures::of_folder(folder));
    let is_wanted =
        |file: &Figures| wanted.is_empty() || wanted.iter().any(|word| file.name.contains(word));
    let verdicts: Vec<Verdict> = files
        .filter(is_wanted)
        .map(|file| {
            let verdict = Verdict::new(&file, within_limit(kernel.name, &file));
            println!("{verdict}");
            verdict
        })
        .collect();
    if verdicts.is_empty() {
        println!("no files at hand");
        return true;
    }
    let named = |of: fn(&Verdict) -> bool| -> Vec<&str> {
        verdicts.iter().filter(|verdict| of(verdict)).map(|verdict| verdict.name.as_str()).collect()
    };
    let (right, wrong) = (named(Verdict::is_right), named(Verdict::is_wrong));
    let beyond = named(Verdict::is_beyond_limits);
    println!("{}: {} of {} right; wrong: {wrong:?}", kernel.name, right.len(), verdicts.len());
    println!("{}: beyond {}: {beyond:?}", kernel.name, verdict::LIMITS);
    wrong.is_empty() && right.len() as f64 >= kernel.least_right * verdicts.len() as f64
}

/// Reads a file in a separate process, which is killed if it hangs.
fn within_limit(kernel: &str, file: &Figures) -> Answer {
    let heights: Vec<String> = file.heights_mm.iter().map(ToString::to_string).collect();
    let mut child = Command::new(std::env::current_exe().expect("this program"))
        .args([TASK, kernel])
        .arg(&file.path)
        .args([file.size_mm().to_string(), heights.join(",")])
        .stdout(Stdio::piped())
        .spawn()
        .expect("this program runs");
    let start = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if start.elapsed() > LIMIT {
            child.kill().expect("a child");
            break;
        }
        std::thread::sleep(POLL);
    }
    let output = child.wait_with_output().expect("a child");
    Answer::parse(&output.stdout, start.elapsed().as_secs_f64())
}
