//! Progress and messages on standard error.

use std::borrow::Cow;
use std::io::{self, IsTerminal, Write};
use std::sync::{Arc, Mutex};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use lamp_adaptive::{LayeredPart, SweptLayer};

use crate::options::Common;

/// Prints messages and a progress bar.
#[derive(Clone)]
pub(crate) struct Progress {
    command: &'static str,
    quiet: bool,
    verbose: bool,
    watched: bool,
    bar: ProgressBar,
    /// Where lines go instead of standard error.
    notes: Option<Notes>,
}

/// Lines that are kept instead of printed.
pub(crate) type Notes = Arc<Mutex<Vec<String>>>;

impl Progress {
    /// Returns progress without a bar, whose lines go into `notes`: without those for who asks for
    /// details.
    pub(crate) fn noting(command: &'static str, notes: &Notes) -> Self {
        let (bar, notes) = (ProgressBar::hidden(), Some(Arc::clone(notes)));
        Self { command, quiet: false, verbose: false, watched: false, bar, notes }
    }

    /// Returns progress with a bar if standard error is a terminal. Of the stages of a pipeline
    /// only the last shows one (`is_last`), because they share the terminal.
    pub(crate) fn new(command: &'static str, common: &Common, is_last: bool) -> Self {
        let &Common { quiet, verbose, .. } = common;
        let watched = !quiet && is_last && io::stderr().is_terminal();
        let bar = ProgressBar::hidden();
        bar.set_style(style("{prefix} {human_pos} layers {per_sec}"));
        bar.set_prefix(command);
        Self { command, quiet, verbose, watched, bar, notes: None }
    }

    /// Sets the number of layers to expect.
    pub(crate) fn expect(&self, layers: u64) {
        self.bar.set_length(layers);
        self.bar.set_style(style("{prefix} {bar:40} layer {human_pos} of {human_len}, {eta} left"));
    }

    /// Counts a layer. The bar appears with the first.
    pub(crate) fn layer_done(&self) {
        if self.watched && self.bar.position() == 0 {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.inc(1);
    }

    /// Returns a bar of how much of a part's height a search for layer heights has come past.
    pub(crate) fn height_bar(&self, part: &LayeredPart) -> HeightBar {
        let [bottom_um, top_um] = part.heights_um();
        let bar = if self.watched {
            ProgressBar::new((top_um - bottom_um) as u64)
        } else {
            ProgressBar::hidden()
        };
        bar.set_style(style("{prefix} layer heights {bar:40} {percent}%, {eta} left"));
        bar.set_prefix(self.command);
        HeightBar { bottom_um, bar }
    }

    /// Prints a line of what is told only to who asks for it with `--verbose`.
    pub(crate) fn detail(&self, line: &str) {
        if self.verbose {
            self.warn(line);
        }
    }

    /// Returns whether details are printed.
    pub(crate) fn is_verbose(&self) -> bool {
        self.verbose
    }

    /// Prints a line, unless quiet.
    pub(crate) fn say(&self, line: &str) {
        if !self.quiet {
            self.warn(line);
        }
    }

    /// Prints a line, also if quiet.
    pub(crate) fn warn(&self, line: &str) {
        let line = format!("{}: {line}", self.command);
        match &self.notes {
            Some(notes) => notes.lock().expect("nobody panics while it is held").push(line),
            None => self.bar.suspend(|| say(&line)),
        }
    }

    /// Removes the bar.
    pub(crate) fn done(&self) {
        self.bar.finish_and_clear();
    }
}

/// A bar over the height of a part. It goes when it is dropped.
pub(crate) struct HeightBar {
    bottom_um: f64,
    bar: ProgressBar,
}

impl HeightBar {
    /// Moves to the top of a layer.
    pub(crate) fn move_to(&self, layer: &SweptLayer) {
        self.bar.set_position((layer.top_um() - self.bottom_um) as u64);
    }
}

impl Drop for HeightBar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Prints a line to standard error. A closed standard error does not stop the work.
pub(crate) fn say(line: &str) {
    let _ = writeln!(io::stderr(), "{}", printable(line));
}

/// Escapes what could steer a terminal, as names of files may.
pub(crate) fn printable(text: &str) -> Cow<'_, str> {
    // The characters that turn the direction of writing hide what a name is.
    let steers =
        |c: char| c.is_control() || matches!(c, '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}');
    if !text.contains(steers) {
        return Cow::Borrowed(text);
    }
    let escaped = |c: char| if steers(c) { c.escape_default().to_string() } else { c.to_string() };
    Cow::Owned(text.chars().map(escaped).collect())
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).expect("the templates are fixed")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_steers_a_terminal_is_escaped() {
        assert_eq!(printable("blade.stl: größe 3"), "blade.stl: größe 3");
        assert_eq!(printable("a\u{1b}[31mb\nc\u{202E}"), r"a\u{1b}[31mb\nc\u{202e}");
    }
}
