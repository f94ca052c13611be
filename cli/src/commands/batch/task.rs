//! `lamp batch task KEY`: does one task. Engines run it.

use std::env;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, anyhow};
use lamp_batch::{
    Damage, Digests, Event, Journal, Key, Manifest, Store, Task, Unpublished, Written, host, now,
    status,
};
use lamp_pipeline::RangeFindings;
use lamp_stack::{
    Destination, Format, IndexedStack, KEY_LAYERS, Layer, PackLevel, Page, StackError, join_packed,
    write_packed,
};
use serde::Serialize;
use serde_json::{Map, Value};

use super::TaskArgs;
use super::resources;
use super::work::{Checked, What, Work};
use crate::commands::report::{Picture, of_layer};
use crate::exit::Exit;
use crate::stages::Stages;
use crate::stages::calls::{Checking, Tiling};
use crate::terminal::out_of_memory;

type Layers<'a> = dyn Iterator<Item = Result<Layer, Exit>> + 'a;
type Write<'a> = dyn FnMut(&mut Layers<'_>) -> Result<(), Exit> + 'a;

pub(super) fn run(args: &TaskArgs) -> Result<(), Exit> {
    let store = Store::open(&args.store).map_err(anyhow::Error::new)?;
    let key = args.key;
    let Some(task) = store.task(key) else {
        let problem = format!("{}: the store knows no such task: run its batch again", key.short());
        return Err(Exit::Failed(anyhow!(problem)));
    };
    if let Some(parent) = args.parent {
        end_with(parent);
    }
    out_of_memory::end_with(status::NO_MEMORY);
    if store.manifest(key).is_some() {
        return Ok(());
    }
    let started = Instant::now();
    let done = do_task(&store, &task);
    let why = done.as_ref().err().map(|error| why_of(&store, &task, error));
    let end = Event {
        at: now(),
        host: host(),
        engine: args.engine.clone(),
        key,
        kind: task.recipe.kind,
        subject: task.subject,
        label: task.label,
        seconds: started.elapsed().as_secs_f64(),
        cpu_s: resources::cpu_s(),
        memory: resources::peak_memory(),
        status: Some(done.as_ref().err().map_or(status::DONE, status_of)),
        why: why.clone(),
    };
    let told = Journal::open(&store).and_then(|mut journal| journal.append(&end));
    match (done, told) {
        // A task without its line in the journal is done all the same.
        (Ok(()), _) => Ok(()),
        (Err(error), _) => Err(Exit::Task(status_of(&error) as u8, why.unwrap_or_default())),
    }
}

/// Returns an error's text, with names of parts where it has files of the store.
fn why_of(store: &Store, task: &Task, error: &Exit) -> String {
    let named = |text: String, need: &Key| match store.task(*need) {
        Some(task) => text.replace(&store.result(*need).display().to_string(), &task.subject),
        None => text,
    };
    task.needs.iter().fold(error.to_string(), named)
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

#[cfg(not(target_os = "linux"))]
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

fn do_task(store: &Store, task: &Task) -> Result<(), Exit> {
    let work: Work = serde_json::from_value(task.work.clone())
        .context("the task is of another version of lamp: run its batch again")?;
    env::set_current_dir(&work.folder).with_context(|| work.folder.display().to_string())?;
    check_files(store, task)?;
    let needs = needed(store, task)?;
    let mut facts = Map::new();
    facts.extend(sum_of_findings(&needs).map(|sum| (STAGES.to_owned(), sum)));
    let stacks: Vec<PathBuf> = task.needs.iter().map(|need| store.result(*need)).collect();
    let doing = Doing { store, key: task.recipe.key() };
    let result = match work.what {
        What::Range { part, stored_name, stages, layers } => {
            doing.range(&part, &stored_name, &stages, layers, &mut facts)?
        }
        What::Join => {
            let layers: u64 =
                needs.iter().filter_map(|need| need.facts.get(LAYERS)?.as_u64()).sum();
            facts.insert(LAYERS.to_owned(), layers.into());
            doing.join(&stacks)?
        }
        What::Whole { part, stages, which } => {
            let parsed = parsed(&stages)?;
            let run = |write: &mut Write<'_>| parsed.after[which].run(&part, &stacks[0], write);
            doing.stack(&mut facts, |write| Ok(run(write)?.notes()))?
        }
        What::Check { words } => doing.check(&stacks[0], &words, &mut facts)?,
        What::Tile { words, copies } => {
            let stacks: Vec<_> = stacks.into_iter().zip(copies.iter().copied()).collect();
            let tiling = Tiling::parse(&words, &copies, Path::new("")).map_err(Exit::usage)?;
            doing.stack(&mut facts, |write| tiling.run(&stacks, write))?
        }
    };
    let manifest = Manifest { recipe: task.recipe.clone(), result: Some(result), facts };
    Ok(store.publish(&manifest).map_err(anyhow::Error::new)?)
}

/// Checks that files have not changed since the task was planned.
fn check_files(store: &Store, task: &Task) -> Result<(), Exit> {
    let mut digests = Digests::of(store);
    for file in &task.files {
        let digest = digests.digest(&file.path);
        let digest = digest.with_context(|| file.path.display().to_string())?;
        if digest != file.digest {
            return Err(Exit::Failed(anyhow!(
                "{}: it has changed since the batch was planned: run the batch again",
                file.path.display()
            )));
        }
    }
    Ok(())
}

/// Returns the manifests of what the task needs, once their results are proved. All that are
/// damaged are taken away.
fn needed(store: &Store, task: &Task) -> Result<Vec<Manifest>, Exit> {
    let mut proved = Vec::new();
    let mut damaged: Option<Exit> = None;
    for need in &task.needs {
        match store.check(*need) {
            Ok(manifest) => proved.push(manifest),
            Err(damage) => {
                store.forget(*need).map_err(anyhow::Error::new)?;
                let name = format!("the result of {} is made again", named(store, *need));
                let error = anyhow::Error::new(damage).context(name);
                damaged.get_or_insert(Exit::Failed(error));
            }
        }
    }
    damaged.map_or(Ok(proved), Err)
}

/// Returns the name of a task for people.
pub(super) fn named(store: &Store, key: Key) -> String {
    let task = store.task(key);
    task.map_or_else(|| key.short(), |task| format!("{} ({})", task.subject, task.label))
}

fn parsed(stages: &[Vec<String>]) -> Result<Stages, Exit> {
    Stages::parse(stages, Path::new("")).map_err(|error| Exit::usage(error.to_string()))
}

/// The facts of what stages found, and of how many layers there are.
pub(super) const STAGES: &str = "stages";
pub(super) const LAYERS: &str = "layers";
/// The facts of a check: islands, and all findings.
pub(super) const ISLANDS: &str = "islands";
pub(super) const FINDINGS: &str = "findings";

/// Adds up what stages found in the layers that a task uses, if they found anything.
fn sum_of_findings(needs: &[Manifest]) -> Option<Value> {
    let found = needs.iter().filter_map(findings_of);
    found.reduce(RangeFindings::joined).as_ref().map(value)
}

/// Returns what stages found in the layers of a result.
pub(super) fn findings_of(manifest: &Manifest) -> Option<RangeFindings> {
    serde_json::from_value(manifest.facts.get(STAGES)?.clone()).ok()
}

fn value(facts: &impl Serialize) -> Value {
    serde_json::to_value(facts).expect("facts have text keys")
}

/// A task that is being done.
struct Doing<'a> {
    store: &'a Store,
    key: Key,
}

