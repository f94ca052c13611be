//! Checks that `lamp compose` makes the pages that `tile` writes, from a recipe instead of a build.

use std::fs;

use lamp_tests::{Scratch, write_gray_ramp};

/// Options of builds on which copies stand, lie and turn in all sorts of ways.
const BUILDS: [&str; 8] = [
    "tower.tif --area 120x110mm",
    "tower.tif --area 120x110mm --mesh none --copies 3",
    "tower.tif --area 120x110mm --moat layer --cell 4mm --break-width 0",
    "tower.tif --area 120x110mm --moat outline --least-piece 0 --base-layers 0",
    "tower.tif:3 torus.tif:2 --area 120x150mm --pack outline --turns quarters --edge-gap 2mm",
    "tower.tif:2 torus.tif:2 --area 120x150mm --settle --resample --fit --moat layer",
    "tower.tif --layers 20..50 --area 120x110mm",
    "tower.tif --layers 20..50 --area 120x110mm --moat outline --cell 3mm",
];

#[test]
fn pages_by_a_recipe_are_those_of_tile() {
    let scratch = Scratch::with_tower_and_torus();
    for options in BUILDS {
        let line = format!("tile {options}");
        let build = scratch.run(&line).succeeds_quietly().stdout;
        let none = scratch.run(&format!("{line} --recipe build.json")).succeeds_quietly();
        assert!(none.stdout.is_empty(), "{options}");
        let both = format!("{line} --recipe both.json -o build.tif");
        scratch.run(&both).succeeds_quietly();
        assert!(scratch.bytes("build.tif") == build, "{options}");
        assert!(scratch.bytes("build.json") == scratch.bytes("both.json"), "{options}");

        let whole = scratch.run("lamp compose build.json").succeeds_quietly().stdout;
        assert!(whole == build, "{options}");
        let first = scratch.layers("build.tif")[0].info.index;
        for (from, to) in [(0, 1), (2, 9), (13, 14), (17, 1000)] {
            let range = format!("--layers {}..{}", first + from, first + to);
            let composed = scratch.run(&format!("lamp compose build.json {range}"));
            let cut = scratch.run(&format!("lamp convert build.tif {range}"));
            assert!(composed.succeeds_quietly().stdout == cut.succeeds_quietly().stdout, "{range}");
        }
    }
}

#[test]
fn forms_of_stacks_are_chosen_when_layers_are_composed() {
    let scratch = Scratch::new();
    write_gray_ramp(&scratch.path("gray.tif"), 300, 200);
    let line = "tile gray.tif --area 90x70mm --cell 4mm";
    scratch.run(&format!("{line} --recipe r.json")).succeeds_quietly();
    for form in ["", "--classic", "--packbits"] {
        let build = scratch.run(&format!("{line} {form}")).succeeds_quietly().stdout;
        let composed = scratch.run(&format!("lamp compose r.json {form}")).succeeds_quietly();
        assert!(composed.stdout == build, "{form}");
    }
    scratch.run("lamp compose r.json -o pages/").succeeds_quietly();
    scratch.run(&format!("{line} -o build.lamp")).succeeds_quietly();
    scratch.run("lamp compose r.json -o composed.lamp").succeeds_quietly();
    assert!(scratch.bytes("build.lamp") == scratch.bytes("composed.lamp"));
    scratch.run("lamp compare pages/ build.lamp").succeeds_quietly();
}

#[test]
fn parts_are_found_from_the_recipe_s_folder() {
    let scratch = Scratch::with_tower_and_torus();
    for folder in ["stacks", "out", "elsewhere"] {
        fs::create_dir(scratch.path(folder)).unwrap();
    }
    fs::rename(scratch.path("tower.tif"), scratch.path("stacks/tower.tif")).unwrap();
    let mine =
        "name = \"mine\"\ndescription = \"-\"\n[area]\nvalue = \"60x60mm\"\nsource = \"-\"\n";
    fs::write(scratch.path("mine.toml"), mine).unwrap();
    let line = "tile stacks/tower.tif --machine mine.toml";
    let build = scratch.run(line).succeeds_quietly().stdout;
    scratch.run(&format!("{line} --recipe out/r.json")).succeeds_quietly();
    let recipe = String::from_utf8(scratch.bytes("out/r.json")).unwrap();
    assert!(recipe.contains("\"file\":\"../stacks/tower.tif\""), "{recipe}");
    assert!(recipe.contains("\"machine\": \"mine.toml@blake3:"), "{recipe}");
    let moved = scratch.path("elsewhere/all");
    fs::create_dir(&moved).unwrap();
    for folder in ["stacks", "out"] {
        fs::rename(scratch.path(folder), moved.join(folder)).unwrap();
    }
    let composed = scratch.run("lamp compose elsewhere/all/out/r.json").succeeds_quietly().stdout;
    assert!(composed == build);
}

