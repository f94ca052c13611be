//! Checks that `lamp convert` writes the same layers in other forms, and back byte for byte.

use std::fs;
use std::io::Cursor;

use lamp_fixtures::Sample;
use lamp_stack::Layer;
use lamp_tests::{Scratch, mask};

/// Makes a build with all page metadata: corrected stray rows and the copies' places.
fn with_build() -> Scratch {
    let scratch = Scratch::new();
    scratch.run("lamp sample tower --facets 5k --defect drop --count 20 -o t.stl -q").succeeds();
    let line = "slice t.stl --dpi 100 --thickness 2mm -q | fix -q | tile --mesh none --area 4x4in -o build.tif";
    scratch.run(line).succeeds();
    assert!(scratch.layers("build.tif").iter().any(|layer| layer.info.other.contains_key("fix")));
    scratch
}

/// Polygons of contour files enclose the white area of each layer.
#[test]
fn contours_enclose_what_is_white() {
    let scratch = with_build();
    let layers = scratch.layers("build.tif");
    scratch.run("lamp convert build.tif -o contours.cli").succeeds_quietly();
    let text = String::from_utf8(scratch.bytes("contours.cli")).unwrap();
    let pixel = 25.4 / 100.0;
    let sections: Vec<_> = text.split("$$LAYER/").skip(1).collect();
    assert_eq!(sections.len(), layers.len());
    for (section, layer) in sections.iter().zip(&layers) {
        let top: f64 = section.lines().next().unwrap().parse().unwrap();
        let info = &layer.info;
        assert!((top * 1000.0 - info.z_um.unwrap() - info.thickness_um.unwrap()).abs() < 1e-3);
        let mut mm2 = 0.0;
        for line in section.lines().filter_map(|line| line.strip_prefix("$$POLYLINE/1,")) {
            let numbers: Vec<f64> = line.split(',').map(|word| word.parse().unwrap()).collect();
            let points: Vec<_> = numbers[2..].chunks(2).map(|p| (p[0], p[1])).collect();
            assert!(points.len() == numbers[1] as usize && points[0] == points[points.len() - 1]);
            let area: f64 = points.windows(2).map(|p| p[0].0 * p[1].1 - p[1].0 * p[0].1).sum();
            assert_eq!(area > 0.0, numbers[0] == 1.0);
            mm2 += area / 2.0;
        }
        let white = mask(layer).white_pixels() as f64 * pixel * pixel;
        assert!((mm2 - white).abs() < 1e-6 * white.max(1.0), "{mm2}, not {white}");
    }
    for name in ["contours.svg", "contours.dxf"] {
        scratch.run(&format!("slice t.stl --dpi 100 --thickness 2mm -q -o {name}")).succeeds();
        assert!(!scratch.bytes(name).is_empty());
    }
    let gray = "slice t.stl --dpi 100 --thickness 2mm --antialias -q -o gray.svg";
    let ran = scratch.run(gray);
    assert!(ran.stderr.contains("is gray, and contours are edges"), "{ran:?}");
    assert!(!scratch.names_in(".").iter().any(|name| name.contains("gray.svg")));
}

#[test]
fn every_shape_goes_back_to_the_same_bytes() {
    let scratch = with_build();
    let build = scratch.bytes("build.tif");
    scratch.run("lamp convert build.tif -o pages/").succeeds_quietly();
    assert_eq!(scratch.names_in("pages").len(), 38);
    scratch.run("lamp convert pages -o back.tif").succeeds_quietly();
    assert!(scratch.bytes("back.tif") == build);
    scratch.run("lamp convert pages/ --classic -o classic.tif").succeeds_quietly();
    assert_eq!(scratch.bytes("classic.tif")[2], 42);
    assert!(scratch.run("lamp convert classic.tif").succeeds_quietly().stdout == build);
    assert!(scratch.run_on("lamp convert", &build).succeeds_quietly().stdout == build);
    scratch.run("lamp convert classic.tif --classic -o classics/").succeeds_quietly();
    assert_eq!(scratch.bytes("classics/layer_00037.tif")[2], 42);
    assert!(scratch.run("lamp convert classics").succeeds_quietly().stdout == build);
    scratch.run("lamp convert build.tif --png -o pngs/").succeeds_quietly();
    assert!(scratch.run("lamp convert pngs").succeeds_quietly().stdout == build);
    // A folder of TIFFs may have any name.
    scratch.run("lamp convert build.tif -o odd.png/").succeeds_quietly();
    assert!(scratch.run("lamp convert odd.png").succeeds_quietly().stdout == build);
}

