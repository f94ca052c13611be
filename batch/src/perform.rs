//! Does one task, in the process that an engine started for it.

use std::env;
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use lamp_pipeline::RangeFindings;
use lamp_stack::{Destination, Format, PackLevel, StackError, join_packed, write_packed};

use crate::assignment::{Assignment, Work};
use crate::commands::{Commands, LayersOf, Stages, WriteLayers};
use crate::engine::status;
use crate::error::BatchError;
use crate::journal::{Event, Journal, host, now};
use crate::key::Key;
use crate::resources;
use crate::store::{Digests, Facts, Manifest, Store, Unpublished, Written};
use crate::task::Task;

/// Does a task of a store, and writes how it went to the journal. Does nothing if it is done
/// already. `engine` is the name of the engine for the journal.
///
/// # Errors
/// Returns an error, and the text that the journal has of it, with names of parts where the error
/// names files of the store.
pub fn perform<C: Commands>(
    store: &Store,
    key: Key,
    engine: &str,
    commands: &C,
) -> Result<(), (C::Error, String)> {
    let Some(task) = store.task(key) else {
        let error = C::Error::from(BatchError::NoTask(key));
        let why = error.to_string();
        return Err((error, why));
    };
    if store.manifest(key).is_some() {
        return Ok(());
    }
    let started = Instant::now();
    let done = Performer { store, key: task.recipe.key(), commands }.perform(&task);
    let done = done.map_err(|error| {
        let why = why_of(store, &task, &error.to_string());
        (error, why)
    });
    let end = Event {
        at: now(),
        host: host(),
        engine: engine.to_owned(),
        key,
        kind: task.recipe.kind,
        subject: task.subject,
        label: task.label,
        seconds: started.elapsed().as_secs_f64(),
        cpu_s: resources::cpu_s(),
        memory: resources::peak_memory(),
        status: Some(done.as_ref().err().map_or(status::DONE, |(error, _)| commands.status(error))),
        why: done.as_ref().err().map(|(_, why)| why.clone()),
    };
    // A task without its line in the journal is done all the same.
    let _ = Journal::open(store).and_then(|mut journal| journal.append(&end));
    done
}

/// Returns an error's text, with names of parts where it has files of the store.
fn why_of(store: &Store, task: &Task, error: &str) -> String {
    let named = |text: String, need: &Key| match store.task(*need) {
        Some(task) => text.replace(&store.result(*need).display().to_string(), &task.subject),
        None => text,
    };
    task.needs.iter().fold(error.to_owned(), named)
}

/// A task that is being done.
struct Performer<'a, C> {
    store: &'a Store,
    key: Key,
    commands: &'a C,
}

