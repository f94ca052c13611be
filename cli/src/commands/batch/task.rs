//! `lamp batch task KEY`: does one task. Engines run it.

use std::io;
use std::io::Write;
use std::path::{Path, PathBuf};

use lamp_batch::{
    CheckCounts, Commands, Damage, StageError, Stages, Store, WriteLayers, perform, status,
};
use lamp_pipeline::RangeFindings;
use lamp_stack::{IndexedStack, KEY_LAYERS, Page, StackError};
use serde::{Deserialize, Serialize};

use super::TaskArgs;
use crate::commands::report::{InlinePicture, of_layer};
use crate::exit::Exit;
use crate::stages::after::After;
use crate::stages::calls::{Checking, Tiling};
use crate::stages::parse;
use crate::terminal::out_of_memory;

pub(super) fn run(args: &TaskArgs) -> Result<(), Exit> {
    let store = Store::open(&args.store).map_err(anyhow::Error::new)?;
    if let Some(parent) = args.parent {
        end_with(parent);
    }
    out_of_memory::end_with(status::NO_MEMORY);
    perform(&store, args.key, &args.engine, &LampCommands)
        .map_err(|(error, why)| Exit::Task(status_of(&error) as u8, why))
}

/// Ends this process when the one that started it does, so that a night that is killed leaves
/// nobody at work.
#[cfg(target_os = "linux")]
fn end_with(parent: i32) {
    use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};
    // Systems without it let the task end by itself.
    let _ = set_parent_process_death_signal(Some(Signal::TERM));
    // It may have ended before.
    if getppid() != Pid::from_raw(parent) {
        std::process::exit(128 + Signal::TERM.as_raw());
    }
}

/// Asks each second, where no signal comes.
#[cfg(all(unix, not(target_os = "linux")))]
fn end_with(parent: i32) {
    use rustix::process::{Pid, Signal, getpid, getppid, kill_process};
    std::thread::spawn(move || {
        while getppid() == Pid::from_raw(parent) {
            std::thread::sleep(std::time::Duration::from_secs(1));
        }
        // As a signal, so that temporary files are removed.
        let _ = kill_process(getpid(), Signal::TERM);
    });
}

/// On Windows the parent arranges it ([`lamp_batch::end_with_this_process`]).
#[cfg(not(unix))]
fn end_with(_: i32) {}

/// Returns the status by which engines decide what to do.
fn status_of(error: &Exit) -> i32 {
    if error.cause::<Damage>().is_some() {
        return status::DAMAGED;
    }
    match error.io_kind() {
        Some(io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded) => status::NO_ROOM,
        // A part that is not there, or cannot be opened, will not be there the next time.
        Some(io::ErrorKind::NotFound | io::ErrorKind::PermissionDenied) => status::BAD_INPUT,
        Some(io::ErrorKind::UnexpectedEof | io::ErrorKind::InvalidData) => status::BAD_INPUT,
        Some(_) => status::INPUT_OUTPUT,
        None => i32::from(error.status()),
    }
}

/// The commands of this program.
pub(super) struct LampCommands;

impl Commands for LampCommands {
    type Error = Exit;
    type Whole = After;
    type Tile = Tiling;
    type Check = Checking;

    fn stages(&self, stages: &[Vec<String>], folder: &Path) -> Result<Stages<After>, StageError> {
        parse::parse(stages, folder)
    }

    fn tile(
        &self,
        options: &[String],
        copies: &[Option<u32>],
        folder: &Path,
    ) -> Result<Tiling, String> {
        Tiling::parse(options, copies, folder)
    }

    fn check(&self, options: &[String], folder: &Path) -> Result<Checking, String> {
        Checking::parse(options, folder)
    }

    fn run_whole(
        &self,
        stage: &After,
        part: &Path,
        stack: &Path,
        write: &mut WriteLayers<'_, Exit>,
    ) -> Result<RangeFindings, Exit> {
        stage.run(part, stack, write)
    }

    fn run_tile(
        &self,
        tile: &Tiling,
        stacks: &[(PathBuf, Option<u32>)],
        write: &mut WriteLayers<'_, Exit>,
    ) -> Result<Vec<String>, Exit> {
        tile.run(stacks, write)
    }

    fn run_check(
        &self,
        check: &Checking,
        stack: &Path,
        out: &mut dyn Write,
    ) -> Result<CheckCounts, Exit> {
        let found = check.run(stack)?;
        let islands = found.kinds.get("island").copied().unwrap_or(0) as u64;
        let counts = CheckCounts { islands, findings: found.found() as u64 };
        let checked = CheckResult { picture: Some(middle(stack)?), lines: found.lines };
        let written = serde_json::to_writer(out, &checked);
        written.map_err(|error| Exit::Output(io::Error::from(error).into()))?;
        Ok(counts)
    }

    fn status(&self, error: &Exit) -> i32 {
        status_of(error)
    }
}

/// Findings in a part, as the result of its check.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct CheckResult {
    /// A line for each finding, the worst first.
    pub(super) lines: Vec<String>,
    /// A layer in the middle.
    pub(super) picture: Option<InlinePicture>,
}

/// Draws a layer in the middle of a stack: one that stands in the pack by itself.
pub(super) fn middle(stack: &Path) -> Result<InlinePicture, Exit> {
    let failed = |error: StackError| Exit::Failed(error.into()).at(stack.display().to_string());
    let stack = IndexedStack::open(stack).map_err(failed)?;
    let half = stack.headers().len() / 2;
    let position = half - half % KEY_LAYERS as usize;
    let layer = stack.page(position).and_then(Page::decode).map_err(failed)?;
    Ok(of_layer(&layer))
}
