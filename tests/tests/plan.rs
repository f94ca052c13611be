//! Checks `lamp plan voxels`: plans of known parts, its files, and what it refuses.

use lamp_fixtures::{Sample, Voxels, cavity_staircase, example_cylinder, overhang_slope};
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::ExposureTime;
use lamp_planning::{LayerTime, Light, RegionDoses, SampleHeight};
use lamp_stack::{Catalogued, GrayMask, Layer, Length};
use lamp_tests::Scratch;
use serde_json::Value;

/// A stack of a part whose layers are exposed for so many milliseconds.
fn stack(scratch: &Scratch, name: &str, part: &Voxels, ms: f64) {
    scratch.stack(name, exposed(part, ms));
}

fn exposed(part: &Voxels, ms: f64) -> Vec<Layer> {
    let mut layers: Vec<_> = part.layers().collect();
    layers.iter_mut().for_each(|layer| layer.info.exposure_ms = Some(ms));
    layers
}

fn report(scratch: &Scratch) -> Value {
    serde_json::from_slice(&scratch.bytes("plan.json")).unwrap()
}

/// Numbers that an SVG shows in cells, in its order.
fn numbers_of(svg: &str) -> Vec<u32> {
    // Doses are black, and the numbers of columns and rows are gray.
    let texts = svg.split("</text>").filter(|text| !text.contains("#282828"));
    let texts = texts.filter_map(|text| text.rsplit('>').next());
    texts.filter_map(|text| text.trim().parse().ok()).collect()
}

/// The doses of figure A.21 of 001: before and after, a row of the figure in each line.
const A_21: [[u32; 14]; 7] = [
    [174, 177, 178, 179, 178, 177, 174, 164, 166, 168, 168, 168, 166, 164],
    [177, 180, 181, 182, 181, 180, 177, 166, 169, 170, 170, 170, 169, 166],
    [178, 181, 183, 183, 183, 181, 178, 168, 170, 172, 172, 172, 170, 168],
    [179, 182, 183, 184, 183, 182, 179, 168, 170, 172, 173, 172, 170, 168],
    [178, 181, 183, 183, 183, 181, 178, 168, 170, 172, 172, 172, 170, 168],
    [177, 180, 181, 182, 181, 180, 177, 166, 169, 170, 170, 170, 169, 166],
    [174, 177, 178, 179, 178, 177, 174, 164, 166, 168, 168, 168, 166, 164],
];

#[test]
fn the_figure_of_001_comes_out_as_printed() {
    let scratch = Scratch::new();
    stack(&scratch, "cylinder.tif", &example_cylinder(), 1000.0);
    let line = "lamp plan voxels cylinder.tif --material zsg-amber --objective boundary \
        --search-gap 0.0001% --around 0px --map a21.svg --map-layer 2 --report plan.json --plot plan.svg -o planned.tif";
    scratch.run(line).succeeds();
    let map = String::from_utf8(scratch.bytes("a21.svg")).unwrap();
    let half = |case: usize| A_21.iter().flat_map(move |row| &row[7 * case..7 * case + 7]).copied();
    let drawn = numbers_of(&map);
    assert_eq!(drawn[..49], half(0).collect::<Vec<_>>());
    // Levels are whole: rounded up to them, the best light lifts four doses to the next digit.
    let lifted = drawn[49..].iter().zip(half(1)).filter(|(drawn, printed)| *drawn != printed);
    assert!(drawn.len() == 98 && lifted.clone().count() <= 4, "{drawn:?}");
    assert!(lifted.clone().all(|(drawn, printed)| *drawn == printed + 1), "{drawn:?}");
    let report = report(&scratch);
    assert_eq!(report["before"]["overcured"], 84);
    assert_eq!(report["after"]["overcured"], 0);
    assert_eq!(report["after"]["lost"], 0);
}

/// The overhang of a staircase, 20 layers of 100 um, in which 1.0 to 2.8 critical doses of
/// `pegda-sudan` gather.
const STAIRS: &str = "lamp plan voxels stairs.tif --layers 22..42 --material pegda-sudan";

fn with_stairs() -> Scratch {
    let scratch = Scratch::new();
    stack(&scratch, "stairs.tif", &cavity_staircase(1), 300.0);
    scratch
}

