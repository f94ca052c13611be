//! `lamp batch`: nights that go on, do nothing twice, and say what needs a person.

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use lamp_fixtures::{Defect, Sample, inject};
use lamp_tests::{Ran, Scratch, tilted_ball};
use serde_json::Value;

const STAGES: &str = "slice --dpi 60 --thickness 2mm";
const TILE: &str = "--area 400x400mm --mesh none";

/// Runs a night with what a test wants to see.
fn night(scratch: &Scratch) -> Ran {
    scratch.run("lamp batch night.toml --jobs 2 --verbose")
}

/// The tasks that a run has done, as it lists them.
fn done(ran: &Ran) -> Vec<&str> {
    ran.stderr
        .lines()
        .filter_map(|line| line.strip_prefix("batch: ")?.strip_suffix(" is done"))
        .collect()
}

/// The files of a store with an end, of the tasks of one night.
fn stored(scratch: &Scratch, end: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for shard in fs::read_dir(scratch.path("lamp-store/tasks")).unwrap() {
        for entry in fs::read_dir(shard.unwrap().path()).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|have| have == end) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

fn write_over(path: &Path, bytes: &[u8]) {
    let mut permissions = fs::metadata(path).unwrap().permissions();
    #[expect(clippy::permissions_set_readonly_false, reason = "the folder is this test's")]
    permissions.set_readonly(false);
    fs::set_permissions(path, permissions).unwrap();
    fs::write(path, bytes).unwrap();
}

/// The first lines of a report, as text.
fn first_of_report(scratch: &Scratch, folder: &str) -> String {
    let html = String::from_utf8(scratch.bytes(&format!("{folder}/report.html"))).unwrap();
    let start = html.find("Look at this first").expect("it tells what to look at");
    html[start..].split("</section>").next().unwrap().to_owned()
}

/// Two cubes in three ranges, and a build of them.
fn two_cubes() -> Scratch {
    let scratch = Scratch::new();
    scratch.part("a.stl", Sample::Cube, 64);
    scratch.part("b.stl", Sample::Cube, 100);
    let night = "\
        [defaults]\nstages = [\"slice --dpi 100 --thickness 100um\", \"fix\"]\nranges = 3\n\
        [[part]]\nfile = \"*.stl\"\n\
        [[build]]\nname = \"both\"\nparts = [\"a:2\", \"b\"]\ntile = \"--mesh none\"\n";
    scratch.write("night.toml", night.as_bytes());
    scratch
}

#[test]
fn a_night_of_twenty_parts_names_the_bad_ones_first() {
    let scratch = Scratch::new();
    let mut parts = Vec::new();
    for k in 0..17 {
        let name = format!("blade-{k:02}");
        scratch.part(&format!("{name}.stl"), Sample::Blade, 24_000 + 400 * k);
        parts.push(name);
    }
    scratch.part("solid.stl", Sample::Cube, 64);
    scratch.run("lamp convert solid.stl solid.step -q").succeeds();
    fs::remove_file(scratch.path("solid.stl")).unwrap();
    let whole = scratch.bytes("blade-03.stl");
    scratch.write("broken.stl", &whole[..whole.len() / 2]);
    let night_file = format!(
        "[defaults]\nstages = [\"{STAGES}\", \"fix\"]\n\
         [[part]]\nfile = [\"*.stl\", \"solid.step\", \"missing.stl\"]\n\
         [[build]]\nname = \"one\"\nparts = [\"blade-00:2\", \"solid\"]\ntile = \"{TILE}\"\n\
         [[build]]\nname = \"two\"\nparts = [\"blade-01\", \"blade-02\"]\ntile = \"{TILE}\"\n\
         [[build]]\nname = \"three\"\nparts = [\"blade-05\", \"broken\"]\ntile = \"{TILE}\"\n\
         [output]\nfolder = \"out\"\nformat = \"tif\"\n"
    );
    scratch.write("night.toml", night_file.as_bytes());
    let ran = night(&scratch);
    assert_eq!(ran.statuses, [Some(1)], "{ran:?}");
    let first = first_of_report(&scratch, "out");
    let names: Vec<&str> =
        first.split("<li><b>").skip(1).map(|item| item.split('<').next().unwrap()).collect();
    assert_eq!(names[..3], ["broken", "missing", "three"], "{first}");
    // All others are there, with the bytes of the commands by hand.
    for name in &parts {
        scratch.run(&format!("lamp verify out/parts/{name}.tif -q")).succeeds();
    }
    for by_hand in [
        format!("{STAGES} blade-00.stl -q | fix -q > blade-00.tif"),
        format!("{STAGES} solid.step -q | fix -q > solid.tif"),
        format!("tile blade-00.tif:2 solid.tif {TILE} -q > one.tif"),
    ] {
        scratch.run(&by_hand).succeeds();
    }
    for (by_hand, of_night) in
        [("blade-00", "parts/blade-00"), ("solid", "parts/solid"), ("one", "builds/one")]
    {
        assert!(
            scratch.bytes(&format!("{by_hand}.tif"))
                == scratch.bytes(&format!("out/{of_night}.tif")),
            "{of_night} has other bytes than by hand"
        );
    }
    assert!(!scratch.path("out/builds/three.tif").exists());
    // Finished tasks are not done again.
    let again = night(&scratch);
    assert_eq!((again.statuses.clone(), done(&again)), (vec![Some(1)], vec![]), "{again:?}");
    // With a stray band that is left instead of the bad ones, all is done and a person is needed.
    let mut ball = tilted_ball();
    inject(&mut ball, Defect::Drop, 5, 1);
    scratch.mesh("broken.stl", &ball);
    scratch.write("missing.stl", &whole);
    let of_ball = "[[part]]\nfile = \"broken.stl\"\nslice = \"--dpi 300 --thickness 200um\"\n\
                   fix = \"--max-width 4\"\n[[build]]";
    let mended = night_file.replace(", \"broken\"]", "]").replacen("[[build]]", of_ball, 1);
    scratch.write("night.toml", mended.as_bytes());
    let ran = night(&scratch);
    assert_eq!(ran.statuses, [Some(3)], "{ran:?}");
    assert!(done(&ran).iter().all(|task| !task.starts_with("blade")), "{ran:?}");
    let first = first_of_report(&scratch, "out");
    assert!(first.contains("<li><b>broken</b> needs a person: "), "{first}");
    assert!(!first.contains("missing") && scratch.path("out/builds/three.tif").exists(), "{first}");
}

#[test]
fn stray_bands_that_are_left_need_a_person() {
    let scratch = Scratch::new();
    let mut ball = tilted_ball();
    inject(&mut ball, Defect::Drop, 5, 1);
    scratch.mesh("ball.stl", &ball);
    scratch.part("cube.stl", Sample::Cube, 64);
    let text = "[defaults]\nstages = [\"slice --dpi 300 --thickness 200um\", \"fix --max-width 4\"]\n\
                [[part]]\nfile = \"*.stl\"\n";
    scratch.write("night.toml", text.as_bytes());
    let ran = scratch.run("lamp batch night.toml --notify cat");
    assert_eq!(ran.statuses, [Some(3)], "{ran:?}");
    assert!(
        ran.stderr.contains("1 needs a person: ball: ") && ran.stderr.contains("stray band"),
        "{ran:?}"
    );
    let told = String::from_utf8(ran.stdout).unwrap();
    assert!(told.contains("\"status\":3") && told.contains("\"state\":\"needs-person\""), "{told}");
    assert!(first_of_report(&scratch, "night").contains("ball"));
    assert_eq!(night(&scratch).statuses, [Some(3)]);
}

#[test]
fn only_what_depends_on_a_change_is_done_again() {
    let scratch = two_cubes();
    let first = night(&scratch);
    assert_eq!(first.statuses, [Some(0)], "{first:?}");
    assert_eq!(done(&first).len(), 2 * (3 + 1 + 1) + 1, "{first:?}");
    let build = scratch.bytes("night/builds/both.lamp");
    // A touched file, and a renamed one that keeps its part's name.
    fs::write(scratch.path("a.stl"), scratch.bytes("a.stl")).unwrap();
    fs::rename(scratch.path("b.stl"), scratch.path("c.stl")).unwrap();
    let text = String::from_utf8(scratch.bytes("night.toml")).unwrap();
    let named = text.replace("[[build]]", "[[part]]\nfile = \"c.stl\"\nname = \"b\"\n[[build]]");
    scratch.write("night.toml", named.as_bytes());
    let touched = night(&scratch);
    assert_eq!((touched.statuses.clone(), done(&touched)), (vec![Some(0)], vec![]), "{touched:?}");
    // Other options of one part concern that part and the build; another form of the same, nothing.
    let same = named.replace("100um", "0.1mm");
    scratch.write("night.toml", same.as_bytes());
    assert_eq!(done(&night(&scratch)), [""; 0]);
    let edited = same.replace("name = \"b\"", "name = \"b\"\nfix = \"--max-width 9\"");
    scratch.write("night.toml", edited.as_bytes());
    let ran = night(&scratch);
    assert!(ran.statuses == [Some(0)] && !done(&ran).is_empty(), "{ran:?}");
    assert!(done(&ran).iter().all(|task| !task.starts_with("a ")), "{ran:?}");
    // Back again: everything is still there, and the build has the same bytes except the file's new
    // name.
    scratch.write("night.toml", named.as_bytes());
    assert_eq!(done(&night(&scratch)), [""; 0]);
    fs::rename(scratch.path("c.stl"), scratch.path("b.stl")).unwrap();
    scratch.write("night.toml", text.as_bytes());
    assert_eq!(done(&night(&scratch)), [""; 0]);
    assert!(scratch.bytes("night/builds/both.lamp") == build);
}

#[test]
fn damaged_results_are_found_and_made_again() {
    let scratch = two_cubes();
    assert_eq!(night(&scratch).statuses, [Some(0)]);
    let build = scratch.bytes("night/builds/both.lamp");
    scratch.run("lamp batch verify night.toml").succeeds_quietly();
    // Half a manifest does not count.
    let manifests = stored(&scratch, "json");
    for manifest in &manifests {
        let text = fs::read(manifest).unwrap();
        write_over(manifest, &text[..text.len() / 2]);
    }
    let ran = night(&scratch);
    assert_eq!(
        (ran.statuses.clone(), done(&ran).len()),
        (vec![Some(0)], manifests.len()),
        "{ran:?}"
    );
    // A flipped bit in each result.
    let results = stored(&scratch, "result");
    for result in &results {
        let mut bytes = fs::read(result).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 16;
        write_over(result, &bytes);
    }
    let verified = scratch.run("lamp batch verify night.toml");
    assert_eq!(verified.statuses, [Some(1)], "{verified:?}");
    let told = format!("{0} of {0} results were damaged", results.len());
    assert!(verified.stderr.contains(&told), "{verified:?}");
    let answer = |scratch: &Scratch| -> Value {
        let ran = scratch.run("lamp batch verify night.toml --json");
        serde_json::from_slice(&ran.stdout).unwrap()
    };
    // Damaged results are removed, and counted no more.
    let counts = |answer: &Value| {
        let damaged = answer["damaged"].as_array().unwrap().len();
        (answer["whole_results"].as_u64().unwrap() as usize, damaged, answer["whole"] == true)
    };
    assert_eq!(counts(&answer(&scratch)), (0, 0, true));
    assert_eq!(done(&night(&scratch)).len(), results.len());
    assert_eq!(counts(&answer(&scratch)), (results.len(), 0, true));
    let file = stored(&scratch, "result").remove(0);
    write_over(&file, b"other");
    let found = answer(&scratch);
    assert_eq!(counts(&found), (results.len() - 1, 1, false), "{found}");
    assert_eq!(found["damaged"][0]["removed"], true, "{found}");
    assert_eq!(night(&scratch).statuses, [Some(0)]);
    // Without verify, a task finds out when it uses one.
    let text = String::from_utf8(scratch.bytes("night.toml")).unwrap();
    let stacks: Vec<_> = stored(&scratch, "result");
    for stack in &stacks {
        let mut bytes = fs::read(stack).unwrap();
        bytes[0] ^= 1;
        write_over(stack, &bytes);
    }
    let edited = text.replace("--mesh none", "--mesh none --gap 3mm");
    scratch.write("night.toml", edited.as_bytes());
    let ran = night(&scratch);
    assert!(ran.statuses == [Some(0)] && ran.stderr.contains("is made again"), "{ran:?}");
    scratch.write("night.toml", text.as_bytes());
    scratch.run("lamp batch verify night.toml");
    assert_eq!(night(&scratch).statuses, [Some(0)]);
    assert!(scratch.bytes("night/builds/both.lamp") == build);
    let temporary = |path: &PathBuf| path.file_name().unwrap().to_string_lossy().starts_with('.');
    assert!(!stored(&scratch, "part").iter().any(temporary));
}

#[test]
fn what_is_wrong_with_a_night_is_told_before_anything_runs() {
    let scratch = two_cubes();
    let text = String::from_utf8(scratch.bytes("night.toml")).unwrap();
    for (from, to, words) in [
        ("\"fix\"]", "\"fix --widht 3\"]", ["night.toml: line 2, column 48: fix: ", "--widht"]),
        (
            "\"fix\"]",
            "\"fix\"]\ncheck = \"--machine gone.toml\"",
            ["night.toml: line 3, column 9: check: ", "gone.toml"],
        ),
        ("--dpi 100", "--dpi none", ["night.toml: line 2, column 11: slice: ", "none"]),
        (
            "--mesh none",
            "--mesh none --cell 3mm",
            ["night.toml: line 9, column 8: tile: ", "--cell"],
        ),
        ("[[build]]", "[[biuld]]", ["night.toml: line 6, column 3: ", "did you mean build?"]),
        ("\"b\"]", "\"bb\"]", ["night.toml: line 8, column 17: ", "there is no part bb"]),
    ] {
        scratch.write("night.toml", text.replace(from, to).as_bytes());
        for command in ["lamp batch night.toml", "lamp batch plan night.toml"] {
            let ran = scratch.run(command).is_wrong_usage(&words);
            assert_eq!(ran.stderr.lines().count(), 1, "{ran:?}");
        }
    }
    assert!(!scratch.path("night").exists());
    scratch.run("lamp batch").is_wrong_usage(&["name a night file"]);
    scratch.run("lamp batch gone.toml").is_wrong_usage(&["gone.toml", "there is no such file"]);
    scratch.write("night.toml", text.as_bytes());
    let plan = scratch.run("lamp batch plan night.toml").succeeds_quietly();
    let plan = String::from_utf8(plan.stdout).unwrap();
    assert!(
        plan.contains("range  6 of 6 tasks to do") && plan.contains("all    11 of 11"),
        "{plan}"
    );
    assert_eq!(night(&scratch).statuses, [Some(0)]);
    let removed = scratch.run("lamp batch gc night.toml").succeeds_quietly();
    assert!(String::from_utf8(removed.stdout).unwrap().starts_with("6 results removed"));
    let status = scratch.run("lamp batch status night.toml").succeeds_quietly();
    let status = String::from_utf8(status.stdout).unwrap();
    assert_eq!(status, "3 of 3 are done (2 parts and 1 build), 0 tasks are to do\n");
}

/// A folder becomes a night file that runs as it stands, and what is no part is named.
#[test]
fn a_night_file_is_made_from_a_folder() {
    let scratch = Scratch::new();
    fs::create_dir_all(scratch.path("in/more")).unwrap();
    scratch.part("in/ball.stl", Sample::Sphere, 600);
    scratch.part("in/cube.stl", Sample::Cube, 64);
    scratch.run("lamp convert in/cube.stl in/cube.step -q").succeeds();
    fs::rename(scratch.path("in/ball.stl"), scratch.path("in/a \"ball\".stl")).unwrap();
    let whole = scratch.bytes("in/cube.stl");
    scratch.write("in/cut.stl", &whole[..whole.len() / 2]);
    scratch.write("in/list.txt", b"cube, ball\n");
    scratch.write("in/x.ply", b"ply\nformat ascii 1.0\n");
    let init = "lamp batch init in --slice=--dpi=60";
    let ran = scratch.run(init).succeeds();
    for line in [
        "batch init: more: left out, a folder in the folder",
        "batch init: list.txt: left out, a text file",
        "batch init: x.ply: left out, a PLY file",
        "batch init: cut.stl: left out, ",
        "night.toml: 3 parts, ",
    ] {
        let mut lines = ran.stderr.lines().chain(ran.written.iter().map(String::as_str));
        assert!(lines.any(|found| found.starts_with(line)), "{line}: {ran:?}");
    }
    let plan = scratch.run("lamp batch plan night.toml").succeeds_quietly();
    assert!(String::from_utf8(plan.stdout).unwrap().contains("check  3 of 3 tasks to do"));
    assert_eq!(night(&scratch).statuses, [Some(0)]);
    for part in ["a \"ball\"", "cube-stl", "cube-step"] {
        assert!(scratch.path(&format!("night/parts/{part}.lamp")).exists(), "{part}");
    }
    // Each line of its examples may become one of the file.
    let text = String::from_utf8(scratch.bytes("night.toml")).unwrap();
    let (start, examples) = text.split_once("# A later entry").unwrap();
    let examples = examples.replace("\n# ", "\n").replace("A build has", "# A build has");
    let all = format!("{start}# A later entry{examples}");
    scratch.write("all.toml", all.as_bytes());
    scratch.run("lamp batch plan all.toml").succeeds_quietly();
    // An existing file stays, and wrong options leave none.
    scratch.run(init).is_wrong_usage(&["night.toml exists", "--force"]);
    assert_eq!(scratch.bytes("night.toml"), text.as_bytes());
    let open = "lamp batch init in --slice=--dpi\"60 -o other.toml";
    scratch.run(open).is_wrong_usage(&["--slice: the quote \" is not closed"]);
    let wrong = "lamp batch init in --slice=--dpp=3 -o other.toml";
    scratch.run(wrong).is_wrong_usage(&["slice: ", "--dpp"]);
    scratch.run("lamp batch init gone").is_wrong_usage(&["gone: there is no such folder"]);
    let none = scratch.run("lamp batch init in/more -o other.toml");
    assert!(none.statuses == [Some(1)] && none.stderr.contains("no part"), "{none:?}");
    assert!(!scratch.path("other.toml").exists());
    // From another folder, and with a machine of one's own.
    fs::create_dir(scratch.path("nights")).unwrap();
    scratch.run("lamp machine new mine --area 90x90mm --recoat 9s -o mine.toml").succeeds();
    scratch.run(&format!("{init} --machine mine.toml -o nights/n.toml")).succeeds();
    scratch.run("lamp batch plan nights/n.toml").succeeds_quietly();
}

/// The times of a plan are those that tasks took, and that the machine states.
#[test]
fn a_plan_has_the_times_that_are_known() {
    let scratch = two_cubes();
    let plan = |options: &str| {
        let ran = scratch.run(&format!("lamp batch plan night.toml --jobs 2 {options}"));
        String::from_utf8(ran.succeeds_quietly().stdout).unwrap()
    };
    let json = |options: &str| -> serde_json::Value {
        serde_json::from_str(&plan(&format!("--json {options}"))).unwrap()
    };
    assert!(plan("").contains(
        "expected: not known\nno time is known of tasks of the kind range, join, check, tile"
    ));
    assert!(plan("").contains("time on the machine: not known\n"));
    let before = json("");
    assert_eq!((&before["earlier_tasks"], before["most_s"].is_null()), (&0.into(), true));
    assert_eq!(night(&scratch).statuses, [Some(0)]);
    assert!(!plan("").contains("expected"), "there is nothing to do");
    // A removed result takes what it took, by the journal.
    let journal = fs::read_dir(scratch.path("lamp-store/journal")).unwrap().next().unwrap();
    let journal = fs::read_to_string(journal.unwrap().path()).unwrap();
    let events: Vec<serde_json::Value> =
        journal.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let tile = events.iter().find(|event| event["kind"] == "tile").unwrap();
    let key = tile["key"].as_str().unwrap();
    fs::remove_file(scratch.path(&format!("lamp-store/tasks/{}/{key}.json", &key[..2]))).unwrap();
    let again = json("");
    let seconds = |value: &serde_json::Value| value.as_f64().unwrap();
    assert_eq!(again["to_do"], 1);
    assert!((seconds(&again["least_s"]) - seconds(&tile["cpu_s"]) / 2.0).abs() < 1e-9, "{again}");
    let longest = seconds(&tile["cpu_s"]).max(seconds(&tile["seconds"]));
    assert!((seconds(&again["most_s"]) - longest).abs() < 1e-9, "{again}");
    assert!(plan("").contains("; started now, it ends "));
    // Before it is made, the build may have more layers than its parts; then each takes 9 s and 1.5 s.
    let build = || json("--recoat 9s --expose 1.5s")["machine_times"][0].clone();
    let open = build();
    assert!(open["build_s"].is_null() && open["missing"][0].as_str().unwrap().contains("is made"));
    assert_eq!(night(&scratch).statuses, [Some(0)]);
    let made = build();
    let layers = scratch.layers("night/builds/both.lamp").len();
    assert_eq!(made["layers"], layers);
    assert!((seconds(&made["build_s"]) - 10.5 * layers as f64).abs() < 1e-6, "{made}");
    let text = plan("--recoat 9s");
    assert!(text.contains("  both: at least ") && text.contains("give --expose"), "{text}");
}

/// A night file for a watched folder has no parts to look at, which is no mistake.
#[test]
fn a_night_without_parts_is_looked_at() {
    let scratch = Scratch::new();
    scratch.write("night.toml", format!("defaults.stages = [\"{STAGES}\"]\n").as_bytes());
    let none = "night.toml: no [[part]] in it: --watch FOLDER makes the parts of a folder, which \
                are not looked at here\n";
    for (command, said) in [
        ("plan", none.to_owned()),
        ("status", none.to_owned()),
        ("verify", format!("0 results are whole\n{none}")),
        ("gc", "0 results removed, 0 kB; 0 stay\n".to_owned()),
    ] {
        let ran = scratch.run(&format!("lamp batch {command} night.toml")).succeeds_quietly();
        assert_eq!(String::from_utf8(ran.stdout).unwrap(), said, "{command}");
    }
    for command in ["plan", "status"] {
        let ran =
            scratch.run(&format!("lamp batch {command} night.toml --json")).succeeds_quietly();
        let answer: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
        assert!(answer["schema"].as_str().unwrap().starts_with("lamp-batch-"), "{answer}");
    }
    scratch.run("lamp batch night.toml").is_wrong_usage(&["there is no part: add [[part]]"]);
}

/// A build whose machine refuses its parts has a reason, and no time.
#[test]
fn a_plan_promises_no_build_that_the_machine_refuses() {
    let scratch = two_cubes();
    let text = String::from_utf8(scratch.bytes("night.toml")).unwrap();
    scratch.run("lamp machine new mine --area 90x90mm --recoat 9s -o mine.toml").succeeds();
    let machine = String::from_utf8(scratch.bytes("mine.toml")).unwrap();
    scratch.write(
        "mine.toml",
        format!("{machine}\n[dpi]\nleast = 600\nmost = 1200\nsource = \"-\"\n").as_bytes(),
    );
    let refused = text.replace("tile = ", "machine = \"mine.toml\"\ntile = ");
    scratch.write("night.toml", refused.as_bytes());
    let plan = |options: &str| {
        let ran =
            scratch.run(&format!("lamp batch plan night.toml --recoat 9s --expose 1s {options}"));
        String::from_utf8(ran.succeeds_quietly().stdout).unwrap()
    };
    let why = "both: cannot be made: its part a: the stack has 100 dpi, and the machine mine builds in \
               600 to 1200 dpi\n";
    assert!(plan("").starts_with(why) && !plan("").contains("  both: "), "{}", plan(""));
    let answer: serde_json::Value = serde_json::from_str(&plan("--json")).unwrap();
    assert_eq!(answer["cannot_be_made"][0]["name"], "both");
    assert_eq!(answer["machine_times"], serde_json::json!([]));
    // As tile says once the parts are there.
    let ran = night(&scratch);
    assert!(
        ran.statuses == [Some(1)] && ran.stderr.contains("builds in 600 to 1200 dpi"),
        "{ran:?}"
    );
    // Without the build, the sum of both parts: 20 s for each layer of theirs.
    let parts = text.split("[[build]]").next().unwrap();
    scratch.write("night.toml", parts.as_bytes());
    let answer: serde_json::Value = serde_json::from_str(&plan("--json")).unwrap();
    let layers = |name: &str| scratch.layers(&format!("night/parts/{name}.lamp")).len() as f64;
    let wanted = 10.0 * (layers("a") + layers("b"));
    assert_eq!(answer["machine_s"].as_f64(), Some(wanted));
    assert_eq!(answer["machine_least_s"].as_f64(), Some(wanted));
    let text = plan("");
    let last = text.lines().last().unwrap();
    let machine = format!("{:.1}min on the machine", wanted / 60.0);
    assert_eq!(last, format!("in all: no task is to do; {machine}"));
}

/// Parts of a watched folder are made as they come, whole, and a signal ends it.
#[test]
#[cfg(unix)]
fn parts_of_a_watched_folder_are_made_as_they_come() {
    let scratch = Scratch::new();
    fs::create_dir(scratch.path("in")).unwrap();
    scratch.part("first.stl", Sample::Cube, 64);
    scratch.part("second.stl", Sample::Sphere, 600);
    scratch.write("night.toml", format!("defaults.stages = [\"{STAGES}\"]\n").as_bytes());
    let mut watching = Command::new(lamp_tests::bin("lamp"));
    watching.args(["batch", "night.toml", "--watch", "in"]).current_dir(scratch.path("."));
    let mut watching = watching.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let made = |name: &str| scratch.path(&format!("night/parts/{name}.lamp"));
    let wait = |is_there: &dyn Fn() -> bool| {
        let start = Instant::now();
        while !is_there() {
            assert!(start.elapsed() < Duration::from_secs(120), "it waits in vain");
            thread::sleep(Duration::from_millis(50));
        }
    };
    fs::copy(scratch.path("first.stl"), scratch.path("in/a.stl")).unwrap();
    // A file that grows at each look is not begun.
    let bytes = scratch.bytes("second.stl");
    let mut growing = fs::File::create(scratch.path("in/b.stl")).unwrap();
    for piece in bytes.chunks(bytes.len() / 40 + 1) {
        growing.write_all(piece).unwrap();
        thread::sleep(Duration::from_millis(150));
        assert!(!made("b").exists());
    }
    drop(growing);
    wait(&|| made("a").exists() && made("b").exists());
    let first = scratch.bytes("night/parts/a.lamp");
    fs::copy(scratch.path("second.stl"), scratch.path("in/a.stl")).unwrap();
    wait(&|| scratch.bytes("night/parts/a.lamp") != first);
    scratch.write("in/c.txt", b"no part\n");
    // Another file of the same stem changes no name.
    scratch.run("lamp convert first.stl in/.a.step -q").succeeds();
    fs::rename(scratch.path("in/.a.step"), scratch.path("in/a.step")).unwrap();
    wait(&|| made("a-step").exists());
    assert!(!made("a-stl").exists());
    wait(&|| scratch.path("night/report.html").exists());
    thread::sleep(Duration::from_secs(5));
    let pid = watching.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &pid]).status().unwrap().success());
    assert_eq!(watching.wait().unwrap().code(), Some(143));
    let mut said = String::new();
    watching.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    let lines = |start: &str| said.lines().filter(|line| line.starts_with(start)).count();
    assert_eq!((lines("batch: a: done, "), lines("batch: b: done, ")), (2, 1), "{said}");
    assert_eq!(lines("batch: c.txt: left out, a text file"), 1, "{said}");
    assert_eq!(lines("batch: a-step: done, "), 1, "{said}");
    for (name, part) in [("a", "second"), ("b", "second")] {
        scratch.run(&format!("{STAGES} {part}.stl -q > {name}.tif")).succeeds();
        let by_watch = scratch.layers(&format!("night/parts/{name}.lamp"));
        let by_hand = scratch.layers(&format!("{name}.tif"));
        assert!(
            by_watch.iter().map(|layer| &layer.image).eq(by_hand.iter().map(|layer| &layer.image))
        );
    }
    let watch = "lamp batch night.toml --watch gone";
    scratch.run(watch).is_wrong_usage(&["--watch gone: there is no such folder"]);
}

