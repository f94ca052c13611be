//! Fails the first, second, third and further call of one kind in every command that writes, until
//! the command succeeds, as SQLite's tests do: each failure is noticed, and none leaves half an
//! output.
#![cfg(target_os = "linux")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use lamp_tests::{Scratch, target_dir, tilted_ball, workspace_root};

/// Commands that write, as users type them. `out` is what they write.
const WRITERS: &[&str] = &[
    "slice ball.stl --dpi 40 --thickness 2mm -o out.tif",
    "slice ball.stl --dpi 40 --thickness 2mm -o out/",
    "slice ball.stl --dpi 40 --thickness 2mm -o out.lamp",
    "slice ball.stl --dpi 40 --thickness 2mm --report out.json",
    "fix good.tif -o out.tif",
    "fix stray.tif --evidence out/",
    "dither good.tif -o out.tif",
    "tile good.tif --fit --area 2x2in --mesh none -o out.tif",
    "tile good.tif --area 2x2in --mesh none --recipe out.json",
    "tile good.tif --area 2x2in --mesh none --strips out/ --mirrors 40",
    "tile good.tif --area 2x2in --mesh none --fields 40x40 -o out/",
    "lamp compensate good.tif --uniform 100um -o out.tif",
    "lamp check good.tif --evidence out/",
    "lamp show good.tif --layer 2 -o out.png",
    "lamp report good.tif -o out.html",
    "lamp report good.tif -o out/",
    "lamp convert good.tif --png -o out/",
    "lamp convert ball.stl out.step",
    "lamp pack good.tif -o out.lamp",
    "lamp join good.tif -o out.tif",
    "lamp split good.tif --every 2 -o out/",
    "lamp mesh-out good.tif -o out.stl",
    "lamp mesh repair ball.stl -o out.stl",
    "lamp plan speed good.tif --material pegda-sudan -o out.tif",
    "lamp learn out/ --start good.tif --speed 1um/s..2mm/s --material pegda-sudan",
    "lamp target squares --sizes 4 --doses 60,90mJ/cm2 --intensity 1W/cm2 --dpi 100 -o out/",
    "lamp target scan --widths 4 --doses 60,90mJ/cm2 --intensity 1W/cm2 --dpi 100 -o out/",
    "lamp sample cube -o out.stl",
    "lamp edit good.tif edits.toml -o out.tif",
    "lamp support good.tif --part ball.stl -o out.tif",
    "lamp compose build.json -o out.tif",
    "lamp cure good.tif --material lamp-suspension --section y=0mm -o out.png",
    "lamp plan voxels good.tif --material pegda-sudan -o out.tif",
    "lamp heights ball.stl --csv out.csv",
    "lamp orient ball.stl --directions 20 --plot out.svg",
    "lamp learn job --measured a.csv --law single -o out.csv",
    "lamp print-sim job -o out.csv",
    "lamp job good.tif --machine scan.toml -o out/",
    "lamp frames good.tif --machine scan.toml --layer 2 --swath 0 -o out.frames",
];

/// Commands that write nothing by themselves, or only through those above; nights keep a store and
/// are attacked by kills (`batch_kills`), calibration writes as `sample` does.
const OTHERS: &[&str] = &[
    "demo",
    "info",
    "verify",
    "compare",
    "view",
    "machine",
    "expose",
    "material",
    "projector",
    "calibrate",
    "brep",
    "batch",
    "config",
    "doctor",
    "completions",
    "man",
    "help",
];

/// Calls that fail, and whether the command must fail with them.
const CALLS: [(&str, Must); 8] = [
    ("open", Must::FailOrNot),
    ("write", Must::Fail),
    ("short", Must::Succeed),
    ("fsync", Must::Fail),
    ("close", Must::Fail),
    ("rename", Must::Fail),
    ("mkdir", Must::Fail),
    ("readdir", Must::FailOrNot),
];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Must {
    Fail,
    Succeed,
    /// Leftovers of other runs may stay unseen.
    FailOrNot,
}

