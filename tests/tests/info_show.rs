//! Compares `lamp info` and `lamp show` with the layers as the library reads them.

use std::io::Cursor;

use lamp_fixtures::Sample;
use lamp_stack::Mask;
use lamp_tests::{Scratch, mask, masks};
use serde_json::json;

fn with_cube() -> Scratch {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 200);
    scratch.run("slice cube.stl --dpi 100 --thickness 1mm -o cube.tif").succeeds();
    scratch
}

/// Returns the value of a line `key: value` of `lamp info`.
fn fact<'a>(text: &'a str, key: &str) -> &'a str {
    let line = text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(':'));
    line.unwrap_or_else(|| panic!("no {key} in {text}")).trim()
}

fn info(scratch: &Scratch, line: &str) -> String {
    String::from_utf8(scratch.run(line).succeeds_quietly().stdout).unwrap()
}

#[test]
fn info_says_what_the_stack_holds() {
    let scratch = with_cube();
    let text = info(&scratch, "lamp info cube.tif");
    let layers = scratch.layers("cube.tif");
    assert_eq!(fact(&text, "stack"), "cube.tif");
    assert_eq!(fact(&text, "part"), "cube");
    assert!(fact(&text, "made by").starts_with("slice cube.stl --dpi 100 --thickness 1mm "));
    // 20 mm in layers of 1 mm, and 78.7 pixels per side: at most 79 are covered, plus
    // a margin of one; the width is rounded up to a multiple of 32.
    assert_eq!(fact(&text, "layers"), "20 (0 to 19)");
    assert_eq!(fact(&text, "size"), "96 x 81 pixels");
    assert_eq!(fact(&text, "resolution"), "100 dpi (24.384 x 20.574 mm)");
    assert_eq!(fact(&text, "z"), "0.000 to 20.000 mm");
    let transitions: usize = masks(&layers).iter().map(|mask| mask.rows().flatten().count()).sum();
    let white: u64 = masks(&layers).iter().map(|mask| mask.white_pixels()).sum();
    let volume = white as f64 * 0.254 * 0.254;
    // Commas group digits.
    assert!(fact(&text, "exposed").contains(','));
    let exposed = format!("{white} pixels in all layers {volume:.3} mm3");
    assert_eq!(fact(&text, "exposed").replace(',', ""), exposed);
    assert!(!text.contains("runs:"));
    let with_runs = info(&scratch, "lamp info cube.tif --runs");
    assert_eq!(fact(&with_runs, "runs").replace(',', ""), format!("{transitions} transitions"));
    let proven = "texts, order and number of layers are as written; lamp verify checks the images";
    assert_eq!(fact(&text, "checks"), proven);
    assert!(fact(&text, "data").ends_with(" bytes, CCITT Group 4"));
    assert_eq!(fact(&text, "stray rows"), "none known");
    let digest = &layers[0].info.stack.as_ref().unwrap().digest;
    assert_eq!(fact(&text, "input"), digest);
    assert!(digest.starts_with("blake3:") && digest.len() == "blake3:".len() + 64, "{digest}");
}

