//! Pixels that are not square, through the commands: every millimeter right, or a sentence.

use std::f64::consts::PI;

use lamp_fixtures::Sample;
use lamp_stack::{Length, Pitch};
use lamp_tests::{Scratch, ask_python, mask, read_stack};
use serde_json::{Value, json};

/// A ball of radius 1.5 mm at pixels of 14 x 19 um.
fn with_ball() -> Scratch {
    let scratch = Scratch::new();
    scratch.run("lamp sample sphere --facets 20k -o ball.stl -q").succeeds();
    let slice = "slice ball.stl --pitch 14x19um --thickness 100um --scale 0.1 -o ball.tif -q";
    scratch.run(slice).succeeds_quietly();
    scratch
}

fn pitch() -> Pitch {
    "14x19um".parse().unwrap()
}

#[test]
fn both_options_and_a_machine_give_one_resolution() {
    let scratch = with_ball();
    let whole = scratch.bytes("ball.tif");
    let machine = "name = \"mine\"\ndescription = \"\"\n[area]\nvalue = \"100x80mm\"\n\
                   source = \"mine\"\n[defaults]\npitch = \"14x19um\"\n";
    scratch.write("mine.toml", machine.as_bytes());
    scratch.write("options.toml", b"pitch = \"14x19um\"\n");
    for option in ["--dpi 14x19um", "--pitch 0.014x0.019mm", "--options options.toml"] {
        let slice = format!("slice ball.stl {option} --thickness 100um --scale 0.1 -q");
        assert!(scratch.run(&slice).succeeds_quietly().stdout == whole, "{option}");
    }
    let by_machine = "slice ball.stl --machine mine.toml --thickness 100um --scale 0.1 -q";
    let layers = read_stack(scratch.run(by_machine).succeeds_quietly().stdout);
    assert!(layers.iter().all(|layer| layer.pitch == Some(pitch())));
    scratch
        .run("slice ball.stl --pitch 14x19 --thickness 100um -q --machine alpha")
        .is_wrong_usage(&["the stack has 14 x 19 dpi, and the machine alpha builds in 1500 to"]);
    for wrong in ["14x", "0.1um", "14x19furlong"] {
        let slice = format!("slice ball.stl --pitch {wrong}");
        scratch.run(&slice).is_wrong_usage(&["is not a resolution", "14x19um"]);
    }
}

#[test]
fn stages_and_forms_keep_the_pitch() {
    let scratch = with_ball();
    let whole = scratch.bytes("ball.tif");
    for there_and_back in [
        "lamp pack ball.tif | lamp convert",
        "lamp convert ball.tif --png -o pngs/ && lamp convert pngs",
        "fix ball.tif | dither",
        "lamp convert ball.tif -o pages/ && lamp convert pages",
    ] {
        let mut lines: Vec<&str> = there_and_back.split(" && ").collect();
        let last = lines.pop().unwrap();
        lines.iter().for_each(|line| drop(scratch.run(line).succeeds()));
        let layers = read_stack(scratch.run(last).succeeds().stdout);
        assert!(layers.iter().all(|layer| layer.pitch == Some(pitch())), "{there_and_back}");
        assert!(layers.len() == read_stack(whole.clone()).len());
    }
    let info = scratch.run("lamp info ball.tif --json").succeeds_quietly().stdout;
    let info: Value = serde_json::from_slice(&info).unwrap();
    assert_eq!(info["dpi"], json!([12_700.0 / 7.0, 25_400.0 / 19.0]));
    let sides = [&info["width_px"], &info["height_px"]].map(|side| side.as_f64().unwrap());
    let text = scratch.run("lamp info ball.tif").succeeds_quietly().stdout;
    let mm = format!("14 x 19 um ({:.3} x {:.3} mm)", sides[0] * 0.014, sides[1] * 0.019);
    assert!(String::from_utf8(text).unwrap().contains(&mm), "{mm}");
    // Sections at the tops of layers: the sum of r^2 - z^2, up to rounding to pixels.
    let areas = (1..30).map(|k| 1.5 * 1.5 - (f64::from(k) * 0.1 - 1.5_f64).powi(2));
    let volume = PI * areas.sum::<f64>() * 0.1;
    let found = info["volume_mm3"].as_f64().unwrap();
    assert!((found / volume - 1.0).abs() < 2e-3, "{found} is not {volume}");
}