/// Builds the library that fails calls.
fn library() -> PathBuf {
    let source = workspace_root().join("tests/tests/late_disks/fail.c");
    let library = target_dir().join("lamp_fail.so");
    let mut cc = Command::new("cc");
    cc.args(["-shared", "-fPIC", "-O1", "-o"]).arg(&library).arg(source).arg("-ldl");
    assert!(cc.status().expect("cc links Rust programs, too").success());
    library
}

fn scratch() -> Scratch {
    let scratch = Scratch::new();
    scratch.mesh("ball.stl", &tilted_ball());
    for line in [
        "slice ball.stl --dpi 40 --thickness 2mm --material lamp-suspension -q -o good.tif",
        "lamp sample tower --facets 2k --defect drop --count 20 --seed 7 -q -o broken.stl",
        "slice broken.stl --dpi 100 --thickness 2mm -q -o stray.tif",
        "tile good.tif --area 2x2in --mesh none -q --recipe build.json",
        "lamp learn job --start good.tif --speed 1um/s..2mm/s --material pegda-sudan -q",
    ] {
        scratch.run(line).succeeds();
    }
    let scan = "name = \"scan\"\ndescription = \"\"\n[area]\nvalue = \"9x9in\"\nsource = \"-\"\n\
                [scan]\nmirrors = [40, 8]\noverlap = 4\nspeed = [\"0.001mm/s\", \"900mm/s\"]\n\
                acceleration = \"2000mm/s2\"\nrow_clock_hz = 22000\nboth_ways = true\nsource = \"-\"\n";
    scratch.write("scan.toml", scan.as_bytes());
    let edit =
        "[[edit]]\nop = \"subtract\"\nbox = { x = [\"-1mm\", \"1mm\"], y = [\"-1mm\", \"1mm\"] }\n";
    scratch.write("edits.toml", edit.as_bytes());
    let rows: String = (0..6).map(|layer| format!("{layer},{},0\n", 10 * layer)).collect();
    scratch.write("a.csv", format!("layer,over_px,under_px\n{rows}").as_bytes());
    scratch
}

/// Returns the bytes of what a command writes, if it is there.
fn output(scratch: &Scratch, line: &str) -> Option<Vec<u8>> {
    let path = scratch.path(line.split(' ').find(|word| word.starts_with("out")).unwrap());
    if !path.is_dir() {
        return fs::read(path).ok();
    }
    let mut files: Vec<_> =
        fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    Some(files.iter().flat_map(|file| fs::read(file).unwrap()).collect())
}

/// Puts the learning job back as it was begun.
fn restart_job(scratch: &Scratch) {
    for name in ["print-000-measured.csv", "print-001.csv", "print-001-doses.csv"] {
        let _ = fs::remove_file(scratch.path("job").join(name));
    }
}

fn clear(scratch: &Scratch, names: &[String]) {
    for name in scratch.names().iter().filter(|name| !names.contains(name)) {
        let path = scratch.path(name);
        let _ = fs::remove_file(&path).or_else(|_| fs::remove_dir_all(&path));
    }
}

/// Fails the calls of a command, one after another. Returns how many failed.
fn attack(library: &Path, line: &str) -> usize {
    let scratch = scratch();
    let names = scratch.names();
    scratch.run(line).succeeds();
    let right = output(&scratch, line).expect("an output");
    let done = scratch.path("failed");
    let mut all = 0;
    for (call, must) in CALLS {
        // Every one at first, then fewer: a folder of pages has many alike.
        let mut at = 1;
        loop {
            clear(&scratch, &names);
            restart_job(&scratch);
            let mut command = scratch.command(line);
            command.env("LD_PRELOAD", library).env("LAMP_FAIL", call);
            command.env("LAMP_FAIL_AT", at.to_string()).env("LAMP_FAIL_DONE", &done);
            let ran = command.output().unwrap();
            if !done.exists() {
                assert!(ran.status.success(), "{line}, {call} {at}: {ran:?}");
                break;
            }
            fs::remove_file(&done).unwrap();
            let place = format!("{line}, {call} {at}");
            let said = String::from_utf8_lossy(&ran.stderr).into_owned();
            let left: Vec<_> =
                scratch.names().into_iter().filter(|it| !names.contains(it)).collect();
            let found = output(&scratch, line);
            match ran.status.code() {
                Some(0) => {
                    assert!(must != Must::Fail, "{place} is passed over");
                    assert!(found.as_ref() == Some(&right), "{place}: another output");
                }
                Some(1) => {
                    assert!(must != Must::Succeed, "{place}: {said}");
                    assert!(!said.contains("panicked") && !said.is_empty(), "{place}: {said}");
                    assert!(found.is_none_or(|it| it == right), "{place}: half an output");
                }
                status => panic!("{place}: {status:?}: {said}"),
            }
            assert!(left.iter().all(|name| name.starts_with("out")), "{place}: {left:?} are left");
            all += 1;
            at += 1 + at / 8;
        }
    }
    all
}

