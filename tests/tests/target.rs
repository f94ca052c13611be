//! Checks the test images of `lamp target` pixel by pixel.

use lamp_stack::Image;
use lamp_tests::{Scratch, mask};
use serde_json::json;

const SIZES: [u32; 10] = [25, 50, 75, 100, 200, 300, 450, 600, 750, 900];

#[test]
fn every_square_of_every_size_gets_its_dose() {
    let scratch = Scratch::new();
    let line = "lamp target squares --doses 60..600mJ/cm2 --material lamp-suspension -o targets/";
    scratch.run(line).succeeds();
    for size in SIZES {
        let name = format!("targets/squares_{size:05}px.tif");
        let pages = scratch.layers(&name);
        assert_eq!(pages.len(), 10, "{name}");
        let width = 59 + 5 * (size + 59);
        for (j, page) in (0..).zip(&pages) {
            let image = mask(page);
            assert_eq!(image.width(), width.next_multiple_of(32));
            assert_eq!(image.height(), 59 + 2 * (size + 59));
            assert_eq!(image.white_pixels(), (10 - j) * u64::from(size * size), "{name}: {j}");
            assert_eq!(page.info.other["feature_px"], json!(size));
            assert_eq!(page.info.other["dose_mj_per_cm2"], json!(60.0 * (j + 1) as f64));
            assert_eq!(page.pitch.unwrap().x.get(), 1500.0);
        }
        for tile in 0..10 {
            let middle = |of: u32| 59 + of * (size + 59) + size / 2;
            let (x, y) = (middle(tile % 5), middle(tile / 5));
            let white = pages.iter().filter(|page| mask(page).is_white(x, y));
            let ms: f64 = white.map(|page| page.info.exposure_ms.unwrap()).sum();
            // At 1.6 W/cm².
            let dose = 60.0 * f64::from(tile + 1);
            assert!((1.6 * ms - dose).abs() < 1e-9, "{name}: {dose} after {ms} ms");
        }
    }
}

#[test]
fn the_table_to_fill_in_is_what_calibrate_reads() {
    let scratch = Scratch::new();
    let line = "lamp target squares --doses 60..600mJ/cm2 --sizes 450,25 --intensity 1.6W/cm2 \
                -o targets";
    scratch.run(line).succeeds();
    scratch
        .run("lamp target squares --doses 1mJ/cm2 --intensity 1W/cm2 -o targets")
        .is_refused_with(&["targets"]);
    let table = String::from_utf8(scratch.bytes("targets/squares.csv")).unwrap();
    scratch
        .run("lamp calibrate width targets/squares.csv")
        .is_refused_with(&["no row below the header holds a measurement"]);
    // Each square grows by 0.1 um per mJ/cm² above 100.
    let filled = table.lines().map(|line| {
        let cells: Vec<f64> = line.split(',').filter_map(|cell| cell.parse().ok()).collect();
        let [pixels, dose] = cells[..] else { return format!("{line}\n") };
        format!("{line}{}\n", pixels * 25_400.0 / 1500.0 + 0.2 * (dose - 100.0_f64).max(0.0))
    });
    scratch.write("filled.csv", filled.collect::<String>().as_bytes());
    let ran = scratch.run("lamp calibrate width filled.csv").succeeds();
    let said = String::from_utf8(ran.stdout).unwrap();
    assert!(said.starts_with("20 points of 20 rows (0 washed away, 0 blank left out)"), "{said}");
    assert_eq!(said.matches("Dp^w (um/(mJ/cm2))             0.10000").count(), 2, "{said}");
    assert_eq!(said.matches("Ec^w (mJ/cm2)                   100.00").count(), 2, "{said}");
}