#[test]
fn info_answers_scripts_in_json() {
    let scratch = with_cube();
    let answer =
        |line: &str| -> serde_json::Value { serde_json::from_str(&info(&scratch, line)).unwrap() };
    let layers = scratch.layers("cube.tif");
    let stack = layers[0].info.stack.as_ref().unwrap();
    let white: u64 = masks(&layers).iter().map(|mask| mask.white_pixels()).sum();
    let found = answer("lamp info cube.tif --json");
    for (key, expected) in [
        ("schema", json!("lamp-info-1")),
        ("part", json!("cube")),
        ("commands", json!(stack.commands)),
        ("digest", json!(stack.digest)),
        ("layers", json!(20)),
        ("first_layer", json!(0)),
        ("last_layer", json!(19)),
        ("gray_layers", json!(0)),
        ("width_px", json!(96)),
        ("height_px", json!(81)),
        ("one_size", json!(true)),
        ("dpi", json!(100.0)),
        ("bottom_mm", json!(0.0)),
        ("top_mm", json!(20.0)),
        ("thickness_um", json!([1000.0, 1000.0])),
        ("exposure_ms", json!(null)),
        ("exposure_s", json!(null)),
        ("exposed_px", json!(white)),
        ("stray_rows", json!(0)),
        ("compressions", json!(["CCITT Group 4"])),
        ("checks", json!(true)),
        ("transitions", json!(null)),
    ] {
        assert_eq!(found[key], expected, "{key}");
    }
    let volume = found["volume_mm3"].as_f64().unwrap();
    assert!((volume - white as f64 * 0.254 * 0.254).abs() < 1e-3, "{volume}");
    let transitions: usize = masks(&layers).iter().map(|mask| mask.change_count()).sum();
    assert_eq!(answer("lamp info cube.tif --json --runs")["transitions"], json!(transitions));
}

#[test]
fn info_reads_pipes_folders_and_ranges() {
    let scratch = with_cube();
    let of_file = info(&scratch, "lamp info cube.tif");
    let of_pipe = info(&scratch, "slice cube.stl --dpi 100 --thickness 1mm | lamp info");
    assert_eq!(of_pipe, of_file.replace("cube.tif", "cube (standard input)"));
    scratch.run("fix cube.tif -o pages/").succeeds();
    let of_folder = info(&scratch, "lamp info pages");
    assert_eq!(of_folder, of_file.replace("cube.tif", "pages"));
    let some = info(&scratch, "lamp info cube.tif --layers 5..8");
    assert_eq!(fact(&some, "layers"), "3 (5 to 7)");
    assert_eq!(fact(&some, "z"), "5.000 to 8.000 mm");
}

#[test]
fn info_counts_stray_rows() {
    let scratch = Scratch::new();
    scratch.run("lamp sample tower --facets 5k --defect drop --seed 7 -o broken.stl").succeeds();
    scratch.run("slice broken.stl --dpi 100 --thickness 1mm -o stray.tif").succeeds();
    let layers = scratch.layers("stray.tif");
    let rows: Vec<usize> = layers.iter().map(|layer| layer.info.stray_rows.len()).collect();
    let (count, of) = (rows.iter().sum::<usize>(), rows.iter().filter(|&&n| n > 0).count());
    assert!(count > of && of > 1);
    let text = info(&scratch, "lamp info stray.tif");
    assert_eq!(fact(&text, "stray rows"), format!("{count} in {of} layers"));
    let text = info(&scratch, "fix -q stray.tif | lamp info");
    assert_eq!(fact(&text, "stray rows"), "none known");
}

/// Returns the rows of gray levels.
type Picture = Vec<Vec<u8>>;

fn read_png(bytes: Vec<u8>) -> Picture {
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut pixels).unwrap();
    assert_eq!(
        (frame.color_type, frame.bit_depth),
        (png::ColorType::Grayscale, png::BitDepth::Eight)
    );
    pixels[..frame.buffer_size()].chunks(frame.width as usize).map(<[u8]>::to_vec).collect()
}

fn show(scratch: &Scratch, options: &str) -> Picture {
    let line = format!("lamp show blade.tif --layer 45 {options}");
    read_png(scratch.run(&line).succeeds_quietly().stdout)
}

fn with_blade() -> (Scratch, Mask) {
    let scratch = Scratch::new();
    scratch.part("blade.stl", Sample::Blade, 24_000);
    scratch.run("slice blade.stl --dpi 100 --thickness 1mm -o blade.tif").succeeds();
    let image = mask(&scratch.layers("blade.tif")[45]).clone();
    (scratch, image)
}