/// Levels of a layer, row by row.
fn levels(layer: &Layer) -> Vec<Vec<u8>> {
    let row = |row| {
        let mut levels = vec![0; layer.image.width() as usize];
        for (start, end, level) in layer.image.runs(row) {
            levels[start as usize..end as usize].fill(level);
        }
        levels
    };
    (0..layer.image.height()).map(row).collect()
}

/// Calls `check` with each pixel of a plan of the staircase: its depth within the part, in squares,
/// below zero outside, and its level.
fn each_pixel(scratch: &Scratch, mut check: impl FnMut(i32, u8)) {
    let part = cavity_staircase(1);
    let planned = scratch.layers("planned.tif");
    assert_eq!(planned.len(), 20);
    for layer in &planned {
        let levels = levels(layer);
        let white = |column: i32, row: i32| {
            let at = [column, row].map(|at| usize::try_from(at).unwrap_or(usize::MAX));
            let inside = at[0] < levels[0].len() && at[1] < levels.len();
            inside && part.holds([at[0], at[1], layer.info.index as usize])
        };
        for (row, levels) in (0..).zip(&levels) {
            for (column, &level) in (0..).zip(levels) {
                let own = white(column, row);
                let same = |by: i32| {
                    let mut square = (-by..=by).flat_map(|y| (-by..=by).map(move |x| (x, y)));
                    square.all(|(x, y)| white(column + x, row + y) == own)
                };
                let depth = (1..5).find(|&by| !same(by)).unwrap_or(5);
                check(if own { depth } else { -depth }, level);
            }
        }
    }
}

#[test]
fn plans_light_the_pixels_they_may() {
    let scratch = with_stairs();
    let plan = |options: &str| {
        let line = format!("{STAIRS} {options} --report plan.json -o planned.tif");
        scratch.run(&line).succeeds();
        report(&scratch)
    };
    let told = plan("");
    let overcured = |at: &str| told[at]["overcured"].as_u64().unwrap();
    assert!(overcured("before") > 1_000 && overcured("after") * 20 < overcured("before"));
    each_pixel(&scratch, |depth, level| assert!(level == 0 || depth > 0));
    let layers = scratch.layers("planned.tif");
    assert!(layers.iter().all(|layer| layer.info.exposure_ms == Some(300.0)));

    plan("--sources grow:2px");
    let mut lit_outside = 0;
    each_pixel(&scratch, |depth, level| {
        assert!(level == 0 || depth >= -2);
        lit_outside += usize::from(level > 0 && depth < 0);
    });
    assert!(lit_outside > 0);
    plan("--sources shell:1px");
    each_pixel(&scratch, |depth, level| assert!(depth <= 1 || level == 255));
    plan("--keep-white wall:2px");
    each_pixel(&scratch, |depth, level| assert!(!(1..=2).contains(&depth) || level == 255));
    plan("--min-level 40");
    each_pixel(&scratch, |_, level| assert!(level == 0 || level >= 40));
}

#[test]
fn a_plan_says_what_sections_show() {
    let scratch = Scratch::new();
    // 0.1665 s cure 23.2e-2 mm2 more than is wanted.
    stack(&scratch, "slope.tif", &overhang_slope(), 166.5);
    let line = "lamp plan voxels slope.tif --material zsg-amber --around 0px --report plan.json -o planned.tif";
    scratch.run(line).succeeds();
    let told = report(&scratch);
    let count = |when: &str, what: &str| told[when][what].as_f64().unwrap();
    for (stack, panel, when) in [("slope", "white", "before"), ("planned", "gray", "after")] {
        let cure = format!(
            "lamp cure {stack}.tif --material zsg-amber --section y=0.005mm --dose-at top -o s.png"
        );
        let said = String::from_utf8(scratch.run(&cure).succeeds_quietly().stdout).unwrap();
        let row = said.lines().find_map(|row| row.strip_prefix(panel)).unwrap();
        let area: f64 = row.split_whitespace().last().unwrap().parse().unwrap();
        let cured = 6_630.0 + count(when, "overcured") - count(when, "undercured");
        assert!((area - cured * 0.0112 * 0.0112).abs() < 1e-4, "{when}: {cured} {said}");
    }
    assert!(count("after", "overcured") < 0.05 * count("before", "overcured"));
}

