//! `lamp batch night.toml`: does what is missing.

use std::thread;

use anyhow::{Context, anyhow};
use lamp_batch::{
    Attempt, Deliverer, DiskRoom, End, Engine, Event, Journal, Launcher, Ledger, NamedTasks,
    NightPlan, SubjectState, Summary, Work, host, now,
};

use super::night_file::NightFile;
use super::notify::notify;
use super::report;
use super::watch::watch;
use super::{EngineName, RunArgs};
use crate::args::options::Common;
use crate::exit::Exit;
use crate::started;
use crate::terminal::progress::Progress;

pub(super) fn run(args: &RunArgs, common: &Common) -> Result<(), Exit> {
    let Some(night) = &args.night else {
        return Err(Exit::usage(
            "name a night file, such as lamp batch night.toml (docs/batch.md)",
        ));
    };
    if let Some(folder) = &args.watch {
        return watch(night, folder, args, common);
    }
    let progress = Progress::new("batch", common, true);
    let file = NightFile::open(night)?;
    let done = make(&file, args, &progress)?;
    if done.end.is_ok() {
        let folder = file.night.output.folder.display();
        progress.say(&format!("all is done: {folder} has {}", counts(&done.summary)));
    }
    done.end
}

/// The outcome of making a night.
pub(super) struct Made {
    pub(super) summary: Summary,
    /// Whether tasks wait, since the store's disk is full.
    pub(super) is_full: bool,
    pub(super) end: Result<(), Exit>,
}

/// Makes what is missing of a night.
pub(super) fn make(file: &NightFile, args: &RunArgs, progress: &Progress) -> Result<Made, Exit> {
    let store = file.store()?;
    let plan = file.plan(&store)?;
    let goals = plan.goals();
    let named = NamedTasks::new(file.path.clone(), &plan.graph, &goals);
    named.keep(&store).map_err(anyhow::Error::new)?;
    let deliverer = Deliverer { store: &store, output: &file.night.output };
    let open = plan.subjects.iter().enumerate();
    let open: Vec<_> = open.filter(|(_, subject)| deliverer.delivered(subject).is_none()).collect();
    for (_, subject) in &open {
        if let Some(damage) = deliverer.take_damaged(subject)? {
            progress.warn(&format!("{}: {damage}: it is made again", subject.name));
        }
    }
    let mut ledger = Ledger::new(&plan.graph, &store, &goals, args.retries);
    let is_new = !ledger.keys().is_empty();
    if is_new && let Some(shortage) = DiskRoom::of(&plan, &ledger, &deliverer).shortage() {
        progress.warn(&shortage);
    }
    let report = file.night.output.folder.join("report.html");
    let launcher = Launcher { program: started::program().context("this program")? };
    let work = Work { graph: &plan.graph, store: &store, launcher: &launcher };
    let mut running = Running { plan: &plan, progress, engine: args.engine(), done: 0 };
    // Who watches a folder gets a line for each part.
    running.begin(&ledger, args.watch.is_none());
    let failed = thread::scope(|scope| {
        let (deliver, delivered) = deliverer.start(scope, &plan.subjects);
        for &(place, subject) in &open {
            let is_done = |key| store.manifest(key).is_some();
            if subject.wanted.as_ref().is_ok_and(|wanted| is_done(wanted.stack)) {
                // The thread listens until nobody can send.
                let _ = deliver.send(place);
            }
        }
        let engine = running.engine.clone();
        let ran = engine.run(&work, &mut ledger, &mut |attempt| {
            running.tell(attempt, &store);
            if attempt.end == End::Done {
                for place in plan.stacks_of(attempt.key) {
                    let _ = deliver.send(place);
                }
            }
        });
        drop(deliver);
        let failed = delivered.join().expect("the thread that delivers does not panic");
        ran.map(|()| failed)
    });
    let failed = failed.map_err(|error| Exit::Failed(error.into()))?;
    let mut summary = Summary::new(&plan, &deliverer, &ledger);
    let failed = failed.into_iter().map(|(name, error)| (name, Exit::from(error).to_string()));
    summary.add_failures(&failed.collect::<Vec<_>>());
    if is_new || !report::is_written(&report, &store, &summary)? {
        report::write(&report, file, &plan, &store, &summary)?;
        if args.watch.is_none() {
            progress.wrote(&report, &[counts(&summary)]);
        }
    }
    let end = end(&summary, &ledger);
    if let Some(command) = &args.notify {
        notify(command, end.as_ref().err().map_or(0, Exit::status), &summary, progress);
    }
    Ok(Made { is_full: ledger.no_room().is_some(), summary, end })
}

