//! Slurm on this machine alone: Debian's packages, without systemd.

use std::fs;
use std::io;
use std::net::TcpListener;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use super::Running;

const DAEMONS: [&str; 3] = ["munged", "slurmctld", "slurmd"];
const PATIENCE: Duration = Duration::from_secs(60);

/// Slurm's daemons, each by its name. `SLURM_CONF` is the file in the folder.
pub(crate) struct Slurm {
    folder: PathBuf,
    daemons: Vec<(&'static str, Child)>,
}

impl Slurm {
    /// Starts all daemons, or says why not.
    pub(crate) fn start(folder: &Path) -> Result<Self, String> {
        for daemon in DAEMONS {
            if !Path::new("/usr/sbin").join(daemon).exists() {
                return Err(format!("{daemon} is not installed"));
            }
        }
        if fs::metadata(folder).map_or(1, |folder| folder.uid()) != 0 {
            return Err("its daemons need root".to_owned());
        }
        configure(folder).map_err(|error| error.to_string())?;
        let mut slurm = Self { folder: folder.to_owned(), daemons: Vec::new() };
        for name in DAEMONS {
            slurm.start_daemon(name);
            // Each needs the one before.
            thread::sleep(Duration::from_millis(500));
        }
        let start = Instant::now();
        while !nodes().contains("idle") {
            if start.elapsed() > PATIENCE {
                return Err(format!("its node does not come up: {}", nodes()));
            }
            thread::sleep(Duration::from_millis(200));
        }
        Ok(slurm)
    }

    fn start_daemon(&mut self, name: &'static str) {
        let munge = self.folder.join("munge");
        let in_munge =
            |option: &str, file: &str| format!("{option}={}", munge.join(file).display());
        let words = match name {
            "munged" => vec![
                "--foreground".to_owned(),
                "--force".to_owned(),
                in_munge("--key-file", "key"),
                in_munge("--socket", "socket"),
                in_munge("--pid-file", "pid"),
                in_munge("--log-file", "log"),
                in_munge("--seed-file", "seed"),
            ],
            _ => vec!["-D".to_owned()],
        };
        let mut command = Command::new(Path::new("/usr/sbin").join(name));
        command.args(words).stdout(Stdio::null()).stderr(Stdio::null());
        self.daemons.push((name, command.spawn().unwrap()));
    }

    fn stop_daemon(&mut self, name: &str) {
        let place = self.daemons.iter().position(|(of, _)| *of == name).unwrap();
        let (_, mut child) = self.daemons.remove(place);
        // SIGKILL.
        child.kill().unwrap();
        child.wait().unwrap();
    }
}

impl Running for Slurm {
    fn parts(&self) -> &'static [&'static str] {
        &["slurmctld", "slurmd"]
    }

    fn kill(&mut self, part: &'static str) {
        self.stop_daemon(part);
        thread::sleep(Duration::from_secs(1));
        self.start_daemon(part);
    }

    /// A controller that was killed forgets the jobs of its last seconds. It gives their numbers
    /// again, takes a node that knows them out of service, and holds the new ones. Jobs that it
    /// starts again wait for two minutes, which nobody has to.
    fn mend(&self) {
        if nodes().contains("dr") {
            call("scontrol", &["update", "NodeName=ALL", "State=RESUME"]);
        }
        let waiting =
            call("squeue", &["--array", "--noheader", "--states=PENDING", "--format=%i %r"]);
        for line in waiting.lines() {
            let (job, why) = line.split_once(' ').unwrap_or_default();
            // "JobHeldAdmin", or "launch failed requeued held".
            if why.to_lowercase().contains("held") {
                call("scontrol", &["release", job]);
            }
            if why == "BeginTime" {
                call("scontrol", &["update", &format!("JobId={job}"), "StartTime=now"]);
            }
        }
    }

    fn state(&self) -> String {
        let log = fs::read_to_string(self.folder.join("slurmctld.log")).unwrap_or_default();
        let log: Vec<_> = log.lines().rev().take(40).collect();
        let log: Vec<_> = log.into_iter().rev().collect();
        [call("squeue", &["--all"]), call("sinfo", &[]), log.join("\n")].join("\n")
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        for name in DAEMONS.into_iter().rev() {
            self.stop_daemon(name);
        }
    }
}

fn nodes() -> String {
    call("sinfo", &["--noheader", "--format=%t"])
}

/// Runs a command of Slurm, and returns all that it says.
fn call(program: &str, words: &[&str]) -> String {
    let answer = Command::new(program).args(words).output().unwrap();
    String::from_utf8_lossy(&[answer.stdout, answer.stderr].concat()).into_owned()
}

/// Writes what the daemons read.
fn configure(folder: &Path) -> io::Result<()> {
    for name in ["munge", "state", "spool"] {
        fs::create_dir(folder.join(name))?;
    }
    let key: Vec<u8> = (0..=255).cycle().take(1024).collect();
    let munge = folder.join("munge");
    fs::write(munge.join("key"), key)?;
    fs::set_permissions(munge.join("key"), fs::Permissions::from_mode(0o600))?;
    // The daemon's socket is for all.
    fs::set_permissions(&munge, fs::Permissions::from_mode(0o755))?;
    let host = fs::read_to_string("/proc/sys/kernel/hostname")?;
    let host = host.trim().split('.').next().unwrap_or_default().to_owned();
    let free = [TcpListener::bind("127.0.0.1:0")?, TcpListener::bind("127.0.0.1:0")?];
    let [controller, node] = free.map(|port| port.local_addr().map_or(0, |address| address.port()));
    let folder = folder.display();
    let text = format!(
        "ClusterName=lamp
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={node}
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SlurmctldTimeout=10
SlurmdTimeout=20
KillWait=2
SchedulerParameters=sched_interval=1,bf_interval=1,batch_sched_delay=0
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=1000 State=UNKNOWN
PartitionName=night Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"
    );
    fs::write(format!("{folder}/slurm.conf"), text)
}
