//! Checks that `tile --fields` cuts a build into rows and columns of fields, and `lamp join` puts
//! it together again.

use std::fs;

use lamp_fixtures::Sample;
use lamp_stack::{Image, Layer};
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

const SCAN: &str = "name = \"scan\"\ndescription = \"\"\n[area]\nvalue = \"9x9in\"\nsource = \"-\"\n\
    [scan]\nmirrors = [100, 80]\noverlap = 20\nspeed = [\"0.001mm/s\", \"900mm/s\"]\n\
    acceleration = \"2000mm/s2\"\nrow_clock_hz = 22000\nboth_ways = true\nsource = \"-\"\n\
    [times]\nexpose_s = 1\nsource = \"-\"\n";

fn index(scratch: &Scratch, folder: &str) -> Value {
    serde_json::from_slice(&scratch.bytes(&format!("{folder}/fields.json"))).unwrap()
}

fn numbers(pair: &Value) -> [u32; 2] {
    [0, 1].map(|k| pair[k].as_u64().unwrap() as u32)
}

/// Checks pixel by pixel that a folder's fields add up to the build, from the index alone.
fn check_sum(scratch: &Scratch, folder: &str, build: &[Layer], step: usize) {
    let index = index(scratch, folder);
    let [width, height] = numbers(&index["field"]);
    let listed = index["fields"].as_array().unwrap();
    let fields: Vec<Vec<Layer>> = listed
        .iter()
        .map(|field| scratch.layers(&format!("{folder}/{}", field["file"].as_str().unwrap())))
        .collect();
    assert_eq!(index["layers"], build.len());
    for (k, layer) in build.iter().enumerate().step_by(step) {
        let size = [layer.image.width(), layer.image.height()];
        assert_eq!(numbers(&index["pixels"]), size);
        let mut sums = vec![vec![(0, 0); size[0] as usize]; size[1] as usize];
        for (field, listed) in fields.iter().zip(listed) {
            let Layer { info, image, .. } = &field[k];
            assert_eq!((image.width(), image.height()), (width, height));
            assert_eq!(info.other["field"]["columns"], listed["columns"]);
            assert_eq!(info.other["field"]["rows"], listed["rows"]);
            let [left, top] = [&listed["columns"], &listed["rows"]].map(|side| numbers(side)[0]);
            let pitch = 25.4 / layer.pitch.unwrap().x.get();
            let mm = |pixels: u32| f64::from(pixels) * pitch;
            let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}");
            near(listed["x_mm"].as_f64().unwrap(), mm(left));
            near(listed["y_mm"].as_f64().unwrap(), mm(top));
            let [origin, of_build] = [info, &layer.info].map(|info| info.origin_mm.unwrap());
            near(origin[0], of_build[0] + mm(left));
            near(origin[1], of_build[1] - mm(top));
            for (row, column) in (0..height).flat_map(|row| (0..width).map(move |c| (row, c))) {
                let level = u32::from(image.level(column, row));
                if level > 0 {
                    // A pixel beyond the build would be out of bounds.
                    let sum = &mut sums[(top + row) as usize][(left + column) as usize];
                    *sum = (sum.0 + level, sum.1 + 1);
                }
            }
        }
        for (y, row) in (0..).zip(&sums) {
            for (x, &(sum, exposures)) in (0..).zip(row) {
                assert_eq!(sum, u32::from(layer.image.level(x, y)), "{folder} {k}: {x} {y}");
                assert!(exposures <= 1 || index["seam"] == "gray", "{folder} {k}: {x} {y}");
            }
        }
    }
}

