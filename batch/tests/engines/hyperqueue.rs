//! HyperQueue: by `hq` where it is on the path, or else by its Python package.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use super::Running;

const PATIENCE: Duration = Duration::from_secs(60);

/// A server and a worker. `HQ_SERVER_DIR` is the folder `hq` in theirs.
pub(crate) struct HyperQueue {
    folder: PathBuf,
    processes: Vec<(&'static str, Child)>,
}

fn command(name: &str) -> Command {
    let mut command = Command::new(name);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

impl HyperQueue {
    /// Starts a server and a worker, or says why not.
    pub(crate) fn start(folder: &Path) -> Result<Self, String> {
        let mut hq = Self { folder: folder.to_owned(), processes: Vec::new() };
        if command("hq").arg("--version").status().is_ok() {
            hq.start_process("server");
            hq.wait_for_server()?;
            hq.start_process("worker");
            return Ok(hq);
        }
        println!("HyperQueue: hq is not on the path, so its Python package runs the job files");
        if !command("python3").args(["-c", "import hyperqueue"]).status().is_ok_and(|s| s.success())
        {
            return Err("its Python package is not installed either".to_owned());
        }
        let stand_in = folder.join("bin/hq");
        fs::create_dir(folder.join("bin")).map_err(|error| error.to_string())?;
        fs::write(&stand_in, include_str!("stand_in_hq.py")).map_err(|error| error.to_string())?;
        let all = fs::Permissions::from_mode(0o755);
        fs::set_permissions(&stand_in, all).map_err(|error| error.to_string())?;
        let server = command("hq").args(["server", "start"]).current_dir(folder).spawn();
        hq.processes.push(("package", server.map_err(|error| error.to_string())?));
        hq.wait_for_server()?;
        Ok(hq)
    }

    fn start_process(&mut self, name: &'static str) {
        let mut hq = command("hq");
        match name {
            "server" => hq.args(["server", "start", "--journal"]).arg(self.folder.join("journal")),
            _ => hq.args(["worker", "start", "--cpus=2", "--on-server-lost=finish-running"]),
        };
        self.processes.push((name, hq.current_dir(&self.folder).spawn().unwrap()));
    }

    fn stop_process(&mut self, name: &str) {
        let Some(place) = self.processes.iter().position(|(of, _)| *of == name) else { return };
        let (_, mut child) = self.processes.remove(place);
        // SIGKILL.
        child.kill().unwrap();
        child.wait().unwrap();
    }

    fn wait_for_server(&self) -> Result<(), String> {
        let start = Instant::now();
        while !command("hq").args(["server", "info"]).status().is_ok_and(|status| status.success())
        {
            if start.elapsed() > PATIENCE {
                return Err("its server does not come up".to_owned());
            }
            thread::sleep(Duration::from_millis(100));
        }
        Ok(())
    }
}

impl Running for HyperQueue {
    fn parts(&self) -> &'static [&'static str] {
        // The package has its worker in the server, and no journal.
        if self.processes[0].0 == "package" { &[] } else { &["worker", "server"] }
    }

    fn kill(&mut self, part: &'static str) {
        self.stop_process(part);
        self.start_process(part);
        if part == "server" {
            self.wait_for_server().unwrap();
            // Workers end with their server.
            self.stop_process("worker");
            self.start_process("worker");
        }
    }
}

impl Drop for HyperQueue {
    fn drop(&mut self) {
        for name in ["worker", "server", "package"] {
            self.stop_process(name);
        }
    }
}
