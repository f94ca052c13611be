//! Removes temporary files when a signal ends the command.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::thread;

use lamp_stack::remove_temporaries;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::exit::Exit;

static CAUGHT: AtomicBool = AtomicBool::new(false);

/// If a signal is ending the process, waits for that: what fails meanwhile,
/// because its files are gone, is not to be told.
pub(crate) fn wait_if_ending() {
    while CAUGHT.load(Relaxed) {
        thread::park();
    }
}

/// Lets Ctrl-C, and the signals that end a batch, take temporary files away
/// before the process ends, with status 128 + the signal's number, as shells
/// have it. A signal that is ignored, as `nohup` arranges, stays so.
pub(crate) fn clean_up_on_signals() -> Result<(), Exit> {
    let ignored = ignored_signals();
    let wanted = [SIGHUP, SIGINT, SIGTERM];
    let wanted = wanted.into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
    let mut signals = Signals::new(wanted).map_err(|error| Exit::Failed(error.into()))?;
    thread::spawn(move || {
        if let Some(signal) = signals.forever().next() {
            CAUGHT.store(true, Relaxed);
            remove_temporaries();
            std::process::exit(128 + signal);
        }
    });
    Ok(())
}

/// The signals that this process was started to ignore, as bits from signal 1
/// on; none where the system does not tell.
fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}