#[test]
fn fields_add_up_to_the_build_and_join_to_its_bytes() {
    let scratch = with_tower();
    scratch.run(&format!("{TILE} -o build.tif")).succeeds_quietly();
    let build = scratch.layers("build.tif");
    for (k, (options, grid, gray)) in [
        ("--fields 100x80 --overlap 20", [4, 3], false),
        ("--fields 100x80 --overlap 20 --seam gray", [4, 3], true),
        ("--fields 64x64", [4, 4], false),
        ("--fields 75x300 --overlap 37", [1, 6], false),
        ("--fields 300x75 --overlap 37 --seam gray", [6, 1], true),
        ("--fields 236x236 --overlap 4", [1, 1], false),
        ("--fields 300x400 --overlap 40 --seam gray", [1, 1], false),
    ]
    .into_iter()
    .enumerate()
    {
        let folder = format!("fields{k}");
        scratch.run(&format!("{TILE} {options} -o {folder}")).succeeds_quietly();
        check_sum(&scratch, &folder, &build, 15);
        let mut expected: Vec<_> = (0..grid[0])
            .flat_map(|row| (0..grid[1]).map(move |c| format!("field_{row:03}_{c:03}.tif")))
            .collect();
        expected.push("fields.json".to_owned());
        assert_eq!(scratch.names_in(&folder), expected, "{options}");
        let first = scratch.layers(&format!("{folder}/field_000_000.tif"));
        assert!(first.iter().all(|layer| matches!(*layer.image, Image::Gray(_)) == gray));
        scratch.run(&format!("lamp join {folder} -o joined{k}.tif")).succeeds_quietly();
        let joined = scratch.bytes(&format!("joined{k}.tif"));
        assert!(joined == scratch.bytes("build.tif"), "{options}");
    }
    let index = index(&scratch, "fields0");
    assert_eq!((&index["name"], &index["pixels"]), (&json!("tower"), &json!([236, 236])));
    assert_eq!((&index["dpi"], &index["overlap"]), (&json!(100.0), &json!(20)));
    assert_eq!(
        index["fields"][5],
        json!({
            "row": 1, "column": 2, "file": "field_001_002.tif", "columns": [160, 236],
            "rows": [60, 140], "x_mm": 40.64, "y_mm": 15.24
        })
    );
    let page = scratch.layers("fields0/field_001_002.tif").remove(0).info;
    let commands = page.stack.unwrap().commands;
    assert_eq!(commands.last().unwrap(), "field 1,2 --fields 100x80 --overlap 20 --seam comb");
    let info = scratch.run("lamp info fields0 --json").succeeds_quietly().stdout;
    let info: Value = serde_json::from_slice(&info).unwrap();
    assert_eq!((&info["schema"], &info["grid"]), (&json!("lamp-info-fields-1"), &json!([4, 3])));
    assert_eq!(info["fields"][5]["rows"], json!([60, 140]));
    let whole = scratch.run("lamp info build.tif --json").succeeds_quietly().stdout;
    let whole: Value = serde_json::from_slice(&whole).unwrap();
    for key in ["layers", "exposed_px", "gray_layers", "checks"] {
        assert_eq!(info[key], whole[key], "{key}");
    }
    let text = scratch.run("lamp info fields0").succeeds_quietly().stdout;
    let text = String::from_utf8(text).unwrap();
    assert!(
        text.contains("grid:       4 rows of 3, of 100 x 80 pixels, 20 shared (comb)"),
        "{text}"
    );
    assert!(text.contains("field_001_002.tif: columns 160 to 235, rows 60 to 139, 81 "), "{text}");
}

#[test]
fn threads_change_no_byte_and_stray_rows_come_back() {
    let scratch = Scratch::new();
    let mut layers = lamp_fixtures::cavity_staircase(1).layers().collect::<Vec<_>>();
    for (k, layer) in layers.iter_mut().enumerate() {
        layer.info.stray_rows = (0..layer.image.height()).step_by(3 + k % 4).collect();
        layer.info.open_rows = layer.info.stray_rows.clone();
    }
    scratch.stack("stray.tif", layers);
    let tile = "tile stray.tif --area 40x40mm --mesh none";
    let build = scratch.run(&format!("{tile} -o build.tif"));
    build.succeeds();
    for threads in [1, 3] {
        let line = format!("{tile} --fields 150x20 --threads {threads} --overlap 2 -o t{threads}/");
        scratch.run(&line).succeeds();
        scratch.run(&format!("lamp join t{threads} -o j.tif --force")).succeeds_quietly();
        assert!(scratch.bytes("j.tif") == scratch.bytes("build.tif"));
    }
    assert_eq!(scratch.names_in("t1"), scratch.names_in("t3"));
    for name in scratch.names_in("t1") {
        assert!(scratch.bytes(&format!("t1/{name}")) == scratch.bytes(&format!("t3/{name}")));
    }
    let first = scratch.layers("build.tif").remove(0).info.stray_rows;
    assert!(!first.is_empty());
}

