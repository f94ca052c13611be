//! Starts `lamp` as one of the pipeline's stages. The program of a stage does no more, so that five
//! programs cost little more to build and to install than one.

use std::env;
use std::ffi::OsString;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::{Command, ExitCode};

/// Runs the `lamp` beside this program, or else the one in `PATH`, as a stage with this process's
/// arguments, streams and name.
pub(crate) fn launch(stage: &str) -> ExitCode {
    let mut words = env::args_os();
    let name = words.next().unwrap_or_else(|| stage.into());
    let mut lamp = Command::new(lamp());
    lamp.args(words).env("LAMP_STAGE", stage);
    let error = become_it(&mut lamp, name);
    let why = match error.kind() {
        io::ErrorKind::NotFound => "the program lamp is neither next to it nor in PATH".to_owned(),
        _ => format!("the program lamp does not start: {error}"),
    };
    // There is nobody left to read it if it cannot be printed.
    let _ = writeln!(io::stderr(), "error: {stage}: {why}");
    ExitCode::FAILURE
}

fn lamp() -> PathBuf {
    let name = format!("lamp{}", env::consts::EXE_SUFFIX);
    // The `lamp` next to it was installed with it; another in PATH may be of another version.
    let beside = env::current_exe().map(|own| own.with_file_name(&name));
    beside.ok().filter(|path| path.exists()).unwrap_or_else(|| name.into())
}

/// Turns this process into `lamp`, which so gets its number, signals and parent.
#[cfg(unix)]
fn become_it(lamp: &mut Command, name: OsString) -> io::Error {
    use std::os::unix::process::CommandExt;
    lamp.arg0(name).exec()
}

/// Waits for `lamp` and ends with its status, where no process can turn into another.
#[cfg(not(unix))]
fn become_it(lamp: &mut Command, _: OsString) -> io::Error {
    let status = lamp.spawn().and_then(|mut child| {
        // Who ends this process means `lamp`.
        #[cfg(windows)]
        lamp_batch::end_with_this_process(&child);
        child.wait()
    });
    match status {
        Ok(status) => std::process::exit(status.code().unwrap_or(1)),
        Err(error) => error,
    }
}
