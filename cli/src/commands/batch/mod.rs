//! `lamp batch`: parts and builds overnight, from one file.

mod init;
mod keep;
mod machine_time;
mod night_file;
mod notify;
mod part_files;
mod plan_text;
mod report;
mod run;
mod status;
mod task;
mod watch;

use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use clap::{Args, Subcommand};
use lamp_batch::{Key, Local};
use lamp_pipeline::memory::available;

use crate::args::options::{Common, TimeArgs, one_of_described, parse_memory};
use crate::exit::Exit;
use crate::output::json_report::ReportTo;

/// Make many parts and builds overnight, even if tasks crash
///
/// The night file names parts, their stages and builds; docs/batch.md shows one. A store keeps
/// complete results, identified by everything that decides their bytes. To resume a night that was
/// stopped, run the same command again: it does only the missing work.
#[derive(Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "\
Examples:
  lamp batch init parts/ --machine beta
  lamp batch plan night.toml
  lamp batch night.toml
  lamp batch night.toml --watch parts/
  lamp batch night.toml --jobs 4 --memory 16GB --notify 'mail -s night ada@example.org'
  lamp batch night.toml --engine slurm
  lamp batch status night.toml
  lamp batch gc night.toml --keep 30d

Exit status: 0 all is done; 1 something failed; 2 wrong usage; 3 all is done, with findings that
need a person (stray bands, islands); 130 and 143 ended by a signal."
)]
pub(crate) struct BatchArgs {
    #[command(subcommand)]
    command: Option<BatchCommand>,

    #[command(flatten)]
    run: RunArgs,
}

#[derive(Args)]
pub(crate) struct RunArgs {
    /// The night file
    #[arg(value_name = "NIGHT.toml")]
    night: Option<PathBuf>,

    /// Engine that runs tasks. HyperQueue and Slurm find their servers as hq and sbatch do. The
    /// store, the parts and this program must have the same paths on all machines
    #[arg(long, value_name = "NAME", default_value_t)]
    #[arg(value_parser = one_of_described::<EngineName>(&[
        "Processes on this machine",
        "HyperQueue: your own machines, or allocations of a cluster",
        "Slurm: arrays with dependencies",
    ]))]
    engine: EngineName,

    #[command(flatten)]
    local: LocalArgs,

    /// How many times a crashed task is tried again
    #[arg(long, value_name = "N", default_value = "2")]
    retries: u32,

    /// Shell command to run at the end. It gets a JSON summary on standard input and the exit
    /// status in LAMP_BATCH_STATUS
    #[arg(long, value_name = "CMD")]
    notify: Option<String>,

    /// Keep running, and make each new or changed part of this folder by the stages of [defaults]. Ctrl-C
    /// ends it
    #[arg(long, value_name = "FOLDER")]
    watch: Option<PathBuf>,
}

/// The share of this machine that tasks may use.
#[derive(Args)]
struct LocalArgs {
    /// Number of threads for all tasks together [default: one per processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=512))]
    jobs: Option<u16>,

    /// Memory that all tasks may use together, by their estimates [default: three quarters of all
    /// memory]
    #[arg(long, value_name = "BYTES", value_parser = parse_memory)]
    memory: Option<u64>,
}

impl LocalArgs {
    fn engine(&self) -> Local {
        let usual = || thread::available_parallelism().map_or(1, usize::from);
        let jobs = self.jobs.map_or_else(usual, usize::from);
        let memory = self.memory.unwrap_or_else(|| available() / 4 * 3);
        Local { jobs, memory }
    }
}

/// The engine that runs tasks, by the name that people use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum EngineName {
    #[default]
    Local,
    HyperQueue,
    Slurm,
}

lamp_stack::named!(EngineName {
    Local = "local",
    HyperQueue = "hyperqueue",
    Slurm = "slurm",
});