/// Names are bytes, and no link and no file is passed over.
#[test]
#[cfg(target_os = "linux")]
fn no_part_of_a_night_is_passed_over() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let scratch = Scratch::new();
    let folder = scratch.path("x").with_file_name(OsStr::from_bytes(b"n\xe9e"));
    fs::create_dir_all(folder.join("parts")).unwrap();
    scratch.part("good.stl", Sample::Cube, 64);
    for name in [&b"good.stl"[..], b"caf\xe9.stl"] {
        let file = folder.join("parts").join(OsStr::from_bytes(name));
        fs::copy(scratch.path("good.stl"), file).unwrap();
    }
    std::os::unix::fs::symlink("nothing", folder.join("parts/link.stl")).unwrap();
    let night = format!("[defaults]\nstages = [\"{STAGES}\"]\n[[part]]\nfile = \"parts/*.stl\"\n");
    fs::write(folder.join("night.toml"), night).unwrap();
    let batch = || {
        let mut batch = std::process::Command::new(lamp_tests::bin("lamp"));
        batch.args(["batch", "night.toml"]).current_dir(&folder).output().unwrap()
    };
    for _ in 0..2 {
        let ran = batch();
        let said = String::from_utf8_lossy(&ran.stderr);
        assert_eq!(ran.status.code(), Some(1), "{said}");
        // As the night file names it.
        assert!(said.contains("link: failed: parts/link.stl: No such file"), "{said}");
        assert!(said.contains("1 of 3 parts failed (link)"), "{said}");
    }
    let made = fs::read_dir(folder.join("night/parts")).unwrap().count();
    assert_eq!(made, 2);
    fs::remove_file(folder.join("parts/link.stl")).unwrap();
    assert!(batch().status.success());
}

