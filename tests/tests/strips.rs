//! Checks that `tile --strips` cuts a build into swaths, and `lamp join` joins them again.

use std::fs;

use lamp_fixtures::Sample;
use lamp_stack::{GrayMask, Image, Layer, PageInfo, Pitch, StackInfo, gray_runs};
use lamp_tests::Scratch;
use serde_json::{Value, json};

/// A tower of 76 layers, which makes a build of 236 x 236 pixels.
fn with_tower() -> Scratch {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 5_000);
    scratch.run("slice tower.stl --dpi 100 --thickness 1mm -q -o tower.tif").succeeds_quietly();
    scratch
}

const TILE: &str = "tile tower.tif --area 60x60mm";

/// Returns the levels of an image, row by row.
fn levels(image: &Image) -> Vec<Vec<u32>> {
    let gray = match image {
        Image::Mask(mask) => GrayMask::from(mask),
        Image::Gray(gray) => gray.clone(),
    };
    let row = |changes: &[_]| {
        let mut levels = vec![0; gray.width() as usize];
        for (start, end, level) in gray_runs(changes, gray.width()) {
            levels[start as usize..end as usize].fill(level.into());
        }
        levels
    };
    gray.rows().map(row).collect()
}

fn index(scratch: &Scratch, folder: &str) -> Value {
    serde_json::from_slice(&scratch.bytes(&format!("{folder}/strips.json"))).unwrap()
}

/// Checks pixel by pixel that a folder's strips add up to the build, and returns them.
fn check_sum(scratch: &Scratch, folder: &str, build: &str) -> Vec<Vec<Layer>> {
    let build = scratch.layers(build);
    let index = index(scratch, folder);
    let listed = index["strips"].as_array().unwrap();
    let strips: Vec<Vec<Layer>> = listed
        .iter()
        .map(|strip| scratch.layers(&format!("{folder}/{}", strip["file"].as_str().unwrap())))
        .collect();
    assert_eq!(index["layers"], build.len());
    assert!(strips.iter().all(|strip| strip.len() == build.len()));
    for (k, layer) in build.iter().enumerate() {
        let expected = levels(&layer.image);
        let mut sum = vec![vec![0; layer.image.width() as usize]; expected.len()];
        let mut exposures = 0;
        for (strip, listed) in strips.iter().zip(listed) {
            let page = &strip[k].info;
            let facts =
                |info: &PageInfo| (info.index, info.z_um, info.thickness_um, info.exposure_ms);
            assert_eq!(facts(page), facts(&layer.info));
            assert_eq!(page.other["strip"]["columns"], listed["columns"]);
            let start = listed["columns"][0].as_u64().unwrap() as usize;
            let x0 = layer.info.origin_mm.unwrap()[0]
                + start as f64 * 25.4 / layer.pitch.unwrap().x.get();
            assert!((page.origin_mm.unwrap()[0] - x0).abs() < 1e-9);
            for (sum, row) in sum.iter_mut().zip(levels(&strip[k].image)) {
                for (column, level) in (start..).zip(row).filter(|(_, level)| *level > 0) {
                    sum[column] += level;
                    exposures += 1;
                }
            }
        }
        assert!(sum == expected, "layer {k} of {folder}");
        let white = expected.iter().flatten().filter(|level| **level > 0).count();
        assert!(exposures == white || index["seam"] == "gray", "layer {k} of {folder}");
    }
    strips
}

