//! Runs a command of the user's at the end.

use std::io::{self, Write};
use std::process::{Command, Stdio};

use lamp_batch::Summary;
use serde::Serialize;

use crate::output::json_report::schemas;
use crate::terminal::progress::Progress;

/// The end of a batch, on the standard input of the command of `lamp batch NIGHT.toml --notify`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct BatchNote<'a> {
    schema: &'static str,
    /// The exit status of the batch.
    status: u8,
    /// The state of each part and build.
    summary: &'a Summary,
}

schemas! { "lamp-batch-1": BatchNote<'_>; }

/// Runs a command by the shell, with a summary on its input and the status in its environment. A
/// failure only prints a warning.
pub(super) fn notify(command: &str, status: u8, summary: &Summary, progress: &Progress) {
    let note = BatchNote { schema: "lamp-batch-1", status, summary };
    let text = serde_json::to_string(&note).expect("notes have text keys");
    match run(command, status, &format!("{text}\n")) {
        Ok(0) => {}
        Ok(failed) => progress.warn(&format!("--notify: {command} ended with status {failed}")),
        Err(error) => progress.warn(&format!("--notify: {command}: {error}")),
    }
}

fn run(command: &str, status: u8, text: &str) -> io::Result<i32> {
    let mut child = shell(command)
        .env("LAMP_BATCH_STATUS", status.to_string())
        .stdin(Stdio::piped())
        .spawn()?;
    let written = child.stdin.take().map_or(Ok(()), |mut input| input.write_all(text.as_bytes()));
    // A command need not read its input.
    if let Err(error) = written
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        return Err(error);
    }
    Ok(child.wait()?.code().unwrap_or(-1))
}

#[cfg(unix)]
fn shell(command: &str) -> Command {
    let mut shell = Command::new("sh");
    shell.args(["-c", command]);
    shell
}

#[cfg(not(unix))]
fn shell(command: &str) -> Command {
    let mut shell = Command::new("cmd");
    shell.args(["/C", command]);
    shell
}