/// A night of plans of exposures: gray levels for a part and a build of it, times for another part.
#[cfg(unix)]
const PLANS: &str = "\
    [defaults]\n\
    stages = [\"slice --dpi 100 --thickness 200um\", \"fix\"]\n\
    [[part]]\n\
    file = \"a.stl\"\n\
    stages = [\"slice --dpi 100 --thickness 200um\", \"fix\", \"plan voxels --material resin.toml --expose 2s\"]\n\
    [[part]]\n\
    file = \"b.stl\"\n\
    stages = [\"slice --dpi 100 --thickness 200um\", \"plan speed --material resin.toml\", \"fix\"]\n\
    [[build]]\n\
    name = \"two\"\n\
    parts = [\"a:2\"]\n\
    tile = \"--mesh none\"\n\
    [output]\n\
    format = \"tif\"\n";

/// Plans have the bytes of their commands, also after a kill, and follow their material.
#[test]
#[cfg(unix)]
fn plans_of_exposures_are_stages_of_nights() {
    let scratch = Scratch::new();
    scratch.part("a.stl", Sample::Cube, 64);
    scratch.part("b.stl", Sample::Sphere, 600);
    scratch.run("lamp material show pegda-sudan > resin.toml").succeeds();
    scratch.write("night.toml", PLANS.as_bytes());
    let plan = scratch.run("lamp batch plan night.toml").succeeds_quietly();
    assert!(String::from_utf8(plan.stdout).unwrap().contains("plan   2 of 2 tasks to do, about "));
    // Killed at work, it goes on.
    let mut first = scratch.command("lamp batch night.toml --jobs 1 -q").spawn().unwrap();
    let start = Instant::now();
    let has_begun =
        || scratch.path("lamp-store/tasks").exists() && !stored(&scratch, "json").is_empty();
    while !has_begun() {
        assert!(start.elapsed() < Duration::from_secs(120), "no task is done");
        thread::sleep(Duration::from_millis(2));
    }
    first.kill().unwrap();
    first.wait().unwrap();
    let ran = night(&scratch);
    assert_eq!(ran.statuses, [Some(0)], "{ran:?}");
    let slice = "slice --dpi 100 --thickness 200um";
    for (by_hand, of_night) in [
        (
            format!(
                "{slice} a.stl -q | fix -q | lamp plan voxels --material resin.toml --expose 2s -q > a.tif"
            ),
            "parts/a",
        ),
        (
            format!("{slice} b.stl -q | lamp plan speed --material resin.toml -q | fix -q > b.tif"),
            "parts/b",
        ),
        ("tile a.tif:2 --mesh none -q > two.tif".to_owned(), "builds/two"),
    ] {
        scratch.run(&by_hand).succeeds();
        let name = Path::new(of_night).file_name().unwrap().to_str().unwrap();
        let by_hand = scratch.bytes(&format!("{name}.tif"));
        assert!(by_hand == scratch.bytes(&format!("night/{of_night}.tif")), "{of_night}");
    }
    let report = String::from_utf8(scratch.bytes("night/report.html")).unwrap();
    for line in ["plan: the best plan is at most ", "plan: the best time for all layers, "] {
        assert!(report.contains(line), "{line}");
    }
    // Another text of the material concerns the plans and what is behind them.
    let resin = scratch.bytes("resin.toml");
    scratch.write("resin.toml", &resin);
    assert_eq!(done(&night(&scratch)), [""; 0]);
    scratch.write("resin.toml", &[&resin[..], b"# measured again\n"].concat());
    let changed = night(&scratch);
    let mut again = done(&changed);
    again.sort_unstable();
    assert_eq!(
        again,
        [
            "a (check)",
            "a (plan voxels of the whole stack)",
            "b (check)",
            "b (fix of the whole stack)",
            "b (plan speed of the whole stack)",
            "two (build of 1 part)",
        ],
        "{changed:?}"
    );
    scratch.write("resin.toml", &resin);
    assert_eq!(done(&night(&scratch)), [""; 0]);
    scratch.run("lamp batch verify night.toml").succeeds_quietly();
    let status = scratch.run("lamp batch status night.toml").succeeds_quietly();
    assert!(String::from_utf8(status.stdout).unwrap().starts_with("3 of 3 are done"));
    // Options of the plan may stand in a part.
    let other = PLANS.replace("[[build]]", "[[part]]\nfile = \"a.stl\"\nplan = \"voxels --material resin.toml --expose 3s\"\n[[build]]");
    scratch.write("night.toml", other.as_bytes());
    let plan = scratch.run("lamp batch plan night.toml").succeeds_quietly();
    assert!(String::from_utf8(plan.stdout).unwrap().contains("plan   1 of 2 tasks to do"));
}
