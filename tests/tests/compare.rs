//! Checks the reports of `lamp compare` on stacks, against their pixels.

use lamp_fixtures::Sample;
use lamp_stack::{GrayMask, Layer, Mask, PageInfo, Pitch, StackInfo};
use lamp_tests::{Ran, Scratch};
use serde_json::{Value, json};

const WIDTH: u32 = 60;
const HEIGHT: u32 = 40;

/// A layer of blocks, white or of a level: columns, then rows.
type Block = ([u32; 2], [u32; 2]);

fn mask(blocks: &[Block]) -> Mask {
    let mut ends = vec![0];
    let mut transitions = Vec::new();
    for row in 0..HEIGHT {
        let mut columns: Vec<u32> = blocks
            .iter()
            .filter(|(_, rows)| (rows[0]..rows[1]).contains(&row))
            .flat_map(|(columns, _)| *columns)
            .collect();
        columns.sort_unstable();
        transitions.extend(columns);
        ends.push(transitions.len() as u32);
    }
    Mask::new(WIDTH, ends, transitions).unwrap()
}

/// Layers of 100 um at 254 dpi, whose pixels are 100 um.
fn stack(scratch: &Scratch, name: &str, layers: impl IntoIterator<Item = Mask>) {
    let layer = |(index, mask): (u32, Mask)| {
        let info = PageInfo {
            index,
            z_um: Some(f64::from(index) * 100.0),
            thickness_um: Some(100.0),
            origin_mm: Some([0.0, 4.0]),
            stack: (index == 0).then(StackInfo::default),
            ..PageInfo::default()
        };
        Layer { info, pitch: Pitch::of_dpi(254.0), image: mask.into() }
    };
    scratch.stack(name, (0..).zip(layers).map(layer));
}

fn status(ran: &Ran) -> Option<i32> {
    ran.statuses[0]
}

fn answer(scratch: &Scratch, line: &str) -> (Option<i32>, Value) {
    let ran = scratch.run(line);
    assert!(ran.stderr.is_empty(), "{ran:?}");
    (status(&ran), serde_json::from_slice(&ran.stdout).unwrap())
}

const BLOCK: Block = ([10, 30], [10, 30]);

#[test]
fn one_flipped_pixel_in_1270_layers_is_seen() {
    let scratch = Scratch::new();
    stack(&scratch, "a.tif", std::iter::repeat_n(mask(&[BLOCK]), 1270));
    let with_speck = |layer| {
        let speck = ([41, 42], [7, 8]);
        if layer == 777 { mask(&[BLOCK, speck]) } else { mask(&[BLOCK]) }
    };
    stack(&scratch, "b.tif", (0..1270).map(with_speck));
    let same = scratch.run("lamp compare a.tif a.tif").succeeds_quietly();
    assert_eq!(same.stdout, b"a.tif and a.tif are the same at 1270 heights\n");
    for (line, [added, missing]) in
        [("lamp compare a.tif b.tif --json", [1, 0]), ("lamp compare b.tif a.tif --json", [0, 1])]
    {
        let (status, found) = answer(&scratch, line);
        assert_eq!(
            (status, &found["same"], &found["different"]),
            (Some(1), &json!(false), &json!(1))
        );
        let [layer] = &found["layers"].as_array().unwrap()[..] else { panic!("{found}") };
        assert_eq!((&layer["layer_a"], &layer["layer_b"]), (&json!(777), &json!(777)));
        assert_eq!((&layer["added_px"], &layer["missing_px"]), (&json!(added), &json!(missing)));
        let place =
            json!([{ "pixels": 1, "box_px": [41, 42, 7, 8], "box_mm": [4.1, 4.2, 3.2, 3.3] }]);
        assert_eq!(layer["boxes"], place);
    }
    let ran = scratch.run("lamp compare a.tif b.tif");
    assert_eq!((status(&ran), &*ran.stderr), (Some(1), ""));
    let text = "a.tif and b.tif differ at 1 of 1270 heights: 1 pixel added, 0 pixels missing
  layer 777 (z 77.70 mm): 1 pixel added, 0 pixels missing
    1 pixel in columns 41 to 41, rows 7 to 7 (x 4.100 to 4.200, y 3.200 to 3.300 mm)\n";
    assert_eq!(String::from_utf8(ran.stdout).unwrap(), text);
}

