//! Checks the reports of `lamp check` on stacks and parts.

use lamp_fixtures::{
    Mesh, Sample, build, closed_void, cup, drawn_mask, mug, needle, ring, serpentine, slanted_wall,
};
use lamp_stack::{Layer, Mask, PageInfo, Pitch};
use lamp_tests::Scratch;
use serde_json::Value;

/// 254 dpi: a pixel is 100 um.
const SLICE: &str = "--dpi 254 --thickness 100um";

fn with(name: &str, mesh: &Mesh) -> Scratch {
    let scratch = Scratch::new();
    scratch.mesh(name, mesh);
    scratch
}

fn report(scratch: &Scratch, name: &str) -> Value {
    serde_json::from_slice(&scratch.bytes(name)).unwrap()
}

/// Returns the findings of a kind in a report.
fn of_kind<'a>(report: &'a Value, kind: &str) -> Vec<&'a Value> {
    let findings = report["findings"].as_array().unwrap().iter();
    findings.filter(|finding| finding["kind"] == kind).collect()
}

#[test]
fn a_stack_and_its_part_have_the_same_findings() {
    let scratch = with("mug.stl", &mug(4000));
    scratch.run(&format!("slice mug.stl {SLICE} -o mug.tif")).succeeds_quietly();
    let of_stack = scratch.run("lamp check mug.tif --report stack.json").succeeds_quietly();
    let of_part =
        scratch.run(&format!("lamp check mug.stl {SLICE} --report part.json")).succeeds_quietly();
    let [stack, text] = [of_stack, of_part].map(|ran| String::from_utf8(ran.stdout).unwrap());
    assert_eq!(stack.replace("mug.tif", "mug.stl"), text);
    let [stack, part] = ["stack.json", "part.json"].map(|name| report(&scratch, name));
    assert_eq!(stack["findings"], part["findings"]);
    let [island] = of_kind(&stack, "island")[..] else { panic!("{stack}") };
    assert_eq!(
        (&island["layer"], &island["joins"], &island["into"]),
        (&80.into(), &140.into(), &"part".into())
    );
    let near = |value: &Value, wanted: f64| (value.as_f64().unwrap() / wanted - 1.0).abs() < 0.02;
    assert!(near(&island["area_mm2"], 9.0) && near(&island["floating_mm3"], 54.0), "{island}");
    // The greatest viscosity of 002 section 4.2.2: 97.5 Pa.
    assert!(near(&island["drag_mn"], 9.0 * 97.5 / 1000.0), "{island}");
    assert_eq!(of_kind(&stack, "cup").len(), 1);
    for word in ["layer 80 (z 8.00 mm)", "joins the part in layer 140", "of resin stay when"] {
        assert!(text.contains(word), "no `{word}` in {text}");
    }
}

#[test]
fn findings_end_a_strict_check_with_status_3() {
    let scratch = with("ring.stl", &ring(2000));
    let strict = format!("slice ring.stl {SLICE} | fix | lamp check --strict");
    let ran = scratch.run(&strict);
    assert_eq!(ran.statuses, [Some(0), Some(0), Some(3)], "{ran:?}");
    assert!(ran.stderr.starts_with("error: check: "), "{ran:?}");
    let ran = scratch.run(&format!("lamp check ring.stl {SLICE} --strict --only pockets,balance"));
    ran.succeeds_quietly();
}

