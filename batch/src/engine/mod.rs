//! Engines, which run tasks: one file each, all running `lamp batch task KEY`.

mod hyperqueue;
mod local;
mod process;
mod rounds;
mod slurm;

use std::io;

use thiserror::Error;

use hyperqueue::HyperQueue;
use rounds::Scheduler;
use slurm::Slurm;

use crate::key::Key;
use crate::ledger::{End, Ledger};
use crate::store::{Store, StoreError};
use crate::task::Graph;

pub use local::Local;
#[cfg(windows)]
pub use process::end_with_this_process;
pub use process::{Launcher, end_children};
pub use rounds::SchedulerError;

/// The exit statuses of `lamp batch task`, for engines.
pub mod status {
    /// The result is in the store.
    pub const DONE: i32 = 0;
    /// The input is at fault.
    pub const BAD_INPUT: i32 = 1;
    /// Options are at fault.
    pub const USAGE: i32 = 2;
    /// The system gave no more memory (EX_OSERR): nothing is in the journal.
    pub const NO_MEMORY: i32 = 71;
    /// The disk is full (EX_CANTCREAT of sysexits.h).
    pub const NO_ROOM: i32 = 73;
    /// Reading or writing failed (EX_IOERR).
    pub const INPUT_OUTPUT: i32 = 74;
    /// A result that the task needs was damaged, and was taken away (EX_TEMPFAIL).
    pub const DAMAGED: i32 = 75;
}

impl End {
    /// Returns the end of a task with an exit status; `None` means a signal.
    pub fn of_status(status: Option<i32>, why: String) -> Self {
        match status {
            Some(status::DONE) => Self::Done,
            Some(status::BAD_INPUT | status::USAGE) => Self::Bad(why),
            Some(status::NO_ROOM) => Self::NoRoom(why),
            Some(status::DAMAGED) => Self::Damaged(why),
            Some(status::INPUT_OUTPUT) => Self::Failed(why),
            // Signals, panics (101) and lack of memory: the process left no line in the journal.
            _ => Self::Crashed(why),
        }
    }
}

/// Runs tasks.
#[derive(Clone, Debug)]
pub enum Engine {
    /// Child processes of this one.
    Local(Local),
    /// HyperQueue, whose server `hq` finds.
    HyperQueue,
    /// Slurm, by `sbatch` and its companions.
    Slurm,
}

impl Engine {
    /// Returns the name, as `--engine` has it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Local(_) => "local",
            Self::HyperQueue => HyperQueue::NAME,
            Self::Slurm => Slurm::NAME,
        }
    }

    /// Runs all tasks of a ledger that can be done, and reports each attempt that ended.
    ///
    /// # Errors
    /// Returns an error if the engine itself fails; failures of tasks are in the ledger.
    pub fn run(
        &self,
        work: &Work<'_>,
        ledger: &mut Ledger<'_>,
        tell: &mut dyn FnMut(&Attempt),
    ) -> Result<(), EngineError> {
        match self {
            Self::Local(local) => local.run(work, ledger, tell),
            Self::HyperQueue => rounds::run(&HyperQueue, work, ledger, tell),
            Self::Slurm => rounds::run(&Slurm, work, ledger, tell),
        }
    }
}

/// The job of an engine.
pub struct Work<'a> {
    /// All tasks.
    pub graph: &'a Graph,
    /// Where their results go.
    pub store: &'a Store,
    /// How a task's process is started.
    pub launcher: &'a Launcher,
}

/// An attempt at a task that ended.
#[derive(Clone, Debug)]
pub struct Attempt {
    /// The task.
    pub key: Key,
    /// How it ended.
    pub end: End,
    /// Whether it is tried again.
    pub again: bool,
}

/// An error that stops an engine.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EngineError {
    /// No process can be started.
    #[error("a process for a task cannot be started")]
    Start(#[source] io::Error),
    /// The scheduler does not do its work.
    #[error(transparent)]
    Scheduler(#[from] SchedulerError),
    /// The journal cannot be read.
    #[error("the journal of the store cannot be read")]
    Journal(#[source] io::Error),
    /// The store cannot be written.
    #[error(transparent)]
    Store(#[from] StoreError),
}
