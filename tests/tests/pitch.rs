//! Pixels that are not square, through the commands: every millimeter right, or a sentence.

use std::f64::consts::PI;

use lamp_fixtures::{Facet, Mesh, Sample};
use lamp_stack::{Image, Layer, Length, MaskBuilder, PageInfo, Pitch};
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
        .run("slice ball.stl --pitch 14x19dpi --thickness 100um -q --machine alpha")
        .is_wrong_usage(&["the stack has 14 x 19 dpi, and the machine alpha builds in 1500 to"]);
    for wrong in ["14x", "0.1um", "14x19furlong"] {
        let slice = format!("slice ball.stl --pitch {wrong}");
        // By the name that was given.
        let words = ["is not a resolution", "14x19um", "'--pitch <DPI>'"];
        scratch.run(&slice).is_wrong_usage(&words);
    }
    let small = scratch.run("slice ball.stl --pitch 14 -o small.tif");
    small.is_wrong_usage(&["--pitch 14um for micrometers", "--dpi 14 for dots"]);
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
    let line = "tile ball.tif --area 20x20mm --mesh none --turns quarters -o build.tif";
    let ran = scratch.run(line).is_refused_with(&["14 x 19 um", "square pixels"]);
    assert!(ran.stdout.is_empty());
}

/// The mesh around a ball has the area that it has at square pixels, in layers with a moat and in base
/// layers.
#[test]
fn a_mesh_is_the_same_in_millimeters() {
    let scratch = with_ball();
    let slice = "slice ball.stl --pitch 16um --thickness 100um --scale 0.1 -o square.tif -q";
    scratch.run(slice).succeeds_quietly();
    // Break lines are as wide as whole pixels, which differ.
    for (mesh, part) in [
        ("--break-width 0um", 0.003),
        ("--break-width 0um --mesh square --cell 0.9mm --wall 0.3mm", 0.003),
        ("--mesh square --cell 0.7mm --wall 0.2mm --break-width 0.456mm --break-pitch 2mm", 0.02),
    ] {
        let [rectangles, squares] = ["ball", "square"].map(|name| {
            let tile = format!("tile {name}.tif --area 20x16mm --copies 1 {mesh} -q -o build.tif");
            scratch.run(&tile).succeeds_quietly();
            let layers = scratch.layers("build.tif");
            let area_mm2 = |layer: &Layer| {
                mask(layer).white_pixels() as f64 * layer.pitch.unwrap().pixel_mm2()
            };
            layers.iter().map(area_mm2).collect::<Vec<_>>()
        });
        assert_eq!(rectangles.len(), squares.len());
        for (layer, (a, b)) in rectangles.iter().zip(&squares).enumerate() {
            assert!((a / b - 1.0).abs() < part, "{mesh} {layer}: {a} and {b} mm2");
        }
    }
}

/// A square that is shifted: its farthest pixel is as far off as the shift is long, in micrometers.
#[test]
fn a_tolerance_in_micrometers_is_as_long_along_both_axes() {
    let scratch = Scratch::new();
    let stack = |name: &str, left: u32, top: u32| {
        let mut mask = MaskBuilder::new(60);
        for row in 0..60 {
            let ends = [left, left + 30];
            let is_white = (top..top + 30).contains(&row);
            mask.push_row(if is_white { &ends } else { &[] }).unwrap();
        }
        let image = Image::from(mask.finish()).into();
        scratch.stack(name, [Layer { info: PageInfo::default(), pitch: Some(pitch()), image }]);
    };
    stack("a.tif", 10, 10);
    for [columns, rows] in [[2, 0], [0, 2], [3, 2], [1, 5]] {
        stack("b.tif", 10 + columns, 10 + rows);
        let off_um = (f64::from(columns) * 14.0).hypot(f64::from(rows) * 19.0);
        for (tolerance_um, status) in [(off_um + 0.01, 0), (off_um - 0.01, 1)] {
            let line = format!("lamp compare a.tif b.tif --tolerance {tolerance_um:.4}um -q");
            assert_eq!(scratch.run(&line).statuses[0], Some(status), "{columns} {rows}");
        }
    }
}

/// A box, by columns, rows and tenths of a millimeter at 14 x 19 um.
fn block(x: [u16; 2], y: [u16; 2], z: [u16; 2]) -> Vec<Facet> {
    let sides = [(x, 0.014), (y, 0.019), (z, 0.1)];
    let corner = |k: usize| {
        [0, 1, 2].map(|axis| {
            let (ends, side) = sides[axis];
            (f64::from(ends[k >> axis & 1]) * side) as f32
        })
    };
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let halves = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    halves.map(|facet| facet.map(corner)).collect()
}

/// A plate with a post below two arms, and an island; edges are edges of pixels both of 14 x 19 um
/// and of 1 um.
fn with_blocks() -> Scratch {
    let scratch = Scratch::new();
    let blocks = [
        block([0, 200], [0, 150], [0, 5]),
        block([20, 60], [20, 50], [5, 20]),
        block([20, 160], [20, 50], [20, 24]),
        block([20, 60], [50, 130], [20, 24]),
        block([120, 180], [90, 130], [15, 24]),
    ];
    scratch.mesh("blocks.stl", &Mesh { facets: blocks.concat() });
    for pitch in ["14x19um", "1um"] {
        let slice = format!("slice blocks.stl --pitch {pitch} --thickness 100um -q -o {pitch}.tif");
        scratch.run(&slice).succeeds_quietly();
    }
    scratch
}