#[test]
fn stages_take_a_folder_of_fields_and_scans_refuse_it() {
    let scratch = with_tower();
    let cut = "--fields 100x80 --overlap 20 --seam gray";
    scratch.run(&format!("{TILE} -o build.tif")).succeeds_quietly();
    scratch.run(&format!("{TILE} {cut} -o s")).succeeds_quietly();
    scratch.run("dither s -q -o dots").succeeds();
    scratch.run("dither build.tif -q -o dots.tif").succeeds();
    assert_eq!(index(&scratch, "dots")["seam"], "comb");
    scratch.run("lamp join dots -o joined.tif").succeeds_quietly();
    assert!(scratch.bytes("joined.tif") == scratch.bytes("dots.tif"));
    scratch.run("fix s -q -o fixed").succeeds();
    scratch.run("fix build.tif -q -o fixed.tif").succeeds();
    scratch.run("lamp join fixed -o back.tif").succeeds_quietly();
    assert!(scratch.bytes("back.tif") == scratch.bytes("fixed.tif"));
    let found = scratch.run("lamp verify fixed").succeeds_quietly().stdout;
    let found = String::from_utf8(found).unwrap();
    assert!(found.ends_with("fixed: whole, the fields make one build\n"), "{found}");
    scratch.run("fix s -q -o t.tif").is_wrong_usage(&["folder of fields", "-o", "lamp join"]);
    scratch.run("lamp info s --runs").is_wrong_usage(&["--runs", "lamp join"]);
    scratch.run("lamp join s build.tif -o x.tif").is_wrong_usage(&["s holds the strips or fields"]);
    scratch.write("scan.toml", SCAN.as_bytes());
    for line in [
        "lamp job s --machine scan.toml -o job/",
        "lamp frames s --machine scan.toml --layer 2 --swath 0 -o a.frames",
    ] {
        scratch.run(line).is_refused_with(&[
            "s",
            "fields are for a projector that steps",
            "lamp join",
        ]);
    }
    assert!(!scratch.path("job").exists() && !scratch.path("a.frames").exists());
}

#[test]
fn what_cannot_be_cut_leaves_nothing() {
    let scratch = with_tower();
    let before = scratch.names();
    for (options, words) in [
        ("--fields 100x80", &["--fields", "-o"][..]),
        ("--fields 100x80 -o -", &["-o fields/"]),
        ("--fields 100x80 -o a.tif", &["-o fields/"]),
        ("--fields 100x80 -o a.lamp", &["-o fields/"]),
        ("--fields 0x80 -o f", &["2560x1600"]),
        ("--fields 100 -o f", &["2560x1600"]),
        ("--fields 100x80 --overlap 40 -o f", &["100 x 80", "less than half"]),
        ("--fields 1x1 --overlap 1 -o f", &["less than half"]),
        ("--fields 65536x9 -o f", &["at most 65535"]),
        ("--fields machine -o f", &["--machine"]),
        ("--fields machine --machine beta -o f", &["beta has no [fields]", "--fields WxH"]),
        ("--fields 100x80 --strips s -o f", &["--strips"]),
        ("--fields 100x80 --mirrors 9 -o f", &["--mirrors"]),
        ("--fields 100x80 -o f --layout-out f", &["the stack is written there"]),
    ] {
        scratch.run(&format!("{TILE} {options}")).is_wrong_usage(words);
        assert_eq!(scratch.names(), before, "{options}");
    }
    let words = &["236 x 236 fields of 1 x 1", "at most 512", "larger --fields"];
    scratch.run(&format!("{TILE} --fields 1x1 -o f")).is_refused_with(words);
    assert_eq!(scratch.names(), before);
    scratch.run(&format!("{TILE} --fields 100x80 -o f")).succeeds_quietly();
    scratch
        .run("tile f/field_000_000.tif --area 200x200mm --fields 99x99 -o g")
        .is_refused_with(&["layer", "is a field already"]);
    scratch.run(&format!("{TILE} --fields 100x80 -o f")).is_refused_with(&["f", "--force"]);
    scratch.run(&format!("{TILE} --fields 100x70 -o f --force")).succeeds_quietly();
    assert_eq!(index(&scratch, "f")["field"], json!([100, 70]));
}

#[test]
fn fields_that_do_not_belong_together_are_named() {
    let scratch = with_tower();
    let cut = |folder: &str, more: &str| {
        let fields = "--fields 100x80 --overlap 20";
        scratch.run(&format!("{TILE} {fields} {more} -o {folder} --force")).succeeds_quietly();
    };
    cut("other", "--layers ..60");
    let with = |name: &str, bytes: &[u8]| {
        fs::remove_dir_all(scratch.path("s")).ok();
        cut("s", "");
        scratch.write(&format!("s/{name}"), bytes);
    };
    let refused = |words: &[&str]| {
        for line in ["lamp join s -o x.tif", "lamp verify s"] {
            let ran = scratch.run(line);
            assert_eq!(ran.statuses, [Some(1)], "{line}");
            let said = format!("{}{}", ran.stderr, String::from_utf8_lossy(&ran.stdout));
            for word in words {
                assert!(said.contains(word), "no {word} in {said}");
            }
        }
        assert!(!scratch.path("x.tif").exists());
    };
    with("field_001_002.tif", &scratch.bytes("other/field_001_002.tif"));
    refused(&["field_001_002.tif", "it has no layer where field_000_000.tif has layer 65"]);
    with("field_001_002.tif", &scratch.bytes("s/field_002_001.tif"));
    refused(&["field_001_002.tif", "does not state that it is the field of row 1, column 2"]);
    with("field_003_000.tif", &scratch.bytes("s/field_003_000.tif")[..3000]);
    refused(&["s", "field_003_000.tif", "cut off"]);
    with("field_004_000.tif", &scratch.bytes("s/field_003_000.tif"));
    refused(&["field_004_000.tif is not a field of this build: fields.json does not list it"]);
    with("fields.json", b"{}");
    refused(&["fields.json", "not an index of fields"]);
    let index = String::from_utf8(scratch.bytes("other/fields.json")).unwrap();
    with("fields.json", index.as_bytes());
    refused(&["field_000_000.tif", "which fields.json does not list"]);
    with("more", b"");
    fs::remove_file(scratch.path("s/field_001_001.tif")).unwrap();
    refused(&["field_001_001.tif", "No such file"]);
    scratch.run("lamp info s").is_refused_with(&["field_001_001.tif"]);
    // Pixels that are added in one field are in two.
    with("more", b"");
    let mut layers = scratch.layers("s/field_001_001.tif");
    for layer in &mut layers {
        let Image::Mask(mask) = &*layer.image else { panic!("a comb makes no gray") };
        layer.image = Image::Mask(mask.inverted()).into();
    }
    scratch.stack("s/field_001_001.tif", layers);
    refused(&["layer 0", "add up to more than full exposure"]);
}

