//! Progress and messages on standard error.

use std::borrow::Cow;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use clap::builder::styling::{AnsiColor, Style};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use lamp_pipeline::watcher::{Importance, KeptRemarks, Remark, Watcher};
use lamp_stack::{Layer, PageInfo, PassingLayer, StackInfo};

use crate::args::options::Common;
use crate::output::numbers::{grouped, number_of, seconds_in_words, size_in_words};
use crate::streams::{is_stream, redirected_to};

/// Prints messages and a progress bar.
#[derive(Clone)]
pub(crate) struct Progress {
    command: &'static str,
    quiet: bool,
    verbose: bool,
    watched: bool,
    start: Instant,
    bar: ProgressBar,
    layers: Arc<Mutex<CountedLayers>>,
    /// How far a search for layer heights has come, while there is one.
    heights: Arc<Mutex<Option<ProgressBar>>>,
    /// Where lines go instead of standard error.
    kept: Option<KeptRemarks>,
}

/// The facts that written layers share.
#[derive(Clone, Copy, Debug, Default)]
struct CountedLayers {
    count: u64,
    /// Of the images, unless they differ.
    size: Option<[u32; 2]>,
    /// Of the parts of a build.
    copies: usize,
}

/// A layer that is written or read.
pub(crate) trait Counted {
    /// Returns its metadata and its image's width and height.
    fn facts(&self) -> (&PageInfo, [u32; 2]);
}

impl Counted for Layer {
    fn facts(&self) -> (&PageInfo, [u32; 2]) {
        (&self.info, [self.image.width(), self.image.height()])
    }
}

impl Counted for PassingLayer {
    fn facts(&self) -> (&PageInfo, [u32; 2]) {
        (self.info(), self.size())
    }
}

impl Progress {
    /// Returns progress without a bar, whose lines are kept, details left out.
    pub(crate) fn keeping(command: &'static str, kept: &KeptRemarks) -> Self {
        let silent = Self::with(command, false, false, false);
        Self { kept: Some(kept.clone()), ..silent }
    }

    /// Returns progress with a bar if standard error is a terminal. Of the stages of a pipeline
    /// only the last shows one (`is_last`), because they share the terminal.
    pub(crate) fn new(command: &'static str, common: &Common, is_last: bool) -> Self {
        let &Common { quiet, verbose, .. } = common;
        // A bar in a file or a log would be thousands of lines.
        let watched = !quiet && is_last && io::stderr().is_terminal();
        let progress = Self::with(command, quiet, verbose, watched);
        progress.bar.set_style(style("{prefix} {human_pos} layers {per_sec}"));
        progress.bar.set_prefix(command);
        progress
    }

    fn with(command: &'static str, quiet: bool, verbose: bool, watched: bool) -> Self {
        let (start, bar) = (Instant::now(), ProgressBar::hidden());
        let (layers, heights) = (Arc::default(), Arc::default());
        Self { command, quiet, verbose, watched, start, bar, layers, heights, kept: None }
    }

    /// Sets the number of layers to expect.
    pub(crate) fn expect(&self, layers: u64) {
        self.bar.set_length(layers);
        self.bar.set_style(style("{prefix} {bar:40} layer {human_pos} of {human_len}, {eta} left"));
    }

    /// Counts a layer that is written, for [`Progress::wrote_layers`].
    pub(crate) fn layer_written(&self, layer: &impl Counted) {
        let (info, size) = layer.facts();
        let mut layers = self.layers.lock().unwrap_or_else(PoisonError::into_inner);
        let CountedLayers { count, size: seen, copies } = &mut *layers;
        *seen = Some(size).filter(|_| *count == 0 || *seen == Some(size));
        *count += 1;
        if let Some(parts) = info.stack.as_ref().and_then(StackInfo::built_parts) {
            *copies = parts.flatten().map(|part| part.copies.len()).sum();
        }
        drop(layers);
        self.layer_done();
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
            self.print(None, line);
        }
    }

    /// Returns whether details are printed.
    pub(crate) fn is_verbose(&self) -> bool {
        self.verbose
    }

    /// Prints a line, unless quiet.
    pub(crate) fn say(&self, line: &str) {
        if !self.quiet {
            self.print(None, line);
        }
    }

    /// Prints a warning, also if quiet.
    pub(crate) fn warn(&self, line: &str) {
        self.print(Some(Severity::Warning), line);
    }

    fn print(&self, severity: Option<Severity>, line: &str) {
        let line = format!("{}: {line}", self.command);
        match &self.kept {
            Some(kept) => kept.keep(line),
            // A line over the bar would spoil both.
            None => self.bar.suspend(|| match severity {
                Some(severity) => severity.say(&line),
                None => say(&line),
            }),
        }
    }

    /// Prints the line of a command that has written layers: where they are, how many, their size.
    pub(crate) fn wrote_layers(&self, output: &Path) {
        let layers = *self.layers.lock().unwrap_or_else(PoisonError::into_inner);
        let CountedLayers { count, size, copies } = layers;
        let mut facts: Vec<_> =
            (count > 0).then(|| number_of(count, "layer")).into_iter().collect();
        facts.extend(size.map(|size| size.map(|side| grouped(side.into())).join(" x ")));
        facts.extend((copies > 1).then(|| format!("{} copies", grouped(copies as u64))));
        self.wrote(output, &facts);
    }

    /// Prints the line of a command that has written its output: facts, its size and the time that
    /// it took. Nothing is printed of an output that another program reads.
    pub(crate) fn wrote(&self, output: &Path, facts: &[String]) {
        if self.quiet || self.kept.is_some() {
            return;
        }
        let (name, bytes) = match is_stream(output) {
            false => (output.display().to_string(), bytes_of(output)),
            true => match redirected_to() {
                Some((name, bytes)) => (name, Some(bytes)),
                None => return,
            },
        };
        let (bytes, time) = (bytes.map(size_in_words), seconds_in_words(self.start.elapsed()));
        let facts: Vec<_> = facts.iter().cloned().chain(bytes).chain([time]).collect();
        self.bar.suspend(|| say(&format!("{name}: {}", facts.join(", "))));
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
            Importance::Note if self.quiet => {}
            Importance::Note => self.print(Some(Severity::Note), &text),
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

/// How much a message matters.
#[derive(Clone, Copy)]
pub(crate) enum Severity {
    Error,
    Warning,
    Note,
}

impl Severity {
    /// Prints a message to standard error behind a label, in color where a terminal shows it.
    pub(crate) fn say(self, message: &str) {
        let (label, color) = match self {
            Self::Error => ("error:", AnsiColor::Red),
            Self::Warning => ("warning:", AnsiColor::Yellow),
            Self::Note => ("note:", AnsiColor::Cyan),
        };
        let style = Style::new().bold().fg_color(Some(color.into()));
        let _ = writeln!(anstream::stderr(), "{style}{label}{style:#} {}", printable(message));
    }
}

/// Prints a line to standard error. A closed standard error does not stop the work.
pub(crate) fn say(line: &str) {
    let _ = writeln!(io::stderr(), "{}", printable(line));
}

/// Returns the bytes of a file, or of the files in a folder.
fn bytes_of(path: &Path) -> Option<u64> {
    let metadata = path.metadata().ok()?;
    if !metadata.is_dir() {
        return metadata.is_file().then_some(metadata.len());
    }
    let files = path.read_dir().ok()?.map(|entry| Some(entry.ok()?.metadata().ok()?.len()));
    files.sum()
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