#[test]
fn files_folders_pipes_and_threads_give_the_same_bytes() {
    let scratch = with_stairs();
    scratch.run(&format!("{STAIRS} --threads 1 -o one.tif")).succeeds();
    scratch.run(&format!("{STAIRS} --threads 2 --plot p.png -o two.tif")).succeeds();
    let piped = STAIRS.replace("stairs.tif", "-");
    scratch.run(&format!("lamp convert stairs.tif | {piped} > piped.tif")).succeeds();
    scratch.run("lamp convert stairs.tif -o pages/").succeeds();
    let folder = STAIRS.replace("stairs.tif", "pages");
    scratch.run(&format!("{folder} -o folder.tif")).succeeds();
    let one = scratch.bytes("one.tif");
    for other in ["two.tif", "piped.tif", "folder.tif"] {
        assert!(scratch.bytes(other) == one, "{other}");
    }
    scratch.run("lamp verify one.tif").succeeds();
    assert!(scratch.bytes("p.png").starts_with(b"\x89PNG"));
}

#[test]
fn wanted_pixels_may_be_gray() {
    let scratch = Scratch::new();
    let mut layers = exposed(&example_cylinder(), 1000.0);
    for layer in &mut layers {
        let mut gray = GrayMask::new(7);
        for row in levels(layer) {
            // The right half is gray.
            let level =
                |(column, level): (usize, u8)| (1, if column > 3 { level / 2 } else { level });
            gray.push_runs(row.into_iter().enumerate().map(level)).unwrap();
        }
        layer.image = gray.into();
    }
    scratch.stack("gray.tif", layers);
    // 21 pixels a layer, of which 8 are of level 127.
    for (options, wanted) in [("", 65), ("--wanted 127", 105), ("--wanted 255", 65)] {
        let line = format!(
            "lamp plan voxels gray.tif --material zsg-amber {options} --report plan.json -o p.tif"
        );
        scratch.run(&line).succeeds();
        assert_eq!(report(&scratch)["wanted"], wanted, "{options}");
    }
}

#[test]
fn pages_get_the_time_that_is_given() {
    let scratch = with_stairs();
    scratch.stack("silent.tif", cavity_staircase(1).layers());
    scratch.run(&format!("{STAIRS} -o stated.tif")).succeeds();
    let silent = STAIRS.replace("stairs.tif", "silent.tif");
    scratch.run(&format!("{silent} --expose 0.3s -o given.tif")).succeeds();
    assert!(scratch.bytes("stated.tif") == scratch.bytes("given.tif"));
    // It replaces the pages' own.
    let longer = with_stairs();
    longer.run(&format!("{STAIRS} --expose 0.6s -o given.tif")).succeeds();
    stack(&longer, "stairs.tif", &cavity_staircase(1), 600.0);
    longer.run(&format!("{STAIRS} -o stated.tif")).succeeds();
    assert!(longer.bytes("stated.tif") == longer.bytes("given.tif"));
    scratch.run(&format!("{silent} -o none.tif")).is_refused_with(&[
        "silent.tif",
        "layer 22",
        "does not state its exposure",
        "--expose",
    ]);
    assert!(!scratch.path("none.tif").exists());
}

#[test]
fn strict_tells_of_what_white_light_cannot_cure() {
    let scratch = Scratch::new();
    stack(&scratch, "cylinder.tif", &example_cylinder(), 1000.0);
    let line = "lamp plan voxels cylinder.tif --material zsg-amber --report plan.json -o p.tif";
    let ran = scratch.run(line).succeeds();
    assert!(ran.stderr.contains("does not cure 42 wanted voxels, in layers 3 to 4"), "{ran:?}");
    let told = report(&scratch);
    let short: Vec<u64> = told["by_layer"]
        .as_array()
        .unwrap()
        .iter()
        .map(|layer| layer["wanted"].as_u64().unwrap() - layer["targets"].as_u64().unwrap())
        .collect();
    assert_eq!((short, &told["uncurable"]), (vec![0, 0, 0, 21, 21], &Value::from(42)));
    std::fs::remove_file(scratch.path("p.tif")).unwrap();
    std::fs::remove_file(scratch.path("plan.json")).unwrap();
    let ran = scratch.run(&format!("{line} --strict"));
    assert_eq!(ran.statuses, [Some(3)], "{ran:?}");
    assert!(ran.stderr.contains("cylinder.tif: white light cannot cure 42"), "{ran:?}");
    assert!(!scratch.path("p.tif").exists());
    assert_eq!(report(&scratch)["uncurable"], 42);
    // Longer exposures cure all.
    stack(&scratch, "cylinder.tif", &example_cylinder(), 3000.0);
    scratch.run(&format!("{line} --strict")).succeeds();
}

