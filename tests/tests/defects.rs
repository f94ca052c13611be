//! Broken meshes: `slice` reports unbalanced rows, `fix` corrects them, and whole parts pass
//! unchanged.

use lamp_fixtures::Sample;
use lamp_stack::Layer;
use lamp_tests::{Ran, Scratch, ends_white, mask, masks};

const COARSE: &str = "--dpi 150 --thickness 500um";

/// Makes `broken.stl` and slices it to `stray.tif`.
fn sliced(scratch: &Scratch, defect: &str) -> Ran {
    let line = format!("lamp sample tower --facets 20k {defect} -o broken.stl");
    scratch.run(&line).succeeds();
    scratch.run(&format!("slice broken.stl {COARSE} -o stray.tif")).succeeds()
}

fn stray_rows(layers: &[Layer]) -> usize {
    layers.iter().map(|layer| layer.info.stray_rows.len()).sum()
}

#[test]
fn slice_lists_the_rows_that_do_not_balance() {
    for seed in [1, 7] {
        let scratch = Scratch::new();
        let ran = sliced(&scratch, &format!("--defect drop --count 40 --seed {seed}"));
        let layers = scratch.layers("stray.tif");
        let rows = stray_rows(&layers);
        let of = layers.iter().filter(|layer| !layer.info.stray_rows.is_empty()).count();
        assert!(rows > 0);
        let says =
            format!("note: slice: {rows} rows in {of} layers do not balance: the mesh has gaps");
        assert!(ran.stderr.starts_with(&says), "{}", ran.stderr);
        for layer in &layers {
            let image = mask(layer);
            let listed = &layer.info.stray_rows;
            assert!(listed.is_sorted_by(|a, b| a < b));
            assert!(listed.iter().all(|&row| row < image.height()));
            let ends_white = |row: &u32| image.row(*row).len() % 2 == 1;
            let missed = (0..image.height()).filter(ends_white).find(|row| !listed.contains(row));
            assert_eq!(missed, None, "{}", layer.info.name());
        }
    }
}

#[test]
fn a_seed_always_breaks_the_same_facets() {
    let scratch = Scratch::new();
    let broken = |seed: u32| {
        let line = format!("lamp sample tower --facets 5k --defect drop --count 9 --seed {seed}");
        scratch.run(&line).succeeds_quietly().stdout
    };
    assert!(broken(3) == broken(3));
    assert!(broken(3) != broken(4));
    let whole = scratch.run("lamp sample tower --facets 5k").succeeds_quietly().stdout;
    assert_eq!(whole.len() - broken(3).len(), 9 * 50);
}

#[test]
fn a_clean_stack_passes_byte_for_byte() {
    let scratch = Scratch::new();
    for part in Sample::ALL {
        scratch.part("part.stl", part, part.min_facets().max(2_000));
        let stack = scratch.run(&format!("slice part.stl {COARSE}")).succeeds_quietly().stdout;
        for stage in ["fix", "dither", "dither --method floyd-steinberg"] {
            let passed = scratch.run_on(stage, &stack).succeeds_quietly().stdout;
            assert!(passed == stack, "{stage} changed a clean {}", part.name());
        }
    }
}

#[test]
fn flipped_facets_change_no_pixel_under_even_odd() {
    let scratch = Scratch::new();
    scratch.run("lamp sample tower --facets 20k -o whole.stl").succeeds();
    scratch.run(&format!("slice whole.stl {COARSE} -o whole.tif")).succeeds_quietly();
    sliced(&scratch, "--defect flip --count 500 --seed 3");
    let line = format!("slice broken.stl {COARSE} --fill even-odd --force -o stray.tif");
    scratch.run(&line).succeeds_quietly();
    let (whole, flipped) = (scratch.layers("whole.tif"), scratch.layers("stray.tif"));
    assert!(masks(&whole) == masks(&flipped));
    // The file differs, so its digest does.
    let digest = |layers: &[Layer]| layers[0].info.stack.clone().unwrap().digest;
    assert_ne!(digest(&whole), digest(&flipped));
}

/// Only the file's digest shows that facets were flipped, and not how many.
#[test]
fn flipped_facets_change_nothing_but_the_digest() {
    let scratch = Scratch::new();
    scratch.run("lamp sample tower --facets 20k -o broken.stl").succeeds();
    let sliced = || {
        let line = format!("slice broken.stl {COARSE} --fill even-odd -o part.tif");
        scratch.run(&line).succeeds_quietly();
        let mut layers = scratch.layers("part.tif");
        assert!(layers.iter().all(|layer| layer.info.closed == Some(true)));
        let digest = layers[0].info.stack.as_mut().unwrap();
        (std::mem::take(&mut digest.digest), layers)
    };
    let (whole_digest, whole) = sliced();
    for (count, seed) in [(1, 1), (700, 2), (19_000, 3), (1_000_000, 4)] {
        let line = format!("--facets 20k --defect flip --count {count} --seed {seed}");
        scratch.run(&format!("lamp sample tower {line} -o broken.stl")).succeeds();
        let (digest, flipped) = sliced();
        assert!(digest != whole_digest && flipped == whole, "{count} facets flipped");
    }
}

#[test]
fn flipped_facets_change_no_pixel_and_are_reported() {
    let scratch = Scratch::new();
    sliced(&scratch, "--defect flip --count 20 --seed 3");
    scratch
        .run(&format!("slice broken.stl {COARSE} --fill even-odd -o even.tif"))
        .succeeds_quietly();
    let ran = scratch.run(&format!("slice broken.stl {COARSE} -o solid.tif")).succeeds();
    assert!(ran.stderr.contains("broken.stl: facets are turned over in "), "{ran:?}");
    assert!(masks(&scratch.layers("solid.tif")) == masks(&scratch.layers("even.tif")));
}

#[test]
fn nudged_parted_and_doubled_facets_never_stop_the_pipeline() {
    let scratch = Scratch::new();
    for defect in ["duplicate", "nudge --by 0.5mm", "gap --by 0.5mm"] {
        sliced(&scratch, &format!("--count 40 --defect {defect}"));
        scratch.run("fix stray.tif | dither | tile -o build.tif").succeeds();
        assert!(masks(&scratch.layers("build.tif")).iter().all(|mask| !ends_white(mask)));
    }
}
