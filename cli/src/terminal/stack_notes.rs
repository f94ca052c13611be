//! Prints what readers find beside the layers of stacks, each note once.

use std::collections::HashSet;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use lamp_stack::{Pages, StackNote};

use crate::streams::input_name;
use crate::terminal::progress::Severity;

/// The notes that were printed.
#[derive(Default)]
struct Printed {
    command: String,
    quiet: bool,
    /// A stack may be read more than once.
    lines: HashSet<String>,
    is_doubtful: bool,
}

static PRINTED: Mutex<Option<Printed>> = Mutex::new(None);

fn printed() -> MutexGuard<'static, Option<Printed>> {
    PRINTED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Prints notes under the name of a command; only doubts if it is `quiet`.
pub(crate) fn print_notes_of(command: &str, quiet: bool) {
    printed().get_or_insert_default().command = command.to_owned();
    printed().get_or_insert_default().quiet = quiet;
}

/// Prints the notes of a stack as they are found.
pub(crate) fn noting(pages: Pages, path: &Path) -> Pages {
    let path = path.to_owned();
    pages.with_listener(move |note| print_note(&path, &note))
}

/// Prints a note on a stack.
pub(crate) fn print_note(path: &Path, note: &StackNote) {
    let mut printed = printed();
    let printed = printed.get_or_insert_default();
    let line = format!("{}: {}: {note}", printed.command, input_name(path));
    // For --strict, which asks only at the end.
    printed.is_doubtful |= note.is_doubt();
    let severity = if note.is_doubt() { Severity::Warning } else { Severity::Note };
    if (note.is_doubt() || !printed.quiet) && printed.lines.insert(line.clone()) {
        severity.say(&line);
    }
}

/// Returns what `--strict` says of doubts about the stacks that were read, if there were any.
pub(crate) fn doubts() -> Option<String> {
    let is_doubtful = printed().as_ref().is_some_and(|printed| printed.is_doubtful);
    is_doubtful.then(|| {
        "the pages that were read may not be one whole stack, as the message above states: repair \
         the folder, or leave out --strict"
            .to_owned()
    })
}