/// Returns a region of an image as gray levels, black outside the image.
fn levels(image: &Mask, columns: std::ops::Range<u32>, rows: std::ops::Range<u32>) -> Picture {
    let level = |column, row| if image.is_white(column, row) { 255 } else { 0 };
    rows.map(|row| columns.clone().map(|column| level(column, row)).collect()).collect()
}

#[test]
fn show_draws_the_layer_pixel_for_pixel() {
    let (scratch, image) = with_blade();
    let all = levels(&image, 0..image.width(), 0..image.height());
    assert!(show(&scratch, "") == all);
    assert!(show(&scratch, "--region 100,90,70,50") == levels(&image, 100..170, 90..140));
    // A region is clipped to the image.
    let (width, height) = (image.width(), image.height());
    let corner = levels(&image, 200..width, 200..height);
    assert!(show(&scratch, "--region 200,200,9999,9999") == corner);
    scratch.run("lamp show blade.tif --layer 45 -o layer.png").succeeds_quietly();
    assert!(read_png(scratch.bytes("layer.png")) == all);
    let piped = scratch.run_on("lamp show --layer 45", &scratch.bytes("blade.tif"));
    assert!(read_png(piped.succeeds_quietly().stdout) == all);
}

#[test]
fn show_enlarges_each_pixel_to_a_square() {
    let (scratch, image) = with_blade();
    let large = show(&scratch, "--region 100,90,70,50 --zoom 4");
    let small = levels(&image, 100..170, 90..140);
    assert_eq!((large.len(), large[0].len()), (200, 280));
    let same = |row: usize, column: usize| large[row][column] == small[row / 4][column / 4];
    assert!((0..200).all(|row| (0..280).all(|column| same(row, column))));
}

#[test]
fn show_reduces_squares_to_their_mean() {
    let (scratch, image) = with_blade();
    for (options, left, top, width, height) in [
        ("--zoom 1/8", 0, 0, image.width(), image.height()),
        ("--zoom 1/8 --region 101,93,64,40", 101, 93, 64, 40),
    ] {
        let small = show(&scratch, options);
        let size = (height.div_ceil(8) as usize, width.div_ceil(8) as usize);
        assert_eq!((small.len(), small[0].len()), size);
        for (row, column) in (0..size.0).flat_map(|row| (0..size.1).map(move |c| (row, c))) {
            let (x, y) = (left + 8 * column as u32, top + 8 * row as u32);
            // At the border of what is shown, squares have the pixels that there are.
            let square = levels(&image, x..(x + 8).min(left + width), y..(y + 8).min(top + height));
            let square = square.concat();
            let sum: u32 = square.iter().copied().map(u32::from).sum();
            let mean = (f64::from(sum) / square.len() as f64).round();
            assert_eq!(f64::from(small[row][column]), mean, "{options}: {column}, {row}");
        }
    }
}

#[test]
fn show_finds_a_layer_by_its_height() {
    let scratch = with_cube();
    let shown =
        |which: &str| scratch.run(&format!("lamp show cube.tif {which}")).succeeds_quietly().stdout;
    for (z, layer) in [("0mm", 0), ("12mm", 12), ("12.999mm", 12), ("13mm", 13), ("20mm", 19)] {
        let by_height = shown(&format!("--z {z}"));
        assert!(by_height == shown(&format!("--layer {layer}")), "{z}");
    }
    for z in ["-1um", "20.001mm"] {
        let line = format!("lamp show cube.tif --z {z}");
        scratch.run(&line).is_refused_with(&["cube.tif: no layer is at z", "0.000 to 20.000 mm"]);
    }
    lamp_tests::write_gray_ramp(&scratch.path("ramp.tif"), 8, 1);
    let words = ["ramp.tif: layer 0 states no height", "--layer"];
    scratch.run("lamp show ramp.tif --z 0mm").is_refused_with(&words);
}

