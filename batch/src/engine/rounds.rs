//! Tasks by a scheduler of several machines, submitted in rounds.
//!
//! A round is all unfinished tasks, with the tasks that each needs. Schedulers lose some of their
//! own books when they are killed, so the end of a task is read from the store alone: its manifest,
//! or its line in the journal. Tasks that a round leaves unfinished go into the next one.

use std::collections::HashMap;
use std::ffi::OsString;
use std::io;
use std::process::{Command, Stdio};
use std::sync::mpsc::channel;
use std::thread;
use std::time::{Duration, Instant};

use lamp_stack::one_line;
use thiserror::Error;

use super::{Attempt, EngineError, Work};
use crate::journal::{Event, events};
use crate::key::{Key, Kind};
use crate::ledger::{End, Ledger, State};
use crate::store::Store;
use crate::task::Cost;

/// The shortest and the longest time between two looks at a round.
const LOOKS: [Duration; 2] = [Duration::from_millis(200), Duration::from_secs(5)];
/// The longest silence of a scheduler: time enough to restart it.
const SILENCE: Duration = Duration::from_secs(30 * 60);
/// The longest time until a result is seen from another machine.
const LATE: Duration = Duration::from_secs(2);
/// The time limit of a scheduler's program. Busy ones take seconds.
const ANSWER_TIME: Duration = Duration::from_secs(120);

/// A task of a round.
#[derive(Clone, Debug)]
pub(super) struct RoundTask {
    pub(super) key: Key,
    pub(super) kind: Kind,
    /// The part or build that it is for.
    pub(super) subject: String,
    /// The tasks of the round that it needs, by their places in it.
    pub(super) needs: Vec<usize>,
    pub(super) cost: Cost,
    /// The program and its words.
    pub(super) command: Vec<String>,
}

/// Submits tasks to machines.
pub(super) trait Scheduler {
    /// The scheduler's handle of a round.
    type Job;

    /// The engine's name.
    const NAME: &'static str;

    /// Submits a round. Each task comes after the tasks that it needs.
    fn submit(&self, round: &[RoundTask], store: &Store) -> Result<Self::Job, SchedulerError>;

    /// Returns whether tasks of a round wait or run.
    fn is_at_work(&self, job: &Self::Job) -> Result<bool, SchedulerError>;

    /// Cancels the tasks that have not been done.
    fn cancel(&self, job: &Self::Job) -> Result<(), SchedulerError>;
}

/// An error of a scheduler.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SchedulerError {
    /// A program of the scheduler is not there.
    #[error("{program} cannot be started: install the scheduler, or put its programs on the PATH")]
    Start {
        /// The program.
        program: &'static str,
        /// Why.
        source: io::Error,
    },
    /// The job file cannot be written.
    #[error("the job file cannot be written to the folder for temporary files")]
    JobFile {
        /// Why.
        source: io::Error,
    },
    /// A path that schedulers do not accept.
    #[error(
        "{path} is not UTF-8, and schedulers accept only UTF-8: rename it, or leave out --engine"
    )]
    NoText {
        /// The path.
        path: String,
    },
    /// A program of the scheduler is silent.
    #[error("{program} has not answered for {seconds} s: check the scheduler")]
    Silent {
        /// The program.
        program: &'static str,
        /// The time that it was given.
        seconds: u64,
    },
    /// A program of the scheduler failed.
    #[error("{program} failed: {why}")]
    Failed {
        /// The program.
        program: &'static str,
        /// Its last words.
        why: String,
    },
    /// A program of the scheduler gave an answer of another form.
    #[error("{program} gave an answer that lamp cannot read: {answer}")]
    Answer {
        /// The program.
        program: &'static str,
        /// How the answer begins.
        answer: String,
    },
}

/// Does all tasks of a ledger, round by round.
pub(super) fn run<S: Scheduler>(
    scheduler: &S,
    work: &Work<'_>,
    ledger: &mut Ledger<'_>,
    tell: &mut dyn FnMut(&Attempt),
) -> Result<(), EngineError> {
    while !ledger.ready().is_empty() {
        let round = round::<S>(work, ledger)?;
        // Counted before the round is submitted: a task may fail at once.
        let before = failures(work.store)?;
        let job = scheduler.submit(&round, work.store)?;
        let pending = round.iter().map(|task| task.key).collect();
        Following { work, ledger, tell, pending, before }.follow(scheduler, &job)?;
    }
    Ok(())
}

