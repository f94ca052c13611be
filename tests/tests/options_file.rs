//! Checks `--options`, and the defaults that machines give to `slice`.

use lamp_fixtures::Sample;
use lamp_tests::Scratch;

const NIGHT: &str = r#"
dpi = 100
quiet = true

[slice]
thickness = "2mm"
rotate = ["x:90", "z:-12.5"]
margin = 3

[tile]
area = "100x100mm"
mesh = "none"
"#;

fn with_tower(options: &str) -> Scratch {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 2_000);
    scratch.write("night.toml", options.as_bytes());
    scratch
}

/// The commands that made a stack, as it records them.
fn commands(scratch: &Scratch, stack: &str) -> Vec<String> {
    scratch.layers(stack)[0].info.stack.clone().expect("the first page has it").commands
}

#[test]
fn one_file_serves_a_night() {
    let scratch = with_tower(NIGHT);
    let line = "slice tower.stl --options night.toml | tile --options night.toml > build.tif";
    scratch.run(line).succeeds_quietly();
    let [slice, tile] = &commands(&scratch, "build.tif")[..] else { panic!("two commands") };
    // The options that took effect are recorded, not the file.
    assert_eq!(
        slice,
        "slice tower.stl --dpi 100 --thickness 2mm --plane top --units mm --fill solid \
         --rotate x:90,z:-12.5 --margin 3"
    );
    assert!(tile.starts_with("tile --area 100x100mm "), "{tile}");
    let plain = "slice tower.stl --dpi 100 --thickness 2mm --rotate x:90,z:-12.5 --margin 3 -q \
                 -o plain.tif";
    scratch.run(plain).succeeds_quietly();
    scratch.run("lamp slice tower.stl --options night.toml -o file.tif").succeeds_quietly();
    assert!(scratch.bytes("plain.tif") == scratch.bytes("file.tif"));
}

#[test]
fn the_command_line_wins() {
    let scratch = with_tower(NIGHT);
    for (options, recorded) in [
        (
            "--thickness 4mm --rotate z:5",
            "--dpi 100 --thickness 4mm --plane top --units mm --fill \
          solid --rotate z:5 --margin 3",
        ),
        // Options that contradict it are left out, too.
        ("--adaptive --max 4mm", "--dpi 100 --adaptive --max 4mm --plane top"),
        ("--origin -20,60 --size 40x120mm --rotate x:0", "--origin -20,60 --size 40x120mm"),
    ] {
        let line = format!("lamp --options night.toml slice {options} -o x.tif -- tower.stl");
        scratch.run(&line).succeeds_quietly();
        let slice = &commands(&scratch, "x.tif")[0];
        assert!(slice.contains(recorded), "{slice}");
    }
}

#[test]
fn a_file_gives_what_a_command_requires() {
    let scratch = with_tower("[split]\nevery = 30\noutput = \"parts/\"\n");
    scratch.run("slice tower.stl --dpi 50 --thickness 1mm -q -o tower.tif").succeeds_quietly();
    scratch.run("lamp split tower.tif").is_wrong_usage(&["required", "--output"]);
    scratch.run("lamp split tower.tif --options night.toml").succeeds();
    assert!(scratch.path("parts").is_dir());
}

#[test]
fn wrong_files_are_wrong_usage() {
    let scratch = with_tower("");
    for (text, words) in [
        ("[slice]\ndip = 100", ["night.toml: line 2: dip", "slice has no such option"]),
        ("[slice]\ndpi = \"many\"", ["night.toml: line 2: dpi", "`many` is not a resolution"]),
        ("\n\ngray = \"yes\"", ["night.toml: line 3: gray", "true or false"]),
        ("dpi", ["night.toml: line 1", "options files are TOML"]),
        // Another command's table.
        ("[tile]\narea = \"4x4\"", ["night.toml: line 2: area", "not a size"]),
        // The options of file and command line together.
        ("[slice]\ngray = true", ["--material", "With the options of night.toml"]),
    ] {
        scratch.write("night.toml", text.as_bytes());
        let line = "slice tower.stl --options night.toml -o x.tif";
        scratch.run(line).is_wrong_usage(&words);
        assert_eq!(scratch.names(), ["night.toml", "tower.stl"]);
    }
    scratch.run("fix --options no.toml").is_wrong_usage(&["no.toml", "No such file"]);
}

const MACHINE: &str = r#"name = "mine"
description = "A machine of mine"

[area]
value = "100x100mm"
source = "data sheet"

[defaults]
dpi = 50
thickness = "4mm"
margin = 7
"#;

#[test]
fn a_machine_gives_slice_its_defaults() {
    let scratch = with_tower("thickness = \"2mm\"");
    scratch.write("mine.toml", MACHINE.as_bytes());
    for (options, recorded) in [
        ("", "--dpi 50 --thickness 4mm --plane top --units mm --fill solid --margin 7"),
        // The options file goes before the machine, the command line before both.
        ("--options night.toml --margin 0", "--dpi 50 --thickness 2mm --plane top"),
        ("--dpi 60 --adaptive --max 8mm", "--dpi 60 --adaptive --max 8mm --plane top"),
    ] {
        let line = format!("slice tower.stl --machine mine.toml -q -o x.tif {options}");
        scratch.run(&line).succeeds_quietly();
        let slice = &commands(&scratch, "x.tif")[0];
        assert!(slice.contains(recorded), "{slice}");
    }
    // The options file may name the machine.
    scratch.write("night.toml", b"[slice]\nmachine = \"mine.toml\"\n");
    scratch.run("slice tower.stl --options night.toml -q -o y.tif").succeeds_quietly();
    assert!(commands(&scratch, "y.tif")[0].contains("--dpi 50 --thickness 4mm"));
    let from_pipe = "slice tower.stl --machine - -o x.tif";
    scratch.run(from_pipe).is_wrong_usage(&["name the machine's file"]);
}