#[test]
fn what_cannot_be_composed_is_said() {
    let scratch = Scratch::with_tower_and_torus();
    let line = "tile tower.tif --area 120x110mm --recipe r.json";
    scratch.run(line).succeeds_quietly();
    for (line, words) in [
        ("lamp compose -", &["give the recipe's file name"][..]),
        ("lamp compose r.json -o r.json", &["that is an input"]),
        ("tile - --recipe r.json", &["standard input has none"]),
        ("tile tower.tif --classic --recipe r.json", &["--classic is for a stack"]),
        ("tile tower.tif --recipe -", &["name a file, such as report.json"]),
        ("tile tower.tif --recipe tower.tif", &["tower.tif: no stack is written there"]),
        ("tile tower.tif --recipe r.json -o r.json", &["the stack is written there"]),
    ] {
        scratch.run(line).is_wrong_usage(words);
    }
    let recipe = String::from_utf8(scratch.bytes("r.json")).unwrap();
    let said = |name: &str, words: &[&str]| {
        let line = format!("lamp compose {name} -o x.tif");
        scratch.run(&line).is_refused_with(&[&[name], words].concat());
        assert!(!scratch.path("x.tif").exists());
    };
    let changed = |from: &str, to: &str| {
        assert!(recipe.contains(from), "{from} in {recipe}");
        fs::write(scratch.path("changed.json"), recipe.replace(from, to)).unwrap();
    };
    said("missing.json", &["No such file"]);
    said("tower.tif", &["stream did not contain valid UTF-8"]);
    fs::write(scratch.path("half.json"), &recipe[..recipe.len() / 2]).unwrap();
    said("half.json", &["this is not a recipe", "write it again with tile --recipe"]);
    changed("lamp-recipe-1", "lamp-recipe-9");
    said("changed.json", &["lamp-recipe-9", "write it again"]);
    changed("\"code\": ", "\"code\": 1");
    said("changed.json", &["by code 1", "would not be the same", "write it again"]);
    for (from, to) in [("tower.tif", "torus.tif"), ("120x110mm", "20x110mm")] {
        changed(from, to);
        said("changed.json", &["changed since tile wrote it", "write it again with tile --recipe"]);
    }
    scratch.run("lamp compose r.json --layers 900").is_refused_with(&["it has layers 0 to 80"]);
    // A damaged part is not composed from.
    let mut bytes = scratch.bytes("tower.tif");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(scratch.path("tower.tif"), bytes).unwrap();
    said("r.json", &["tower.tif is not the stack that the recipe is for"]);
    fs::remove_file(scratch.path("tower.tif")).unwrap();
    said("r.json", &["tower.tif", "No such file"]);
}

#[test]
fn no_recipe_is_written_of_a_build_that_is_refused() {
    let scratch = Scratch::with_tower_and_torus();
    scratch.run("lamp convert tower.tif -o pages/").succeeds_quietly();
    for (line, words) in [
        ("tile tower.tif torus.tif --area 30x30mm", &["mm"][..]),
        ("tile missing.tif", &["No such file"]),
        (
            "tile tower.tif:2 torus.tif:1 --area 120x110mm --layers 40..",
            &["no layer is in that range"],
        ),
        ("tile tower.tif --machine low.toml --area 60x60mm", &["50"]),
    ] {
        let low = "name = \"low\"\ndescription = \"a low one\"\n[area]\nvalue = \"100x100mm\"\nsource = \"x\"\n\
                   [height]\nvalue = \"50mm\"\nsource = \"x\"\n";
        fs::write(scratch.path("low.toml"), low).unwrap();
        scratch.run(&format!("{line} --recipe r.json")).is_refused_with(words);
        assert!(!scratch.path("r.json").exists(), "{line}");
    }
    scratch
        .run("tile pages/ --recipe r.json")
        .is_wrong_usage(&["pages/ is a folder", "lamp convert"]);
    // Stray rows are reported as when the build is made.
    scratch.run("lamp sample tower --facets 5k --defect drop -q -o broken.stl").succeeds_quietly();
    scratch.run("slice broken.stl --dpi 100 --thickness 1mm -q -o broken.tif").succeeds();
    let strict = scratch.run("tile broken.tif --area 60x60mm --strict --recipe r.json");
    assert_eq!(strict.statuses, [Some(3)]);
    assert!(!scratch.path("r.json").exists());
    let told = scratch.run("tile broken.tif --area 60x60mm --recipe r.json").succeeds();
    assert!(told.stderr.contains("stray rows"), "{}", told.stderr);
    let built = scratch.run("tile broken.tif --area 60x60mm").succeeds().stdout;
    assert!(scratch.run("lamp compose r.json").succeeds_quietly().stdout == built);
}