#[test]
fn the_worst_come_first() {
    let scratch = Scratch::new();
    stack(&scratch, "a.tif", std::iter::repeat_n(mask(&[BLOCK]), 3));
    let blocks = |more: &[Block]| mask(&[&[BLOCK][..], more].concat());
    let (small, large) = (([2, 4], [2, 4]), ([40, 50], [20, 30]));
    stack(&scratch, "b.tif", [mask(&[BLOCK]), blocks(&[small]), blocks(&[small, large])]);
    let ran = scratch.run("lamp compare a.tif b.tif");
    let text = String::from_utf8(ran.stdout).unwrap();
    let lines: Vec<_> = text.lines().skip(1).map(str::trim).collect();
    assert!(
        lines[0].starts_with("layer 2 (z 0.20 mm): 104 pixels added, 0 pixels missing"),
        "{text}"
    );
    assert!(lines[1].starts_with("100 pixels in columns 40 to 49, rows 20 to 29"), "{text}");
    assert!(lines[2].starts_with("4 pixels in columns 2 to 3, rows 2 to 3"), "{text}");
    assert!(lines[3].starts_with("layer 1 "), "{text}");
}

#[test]
fn edges_within_the_tolerance_are_forgiven_and_gaps_are_not() {
    let scratch = Scratch::new();
    let gap = [([10, 20], [10, 30]), ([21, 30], [10, 30])];
    stack(&scratch, "a.tif", [mask(&[BLOCK]), mask(&gap)]);
    // A pixel wider on one side; and the gap of a pixel closed.
    stack(&scratch, "b.tif", [mask(&[([10, 31], [10, 30])]), mask(&[BLOCK])]);
    let (status, exact) = answer(&scratch, "lamp compare a.tif b.tif --json");
    assert_eq!((status, &exact["added_px"], &exact["different"]), (Some(1), &json!(40), &json!(2)));
    for tolerance in ["1px", "100um"] {
        let line = format!("lamp compare a.tif b.tif --tolerance {tolerance} --json");
        let (status, found) = answer(&scratch, &line);
        assert_eq!((status, &found["different"]), (Some(1), &json!(1)), "{found}");
        // The ends of the gap are near to what is black in both.
        assert_eq!((&found["added_px"], &found["forgiven_px"]), (&json!(18), &json!(22)));
    }
    stack(&scratch, "c.tif", [mask(&[([9, 30], [10, 30])]), mask(&gap)]);
    let ran = scratch.run("lamp compare a.tif c.tif --tolerance 1px");
    assert_eq!(
        status_and_text(&ran),
        (
            Some(0),
            "a.tif and c.tif are the same at 2 heights, except 20 pixels that the tolerance forgives\n"
        )
    );
    assert_eq!(self::status(&scratch.run("lamp compare a.tif c.tif --tolerance 0.9px")), Some(1));
}

fn status_and_text(ran: &Ran) -> (Option<i32>, &str) {
    (status(ran), std::str::from_utf8(&ran.stdout).unwrap())
}

#[test]
fn thin_and_thick_layers_are_compared_by_height() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 200);
    for (name, thickness) in [("thick", "1mm"), ("thin", "0.4mm")] {
        let line = format!("slice cube.stl --dpi 100 --thickness {thickness} -o {name}.tif");
        scratch.run(&line).succeeds();
    }
    let (status, found) = answer(&scratch, "lamp compare thick.tif thin.tif --json");
    // 20 layers of 1 mm and 50 of 0.4 mm have 60 ends of layers between them.
    assert_eq!((status, &found["same"], &found["compared"]), (Some(0), &json!(true), &json!(60)));
    scratch.run("lamp convert thin.tif --layers 0..40 -o low.tif").succeeds();
    let (status, found) = answer(&scratch, "lamp compare thick.tif low.tif --json");
    let layers = found["layers"].as_array().unwrap();
    assert_eq!((status, layers.len()), (Some(1), 4));
    assert!(layers.iter().all(|layer| layer["layer_b"].is_null() && layer["missing_px"] != 0));
    assert_eq!((&layers[0]["bottom_mm"], &layers[3]["top_mm"]), (&json!(16.0), &json!(20.0)));
}