#[test]
fn a_plan_that_cures_nothing_is_a_finding() {
    let scratch = with_stairs();
    for (line, why) in [
        (
            format!("{STAIRS} --expose 1ms"),
            "the plan cures no wanted voxel, and neither does white light: expose longer",
        ),
        (
            "lamp plan speed stairs.tif --material pegda-sudan --speed 1m/s..2m/s".to_owned(),
            "the plan cures no voxel of the part",
        ),
    ] {
        let ran = scratch.run(&format!("{line} -o none.tif")).succeeds();
        assert!(ran.stderr.contains(&format!("warning: plan: stairs.tif: {why}")), "{ran:?}");
        let ran = scratch.run(&format!("{line} --strict -o strict.tif"));
        assert_eq!(ran.statuses, [Some(3)], "{ran:?}");
        assert!(!scratch.path("strict.tif").exists());
    }
}

/// With a margin, less light loses no target of the part.
#[test]
fn boundaries_are_planned_with_a_margin() {
    let scratch = with_stairs();
    let lost = |options: &str| {
        let line = format!("{STAIRS} --objective boundary --report plan.json {options} -o b.tif");
        scratch.run(&format!("{line} --force")).succeeds();
        let report = report(&scratch);
        (report["margin"].as_f64(), report["after"]["at_less_light"]["lost"].as_u64().unwrap())
    };
    let (plain, with_margin) = (lost(""), lost("--dose-margin 10%"));
    assert_eq!([plain.0, with_margin.0], [Some(0.0), Some(0.1)]);
    assert!(with_margin.1 * 4 < plain.1, "{plain:?} {with_margin:?}");
}

#[test]
fn what_cannot_be_planned_is_refused() {
    let scratch = with_stairs();
    let good = scratch.layers("stairs.tif");
    let spoilt = |name: &str, spoil: &dyn Fn(&mut Layer)| {
        let mut layers = good.clone();
        spoil(&mut layers[30]);
        scratch.stack(name, layers);
    };
    spoilt("thin.tif", &|layer| layer.info.thickness_um = None);
    spoilt("flat.tif", &|layer| layer.info.thickness_um = Some(0.0));
    spoilt("dark.tif", &|layer| layer.info.exposure_ms = Some(-1.0));
    spoilt("coarse.tif", &|layer| layer.pitch = None);
    spoilt("narrow.tif", &|layer| layer.image = lamp_stack::Mask::black(49, 30).into());
    let shown = scratch.run("lamp material show pegda-sudan").succeeds().stdout;
    let material = String::from_utf8(shown).unwrap();
    let without = |name: &str, table: &str| {
        let tables: Vec<_> = material.split("\n\n").collect();
        let kept: Vec<_> = tables.into_iter().filter(|text| !text.contains(table)).collect();
        scratch.write(name, kept.join("\n\n").as_bytes());
    };
    without("dim.toml", "[intensity]");
    scratch.write("wide.toml", material.replace("\"50 um\"", "\"1e9 mm\"").as_bytes());
    without("curveless.toml", "[working-curve");
    for (line, words) in [
        ("stairs.tif --material lamp-suspension", &["how far light spreads", "[spread]"][..]),
        ("stairs.tif --material curveless.toml", &["how deep a dose cures", "[working-curve]"]),
        ("stairs.tif --material dim.toml", &["how bright", "[intensity]"]),
        ("stairs.tif --material none.toml", &["none.toml"]),
        ("stairs.tif --material wide.toml", &["wide.toml", "at most 2 mm"]),
        ("stairs.tif --material wide.toml --map m.svg --map-layer 3", &["at most 2 mm"]),
        ("thin.tif", &["thin.tif", "layer 30", "does not state its thickness", "slice"]),
        ("flat.tif", &["flat.tif", "layer 30", "a thickness that is not above zero"]),
        ("dark.tif", &["dark.tif", "layer 30", "an exposure that is not above zero"]),
        ("coarse.tif", &["coarse.tif", "layer 30", "does not state its resolution"]),
        ("narrow.tif", &["narrow.tif", "layer 30", "differs from the first layer in size"]),
        ("stairs.tif --layers 90..95", &["no layer is in that range"]),
        ("stairs.tif --map m.svg --map-layer 60", &["there is no layer 60"]),
    ] {
        let material = if line.contains("--material") { "" } else { "--material pegda-sudan" };
        let line = format!("lamp plan voxels {line} {material} --report r.json -o out.tif");
        scratch.run(&line).is_refused_with(words);
        for file in ["out.tif", "r.json", "m.svg"] {
            assert!(!scratch.path(file).exists(), "{line}: {file}");
        }
    }
}