/// The mesh of the layers holds the volume of their pixels, and so does a build of them.
#[test]
fn a_mesh_of_the_layers_has_their_size() {
    let scratch = with_ball();
    scratch.run("tile ball.tif --area 12x9mm --gap 1mm --mesh none -q -o build.tif").succeeds();
    let json = |line: &str| -> Value {
        serde_json::from_slice(&scratch.run(line).succeeds().stdout).unwrap()
    };
    let volume =
        |stack: &str| json(&format!("lamp info {stack} --json"))["volume_mm3"].as_f64().unwrap();
    let ball = volume("ball.tif");
    // The surface of a build has larger cells.
    for (stack, copies, within) in [("ball.tif", 1.0, 1e-3), ("build.tif", 6.0, 2e-3)] {
        assert!((volume(stack) / ball - copies).abs() < 1e-6, "{stack}");
        scratch.run(&format!("lamp mesh-out {stack} -o surface.stl -q")).succeeds();
        let mesh = scratch.bytes("surface.stl");
        // The divergence theorem, over facets of a binary STL: 84 bytes, then 50 each.
        let facets = mesh[84..].chunks_exact(50).map(|facet| {
            let number = |k: usize| {
                f64::from(f32::from_le_bytes(facet[12 + 4 * k..][..4].try_into().unwrap()))
            };
            let [a, b, c] = [0, 3, 6].map(|k| [number(k), number(k + 1), number(k + 2)]);
            a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0])
        });
        let enclosed = facets.sum::<f64>() / 6.0;
        assert!((enclosed / (copies * ball) - 1.0).abs() < within, "{enclosed} mm3");
    }
}

/// Moving the edges of a disc inwards leaves a disc.
#[test]
fn edges_move_by_the_same_distance_along_both_axes() {
    let scratch = with_ball();
    let before = read_stack(scratch.bytes("ball.tif"));
    let by = Length::from_um(60.0);
    let compensate = "lamp compensate ball.tif --uniform 60um --min-feature 0um --one-bit -q";
    let after = read_stack(scratch.run(compensate).succeeds().stdout);
    for (before, after) in before.iter().zip(&after).filter(|(b, _)| mask(b).white_pixels() > 9000)
    {
        let area = |layer| mask(layer).white_pixels() as f64 * pitch().pixel_mm2();
        let radius = (area(before) / PI).sqrt() - by.mm();
        let left = PI * radius * radius;
        assert!((area(after) / left - 1.0).abs() < 0.01, "{} of {left}", area(after));
    }
    scratch.run("lamp compensate ball.tif --uniform 60um").is_refused_with(&[
        "cannot be compensated so: its pixels are 14 x 19 um, and keeping walls (--min-feature above 0um) needs square pixels",
    ]);
}

#[test]
fn stages_that_need_square_pixels_refuse_others_in_a_sentence() {
    let scratch = with_ball();
    for line in [
        "lamp view ball.tif",
        "lamp cure ball.tif --section x=0mm --material pegda-sudan -o cure.png",
        "tile ball.tif --area 20x20mm -o build.tif",
        "tile ball.tif --area 20x20mm --mesh none --turns quarters -o build.tif",
    ] {
        let ran = scratch.run(line).is_refused_with(&["14 x 19 um", "square pixels"]);
        assert!(ran.stdout.is_empty(), "{line}");
    }
    scratch
        .run("lamp compare ball.tif ball.tif --tolerance 20um")
        .is_wrong_usage(&["14 x 19 um", "a length needs square pixels"]);
    scratch.run("lamp compare ball.tif ball.tif").succeeds();
}

/// Pillow reads both resolutions, and the rectangle of white pixels in millimeters.
#[test]
fn other_programs_read_both_resolutions() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 400);
    let slice = "slice cube.stl --pitch 140x190um --thickness 1mm --layers 1..2 -q -o one.tif";
    scratch.run(slice).succeeds_quietly();
    let script = "from PIL import Image\n\
         image = Image.open('one.tif')\n\
         x, y = image.tag_v2[282], image.tag_v2[283]\n\
         left, top, right, bottom = image.convert('L').getbbox()\n\
         print(x.numerator, x.denominator, y.numerator, y.denominator, image.tag_v2[296])\n\
         print(25.4 * (right - left) / float(x), 25.4 * (bottom - top) / float(y))";
    let Some(read) = ask_python(&scratch, script) else { return };
    let mut lines = read.lines();
    assert_eq!(lines.next(), Some("1270 7 2540 19 2"));
    let sides = lines.next().unwrap().split(' ').map(|side| side.parse::<f64>().unwrap());
    for (side, pixel) in sides.zip([0.14, 0.19]) {
        assert!((side - 20.0).abs() < pixel, "{side}");
    }
}
