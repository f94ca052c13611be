//! Checks what `lamp plan simulate` says of bitmaps and discs, and which targets, projectors and
//! folders it refuses.

use lamp_fixtures::{Facet, Mesh};
use lamp_stack::{Image, Layer, Mask, MaskBuilder, PageInfo};
use lamp_tests::{Scratch, ask, mask};
use serde_json::Value;

const ZHAO: &str = "--projector zhao --material pegda-mw700";
const DISCS: &str = "40:60s,30:20s,5-20:30s";

fn simulate(scratch: &Scratch, bitmaps: &str, more: &str) -> lamp_tests::Ran {
    scratch.run(&format!("lamp plan simulate {bitmaps} --model column {ZHAO} {more}"))
}

fn report(scratch: &Scratch, folder: &str) -> Value {
    serde_json::from_slice(&scratch.bytes(&format!("{folder}/report.json"))).unwrap()
}

#[test]
fn discs_and_the_stack_written_of_them_cure_the_same() {
    let scratch = Scratch::new();
    let typed = simulate(&scratch, DISCS, "--target small-sphere -o typed").succeeds();
    assert!(typed.stderr.contains("in 110.0 s 3 bitmaps cure up to"), "{}", typed.stderr);
    assert!(typed.stderr.contains("lower than 180um"), "{}", typed.stderr);
    let read = simulate(&scratch, "typed/bitmaps.tif", "--target small-sphere -o read").succeeds();
    assert_eq!(typed.stderr, read.stderr);
    let [mut a, b] = ["typed", "read"].map(|folder| report(&scratch, folder));
    assert_eq!(a["schema"], "lamp-simulation-1");
    assert_eq!(a["exposure_s"], 110.0);
    a["bitmaps"] = b["bitmaps"].clone();
    assert_eq!(a, b);
    for file in ["section.svg", "residual.png", "times.png"] {
        let [a, b] = ["typed", "read"].map(|folder| scratch.bytes(&format!("{folder}/{file}")));
        assert!(a == b, "{file}");
    }
    let one = simulate(&scratch, DISCS, "--target small-sphere -o one --threads 1");
    one.succeeds();
    for file in ["bitmaps.tif", "report.json", "residual.png"] {
        let [a, b] = ["typed", "one"].map(|folder| scratch.bytes(&format!("{folder}/{file}")));
        assert!(a == b, "{file}");
    }
}