#[derive(Subcommand)]
enum BatchCommand {
    /// Write a night file from a folder of parts
    #[command(after_help = "\
Examples:
  lamp batch init parts/
  lamp batch init parts/ --machine mine.toml -o monday.toml
  lamp batch init parts/ --slice '--dpi 2400 --thickness 25um'")]
    Init(init::InitArgs),
    /// Print a night's plan: tasks, existing results, the tasks' time, memory and disk space, and the
    /// time on the machine
    Plan(PlanArgs),
    /// Print the state of each part and build
    Status(NightArgs),
    /// Hash all results and delivered files again, and remove damaged results
    Verify(VerifyArgs),
    /// Remove results that no recent batch names
    Gc(GcArgs),
    /// Do one task, as engines call it
    #[command(hide = true)]
    Task(TaskArgs),
}

#[derive(Args)]
struct PlanArgs {
    #[command(flatten)]
    night: NightArgs,

    #[command(flatten)]
    local: LocalArgs,

    #[command(flatten)]
    times: TimeArgs,
}

#[derive(Args)]
struct NightArgs {
    /// The night file
    #[arg(value_name = "NIGHT.toml")]
    night: PathBuf,

    #[command(flatten)]
    report: ReportTo,
}

#[derive(Args)]
struct StoreArgs {
    /// A night file that names the store
    #[arg(value_name = "NIGHT.toml", required_unless_present = "store")]
    night: Option<PathBuf>,

    /// The store itself
    #[arg(long, value_name = "DIR", conflicts_with = "night")]
    store: Option<PathBuf>,
}

#[derive(Args)]
struct VerifyArgs {
    #[command(flatten)]
    store: StoreArgs,

    /// Print JSON, as docs/json.md describes it
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct GcArgs {
    #[command(flatten)]
    store: StoreArgs,

    /// Keep results of batches run within this time: 12h, 30d
    #[arg(long, value_name = "TIME", default_value = "30d", value_parser = parse_age)]
    keep: Duration,
}

#[derive(Args)]
struct TaskArgs {
    /// The task
    #[arg(value_name = "KEY")]
    key: Key,

    /// The store that knows it
    #[arg(long, value_name = "DIR")]
    store: PathBuf,

    /// The engine that runs it, for the journal
    #[arg(long, value_name = "NAME", default_value = "hand")]
    engine: String,

    /// The process that started it, which it is to end with
    #[arg(long, value_name = "PID")]
    parent: Option<i32>,
}

pub(crate) fn run(args: &BatchArgs, common: &Common) -> Result<(), Exit> {
    match &args.command {
        None => run::run(&args.run, common),
        Some(BatchCommand::Init(args)) => init::run(args, common),
        Some(BatchCommand::Plan(args)) => plan_text::run(args, common),
        Some(BatchCommand::Status(args)) => status::run(args, common),
        Some(BatchCommand::Verify(args)) => keep::verify(args, common),
        Some(BatchCommand::Gc(args)) => keep::collect(args, common),
        Some(BatchCommand::Task(args)) => task::run(args),
    }
}

/// Parses a time such as `12h` or `30d`.
fn parse_age(text: &str) -> Result<Duration, String> {
    let wrong = || format!("`{text}` is not a time: write hours or days, such as 12h or 30d");
    let (number, hours) = match text.strip_suffix('d') {
        Some(number) => (number, 24),
        None => (text.strip_suffix('h').ok_or_else(wrong)?, 1),
    };
    let number: u32 = number.parse().map_err(|_| wrong())?;
    Ok(Duration::from_secs(u64::from(number) * hours * 3600))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ages_have_units() {
        assert_eq!(parse_age("30d"), Ok(Duration::from_secs(30 * 86400)));
        assert_eq!(parse_age("0h"), Ok(Duration::ZERO));
        for wrong in ["", "30", "d", "-1d", "1.5h", "5000000000d"] {
            assert!(parse_age(wrong).unwrap_err().contains("as 12h or 30d"), "{wrong}");
        }
    }
}
