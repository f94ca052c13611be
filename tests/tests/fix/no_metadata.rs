//! Stacks without our metadata, as other programs write them, and gray stacks.

use lamp_stack::{Image, Layer};
use lamp_tests::{Scratch, at_least, mask, stripped, with_soft_edges};

use super::{COARSE, bands, broken_ball, is_corrected, number, pixels_off, report};

#[test]
fn a_stack_without_metadata_is_corrected_to_the_same_pixels() {
    for seed in [1, 2, 3] {
        let (scratch, _) = broken_ball(5, seed, COARSE);
        scratch.run("fix stray.tif --max-width 40 -o fixed.tif").succeeds();
        scratch.stack("bare.tif", stripped(&scratch.layers("stray.tif")));
        scratch.run("fix bare.tif --max-width 40 -o bare_fixed.tif").succeeds();
        scratch.run(&format!("slice whole.stl {COARSE} -o whole.tif")).succeeds();
        let whole = scratch.layers("whole.tif");
        // Rows alone leave open where contours break off, so a pixel may differ here and there.
        let wrong = |name: &str| pixels_off(&scratch.layers(name), &whole);
        let [stray, fixed, bare] = ["stray.tif", "fixed.tif", "bare_fixed.tif"].map(wrong);
        let most = stray / 50;
        assert!(stray > 1000 && fixed <= most && bare <= most, "{seed}: {stray} {fixed} {bare}");
    }
}

fn gray(layers: &[Layer]) -> Vec<Layer> {
    let soft =
        |layer: &Layer| Layer { image: with_soft_edges(mask(layer)).into(), ..layer.clone() };
    layers.iter().map(soft).collect()
}

#[test]
fn gray_rows_end_black_and_good_ones_stay() {
    for strip in [false, true] {
        let (scratch, _) = broken_ball(5, 1, COARSE);
        let stray = gray(&scratch.layers("stray.tif"));
        let stray = if strip { stripped(&stray) } else { stray };
        scratch.stack("stray.tif", stray.iter().cloned());
        let (report, ran) = report(&scratch, "--max-width 40");
        ran.succeeds();
        assert!(bands(&report).iter().all(is_corrected));
        let fixed = scratch.layers("fixed.tif");
        let mut stray_rows = 0;
        for (stray, fixed) in stray.iter().zip(&fixed) {
            let (Image::Gray(before), Image::Gray(after)) = (&*stray.image, &*fixed.image) else {
                panic!("gray stays gray");
            };
            for row in 0..before.height() {
                assert!(after.row(row).last().is_none_or(|change| change.level == 0));
                let is_stray = bands(&report).iter().any(|band| {
                    band["layer"] == stray.info.index
                        && (number(&band["first_row"])..=number(&band["last_row"])).contains(&row)
                });
                stray_rows += usize::from(is_stray);
                assert_eq!(before.row(row) == after.row(row), !is_stray, "row {row}");
            }
        }
        assert!(stray_rows > 20);
    }
}

#[test]
fn gray_outlines_are_corrected_as_masks_are() {
    let (scratch, _) = broken_ball(5, 2, COARSE);
    scratch.run("fix stray.tif --max-width 40 -o fixed.tif").succeeds();
    let masks = scratch.layers("fixed.tif");
    scratch.stack("stray.tif", gray(&scratch.layers("stray.tif")));
    scratch.run("fix stray.tif --max-width 40 -o fixed.tif").succeeds();
    for (gray, whole) in scratch.layers("fixed.tif").iter().zip(&masks) {
        let Image::Gray(gray) = &*gray.image else { panic!("gray stays gray") };
        assert!(at_least(gray, 1) == *mask(whole), "{}", whole.info.name());
    }
}

#[test]
fn a_clean_gray_stack_passes_byte_for_byte() {
    let scratch = Scratch::new();
    let (clean, _) = broken_ball(0, 1, COARSE);
    let clean = gray(&clean.layers("stray.tif"));
    for layers in [stripped(&clean), clean] {
        scratch.stack("clean.tif", layers);
        scratch.run("fix clean.tif -o fixed.tif").succeeds_quietly();
        assert!(scratch.bytes("clean.tif") == scratch.bytes("fixed.tif"));
    }
}