#[test]
fn strips_add_up_to_the_build_and_join_to_its_bytes() {
    let scratch = with_tower();
    for (k, (options, files, gray)) in [
        ("--mirrors 100 --overlap 20", 3, false),
        ("--mirrors 100 --overlap 20 --seam gray", 3, true),
        ("--mirrors 64", 4, false),
        ("--mirrors 75 --overlap 37", 6, false),
        ("--mirrors 75 --overlap 37 --seam gray", 6, true),
        ("--mirrors 30 --overlap 14", 14, false),
        ("--mirrors 300 --overlap 40", 1, false),
    ]
    .into_iter()
    .enumerate()
    {
        let folder = format!("strips{k}");
        let line = format!("{TILE} --strips {folder} {options} -o {k}.tif");
        scratch.run(&line).succeeds_quietly();
        let strips = check_sum(&scratch, &folder, &format!("{k}.tif"));
        assert_eq!(strips.len(), files, "{options}");
        let is_gray = |layer: &Layer| matches!(*layer.image, Image::Gray(_));
        assert!(strips.iter().flatten().all(|layer| is_gray(layer) == gray), "{options}");
        let mut expected: Vec<_> = (0..files).map(|k| format!("strip_{k:03}.tif")).collect();
        expected.push("strips.json".to_owned());
        assert_eq!(scratch.names_in(&folder), expected);
        scratch.run(&format!("lamp join {folder} -o joined{k}.tif")).succeeds_quietly();
        let whole = scratch.run(TILE).succeeds_quietly().stdout;
        assert!(scratch.bytes(&format!("{k}.tif")) == whole);
        assert!(scratch.bytes(&format!("joined{k}.tif")) == whole, "{options}");
    }
    let index = index(&scratch, "strips0");
    assert_eq!((&index["name"], &index["pixels"]), (&json!("tower"), &json!([236, 236])));
    assert_eq!((&index["mirrors"], &index["overlap"]), (&json!(100), &json!(20)));
    let columns: Vec<_> =
        index["strips"].as_array().unwrap().iter().map(|s| &s["columns"]).collect();
    assert_eq!(columns, [&json!([0, 100]), &json!([80, 180]), &json!([160, 236])]);
    let first = scratch.layers("strips0/strip_001.tif").remove(0).info;
    let commands = first.stack.unwrap().commands;
    assert_eq!(commands.last().unwrap(), "strip 1 --mirrors 100 --overlap 20 --seam comb");
    assert_eq!(index["seam"], "comb");
    assert_eq!(
        first.other["strip"],
        json!({"number": 1, "of": 3, "columns": [80, 180], "bits": 1})
    );
}

#[test]
fn the_machine_knows_its_strips_and_threads_change_no_byte() {
    let scratch = with_tower();
    let machine = "name = \"mine\"\ndescription = \"mine\"\n[area]\nvalue = \"60x60mm\"\nsource = \"here\"\n\
                   [strips]\nmirrors = 100\noverlap = 20\nsource = \"here\"\n";
    scratch.write("mine.toml", machine.as_bytes());
    let line = "tile tower.tif --machine mine.toml";
    scratch.run(&format!("{line} --strips a/ --threads 1")).succeeds_quietly();
    // The build is also written if requested.
    let tile = format!("{TILE} --machine mine.toml");
    let line = format!("{tile} --strips b --mirrors 100 --overlap 20 --threads 3 -o -");
    let build = scratch.run(&line).succeeds_quietly().stdout;
    assert!(build == scratch.run(&tile).succeeds_quietly().stdout);
    assert_eq!(scratch.names_in("a"), scratch.names_in("b"));
    for name in scratch.names_in("a") {
        let [a, b] = ["a", "b"].map(|folder| scratch.bytes(&format!("{folder}/{name}")));
        assert!(a == b, "{name}");
    }
    assert!(scratch.run("lamp join a").succeeds_quietly().stdout == build);
    scratch.run(&format!("{tile} --strips c --mirrors 100 --classic")).succeeds_quietly();
    assert_eq!(scratch.bytes("c/strip_002.tif")[2], 42);
    assert!(scratch.run("lamp join c").succeeds_quietly().stdout == build);
}

