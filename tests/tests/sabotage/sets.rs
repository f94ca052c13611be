//! Damaged sets, jobs, recipes, nights and stores: each gives what the whole one gives, or an error.

use std::fs;
use std::path::{Path, PathBuf};

use lamp_fixtures::{Sample, SplitMix, cavity_staircase};
use lamp_tests::hostile::damage;
use lamp_tests::{Scratch, note, tilted_ball};

use super::limits::limited;
use super::trials;

/// Something of several files, and a command that reads them.
struct Target {
    name: &'static str,
    /// Makes them in a folder `set`.
    make: fn(&Scratch),
    /// Writes `out`.
    line: &'static str,
    /// Whether people edit it, so that a changed number is as good as another.
    is_edited: bool,
}

const TARGETS: [Target; 10] = [
    Target {
        name: "files",
        make: |s| convert(s, "-o set/a.tif"),
        line: FIX_FILE,
        is_edited: false,
    },
    Target { name: "folders", make: |s| convert(s, "-o set/a/"), line: FIX, is_edited: false },
    Target {
        name: "PNG folders",
        make: |s| convert(s, "--png -o set/a/"),
        line: FIX,
        is_edited: false,
    },
    Target { name: "packed", make: packed, line: "fix set/a.lamp -q -o out", is_edited: false },
    Target { name: "strips", make: strips, line: "lamp join set/a -q -o out", is_edited: false },
    Target { name: "fields", make: fields, line: "lamp join set/a -q -o out", is_edited: false },
    Target {
        name: "recipes",
        make: recipe,
        line: "lamp compose set/build.json -q -o out",
        is_edited: false,
    },
    Target {
        name: "jobs",
        make: job,
        line: "lamp learn set/job --measured a.csv --law single -q -o out",
        is_edited: false,
    },
    Target { name: "nights", make: night, line: "lamp batch set/night.toml -q", is_edited: true },
    Target { name: "stores", make: store, line: "lamp batch set/night.toml -q", is_edited: false },
];

const FIX_FILE: &str = "fix set/a.tif -q -o out";
const FIX: &str = "fix set/a -q -o out";

fn convert(scratch: &Scratch, to: &str) {
    scratch.run(&format!("lamp convert good.tif -q {to}")).succeeds();
}

fn packed(scratch: &Scratch) {
    scratch.run("lamp pack good.tif -q -o set/a.lamp").succeeds();
}

fn strips(scratch: &Scratch) {
    let line = "tile good.tif --area 40x40mm --mesh none --strips set/a --mirrors 40 -q -o x.tif";
    scratch.run(line).succeeds();
}

fn fields(scratch: &Scratch) {
    let line = "tile good.tif --area 40x40mm --mesh none --fields 40x30 --overlap 4 -q -o set/a/";
    scratch.run(line).succeeds();
}

fn recipe(scratch: &Scratch) {
    convert(scratch, "-o set/a.tif");
    let line = "tile set/a.tif --area 40x40mm --mesh none -q --recipe set/build.json";
    scratch.run(line).succeeds();
}

fn job(scratch: &Scratch) {
    scratch.stack("stairs.tif", cavity_staircase(1).layers());
    let plan = "lamp plan speed stairs.tif --material pegda-sudan --search-gap 5% -q -o timed.tif";
    scratch.run(plan).succeeds();
    scratch.run("lamp learn set/job --start timed.tif --material pegda-sudan -q").succeeds();
    let rows: String = (0..60).map(|layer| format!("{layer},{},0\n", 10 * layer)).collect();
    scratch.write("a.csv", format!("layer,over_px,under_px\n{rows}").as_bytes());
}

fn night(scratch: &Scratch) {
    scratch.part("set/a.stl", Sample::Cube, 64);
    let night = "[defaults]\nstages = [\"slice --dpi 60 --thickness 2mm\", \"fix\"]\nranges = 2\n\
                 [[part]]\nfile = \"a*.stl\"\n[[build]]\nname = \"two\"\nparts = [\"a:2\"]\n\
                 tile = \"--area 60x60mm --mesh none\"\n[output]\nfolder = \"../out\"\n";
    scratch.write("set/night.toml", night.as_bytes());
}

