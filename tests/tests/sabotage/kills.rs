//! Commands that are ended at random moments.

use std::fs::File;
use std::io::{Read, Seek};
use std::process::Command;
use std::thread;

use lamp_fixtures::SplitMix;

use super::jobs::{JOBS, Job, Wanted, Workplace};
use super::trials;

/// The first is for nobody to handle.
const SIGNALS: [&str; 8] = ["KILL", "KILL", "KILL", "TERM", "HUP", "INT", "USR1", "XCPU"];

#[test]
fn whatever_ends_a_command_leaves_whole_outputs_and_no_litter() {
    let workplace = Workplace::new();
    let wanted: Vec<Wanted> = JOBS.iter().map(|job| workplace.wanted(job)).collect();
    // Kills take a thousand times as long as mutants.
    for number in 0..trials(480) / 10 {
        let mut numbers = SplitMix(number);
        let job = number as usize % JOBS.len();
        trial(&workplace, &JOBS[job], &wanted[job], &mut numbers);
    }
}

fn trial(workplace: &Workplace, job: &Job, wanted: &Wanted, numbers: &mut SplitMix) {
    if numbers.below(2) == 1 {
        workplace.put_old(job);
    }
    let signal = SIGNALS[numbers.below(SIGNALS.len())];
    let delay = wanted.time.mul_f64(numbers.below(1100) as f64 / 1000.0);
    let mut said = tempfile::tempfile().expect("a temporary file");
    let mut stages = workplace.scratch.start(job.line, None, &said);
    thread::sleep(delay);
    let hit = numbers.below(stages.len());
    send(signal, stages[hit].id());
    for stage in &mut stages {
        stage.wait().expect("a child can be waited for");
    }
    let what = format!("{signal} after {delay:?} to stage {hit} of `{}`", job.line);
    assert!(!text(&mut said).contains("panicked"), "{what}");
    workplace.check_whole(job, wanted, &what);
    if signal != "KILL" {
        workplace.check_tidy(job, &what);
    }
    workplace.check_rerun(job, wanted, &what);
    workplace.clear(job);
}

fn send(signal: &str, process: u32) {
    let kill = Command::new("kill").args(["-s", signal, &process.to_string()]).status();
    assert!(kill.expect("there is kill").success());
}

fn text(said: &mut File) -> String {
    let mut text = String::new();
    said.rewind().and_then(|()| said.read_to_string(&mut text)).expect("text");
    text
}