impl Doing<'_> {
    fn begin(&self) -> Result<Unpublished, Exit> {
        self.store.begin(self.key).map_err(|error| Exit::Output(error.into()))
    }

    /// Makes layers of a part.
    fn range(
        &self,
        part: &Path,
        stored_name: &str,
        stages: &[Vec<String>],
        layers: Range<u32>,
        facts: &mut Map<String, Value>,
    ) -> Result<Written, Exit> {
        let stages = parsed(stages)?;
        let result = self.begin()?;
        let mut count = 0;
        let findings = stages.chain.run(part, stored_name, layers, |layers| {
            write(&mut layers.map(|layer| Ok(layer?)).inspect(|_| count += 1), &result)
        })?;
        facts.insert(STAGES.to_owned(), value(&findings));
        facts.insert(LAYERS.to_owned(), count.into());
        finish(result)
    }

    /// Joins ranges of a part.
    fn join(&self, ranges: &[PathBuf]) -> Result<Written, Exit> {
        let result = self.begin()?;
        join_packed(ranges, stream(&result), Format::Big, PackLevel::default())?;
        finish(result)
    }

    /// Makes a stack of others. `make` gives its layers to what writes them, and returns notes.
    fn stack(
        &self,
        facts: &mut Map<String, Value>,
        make: impl FnOnce(&mut Write<'_>) -> Result<Vec<String>, Exit>,
    ) -> Result<Written, Exit> {
        let result = self.begin()?;
        let mut count = 0;
        let notes = make(&mut |layers| write(&mut layers.inspect(|_| count += 1), &result))?;
        facts.insert(LAYERS.to_owned(), count.into());
        if !notes.is_empty() {
            facts.insert("notes".to_owned(), value(&notes));
        }
        finish(result)
    }

    /// Finds what needs a person in a stack, and draws a layer.
    fn check(
        &self,
        stack: &Path,
        words: &[String],
        facts: &mut Map<String, Value>,
    ) -> Result<Written, Exit> {
        let found = Checking::parse(words, Path::new("")).map_err(Exit::usage)?.run(stack)?;
        let islands = found.kinds.get("island").copied().unwrap_or(0);
        facts.insert(ISLANDS.to_owned(), islands.into());
        facts.insert(FINDINGS.to_owned(), found.found().into());
        let checked = Checked { picture: Some(middle(stack)?), lines: found.lines };
        let result = self.begin()?;
        let written = serde_json::to_writer(result.file(), &checked);
        written.map_err(|error| Exit::Output(io::Error::from(error).into()))?;
        finish(result)
    }
}

/// Writes layers as the store has them.
fn write(layers: &mut Layers<'_>, result: &Unpublished) -> Result<(), Exit> {
    write_packed(layers, stream(result), Format::Big, PackLevel::default())
}

fn stream(result: &Unpublished) -> Destination {
    Destination::Stream(Box::new(result.file()))
}

fn finish(result: Unpublished) -> Result<Written, Exit> {
    result.finish().map_err(|error| Exit::output(error, "the store"))
}

/// Draws a layer in the middle of a stack: one that stands in the pack by itself.
pub(super) fn middle(stack: &Path) -> Result<Picture, Exit> {
    let failed = |error: StackError| Exit::Failed(error.into()).at(stack.display().to_string());
    let stack = IndexedStack::open(stack).map_err(failed)?;
    let half = stack.headers().len() / 2;
    let position = half - half % KEY_LAYERS as usize;
    let layer = stack.page(position).and_then(Page::decode).map_err(failed)?;
    Ok(of_layer(&layer))
}
