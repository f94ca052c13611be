//! Checks the layers of `slice --gray`, and `lamp cure` on them.

use std::io::Cursor;

use lamp_fixtures::{Sample, example_cylinder};
use lamp_stack::{Image, Layer, gray_runs};
use lamp_tests::{Ran, Scratch};

const COARSE: &str = "--dpi 300 --thickness 400um";

fn with_tower() -> Scratch {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 5_000);
    scratch
}

fn gray_pixels(image: &Image) -> u64 {
    let Image::Gray(gray) = image else { return 0 };
    let runs = gray.rows().flat_map(|row| gray_runs(row, gray.width()));
    runs.filter(|run| run.2 < 255).map(|run| u64::from(run.1 - run.0)).sum()
}

/// The levels of all pixels.
fn levels(image: &Image) -> Vec<u8> {
    let width = image.width();
    let rows: Vec<Vec<(u32, u32, u8)>> = match image {
        Image::Gray(gray) => gray.rows().map(|row| gray_runs(row, width).collect()).collect(),
        Image::Mask(mask) => {
            let white = |pair: &[u32]| (pair[0], pair.get(1).copied().unwrap_or(width), 255);
            mask.rows().map(|row| row.chunks(2).map(white).collect()).collect()
        }
    };
    let mut levels = Vec::new();
    for runs in rows {
        let mut row = vec![0; width as usize];
        runs.iter().for_each(|&(from, to, level)| row[from as usize..to as usize].fill(level));
        levels.extend(row);
    }
    levels
}

#[test]
fn gray_edges_go_through_the_pipeline() {
    let scratch = with_tower();
    scratch.run(&format!("slice tower.stl {COARSE} -o white.tif")).succeeds_quietly();
    scratch.run(&format!("slice tower.stl {COARSE} --antialias -o edges.tif")).succeeds_quietly();
    let (white, edges) = (scratch.layers("white.tif"), scratch.layers("edges.tif"));
    assert_eq!(white.len(), edges.len());
    for (white, edges) in white.iter().zip(&edges) {
        let (white, edges) = (levels(&white.image), levels(&edges.image));
        let sum = |levels: &[u8]| levels.iter().map(|&level| f64::from(level)).sum::<f64>();
        // Centers miss areas by a share of the outline, a few of thousands of pixels.
        assert!((sum(&edges) / sum(&white) - 1.0).abs() < 0.02);
        assert!(white.iter().zip(&edges).all(|(white, level)| white.abs_diff(*level) < 255));
    }
    assert!(edges.iter().map(|layer| gray_pixels(&layer.image)).sum::<u64>() > 10_000);
    let stack = edges[0].info.stack.as_ref().unwrap();
    assert!(stack.commands[0].contains(" --antialias"), "{}", stack.commands[0]);

    scratch.run("dither edges.tif -q -o dots.tif").succeeds_quietly();
    let dots = scratch.layers("dots.tif");
    let white = |layer: &Layer| levels(&layer.image).iter().filter(|level| **level > 0).count();
    for (dots, edges) in dots.iter().zip(&edges) {
        assert!(matches!(*dots.image, Image::Mask(_)));
        let sum: f64 = levels(&edges.image).iter().map(|&level| f64::from(level)).sum();
        assert!((white(dots) as f64 / (sum / 255.0) - 1.0).abs() < 0.02);
    }

    let gray = "--gray --material lamp-suspension";
    scratch.run(&format!("slice tower.stl {COARSE} {gray} -o gray.tif")).succeeds();
    let line = format!("slice tower.stl {COARSE} {gray} --antialias -o both.tif");
    scratch.run(&line).succeeds();
    let (by_depth, both) = (scratch.layers("gray.tif"), scratch.layers("both.tif"));
    for ((both, by_depth), edges) in both.iter().zip(&by_depth).zip(&edges) {
        let [both, by_depth, shares] = [both, by_depth, edges].map(|layer| levels(&layer.image));
        for ((level, depth), share) in both.into_iter().zip(by_depth).zip(shares) {
            let product = (u32::from(depth) * u32::from(share) + 127) / 255;
            assert!(level <= share && (depth == 0 || u32::from(level) == product));
        }
    }
    let line = format!("slice tower.stl {COARSE} {gray} --print-through --antialias -o x.tif");
    is_wrong_usage(&scratch.run(&line), "--antialias");
}