/// Returns a PNG's metadata and its image as bytes.
struct Read {
    bits: u8,
    line: String,
    per_metre: Option<u32>,
    size: [u32; 2],
    rows: Vec<Vec<u8>>,
}

/// Reads a gray PNG with an independent decoder.
fn read(png: Vec<u8>) -> Read {
    let mut reader = png::Decoder::new(Cursor::new(png)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut pixels).unwrap();
    let info = reader.info();
    assert_eq!(info.color_type, png::ColorType::Grayscale);
    let [text] = &info.uncompressed_latin1_text[..] else { panic!("one text") };
    assert_eq!(text.keyword, "Description");
    Read {
        bits: info.bit_depth as u8,
        line: text.text.clone(),
        per_metre: info.pixel_dims.map(|dims| {
            assert!(dims.unit == png::Unit::Meter && dims.xppu == dims.yppu);
            dims.xppu
        }),
        size: [info.width, info.height],
        rows: pixels.chunks(frame.line_size).map(<[u8]>::to_vec).collect(),
    }
}

/// Returns a page's line without its check.
fn before_check(line: &str) -> String {
    format!("{}}}", line.split_once(",\"check\":").expect("every page has a check").0)
}

#[track_caller]
fn assert_shows(png: &Read, layer: &Layer) {
    let mask = mask(layer);
    assert_eq!((png.bits, png.size), (1, [mask.width(), mask.height()]));
    for (row, bytes) in (0..).zip(&png.rows) {
        let white = |column: u32| bytes[column as usize / 8] << (column % 8) & 0x80 != 0;
        assert!((0..mask.width()).all(|column| white(column) == mask.is_white(column, row)));
    }
}

#[test]
fn a_folder_of_pngs_holds_the_pixels_and_the_lines() {
    let scratch = with_build();
    scratch.run("lamp convert build.tif --png -o pngs/").succeeds_quietly();
    let layers = scratch.layers("build.tif");
    assert_eq!(scratch.names_in("pngs").len(), layers.len());
    for layer in &layers {
        let png = read(scratch.bytes(&format!("pngs/layer_{:05}.png", layer.info.index)));
        assert_shows(&png, layer);
        // 100 dpi are 3937.008 pixels a meter.
        assert_eq!(png.per_metre, Some(3937));
        assert_eq!(before_check(&png.line), serde_json::to_string(&layer.info).unwrap());
    }
}

#[test]
fn a_resolution_that_metres_would_lose_stands_in_the_line() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 64);
    scratch.run("slice cube.stl --dpi 72.25 --layers 7 -o cube.tif").succeeds_quietly();
    scratch.run("lamp convert cube.tif -o cube.png").succeeds_quietly();
    let (png, layer) = (read(scratch.bytes("cube.png")), scratch.layers("cube.tif").remove(0));
    assert_shows(&png, &layer);
    assert_eq!(png.per_metre, Some(2844));
    let line = serde_json::to_string(&layer.info).unwrap();
    let stated = format!("{},\"dpi\":72.25}}", line.strip_suffix('}').unwrap());
    assert_eq!(before_check(&png.line), stated);
    let back = scratch.run("lamp convert cube.png").succeeds_quietly().stdout;
    assert!(back == scratch.bytes("cube.tif"));
}

