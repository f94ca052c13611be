//! Records of stacks, recipes and jobs: commands that can be typed again, files that are found by
//! their digests, and numbers that nobody changes in silence.

use std::fs;
use std::process::Command;

use lamp_fixtures::{Plate, Sample, cavity_staircase};
use lamp_tests::{Ran, Scratch, bin, tilted_ball};

/// Runs a line in a shell, with the binaries before all others on its path.
fn shell(scratch: &Scratch, line: &str) -> Ran {
    let path = std::env::var("PATH").unwrap_or_default();
    let folder = bin("lamp").parent().unwrap().display().to_string();
    let mut shell = Command::new("sh");
    shell.args(["-c", line]).current_dir(scratch).env("PATH", format!("{folder}:{path}"));
    let ran = shell.output().unwrap();
    let stderr = String::from_utf8_lossy(&ran.stderr).into_owned();
    Ran::new(line, vec![ran.status.code()], ran.stdout, &stderr)
}

fn commands(scratch: &Scratch, stack: &str) -> Vec<String> {
    scratch.layers(stack)[0].info.stack.as_ref().unwrap().commands.clone()
}

/// Returns the part's name in a stack.
fn part(scratch: &Scratch, stack: &str) -> String {
    scratch.layers(stack)[0].info.stack.as_ref().unwrap().part.clone()
}

#[test]
fn a_part_has_the_name_that_it_is_given() {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 5_000);
    let line = "cat tower.stl | slice - --dpi 100 --thickness 1mm --name 'Blade 7' -o a.tif";
    shell(&scratch, line).succeeds();
    assert_eq!(part(&scratch, "a.tif"), "Blade 7");
    let [command] = &commands(&scratch, "a.tif")[..] else { panic!("one command made it") };
    assert!(command.ends_with(" --name 'Blade 7'"), "{command}");
    // The name changes no image, and the record that has it is read again.
    scratch.run("slice tower.stl --dpi 100 --thickness 1mm -o b.tif").succeeds();
    scratch.run("lamp compare a.tif b.tif").succeeds();
    scratch.run("lamp support a.tif --part tower.stl -o c.tif").succeeds();
    assert_eq!(part(&scratch, "c.tif"), "Blade 7");
    for blank in ["--name=", "'--name=  '"] {
        let ran = shell(&scratch, &format!("slice tower.stl {blank} -o d.tif"));
        ran.is_wrong_usage(&["--name", "blank"]);
    }
}

/// Names of files that shells and options would take for something else.
const NAMES: [&str; 7] = [
    "plain.stl",
    "my part.stl",
    "my --part.stl",
    "it's $HOME.stl",
    "a@1,2.stl",
    "a@1,2",
    "-odd.stl",
];

#[test]
fn recorded_commands_can_be_typed_again() {
    for name in NAMES {
        let scratch = Scratch::new();
        scratch.mesh(name, &tilted_ball());
        let word = if name.starts_with('-') { format!("./{name}") } else { name.to_owned() };
        let quoted = format!("'{}'", word.replace('\'', r"'\''"));
        let slice = format!("slice {quoted} --dpi 40 --thickness 2mm --material lamp-suspension");
        shell(&scratch, &format!("{slice} -q -o first.tif")).succeeds();
        let recorded = commands(&scratch, "first.tif");
        shell(&scratch, &format!("{} -q -o again.tif", recorded[0])).succeeds();
        assert!(scratch.bytes("first.tif") == scratch.bytes("again.tif"), "{name}: {recorded:?}");
        // Commands that open the part of a stack again.
        let part = format!("--part {quoted}");
        let cure = "lamp cure first.tif --material lamp-suspension --section y=0mm -q -o out.png";
        shell(&scratch, &format!("{cure} {part}")).succeeds();
        shell(&scratch, &format!("lamp support first.tif {part} -q -o held.tif")).succeeds();
    }
}

#[test]
fn placements_of_odd_names_are_kept() {
    let scratch = Scratch::new();
    scratch.mesh("a@1,2.stl", &tilted_ball());
    shell(&scratch, "slice 'a@1,2.stl@3,4' --dpi 40 --thickness 2mm -q -o a.tif").succeeds();
    shell(&scratch, "lamp support a.tif --part 'a@1,2.stl@3,4,0' -q -o held.tif").succeeds();
    let ran = shell(&scratch, "lamp support a.tif --part 'a@1,2.stl' -q -o held.tif");
    ran.is_refused_with(&["with the same placements"]);
}

/// A material of one's own that is called as a built-in one is.
fn own_material(scratch: &Scratch, dose: &str) {
    let shown = scratch.run("lamp material show lamp-suspension").succeeds_quietly().stdout;
    let text = String::from_utf8(shown).unwrap();
    assert!(text.contains("131.5 mJ/cm2"));
    scratch.write("mine.toml", text.replacen("131.5 mJ/cm2", dose, 1).as_bytes());
}