#[test]
fn gray_stacks_go_through_the_pipeline() {
    let scratch = with_tower();
    let line = format!("slice tower.stl {COARSE} --gray --material lamp-suspension -o gray.tif");
    // White that just cures its layer bonds to nothing.
    let said = scratch.run(&line).succeeds().stderr;
    let words = "white cures 1 layer deep: no layer bonds to the layer below";
    assert!(said.contains(words) && said.lines().count() == 1, "{said}");
    let gray = scratch.layers("gray.tif");
    assert_eq!(gray.len(), 190);
    // The cylinder and the cone face no downward slope.
    assert!(gray[..90].iter().all(|layer| matches!(*layer.image, Image::Mask(_))));
    assert!(gray.iter().map(|layer| gray_pixels(&layer.image)).sum::<u64>() > 1_000);
    // 137.4 mJ/cm2 exp(400/215.2) at 1.6 W/cm2.
    assert!(gray.iter().all(|layer| layer.info.exposure_ms == Some(550.942)));
    let stack = gray[0].info.stack.as_ref().unwrap();
    assert!(stack.commands[0].contains("--gray --material lamp-suspension@blake3:"));

    let line = format!(
        "slice tower.stl {COARSE} --gray --material lamp-suspension | fix | dither -q > dots.tif"
    );
    scratch.run(&line).succeeds();
    let dots = scratch.layers("dots.tif");
    assert!(dots.iter().all(|layer| matches!(*layer.image, Image::Mask(_))));
    assert!(dots.iter().all(|layer| layer.info.exposure_ms == Some(550.942)));
    let said = scratch.run("lamp info gray.tif").succeeds().stdout;
    let said = String::from_utf8(said).unwrap();
    for line in ["of them gray", "exposure:   550.942 ms", "CCITT Group 4 and Deflate"] {
        assert!(said.contains(line), "{said}");
    }
}

/// Levels are shares of a dose, which a material without an intensity has, too.
#[test]
fn levels_need_no_light() {
    let scratch = with_tower();
    let show = scratch.run("lamp material show lamp-suspension").succeeds().stdout;
    let bright = String::from_utf8(show).unwrap();
    let (head, rest) = bright.split_once("[intensity]").unwrap();
    let rest = rest.split_once("[working-curve.critical-dose]").unwrap().1;
    let dark = format!("{head}[working-curve.critical-dose]{rest}");
    scratch.write("dark.toml", dark.as_bytes());
    for (material, name) in [("lamp-suspension", "bright"), ("dark.toml", "dark")] {
        let line = format!("slice tower.stl {COARSE} --gray --material {material} -o {name}.tif");
        scratch.run(&line).succeeds();
    }
    let [bright, dark] = ["bright.tif", "dark.tif"].map(|name| scratch.layers(name));
    assert!(bright.iter().any(|layer| matches!(*layer.image, Image::Gray(_))));
    for (bright, dark) in bright.iter().zip(&dark) {
        // Times are rounded to a microsecond, which may move a level by one.
        let differ = |(a, b): (u8, u8)| a.abs_diff(b) > 1;
        assert!(!levels(&bright.image).into_iter().zip(levels(&dark.image)).any(differ));
        assert_eq!(dark.info.exposure_ms, None);
    }
    let line = format!("slice tower.stl {COARSE} --material dark.toml -o white.tif");
    scratch.run(&line).is_refused_with(&["how bright full white is", "[intensity]"]);
}

