//! Work in a thread of its own, without Python's lock. The thread that waits for it looks for
//! signals, so Ctrl-C ends the wait and the work.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use lamp_pipeline::Error;
use lamp_pipeline::watcher::{Importance, Remark, Watcher};
use lamp_stack::{Layer, MemorySize, PassingLayer};
use pyo3::prelude::*;
use serde_json::Value;

use crate::error::{exception, stopped};

/// Layers on their way from stage to stage.
pub(crate) type Flow<'a> = Box<dyn Iterator<Item = Result<PassingLayer, Error>> + 'a>;

/// Groups of layers that wait for a slow reader: more would only take memory.
const WAITING: usize = 2;
/// A group of layers: small layers would otherwise take less time than to hand them over.
const GROUP_LAYERS: usize = 16;
const GROUP_BYTES: usize = 1 << 20;
const GROUP_TIME: Duration = Duration::from_millis(10);
/// How often a wait looks for signals.
const LOOK: Duration = Duration::from_millis(50);
/// How long stopped work may take to remove its temporary files.
const GRACE: Duration = Duration::from_secs(1);

enum Message {
    Layers(Vec<Layer>),
    Remark(String, Importance),
    Done(Result<Value, Error>),
}

/// The end of work that is in the thread.
#[derive(Clone)]
pub(crate) struct Work {
    sender: SyncSender<Message>,
    stop: Arc<AtomicBool>,
}

impl Work {
    /// Gives layers to the waiting thread, also those before an error.
    pub(crate) fn give(&self, mut layers: Flow<'_>) -> Result<(), Error> {
        let (mut group, mut bytes, mut begun) = (Vec::new(), 0, Instant::now());
        let send = |group: &mut Vec<Layer>| match group.is_empty() {
            true => Ok(()),
            false => {
                let group = Message::Layers(std::mem::take(group));
                self.sender.send(group).map_err(|_| stopped())
            }
        };
        let given = layers.try_for_each(|layer| {
            let layer = layer?.decode()?;
            if group.is_empty() {
                (bytes, begun) = (0, Instant::now());
            }
            bytes += layer.bytes();
            group.push(layer);
            let is_full = group.len() >= GROUP_LAYERS || bytes >= GROUP_BYTES;
            if is_full || begun.elapsed() > GROUP_TIME { send(&mut group) } else { Ok(()) }
        });
        send(&mut group)?;
        given
    }

    /// Gives a line of a stage, unless it is a detail.
    pub(crate) fn say(&self, stage: &str, Remark { importance, text }: Remark) {
        if importance > Importance::Detail {
            self.say_line(format!("{stage}: {text}"), importance);
        }
    }

    /// Gives a line that names its stage.
    pub(crate) fn say_line(&self, line: String, importance: Importance) {
        // Nobody may be waiting anymore.
        let _ = self.sender.send(Message::Remark(line, importance));
    }

    /// Returns a watcher of a stage.
    pub(crate) fn watcher(&self, stage: &'static str) -> StageWatcher {
        StageWatcher { work: self.clone(), stage }
    }

    /// Returns layers that end with an error once nobody waits for the work.
    pub(crate) fn watched<'a>(&self, layers: Flow<'a>) -> Flow<'a> {
        let stop = self.stop.clone();
        Box::new(layers.map(move |layer| match stop.load(Ordering::Relaxed) {
            true => Err(stopped()),
            false => layer,
        }))
    }
}

/// Passes the remarks of a stage on.
pub(crate) struct StageWatcher {
    work: Work,
    stage: &'static str,
}

impl Watcher for StageWatcher {
    fn remark(&self, remark: Remark) {
        self.work.say(self.stage, remark);
    }

    fn is_stopped(&self) -> bool {
        self.work.stop.load(Ordering::Relaxed)
    }
}

