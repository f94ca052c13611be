//! Checks that a new user's mistakes get the right hint, or none.

use lamp_fixtures::Sample;
use lamp_tests::Scratch;

/// What people type, and what the answer must say; nothing if no hint is right.
const MISTAKES: &[(&str, Option<&str>)] = &[
    // Options of other programs that mean something else, or nothing, here.
    ("slice part.stl --spacing 2mm", None),
    ("slice part.stl --infill 20", None),
    ("slice part.stl --quality high", None),
    ("slice part.stl --verbosity 2", None),
    ("slice part.stl --frobnicate", None),
    ("slice part.stl -x", None),
    ("slice part.stl -p 50um", None),
    ("lamp view part.tif --zoom 2", None),
    ("lamp check part.tif --colour", None),
    ("lamp show part.tif --png", None),
    // Slips of the hand.
    ("slice part.stl --thicknes 50um", Some("--thickness")),
    ("slice part.stl --thikness 50um", Some("--thickness")),
    ("slice part.stl --machne alpha", Some("--machine")),
    ("slice part.stl --antialiasing", Some("--antialias")),
    ("slice part.stl --ouput x.tif", Some("--output")),
    ("slice part.stl --dip 300", None),
    ("fix part.tif --metod spline", Some("--method")),
    ("tile part.tif --copie 3", Some("--copies")),
    ("lamp show part.tif --layr 3", Some("--layer")),
    ("lamp infos part.tif", Some("info")),
    ("lamp chek part.tif", Some("check")),
    ("lamp verfy part.tif", Some("verify")),
    ("lamp slize part.stl", Some("slice")),
    ("lamp print part.stl", Some("print-sim")),
    ("lamp render part.tif", None),
    ("lamp dcotor", Some("doctor")),
    // Values.
    ("slice part.stl --thickness 50", Some("add um")),
    ("slice part.stl --thickness 0.05", Some("um")),
    ("slice part.stl --dpi fine", Some("dpi")),
    ("slice part.stl --units inches", Some("inch")),
    ("slice part.stl --plane center", Some("middle")),
    ("slice part.stl --machine alhpa", Some("did you mean alpha?")),
    ("slice part.stl --machine mars", Some("did you mean mars3?")),
    ("slice part.stl --machine ender3", Some("alpha, beta")),
    ("lamp material show pegda", Some("pegda-mw700")),
    ("tile part.tif --copies 0", Some("at least 1")),
    ("tile part.tif --copies two", Some("whole number")),
    ("lamp info part.tif --layers 10:20", Some("A..B")),
    ("lamp info part.tif --layers 20..10", Some("the end must be above the start")),
    // Files.
    ("slice part.tif -o x.tif", Some("lamp info describes layers")),
    ("lamp info part.stl", Some("slice")),
    ("slice prt.stl", Some("No such file")),
    ("lamp report part.tif -o report.pdf", Some(".html")),
    ("slice part.stl -o part.png", Some("lamp convert")),
    ("slice part.stl -o part.gcode", Some(".tif")),
    ("lamp view", Some("no stack arrived")),
];

#[test]
fn mistakes_get_the_right_hint_or_none() {
    let scratch = Scratch::new();
    scratch.part("part.stl", Sample::Cube, 64);
    scratch.run("slice part.stl --dpi 100 --thickness 1mm -o part.tif").succeeds();
    for (line, hint) in MISTAKES {
        let ran = scratch.run(line);
        assert!(matches!(ran.statuses[..], [Some(1 | 2)]), "{ran:?}");
        match hint {
            Some(hint) => assert!(ran.stderr.contains(hint), "no `{hint}`: {ran:?}"),
            None => assert!(!ran.stderr.contains("tip:"), "a wrong tip: {ran:?}"),
        }
    }
    assert_eq!(scratch.names(), ["part.stl", "part.tif"]);
}

#[test]
fn names_that_people_know_from_elsewhere_are_understood() {
    let scratch = Scratch::new();
    scratch.part("part.stl", Sample::Cube, 64);
    scratch.run("slice part.stl --dpi 100 --thickness 1mm -o part.tif").succeeds();
    for line in [
        "slice part.stl --resolution 100 --layer-height 1mm -o same.tif",
        "slice part.stl --pitch 254um --thickness 1mm -j 2 -o same.tif",
        "lamp slice part.stl -j2 --dpi 100 --layer-height 1000um -o same.tif",
    ] {
        scratch.run(line).succeeds_quietly();
        assert!(scratch.bytes("same.tif") == scratch.bytes("part.tif"), "{line}");
    }
    scratch.run("lamp convert part.tif -o pages/").succeeds_quietly();
    scratch.run("lamp convert part.tif -o pages/ --overwrite").succeeds_quietly();
    let layers = |range: &str| {
        let ran = scratch.run(&format!("lamp info part.tif --layers {range} --json"));
        String::from_utf8(ran.succeeds_quietly().stdout).unwrap()
    };
    assert_eq!(layers("5-10"), layers("5..11"));
    // Each stack on its line.
    let both = scratch.run("lamp info part.tif same.tif --json").succeeds_quietly().stdout;
    let both = String::from_utf8(both).unwrap();
    assert_eq!(both, layers("..") + &layers("..").replace("part.tif", "same.tif"));
    // A page beside the stack.
    scratch.run("lamp report part.tif").succeeds_quietly();
    assert!(scratch.names().contains(&"part.html".to_owned()));
    // A machine's name in any case is recorded as its own.
    let commands = |name: &str| {
        let line = format!("slice part.stl --thickness 1mm --machine {name} -o panel.tif");
        scratch.run(&line).succeeds_quietly();
        scratch.layers("panel.tif")[0].info.stack.as_ref().unwrap().commands.clone()
    };
    assert_eq!(commands("Mars3"), commands("mars3"));
}
