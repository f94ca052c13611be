//! Runs OpenCASCADE in a process of its own: on broken files it may crash.

use std::env;
use std::ffi::OsString;
use std::process::Command;

use anyhow::{Context, anyhow};

use crate::args::arguments::words_in_effect;
use crate::exit::Exit;
use crate::started;

/// Set in the environment of the process that does the work.
const MARK: &str = "LAMP_SUPERVISED";

/// Returns whether a command line asks for OpenCASCADE.
fn asks(words: &[OsString]) -> bool {
    let is_it = |kernel: &str| ["occt", "both"].contains(&kernel);
    let is_kernel =
        |pair: &[OsString]| pair[0] == "--kernel" && pair[1].to_str().is_some_and(is_it);
    let is_joined = |word: &OsString| {
        let kernel = word.to_str().and_then(|word| word.strip_prefix("--kernel="));
        kernel.is_some_and(is_it)
    };
    words.windows(2).any(is_kernel) || words.iter().any(|word| word == "--both" || is_joined(word))
}

/// Runs this command once more, as a child that ends with this process, and returns
/// its status; nothing where this is the child, or OpenCASCADE is not asked for. A
/// child that crashes is a failure as any other: it has not written anything.
pub(crate) fn supervised() -> Result<Option<u8>, Exit> {
    // The mark keeps the child from starting a child of its own.
    if env::var_os(MARK).is_some() {
        // OpenCASCADE may hang: it must not outlive a parent that was killed.
        let signal = Some(rustix::process::Signal::TERM);
        rustix::process::set_parent_process_death_signal(signal)
            .context("the process that watches over this one")?;
        return Ok(None);
    }
    // A file of options may ask for it, too.
    if !asks(words_in_effect()) {
        return Ok(None);
    }
    let program = started::program().context("this program's own file")?;
    let status =
        Command::new(program).args(started::words().into_iter().skip(1)).env(MARK, "1").status();
    let status = status.context("a process for OpenCASCADE")?;
    match status.code() {
        Some(code) => Ok(Some(u8::try_from(code).unwrap_or(1))),
        None => Err(Exit::Failed(anyhow!(
            "OpenCASCADE failed ({status}), as it does on some broken files: try --kernel lamp"
        ))),
    }
}