#[test]
fn show_puts_layers_on_a_sheet() {
    let (scratch, image) = with_blade();
    let sheet = scratch.run("lamp show blade.tif --layers 5..127/40").succeeds_quietly().stdout;
    let sheet = read_png(sheet);
    // Layers 5, 45, 85 and 125: two on two, with gutters of 12 pixels and captions of 24.
    let (width, height) = (image.width() as usize, image.height() as usize);
    assert_eq!((sheet[0].len(), sheet.len()), (12 + 2 * (width + 12), 12 + 2 * (height + 36)));
    let cell = |column: usize, row: usize| -> Picture {
        let top = 12 + row * (height + 36);
        let left = 12 + column * (width + 12);
        sheet[top..top + height].iter().map(|row| row[left..left + width].to_vec()).collect()
    };
    for (k, layer) in [5, 45, 85, 125].into_iter().enumerate() {
        let line = format!("lamp show blade.tif --layer {layer}");
        let alone = read_png(scratch.run(&line).succeeds_quietly().stdout);
        assert!(cell(k % 2, k / 2) == alone, "layer {layer}");
    }
    // A caption has letters, from the left edge of the picture on.
    let caption = &sheet[12 + height..12 + height + 24];
    let white = |row: &Vec<u8>| row[12..].contains(&255);
    assert!(caption.iter().any(white));

    scratch.run("lamp show blade.tif --layers 200..").is_refused_with(&["no layer is in that"]);
    let large = "lamp show blade.tif --layers ..20 --zoom 100";
    scratch.run(large).is_wrong_usage(&["choose fewer layers", "--layers 0..1270/40"]);
    let both = "lamp show blade.tif --layer 3 --layers 4..6";
    scratch.run(both).is_wrong_usage(&["cannot be used with"]);
    scratch.run("lamp show blade.tif").is_wrong_usage(&["--layer <N>|--z"]);
}

#[test]
fn show_reads_no_further_than_it_shows() {
    let scratch = with_cube();
    let whole = scratch.bytes("cube.tif");
    let cut = &whole[..whole.len() - 9];
    scratch.run_on("lamp show --layers 3..19", cut).succeeds_quietly();
    scratch.run_on("lamp show --layers 3..", cut).is_refused_with(&["last whole layer is 18"]);
}

#[test]
fn show_animates_layers() {
    let (scratch, image) = with_blade();
    let line = "lamp show blade.tif --layers 5../40 --animate --fps 25 -o blade.png";
    scratch.run(line).succeeds_quietly();
    let file = scratch.bytes("blade.png");
    let mut reader = png::Decoder::new(Cursor::new(file)).read_info().unwrap();
    let animation = *reader.info().animation_control().unwrap();
    assert_eq!((animation.num_frames, animation.num_plays), (4, 0));
    let (width, height) = (image.width() as usize, image.height() as usize);
    for layer in [5, 45, 85, 125] {
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        let frame = reader.info().frame_control().unwrap();
        assert_eq!((frame.delay_num, frame.delay_den), (1, 25));
        let rows: Picture = pixels.chunks(width).map(<[u8]>::to_vec).collect();
        assert_eq!(rows.len(), height + 24);
        let line = format!("lamp show blade.tif --layer {layer}");
        let alone = read_png(scratch.run(&line).succeeds_quietly().stdout);
        assert!(rows[..height] == alone, "layer {layer}");
    }
    scratch.run("lamp info blade.png").is_refused_with(&["a picture file with several images"]);
    let alone = "lamp show blade.tif --layer 5 --animate";
    scratch.run(alone).is_wrong_usage(&["--animate", "cannot be used with", "--layer"]);
}

#[test]
fn show_draws_gray_levels() {
    let scratch = Scratch::new();
    lamp_tests::write_gray_ramp(&scratch.path("ramp.tif"), 256, 3);
    let line = "lamp show ramp.tif --layer 0";
    let picture = read_png(scratch.run(line).succeeds_quietly().stdout);
    assert_eq!(picture, vec![Vec::from_iter(0..=255); 3]);
}