#[test]
fn gray_layers_and_ranges_come_back() {
    let scratch = Scratch::new();
    let layer = |index: u32| {
        let mut ramp = GrayMask::new(90);
        (0..30)
            .for_each(|row| ramp.push_runs((row..90).map(|l| (1, (l * 2 + index) as u8))).unwrap());
        let stack = (index == 0).then(StackInfo::default);
        let info = PageInfo {
            index,
            z_um: Some(f64::from(index) * 100.0),
            thickness_um: Some(100.0),
            exposure_ms: Some(12.5),
            stack,
            ..PageInfo::default()
        };
        Layer { info, pitch: Pitch::of_dpi(25.4), image: Image::Gray(ramp).into() }
    };
    scratch.stack("gray.tif", (0..9).map(layer));
    let tile = "tile gray.tif --area 100x80mm";
    // Only the base is black and white.
    scratch
        .run(&format!("{tile} --strips s --mirrors 40 --overlap 11 -o build.tif"))
        .succeeds_quietly();
    check_sum(&scratch, "s", "build.tif");
    scratch.run("lamp join s -o back.tif").succeeds_quietly();
    assert!(scratch.bytes("back.tif") == scratch.bytes("build.tif"));
    let back = scratch.layers("back.tif");
    let grays = back.iter().filter(|layer| matches!(*layer.image, Image::Gray(_))).count();
    assert_eq!((grays, back.len()), (9, 14));
    let range = format!("{tile} --layers 3..7");
    scratch.run(&format!("{range} --strips r --mirrors 40 --overlap 11")).succeeds_quietly();
    assert!(
        scratch.run("lamp join r").succeeds_quietly().stdout
            == scratch.run(&range).succeeds_quietly().stdout
    );
    // A strip is a stack that can be joined and split.
    scratch.run("lamp split s/strip_001.tif --every 4 -o parts/").succeeds_quietly();
    let files: Vec<_> =
        scratch.names_in("parts").iter().map(|name| format!("parts/{name}")).collect();
    let joined = scratch.run(&format!("lamp join {}", files.join(" "))).succeeds_quietly().stdout;
    assert!(joined == scratch.bytes("s/strip_001.tif"));
}

#[test]
fn dithered_strips_give_seams_their_full_dose() {
    let scratch = Scratch::new();
    let mut white = GrayMask::new(320);
    (0..320).for_each(|_| white.push_runs([(320, 255)]).unwrap());
    let info = PageInfo { stack: Some(StackInfo::default()), ..PageInfo::default() };
    scratch.stack(
        "white.tif",
        [Layer { info, pitch: Pitch::of_dpi(25.4), image: Image::Gray(white).into() }],
    );
    scratch
        .run("tile white.tif --area 320x320mm --mesh none --strips s --mirrors 192 --overlap 64 --seam gray")
        .succeeds_quietly();
    let dots = |k: u32| {
        scratch.run(&format!("dither -q s/strip_00{k}.tif -o {k}.tif")).succeeds();
        levels(&scratch.layers(&format!("{k}.tif"))[0].image)
    };
    let [left, right] = [0, 1].map(dots);
    let white = |rows: &[Vec<u32>], columns: std::ops::Range<usize>| -> f64 {
        rows.iter().flat_map(|row| &row[columns.clone()]).map(|&l| f64::from(l) / 255.0).sum()
    };
    assert_eq!(white(&left, 0..128), 128.0 * 320.0);
    let seam = (white(&left, 128..192) + white(&right, 0..64)) / (64.0 * 320.0);
    assert!((seam - 1.0).abs() < 0.01, "the seam has {seam} of the dose");
    // A ramp from edge to edge, not a step of a half.
    let falls = [128..144, 176..192].map(|columns| white(&left, columns) / (16.0 * 320.0));
    assert!(falls[0] > 0.8 && falls[1] < 0.2, "{falls:?}");
}