#[test]
fn a_lamp_that_has_aged_exposes_for_longer() {
    let scratch = with_tower();
    let slice = format!("slice tower.stl {COARSE} --gray --material lamp-suspension");
    let line = format!("{slice} --lamp-intensity 75% -o aged.tif");
    scratch.run(&line).succeeds();
    let aged = scratch.layers("aged.tif");
    // (137.4 - 0.4 * 18.31) mJ/cm2 exp(400/215.2) at 1.2 W/cm2 (002 eq. 36 and 40).
    let ms = aged[0].info.exposure_ms.unwrap();
    assert!((ms - 695.432).abs() < 1e-3, "{ms}");
    let command = &aged[0].info.stack.as_ref().unwrap().commands[0];
    assert!(command.contains("--lamp-intensity 75%"), "{command}");
    // The recorded command makes the same stack.
    assert!(scratch.run(command).succeeds().stdout == scratch.bytes("aged.tif"));
    // A lamp as it was changes nothing.
    scratch.run(&format!("{slice} -o new.tif")).succeeds();
    scratch.run(&format!("{slice} --lamp-intensity 1.6W/cm2 -o same.tif")).succeeds();
    let [new, same] = ["new.tif", "same.tif"].map(|name| scratch.layers(name));
    assert!(new.iter().zip(&same).all(|(a, b)| a.image == b.image));
    assert_eq!(new[0].info.exposure_ms, same[0].info.exposure_ms);
    let weak = scratch.run(&format!("{slice} --lamp-intensity od0.6 -o weak.tif")).succeeds();
    assert!(weak.stderr.contains("was measured under 512 to 1600 mW/cm"), "{weak:?}");
    // Cured under the same lamp, white is as deep as the layer.
    let cure = "lamp cure aged.tif --material lamp-suspension --section y=0mm -o s.png";
    let white = |line: &str| -> f64 {
        let said = String::from_utf8(scratch.run(line).succeeds().stdout).unwrap();
        let row = said.lines().find(|line| line.starts_with("white ")).unwrap();
        row.rsplit(' ').next().unwrap().parse().unwrap()
    };
    let [under, not] = [white(&format!("{cure} --lamp-intensity 75%")), white(cure)];
    assert!(not > under, "{not} {under}");
    for wrong in ["0%", "od9", "bright"] {
        let ran = scratch.run(&format!("{slice} --lamp-intensity {wrong} -o w.tif"));
        is_wrong_usage(&ran, "is not");
    }
}

#[test]
fn a_material_alone_says_how_long_white_layers_are_exposed() {
    let scratch = with_tower();
    scratch.run(&format!("slice tower.stl {COARSE} -o plain.tif")).succeeds_quietly();
    let line = format!("slice tower.stl {COARSE} --material mine.toml --overcure 1.5 -o timed.tif");
    scratch.run("lamp material show lamp-suspension > mine.toml").succeeds();
    // Doses beyond the range that 002 measured are reported.
    let said = scratch.run(&line).succeeds().stderr;
    let words = "layers get 2233 mJ/cm2, but lamp-suspension was measured at 320 to 1920 mJ/cm2";
    assert!(said.contains(words) && said.lines().count() == 1, "{said}");
    let (plain, timed) = (scratch.layers("plain.tif"), scratch.layers("timed.tif"));
    // A material may state how deep white cures, and the option counts more than that.
    let stated = String::from_utf8(scratch.bytes("mine.toml")).unwrap()
        + "\n[overcure]\nvalue = 1.5\nsource = \"a\"\n";
    scratch.write("stated.toml", stated.as_bytes());
    for (options, overcure, ms) in [("", "1.5", 1395.5), (" --overcure 1", "1", 550.942)] {
        let line =
            format!("slice tower.stl {COARSE} --material stated.toml{options} -o stated.tif");
        scratch.run(&line).succeeds();
        let stated = scratch.layers("stated.tif");
        let found = stated[0].info.exposure_ms.unwrap();
        assert!((found - ms).abs() < 1.0, "{found}");
        let command = &stated[0].info.stack.as_ref().unwrap().commands[0];
        assert!(command.contains(&format!(" --overcure {overcure} ")), "{command}");
    }
    for (plain, timed) in plain.iter().zip(&timed) {
        assert!(plain.image == timed.image);
        let ms = timed.info.exposure_ms.unwrap();
        assert!((ms - 1395.5).abs() < 1.0, "{ms}");
    }
}