#[test]
fn images_lie_where_their_origins_say() {
    let scratch = Scratch::new();
    stack(&scratch, "a.tif", [mask(&[BLOCK])]);
    let at = |name: &str, origin: [f64; 2], dpi: f64, block: Block| {
        let info = PageInfo {
            origin_mm: Some(origin),
            z_um: Some(0.0),
            thickness_um: Some(100.0),
            ..PageInfo::default()
        };
        scratch
            .stack(name, [Layer { info, pitch: Pitch::of_dpi(dpi), image: mask(&[block]).into() }]);
    };
    at("moved.tif", [-0.3, 4.5], 254.0, ([13, 33], [15, 35]));
    scratch.run("lamp compare a.tif moved.tif").succeeds_quietly();
    at("wrong.tif", [-0.3, 4.5], 254.0, ([13, 33], [15, 36]));
    let (_, found) = answer(&scratch, "lamp compare a.tif wrong.tif --json");
    assert_eq!(found["layers"][0]["boxes"][0]["box_px"], json!([10, 30, 30, 31]));
    at("between.tif", [-0.35, 4.5], 254.0, BLOCK);
    at("fine.tif", [-0.3, 4.5], 508.0, BLOCK);
    at("far.tif", [500.0, 4.5], 254.0, BLOCK);
    for (name, why) in [
        ("between", "the pixels of the two images do not line up"),
        ("fine", "254 dpi"),
        ("far", "do not overlap"),
    ] {
        let ran = scratch.run(&format!("lamp compare a.tif {name}.tif"));
        assert!(
            status(&ran) == Some(2) && ran.stderr.contains(why) && ran.stdout.is_empty(),
            "{ran:?}"
        );
    }
}

#[test]
fn gray_pages_are_compared_by_level() {
    let scratch = Scratch::new();
    let gray = |levels: &[u8]| {
        let mut gray = GrayMask::new(4);
        for _ in 0..3 {
            gray.push_runs(levels.iter().map(|&level| (1, level))).unwrap();
        }
        [Layer { info: PageInfo::default(), pitch: None, image: gray.into() }]
    };
    scratch.stack("a.tif", gray(&[0, 100, 255, 0]));
    scratch.stack("b.tif", gray(&[0, 101, 254, 0]));
    let (status, found) = answer(&scratch, "lamp compare a.tif b.tif --json");
    assert_eq!((status, &found["added_px"], &found["missing_px"]), (Some(1), &json!(3), &json!(3)));
    assert_eq!(found["by"], json!("indices"));
    let ran = scratch.run("lamp compare a.tif b.tif --tolerance 20um");
    assert!(
        self::status(&ran) == Some(2) && ran.stderr.contains("give --tolerance in pixels"),
        "{ran:?}"
    );
}

#[test]
fn a_broken_stack_does_not_look_like_one_that_differs() {
    let scratch = Scratch::new();
    let layers = || (0..20).map(|k| mask(&[([10, 20 + k], [10, 30])]));
    stack(&scratch, "a.tif", layers());
    let whole = scratch.bytes("a.tif");
    scratch.write("cut.tif", &whole[..whole.len() / 2]);
    // Both stacks have the fault, and so the same bytes.
    let mut flipped = whole.clone();
    let of_image = whole.len() - 100;
    flipped[of_image] ^= 0x10;
    scratch.write("flipped.tif", &flipped);
    scratch.write("text.tif", b"no stack");
    for line in [
        "a.tif cut.tif",
        "cut.tif a.tif",
        "cut.tif cut.tif",
        "flipped.tif flipped.tif",
        "a.tif flipped.tif",
        "a.tif text.tif",
        "a.tif none.tif",
        "- -",
    ] {
        let ran = scratch.run(&format!("lamp compare {line}"));
        assert!(status(&ran) == Some(2) && ran.stdout.is_empty(), "{line}: {ran:?}");
        assert_eq!(ran.stderr.lines().count(), 1, "{ran:?}");
    }
}

#[test]
fn a_pipe_is_compared_and_the_worst_layer_drawn() {
    let scratch = Scratch::new();
    stack(&scratch, "a.tif", [mask(&[BLOCK])]);
    stack(&scratch, "b.tif", [mask(&[([10, 34], [12, 30])])]);
    let ran = scratch.run("lamp convert b.tif -o - | lamp compare a.tif - --picture worst.png");
    assert_eq!(ran.statuses, [Some(0), Some(1)], "{ran:?}");
    let mut reader =
        png::Decoder::new(std::io::Cursor::new(scratch.bytes("worst.png"))).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    // Each pixel is shown as 8 x 8.
    let of = |colour: [u8; 3]| pixels.chunks(3).filter(|pixel| **pixel == colour).count() / 64;
    assert_eq!((of([230, 159, 0]), of([86, 180, 233]), of([150; 3])), (4 * 18, 2 * 20, 20 * 18));
    // The same images, coded otherwise.
    scratch.run("lamp convert b.tif --png -o pages/").succeeds();
    scratch.run("lamp compare b.tif pages").succeeds_quietly();
    let ran = scratch.run("lamp compare a.tif a.tif --picture none.png").succeeds();
    assert!(ran.stderr.contains("nothing differs"), "{ran:?}");
    assert!(!scratch.names().contains(&"none.png".to_owned()));
}
