//! Options, machines and materials of one's own, and the commands that report them.

use std::fs;

use lamp_fixtures::Sample;
use lamp_tests::{OWN_SETTINGS, Scratch};
use serde_json::Value;

/// A folder with a part, a file of options of one's own and a machine of one's own.
fn with_settings(config: &str) -> Scratch {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 2_000);
    let own = scratch.path(OWN_SETTINGS).join("lamp");
    fs::create_dir_all(own.join("machines")).unwrap();
    fs::create_dir_all(own.join("materials")).unwrap();
    fs::write(own.join("config.toml"), config).unwrap();
    let mine = scratch.run("lamp machine show beta --no-config").succeeds().stdout;
    let mine = String::from_utf8(mine).unwrap().replace("name = \"beta\"", "name = \"mine\"");
    fs::write(own.join("machines/mine.toml"), mine).unwrap();
    let resin = scratch.run("lamp material show lamp-suspension --no-config").succeeds().stdout;
    let resin = String::from_utf8(resin).unwrap().replace("\"lamp-suspension\"", "\"my-resin\"");
    fs::write(own.join("materials/my-resin.toml"), resin).unwrap();
    scratch
}

/// Returns the JSON that a command prints, whatever its status.
fn answer(scratch: &Scratch, line: &str) -> Value {
    serde_json::from_slice(&scratch.run(line).stdout).unwrap()
}

fn dpi(scratch: &Scratch, stack: &str) -> f64 {
    scratch.layers(stack)[0].pitch.expect("it is known").x.get()
}

#[test]
fn the_strongest_file_that_has_an_option_decides() {
    let scratch = with_settings("quiet = true\ndpi = 50\n[slice]\nthickness = \"4mm\"\n");
    scratch.run("slice tower.stl -o a.tif").succeeds_quietly();
    let thick = scratch.layers("a.tif").len();
    assert_eq!(dpi(&scratch, "a.tif"), 50.0);
    // The current folder's file, then the environment's, then the command line.
    scratch.write("lamp.toml", b"dpi = 60\n");
    scratch.run("slice tower.stl -o b.tif").succeeds_quietly();
    assert_eq!((dpi(&scratch, "b.tif"), scratch.layers("b.tif").len()), (60.0, thick));
    scratch.write("night.toml", b"dpi = 70\n");
    let mut command = scratch.command("slice tower.stl -o c.tif");
    assert!(command.env("LAMP_OPTIONS", "night.toml").status().unwrap().success());
    assert_eq!(dpi(&scratch, "c.tif"), 70.0);
    scratch.run("slice tower.stl --dpi 80 -o d.tif").succeeds_quietly();
    assert_eq!(dpi(&scratch, "d.tif"), 80.0);
    let line = "slice tower.stl --no-config --dpi 90 --thickness 2mm -q -o e.tif";
    scratch.run(line).succeeds_quietly();
    assert!(scratch.layers("e.tif").len() > thick);

    let listed = scratch.run("lamp config slice").succeeds().stdout;
    let listed = String::from_utf8(listed).unwrap();
    let of = |word: &str| listed.lines().find(|line| line.starts_with(word)).unwrap_or_default();
    assert!(of("--dpi=60").ends_with("lamp.toml"), "{listed}");
    assert!(of("--thickness=4mm").ends_with("config.toml"), "{listed}");
    assert!(!listed.contains("--dpi=50"), "{listed}");
    let answer = answer(&scratch, "lamp config slice --json");
    let options = answer["options"].as_array().unwrap();
    let told: String = options
        .iter()
        .map(|it| {
            format!("{:<30} {}\n", it["word"].as_str().unwrap(), it["file"].as_str().unwrap())
        })
        .collect();
    assert_eq!(told, listed);
}

#[test]
fn a_machine_fills_in_right_after_the_file_that_names_it() {
    let scratch = with_settings("machine = \"coarse\"\nmargin = 7\nquiet = true\n");
    let coarse = "name = \"coarse\"\ndescription = \"\"\n[area]\nvalue = \"9x9in\"\nsource = \"-\"\n\
                  [defaults]\ndpi = 40\nthickness = \"4mm\"\nmargin = 3\n";
    let folder = scratch.path(OWN_SETTINGS).join("lamp/machines");
    fs::write(folder.join("coarse.toml"), coarse).unwrap();
    fs::write(scratch.path("fine.toml"), coarse.replace("40", "80").replace("coarse", "fine"))
        .unwrap();
    let listed = String::from_utf8(scratch.run("lamp config slice").succeeds().stdout).unwrap();
    // The file that names the machine states another margin.
    assert!(listed.contains("--dpi=40") && listed.contains("--margin=7"), "{listed}");
    assert!(!listed.contains("--margin=3"), "{listed}");
    scratch.run("slice tower.stl -o a.tif").succeeds_quietly();
    assert_eq!(dpi(&scratch, "a.tif"), 40.0);
    // All that the machine of the command line says comes before the file.
    scratch.run("slice tower.stl --machine fine.toml -o b.tif").succeeds_quietly();
    assert_eq!(dpi(&scratch, "b.tif"), 80.0);
    let commands = scratch.layers("b.tif")[0].info.stack.clone().unwrap().commands;
    assert!(commands[0].contains("--margin 3"), "{commands:?}");
}

