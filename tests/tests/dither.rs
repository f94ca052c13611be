//! Checks `dither` on stacks of gray layers.

use lamp_stack::{Destination, Format, GrayMask, Layer, PageInfo, Pitch, StackError, write_stack};
use lamp_tests::{Scratch, masks, read_stack};

const METHODS: [&str; 5] = ["blue-noise", "ordered", "floyd-steinberg", "sierra-lite", "threshold"];

/// Writes white squares on black, from layer 40 on, in a gray rim that rises from the left.
fn with_gray_stack(dpi: f64) -> Scratch {
    let layer = |index| {
        let mut gray = GrayMask::new(300);
        for row in 0..90 {
            let inside = if (20..70).contains(&row) { 255 } else { 90 };
            let rim = (30u32..90).map(|level| (1, level as u8));
            gray.push_runs([(11, 0)].into_iter().chain(rim).chain([(100, inside), (70, 128)]))
                .unwrap();
        }
        let info = PageInfo { index, ..PageInfo::default() };
        Ok::<_, StackError>(Layer { info, pitch: Pitch::of_dpi(dpi), image: gray.into() })
    };
    let scratch = Scratch::new();
    let to = Destination::File(scratch.path("gray.tif"));
    write_stack((40..52).map(layer), to, Format::Big).unwrap();
    scratch
}

#[test]
fn blue_noise_is_what_is_done_by_default() {
    let scratch = with_gray_stack(1500.0);
    let plain = scratch.run("dither gray.tif").succeeds_quietly().stdout;
    assert!(plain == scratch.run("dither gray.tif --method blue-noise").succeeds_quietly().stdout);
}

#[test]
fn pages_name_the_method_and_have_the_level_as_white() {
    let scratch = with_gray_stack(1500.0);
    for method in METHODS {
        let line = format!("dither gray.tif --method {method}");
        let layers = read_stack(scratch.run(&line).succeeds_quietly().stdout);
        assert_eq!(layers.len(), 12);
        for (layer, mask) in layers.iter().zip(masks(&layers)) {
            assert_eq!(layer.info.other["dither"], method);
            let solid = (71..171).all(|column| mask.is_white(column, 40));
            assert!(solid && !mask.is_white(10, 40) && !mask.is_white(241, 40), "{method}");
        }
        // Half gray, 70 x 90 pixels in the mean of all layers.
        let half = |mask: &lamp_stack::Mask| {
            let at = |row| (171..241).filter(move |&column| mask.is_white(column, row)).count();
            (0..90).map(at).sum::<usize>()
        };
        let white = masks(&layers).into_iter().map(half).sum::<usize>() / 12;
        match method {
            "threshold" => assert_eq!(white, 6300),
            _ => assert!((3150usize - 60..3150 + 90).contains(&white), "{method}: {white}"),
        }
    }
}

#[test]
fn a_layer_has_the_same_dots_whatever_the_threads_and_the_range() {
    let scratch = with_gray_stack(1500.0);
    for method in METHODS {
        let line = format!("dither gray.tif --method {method}");
        let stack = scratch.run(&line).succeeds_quietly().stdout;
        for threads in [1, 2, 7] {
            let ran = scratch.run(&format!("{line} --threads {threads}")).succeeds_quietly();
            assert!(ran.stdout == stack, "{method}, {threads} threads");
        }
        let all = read_stack(stack);
        let some = scratch.run(&format!("{line} --layers 45..48")).succeeds_quietly().stdout;
        assert!(masks(&read_stack(some)) == masks(&all[5..8]), "{method}");
        // The layers are alike except for their dots.
        assert_eq!(all[5].image == all[6].image, method == "threshold");
    }
}

#[test]
fn pixels_too_wide_to_cure_evenly_are_told_of_once() {
    let even = with_gray_stack(1500.0);
    assert_eq!(even.run("dither gray.tif -o dots.tif").succeeds().stderr, "");
    for (dpi, words) in [
        (1000.0, ["25.4 um", "dots of 17 um cured evenly", "sizes between are untested"]),
        (300.0, ["84.7 um", "dots of 85 um did not", "will cure as spots"]),
    ] {
        let scratch = with_gray_stack(dpi);
        let ran = scratch.run("dither gray.tif -o dots.tif").succeeds();
        assert_eq!(ran.stderr.lines().count(), 1, "{ran:?}");
        assert!(words.iter().all(|word| ran.stderr.contains(word)), "{ran:?}");
        // Existing dots, or none, give no message.
        scratch.run("dither dots.tif -o again.tif").succeeds_quietly();
        scratch.run("dither gray.tif --method threshold -o white.tif").succeeds_quietly();
        scratch.run("dither gray.tif --quiet -o dots.tif").succeeds_quietly();
    }
}

/// Cells lie inside a ball: a pixel that changes is as far from its surface as the clearance.
#[test]
fn cells_screen_the_inside_of_a_part() {
    let scratch = Scratch::new();
    scratch.mesh("ball.stl", &lamp_fixtures::sphere(5.0, 20_000));
    scratch.run("slice ball.stl --dpi 300 --thickness 200um -q -o ball.tif").succeeds_quietly();
    let line = "dither ball.tif --cell 340um --cell-clearance 1mm";
    scratch.run(&format!("{line} -o cells.tif")).succeeds_quietly();
    let (before, after) = (scratch.layers("ball.tif"), scratch.layers("cells.tif"));
    let (mut inner, mut black) = (0, 0);
    let pairs = before.iter().zip(&after).zip(masks(&before).into_iter().zip(masks(&after)));
    for ((layer, screened), (from, to)) in pairs {
        let [left, top] = layer.info.origin_mm.unwrap();
        let away_mm = layer.info.z().unwrap().mm() + 0.1 - 5.0;
        for row in 0..from.height() {
            for column in 0..from.width() {
                let [x, y] = [column, row].map(|at| (f64::from(at) + 0.5) * 25.4 / 300.0);
                let off = (left + x).hypot(top - y).hypot(away_mm);
                let is_black = from.is_white(column, row) && !to.is_white(column, row);
                assert!(from.is_white(column, row) || !to.is_white(column, row));
                assert!(!is_black || off < 4.0, "{off} in layer {}", layer.info.index);
                // A cylinder of the clearance fits there, with a layer and a pixel to spare.
                inner += u64::from(off < 3.1);
                black += u64::from(off < 3.1 && is_black);
            }
        }
        let has_cells = from != to;
        let record = screened.info.other.get("dither");
        assert_eq!(record.is_some(), has_cells);
        assert!(
            record.is_none_or(|it| it["cell_um"] == 340.0 && it["cell_clearance_um"] == 1000.0)
        );
    }
    let share = black as f64 / inner as f64;
    assert!((share - 0.5).abs() < 0.03, "{black} of {inner}");
    for (words, why) in [
        ("--cell 340um", "--cell-clearance"),
        ("--cell 17um --cell-clearance 1mm", "cure evenly"),
        (
            "--cell 85um --cell-clearance 1mm",
            "two pixels wide, and a pixel of this stack has 84.7 um",
        ),
        ("--cell 340um --cell-clearance 0um", "above zero"),
        ("--cell 340um --cell-clearance 1mm --layers 3..9", "leave out --layers"),
    ] {
        scratch.run(&format!("dither ball.tif {words} -o out.tif")).is_wrong_usage(&[why]);
        assert!(!scratch.path("out.tif").exists());
    }
}