#[track_caller]
fn is_wrong_usage(ran: &Ran, word: &str) {
    assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
    assert!(ran.stderr.contains(word), "{ran:?}");
}

#[test]
fn what_cannot_be_exposed_is_refused() {
    let scratch = with_tower();
    for (options, word) in [
        ("--gray", "--material"),
        ("--overcure 2", "--material"),
        ("--gray --material lamp-suspension --plane middle", "--plane"),
        ("--gray --material lamp-suspension --overcure 0", "is not a depth in layers"),
    ] {
        let line = format!("slice tower.stl {COARSE} {options} -o out.tif");
        is_wrong_usage(&scratch.run(&line), word);
    }
    for (options, words) in [
        ("--gray --material none", &["nor a material of that name", "lamp-suspension"][..]),
        ("--gray --material none.toml", &["none.toml"]),
        ("--material lamp-no-absorber", &["how bright"]),
        ("--gray --material tmpta", &["no cure model"]),
        ("--gray --material pegda-mw700", &["all depths"]),
    ] {
        let line = format!("slice tower.stl {COARSE} {options} -o out.tif");
        scratch.run(&line).is_refused_with(words);
        assert!(!scratch.path("out.tif").exists());
    }
}

#[test]
fn no_input_is_overwritten() {
    let scratch = with_tower();
    scratch.run("lamp material show lamp-suspension > mine.toml").succeeds();
    let gray = format!("slice tower.stl {COARSE} --gray --material mine.toml");
    scratch.run(&format!("{gray} -o gray.tif")).succeeds();
    let cure = "lamp cure gray.tif --material mine.toml --section y=0mm --part tower.stl";
    for line in [
        "slice tower.stl -o tower.stl",
        "slice tower.stl -o t.tif --report ./tower.stl",
        &format!("{gray} -o mine.toml"),
        &format!("{gray} -o t.tif --report mine.toml"),
        &format!("{cure} -o mine.toml"),
        &format!("{cure} -o tower.stl"),
        &format!("{cure} -o gray.tif"),
    ] {
        // Where an ending names another format, that comes first.
        assert_eq!(scratch.run(line).statuses, [Some(2)], "{line}");
    }
    scratch.run(&format!("{cure} -o s.png")).succeeds();
}

#[test]
fn exposures_that_are_none_are_refused() {
    let scratch = with_tower();
    scratch.run(&format!("slice tower.stl {COARSE} --layers 0..3 -o t.tif")).succeeds_quietly();
    for (key, value) in [("exposure_ms", -17.5), ("exposure_ms", 0.0), ("thickness_um", 0.0)] {
        let mut layers = scratch.layers("t.tif");
        match key {
            "exposure_ms" => layers[1].info.exposure_ms = Some(value),
            _ => layers[1].info.thickness_um = Some(value),
        }
        scratch.stack("bad.tif", layers);
        let line = "lamp cure bad.tif --material lamp-suspension --section y=0mm -o s.png";
        scratch.run(line).is_refused_with(&["layer 1", "not above zero"]);
    }
}

/// Returns the areas that `lamp cure` prints for each panel: overshoot and missing.
fn areas(text: &[u8]) -> Vec<[f64; 2]> {
    let text = std::str::from_utf8(text).unwrap();
    let rows = text.lines().filter(|line| line.starts_with("white ") || line.starts_with("gray "));
    rows.map(|row| {
        let numbers: Vec<f64> =
            row.split_whitespace().skip(1).map(|number| number.parse().unwrap()).collect();
        [numbers[2], numbers[3]]
    })
    .collect()
}

