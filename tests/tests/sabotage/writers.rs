//! Several writers to one folder, dead and living.

use std::fs;
use std::io::Write;
use std::process::{Child, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use lamp_tests::Scratch;

use super::jobs::{JOBS, Workplace};
use super::limits::PATIENCE;

fn temporaries(scratch: &Scratch) -> Vec<String> {
    scratch.names().into_iter().filter(|name| name.ends_with(".part")).collect()
}

#[test]
fn what_dead_writers_left_goes_and_all_else_stays() {
    let Workplace { scratch, .. } = Workplace::new();
    scratch.write(".a.tif.lamp-aaaaaa.part", b"dead");
    fs::create_dir(scratch.path(".b.lamp-bbbbbb.part")).unwrap();
    scratch.write(".b.lamp-bbbbbb.part/layer_00000.tif", b"dead");
    // Files of an editor, of a user, and of a version without locks.
    let others = [".a.part", ".lamp-aaaaaa.part", "lamp.part"];
    others.iter().for_each(|name| scratch.write(name, b"mine"));
    scratch.run("fix stray.tif -q -o out.tif").succeeds();
    assert_eq!(temporaries(&scratch), others);
}

#[test]
fn the_longest_names_there_are_can_be_written() {
    let Workplace { scratch, .. } = Workplace::new();
    let (file, folder) = (format!("{}.tif", "l".repeat(251)), "ö".repeat(127));
    scratch.run(&format!("fix stray.tif -q -o {file}")).succeeds();
    scratch.run(&format!("fix stray.tif -q -o {folder}/")).succeeds();
    let names = scratch.names();
    assert!(names.contains(&file) && names.contains(&folder), "{names:?}");
}

/// Returns all of a stack but its end, so that a stage begins its output and waits.
fn begun(stack: &[u8]) -> &[u8] {
    &stack[..stack.len() - 1000]
}

/// A command that has begun its output and waits for its input.
fn waiting(scratch: &Scratch, output: &str) -> Child {
    let stray = scratch.bytes("stray.tif");
    let mut fix = scratch.command(&format!("fix -q -o {output}"));
    let mut fix = fix.stdin(Stdio::piped()).spawn().unwrap();
    fix.stdin.as_mut().unwrap().write_all(begun(&stray)).unwrap();
    let start = Instant::now();
    while temporaries(scratch).is_empty() {
        assert!(start.elapsed() < PATIENCE, "it begins no output");
        thread::sleep(Duration::from_millis(1));
    }
    fix
}

#[test]
fn a_living_writers_file_stays() {
    let Workplace { scratch, .. } = Workplace::new();
    let stray = scratch.bytes("stray.tif");
    let mut slow = waiting(&scratch, "slow.tif");
    let held = temporaries(&scratch);
    scratch.run("fix stray.tif -q -o out.tif").succeeds();
    scratch.run("fix stray.tif -q -o pages/").succeeds();
    assert_eq!(temporaries(&scratch), held);
    let mut input = slow.stdin.take().unwrap();
    input.write_all(&stray[begun(&stray).len()..]).unwrap();
    drop(input);
    assert!(slow.wait().unwrap().success());
    assert_eq!(scratch.bytes("slow.tif"), scratch.bytes("out.tif"));
    assert!(temporaries(&scratch).is_empty());
}

#[test]
fn writers_that_start_at_once_do_not_disturb_each_other() {
    let workplace = Workplace::new();
    for job in [&JOBS[3], &JOBS[6]] {
        let wanted = workplace.wanted(job);
        for _ in 0..4 {
            let start =
                |_| workplace.scratch.command(job.line).stdin(Stdio::null()).spawn().unwrap();
            let mut writers: Vec<Child> = (0..6).map(start).collect();
            assert!(writers.iter_mut().all(|writer| writer.wait().unwrap().success()));
            workplace.check_whole(job, &wanted, job.line);
            workplace.check_tidy(job, job.line);
        }
        workplace.clear(job);
    }
}
