//! Checks that bodies of one file unite, also where they overlap, touch or enclose each
//! other, in images of every kind.

use lamp_fixtures::StepBody::{Ball, Block, Hollow};
use lamp_fixtures::{
    StepBody, StepSample, StepUnit, sphere, step, step_bodies, three_mf, three_mf_model,
};
use lamp_stack::Layer;
use lamp_tests::{Scratch, differing, mask, masks};

/// Pixels of 0.1 mm, which no side of a block goes through the middle of.
const LINE: &str = "--dpi 254 --thickness 100um --quiet";

/// A folder with bodies as `part.step`, and as an STL.
fn with(bodies: &[(&str, StepBody)]) -> Scratch {
    let scratch = Scratch::new();
    scratch.write("part.step", step_bodies(bodies).as_bytes());
    scratch.run("lamp convert part.step part.stl --chord 1um").succeeds();
    scratch
}

fn slice(scratch: &Scratch, words: &str) -> Vec<Layer> {
    scratch.run(&format!("slice {words} {LINE} -o out.tif --force")).succeeds();
    scratch.layers("out.tif")
}

/// Returns the area of each layer, in square millimeters.
fn areas_mm2(layers: &[Layer]) -> Vec<f64> {
    layers.iter().map(|layer| mask(layer).white_pixels() as f64 / 100.0).collect()
}

/// Returns what `slice` says.
fn said(scratch: &Scratch, words: &str) -> String {
    let line = format!("slice part.step --dpi 254 --thickness 100um {words} -o said.tif --force");
    scratch.run(&line).succeeds().stderr
}

fn block(low: [f64; 3], high: [f64; 3]) -> StepBody {
    Block([low, high])
}