/// Returns the width of a color picture and its pixels row by row.
fn rgb_pixels(png: &[u8]) -> (usize, Vec<[u8; 3]>) {
    let mut reader = png::Decoder::new(Cursor::new(png)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgb);
    (info.width as usize, bytes.as_chunks().0.to_vec())
}

#[test]
fn a_section_shows_what_gray_saves() {
    let scratch = with_tower();
    let placed = "--rotate z:30 --translate 3,-2,5";
    let line =
        format!("slice tower.stl {COARSE} {placed} --gray --material lamp-suspension -o gray.tif");
    scratch.run(&line).succeeds();
    for section in ["y=-2mm", "x=3.4mm", "y=1in"] {
        let line = format!(
            "lamp cure gray.tif --material lamp-suspension --section {section} --part tower.stl --alone -o s.png"
        );
        if section == "y=1in" {
            scratch.run(&line).is_refused_with(&["y = 25.400 mm", "outside its images"]);
            continue;
        }
        let ran = scratch.run(&line).succeeds();
        let [white, gray] = areas(&ran.stdout)[..] else { panic!("two panels") };
        // Pixels are 85 um wide, and gray has one depth all over each.
        assert!(white[0] > 1.0 && gray[0] < 0.2 * white[0], "{white:?} {gray:?}");
        assert!((gray[1] - white[1]).abs() < 0.12 * white[0], "{white:?} {gray:?}");
        let (width, pixels) = rgb_pixels(&scratch.bytes("s.png"));
        // Red only on the left, blue on both sides. The legend below has both.
        let count = |colour: [u8; 3], left: bool| {
            let end = pixels.len() - 88 * width;
            let of_half = |k: usize| (k % width < width / 2) == left && k < end;
            (0..).zip(&pixels).filter(|(k, pixel)| of_half(*k) && **pixel == colour).count()
        };
        let [red, blue] = [[226, 72, 52], [52, 130, 226]];
        assert!(count(red, true) > 50 && count(red, false) < count(red, true) / 20);
        assert!(count(blue, true) > 50 && count(blue, false) > 50);
    }
}

#[test]
fn print_through_stays_in_the_part() {
    let scratch = with_tower();
    let slice = "slice tower.stl --dpi 600 --thickness 200um --material lamp-suspension";
    scratch.run(&format!("{slice} -o white.tif")).succeeds();
    scratch.run(&format!("{slice} --gray --print-through -o summed.tif")).succeeds();
    let line = "lamp cure summed.tif --material lamp-suspension --section y=0mm --part tower.stl";
    let ran = scratch.run(&format!("{line} -o s.png")).succeeds_quietly();
    let [white, gray] = areas(&ran.stdout)[..] else { panic!("two panels") };
    assert!(white[0] > 1.0 && gray[0] < 0.1 * white[0], "{white:?} {gray:?}");
    assert!(gray[1] < white[1] + 0.1 * white[0], "{white:?} {gray:?}");
    // Outlines are the outlines of white, except pixels whose centers are on the underside.
    let (white, summed) = (scratch.layers("white.tif"), scratch.layers("summed.tif"));
    let lit = |image: &Image| -> u64 {
        let runs = (0..image.height()).flat_map(|row| image.runs(row));
        runs.map(|(start, end, _)| u64::from(end - start)).sum()
    };
    let count = |layers: &[Layer]| layers.iter().map(|layer| lit(&layer.image)).sum::<u64>();
    let [white, all] = [&white, &summed].map(|layers| count(layers));
    assert!(all <= white && white - all < 100, "{white} {all}");
    let command = &summed[0].info.stack.as_ref().unwrap().commands[0];
    assert!(command.contains(" --gray --print-through --material"), "{command}");

    scratch
        .run(&format!("{slice} --gray --print-through --layers 200..210 -o range.tif"))
        .succeeds();
    let range = scratch.layers("range.tif");
    assert!(range.iter().zip(&summed[200..]).all(|(a, b)| a.image == b.image));
    let line = format!("{slice} --gray --print-through --overcure 0.5 -o short.tif");
    let ran = scratch.run(&line).succeeds();
    assert!(ran.stderr.contains("not cured down to the underside"), "{ran:?}");
    is_wrong_usage(&scratch.run(&format!("{slice} --print-through -o x.tif")), "--gray");
    let line = format!("{slice} --gray --print-through --fallback tower.stl -o x.tif");
    is_wrong_usage(&scratch.run(&line), "--fallback");
}