#[test]
fn the_machine_knows_its_fields_and_their_time() {
    let scratch = with_tower();
    let machine = |fields: &str| {
        format!(
            "name = \"mine\"\ndescription = \"mine\"\n[area]\nvalue = \"60x60mm\"\nsource = \"here\"\n\
             [fields]\npixels = [100, 80]\noverlap = 20\n{fields}source = \"here\"\n\
             [times]\nrecoat_s = 2\nexpose_s = 1.5\nsource = \"here\"\n"
        )
    };
    scratch.write("mine.toml", machine("step_s = 0.25\n").as_bytes());
    scratch.write("stepless.toml", machine("").as_bytes());
    let tile = "tile tower.tif --machine mine.toml";
    scratch.run("lamp machine check mine.toml stepless.toml").succeeds_quietly();
    scratch.run(&format!("{tile} --fields machine -o a")).succeeds_quietly();
    scratch.run(&format!("{TILE} --fields 100x80 --overlap 20 -o b")).succeeds_quietly();
    // Counted by hand: fields of a layer with a white pixel.
    let names = scratch.names_in("a").into_iter().filter(|name| name.ends_with(".tif"));
    let fields: Vec<Vec<Layer>> = names.map(|name| scratch.layers(&format!("a/{name}"))).collect();
    let white = |k: usize| fields.iter().filter(|f| f[k].image.change_count() > 0).count();
    let layers = fields[0].len();
    let counts: Vec<usize> = (0..layers).map(white).collect();
    let count: usize = counts.iter().sum();
    let steps: usize = counts.iter().map(|count| count.saturating_sub(1)).sum();
    let seconds = count as f64 * 1.5 + steps as f64 * 0.25 + layers as f64 * 2.0;
    let report = |line: &str| -> Value {
        scratch.run(line).succeeds();
        serde_json::from_slice(&scratch.bytes("report.json")).unwrap()
    };
    let of = report(&format!("{tile} --time --report report.json"));
    assert_eq!((&of["fields"], &of["swaths"]), (&json!(count), &Value::Null));
    assert_eq!(of["black_fields"], json!(fields.len() * layers - count));
    assert!((of["build_s"].as_f64().unwrap() - seconds).abs() < 1e-6, "{of}");
    assert_eq!(of["warnings"], json!([]));
    let text = scratch.run(&format!("{tile} --time")).succeeds_quietly().stdout;
    let text = String::from_utf8(text).unwrap();
    assert!(
        text.contains(&format!(", {count} in all")) && text.contains("between fields"),
        "{text}"
    );
    // Other fields than the machine's.
    let of = report(&format!("{tile} --time --fields 236x236 --report report.json --force"));
    assert_eq!((&of["fields"], &of["black_fields"]), (&json!(layers), &json!(0)));
    let stepless = "tile tower.tif --machine stepless.toml --time";
    let text = scratch.run(stepless).succeeds_quietly().stdout;
    let text = String::from_utf8(text).unwrap();
    assert!(
        text.contains("steps between fields are not in it: write step_s into [fields]"),
        "{text}"
    );
    let shown = scratch.run("lamp machine show mine.toml --json").succeeds_quietly().stdout;
    let shown: Value = serde_json::from_slice(&shown).unwrap();
    assert_eq!(
        shown["machines"][0]["fields"],
        json!({ "pixels": [100, 80], "overlap": 20, "step_s": 0.25, "source": "here" })
    );
}
