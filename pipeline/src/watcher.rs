//! Watchers of a stage at work: a terminal, or a list of lines.

use std::sync::{Arc, Mutex};

/// How much a line matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Importance {
    /// For people who ask for details.
    Detail,
    /// Worth knowing.
    Note,
    /// Something to look at.
    Warning,
}

/// A line about the work, for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remark {
    /// How much it matters.
    pub importance: Importance,
    /// The sentence.
    pub text: String,
}

impl Remark {
    /// Returns a line worth knowing.
    pub fn note(text: impl Into<String>) -> Self {
        Self { importance: Importance::Note, text: text.into() }
    }

    /// Returns a line about something to look at.
    pub fn warning(text: impl Into<String>) -> Self {
        Self { importance: Importance::Warning, text: text.into() }
    }
}

/// Watches a stage at work.
pub trait Watcher {
    /// Takes a line.
    fn remark(&self, remark: Remark);

    /// Takes the height that a search for layer heights has reached, in micrometers, in a part that
    /// is `part_um` high.
    fn height_reached(&self, part_um: [f64; 2], um: f64) {
        let _ = (part_um, um);
    }

    /// Takes the end of such a search.
    fn heights_found(&self) {}

    /// Returns whether nobody waits for the work anymore, so that a long search may end.
    fn is_stopped(&self) -> bool {
        false
    }
}

/// Keeps lines that are worth knowing, each after the name of its stage. Clones share the lines.
#[derive(Clone, Debug, Default)]
pub struct KeptRemarks {
    lines: Arc<Mutex<Vec<String>>>,
}

impl KeptRemarks {
    /// Returns a watcher of one stage.
    pub fn of<'a>(&'a self, stage: &'static str) -> impl Watcher + 'a {
        KeptOfStage { stage, kept: self }
    }

    /// Keeps a line.
    pub fn keep(&self, line: String) {
        self.lines.lock().expect("nobody panics while it is held").push(line);
    }

    /// Takes the lines out.
    pub fn take(&self) -> Vec<String> {
        std::mem::take(&mut *self.lines.lock().expect("nobody panics while it is held"))
    }
}

struct KeptOfStage<'a> {
    stage: &'static str,
    kept: &'a KeptRemarks,
}

impl Watcher for KeptOfStage<'_> {
    fn remark(&self, Remark { importance, text }: Remark) {
        // Kept lines become findings of a night, where nobody asked for details.
        if importance > Importance::Detail {
            self.kept.keep(format!("{}: {text}", self.stage));
        }
    }
}
