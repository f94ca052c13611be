//! Runs commands within limits of `ulimit`, and not for ever.

use std::io::Read;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// How a command within limits ended.
#[derive(Debug)]
pub(crate) struct Ended {
    /// Its status; `None` if a signal or the end of patience ended it.
    pub(crate) status: Option<i32>,
    pub(crate) stderr: String,
    pub(crate) time: Duration,
}

/// A minute is more than any job takes, and a hang.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// Runs a command after `ulimit` with these words.
pub(crate) fn limited(command: &Command, ulimit: &str) -> Ended {
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("ulimit {ulimit} && exec \"$@\""), "sh"]);
    shell.arg(command.get_program()).args(command.get_args());
    shell.current_dir(command.get_current_dir().expect("jobs run in a folder"));
    patiently(shell)
}

/// Runs a command, and kills it when patience ends.
pub(crate) fn patiently(mut command: Command) -> Ended {
    let start = Instant::now();
    let quiet = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = quiet.spawn().expect("a shell");
    let mut from = child.stderr.take().expect("it was asked for");
    let said = thread::spawn(move || {
        let mut said = Vec::new();
        from.read_to_end(&mut said).expect("a pipe can be read");
        String::from_utf8_lossy(&said).into_owned()
    });
    let status = loop {
        match child.try_wait().expect("a child can be waited for") {
            Some(status) => break status.code(),
            None if start.elapsed() > PATIENCE => {
                child.kill().expect("a child can be killed");
                break child.wait().expect("a child can be waited for").code();
            }
            None => thread::sleep(Duration::from_millis(1)),
        }
    };
    let time = start.elapsed();
    Ended { status, stderr: said.join().expect("it only reads"), time }
}

impl Ended {
    /// Checks for a refusal: status 1 and one sentence with one of these words.
    pub(crate) fn is_refusal(&self, words: &[&str]) -> bool {
        self.status == Some(1)
            && self.stderr.lines().count() == 1
            && words.iter().any(|word| self.stderr.contains(word))
    }
}