#[test]
fn equal_targets_are_equal_bytes() {
    let scratch = Scratch::new();
    for folder in ["a", "b"] {
        let line = "lamp target squares --doses 10,20.5,40mJ/cm2 --sizes 30 --gap 0.5mm \
                    --intensity 20mW/cm2 -o";
        scratch.run(&format!("{line} {folder}")).succeeds();
    }
    let [a, b] = ["a", "b"].map(|folder| scratch.bytes(&format!("{folder}/squares_00030px.tif")));
    assert_eq!(a, b);
    let first = &scratch.layers("a/squares_00030px.tif")[0].info;
    let command = &first.stack.as_ref().unwrap().commands[0];
    assert_eq!(
        command,
        "target squares --dpi 1500 --sizes 30 --doses 10,20.5,40mJ/cm2 --intensity 20mW/cm2 --gap 500um"
    );
    assert_eq!(first.exposure_ms, Some(500.0));
}

#[test]
fn screens_are_checkerboards_of_the_study() {
    let scratch = Scratch::new();
    scratch.run("lamp target screens --expose 600ms -o screens.tif").succeeds();
    let pages = scratch.layers("screens.tif");
    let [page] = &pages[..] else { panic!("{} pages", pages.len()) };
    assert_eq!(page.info.exposure_ms, Some(600.0));
    let Image::Gray(image) = &*page.image else { panic!("it is gray") };
    let level = |x: u32, y: u32| {
        let row = image.row(y);
        row.iter().take_while(|change| change.column <= x).last().map_or(0, |change| change.level)
    };
    let gap = 59;
    assert_eq!(level(gap, gap), 128);
    for (tile, cell) in [(1, 1), (2, 5), (3, 10), (4, 15)] {
        let left = gap + tile * (720 + gap);
        for (x, y) in [(0, 0), (cell - 1, 0), (cell, 0), (0, cell), (cell, cell), (719, 719)] {
            let white = (x / cell + y / cell) % 2 == 0;
            assert_eq!(level(left + x, gap + y), if white { 255 } else { 0 }, "{cell}: {x}, {y}");
        }
        assert_eq!((level(left - 1, gap), level(left + 720, gap)), (0, 0));
    }
    // The gray tile as dots, and the screens unchanged.
    scratch.run("lamp target screens --gray-level 25% | dither > dots.tif").succeeds();
    let white = mask(&scratch.layers("dots.tif")[0]).white_pixels() as f64;
    assert!((white / (5.0 * 720.0 * 720.0) - 0.25).abs() < 0.001, "{white}");
}

#[test]
fn impossible_targets_are_wrong_usage() {
    let scratch = Scratch::new();
    let squares = "lamp target squares -o targets --intensity 1W/cm2";
    for (line, words) in [
        ("lamp target", "Usage"),
        ("lamp target squares -o targets --doses 1,2mJ/cm2", "--intensity"),
        ("lamp target squares -o t --doses 1mJ/cm2 --material sl-5510", "give --intensity"),
        (&format!("{squares} --doses 2,1mJ/cm2"), "go up"),
        (&format!("{squares} --doses 1,2"), "is not a dose"),
        (&format!("{squares} --doses 1,2mJ/cm2 --sizes 25,0"), "squares of 0 pixels"),
        (&format!("{squares} --doses 1,2mJ/cm2 --sizes 25,30,25"), "25 is given twice"),
        (&format!("{squares} --doses 1e-300..1e300mJ/cm2"), "is not a plausible dose"),
        (&format!("{squares} --doses 1,2mJ/cm2 --gap 0um"), "it must be above zero"),
        (&format!("{squares} --doses 1,2mJ/cm2 --gap 1um"), "gaps of 0 pixels"),
        ("lamp target screens --gray-level 120% -o a.tif", "0% (black) to 100% (white)"),
        ("lamp target screens --tile 9999999 -o a.tif", "tiles of 9999999 pixels"),
        ("lamp target screens --squares 0 -o a.tif", "screen squares of 0 pixels"),
    ] {
        let ran = scratch.run(line);
        assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
        assert!(ran.stderr.contains(words), "no `{words}` in {ran:?}");
    }
    assert_eq!(scratch.names(), [] as [&str; 0]);
}
