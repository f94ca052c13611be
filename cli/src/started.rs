//! How the process was started: its words, and the file that starts it again.

use std::env;
use std::ffi::OsString;
use std::io;
use std::path::PathBuf;
use std::sync::OnceLock;

/// A program of another language that runs this one within its process, whose words are not its own.
#[derive(Debug)]
pub struct Host {
    /// The file that starts the program again.
    pub program: PathBuf,
    /// The words of the command line, the program's name first.
    pub words: Vec<OsString>,
}

static HOST: OnceLock<Host> = OnceLock::new();

impl Host {
    /// Notes the host before the program starts, which it does once in a process.
    pub fn note(self) {
        let _ = HOST.set(self);
    }
}

/// Returns the words of the command line, the program's name first.
pub(crate) fn words() -> Vec<OsString> {
    HOST.get().map_or_else(|| env::args_os().collect(), |host| host.words.clone())
}

/// Returns the file that starts the program again.
pub(crate) fn program() -> io::Result<PathBuf> {
    HOST.get().map_or_else(env::current_exe, |host| Ok(host.program.clone()))
}
