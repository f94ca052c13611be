//! The state of each part and build.

use serde::Serialize;

use crate::deliver::Deliverer;
use crate::ledger::{Ledger, State};
use crate::plan::{NightPlan, Subject, WantedResults};
use crate::store::{Manifest, Store};

/// The parts and builds of a night: failures first, then results that need a person.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Summary {
    /// The parts.
    pub parts: Vec<SubjectSummary>,
    /// The builds.
    pub builds: Vec<SubjectSummary>,
}

/// A part or a build.
#[derive(Clone, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SubjectSummary {
    /// The name in the night file.
    pub name: String,
    /// Its state.
    pub state: SubjectState,
    /// Why it failed or waits, or what a person should look at.
    pub why: Option<String>,
    /// Where its stack is.
    pub file: Option<String>,
    /// The number of layers of its stack.
    pub layers: Option<u64>,
    /// Bands of stray rows that `fix` corrected.
    pub stray_fixed: u64,
    /// Bands of stray rows that `fix` left; without `fix`, stray rows.
    pub stray_left: u64,
    /// Islands that its check finds.
    pub islands: u64,
    /// All that `lamp check` finds.
    pub findings: u64,
    /// The digest of the file.
    pub digest: Option<String>,
    /// Where it is among the parts and builds of the plan.
    #[serde(skip)]
    pub place: usize,
}

/// The state of a part or a build, the worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum SubjectState {
    /// It failed.
    Failed,
    /// A part of the build failed.
    Skipped,
    /// It is not done, and nothing failed.
    Waiting,
    /// It is done, with findings that need a person.
    NeedsPerson,
    /// It is done.
    Done,
}

impl SubjectState {
    /// Returns the words for it.
    pub fn words(self) -> &'static str {
        match self {
            Self::Failed => "failed",
            Self::Skipped => "skipped",
            Self::Waiting => "to do",
            Self::NeedsPerson => "needs a person",
            Self::Done => "done",
        }
    }
}

impl Summary {
    /// Gathers results from the store, and the rest from a run.
    pub fn new(plan: &NightPlan, deliverer: &Deliverer<'_>, ledger: &Ledger<'_>) -> Self {
        let all = plan.subjects.iter().enumerate();
        let mut lines: Vec<(bool, SubjectSummary)> = all
            .map(|(place, subject)| (subject.is_build, line(place, subject, deliverer, ledger)))
            .collect();
        // The sort keeps the order of the night file.
        lines.sort_by_key(|(_, line)| line.state);
        let of = |wanted: bool| {
            let lines = lines.iter().filter(|(is_build, _)| *is_build == wanted);
            lines.map(|(_, line)| line.clone()).collect()
        };
        Self { parts: of(false), builds: of(true) }
    }

    /// Returns parts, and then builds.
    pub fn lines(&self) -> impl Iterator<Item = &SubjectSummary> {
        self.parts.iter().chain(&self.builds)
    }

    /// Returns how many parts and builds are in a state.
    pub fn count(&self, state: SubjectState) -> usize {
        self.lines().filter(|line| line.state == state).count()
    }

    /// Says that results could not be delivered.
    pub fn add_failures(&mut self, failures: &[(String, String)]) {
        for line in self.parts.iter_mut().chain(&mut self.builds) {
            if let Some((_, why)) = failures.iter().find(|(name, _)| *name == line.name) {
                line.state = SubjectState::Failed;
                line.why = Some(why.clone());
            }
        }
        self.parts.sort_by_key(|line| line.state);
        self.builds.sort_by_key(|line| line.state);
    }
}

fn line(
    place: usize,
    subject: &Subject,
    deliverer: &Deliverer<'_>,
    ledger: &Ledger<'_>,
) -> SubjectSummary {
    let mut line = SubjectSummary {
        name: subject.name.clone(),
        state: SubjectState::Waiting,
        why: None,
        file: None,
        layers: None,
        stray_fixed: 0,
        stray_left: 0,
        islands: 0,
        findings: 0,
        digest: None,
        place,
    };
    let wanted = match &subject.wanted {
        Ok(wanted) => wanted,
        Err(why) => {
            line.state =
                if subject.is_build { SubjectState::Skipped } else { SubjectState::Failed };
            line.why = Some(why.clone());
            return line;
        }
    };
    let store = deliverer.store;
    let stack = store.manifest(wanted.stack);
    let check = wanted.check.map(|check| store.manifest(check));
    if let Some(stack) = &stack {
        line.add_stack(stack);
        let delivered = deliverer.delivered(subject);
        line.file = delivered.as_ref().map(|_| deliverer.path(subject).display().to_string());
        line.digest = delivered.map(|delivered| delivered.digest);
    }
    if let Some(counts) = check.as_ref().and_then(|check| check.as_ref()?.facts.check) {
        line.islands = counts.islands;
        line.findings = counts.findings;
    }
    (line.state, line.why) = if stack.is_some() && check.is_none_or(|check| check.is_some()) {
        match line.needs() {
            None => (SubjectState::Done, None),
            needs => (SubjectState::NeedsPerson, needs),
        }
    } else {
        line.unfinished(subject, wanted, ledger, store)
    };
    line
}

impl SubjectSummary {
    fn add_stack(&mut self, stack: &Manifest) {
        self.layers = Some(stack.facts.layers.unwrap_or(0));
        let Some(found) = &stack.facts.stages else { return };
        self.stray_fixed = found.bands_corrected as u64;
        let is_fixed = found.bands_corrected + found.bands_left > 0;
        let left = if is_fixed { found.bands_left } else { found.stray_rows };
        self.stray_left = left as u64;
    }

    /// Returns what a person should look at.
    fn needs(&self) -> Option<String> {
        let some = |count: u64, one: &str, more: &str| match count {
            0 => None,
            1 => Some(format!("1 {one}")),
            count => Some(format!("{count} {more}")),
        };
        let stray = some(self.stray_left, "stray band is left", "stray bands are left");
        let islands = some(self.islands, "island", "islands");
        let all: Vec<_> = stray.into_iter().chain(islands).collect();
        (!all.is_empty()).then(|| all.join(", "))
    }

    /// Returns why something is not done.
    fn unfinished(
        &self,
        subject: &Subject,
        wanted: &WantedResults,
        ledger: &Ledger<'_>,
        store: &Store,
    ) -> (SubjectState, Option<String>) {
        let missing: Vec<_> = wanted.goals().filter(|key| store.manifest(*key).is_none()).collect();
        let why = missing.iter().find_map(|key| ledger.why(*key)).map(str::to_owned);
        let is_own = missing.iter().any(|key| matches!(ledger.state(*key), State::Failed(_)));
        match why {
            Some(why) if subject.is_build && !is_own => {
                (SubjectState::Skipped, Some(format!("a part of it failed: {why}")))
            }
            Some(why) => (SubjectState::Failed, Some(why)),
            None => (SubjectState::Waiting, ledger.no_room().map(str::to_owned)),
        }
    }
}
