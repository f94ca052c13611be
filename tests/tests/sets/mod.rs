//! Every command that reads a stack, every form of a stack, and every way in which a set of pages
//! can be short or wrong: none gives another result in silence.
//!
//! `matrix.txt` has a line for each command and form, and a letter for each fault:
//!
//! - `R` refused: a status other than 0, one sentence, and no output;
//! - `W` done, with a warning;
//! - `=` done, with the output of the whole stack, since what is wrong is not needed for it.
//!
//! A `-` stands for all where the command does not take the form.
//!
//! After a change that is meant, `LAMP_BLESS=1 cargo test -p lamp-tests --test sets` rewrites it.

mod faults;

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use lamp_tests::{Scratch, tilted_ball, workspace_root};

use faults::Form;

/// Commands that read a stack, as users type them: `S` is the stack, `out` what they write, if they
/// do; else their answer counts.
const READERS: &[&str] = &[
    "fix S -o out.tif",
    "fix S -o out/",
    "dither S -o out.tif",
    "lamp compensate S --uniform 100um -o out.tif",
    "lamp edit S edits.toml -o out.tif",
    "tile S --fit --area 2x2in --mesh none -o out.tif",
    "tile S --area 2x2in --mesh none --recipe out.json",
    "lamp info S",
    "lamp verify S",
    "lamp compare S good.tif",
    "lamp check S",
    "lamp support S --part ball.stl -o out.tif",
    "lamp show S --layer 2 -o out.png",
    "lamp show S --layers 0..6 -o out.png",
    "lamp report S -o out.html",
    "lamp convert S -o out.tif",
    "lamp convert S --png -o out/",
    "lamp pack S -o out.lamp",
    "lamp join S -o out.tif",
    "lamp split S --every 2 -o out/",
    "lamp plan speed S --material pegda-sudan -o out.tif",
    "lamp plan voxels S --material pegda-sudan -o out.tif",
    "lamp learn out/ --start S --speed 1um/s..2mm/s --material pegda-sudan",
    "lamp cure S --material lamp-suspension --section y=0mm -o out.png",
    "lamp mesh-out S -o out.stl",
    "lamp job S --machine scan.toml -o out/",
    "lamp frames S --machine scan.toml --layer 2 --swath 0 -o out.frames",
];

/// Commands that read no stack, or read it through a command above, or serve one (`view` states
/// what it cannot read, see `view_server`; `compose` and `batch` compare digests of what they
/// read).
const OTHERS: &[&str] = &[
    "slice",
    "sample",
    "demo",
    "view",
    "expose",
    "print-sim",
    "compose",
    "batch",
    "machine",
    "material",
    "projector",
    "calibrate",
    "target",
    "heights",
    "orient",
    "brep",
    "mesh",
    "config",
    "doctor",
    "completions",
    "man",
    "help",
];

/// A folder with a good stack, and the other files that commands need.
fn scratch() -> Scratch {
    let scratch = Scratch::new();
    scratch.mesh("ball.stl", &tilted_ball());
    let edit = "[[edit]]\nop = \"subtract\"\nz = [\"2mm\", \"6mm\"]\n\
                box = { x = [\"-1mm\", \"1mm\"], y = [\"-1mm\", \"1mm\"] }\n";
    scratch.write("edits.toml", edit.as_bytes());
    let scan = "name = \"scan\"\ndescription = \"\"\n[area]\nvalue = \"9x9in\"\nsource = \"-\"\n\
                [scan]\nmirrors = [20, 8]\noverlap = 0\nspeed = [\"0.001mm/s\", \"900mm/s\"]\n\
                acceleration = \"2000mm/s2\"\nrow_clock_hz = 22000\nboth_ways = true\nsource = \"-\"\n\
                [times]\nexpose_s = 1\nsource = \"-\"\n";
    scratch.write("scan.toml", scan.as_bytes());
    let line = "slice ball.stl --dpi 40 --thickness 2mm --material lamp-suspension -q -o good.tif";
    scratch.run(line).succeeds_quietly();
    assert_eq!(scratch.layers("good.tif").len(), 6);
    scratch.run("slice ball.stl --dpi 40 --thickness 2mm --scale 0.9 -q -o other.tif").succeeds();
    scratch
}

/// Runs a command on a stack. Returns its status, messages, and output or answer.
fn outcome(folder: &Scratch, line: &str, form: Form) -> (Option<i32>, String, Option<Vec<u8>>) {
    for name in ["out.tif", "out.json", "out.png", "out.html", "out.lamp", "out.stl", "out.frames"]
    {
        let _ = fs::remove_file(folder.path(name));
    }
    let _ = fs::remove_dir_all(folder.path("out"));
    let stack = match form {
        Form::Pipe => "-",
        form => form.name(),
    };
    let words: Vec<&str> =
        line.split(' ').map(|word| if word == "S" { stack } else { word }).collect();
    let input = if form == Form::Pipe { folder.bytes(form.name()) } else { Vec::new() };
    let ran = folder.run_on(&words.join(" "), &input);
    let out = words.iter().find(|word| word.starts_with("out"));
    let output = match out {
        Some(name) if folder.path(name).is_dir() => Some(bytes_in(&folder.path(name))),
        Some(name) => fs::read(folder.path(name)).ok(),
        None => Some(ran.stdout),
    };
    (ran.statuses[0], ran.stderr, output)
}

/// Returns all files of a folder, one after another.
fn bytes_in(folder: &Path) -> Vec<u8> {
    let mut files: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.iter().flat_map(|file| fs::read(file).unwrap()).collect()
}