impl<C: Commands> Performer<'_, C> {
    fn perform(&self, task: &Task) -> Result<(), C::Error> {
        let assignment: Assignment =
            serde_json::from_value(task.work.clone()).map_err(BatchError::OtherVersion)?;
        let folder = &assignment.folder;
        env::set_current_dir(folder).map_err(BatchError::file(folder))?;
        self.check_files(task)?;
        let needs = self.needed(task)?;
        let found = needs.iter().filter_map(|need| need.facts.stages.clone());
        let mut facts = Facts { stages: found.reduce(RangeFindings::joined), ..Facts::default() };
        let stacks: Vec<PathBuf> = task.needs.iter().map(|need| self.store.result(*need)).collect();
        let result = match assignment.what {
            Work::Range { part, stored_name, stages, layers } => {
                self.range(&part, &stored_name, &stages, layers, &mut facts)?
            }
            Work::Join => {
                facts.layers = Some(needs.iter().filter_map(|need| need.facts.layers).sum());
                self.join(&stacks)?
            }
            Work::Whole { part, stages, which } => {
                let stages = self.stages(&stages)?;
                let run = |write: &mut WriteLayers<'_, C::Error>| {
                    self.commands.run_whole(&stages.after[which], &part, &stacks[0], write)
                };
                self.stack(&mut facts, |write| Ok(run(write)?.notes()))?
            }
            Work::Check { words } => {
                let check = self.commands.check(&words, Path::new(""));
                let check = check.map_err(BatchError::Options)?;
                let result = self.begin()?;
                // The file must be closed again before the result is finished.
                facts.check =
                    Some(self.commands.run_check(&check, &stacks[0], &mut &*result.file())?);
                finish(result)?
            }
            Work::Tile { words, copies } => {
                let stacks: Vec<_> = stacks.into_iter().zip(copies.iter().copied()).collect();
                let tile = self.commands.tile(&words, &copies, Path::new(""));
                let tile = tile.map_err(BatchError::Options)?;
                self.stack(&mut facts, |write| self.commands.run_tile(&tile, &stacks, write))?
            }
        };
        let manifest = Manifest { recipe: task.recipe.clone(), result: Some(result), facts };
        Ok(self.store.publish(&manifest).map_err(BatchError::from)?)
    }

    /// Checks that files have not changed since the task was planned.
    fn check_files(&self, task: &Task) -> Result<(), BatchError> {
        let mut digests = Digests::of(self.store);
        for file in &task.files {
            let digest = digests.digest(&file.path).map_err(BatchError::file(&file.path))?;
            if digest != file.digest {
                return Err(BatchError::Changed(file.path.clone()));
            }
        }
        Ok(())
    }

    /// Returns the manifests of what the task needs, once their results are proved. All that are
    /// damaged are taken away.
    fn needed(&self, task: &Task) -> Result<Vec<Manifest>, BatchError> {
        let mut proved = Vec::new();
        let mut damaged = None;
        for &need in &task.needs {
            match self.store.check(need) {
                Ok(manifest) => proved.push(manifest),
                Err(source) => {
                    self.store.forget(need)?;
                    let name = self.store.name_of(need);
                    damaged.get_or_insert(BatchError::Damaged { name, source });
                }
            }
        }
        damaged.map_or(Ok(proved), Err)
    }

    fn stages(&self, stages: &[Vec<String>]) -> Result<Stages<C::Whole>, BatchError> {
        Ok(self.commands.stages(stages, Path::new(""))?)
    }

    fn begin(&self) -> Result<Unpublished, BatchError> {
        self.store.begin(self.key).map_err(BatchError::Begin)
    }

    /// Makes layers of a part.
    fn range(
        &self,
        part: &Path,
        stored_name: &str,
        stages: &[Vec<String>],
        layers: Range<u32>,
        facts: &mut Facts,
    ) -> Result<Written, C::Error> {
        let stages = self.stages(stages)?;
        let result = self.begin()?;
        let mut count = 0;
        let findings = stages.chain.run(part, stored_name, layers, |layers| {
            write::<C::Error>(&mut layers.map(|layer| Ok(layer?)).inspect(|_| count += 1), &result)
        })?;
        facts.stages = Some(findings);
        facts.layers = Some(count);
        Ok(finish(result)?)
    }

    /// Joins ranges of a part.
    fn join(&self, ranges: &[PathBuf]) -> Result<Written, BatchError> {
        let result = self.begin()?;
        join_packed(ranges, stream(&result), Format::Big, PackLevel::default())?;
        finish(result)
    }

    /// Makes a stack of others. `make` gives its layers to what writes them, and returns notes.
    fn stack(
        &self,
        facts: &mut Facts,
        make: impl FnOnce(&mut WriteLayers<'_, C::Error>) -> Result<Vec<String>, C::Error>,
    ) -> Result<Written, C::Error> {
        let result = self.begin()?;
        let mut count = 0;
        facts.notes = make(&mut |layers| write(&mut layers.inspect(|_| count += 1), &result))?;
        facts.layers = Some(count);
        Ok(finish(result)?)
    }
}

/// Writes layers as the store has them.
fn write<E: fmt::Display + From<StackError> + Send>(
    layers: &mut LayersOf<'_, E>,
    result: &Unpublished,
) -> Result<(), E> {
    write_packed(layers, stream(result), Format::Big, PackLevel::default())
}

fn stream(result: &Unpublished) -> Destination {
    Destination::Stream(Box::new(result.file()))
}

fn finish(result: Unpublished) -> Result<Written, BatchError> {
    result.finish().map_err(BatchError::Result)
}