/// Returns all tasks that wait, written where processes find them.
fn round<S: Scheduler>(
    work: &Work<'_>,
    ledger: &Ledger<'_>,
) -> Result<Vec<RoundTask>, EngineError> {
    let mut keys = ledger.keys();
    keys.retain(|&key| ledger.state(key) == State::Waiting);
    let places: HashMap<Key, usize> = keys.iter().copied().zip(0..).collect();
    let in_text = |word: OsString| {
        word.into_string().map_err(|word| {
            let path = one_line(&word.to_string_lossy());
            EngineError::from(SchedulerError::NoText { path })
        })
    };
    let task = |&key: &Key| {
        let task = work.graph.task(key);
        work.store.write_task(task)?;
        // Schedulers count threads as processors, and each task is submitted with one.
        let words = work.launcher.words(key, work.store, S::NAME, 1);
        let words = std::iter::once(work.launcher.program.clone().into()).chain(words);
        Ok(RoundTask {
            key,
            kind: task.recipe.kind,
            subject: task.subject.clone(),
            needs: task.needs.iter().filter_map(|need| places.get(need).copied()).collect(),
            cost: task.cost,
            command: words.map(in_text).collect::<Result<_, _>>()?,
        })
    };
    keys.iter().map(task).collect()
}

/// A round that is being done.
struct Following<'a, 'b, 'c> {
    work: &'a Work<'b>,
    ledger: &'a mut Ledger<'c>,
    tell: &'a mut dyn FnMut(&Attempt),
    /// The tasks that have not ended yet.
    pending: Vec<Key>,
    /// How often each task had failed before the round.
    before: HashMap<Key, usize>,
}

impl Following<'_, '_, '_> {
    fn follow<S: Scheduler>(&mut self, scheduler: &S, job: &S::Job) -> Result<(), EngineError> {
        let [mut pause, longest] = LOOKS;
        let mut answered = Instant::now();
        loop {
            thread::sleep(pause);
            pause = (pause * 3 / 2).min(longest);
            // The scheduler is asked first: tasks that it has ended by now are seen below.
            let is_at_work = match scheduler.is_at_work(job) {
                Ok(is_at_work) => {
                    answered = Instant::now();
                    is_at_work
                }
                Err(error) if answered.elapsed() > SILENCE => return Err(error.into()),
                Err(_) => true,
            };
            let ended = self.look()?;
            if ended > 0 {
                pause = LOOKS[0];
            }
            if self.ledger.no_room().is_some() {
                // On a full disk, the other tasks of the round would only fail as well.
                return Ok(scheduler.cancel(job)?);
            }
            if self.pending.is_empty() && !is_at_work {
                return Ok(());
            }
            if !is_at_work {
                thread::sleep(LATE);
                self.look()?;
                self.give_up();
                return Ok(());
            }
        }
    }

    /// Records tasks that have ended. Returns their number.
    fn look(&mut self) -> Result<usize, EngineError> {
        let store = self.work.store;
        let (done, pending): (Vec<Key>, Vec<Key>) =
            self.pending.drain(..).partition(|&key| store.manifest(key).is_some());
        self.pending = pending;
        for &key in &done {
            self.end(key, End::Done);
        }
        let mut count = done.len();
        let failed = failed(store)?;
        let mut times: HashMap<Key, usize> = HashMap::new();
        for event in failed {
            let time = times.entry(event.key).or_default();
            *time += 1;
            // The journal also has the failures of earlier rounds and nights.
            if *time <= self.before.get(&event.key).copied().unwrap_or(0) {
                continue;
            }
            if let Some(place) = self.pending.iter().position(|&key| key == event.key) {
                self.pending.remove(place);
                self.end(event.key, End::of_status(event.status, event.why.unwrap_or_default()));
                count += 1;
            }
        }
        // Tasks that need a task that failed for good are not waited for.
        self.pending.retain(|&key| self.ledger.state(key) == State::Waiting);
        Ok(count)
    }

    /// Records tasks that could have been done, and were not.
    fn give_up(&mut self) {
        let ready = self.ledger.ready();
        for key in std::mem::take(&mut self.pending) {
            // Other tasks wait for a task that failed: they had no turn, and so no failure.
            if ready.contains(&key) {
                let why = "it ended without a message: it was probably killed, or ran out of \
                           memory or time";
                self.end(key, End::Crashed(why.to_owned()));
            }
        }
    }

    fn end(&mut self, key: Key, end: End) {
        let again = self.ledger.end(key, end.clone());
        (self.tell)(&Attempt { key, end, again });
    }
}

