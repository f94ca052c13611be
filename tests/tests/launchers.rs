//! The programs of the stages, which start the `lamp` next to them.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};
#[cfg(target_os = "linux")]
use std::{
    process::Stdio,
    thread,
    time::{Duration, Instant},
};

use lamp_tests::{Scratch, bin};

/// Runs a stage in a folder without `lamp`, by links to the programs: nothing that is written can
/// be run at once while other threads start processes.
fn run_alone(stage: &str, path: &Path) -> Output {
    let program = bin(stage);
    let folder = program.parent().expect("a folder of programs");
    let alone = tempfile::tempdir_in(folder).expect("a folder that can be written to");
    let alone = alone.path().join(program.file_name().expect("a program's name"));
    fs::hard_link(&program, &alone).expect("a link in the same file system");
    let command = Command::new(alone).arg("--version").env("PATH", path).output();
    command.expect("a program that starts")
}

#[test]
fn without_lamp_a_stage_says_so() {
    for stage in ["slice", "fix", "dither", "tile"] {
        let ran = run_alone(stage, Path::new(""));
        assert_eq!((ran.status.code(), &ran.stdout[..]), (Some(1), &b""[..]), "{stage}");
        assert_eq!(
            String::from_utf8_lossy(&ran.stderr),
            format!("error: {stage}: the program lamp is neither next to it nor in PATH\n")
        );
    }
}

#[test]
fn a_stage_finds_lamp_in_the_path() {
    let ran = run_alone("slice", bin("lamp").parent().expect("a folder of programs"));
    assert!(ran.status.success() && ran.stdout.starts_with(b"slice "), "{ran:?}");
}

#[test]
fn stages_have_their_own_names_and_status() {
    let scratch = Scratch::new();
    for stage in ["slice", "fix", "dither", "tile"] {
        let help = scratch.run(&format!("{stage} --help")).succeeds_quietly().stdout;
        let help = String::from_utf8(help).expect("text");
        assert!(help.contains(&format!("Usage: {stage} ")), "{help}");
        let usage = scratch.run(&format!("{stage} --no-such-option"));
        usage.is_wrong_usage(&["unexpected argument '--no-such-option'"]);
        scratch.run(&format!("{stage} missing.file")).is_refused_with(&[&format!("{stage}: ")]);
    }
}

/// Signals to the program reach the stage, since they are one process.
#[cfg(target_os = "linux")]
#[test]
fn a_stage_is_the_process_that_was_started() {
    let scratch = Scratch::new();
    let mut fix = scratch.command("fix").stdin(Stdio::piped()).spawn().expect("a program");
    let lamp = fs::canonicalize(bin("lamp")).expect("a file");
    let link = format!("/proc/{}/exe", fix.id());
    let start = Instant::now();
    while fs::read_link(&link).expect("a process that waits for its input") != lamp {
        assert!(start.elapsed() < Duration::from_secs(60), "{link} is lamp");
        thread::sleep(Duration::from_millis(1));
    }
    fix.kill().expect("a process");
    fix.wait().expect("a process");
}
