//! `--strict`, and the place of the gap in messages about bands that were left.

use lamp_fixtures::Facet;

use super::{COARSE, bands, broken_ball, is_corrected, number, report};

#[test]
fn bands_that_are_left_end_with_status_3_and_no_stack() {
    let (scratch, _) = broken_ball(5, 1, COARSE);
    let lax = scratch.run("fix stray.tif --max-width 4 -v -o lax.tif").succeeds();
    let (report, strict) = report(&scratch, "--max-width 4 --strict -v");
    assert_eq!(strict.statuses, [Some(3)]);
    assert!(!scratch.path("fixed.tif").exists());
    let left = bands(&report).iter().filter(|band| !is_corrected(band)).count();
    for ran in [lax, strict] {
        let last = ran.stderr.lines().last().unwrap();
        assert!(last.contains(&format!("{left} bands of stray rows were left")), "{last}");
        assert_eq!(ran.stderr.matches("; repair the CAD model near ").count(), left);
    }
}

#[test]
fn two_lines_sum_up_and_quiet_keeps_what_strict_would_stop_for() {
    let (scratch, _) = broken_ball(5, 1, COARSE);
    let (report, ran) = report(&scratch, "--max-width 4");
    let ran = ran.succeeds();
    let (corrected, left): (Vec<_>, Vec<_>) =
        bands(&report).iter().partition(|band| is_corrected(band));
    assert!(corrected.len() > 1 && left.len() > 1);
    let [of_corrected, of_left] = ran.stderr.lines().collect::<Vec<_>>()[..] else {
        panic!("two lines: {ran:?}")
    };
    let start = format!("fix: {} bands of stray rows in ", corrected.len());
    let changed = number(&report["pixels_changed"]);
    let end = format!(" were corrected, {changed} pixels changed");
    assert!(of_corrected.starts_with(&start) && of_corrected.ends_with(&end), "{of_corrected}");
    let (count, first) = (left.len(), number(&left[0]["layer"]));
    let start = format!(
        "warning: fix: {count} bands of stray rows were left, the first in layer {first} (z "
    );
    assert!(of_left.starts_with(&start) && of_left.contains(" near x "), "{of_left}");

    let quiet = scratch.run("fix stray.tif --max-width 4 --quiet -o quiet.tif").succeeds();
    assert_eq!(quiet.stderr.trim_end(), of_left);
    assert!(scratch.bytes("quiet.tif") == scratch.bytes("fixed.tif"));
    let strict = scratch.run("fix stray.tif --max-width 4 --strict --quiet -o strict.tif");
    assert_eq!(strict.statuses, [Some(3)]);
    assert_eq!(strict.stderr, quiet.stderr.replacen("warning", "error", 1));
}

#[test]
fn if_all_are_corrected_strict_succeeds() {
    let (scratch, _) = broken_ball(5, 1, COARSE);
    let (report, ran) = report(&scratch, "--max-width 60 --strict");
    ran.succeeds();
    assert!(!bands(&report).is_empty() && bands(&report).iter().all(is_corrected));
}

/// Where the plane cuts the facet: from the least to the greatest x, and y.
fn cut(facet: &Facet, z: f64) -> [[f64; 2]; 2] {
    let corners = facet.map(|corner| corner.map(f64::from));
    let mut points = Vec::new();
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        if (a[2] < z) != (b[2] < z) {
            let share = (z - a[2]) / (b[2] - a[2]);
            points.push([0, 1].map(|axis| a[axis] + share * (b[axis] - a[axis])));
        }
    }
    let [a, b] = points[..] else { panic!("the plane at {z} misses {facet:?}") };
    [0, 1].map(|axis| [a[axis].min(b[axis]), a[axis].max(b[axis])])
}

/// `31.4-33.0` or, below zero, `-3.1 to -2.5`.
fn range(text: &str) -> [f64; 2] {
    let (low, high) = text.split_once(" to ").or_else(|| text.split_once('-')).expect("a range");
    [low, high].map(|number| number.parse().expect("a number"))
}

/// Each left band has its message, with the place of the missing facet.
#[test]
fn a_band_that_is_left_names_the_place_of_the_missing_facet() {
    /// The place is rounded to 0.1 mm; a curve is a little off the facet, and
    /// a row or a column is a pixel of 0.04 mm wide.
    const NEAR: f64 = 0.05 + 0.1;
    let mut met = 0;
    for (seed, [dx, dy]) in [(1, [50.0, 40.0]), (2, [0.0, 0.0]), (3, [50.0, 40.0]), (6, [0.0, 9.0])]
    {
        let slicing = format!("--dpi 600 --thickness 50um --translate {dx},{dy},0");
        let (scratch, facets) = broken_ball(1, seed, &slicing);
        let (report, ran) = report(&scratch, "--max-width 15 --strict --verbose");
        let left: Vec<_> = bands(&report).iter().filter(|band| !is_corrected(band)).collect();
        assert_eq!(ran.statuses, [Some(if left.is_empty() { 0 } else { 3 })]);
        let stray = scratch.layers("stray.tif");
        let mut lines =
            ran.stderr.lines().filter(|line| line.contains("repair the CAD model near"));
        for band in left {
            let [layer, first, last] =
                ["layer", "first_row", "last_row"].map(|key| number(&band[key]));
            let z_mm = stray[layer as usize].info.z_um.unwrap() / 1000.0;
            assert_eq!(band["outcome"], "left: too wide");
            let line = lines.next().expect("a line for each band that was left");
            let start = format!(
                "fix: layer {layer} (z {z_mm:.2} mm) rows {first}-{last}: {} rows wide, limit 15; \
                 repair the CAD model near x ",
                last - first + 1
            );
            let place = line.strip_prefix(&start).unwrap_or_else(|| panic!("{line}\n{start}"));
            let place = place.strip_suffix(" mm").expect("millimetres");
            let (x, y) = place.split_once(" y ").expect("x and y");
            let [true_x, true_y] = cut(&facets[0], z_mm + 0.05);
            for (said, real, moved) in [(x, true_x, dx), (y, true_y, dy)] {
                let said = range(said).map(|value| value - moved);
                let off = [0, 1].map(|end| (said[end] - real[end]).abs());
                assert!(off[0] < NEAR && off[1] < NEAR, "{line}: {real:?}");
            }
            met += 1;
        }
        assert_eq!(lines.next(), None);
    }
    assert!(met > 10, "only {met} bands were left");
}