impl RunArgs {
    fn engine(&self) -> Engine {
        match self.engine {
            EngineName::Local => Engine::Local(self.local.engine()),
            EngineName::HyperQueue => Engine::HyperQueue,
            EngineName::Slurm => Engine::Slurm,
        }
    }
}

/// A run, for who watches it.
struct Running<'a> {
    plan: &'a NightPlan,
    progress: &'a Progress,
    engine: Engine,
    done: usize,
}

impl Running<'_> {
    fn begin(&self, ledger: &Ledger<'_>, with_faults: bool) {
        let NightPlan { graph, subjects } = self.plan;
        let to_do = ledger.keys().len();
        for subject in subjects.iter().filter(|subject| with_faults && !subject.is_build) {
            if let Err(why) = &subject.wanted {
                self.progress.warn(&format!("{}: failed: {why}", subject.name));
            }
        }
        if to_do > 0 {
            let all = graph.keys().len();
            self.progress.say(&format!("{to_do} of {all} tasks are to do"));
        }
    }

    /// Reports an attempt, and writes a crash to the journal, since its task could not.
    fn tell(&mut self, attempt: &Attempt, store: &lamp_batch::Store) {
        let task = self.plan.graph.task(attempt.key);
        let name = format!("{} ({})", task.subject, task.label);
        let why = match &attempt.end {
            End::Done => {
                self.done += 1;
                return self.progress.detail(&format!("{name} is done"));
            }
            End::Bad(why) | End::Failed(why) | End::Damaged(why) => why,
            End::NoRoom(why) => {
                let stop = "no more tasks are started";
                return self.progress.warn(&format!("{name}: {why}: {stop}"));
            }
            End::Crashed(why) => {
                let event = Event {
                    at: now(),
                    host: host(),
                    engine: self.engine.name().to_owned(),
                    key: attempt.key,
                    kind: task.recipe.kind,
                    subject: task.subject.clone(),
                    label: task.label.clone(),
                    seconds: 0.0,
                    cpu_s: None,
                    memory: None,
                    status: None,
                    why: Some(why.clone()),
                };
                let told = Journal::open(store).and_then(|mut journal| journal.append(&event));
                if let Err(error) = told {
                    self.progress.warn(&format!("the journal cannot be written: {error}"));
                }
                why
            }
        };
        let then = if attempt.again { "it is tried again" } else { "it is set aside" };
        self.progress.warn(&format!("{name}: {why}: {then}"));
    }
}

/// Returns how the batch ends.
fn end(summary: &Summary, ledger: &Ledger<'_>) -> Result<(), Exit> {
    if ledger.no_room().is_some() {
        let problem =
            "the store's disk is full: make room, and run the same command again to go on";
        return Err(Exit::Failed(anyhow!(problem)));
    }
    let [failed, skipped, waiting, person] = [
        SubjectState::Failed,
        SubjectState::Skipped,
        SubjectState::Waiting,
        SubjectState::NeedsPerson,
    ]
    .map(|state| summary.count(state));
    if failed + skipped + waiting > 0 {
        let names = summary.lines().filter(|line| line.state == SubjectState::Failed);
        let names: Vec<&str> = names.map(|line| line.name.as_str()).take(5).collect();
        let skipped =
            if skipped > 0 { format!(", {skipped} skipped for them") } else { String::new() };
        let problem = format!(
            "{failed} of {} failed ({}){skipped}: report.html says why, and the same command tries \
             them again",
            counts(summary),
            names.join(", ")
        );
        return Err(Exit::Failed(anyhow!(problem)));
    }
    if person > 0 {
        let names = summary.lines().filter(|line| line.state == SubjectState::NeedsPerson);
        let text = names
            .take(5)
            .map(|line| format!("{}: {}", line.name, line.why.as_deref().unwrap_or_default()));
        let text = text.collect::<Vec<_>>().join("; ");
        let verb = if person == 1 { "needs" } else { "need" };
        return Err(Exit::Findings(format!("all is done, and {person} {verb} a person: {text}")));
    }
    Ok(())
}

/// `20 parts and 3 builds`
pub(super) fn counts(summary: &Summary) -> String {
    let some = |count: usize, one: &str| match count {
        1 => format!("1 {one}"),
        count => format!("{count} {one}s"),
    };
    match summary.builds.len() {
        0 => some(summary.parts.len(), "part"),
        builds => format!("{} and {}", some(summary.parts.len(), "part"), some(builds, "build")),
    }
}