#[test]
fn what_cannot_be_cut_leaves_nothing() {
    let scratch = with_tower();
    scratch.write("file", b"");
    fs::create_dir(scratch.path("full")).unwrap();
    scratch.write("full/file", b"");
    let before = scratch.names();
    for (options, words) in [
        ("--strips s", &["--mirrors", "--machine"][..]),
        ("--strips s --machine alpha", &["--mirrors", "alpha has no [strips]"]),
        ("--mirrors 100", &["--strips"]),
        ("--overlap 3", &["--strips"]),
        ("--seam gray", &["--strips"]),
        ("--strips s --mirrors 0", &["--mirrors"]),
        ("--strips s --mirrors 100 --overlap 50", &["share less than half"]),
        ("--strips s --mirrors 99999999", &["wider than any image"]),
        ("--strips s --mirrors 100 -o s", &["the stack is written there"]),
        ("--strips - --mirrors 100", &["name the folder"]),
        ("--strips s --mirrors 100 --layout-out s", &["the stack is written there"]),
    ] {
        scratch.run(&format!("{TILE} {options}")).is_wrong_usage(words);
        assert_eq!(scratch.names(), before, "{options}");
    }
    let cut = scratch.bytes("tower.tif");
    scratch.write("tower.tif", &cut[..cut.len() / 2]);
    for (options, words) in [
        ("--strips full --mirrors 100", &["full", "--force replaces a folder"][..]),
        ("--strips no/s --mirrors 100", &["no/s", "there is no folder no"]),
        ("--strips s --mirrors 100", &["tower.tif", "cut off"]),
        ("--strips s --mirrors 100 -o build.tif", &["tower.tif", "cut off"]),
        ("--strips s --mirrors 100 --layers ..3 -o no/build.tif", &["there is no folder no"]),
    ] {
        scratch.run(&format!("{TILE} {options}")).is_refused_with(words);
        assert_eq!(scratch.names(), before, "{options}");
    }
    scratch.write("tower.tif", &cut);
    let many = "tile tower.tif --area 200x60mm --strips s --mirrors 1";
    scratch.run(many).is_refused_with(&["787 pixels wide", "787 strips", "at most 512"]);
    scratch.run(&format!("{TILE} --strips s --mirrors 100 --overlap 9")).succeeds_quietly();
    scratch
        .run("tile s/strip_000.tif --area 200x200mm --strips t --mirrors 100")
        .is_refused_with(&["layer", "is a strip already"]);
}

#[test]
fn strips_that_do_not_belong_together_are_named() {
    let scratch = with_tower();
    let strips = "--mirrors 100 --overlap 20 --seam gray";
    let cut = |folder: &str, more: &str| {
        scratch.run(&format!("{TILE} {strips} --strips {folder} {more}")).succeeds_quietly();
    };
    cut("other", "--layers ..60");
    let with = |name: &str, bytes: &[u8]| {
        fs::remove_dir_all(scratch.path("s")).ok();
        cut("s", "");
        scratch.write(&format!("s/{name}"), bytes);
    };
    let refused = |words: &[&str]| {
        scratch.run("lamp join s -o x.tif").is_refused_with(words);
        assert!(!scratch.path("x.tif").exists());
    };
    with("strip_001.tif", &scratch.bytes("other/strip_001.tif"));
    refused(&["join: s", "strip_001.tif", "it has no layer where strip_000.tif has layer 65"]);
    with("strip_000.tif", &scratch.bytes("s/strip_001.tif"));
    refused(&["strip_000.tif", "does not state that it is strip 0"]);
    with("strip_002.tif", &scratch.bytes("s/strip_001.tif")[..3000]);
    refused(&["s", "strip_002.tif", "cut off"]);
    with("strips.json", b"{}");
    refused(&["strips.json", "not an index of strips"]);
    let index = String::from_utf8(scratch.bytes("other/strips.json")).unwrap();
    with("strips.json", index.as_bytes());
    refused(&["strip_000.tif", "which strips.json does not list"]);
    with("strips.json", index.replace("65", "99").as_bytes());
    refused(&["strip_000.tif", "18 layers that strips.json lists are missing"]);
    with("strips.json", index.replace("65", "81").replace("[236, 236]", "[236, 235]").as_bytes());
    refused(&["layer 0", "do not make up such a layer"]);
    with("more", b"");
    fs::remove_file(scratch.path("s/strip_001.tif")).unwrap();
    refused(&["strip_001.tif", "No such file"]);
    with("more", b"");
    scratch.run("dither -q --method threshold s/strip_001.tif -o dots.tif").succeeds();
    with("strip_001.tif", &scratch.bytes("dots.tif"));
    refused(&["layer 0"]);
    let both = scratch.run("lamp join s other -o x.tif");
    both.is_wrong_usage(&["s holds the strips or fields of one build"]);
}