#[test]
fn every_command_that_writes_is_attacked() {
    let scratch = Scratch::new();
    let ran = scratch.run("lamp completions fish").succeeds_quietly();
    let text = String::from_utf8(ran.stdout).unwrap();
    let of_lamp =
        text.lines().filter_map(|line| line.split("__fish_lamp_needs_command\" -f -a \"").nth(1));
    let commands: Vec<&str> = of_lamp.map(|rest| rest.split('"').next().unwrap()).collect();
    assert!(commands.len() > 30, "{commands:?}");
    for command in commands {
        let mut words = WRITERS.iter().map(|line| line.strip_prefix("lamp ").unwrap_or(line));
        let is_attacked = words.any(|line| line.split(' ').next() == Some(command));
        assert!(is_attacked || OTHERS.contains(&command), "{command}: add it to the writers");
    }
}

#[test]
fn no_failure_of_a_disk_is_passed_over() {
    let library = library();
    let (next, all) = (AtomicUsize::new(0), AtomicUsize::new(0));
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(2, usize::from) {
            scope.spawn(|| {
                while let Some(line) = WRITERS.get(next.fetch_add(1, Ordering::Relaxed)) {
                    all.fetch_add(attack(&library, line), Ordering::Relaxed);
                }
            });
        }
    });
    let all = all.into_inner();
    lamp_tests::note(&format!("{all} calls failed in {} commands", WRITERS.len()));
    assert!(all > 20 * WRITERS.len(), "{all} calls failed");
}

/// Standard output is synced where it is a file, unless that is left out.
#[test]
fn a_redirected_stack_is_synced() {
    let (library, scratch) = (library(), scratch());
    let done = scratch.path("failed");
    for (options, fails) in [("", true), ("--no-sync", false)] {
        let out = fs::File::create(scratch.path("out.tif")).unwrap();
        let mut command = scratch.command(&format!("fix good.tif {options}"));
        command.env("LD_PRELOAD", &library).env("LAMP_FAIL", "fsync").env("LAMP_FAIL_AT", "1");
        let ran = command.env("LAMP_FAIL_DONE", &done).stdout(out).output().unwrap();
        assert_eq!(ran.status.success(), !fails, "{ran:?}");
        assert_eq!(done.exists(), fails);
        let _ = fs::remove_file(&done);
    }
}

/// A store that can only be read serves what it has.
#[test]
fn a_store_that_is_only_read_serves() {
    let (library, scratch) = (library(), scratch());
    let night = "[defaults]\nstages = [\"slice --dpi 60 --thickness 2mm\"]\n\
                 [[part]]\nfile = \"ball.stl\"\n[output]\nfolder = \"out\"\n";
    scratch.write("night.toml", night.as_bytes());
    scratch.run("lamp batch night.toml -q").succeeds();
    let right = scratch.bytes("out/parts/ball.lamp");
    fs::remove_dir_all(scratch.path("out")).unwrap();
    for line in [
        "lamp batch status night.toml",
        "lamp batch plan night.toml",
        "lamp batch night.toml -q",
        "lamp batch verify night.toml",
    ] {
        let mut command = scratch.command(line);
        let ran = command.env("LD_PRELOAD", &library).env("LAMP_FAIL", "store").output().unwrap();
        assert!(ran.status.success(), "{line}: {ran:?}");
    }
    assert_eq!(scratch.bytes("out/parts/ball.lamp"), right);
}
