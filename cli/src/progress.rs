//! Progress and messages on standard error.

use std::io::{self, IsTerminal, Write};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Prints messages and a progress bar.
#[derive(Clone)]
pub(crate) struct Progress {
    command: &'static str,
    quiet: bool,
    watched: bool,
    bar: ProgressBar,
}

impl Progress {
    /// Returns progress with a bar if standard error is a terminal. Of the stages of a pipeline
    /// only the last shows one (`is_last`), because they share the terminal.
    pub(crate) fn new(command: &'static str, quiet: bool, is_last: bool) -> Self {
        let watched = !quiet && is_last && io::stderr().is_terminal();
        let bar = ProgressBar::hidden();
        bar.set_style(style("{prefix} {human_pos} layers {per_sec}"));
        bar.set_prefix(command);
        Self { command, quiet, watched, bar }
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

    /// Prints a line, unless quiet.
    pub(crate) fn say(&self, line: &str) {
        if !self.quiet {
            self.bar.suspend(|| say(&format!("{}: {line}", self.command)));
        }
    }

    /// Removes the bar.
    pub(crate) fn done(&self) {
        self.bar.finish_and_clear();
    }
}

/// Prints a line to standard error. A closed standard error does not stop the work.
pub(crate) fn say(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).expect("the templates are fixed")
}
