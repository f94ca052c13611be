//! Work that goes on while the viewer answers.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::{Value, json};

/// Progress of work.
#[derive(Debug, Default)]
pub struct WorkProgress {
    step: Mutex<&'static str>,
    done: AtomicU64,
    of: AtomicU64,
    is_stopped: AtomicBool,
}

impl WorkProgress {
    /// Begins a step of the work, of an amount that is not known yet.
    pub fn begin(&self, step: &'static str) {
        *self.step.lock().unwrap_or_else(PoisonError::into_inner) = step;
        self.done.store(0, Ordering::Relaxed);
        self.expect(0);
    }

    /// Returns whether nobody waits for the work any more.
    pub fn is_stopped(&self) -> bool {
        self.is_stopped.load(Ordering::Relaxed)
    }

    /// Sets the amount of work.
    pub fn expect(&self, of: u64) {
        self.of.store(of, Ordering::Relaxed);
    }

    /// Counts one more unit of work as done.
    pub fn one_done(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }
}

/// Work that goes on while the viewer answers, and its result.
pub(crate) struct Background<T> {
    progress: WorkProgress,
    result: Mutex<WorkState<T>>,
}

enum WorkState<T> {
    NotWanted,
    Running,
    Ready(T),
    Failed(String),
}

impl<T> Default for Background<T> {
    fn default() -> Self {
        Self { progress: WorkProgress::default(), result: Mutex::new(WorkState::NotWanted) }
    }
}

impl<T> Background<T> {
    /// Records that work will run.
    pub(crate) fn start(&self) {
        *self.lock() = WorkState::Running;
    }

    /// Records that work will run, if that is new. Returns whether it is new.
    pub(crate) fn start_once(&self) -> bool {
        let mut stage = self.lock();
        let is_new = matches!(*stage, WorkState::NotWanted);
        if is_new {
            *stage = WorkState::Running;
        }
        is_new
    }

    /// Works, and keeps the result or the failure.
    pub(crate) fn run(&self, work: impl FnOnce(&WorkProgress) -> Result<T, String>) {
        self.start();
        // The page waits for a result: without one, it would wait forever.
        let result = catch_unwind(AssertUnwindSafe(|| work(&self.progress)));
        *self.lock() = match result {
            Ok(Ok(result)) => WorkState::Ready(result),
            Ok(Err(message)) => WorkState::Failed(message),
            Err(_) => WorkState::Failed("an error of the program; please report it".to_owned()),
        };
    }

    pub(crate) fn is_wanted(&self) -> bool {
        !matches!(*self.lock(), WorkState::NotWanted)
    }

    pub(crate) fn is_running(&self) -> bool {
        matches!(*self.lock(), WorkState::Running)
    }

    /// Asks the work to stop.
    pub(crate) fn stop(&self) {
        self.progress.is_stopped.store(true, Ordering::Relaxed);
    }

    /// Returns the part of the result that `of` takes, if it is there.
    pub(crate) fn get<U>(&self, of: impl FnOnce(&T) -> U) -> Option<U> {
        match &*self.lock() {
            WorkState::Ready(result) => Some(of(result)),
            _ => None,
        }
    }

    /// Returns the progress of the work.
    pub(crate) fn state(&self) -> Value {
        let (status, message) = match &*self.lock() {
            WorkState::NotWanted => ("none", None),
            WorkState::Running => ("running", None),
            WorkState::Ready(_) => ("ready", None),
            WorkState::Failed(_) if self.progress.is_stopped() => ("stopped", None),
            WorkState::Failed(message) => ("failed", Some(message.clone())),
        };
        let number = |number: &AtomicU64| number.load(Ordering::Relaxed);
        let WorkProgress { step, done, of, .. } = &self.progress;
        let step = *step.lock().unwrap_or_else(PoisonError::into_inner);
        let (done, of) = (number(done), number(of));
        json!({"status": status, "message": message, "step": step, "done": done, "of": of})
    }

    fn lock(&self) -> MutexGuard<'_, WorkState<T>> {
        // Stages are replaced whole, so one is valid even after a panic.
        self.result.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
