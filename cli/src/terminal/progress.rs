//! Progress and messages on standard error.

use std::borrow::Cow;
use std::io::{self, IsTerminal, Write};
use std::sync::{Arc, Mutex, PoisonError};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use lamp_pipeline::watcher::{Importance, KeptRemarks, Remark, Watcher};

use crate::args::options::Common;

/// Prints messages and a progress bar.
#[derive(Clone)]
pub(crate) struct Progress {
    command: &'static str,
    quiet: bool,
    verbose: bool,
    watched: bool,
    bar: ProgressBar,
    /// How far a search for layer heights has come, while there is one.
    heights: Arc<Mutex<Option<ProgressBar>>>,
    /// Where lines go instead of standard error.
    kept: Option<KeptRemarks>,
}

impl Progress {
    /// Returns progress without a bar, whose lines are kept, details left out.
    pub(crate) fn keeping(command: &'static str, kept: &KeptRemarks) -> Self {
        let kept = Some(kept.clone());
        let (bar, heights) = (ProgressBar::hidden(), Arc::default());
        Self { command, quiet: false, verbose: false, watched: false, bar, heights, kept }
    }

    /// Returns progress with a bar if standard error is a terminal. Of the stages of a pipeline
    /// only the last shows one (`is_last`), because they share the terminal.
    pub(crate) fn new(command: &'static str, common: &Common, is_last: bool) -> Self {
        let &Common { quiet, verbose, .. } = common;
        // A bar in a file or a log would be thousands of lines.
        let watched = !quiet && is_last && io::stderr().is_terminal();
        let bar = ProgressBar::hidden();
        bar.set_style(style("{prefix} {human_pos} layers {per_sec}"));
        bar.set_prefix(command);
        Self { command, quiet, verbose, watched, bar, heights: Arc::default(), kept: None }
    }

    /// Sets the number of layers to expect.
    pub(crate) fn expect(&self, layers: u64) {
        self.bar.set_length(layers);
        self.bar.set_style(style("{prefix} {bar:40} layer {human_pos} of {human_len}, {eta} left"));
    }

    /// Counts a layer. The bar appears with the first.
    pub(crate) fn layer_done(&self) {
        // A command that fails before its first layer shows no bar.
        if self.watched && self.bar.position() == 0 {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.inc(1);
    }

    /// Prints a line only if `--verbose` is given.
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
        match &self.kept {
            Some(kept) => kept.keep(line),
            // A line over the bar would spoil both.
            None => self.bar.suspend(|| say(&line)),
        }
    }

    /// Removes the bar.
    pub(crate) fn done(&self) {
        self.bar.finish_and_clear();
    }
}

impl Watcher for Progress {
    fn remark(&self, Remark { importance, text }: Remark) {
        match importance {
            Importance::Detail => self.detail(&text),
            Importance::Note => self.say(&text),
            Importance::Warning => self.warn(&text),
        }
    }

    fn height_reached(&self, [bottom_um, top_um]: [f64; 2], um: f64) {
        if !self.watched {
            return;
        }
        let mut heights = self.heights.lock().unwrap_or_else(PoisonError::into_inner);
        let bar = heights.get_or_insert_with(|| {
            let bar = ProgressBar::new((top_um - bottom_um) as u64);
            bar.set_style(style("{prefix} layer heights {bar:40} {percent}%, {eta} left"));
            bar.set_prefix(self.command);
            bar
        });
        bar.set_position((um - bottom_um) as u64);
    }

    fn heights_found(&self) {
        let bar = self.heights.lock().unwrap_or_else(PoisonError::into_inner).take();
        bar.into_iter().for_each(|bar| bar.finish_and_clear());
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