#[test]
fn wrong_options_are_status_2() {
    let scratch = with_stairs();
    for (options, word) in [
        ("--sources glow:3px", "grow:3px"),
        ("--sources grow:0px", "1px to 1000px"),
        ("--keep-white 3px", "wall:3px"),
        ("--dose-margin 100%", "below 100%"),
        ("--search-gap 0%", "0.1%"),
        ("--wanted 0", "--wanted"),
        ("--min-level 256", "--min-level"),
        ("--expose 0s", "takes some time"),
        ("--plot plan.pdf", ".svg, .png or .csv"),
        ("--report stairs.tif", "that is an input"),
        ("--report p.svg --plot p.svg", "written as JSON"),
        ("--map m.svg", "--map-layer"),
        ("--map m.svg --map-layer 30 --map-region 90,0,2,2", "outside the image"),
    ] {
        let ran = scratch.run(&format!("{STAIRS} {options} -o out.tif"));
        assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
        assert!(ran.stderr.contains(word), "{ran:?}");
        assert!(!scratch.path("out.tif").exists());
    }
}

/// The doses of a stack's first layer.
fn doses_of_first(layers: &[Layer], light: Light) -> Vec<f64> {
    let first = &layers[0];
    let [columns, rows] = [0..first.image.width(), 0..first.image.height()];
    let mut doses = RegionDoses::new(light, first.pitch.unwrap().x, columns, rows);
    for layer in layers {
        let exposed = LayerTime {
            thickness: Length::from_um(layer.info.thickness_um.unwrap()),
            time: ExposureTime::from_ms(layer.info.exposure_ms.unwrap()),
        };
        doses.expose(&layer.image, exposed, |level| light.of_level(level));
    }
    doses.doses().to_vec()
}

#[test]
fn dots_of_a_plan_with_margin_lose_little() {
    let scratch = Scratch::new();
    scratch.part("stairs.stl", Sample::Stairs, 1_000);
    // Pixels of 25 um: the spread is that of two.
    let slice = "slice stairs.stl --dpi 1016 --thickness 100um --layers 24..44";
    scratch.run(&format!("{slice} --material pegda-sudan -o part.tif")).succeeds();
    scratch
        .run("lamp plan voxels part.tif --material pegda-sudan --dose-margin 10% | dither > dots.tif")
        .succeeds();
    let light = Light::of(&Material::builtin("pegda-sudan").unwrap(), SampleHeight::Top).unwrap();
    let (part, dots) = (scratch.layers("part.tif"), scratch.layers("dots.tif"));
    let (mut targets, mut lost, mut black) = (0, 0, 0);
    for layer in 0..part.len() {
        let [white, dotted] = [&part, &dots].map(|stack| doses_of_first(&stack[layer..], light));
        let wanted = levels(&part[layer]).concat();
        let lit = levels(&dots[layer]).concat();
        for (place, wanted) in wanted.iter().enumerate().filter(|(_, level)| **level > 0) {
            black += usize::from(lit[place] != *wanted);
            targets += usize::from(white[place] >= 1.0);
            lost += usize::from(white[place] >= 1.0 && dotted[place] < 1.0);
        }
    }
    assert!(targets > 100_000 && black > 10_000, "{targets} {black}");
    assert!(lost * 300 < targets, "{lost} of {targets}");
}