#[test]
fn stages_take_a_folder_of_strips_for_its_build() {
    let scratch = Scratch::new();
    let layer = |index: u32| {
        let mut ramp = GrayMask::new(90);
        (0..30).for_each(|_| ramp.push_runs((0..90).map(|l| (1, (l * 2 + index) as u8))).unwrap());
        let stack = (index == 0).then(StackInfo::default);
        let info = PageInfo { index, stack, ..PageInfo::default() };
        Layer { info, pitch: Pitch::of_dpi(1500.0), image: Image::Gray(ramp).into() }
    };
    scratch.stack("gray.tif", (0..3).map(layer));
    let tile = "tile gray.tif --area 1.6x0.6mm --mesh none -o build.tif --mirrors 40 --overlap 11";
    scratch.run(&format!("{tile} --strips s --seam gray")).succeeds_quietly();
    scratch.run("dither build.tif -q -o dots.tif").succeeds();
    scratch.run("dither s -q -o dots").succeeds();
    // Each white pixel is exposed once, although the strips had ramps.
    assert_eq!(index(&scratch, "dots")["seam"], "comb");
    check_sum(&scratch, "dots", "dots.tif");
    scratch.run("lamp join dots -o joined.tif").succeeds_quietly();
    assert!(scratch.bytes("joined.tif") == scratch.bytes("dots.tif"));
    scratch.run("fix build.tif -q -o fixed.tif").succeeds();
    scratch.run("fix s -q -o fixed").succeeds();
    assert_eq!(index(&scratch, "fixed")["seam"], "gray");
    check_sum(&scratch, "fixed", "fixed.tif");
    scratch.run("lamp verify dots fixed -q").succeeds_quietly();

    let info = scratch.run("lamp info dots --json").succeeds_quietly().stdout;
    let info: Value = serde_json::from_slice(&info).unwrap();
    let build = scratch.run("lamp info dots.tif --json").succeeds_quietly().stdout;
    let build: Value = serde_json::from_slice(&build).unwrap();
    for key in ["layers", "exposed_px", "gray_layers", "checks"] {
        assert_eq!(info[key], build[key], "{key}");
    }
    assert_eq!((&info["schema"], &info["seam"]), (&json!("lamp-info-strips-1"), &json!("comb")));
    assert_eq!(info["strips"].as_array().unwrap().len(), 3);
    assert_eq!(info["strips"][1]["columns"], json!([29, 69]));
    let text = scratch.run("lamp info dots").succeeds_quietly().stdout;
    let text = String::from_utf8(text).unwrap();
    assert!(text.contains("strip_001.tif: columns 29 to 68, 3 layers, "), "{text}");

    for to in ["", " -o t.tif", " -o t.lamp"] {
        scratch.run(&format!("dither s{to}")).is_wrong_usage(&[
            "folder of strips",
            "-o",
            "lamp join",
        ]);
    }
    scratch.run("dither s --layers 1..2 -o t").is_wrong_usage(&["--layers", "lamp join"]);
    scratch.run("lamp info s --runs").is_wrong_usage(&["--runs"]);
    scratch.run("dither s -o dots").is_refused_with(&["dots", "--force replaces a folder"]);
    fs::remove_file(scratch.path("s/strip_001.tif")).unwrap();
    scratch.run("dither s -q -o t").is_refused_with(&["s: strip_001.tif"]);
    scratch.run("fix s -q -o t").is_refused_with(&["s: strip_001.tif"]);
    assert!(!scratch.path("t").exists());
}