/// Returns the events of tasks that failed.
fn failed(store: &Store) -> Result<Vec<Event>, EngineError> {
    let mut all = events(store).map_err(EngineError::Journal)?;
    all.retain(|event| !event.is_done());
    Ok(all)
}

/// Returns how often each task has failed.
fn failures(store: &Store) -> Result<HashMap<Key, usize>, EngineError> {
    let mut counts = HashMap::new();
    for event in failed(store)? {
        *counts.entry(event.key).or_default() += 1;
    }
    Ok(counts)
}

/// Runs a program of a scheduler and returns what it prints.
pub(super) fn answer_of(
    program: &'static str,
    arguments: &[&str],
    input: Option<&str>,
) -> Result<String, SchedulerError> {
    answer_within(ANSWER_TIME, program, arguments, input)
}

fn answer_within(
    patience: Duration,
    program: &'static str,
    arguments: &[&str],
    input: Option<&str>,
) -> Result<String, SchedulerError> {
    let start = |source| SchedulerError::Start { program, source };
    let stdin = if input.is_some() { Stdio::piped() } else { Stdio::null() };
    let mut child = Command::new(program)
        .args(arguments)
        .stdin(stdin)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(start)?;
    let (sender, answer) = channel();
    let (stdin, text) = (child.stdin.take(), input.map(str::to_owned));
    let pid = child.id();
    // A thread of its own, which is left behind if the program hangs.
    thread::spawn(move || {
        if let (Some(text), Some(mut stdin)) = (text, stdin) {
            // If a program does not read to the end, its error is reported below.
            let _ = io::Write::write_all(&mut stdin, text.as_bytes());
        }
        let _ = sender.send(child.wait_with_output());
    });
    let Ok(output) = answer.recv_timeout(patience) else {
        kill(pid);
        return Err(SchedulerError::Silent { program, seconds: patience.as_secs() });
    };
    let output = output.map_err(start)?;
    if !output.status.success() {
        let text = [output.stderr, output.stdout].concat();
        let text = String::from_utf8_lossy(&text);
        let why = text.lines().map(str::trim).find(|line| !line.is_empty());
        let why = why.map_or_else(|| output.status.to_string(), str::to_owned);
        return Err(SchedulerError::Failed { program, why });
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Ends a program that hangs.
#[cfg(target_os = "linux")]
fn kill(pid: u32) {
    use rustix::process::{Pid, Signal, kill_process};
    if let Some(pid) = Pid::from_raw(pid as i32) {
        // It may have ended meanwhile.
        let _ = kill_process(pid, Signal::KILL);
    }
}

/// Elsewhere it runs on, ignored.
#[cfg(not(target_os = "linux"))]
fn kill(_: u32) {}

/// Returns an error that shows how an answer begins.
pub(super) fn not_understood(program: &'static str, answer: &str) -> SchedulerError {
    SchedulerError::Answer { program, answer: answer.trim().chars().take(80).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_hangs_is_ended() {
        let start = Instant::now();
        let answer = answer_within(Duration::from_millis(100), "sleep", &["60"], None);
        assert!(matches!(answer, Err(SchedulerError::Silent { program: "sleep", .. })));
        assert!(start.elapsed() < Duration::from_secs(30));
        let answer = answer_within(Duration::from_secs(30), "cat", &[], Some("blade"));
        assert_eq!(answer.unwrap(), "blade");
    }
}

#[cfg(test)]
pub(super) mod testing {
    use super::*;
    use crate::task::tests::task;

    /// Two ranges, the task that joins them, and the task that checks the result.
    pub(in crate::engine) fn round() -> Vec<RoundTask> {
        let kinds = [Kind::Range, Kind::Range, Kind::Join, Kind::Check];
        let needs = [vec![], vec![], vec![0, 1], vec![2]];
        let entry = |(place, (kind, needs)): (usize, (Kind, Vec<usize>))| RoundTask {
            key: task(&place.to_string(), kind, &[]).recipe.key(),
            kind,
            subject: "blade's".to_owned(),
            needs,
            cost: Cost { cpu_s: 90.0, memory: 300_000_000, disk: 5 },
            command: ["/opt/my lamp", "batch", "task", &place.to_string()]
                .map(str::to_owned)
                .to_vec(),
        };
        kinds.into_iter().zip(needs).enumerate().map(entry).collect()
    }
}