#[test]
fn a_material_is_found_by_its_digest() {
    let scratch = Scratch::new();
    scratch.mesh("plate.stl", &Plate::Triangle.mesh(4.0));
    own_material(&scratch, "150 mJ/cm2");
    let slice = "slice plate.stl --dpi 100 --thickness 1mm --material mine.toml -q -o plate.tif";
    scratch.run(slice).succeeds();
    let layer = &scratch.layers("plate.tif")[0];
    let stack = layer.info.stack.as_ref().unwrap();
    assert!(stack.commands[0].contains("--material mine.toml@blake3:"), "{:?}", stack.commands);
    let numbers = &stack.other["material"];
    assert_eq!(numbers["name"], "lamp-suspension");
    assert!(numbers.to_string().contains("150 mJ/cm2"), "{numbers}");
    let plan =
        "tile plate.tif --mesh none --turns 15deg --area 70x40mm --layout-out l.json -o b.tif -q";
    let script = String::from_utf8(scratch.run(plan).succeeds().stdout).unwrap();
    let line = script.lines().find(|line| line.starts_with("slice"));
    if let Some(line) = line {
        shell(&scratch, &format!("{line}-again.tif")).succeeds();
    }
    // The file is another one now, or gone.
    own_material(&scratch, "140 mJ/cm2");
    scratch.run(plan).is_refused_with(&["mine.toml@blake3:", "no unchanged"]);
    let recorded = commands(&scratch, "plate.tif");
    shell(&scratch, &format!("{} -q -o x.tif", recorded[0]))
        .is_refused_with(&["has changed: its digest"]);
    fs::remove_file(scratch.path("mine.toml")).unwrap();
    scratch.run(plan).is_refused_with(&["mine.toml@blake3:", "no unchanged"]);
}

/// Changes each byte of some in a file, and checks that a command refuses it or gives the same.
fn damage(scratch: &Scratch, file: &str, line: &str, output: Option<&str>, every: usize) {
    let bytes = scratch.bytes(file);
    let right = |ran: &Ran| output.map_or_else(|| ran.stdout.clone(), |name| scratch.bytes(name));
    let expected = right(&scratch.run(line).succeeds());
    let mut refused = 0;
    for at in (0..bytes.len()).step_by(every) {
        let mut changed = bytes.clone();
        // Another digit or letter.
        changed[at] ^= 1;
        scratch.write(file, &changed);
        let ran = scratch.run(line);
        match ran.statuses[0] {
            Some(0) => assert!(right(&ran) == expected, "{file}: byte {at}"),
            _ => refused += 1,
        }
    }
    scratch.write(file, &bytes);
    assert!(10 * refused > 8 * (bytes.len() / every), "{file}: {refused} refused");
}

#[test]
fn a_changed_recipe_is_refused() {
    let scratch = Scratch::new();
    scratch.mesh("ball.stl", &tilted_ball());
    scratch.run("slice ball.stl --dpi 40 --thickness 2mm -q -o ball.tif").succeeds();
    scratch.run("tile ball.tif --area 2x2in --mesh none -q --recipe build.json").succeeds();
    damage(&scratch, "build.json", "lamp compose build.json -q -o out.tif", Some("out.tif"), 3);
}

#[test]
fn a_changed_job_is_refused() {
    let scratch = Scratch::new();
    scratch.stack("stairs.tif", cavity_staircase(1).layers());
    let plan = "lamp plan speed stairs.tif --material pegda-sudan --search-gap 5% -q -o timed.tif";
    scratch.run(plan).succeeds();
    scratch.run("lamp learn job/ --start timed.tif --material pegda-sudan -q").succeeds();
    let rows: String = (0..60).map(|layer| format!("{layer},{},0\n", 10 * layer)).collect();
    scratch.write("a.csv", format!("layer,over_px,under_px\n{rows}").as_bytes());
    let line = "lamp learn job/ --measured a.csv --law single -q -o next.csv";
    scratch.run(line).succeeds();
    for (file, every) in [
        ("job/job.toml", 29),
        ("job/material.toml", 97),
        ("job/print-000.csv", 131),
        ("job/print-001.csv", 131),
    ] {
        damage(&scratch, file, line, Some("next.csv"), every);
    }
}

#[test]
fn a_stranger_s_folder_is_never_replaced() {
    let scratch = Scratch::new();
    scratch.mesh("ball.stl", &tilted_ball());
    scratch.run("slice ball.stl --dpi 40 --thickness 2mm -q -o y.tif").succeeds();
    for name in ["index.html", "strips.json", "layer_00001.tif", "report.json", "squares.csv"] {
        fs::create_dir(scratch.path("site")).unwrap();
        scratch.write(&format!("site/{name}"), b"mine");
        for line in [
            "lamp split y.tif --every 2 -o site --force",
            "lamp convert y.tif -o site/ --force",
            "lamp report y.tif -o site/ --force",
            "fix y.tif --evidence site/ --force -o z.tif",
        ] {
            let ran = scratch.run(line);
            assert_ne!(ran.statuses, [Some(0)], "{line}");
            assert_eq!(scratch.bytes(&format!("site/{name}")), b"mine", "{line}");
        }
        fs::remove_dir_all(scratch.path("site")).unwrap();
    }
    scratch.run("lamp split y.tif --every 2 -q -o site").succeeds();
    scratch.run("lamp report y.tif -q -o site/ --force").succeeds();
    assert!(scratch.path("site/index.html").exists());
}