#[test]
fn rows_that_end_white_get_levels_too() {
    let scratch = Scratch::new();
    let mut ended_white = 0;
    for seed in 1..=4 {
        let sample = format!("lamp sample sphere --defect drop --count 1 --seed {seed}");
        scratch.run(&format!("{sample} -o open{seed}.stl")).succeeds();
        let slice = format!("slice open{seed}.stl --dpi 200 --material lamp-suspension --gray");
        scratch.run(&format!("{slice} --print-through -o summed{seed}.tif")).succeeds();
        for Layer { image, .. } in scratch.layers(&format!("summed{seed}.tif")) {
            let width = image.width();
            let ends_white = |row: &u32| image.runs(*row).last().is_some_and(|run| run.1 == width);
            ended_white += (0..image.height()).filter(ends_white).count();
        }
    }
    assert!(ended_white > 0, "no row ends white");
}

#[test]
fn a_section_needs_its_own_part() {
    let scratch = with_tower();
    scratch.part("cube.stl", Sample::Cube, 200);
    scratch.run(&format!("slice tower.stl {COARSE} -o white.tif")).succeeds_quietly();
    let cure = "lamp cure white.tif --material lamp-suspension --section y=0mm";
    scratch.run(&format!("{cure} --part cube.stl -o s.png")).is_refused_with(&["not sliced from"]);
    let ran =
        scratch.run(&format!("{cure} --part tower.stl --layers 100..120 -o s.png")).succeeds();
    assert_eq!(areas(&ran.stdout).len(), 1);
    let said = scratch.run(&format!("{cure} -o s.png")).succeeds().stdout;
    assert!(String::from_utf8(said).unwrap().contains("cured 14"));
    is_wrong_usage(&scratch.run(&format!("{cure} -o white.tif")), "that is an input");
    let upright = cure.replace("y=0mm", "z=0mm");
    is_wrong_usage(&scratch.run(&format!("{upright} -o t.png")), "is not a section");
    let line = format!("{cure} --along 90mm..95mm -o t.png");
    scratch.run(&line).is_refused_with(&["no pixel of the section"]);
    scratch.run(&format!("{cure} --zoom 1000 -o t.png")).is_refused_with(&["smaller --zoom"]);
    assert!(!scratch.path("t.png").exists());
}

/// The colors of what is cured, and of what is not.
const CURED: [u8; 3] = [200, 204, 208];
const EMPTY: [u8; 3] = [24, 26, 30];