/// Checks that two reports state the same, but for pixels: numbers to a pixel, and areas to the
/// pixels along an edge.
fn assert_alike([a, b]: [&Value; 2], key: &str) {
    let of_pixels = |key: &str| key.contains("px") || ["dpi", "input"].contains(&key);
    match (a, b) {
        (Value::Object(a), Value::Object(b)) => {
            assert!(a.keys().eq(b.keys()), "{key}: {a:?} {b:?}");
            for (key, value) in a.iter().filter(|(key, _)| !of_pixels(key)) {
                assert_alike([value, &b[key]], key);
            }
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{key}: {a:?} {b:?}");
            a.iter().zip(b).for_each(|(a, b)| assert_alike([a, b], key));
        }
        (Value::Number(x), Value::Number(y)) => {
            let [x, y] = [x, y].map(|number| number.as_f64().unwrap());
            assert!((x - y).abs() < 0.03_f64.max(0.01 * y.abs()), "{key}: {x} {y}");
        }
        _ => assert_eq!(a, b, "{key}"),
    }
}

#[test]
fn findings_have_the_same_millimeters() {
    let scratch = with_blocks();
    let report = |pitch: &str| -> Value {
        scratch.run(&format!("lamp check {pitch}.tif --report {pitch}.json")).succeeds();
        serde_json::from_slice(&scratch.bytes(&format!("{pitch}.json"))).unwrap()
    };
    let [found, fine] = ["14x19um", "1um"].map(report);
    let kinds: Vec<_> =
        found["findings"].as_array().unwrap().iter().map(|it| &it["kind"]).collect();
    assert_eq!(kinds, ["island", "weak-joint", "overhang", "overhang"]);
    assert_alike([&found, &fine], "");
    let island = &found["findings"][0];
    let area = 60.0 * 0.014 * 40.0 * 0.019;
    assert!((island["area_mm2"].as_f64().unwrap() - area).abs() < 1e-6, "{island}");
}

#[test]
fn supports_have_the_same_millimeters() {
    let scratch = with_blocks();
    let sizes = "--tip 0.2mm --pillar 0.3mm --base 0.5mm --clearance 0.1mm";
    for to in [
        "--radius 0.1mm".to_owned(),
        format!("--to platform --overhangs 45 --spacing 0.6mm {sizes}"),
    ] {
        let report = |pitch: &str| -> Value {
            let support = format!(
                "lamp support {pitch}.tif --part blocks.stl {to} --report {pitch}.json -o held.tif"
            );
            scratch.run(&support).succeeds();
            serde_json::from_slice(&scratch.bytes(&format!("{pitch}.json"))).unwrap()
        };
        let [held, fine] = ["14x19um", "1um"].map(report);
        for count in
            ["islands", "left", "weak", "supports", "pillars", "overhangs", "bare_overhangs"]
        {
            assert_eq!(held[count], fine[count], "{count}");
        }
        // Columns stand at the centers of pixels, and each widens its base as far as there is room.
        let [volume, least] = [&held, &fine].map(|report| report["volume_mm3"].as_f64().unwrap());
        assert!(volume > 0.1 && (volume / least - 1.0).abs() < 0.03, "{volume} {least}");
        assert_eq!(held["left"], 0);
    }
}

/// A picture has the shape of the part: both sides of the ball's layer are as long.
#[test]
fn pictures_are_not_stretched() {
    let scratch = with_ball();
    scratch.run("lamp show ball.tif --layer 15 --zoom 2 -o ball.png").succeeds();
    let sides = |scratch: &Scratch, name: &str| {
        let mut reader =
            png::Decoder::new(std::io::Cursor::new(scratch.bytes(name))).read_info().unwrap();
        let mut levels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut levels).unwrap();
        let width = info.width as usize;
        let white = |at: &usize| levels[*at] > 127;
        let of_row = |row: usize| (row * width..(row + 1) * width).filter(white).count();
        let of_column = |column: usize| (column..levels.len()).step_by(width).filter(white).count();
        let rows = levels.len() / width;
        [(0..rows).map(of_row).max().unwrap(), (0..width).map(of_column).max().unwrap()]
    };
    let [across, down] = sides(&scratch, "ball.png");
    // 3 mm in widths of 14 um, twice each.
    assert!(across.abs_diff(428) < 5 && across.abs_diff(down) < 5, "{across} x {down}");
}

/// A section through the middle of the ball is a disc, along a row and along a column.
#[test]
fn cured_sections_have_the_part_in_millimeters() {
    let scratch = with_ball();
    for plane in ["x=0mm", "y=0mm"] {
        let cure = format!(
            "lamp cure ball.tif --section {plane} --part ball.stl --material pegda-sudan -o cure.png"
        );
        let text = String::from_utf8(scratch.run(&cure).succeeds().stdout).unwrap();
        let line = text
            .lines()
            .find(|line| line.starts_with("pixels"))
            .unwrap_or_else(|| panic!("{text}"));
        let part: f64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
        assert!((part / (PI * 1.5 * 1.5) - 1.0).abs() < 0.01, "{plane}: {text}");
    }
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
