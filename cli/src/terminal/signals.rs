//! Removes temporary files when a signal ends the command.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::thread;

use anyhow::Context;
use lamp_batch::end_children;
use lamp_stack::remove_temporaries;

use crate::exit::Exit;

static ENDS: AtomicBool = AtomicBool::new(false);

const WATCH: &str = "the thread that waits for signals";

/// If a signal or a lack of memory is ending the process, waits for the end: a failure meanwhile,
/// because the process's files are gone, must not be reported.
pub(crate) fn wait_if_ending() {
    while ENDS.load(Relaxed) {
        thread::park();
    }
}

/// Keeps failures from now on from being reported, since the process is about to end.
pub(crate) fn say_no_more() {
    ENDS.store(true, Relaxed);
}

/// Ends tasks and takes temporary files away, and then ends the process.
fn clean_up_and_end(status: i32) -> ! {
    // Before files are removed: writers that then fail must not report it.
    say_no_more();
    // Tasks remove their own temporary files, so they end first.
    end_children();
    remove_temporaries();
    std::process::exit(status)
}

/// Lets Ctrl-C, and the signals that end a batch, end tasks and take temporary files away
/// before the process ends, with status 128 + the signal's number, as shells
/// have it. A signal that is ignored, as `nohup` arranges, stays so. A file
/// that passes the limit of sizes is an error of writing it, and no signal.
#[cfg(unix)]
pub(crate) fn clean_up_on_signals() -> Result<(), Exit> {
    use signal_hook::consts::{
        SIGALRM, SIGHUP, SIGINT, SIGPROF, SIGQUIT, SIGTERM, SIGUSR1, SIGUSR2, SIGVTALRM, SIGXCPU,
        SIGXFSZ,
    };
    use signal_hook::iterator::Signals;

    /// The signals that end a process which does not expect them.
    const ENDING: [i32; 10] =
        [SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGALRM, SIGVTALRM, SIGPROF, SIGXCPU, SIGUSR1, SIGUSR2];
    let ignored = ignored_signals();
    // SIGXFSZ ends a process that does not expect it. Once it is watched, the write fails with
    // EFBIG (setrlimit(2)).
    let wanted = ENDING.into_iter().chain([SIGXFSZ]);
    let wanted = wanted.filter(|signal| ignored >> (signal - 1) & 1 == 0);
    let mut signals = Signals::new(wanted).context(WATCH)?;
    let watch = move || {
        if let Some(signal) = signals.forever().find(|&signal| signal != SIGXFSZ) {
            clean_up_and_end(128 + signal);
        }
    };
    std::thread::Builder::new().spawn(watch).context(WATCH)?;
    Ok(())
}

/// Lets Ctrl-C, Ctrl-Break, a closed console and the end of a session end tasks and take temporary
/// files away before the process ends, with the status that shells give to Ctrl-C.
#[cfg(windows)]
pub(crate) fn clean_up_on_signals() -> Result<(), Exit> {
    ctrlc::set_handler(|| clean_up_and_end(130)).context(WATCH)?;
    Ok(())
}

/// The signals that this process was started to ignore, as bits from signal 1 on; zero where the
/// system does not report them.
#[cfg(unix)]
fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}