#[test]
fn a_section_is_also_drawn_as_shapes() {
    let scratch = with_tower();
    scratch.run("slice tower.stl --dpi 300 --thickness 500um -o t.tif").succeeds_quietly();
    let cure =
        "lamp cure t.tif --material lamp-suspension --section y=0mm --part tower.stl --alone";
    let said = scratch.run(&format!("{cure} -o s.svg")).succeeds_quietly().stdout;
    let text = String::from_utf8(scratch.bytes("s.svg")).unwrap();
    // The area that each color covers, of rectangles M x y H x V y H x Z.
    let area = |color: &str| -> f64 {
        let begin = format!("fill=\"{color}\" d=\"");
        let path = text.split(&begin).nth(1).unwrap().split('"').next().unwrap();
        let rectangles = path.split('Z').filter(|rectangle| !rectangle.is_empty());
        rectangles
            .map(|rectangle| {
                let numbers: Vec<f64> = rectangle
                    .split(|c: char| !(c.is_ascii_digit() || c == '.'))
                    .filter_map(|number| number.parse().ok())
                    .collect();
                let [left, top, right, bottom, _] = numbers[..] else { panic!("{rectangle}") };
                (right - left) * (bottom - top)
            })
            .sum()
    };
    let side_mm = 25.4 / 300.0;
    let [cured, over, missing] =
        ["#c8ccd0", "#e24834", "#3482e2"].map(|color| area(color) * side_mm * side_mm);
    let [overshoot, lost] = areas(&said)[0];
    // Shapes are of pixels' centers, the printed areas of the part's outline within each pixel.
    assert!((over - overshoot).abs() < 0.05 * overshoot, "{over} {overshoot}");
    assert!((missing - lost).abs() < 0.1 * lost.max(0.2), "{missing} {lost}");
    assert!(cured > 10.0 * over, "{cured}");
    assert!(text.contains("x (mm)") && text.contains("z (mm)"));
    is_wrong_usage(&scratch.run(&format!("{cure} -o s.pdf")), "end its name in .svg or .png");
}

#[test]
fn doses_add_up_to_those_of_001() {
    let scratch = Scratch::new();
    let mut layers: Vec<_> = example_cylinder().layers().collect();
    layers.iter_mut().for_each(|layer| layer.info.exposure_ms = Some(1000.0));
    scratch.stack("cylinder.tif", layers);
    let cure = "lamp cure cylinder.tif --material zsg-amber --section y=0.0392mm -o s.png";
    let said = scratch.run(&format!("{cure} --dose-at top")).succeeds_quietly().stdout;
    let said = String::from_utf8(said).unwrap();
    // Figure A.21: all 7 x 7 pixels of the third layer, and so of those below; 21 voxels here.
    assert!(said.contains("white   cured 0.0026\n"), "{said}");
    let (width, pixels) = rgb_pixels(&scratch.bytes("s.png"));
    // Below the title and beside the heights.
    let section = |row: usize| &pixels[(60 + row) * width + 76..][..7];
    for row in 0..5 {
        assert_eq!(section(row), [if row < 2 { EMPTY } else { CURED }; 7], "{row}");
    }
    let beside = |row: usize, column: usize| pixels[row * width + column];
    assert_eq!([beside(59, 76), beside(62, 83)], [[255; 3]; 2]);
    // A layer's bottom has 10^-0.008 of its top's dose: too little only in corners.
    let bottom = scratch.run(&format!("{cure} --dose-at bottom")).succeeds_quietly().stdout;
    assert_eq!(String::from_utf8(bottom).unwrap(), said);
    is_wrong_usage(&scratch.run(&format!("{cure} --dose-at bottom --alone")), "--alone");
    is_wrong_usage(&scratch.run(&format!("{cure} --add-up --alone")), "--alone");
    let told = |options: &str, material: &str| {
        let line = format!("{cure} {options}").replace("zsg-amber", material);
        String::from_utf8(scratch.run(&line).succeeds_quietly().stdout).unwrap()
    };
    assert_eq!(told("", "zsg-amber"), told("--add-up", "zsg-amber"));
    for (options, material, words) in [
        ("", "zsg-amber", "doses added up, with spread"),
        ("", "lamp-suspension", "doses added up straight down"),
        ("--dose-at top", "lamp-suspension", "doses added up layer by layer"),
        ("--alone", "lamp-suspension", "each layer alone"),
    ] {
        assert!(told(options, material).contains(words), "{options} {material}");
    }
}