/// Work that goes on in a thread.
pub(crate) struct Running {
    receiver: Receiver<Message>,
    stop: Arc<AtomicBool>,
    thread: JoinHandle<()>,
    /// Layers that have come.
    ready: VecDeque<Layer>,
}

/// A layer, or the report at the end.
pub(crate) enum Next {
    Layer(Box<Layer>),
    End(Value),
}

impl Running {
    /// Starts work.
    pub(crate) fn start(
        job: impl FnOnce(&Work) -> Result<Value, Error> + Send + 'static,
    ) -> PyResult<Self> {
        let (sender, receiver) = sync_channel(WAITING);
        let stop = Arc::new(AtomicBool::new(false));
        let work = Work { sender, stop: stop.clone() };
        let thread = thread::Builder::new().name("lamp".to_owned()).spawn(move || {
            let done = job(&work);
            let _ = work.sender.send(Message::Done(done));
        })?;
        Ok(Self { receiver, stop, thread, ready: VecDeque::new() })
    }

    /// Waits for the next layer or the end. Remarks on the way become warnings of the code that asks
    /// for it.
    pub(crate) fn next(&mut self, py: Python<'_>) -> PyResult<Next> {
        self.next_for(py, 1)
    }

    fn next_for(&mut self, py: Python<'_>, caller: u8) -> PyResult<Next> {
        let next = self.message(py, caller);
        if next.is_err() {
            self.stop(py);
        }
        next
    }

    /// Waits for the end of work, and returns its report.
    pub(crate) fn finish(self, py: Python<'_>) -> PyResult<Value> {
        self.finish_with_layers(py).map(|(_, report)| report)
    }

    /// Waits for the end of work, and returns its layers and its report.
    pub(crate) fn finish_with_layers(mut self, py: Python<'_>) -> PyResult<(Vec<Layer>, Value)> {
        let mut layers = Vec::new();
        loop {
            match self.next_for(py, WRAPPED)? {
                Next::Layer(layer) => layers.push(*layer),
                Next::End(report) => return Ok((layers, report)),
            }
        }
    }

    fn message(&mut self, py: Python<'_>, caller: u8) -> PyResult<Next> {
        loop {
            py.check_signals()?;
            if let Some(layer) = self.ready.pop_front() {
                return Ok(Next::Layer(Box::new(layer)));
            }
            // Shared references to a receiver stay in one thread, so it goes in as a whole.
            let receiver = &mut self.receiver;
            match py.detach(move || receiver.recv_timeout(LOOK)) {
                Ok(Message::Layers(layers)) => self.ready.extend(layers),
                Ok(Message::Remark(text, importance)) => warn(py, &text, importance, caller)?,
                Ok(Message::Done(Ok(report))) => return Ok(Next::End(report)),
                Ok(Message::Done(Err(error))) => return Err(exception(py, &error)),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(exception(py, &Error::work("an internal error ended the work")));
                }
            }
        }
    }

    /// Ends the work, and waits a moment for it to clean up.
    fn stop(&mut self, py: Python<'_>) {
        self.stop.store(true, Ordering::Relaxed);
        let Self { receiver, thread, .. } = self;
        py.detach(move || {
            let begun = Instant::now();
            while !thread.is_finished() && begun.elapsed() < GRACE {
                // Work that waits for a reader goes on to its end.
                let _ = receiver.recv_timeout(Duration::from_millis(10));
            }
        });
    }
}

/// The caller of a function of the package, by the number of Python's frames from here.
pub(crate) const WRAPPED: u8 = 2;

/// Warns in Python's way: a remark is shown once for each place that calls.
pub(crate) fn warn(py: Python<'_>, text: &str, importance: Importance, caller: u8) -> PyResult<()> {
    let name = if importance > Importance::Note { "LampWarning" } else { "LampNote" };
    let class = py.import("lamp_slicer._errors")?.getattr(name)?;
    py.import("warnings")?.call_method1("warn", (text, class, caller))?;
    Ok(())
}