fn store(scratch: &Scratch) {
    night(scratch);
    scratch.run("lamp batch set/night.toml -q").succeeds();
    fs::remove_dir_all(scratch.path("out")).unwrap();
}

/// Returns the files of a folder and of those below, by name.
fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut entries: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    let below = |path: PathBuf| if path.is_dir() { files_below(&path) } else { vec![path] };
    entries.into_iter().flat_map(below).collect()
}

/// Returns what a command wrote, without the reports of nights, which have times.
fn output(scratch: &Scratch) -> Option<Vec<u8>> {
    let out = scratch.path("out");
    if !out.is_dir() {
        return fs::read(out).ok();
    }
    let files = files_below(&out);
    let stacks = files.iter().filter(|file| file.extension().is_some_and(|end| end == "lamp"));
    Some(stacks.flat_map(|file| fs::read(file).unwrap()).collect())
}

fn clear(path: &Path) {
    let _ = fs::remove_file(path).or_else(|_| fs::remove_dir_all(path));
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for file in files_below(from) {
        let place = to.join(file.strip_prefix(from).unwrap());
        fs::create_dir_all(place.parent().unwrap()).unwrap();
        fs::copy(&file, place).unwrap();
    }
}

/// Puts other bytes in the place of a file, also of one that is only to be read.
fn replace(file: &Path, bytes: &[u8]) {
    fs::remove_file(file).unwrap();
    fs::write(file, bytes).unwrap();
}

/// Damages files of a target, one at a time. Returns how many were refused, and how many read as whole
/// or as edited, and what must not be.
fn attack(target: &Target, trials: u64) -> (u64, u64, Vec<String>) {
    let scratch = Scratch::new();
    scratch.mesh("ball.stl", &tilted_ball());
    scratch.run("slice ball.stl --dpi 60 --thickness 2mm -q -o good.tif").succeeds();
    fs::create_dir(scratch.path("set")).unwrap();
    (target.make)(&scratch);
    copy(&scratch.path("set"), &scratch.path("whole"));
    scratch.run(target.line).succeeds();
    let right = output(&scratch).expect("an output");
    let (mut refused, mut read, mut wrong) = (0, 0, Vec::new());
    for number in 0..trials {
        for name in ["out", "set"] {
            clear(&scratch.path(name));
        }
        copy(&scratch.path("whole"), &scratch.path("set"));
        let files = files_below(&scratch.path("set"));
        let victims: Vec<_> = files
            .iter()
            .filter(|file| target.name != "nights" || file.ends_with("night.toml"))
            .filter(|file| {
                target.name != "stores" || file.starts_with(scratch.path("set/lamp-store"))
            })
            .collect();
        let victim = victims[number as usize % victims.len()];
        let mut bytes = fs::read(victim).unwrap();
        damage(&mut bytes, &mut SplitMix(number));
        replace(victim, &bytes);
        let ended = limited(&scratch.command(target.line), "-v 4194304");
        let place = victim.strip_prefix(scratch.path("set")).unwrap().display();
        let is_right = || output(&scratch).as_ref() == Some(&right);
        match ended.status {
            Some(0 | 3) if target.is_edited || is_right() => read += 1,
            Some(1..=3) if !ended.stderr.contains("panicked") => refused += 1,
            _ => wrong.push(format!("{}, {number}, {place}: {ended:?}", target.name)),
        }
    }
    (refused, read, wrong)
}

#[test]
fn damaged_sets_are_errors_or_the_same() {
    note("| damaged | refused | read as it was | read otherwise, or a panic |");
    let mut all_wrong = Vec::new();
    for target in &TARGETS {
        let inputs = trials(9);
        let (refused, read, wrong) = attack(target, inputs);
        note(&format!("| {inputs} of {} | {refused} | {read} | {} |", target.name, wrong.len()));
        all_wrong.extend(wrong);
    }
    assert!(all_wrong.is_empty(), "{}", all_wrong.join("\n"));
}