#[test]
fn gray_layers_become_8_bit_pngs() {
    let scratch = Scratch::new();
    lamp_tests::write_gray_ramp(&scratch.path("ramp.tif"), 256, 3);
    scratch.run("lamp convert ramp.tif -o ramp.PNG").succeeds_quietly();
    let png = read(scratch.bytes("ramp.PNG"));
    assert_eq!((png.bits, before_check(&png.line).as_str()), (8, r#"{"layer":0}"#));
    assert_eq!(png.rows, vec![Vec::from_iter(0..=255); 3]);
    for folder in ["pages/", "pages.png/ --png"] {
        scratch.run(&format!("lamp convert ramp.tif -o {folder}")).succeeds_quietly();
        let back = format!("lamp convert {}", folder.trim_end_matches(" --png"));
        assert!(scratch.run(&back).succeeds_quietly().stdout == scratch.bytes("ramp.tif"));
    }
}

#[test]
fn a_range_states_how_many_layers_it_has() {
    let scratch = with_build();
    let all = scratch.layers("build.tif");
    scratch.run("lamp convert build.tif --layers 10..20 -o some.tif").succeeds_quietly();
    scratch.run("lamp convert some.tif --layers 15.. --png -o pngs/").succeeds_quietly();
    scratch.run("lamp convert some.tif --layers 15.. -o pages/").succeeds_quietly();
    for (name, wanted) in [("some.tif", 10..20), ("pages", 15..20)] {
        let mut some = scratch.layers(name);
        let stack = some[0].info.stack.take().expect("the first page says what it is of");
        assert_eq!(stack.layers, Some(wanted.len() as u32));
        let whole = all[0].info.stack.clone().unwrap();
        assert_eq!((stack.commands, stack.other), (whole.commands, whole.other));
        assert!(some == all[wanted], "{name}");
    }
    let first = read(scratch.bytes("pngs/layer_00015.png"));
    assert_shows(&first, &all[15]);
    assert!(first.line.contains(r#""layers":5,"#), "{}", first.line);
    assert_eq!(scratch.names_in("pngs").len(), 5);
}

#[test]
fn a_stack_that_is_cut_off_leaves_nothing_behind() {
    let scratch = with_build();
    let build = scratch.bytes("build.tif");
    scratch.write("cut.tif", &build[..build.len() - 1000]);
    let before = scratch.names();
    for output in ["x.tif", "x/", "x/ --png", "x.tif --classic"] {
        let ran = scratch.run(&format!("lamp convert cut.tif -o {output}"));
        ran.is_refused_with(&["convert: cut.tif: ", "cut off", "36"]);
        assert_eq!(scratch.names(), before, "{output}");
    }
    scratch.run("lamp split cut.tif --every 10 -o x/").is_refused_with(&["split: cut.tif: ", "36"]);
    assert_eq!(scratch.names(), before);
    // One layer of several is no stack of one.
    let ran = scratch.run("lamp convert build.tif -o x.png");
    ran.is_refused_with(&["build.tif: ", "one layer", "--layers", "--png"]);
    assert_eq!(scratch.names(), before);
}

#[test]
fn a_png_replaces_the_file_that_was_there_and_a_folder_does_not() {
    let scratch = with_build();
    scratch.write("x.png", b"old");
    scratch.run("lamp convert build.tif --layers 3 -o x.png").succeeds_quietly();
    assert_shows(&read(scratch.bytes("x.png")), &scratch.layers("build.tif")[3]);
    fs::create_dir(scratch.path("pngs")).unwrap();
    scratch.run("lamp convert build.tif --png -o pngs").succeeds_quietly();
    let ran = scratch.run("lamp convert build.tif --png -o pngs");
    ran.is_refused_with(&["convert: pngs: ", "--force replaces a folder"]);
}

#[test]
fn an_ending_that_names_no_format_gets_a_note() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 64);
    let slice = "slice cube.stl --dpi 60 --thickness 2mm";
    let note = "slice: build.v2: written as a TIFF; --format names another format";
    let said = scratch.run(&format!("{slice} -o build.v2")).succeeds().stderr;
    assert_eq!(said.lines().filter(|line| *line == note).count(), 1, "{said}");
    assert!(scratch.bytes("build.v2").starts_with(b"II"));
    for silent in
        ["-o build.v2 -q", "-o build.v2 --format tiff", "-o build.tif", "-o build", "-o v.2/"]
    {
        let said = scratch.run(&format!("{slice} {silent}")).succeeds().stderr;
        assert!(!said.contains("written as a TIFF"), "{silent}: {said}");
    }
}

/// As with every command from stacks to stacks: the file is replaced when the new one is complete.
#[test]
fn a_stack_may_be_converted_in_place() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 64);
    scratch.run("slice cube.stl --dpi 60 --thickness 2mm -o a.tif").succeeds();
    scratch.run("slice cube.stl --machine mars3 --thickness 1mm -o a.goo").succeeds();
    for name in ["a.tif", "a.goo"] {
        let before = scratch.bytes(name);
        scratch.run(&format!("lamp convert {name} {name}")).succeeds();
        assert_eq!(scratch.bytes(name), before, "{name}");
    }
    let layers = scratch.layers("a.tif");
    scratch.run("lamp convert a.tif --classic a.tif").succeeds();
    assert!(scratch.layers("a.tif") == layers);
    // A TIFF's version is 42, a BigTIFF's 43.
    assert_eq!(scratch.bytes("a.tif")[2], 42);
    let before = scratch.bytes("a.tif");
    scratch.run("lamp convert a.tif --layers 900..901 a.tif").is_refused_with(&["a.tif"]);
    assert_eq!(scratch.bytes("a.tif"), before);
}
