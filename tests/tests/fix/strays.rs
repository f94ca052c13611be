//! Broken parts are corrected to what whole ones give.

use lamp_tests::{Scratch, ends_white, mask, masks};

use super::{COARSE, broken_ball, pixels_off};

/// A tower that lost facets, sliced to `stray.tif`.
fn broken_tower() -> Scratch {
    let scratch = Scratch::new();
    let line = "lamp sample tower --facets 20k --defect drop --count 40 --seed 7 -o broken.stl";
    scratch.run(line).succeeds();
    scratch.run(&format!("slice broken.stl {TOWER} -o stray.tif")).succeeds();
    scratch
}

const TOWER: &str = "--dpi 150 --thickness 500um";

#[test]
fn fix_says_what_it_changed_and_leaves_no_row_that_ends_white() {
    let scratch = broken_tower();
    let ran = scratch.run("fix stray.tif --verbose -o fixed.tif").succeeds();
    let (stray, fixed) = (scratch.layers("stray.tif"), scratch.layers("fixed.tif"));
    assert_eq!(stray.len(), fixed.len());
    assert!(masks(&stray).iter().any(|mask| ends_white(mask)));
    let mut lines = ran.stderr.lines();
    for (stray, fixed) in stray.iter().zip(&fixed) {
        assert!(!ends_white(mask(fixed)) && fixed.info.stray_rows.is_empty());
        if stray.info.stray_rows.is_empty() {
            assert!(stray == fixed, "{} had nothing to mend", stray.info.name());
            continue;
        }
        let changed = pixels_off(std::slice::from_ref(stray), std::slice::from_ref(fixed)) as u64;
        let line = lines.next().expect("a line for each layer that had stray rows");
        assert!(line.starts_with(&format!("fix: {}: row", stray.info.name())), "{line}");
        assert!(line.ends_with(&format!(" corrected, {changed} pixels changed")), "{line}");
        let on_page = &fixed.info.other["fix"]["bands"];
        let pixels =
            on_page.as_array().unwrap().iter().map(|band| band["pixels"].as_u64().unwrap());
        assert_eq!(pixels.sum::<u64>(), changed);
    }
    let sum = lines.next().expect("a line that sums up");
    assert!(sum.contains(" bands of stray rows in "), "{sum}");
    assert_eq!(lines.next(), None);
}

#[test]
fn a_mended_stack_is_nearer_to_the_whole_part() {
    let scratch = broken_tower();
    scratch.run("fix stray.tif -o fixed.tif").succeeds();
    scratch.run("lamp sample tower --facets 20k -o whole.stl").succeeds();
    scratch.run(&format!("slice whole.stl {TOWER} -o whole.tif")).succeeds_quietly();
    let [whole, stray, fixed] =
        ["whole", "stray", "fixed"].map(|n| scratch.layers(&format!("{n}.tif")));
    // One hole a facet high spoils whole rows; a mended row is off by the
    // slope of the wall.
    let (stray, fixed) = (pixels_off(&whole, &stray), pixels_off(&whole, &fixed));
    assert!(stray > 5_000 && fixed * 20 < stray, "{stray} pixels off, {fixed} after the fix");
}

#[test]
fn fixing_twice_changes_no_byte() {
    let scratch = broken_tower();
    scratch.run("fix stray.tif -o fixed.tif").succeeds();
    scratch.run("fix fixed.tif -o again.tif").succeeds_quietly();
    assert!(scratch.bytes("stray.tif") != scratch.bytes("fixed.tif"));
    assert!(scratch.bytes("fixed.tif") == scratch.bytes("again.tif"));
}

/// `tile` ends what runs across where the copy's image ends, so that rows end
/// black; each copy is corrected as the part alone, except for some pixels where
/// contours close.
#[test]
fn copies_are_corrected_as_the_part_is() {
    for (seed, copies) in [(1, 2), (2, 3), (3, 8)] {
        let (scratch, _) = broken_ball(5, seed, COARSE);
        let fix = "fix --min-confidence 0 --max-width 30";
        let tile = format!("tile --mesh none --area 120x16mm --gap 1mm --copies {copies}");
        scratch.run(&format!("{fix} stray.tif | {tile} -o expected.tif")).succeeds();
        scratch.run(&format!("{tile} stray.tif -o tiled.tif")).succeeds();
        scratch.run(&format!("{fix} tiled.tif -o fixed.tif")).succeeds();
        let [expected, tiled, fixed] =
            ["expected.tif", "tiled.tif", "fixed.tif"].map(|name| scratch.layers(name));
        let (stray, left) = (pixels_off(&tiled, &expected), pixels_off(&fixed, &expected));
        assert!(stray > 1000 && left * 50 < stray, "{left} of {stray} pixels");
    }
}