#[test]
fn documents_of_ones_own_have_names() {
    let scratch = with_settings("");
    let line = "slice tower.stl --dpi 100 --thickness 2mm --gray --material my-resin -q -o a.tif";
    scratch.run(line).succeeds_quietly();
    let commands = scratch.layers("a.tif")[0].info.stack.clone().unwrap().commands;
    assert!(commands[0].contains("--material my-resin@blake3:"), "{commands:?}");
    for command in ["machine list", "config"] {
        let listed = scratch.run(&format!("lamp {command}")).succeeds().stdout;
        assert!(String::from_utf8(listed).unwrap().contains("mine"), "{command}");
    }
    let listed = scratch.run("lamp material list --json").succeeds().stdout;
    assert!(String::from_utf8(listed).unwrap().contains("\"my-resin\""));
    scratch
        .run("lamp machine show nobody")
        .is_refused_with(&["alpha, beta, athena8k", "sonicmega8k, mine"]);
    // A night finds them, too, with their content in the key.
    scratch.write(
        "night.toml",
        b"[defaults]\nstages = [\"slice --dpi 50 --thickness 4mm --gray --material my-resin\"]\n\
          [[part]]\nfile = \"tower.stl\"\n",
    );
    scratch.run("lamp batch night.toml -q").succeeds();
    // Its tasks read no file of options, also while somebody edits one.
    scratch.write("lamp.toml", b"dpj = 600\n");
    let again = String::from_utf8(scratch.bytes("night.toml")).unwrap().replace("4mm", "3mm");
    scratch.write("again.toml", again.as_bytes());
    scratch.run("lamp batch again.toml -q --no-config").succeeds();
    fs::remove_file(scratch.path("lamp.toml")).unwrap();
    // A file whose name within is another one would be listed under that.
    let own = scratch.path(OWN_SETTINGS).join("lamp/machines");
    fs::rename(own.join("mine.toml"), own.join("other.toml")).unwrap();
    scratch.run("lamp machine show other").is_refused_with(&["called mine inside"]);
}

#[test]
fn faults_of_settings_are_named_and_reported() {
    let scratch = with_settings("[slice]\nmargin = \"1mm\"\n");
    scratch.run("lamp info nothing.tif").is_wrong_usage(&["config.toml: line 2: margin"]);
    let ran = scratch.run("lamp config");
    assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
    assert!(String::from_utf8(ran.stdout).unwrap().contains("line 2: margin"));
    let before = scratch.names();
    let ran = scratch.run("lamp doctor");
    assert_eq!((ran.statuses[0], scratch.names()), (Some(1), before));
    let text = String::from_utf8(ran.stdout).unwrap();
    for word in ["target: ", "memory: ", "STEP kernels: lamp", "locks work", "line 2: margin"] {
        assert!(text.contains(word), "no {word} in {text}");
    }
    let found = answer(&scratch, "lamp doctor --json");
    for folder in found["folders"].as_array().unwrap() {
        let (path, disk) = (folder["path"].as_str().unwrap(), &folder["disk"]);
        assert!(text.contains(path) && disk["free_bytes"].as_u64() > Some(0), "{folder}");
        assert_eq!((&disk["locks_work"], &folder["fault"]), (&Value::Bool(true), &Value::Null));
    }
    let config = &found["config"];
    for file in config["files"].as_array().unwrap() {
        let is_own = file["from"] == "your settings folder";
        assert_eq!((&file["is_there"], file["fault"].is_string()), (&is_own.into(), is_own));
    }
    assert_eq!(config["materials"]["names"], serde_json::json!(["my-resin"]));
    // What may stand in a command's table is no fault; a file that breaks every pipe is.
    let fine = scratch.path(OWN_SETTINGS).join("lamp/config.toml");
    fs::write(&fine, "[slice]\nthreads = 1\nquiet = true\n").unwrap();
    scratch.run("lamp config").succeeds_quietly();
    let found = answer(&scratch, "lamp config --json");
    let options: Vec<_> =
        found["files"].as_array().unwrap().iter().map(|it| &it["options"]).collect();
    let option = |key, value| serde_json::json!({"command": "slice", "key": key, "value": value});
    let own = serde_json::json!([option("quiet", "true"), option("threads", "1")]);
    assert!(options.contains(&&own), "{options:?}");
    fs::write(&fine, "output = \"o.tif\"\n").unwrap();
    scratch.run("slice tower.stl --dpi 50").is_wrong_usage(&["config.toml: output: it is only"]);
    scratch.run("lamp completions bash").succeeds_quietly();
    scratch.run("lamp config nonsense").is_wrong_usage(&["no command nonsense"]);
}
