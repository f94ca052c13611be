//! Processes of tasks.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::io::{self, Read};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::Sender;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::key::Key;
use crate::ledger::End;
use crate::store::Store;

/// How a task's process is started: `lamp batch task KEY --store STORE`.
#[derive(Clone, Debug)]
pub struct Launcher {
    /// The program.
    pub program: PathBuf,
}

impl Launcher {
    /// Returns the words of the command, after the program.
    pub fn words(&self, key: Key, store: &Store, engine: &str, threads: usize) -> Vec<OsString> {
        let (key, threads) = (key.to_string(), threads.to_string());
        let before = ["batch", "task", &key, "--store"].map(OsString::from);
        // A night is the same for everybody, and while somebody edits files of options.
        let after = ["--engine", engine, "--threads", &threads, "--no-config"].map(OsString::from);
        before.into_iter().chain([store.root().into()]).chain(after).collect()
    }
}

/// The children of this process that run now, and whether they are being ended.
struct RunningChildren {
    children: BTreeSet<u32>,
    is_ending: bool,
}

static RUNNING: Mutex<RunningChildren> =
    Mutex::new(RunningChildren { children: BTreeSet::new(), is_ending: false });

fn running() -> MutexGuard<'static, RunningChildren> {
    // The set is valid even if a thread panicked while it held the lock.
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends the children of this process, which remove their temporary files, and waits for them, at
/// most 10 s. From then on no child is started, and no end is reported. Call it before exiting on a
/// signal.
pub fn end_children() {
    let patience = Instant::now() + Duration::from_secs(10);
    running().is_ending = true;
    ask_to_end();
    while !running().children.is_empty() && Instant::now() < patience {
        thread::sleep(Duration::from_millis(10));
    }
}

#[cfg(unix)]
fn ask_to_end() {
    use rustix::process::{Pid, Signal, kill_process};
    for pid in running().children.iter().filter_map(|&pid| Pid::from_raw(pid as i32)) {
        // One that has already ended is fine.
        let _ = kill_process(pid, Signal::TERM);
    }
}

/// Children share the terminal, so that Ctrl-C reaches them, too.
#[cfg(not(unix))]
fn ask_to_end() {}

/// Lets the system end a child, and its own children, when this process ends for whatever reason. Where
/// the system refuses, the child ends by itself.
#[cfg(windows)]
#[expect(unsafe_code, reason = "job objects have C functions alone")]
pub fn end_with_this_process(child: &Child) {
    use std::os::windows::io::AsRawHandle;
    use std::ptr::{from_ref, null};
    use std::sync::LazyLock;

    use windows_sys::Win32::System::JobObjects::{
        AssignProcessToJobObject, CreateJobObjectW, JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE,
        JOBOBJECT_EXTENDED_LIMIT_INFORMATION, JobObjectExtendedLimitInformation,
        SetInformationJobObject,
    };

    /// The job's handle, which stays open until this process ends.
    static JOB: LazyLock<usize> = LazyLock::new(|| {
        let mut limits = JOBOBJECT_EXTENDED_LIMIT_INFORMATION::default();
        limits.BasicLimitInformation.LimitFlags = JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE;
        let size = size_of_val(&limits) as u32;
        // SAFETY: both pointers may be null: nobody else inherits or names the job.
        let job = unsafe { CreateJobObjectW(null(), null()) };
        // SAFETY: the struct is the one that this class of information has, with its size.
        unsafe {
            SetInformationJobObject(
                job,
                JobObjectExtendedLimitInformation,
                from_ref(&limits).cast(),
                size,
            );
        }
        job as usize
    });
    // SAFETY: both handles are open; a job that could not be made is null, which is refused.
    unsafe { AssignProcessToJobObject(*JOB as _, child.as_raw_handle().cast()) };
}

/// Starts a process and sends its end, with its last words.
pub(super) fn start(mut command: Command, key: Key, ends: Sender<(Key, End)>) -> io::Result<()> {
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    // Locked until the child is listed: `end_children` must not miss a child that starts now.
    let mut now = running();
    if now.is_ending {
        return Err(io::Error::new(io::ErrorKind::Interrupted, "a signal ends the night"));
    }
    let child = command.spawn()?;
    #[cfg(windows)]
    end_with_this_process(&child);
    now.children.insert(child.id());
    drop(now);
    let wait = move || {
        let end = wait_for(child);
        if !running().is_ending {
            // The run has ended if nobody listens.
            let _ = ends.send((key, end));
        }
    };
    thread::Builder::new().spawn(wait)?;
    Ok(())
}

/// The most bytes of last words to keep.
const MOST_WORDS: usize = 4096;

fn wait_for(mut child: Child) -> End {
    let id = child.id();
    let mut words = Vec::new();
    if let Some(mut stderr) = child.stderr.take() {
        let mut some = [0; MOST_WORDS];
        while let Ok(count @ 1..) = stderr.read(&mut some) {
            words.extend_from_slice(&some[..count]);
            words.drain(..words.len().saturating_sub(MOST_WORDS));
        }
    }
    let status = child.wait();
    running().children.remove(&id);
    let words = String::from_utf8_lossy(&words).trim().to_owned();
    match status {
        Ok(status) => End::of_status(status.code(), why(status, &words)),
        Err(error) => End::Failed(error.to_string()),
    }
}

/// Returns the last words of a process: its last line, or the signal that ended it.
fn why(status: ExitStatus, words: &str) -> String {
    let last = words.lines().last().unwrap_or_default();
    let last = ["error: ", "lamp: ", "batch: "]
        .iter()
        .fold(last, |last, label| last.strip_prefix(label).unwrap_or(last));
    let last = last.to_owned();
    match signal(status) {
        Some(signal) if last.is_empty() => {
            format!("its process was ended by signal {signal}{}", guess(signal))
        }
        Some(signal) => {
            format!("its process was ended by signal {signal}{}: {last}", guess(signal))
        }
        None if last.is_empty() => format!("its process ended with {status}"),
        None => last,
    }
}

/// Returns the usual meaning of a signal.
fn guess(signal: i32) -> &'static str {
    if signal == 9 { ", as the system does when memory runs out" } else { "" }
}

#[cfg(unix)]
fn signal(status: ExitStatus) -> Option<i32> {
    std::os::unix::process::ExitStatusExt::signal(&status)
}

#[cfg(not(unix))]
fn signal(_: ExitStatus) -> Option<i32> {
    None
}