#[test]
fn bitmaps_are_stacks_that_lamp_info_and_libtiff_read() {
    let scratch = Scratch::new();
    simulate(&scratch, DISCS, "-o cured").succeeds();
    let layers = scratch.layers("cured/bitmaps.tif");
    let times: Vec<_> = layers.iter().map(|layer| layer.info.exposure_ms.unwrap()).collect();
    assert_eq!(times, [60_000.0, 20_000.0, 30_000.0]);
    // Discs of 40 and 30 mirrors, and a ring.
    let near = |layer: &Layer, mirrors: f64| {
        let white = mask(layer).white_pixels() as f64;
        (white / (std::f64::consts::PI * mirrors) - 1.0).abs() < 0.01
    };
    assert!(near(&layers[0], 1600.0) && near(&layers[1], 900.0) && near(&layers[2], 375.0));
    let info =
        String::from_utf8(scratch.run("lamp info cured/bitmaps.tif").succeeds_quietly().stdout);
    assert!(info.unwrap().contains("110.0 s in all"));
    scratch.run("lamp verify cured/bitmaps.tif").succeeds();
    if let Some(said) = ask(&scratch, "tiffinfo", &["cured/bitmaps.tif"]) {
        assert_eq!(said.matches("Image Width: 1024 Image Length: 768").count(), 3, "{said}");
        assert!(said.contains(r#""exposure_ms":60000"#), "{said}");
    }
}

#[test]
fn twice_the_time_and_gray_levels_are_the_doses_that_they_say() {
    let scratch = Scratch::new();
    let highest = |folder: &str| report(&scratch, folder)["cured"]["highest_um"].as_f64().unwrap();
    // Straight, for PEGDA's curve: twice the dose above the critical one.
    for (folder, bitmaps) in [("a", "40:60s"), ("b", "40:120s"), ("c", "40:60s,40:60s")] {
        simulate(&scratch, bitmaps, &format!("-o {folder}")).succeeds();
    }
    let [a, b, c] = ["a", "b", "c"].map(highest);
    assert!((b - c).abs() < 1e-9, "{b} {c}");
    let liquid_um = 302.825_3;
    assert!(((b + liquid_um) / (a + liquid_um) - 2.0).abs() < 1e-3, "{a} {b}");
}

#[test]
fn a_plan_cures_what_its_report_says() {
    let scratch = Scratch::new();
    let plan = format!("lamp plan column-cure lens-array {ZHAO}");
    scratch.run(&format!("{plan} -o plan/")).succeeds();
    scratch.run(&format!("{plan} --gray --bitmaps 5 -o gray/")).succeeds();
    for folder in ["plan", "gray"] {
        let line = format!("--target lens-array -o {folder}-cured");
        simulate(&scratch, &format!("{folder}/bitmaps.tif"), &line).succeeds();
        let planned = report(&scratch, folder)["bitmaps"]["measures"].clone();
        let cured = report(&scratch, &format!("{folder}-cured"))["measures"].clone();
        for (measure, planned) in planned.as_object().unwrap() {
            let [planned, cured] = [planned, &cured[measure]].map(|it| it.as_f64().unwrap());
            assert!((planned - cured).abs() < 1e-6, "{folder}, {measure}: {planned} {cured}");
        }
    }
}

/// A stack of one page.
fn page(scratch: &Scratch, name: &str, image: Mask, exposure_ms: Option<f64>) {
    let info = PageInfo { exposure_ms, ..PageInfo::default() };
    scratch.stack(name, [Layer { info, pitch: None, image: Image::Mask(image).into() }]);
}

#[test]
fn bitmaps_that_no_display_shows_are_refused() {
    let scratch = Scratch::new();
    page(&scratch, "silent.tif", Mask::black(8, 8), None);
    page(&scratch, "short.tif", Mask::black(8, 8), Some(0.5));
    let mut wide = MaskBuilder::new(1025);
    wide.push_black(8);
    page(&scratch, "wide.tif", wide.finish(), Some(5.0));
    for (bitmaps, words) in [
        ("silent.tif", ["layer 0", "does not state how long"]),
        ("short.tif", ["bitmap 1 is shown for 0.5 ms", "step is 1 ms"]),
        ("wide.tif", ["1025 x 8 pixels", "1024 x 768"]),
        ("none.tif", ["none.tif", "No such file"]),
        ("40:60s,40:1e300s", ["bitmap 2 is shown", "more than a day"]),
        ("40:0.1ms", ["bitmap 1 is shown for 0.1 ms", "step is 1 ms"]),
    ] {
        simulate(&scratch, bitmaps, "-o cured").is_refused_with(&words);
        assert!(!scratch.path("cured").exists());
    }
    for (bitmaps, words) in [
        ("40:60", ["`40:60` is neither a disc nor a ring", "12:7.9s"]),
        ("385:1s", ["385:1s", "reaches 384 mirrors"]),
        ("20-10:1s", ["neither a disc nor a ring", "5-12:7.9s"]),
    ] {
        simulate(&scratch, bitmaps, "-o cured").is_wrong_usage(&words);
    }
}

/// The facets of a box in millimeters, counter-clockwise seen from outside.
fn block(at: [f32; 3], size: [f32; 3]) -> impl Iterator<Item = Facet> {
    const SIDES: [[usize; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let corner = move |number: usize| {
        std::array::from_fn(|axis| at[axis] + size[axis] * (number >> axis & 1) as f32)
    };
    let halves = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]];
    SIDES.into_iter().flat_map(halves).map(move |half| half.map(corner))
}

/// A 16-bit height map of 2 x 2 pixels, all white.
fn white_png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(&[255; 8]).unwrap();
    bytes
}

fn part(scratch: &Scratch, name: &str, blocks: &[([f32; 3], [f32; 3])]) {
    let facets = blocks.iter().flat_map(|&(at, size)| block(at, size)).collect();
    scratch.mesh(name, &Mesh { facets });
}

#[test]
fn targets_that_light_cannot_cure_are_refused_with_the_place() {
    let scratch = Scratch::new();
    part(
        &scratch,
        "bridge.stl",
        &[([0.0; 3], [2.0, 1.0, 0.2]), ([0.5, 0.0, 0.4], [1.0, 1.0, 0.1])],
    );
    part(&scratch, "step.stl", &[([0.0; 3], [1.0, 1.0, 0.2]), ([1.0, 0.0, 0.05], [1.0, 1.0, 0.2])]);
    part(&scratch, "wide.stl", &[([0.0; 3], [30.0, 1.0, 0.2])]);
    scratch.write("nothing.toml", b"name = 'a'\ndescription = 'b'\n");
    scratch.write(
        "nan.toml",
        b"name = 'a'\ndescription = 'b'\n[[lens]]\ndiameter = '1mm'\nsag = 'nanum'\n",
    );
    scratch.write(
        "ball.toml",
        b"name = 'a'\ndescription = 'b'\n[[lens]]\ndiameter = '1mm'\nsag = '0.6mm'\n",
    );
    scratch.write("map.png", &white_png());
    scratch.write("cut.png", &white_png()[..40]);
    scratch.write("junk.stl", b"junk");
    for (target, words) in [
        ("bridge.stl", &["bridge.stl", "(x -495um, y 495um) is empty from 200um to 400um"][..]),
        ("step.stl", &["(x 5um, y 495um) begins 50um above", "bottom must be flat"]),
        ("wide.stl", &["30mm x 1mm wide", "lights 28.54"]),
        ("nothing.toml", &["nothing.toml", "nothing to cure"]),
        ("nan.toml", &["line 5", "lens[0].sag", "not a length"]),
        ("ball.toml", &["lens 1: sag 600um", "overhang"]),
        ("map.png", &["map.png", "height map", "--pixel", "--full"]),
        ("cut.png --pixel 10um --full 1mm", &["cut.png", "not a complete PNG"]),
        ("map.png --pixel 20mm --full 1mm", &["40mm x 40mm wide"]),
        ("junk.stl", &["junk.stl"]),
        ("nobody", &["nobody: there is no such file, nor a built-in target", "lens-array"]),
    ] {
        let line = format!("--target {target} -o cured");
        simulate(&scratch, "40:60s", &line).is_refused_with(words);
        assert!(!scratch.path("cured").exists());
    }
    for (more, words) in [
        ("--target sphere --pixel 1um --full 1um", "--pixel and --full are for height maps"),
        ("--target sphere --pixel 1um", "--full"),
        ("--pixel 1um --full 1um", "--target"),
        ("--force", "--output"),
        ("--rays 9x", "write 9x15"),
    ] {
        simulate(&scratch, "40:60s", more).is_wrong_usage(&[words]);
    }
}

#[test]
fn targets_of_all_kinds_are_compared_alike() {
    let scratch = Scratch::new();
    // A plate of 1 x 1 mm and 0.2 mm.
    part(&scratch, "plate.stl", &[([3.0, 2.0, 1.0], [1.0, 1.0, 0.2])]);
    scratch.write(
        "plate.toml",
        b"name = 'plate'\ndescription = 'a'\n[[base]]\nsize = '1x1mm'\nheight = '200um'\n",
    );
    scratch.write("plate.png", &white_png());
    let measures = |target: &str, folder: &str| {
        simulate(&scratch, "20:60s", &format!("--target {target} -o {folder}")).succeeds();
        report(&scratch, folder)["measures"].clone()
    };
    let shapes = measures("plate.toml", "a");
    assert_eq!(shapes, measures("plate.png --pixel 500um --full 200um", "c"));
    let part = measures("plate.stl", "b");
    let [of_shapes, of_part] = [shapes, part].map(|measures| measures["ra_um"].as_f64().unwrap());
    assert!((of_shapes - of_part).abs() < 1e-4, "{of_shapes} {of_part}");
}

#[test]
fn a_folder_is_replaced_only_if_asked_and_if_a_plan_is_in_it() {
    let scratch = Scratch::new();
    simulate(&scratch, "40:60s", "-o cured").succeeds();
    let before = scratch.bytes("cured/bitmaps.tif");
    let again = simulate(&scratch, "30:60s", "-o cured");
    again.is_refused_with(&["cured", "--force replaces"]);
    assert!(scratch.bytes("cured/bitmaps.tif") == before);
    simulate(&scratch, "30:60s", "-o cured --force").succeeds();
    assert!(scratch.bytes("cured/bitmaps.tif") != before);
    scratch.write("cured/thesis.txt", b"mine");
    simulate(&scratch, "30:60s", "-o cured --force").is_refused_with(&["cured", "thesis.txt"]);
    assert_eq!(scratch.bytes("cured/thesis.txt"), b"mine");
}