/// Two blocks that share 1 x 2 x 0.5 mm.
fn overlapping() -> [(&'static str, StepBody); 2] {
    [("can", block([0.0; 3], [2.0, 2.0, 1.0])), ("foot", block([1.0, 0.0, 0.5], [3.0, 2.0, 1.5]))]
}

#[test]
fn overlapping_bodies_unite_unless_they_are_to_cancel_out() {
    let scratch = with(&overlapping());
    let united = areas_mm2(&slice(&scratch, "part.step"));
    assert_eq!(united, [[4.0; 5], [6.0; 5], [4.0; 5]].concat());
    let apart = areas_mm2(&slice(&scratch, "part.step --fill even-odd --bodies xor"));
    assert_eq!(apart, [[4.0; 5], [4.0; 5], [4.0; 5]].concat());
    let text = said(&scratch, "");
    let shared = "bodies 1 (can) and 2 (foot) overlap by 1 mm³: ";
    assert!(text.contains(shared) && text.contains("they unite"), "{text}");
    // Only the layers that are made count.
    let text = said(&scratch, "--layers 5..7");
    assert!(text.contains("(foot) overlap by 0.4 mm³"), "{text}");
    let text = said(&scratch, "--fill even-odd --bodies xor --quiet");
    assert!(text.contains(shared) && text.contains("cancels out"), "{text}");
    assert_eq!(said(&scratch, "--quiet --strict"), "");
    let ran = scratch
        .run(&format!("slice part.step {LINE} --fill even-odd --bodies xor --strict -o no.tif"));
    assert!(ran.statuses == [Some(3)] && ran.stderr.contains(shared), "{ran:?}");
    assert!(!scratch.path("no.tif").exists());
    scratch
        .run(&format!("slice part.step {LINE} --bodies xor -o no.tif"))
        .is_wrong_usage(&["--bodies xor is for --fill even-odd"]);
}

#[test]
fn the_stack_records_bodies_that_cancel_out() {
    let scratch = with(&overlapping());
    for (words, recorded) in [("", ""), ("--bodies unite", ""), ("--bodies xor", " --bodies xor")] {
        let layers = slice(&scratch, &format!("part.step --fill even-odd {words}"));
        let command = &layers[0].info.stack.as_ref().unwrap().commands[0];
        let options = format!("--units mm --fill even-odd{recorded} --margin 1");
        assert!(command.ends_with(&options), "{command}");
    }
}

/// Side by side, on top of each other, and both: no seam, no hole, and nothing to say.
#[test]
fn touching_bodies_neither_vanish_nor_overlap() {
    let scratch = with(&[
        ("left", block([0.0; 3], [1.0, 2.0, 1.0])),
        ("right", block([1.0, 0.0, 0.0], [2.0, 2.0, 1.0])),
        ("lid", block([0.0, 0.0, 1.0], [2.0, 2.0, 2.0])),
    ]);
    let layers = slice(&scratch, "part.step");
    assert_eq!(areas_mm2(&layers), [4.0; 20]);
    assert!(
        masks(&layers).iter().all(|mask| (0..mask.height()).all(|row| mask.row(row).len() < 3))
    );
    assert_eq!(said(&scratch, ""), "");
    let gray = slice(&scratch, "part.step --gray --material lamp-suspension");
    assert_eq!(areas_mm2(&gray), [4.0; 20]);
}

#[test]
fn a_body_inside_another_is_no_hole_but_a_void_is() {
    let (outer, inner) = ([[0.0; 3], [3.0, 3.0, 3.0]], [[1.0; 3], [2.0; 3]]);
    let height = |at: f64| [vec![9.0; 10], vec![at; 10], vec![9.0; 10]].concat();
    let nested = with(&[("outer", Block(outer)), ("inner", Block(inner))]);
    assert_eq!(areas_mm2(&slice(&nested, "part.step")), height(9.0));
    assert_eq!(areas_mm2(&slice(&nested, "part.step --fill even-odd --bodies xor")), height(8.0));
    assert!(said(&nested, "").contains("1 (outer) and 2 (inner) overlap by 1 mm³"));
    // An STL knows no bodies: by even-odd, a shell in another is a cavity.
    assert_eq!(areas_mm2(&slice(&nested, "part.stl")), height(9.0));
    assert_eq!(areas_mm2(&slice(&nested, "part.stl --fill even-odd")), height(8.0));
    let hollow = with(&[("hollow", Hollow(outer, inner))]);
    assert_eq!(areas_mm2(&slice(&hollow, "part.step")), height(8.0));
    assert_eq!(said(&hollow, ""), "");
    let core = block([1.2; 3], [1.8; 3]);
    let filled = with(&[("hollow", Hollow(outer, inner)), ("core", core)]);
    let areas = areas_mm2(&slice(&filled, "part.step"));
    assert_eq!((areas[10], areas[15]), (8.0, 8.36));
    assert_eq!(said(&filled, ""), "");
}

#[test]
fn the_same_body_twice_is_itself() {
    let ball = Ball { centre: [0.0; 3], radius: 2.0 };
    let once = slice(&with(&[("ball", ball)]), "part.step");
    let twice = slice(&with(&[("ball", ball), ("ball", ball)]), "part.step");
    assert_eq!(masks(&once), masks(&twice));
}

/// A chain of twelve balls, each of which reaches into the next.
#[test]
fn twelve_bodies_unite_on_their_surfaces() {
    let ball = |k: u32| Ball { centre: [3.0 * f64::from(k), 0.0, 0.0], radius: 2.0 };
    let bodies: Vec<(&str, StepBody)> = (0..12).map(|k| ("", ball(k))).collect();
    let scratch = with(&bodies);
    let layers = slice(&scratch, "part.step");
    for (layer, mask) in layers.iter().zip(masks(&layers)) {
        let [left, top] = layer.info.origin_mm.unwrap();
        let z = -2.0 + 0.1 * f64::from(layer.info.index + 1);
        for (row, column) in (0..mask.height()).flat_map(|r| (0..mask.width()).map(move |c| (r, c)))
        {
            let at = |k: u32| 0.1 * (f64::from(k) + 0.5);
            let (x, y) = (left + at(column), top - at(row));
            let nearest = (x / 3.0).round().clamp(0.0, 11.0) * 3.0;
            let depth = 4.0 - (x - nearest).powi(2) - y * y - z * z;
            if depth.abs() > 1e-6 {
                assert_eq!(mask.is_white(column, row), depth > 0.0, "{x} {y} {z}");
            }
        }
    }
    // A lens of two caps, 0.5 mm high.
    let lens = 2.0 * std::f64::consts::PI * 0.25 / 3.0 * (6.0 - 0.5);
    let text = said(&scratch, "");
    let volume = |from: &str| -> f64 {
        let rest = &text[text.find(from).unwrap() + from.len()..];
        rest.split(' ').next().unwrap().parse().unwrap()
    };
    assert!((volume(" overlap by ") / lens - 1.0).abs() < 0.02, "{lens}: {text}");
    assert!((volume(" and 10 other pairs by ") / lens / 10.0 - 1.0).abs() < 0.02, "{lens}: {text}");
}

#[test]
fn a_core_of_another_file_cuts_united_bodies() {
    let scratch = with(&overlapping());
    scratch.write("core.step", step_bodies(&[("", block([0.5; 3], [2.5, 1.5, 1.0]))]).as_bytes());
    for cut in ["part.step core.step --fill even-odd", "part.step --subtract core.step"] {
        let areas = areas_mm2(&slice(&scratch, cut));
        assert_eq!(areas, [[4.0; 5], [4.0; 5], [4.0; 5]].concat(), "{cut}");
    }
    let areas = areas_mm2(&slice(&scratch, "part.step core.step"));
    assert_eq!(areas, [[4.0; 5], [6.0; 5], [4.0; 5]].concat());
    let areas = areas_mm2(&slice(&scratch, "part.step --intersect core.step"));
    assert_eq!(areas, [[0.0; 5], [2.0; 5], [0.0; 5]].concat());
}

/// For bodies that close by themselves, even-odd fill of each unites them, too.
#[test]
fn images_of_every_kind_are_those_of_even_odd_bodies() {
    let scratch = with(&[
        ("ball", Ball { centre: [0.0; 3], radius: 2.0 }),
        ("other", Ball { centre: [1.0, 0.5, 0.7], radius: 2.0 }),
        ("foot", block([-1.0, -1.0, -2.0], [3.0, 1.0, 0.13])),
    ]);
    for options in [
        "",
        "--no-polish",
        "--rotate x:20,y:31",
        "--gray --material lamp-suspension",
        "--gray --material lamp-suspension --no-polish",
        "--adaptive --material lamp-suspension",
        "--adaptive --gray --material lamp-suspension",
    ] {
        let line = |fill: &str, file: &str| {
            let layers = if options.contains("adaptive") { "" } else { "--thickness 100um" };
            format!("slice part.step {options} --dpi 254 {layers} --quiet {fill} -o {file} --force")
        };
        scratch.run(&line("", "unite.tif")).succeeds();
        scratch.run(&line("--fill even-odd", "even.tif")).succeeds();
        let [unite, even] = ["unite.tif", "even.tif"].map(|name| scratch.layers(name));
        assert_eq!(unite.len(), even.len(), "{options}");
        let mut others = 0;
        for (a, b) in unite.iter().zip(&even) {
            assert_eq!(a.info.z_um, b.info.z_um, "{options}");
            assert!(a.info.stray_rows.is_empty() && a.info.closed == Some(true));
            let rows = 0..a.image.height();
            others += rows.map(|row| differing(&a.image, &b.image, row).len()).sum::<usize>();
        }
        assert_eq!(others, 0, "{options}");
    }
    let heights = |fill: &str| {
        let line = format!("lamp heights part.step --dpi 254 {fill}");
        String::from_utf8(scratch.run(&line).succeeds().stdout).unwrap()
    };
    assert_eq!(heights(""), heights("--fill even-odd"));
    assert_ne!(heights(""), heights("--fill even-odd --bodies xor"));
    let cure = |fill: &str| {
        scratch.run(&format!("slice part.step {LINE} {fill} -o out.tif --force")).succeeds();
        let line = "lamp cure out.tif --part part.step --material lamp-suspension --section y=0mm";
        String::from_utf8(scratch.run(&format!("{line} -o cure.png")).succeeds().stdout).unwrap()
    };
    assert_eq!(cure(""), cure("--fill even-odd"));
}

#[test]
fn threads_and_memory_change_no_byte() {
    let ball = |k: u32| Ball { centre: [1.1 * f64::from(k), 0.3, 0.0], radius: 2.0 };
    let bodies: Vec<(&str, StepBody)> = (0..8).map(|k| ("", ball(k))).collect();
    let scratch = with(&bodies);
    let line = "slice part.step --dpi 600 --rotate x:40 --gray --material lamp-suspension";
    let one = scratch.run(&format!("{line} --threads 1 -o one.tif")).succeeds().stderr;
    let four = scratch.run(&format!("{line} --threads 4 --memory 16MB -o four.tif")).succeeds();
    assert!(scratch.bytes("one.tif") == scratch.bytes("four.tif"));
    assert!(one.contains("overlap by") && one == four.stderr, "{one}");
}

/// An STL says nothing of bodies, so it stands in for united ones by winding.
#[test]
fn the_fallback_unites_too() {
    let scratch = with(&overlapping());
    let whole = slice(&scratch, "part.step");
    let text = said(&scratch, "--fallback part.stl");
    assert!(!text.contains("gaps"), "{text}");
    assert_eq!(masks(&scratch.layers("said.tif")), masks(&whole));
}

#[test]
fn items_of_a_3mf_unite() {
    let scratch = Scratch::new();
    let ball = sphere(3.0, 2_000);
    let items = "<item objectid=\"1\"/>\n\
                 <item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 2 0 0\"/>\n";
    let model = three_mf_model("millimeter", &ball.three_mf_object(1), items);
    scratch.write("part.3mf", &three_mf(&model, &[]));
    let text = scratch.run("slice part.3mf --dpi 254 -o said.tif").succeeds().stderr;
    assert!(text.contains("meshes 1 and 2 overlap by"), "{text}");
    let unite = slice(&scratch, "part.3mf");
    assert_eq!(masks(&unite), masks(&slice(&scratch, "part.3mf --fill even-odd")));
    assert_ne!(masks(&unite), masks(&slice(&scratch, "part.3mf --fill even-odd --bodies xor")));
}

/// Each of several files is polished as it would be alone.
#[test]
fn files_side_by_side_are_each_as_exact_as_alone() {
    let scratch = Scratch::new();
    scratch.write("part.step", step(StepSample::Tower, StepUnit::Millimetre).as_bytes());
    let line = "--dpi 254 --thickness 1mm --rotate x:50 --quiet --force";
    let white = |files: &str, fill: &str| -> Vec<u64> {
        scratch.run(&format!("slice {files} {line} {fill} -o out.tif")).succeeds();
        masks(&scratch.layers("out.tif")).iter().map(|mask| mask.white_pixels()).collect()
    };
    let doubled: Vec<u64> = white("part.step", "").iter().map(|pixels| 2 * pixels).collect();
    for fill in ["", "--fill even-odd"] {
        assert_eq!(white("part.step part.step@100,0", fill), doubled, "{fill}");
    }
}