/// Returns the letter of a cell. `whole` is the output for the whole stack.
fn cell(folder: &Scratch, line: &str, form: Form, whole: &[u8]) -> Result<char, String> {
    let (status, said, output) = outcome(folder, line, form);
    let writes = line.contains(" out");
    match status {
        Some(0) if output.as_deref() == Some(whole) && said.is_empty() => Ok('='),
        Some(0) if !said.is_empty() => Ok('W'),
        Some(0) => Err("another output, without a word".to_owned()),
        // As of `diff`, 1 says that stacks differ.
        Some(1 | 2) if writes && output.is_some() => Err(format!("an output is left: {said}")),
        Some(1 | 2) if said.lines().count() <= 2 && !said.contains("panicked") => Ok('R'),
        status => Err(format!("status {status:?}: {said}")),
    }
}

/// Fills the line of the matrix for a command and a form.
fn line_of(folder: &Scratch, command: &str, form: Form) -> Result<String, String> {
    form.write(folder, None);
    let (status, said, whole) = outcome(folder, command, form);
    let place = format!("{:8} {command}", form.label());
    // A folder of strips or fields is no stack of layers, and only some commands take it for its
    // build.
    let is_cut = matches!(form, Form::Strips | Form::Fields);
    if status == Some(2) || is_cut && status == Some(1) {
        return Ok(format!("{place:66} -\n"));
    }
    if status != Some(0) {
        return Err(format!("{place}: whole, but {status:?}: {said}"));
    }
    let whole = whole.expect("a command that succeeds has an output");
    let mut cells = String::new();
    for &fault in form.faults() {
        form.write(folder, Some(fault));
        let cell = cell(folder, command, form, &whole);
        cells.push(cell.map_err(|why| format!("{place}, {fault:?}: {why}"))?);
    }
    Ok(format!("{place:66} {cells}\n"))
}

#[test]
fn no_set_is_wrong_in_silence() {
    let cases: Vec<(&str, Form)> = READERS
        .iter()
        .flat_map(|&command| Form::ALL.into_iter().map(move |form| (command, form)))
        .collect();
    let (next, lines) = (AtomicUsize::new(0), Mutex::new(vec![None; cases.len()]));
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(2, usize::from) {
            scope.spawn(|| {
                let folder = scratch();
                while let Some(&(command, form)) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let line = line_of(&folder, command, form);
                    let place = cases.iter().position(|case| *case == (command, form)).unwrap();
                    lines.lock().unwrap_or_else(PoisonError::into_inner)[place] = Some(line);
                }
            });
        }
    });
    let lines = lines.into_inner().unwrap().into_iter().flatten();
    let (lines, wrong): (Vec<_>, Vec<_>) = lines.partition(Result::is_ok);
    let wrong: Vec<String> = wrong.into_iter().filter_map(Result::err).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let head: String =
        Form::ALL.iter().map(|form| format!("# {}: {:?}\n", form.label(), form.faults())).collect();
    let matrix: String = std::iter::once(head).chain(lines.into_iter().flatten()).collect();
    let file = workspace_root().join("tests/tests/sets/matrix.txt");
    if std::env::var_os("LAMP_BLESS").is_some() {
        fs::write(&file, &matrix).unwrap();
    }
    let known = fs::read_to_string(&file).unwrap_or_default();
    let changed = matrix.lines().zip(known.lines()).find(|(a, b)| a != b);
    assert!(matrix == known, "the matrix is another: {changed:?}");
}

#[test]
fn every_command_is_in_the_matrix() {
    let scratch = Scratch::new();
    let ran = scratch.run("lamp completions fish").succeeds_quietly();
    let text = String::from_utf8(ran.stdout).unwrap();
    let of_lamp = text.lines().filter(|line| line.contains("__fish_lamp_needs_command\" -f -a \""));
    let commands: Vec<&str> = of_lamp
        .map(|line| line.split("-a \"").nth(1).unwrap().split('"').next().unwrap())
        .collect();
    assert!(commands.len() > 30, "{commands:?}");
    for command in commands {
        let is_reader =
            |line: &&str| line.strip_prefix("lamp ").unwrap_or(line).starts_with(command);
        assert!(
            READERS.iter().any(is_reader) || OTHERS.contains(&command),
            "{command}: add it to the matrix if it reads stacks, else to the others"
        );
    }
}

#[test]
fn folders_of_stacks_hide_none() {
    let scratch = scratch();
    fs::create_dir(scratch.path("night")).unwrap();
    scratch.run("lamp pack good.tif -q -o night/a.lamp").succeeds();
    for command in ["lamp verify night", "lamp report night -o site.html"] {
        scratch.run(command).succeeds();
    }
    fs::copy(scratch.path("good.tif"), scratch.path("night/b.tif")).unwrap();
    scratch.run("lamp verify night").succeeds();
    let mut bytes = scratch.bytes("night/a.lamp");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    for name in ["night/a.lamp", "night/a.old"] {
        scratch.write(name, &bytes);
        assert_eq!(scratch.run("lamp verify night").statuses, [Some(1)], "{name}");
        let ran = scratch.run("lamp report night --force -o site/");
        assert_eq!(ran.statuses, [Some(1)], "{name}");
        fs::remove_file(scratch.path(name)).unwrap();
    }
    scratch.run("lamp verify night").succeeds();
    // Pages, and a packed stack next to them.
    scratch.run("lamp convert good.tif -q -o night/pages/").succeeds();
    scratch.run("lamp verify night").succeeds();
    scratch.write("night/pages/a.lamp", &bytes);
    assert_eq!(scratch.run("lamp verify night").statuses, [Some(1)]);
    assert_eq!(scratch.run("lamp verify night/pages").statuses, [Some(1)]);
}