#[test]
fn pictures_show_the_worst_findings() {
    let scratch = with("ring.stl", &ring(2000));
    scratch.run(&format!("slice ring.stl {SLICE} -o ring.tif")).succeeds_quietly();
    scratch.run("lamp check ring.tif --evidence of_stack").succeeds_quietly();
    scratch.run(&format!("lamp check ring.stl {SLICE} --evidence of_part")).succeeds_quietly();
    let piped = format!("slice ring.stl {SLICE} | lamp check --evidence of_pipe");
    scratch.run(&piped).succeeds_quietly();
    let picture = "check_01_island_layer_00100.png";
    let [stack, part, pipe] = ["of_stack", "of_part", "of_pipe"]
        .map(|folder| scratch.bytes(&format!("{folder}/{picture}")));
    assert!(stack == part && stack == pipe);
    let mut reader = png::Decoder::new(std::io::Cursor::new(stack)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let width = reader.next_frame(&mut pixels).unwrap().width as usize;
    let (pixels, _) = pixels.as_chunks::<3>();
    // The place comes first, 480 pixels wide and high, below a line of text.
    let rows = pixels.chunks(width).skip(36).take(480);
    let red = rows.flat_map(|row| &row[12..492]).filter(|pixel| **pixel == [230, 30, 30]).count();
    // The ring has 156 mm2, at 10 pixels a millimeter and 2 x 2 pixels for one.
    assert!((red as f64 / (156.0 * 400.0) - 1.0).abs() < 0.02, "{red}");
    let ran = scratch.run("lamp check ring.tif --evidence of_stack");
    ran.is_refused_with(&["of_stack"]);
    scratch.run("lamp check ring.tif --evidence of_stack --force").succeeds_quietly();
}

/// Layers of 10 x 10 pixels, 1 mm wide and high, each white in a square or in none.
fn squares(sides: &[[u32; 2]]) -> Vec<Layer> {
    let layer = |(index, [start, end]): (u32, &[u32; 2])| {
        let mut mask = lamp_stack::MaskBuilder::new(10);
        mask.push_black(*start);
        (*start..*end).for_each(|_| mask.push_row(&[*start, *end]).unwrap());
        mask.push_black(10 - end);
        let info = PageInfo {
            index,
            z_um: Some(1000.0 * f64::from(index)),
            thickness_um: Some(1000.0),
            origin_mm: Some([0.0, 10.0]),
            ..PageInfo::default()
        };
        Layer { info, pitch: Pitch::of_dpi(25.4), image: mask.finish().into() }
    };
    (0..).zip(sides).map(layer).collect()
}

#[test]
fn overhangs_weak_joints_borders_and_empty_layers_are_told() {
    let scratch = Scratch::new();
    let [none, small, large, whole] = [[0, 0], [4, 6], [1, 9], [0, 9]];
    scratch.stack("a.tif", squares(&[small, large, none, whole, none]));
    let ran = scratch.run("lamp check a.tif --report a.json").succeeds_quietly();
    let text = String::from_utf8(ran.stdout).unwrap();
    for line in [
        "a.tif: 5 layers, 4 findings",
        "island: number 1 begins in layer 3 (z 3.00 mm) at x 4.50, y 5.50 mm with 81.0 mm2; never joins",
        "weak joint: layer 1 (z 1.00 mm) at x 5.00, y 5.00 mm: 64.0 mm2 rest on 4.00 mm2 (6.25%); with 1 overhang",
        "border: layer 3 (z 3.00 mm): white there",
        "empty: layer 2 (z 2.00 mm): no white; nothing holds",
        "empty: layer 4 (z 4.00 mm): no white; above the part",
    ] {
        assert!(text.contains(line), "no `{line}` in {text}");
    }
    let report = report(&scratch, "a.json");
    assert_eq!(report["inputs"][0]["findings"], 4);
    assert_eq!(of_kind(&report, "overhang")[0]["reach_px"], 18f64.sqrt());
    // Reaches of 4 mm are allowed.
    let ran = scratch.run(
        "lamp check a.tif --max-overhang 4.3mm --least-support 6% --only joints,overhangs --strict",
    );
    ran.succeeds_quietly();
}

#[test]
fn gray_is_white_from_a_threshold() {
    let scratch = Scratch::new();
    let gray = |layer: Layer, level: u8| {
        let lamp_stack::Image::Mask(mask) = &*layer.image else { unreachable!() };
        let mut gray = lamp_stack::GrayMask::new(mask.width());
        for row in mask.rows() {
            let runs = lamp_stack::white_runs(row, mask.width());
            let runs = runs.flat_map(|(start, end)| [(start, 0), (end - start, level)]);
            gray.push_runs(runs).unwrap();
        }
        Layer { image: gray.into(), ..layer }
    };
    let layers = squares(&[[1, 9], [2, 8], [2, 8]]);
    let [a, b, c] = <[Layer; 3]>::try_from(layers).unwrap();
    scratch.stack("g.tif", [gray(a, 255), gray(b, 100), gray(c, 255)]);
    scratch.run("lamp check g.tif --strict").succeeds_quietly();
    let ran = scratch.run("lamp check g.tif --threshold 101 --strict");
    assert_eq!(ran.statuses, [Some(3)]);
    assert!(String::from_utf8(ran.stdout).unwrap().contains("island: number 1 begins in layer 2"));
}

#[test]
fn stray_rows_are_named_first() {
    let scratch = with("ring.stl", &ring(2000));
    scratch.run(&format!("slice ring.stl {SLICE} -o ring.tif")).succeeds_quietly();
    let mut layers = scratch.layers("ring.tif");
    layers[120].info.stray_rows = vec![5, 6];
    scratch.stack("stray.tif", layers);
    let ran = scratch.run("lamp check stray.tif").succeeds_quietly();
    let text = String::from_utf8(ran.stdout).unwrap();
    let first = text.lines().skip(1).find(|line| !line.starts_with("  note: ")).unwrap();
    assert!(first.starts_with("  stray rows: layer 120 (z 12.00 mm): 2, which"), "{text}");
}

#[test]
fn threads_and_memory_change_no_byte() {
    let scratch = Scratch::new();
    scratch.part("blade.stl", Sample::Blade, 24_000);
    let mut reports = Vec::new();
    for options in ["--threads 1", "--threads 3", "--memory 16MB"] {
        let line = format!(
            "lamp check blade.stl --dpi 200 --rotate y:90 --drain 1mm --report r.json --force {options}"
        );
        let ran = scratch.run(&line).succeeds_quietly();
        reports.push((ran.stdout, scratch.bytes("r.json")));
    }
    assert!(reports.iter().all(|report| *report == reports[0]));
}

#[test]
fn a_chamber_behind_a_narrow_hole_drains_through_it_only_if_that_may_be_narrow() {
    let scratch = with("core.stl", &lamp_fixtures::cavity_core(2000));
    let narrow = |drain: &str| {
        let line = format!("lamp check core.stl {SLICE} --only pockets --report d.json {drain}");
        scratch.run(&line).succeeds_quietly();
        let report = report(&scratch, "d.json");
        of_kind(&report, "narrow").len()
    };
    // The gate is 2 x 2 mm.
    assert_eq!(["", "--drain 1.9mm", "--drain 2.2mm"].map(narrow), [0, 0, 1]);
    // A channel in which no such ball fits is no room.
    scratch.mesh("core.stl", &serpentine(2000));
    assert_eq!(narrow("--drain 3mm"), 0);
}

#[test]
fn minima_that_pixels_miss_and_islands_that_the_mesh_lacks_are_told() {
    // No center of a pixel of 5 mm lies in the needle, which is 4 mm wide.
    let scratch = with("needle.stl", &needle(2000));
    let frame = "--dpi 5.08 --origin -50,50 --size 100x100mm";
    let line = format!("lamp check needle.stl {frame} --only islands --speck 0 --report n.json");
    scratch.run(&line).succeeds_quietly();
    let found = report(&scratch, "n.json");
    let [lone] = of_kind(&found, "minimum-without-island")[..] else { panic!("{found}") };
    assert_eq!(lone["z_mm"], 10.0);
    assert!(of_kind(&found, "island").is_empty());
    let ran = scratch.run(&format!("lamp check needle.stl {SLICE} --only islands --report n.json"));
    ran.succeeds_quietly();
    let found = report(&scratch, "n.json");
    assert_eq!(of_kind(&found, "island").len(), 1);
    assert!(of_kind(&found, "minimum-without-island").is_empty());
    // A wall that leans by more than its thickness in a layer falls apart into islands.
    scratch.mesh("wall.stl", &slanted_wall(0.5, 1.0, 200));
    scratch
        .run("lamp check wall.stl --dpi 254 --thickness 1mm --only islands --report w.json")
        .succeeds_quietly();
    let found = report(&scratch, "w.json");
    let islands = of_kind(&found, "island").len();
    assert!(islands > 10 && of_kind(&found, "island-without-minimum").len() == islands, "{found}");
}

#[test]
fn a_body_upon_another_begins_no_island() {
    // A cup stands on a block; they share no vertex.
    let (mut both, cup) = (closed_void(200), cup(200));
    let lifted = |corner: [f32; 3]| [0.7 * corner[0], 0.7 * corner[1], corner[2] + 12.0];
    both.facets.extend(cup.facets.iter().map(|facet| facet.map(lifted)));
    let scratch = with("both.stl", &both);
    scratch.run(&format!("lamp check both.stl {SLICE} --only islands --strict")).succeeds_quietly();
}

/// The sample blade at 1500 dpi and 100 um: layers where islands begin and join.
#[test]
fn islands_of_the_sample_blade_begin_at_its_minima() {
    let scratch = Scratch::new();
    scratch.mesh("blade.stl", &build(Sample::Blade, 100_000).unwrap());
    for (rotate, expected) in [
        ("x:0", &[][..]),
        ("x:180", &[(80, 312), (150, 262)]),
        ("y:90", &[(436, 458), (300, 346), (347, 348)]),
        ("x:30", &[(1124, 1153)]),
    ] {
        let line = format!(
            "lamp check blade.stl --rotate {rotate} --only islands --speck 50um --report b.json"
        );
        scratch.run(&line).succeeds_quietly();
        let found = report(&scratch, "b.json");
        let layers = |it: &Value| (it["layer"].as_u64().unwrap(), it["joins"].as_u64().unwrap());
        let islands: Vec<_> = of_kind(&found, "island").into_iter().map(layers).collect();
        assert_eq!(islands, expected, "{rotate}");
        assert_eq!(
            found["findings"].as_array().unwrap().len(),
            expected.len(),
            "{rotate}: {found}"
        );
    }
}

#[test]
fn builds_and_adaptive_layers_are_checked() {
    let scratch = with("mug.stl", &mug(4000));
    let tile = "tile --area 80x40mm --copies 2 --mesh none -o build.tif";
    scratch.run(&format!("slice mug.stl {SLICE} | {tile}")).succeeds();
    let heights = "--adaptive --min 25um --max 200um --cusp 20um";
    scratch.run(&format!("slice mug.stl --dpi 254 {heights} -o adaptive.tif")).succeeds();
    scratch
        .run("lamp check build.tif adaptive.tif --only islands,pockets --report b.json")
        .succeeds();
    let found = report(&scratch, "b.json");
    let of = |input: u64, kind: &str| -> Vec<f64> {
        let found = of_kind(&found, kind).into_iter();
        found.filter(|it| it["input"] == input).map(|it| it["z_mm"].as_f64().unwrap()).collect()
    };
    // Each part of a build is judged once.
    assert_eq!(of(0, "island"), [8.0]);
    assert_eq!(of(0, "cup").len(), 1);
    let [z] = of(1, "island")[..] else { panic!("{found}") };
    assert!((7.79..=8.0).contains(&z), "{z}");
    let volume = of_kind(&found, "island").into_iter().find(|it| it["input"] == 1).unwrap();
    assert!((volume["floating_mm3"].as_f64().unwrap() / 54.0 - 1.0).abs() < 0.03, "{volume}");
}

#[test]
fn several_inputs_are_checked_each_on_its_own() {
    let scratch = with("cup.stl", &cup(200));
    scratch.mesh("ring.stl", &ring(2000));
    scratch.run(&format!("slice cup.stl {SLICE} -o cup.tif")).succeeds_quietly();
    let line = format!("lamp check cup.tif ring.stl {SLICE} --report all.json --evidence pictures");
    let ran = scratch.run(&line).succeeds_quietly();
    let text = String::from_utf8(ran.stdout).unwrap();
    assert!(text.contains("cup.tif: 120 layers") && text.contains("ring.stl: "), "{text}");
    let found = report(&scratch, "all.json");
    assert_eq!(of_kind(&found, "cup")[0]["input"], 0);
    assert_eq!(of_kind(&found, "island")[0]["input"], 1);
    assert!(scratch.path("pictures/check_01_01_cup_layer_00020.png").exists());
    assert!(scratch.path("pictures/check_02_01_island_layer_00100.png").exists());
}

#[test]
fn what_cannot_be_checked_is_refused_in_a_sentence() {
    let scratch = Scratch::new();
    let mut layers = squares(&[[1, 9], [1, 9]]);
    layers[1].image = Mask::black(12, 10).into();
    scratch.stack("sizes.tif", layers);
    scratch.run("lamp check sizes.tif").is_refused_with(&["sizes.tif", "layer 1", "12 x 10"]);
    let mut layers = squares(&[[1, 9], [1, 9]]);
    layers.iter_mut().for_each(|layer| layer.info.thickness_um = None);
    scratch.stack("bare.tif", layers);
    scratch.run("lamp check bare.tif --drain 1mm").is_refused_with(&["bare.tif", "thick"]);
    scratch.run("lamp check bare.tif").succeeds_quietly();
    scratch.write("nan.stl", b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex nan 1 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid\n");
    scratch.run("lamp check nan.stl").is_refused_with(&["nan.stl", "facet 0"]);
    scratch.write("empty.stl", b"");
    scratch.run("lamp check empty.stl").is_refused_with(&["empty.stl", "empty"]);
    scratch.run("lamp check nothing.tif").is_refused_with(&["nothing.tif"]);
    scratch.run("lamp check - -").is_wrong_usage(&["once"]);
    for line in ["lamp check bare.tif --dpi 300", "lamp view bare.tif --thickness 50um"] {
        let option = line.split(' ').nth(3).unwrap();
        scratch.run(line).is_wrong_usage(&["bare.tif is a stack", option]);
    }
    scratch.run("lamp check a.tif --only rings").is_wrong_usage(&["rings"]);
    scratch.run("lamp check a.tif --least-support 130%").is_wrong_usage(&["130%"]);
}

#[test]
fn a_build_is_judged_by_one_copy_of_each_part() {
    let scratch = Scratch::new();
    scratch.part("mug.stl", Sample::Mug, 2_000);
    scratch.run("slice mug.stl --dpi 150 --thickness 500um -q -o mug.tif").succeeds();
    let tile = "tile mug.tif --area 110x110mm --copies 4";
    scratch.run(&format!("{tile} -o build.tif")).succeeds();
    let report = |stack: &str| -> serde_json::Value {
        scratch.run(&format!("lamp check {stack} --report r.json --verbose")).succeeds();
        serde_json::from_slice(&scratch.bytes("r.json")).unwrap()
    };
    let kinds = |report: &serde_json::Value| -> Vec<String> {
        let features = report["features"].as_array().unwrap();
        let kind = |feature: &serde_json::Value| {
            let finding = &report["findings"][feature["finding"].as_u64().unwrap() as usize];
            finding["kind"].as_str().unwrap().to_owned()
        };
        features.iter().map(kind).collect()
    };
    let (part, build) = (report("mug.tif"), report("build.tif"));
    assert!(kinds(&part).contains(&"cup".to_owned()), "{part}");
    assert_eq!(kinds(&build), kinds(&part));
    for finding in build["findings"].as_array().unwrap() {
        assert_eq!((&finding["part"], &finding["copies"]), (&"mug".into(), &4.into()));
    }
    // The same volume, five layers of mesh higher.
    let cup = |report: &serde_json::Value| {
        let cup = report["findings"].as_array().unwrap().iter().find(|it| it["kind"] == "cup");
        let cup = cup.unwrap();
        [&cup["volume_px"], &cup["layer"]].map(|number| number.as_u64().unwrap())
    };
    let [[volume, layer], of_build] = [cup(&part), cup(&build)];
    assert_eq!(of_build, [volume, layer + 5]);
    // Without the layers of mesh below, copies stand as they are, and a note says so.
    let range = scratch.run("lamp check build.tif --layers 8..").succeeds();
    let text = String::from_utf8(range.stdout).unwrap();
    assert!(text.contains("\n  note: each copy and the build mesh were checked"), "{text}");
    // What a person has seen is left out, and the rest is not.
    let seen = scratch.run("lamp check build.tif --accept r.json --strict").succeeds();
    let line = String::from_utf8(seen.stdout).unwrap();
    assert!(line.contains("no findings") && line.contains(" accepted"), "{line}");
    let one = "lamp check build.tif --only islands --report one.json";
    scratch.run(one).succeeds();
    let new = scratch.run("lamp check build.tif --accept one.json --only islands,pockets --strict");
    assert_eq!(new.statuses, [Some(3)], "{new:?}");
    scratch.run("lamp check build.tif --accept mug.tif").is_refused_with(&["mug.tif"]);
    // A copy that lacks a few pixels in a layer is named.
    let mut layers = scratch.layers("build.tif");
    let parts = layers[0].info.stack.as_ref().unwrap().built_parts().unwrap();
    let [left, top] = parts.map(Result::unwrap).next().unwrap().copies[2];
    let broken = &mut layers[20];
    let mask = broken.image.exposed().into_owned();
    let (mut rows, mut changed) = (lamp_stack::MaskBuilder::new(mask.width()), 0);
    for row in 0..mask.height() {
        let mut transitions = mask.row(row).to_vec();
        let within = transitions.iter().position(|&column| i64::from(column) >= left);
        if let Some(at) = within.filter(|_| i64::from(row) == top + 40) {
            transitions[at] += 3;
            changed += 1;
        }
        rows.push_row(&transitions).unwrap();
    }
    assert_eq!(changed, 1);
    broken.image = rows.finish().into();
    scratch.stack("broken.tif", layers);
    let broken = report("broken.tif");
    let copy =
        broken["findings"].as_array().unwrap().iter().find(|it| it["kind"] == "copy-differs");
    let copy = copy.unwrap();
    assert_eq!((&copy["copy"], &copy["differing_px"]), (&3.into(), &3.into()), "{copy}");
    assert_eq!((&copy["layer"], &copy["last_layer"]), (&20.into(), &20.into()));
    // A plain part on a build with a mesh has no findings.
    scratch.part("cube.stl", Sample::Cube, 100);
    scratch.run("slice cube.stl --dpi 150 --thickness 500um -q -o cube.tif").succeeds();
    scratch.run("tile cube.tif --area 80x80mm --copies 4 -o cubes.tif").succeeds();
    scratch.run("lamp check cubes.tif --strict").succeeds();
}

/// Layers of a plan cure by the light of each other.
#[test]
fn bonds_of_planned_layers_are_not_judged_one_by_one() {
    let scratch = Scratch::new();
    scratch.stack("stairs.tif", lamp_fixtures::cavity_staircase(1).layers());
    let plan = "lamp plan speed stairs.tif --material pegda-sudan --search-gap 5% -q -o timed.tif";
    scratch.run(plan).succeeds();
    let ran = scratch.run("lamp check timed.tif --material pegda-sudan --only rules");
    let text = String::from_utf8(ran.stdout).unwrap();
    assert!(!text.contains("weak bond"), "{text}");
    assert!(text.contains("not checked: bonds; layers are lit that cure only with"), "{text}");
}

/// Design rules of light need the resin: of the stack's record, or of an option; or a note names them.
#[test]
fn rules_of_light_take_the_resin_of_the_stack() {
    let scratch = with("mug.stl", &mug(400));
    let check = |line: &str| {
        let ran = scratch.run(&format!("lamp check {line} --only rules"));
        assert_eq!(ran.statuses, [Some(0)], "{line}");
        String::from_utf8(ran.stdout).unwrap()
    };
    scratch.run(&format!("slice mug.stl {SLICE} -o plain.tif")).succeeds_quietly();
    let unchecked = "note: design rules were not checked: closes, bonds; no resin is known";
    assert!(check("plain.tif").contains(unchecked));
    assert!(check(&format!("mug.stl {SLICE}")).contains(unchecked));
    for (overcure, is_weak) in [(0.9, true), (1.0, true), (1.2, false)] {
        let resin = format!("--material lamp-suspension --overcure {overcure}");
        let ran = scratch.run(&format!("slice mug.stl {SLICE} {resin} -o of_resin.tif --force"));
        assert_eq!(ran.statuses, [Some(0)]);
        for line in [
            format!("mug.stl {SLICE} {resin}"),
            format!("plain.tif {resin}"),
            "of_resin.tif".to_owned(),
        ] {
            let text = check(&line);
            let has_line = text.contains("weak bond: layers 0 to 299");
            assert_eq!(has_line, is_weak, "{line}: {text}");
            // This resin states no cure widths.
            let note =
                "note: design rules were not checked: closes; lamp-suspension states no cure width";
            assert!(text.contains(note), "{line}: {text}");
        }
    }
}

const RULES: &str = "name = 'wide'
description = 'it'
[[slot]]
name = 'closes'
cure-widths = 2
source = 'it'
[[bond]]
name = 'bonds'
source = 'it'
";

/// Cures 200 um deep at 738.9 mJ/cm2, where edges grow by 319.5 um.
const RESIN: &str = r#"name = "mine"
description = "cures wide"
[intensity]
value = "100 mW/cm2"
source = "page 1"
[working-curve]
critical-dose = { value = "100 mJ/cm2", source = "page 1" }
penetration-depth = { value = "100 um", source = "page 1" }
[[cure-width]]
feature-size = "1 mm"
critical-dose = { value = "100 mJ/cm2", source = "page 1" }
sensitivity = { value = "0.5 um/(mJ/cm2)", source = "page 1" }
"#;

/// A slot closes if it is narrower than twice the growth of edges at its layer's exposure time.
#[test]
fn slots_close_by_the_exposure_of_their_layers() {
    let scratch = Scratch::new();
    scratch.write("mine.toml", RESIN.as_bytes());
    scratch.write("rules.toml", RULES.as_bytes());
    // Slots 400 um and 1000 um wide.
    let comb = drawn_mask([60, 40], |[x, y]| {
        let is_slot = (20.0..24.0).contains(&x) || (36.0..46.0).contains(&x);
        (5.0..55.0).contains(&x)
            && (5.0..35.0).contains(&y)
            && !(is_slot && (10.0..30.0).contains(&y))
    });
    for (ms, closed) in [(Some(7389.0), 1), (Some(3000.0), 0), (Some(14_000.0), 2), (None, 0)] {
        let layer = |index: u32| {
            let info = PageInfo {
                index,
                z_um: Some(f64::from(index) * 100.0),
                thickness_um: Some(100.0),
                exposure_ms: ms,
                ..PageInfo::default()
            };
            Layer { info, pitch: Pitch::of_dpi(254.0), image: comb.clone().into() }
        };
        scratch.stack("comb.tif", (0..20).map(layer));
        scratch.run("lamp check comb.tif --material mine.toml --rules rules.toml --report r.json --force").succeeds_quietly();
        let found = report(&scratch, "r.json");
        let slots = of_kind(&found, "slot");
        assert_eq!(slots.len(), closed, "{ms:?}: {found}");
        assert!(slots.iter().all(|slot| slot["rule"] == "closes"));
        // Without a time, the dose just cures a layer, and bonds nothing.
        assert_eq!(of_kind(&found, "weak-bond").len(), usize::from(ms.is_none()));
    }
}
