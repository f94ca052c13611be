//! Checks the adaptive layers of `slice --adaptive` and `lamp heights`.

use std::f64::consts::PI;

use lamp_fixtures::{Mesh, Sample, cone};
use lamp_stack::{Image, Layer, Mask};
use lamp_tests::{Scratch, masks};

/// Layers of 100 um to 2.5 mm.
const LIMITS: &str = "--min 100um --max 2.5mm --step 10um";

fn with_tower() -> Scratch {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 5_000);
    scratch.write("times.csv", b"thickness_um,exposure_ms\n100,200\n500,1000\n2500,9000\n");
    scratch
}

fn heights_of(layers: &[Layer]) -> Vec<[f64; 2]> {
    layers.iter().map(|l| [l.info.z_um.unwrap(), l.info.thickness_um.unwrap()]).collect()
}

/// Returns the rows of a report, by column.
fn report(scratch: &Scratch, name: &str) -> Vec<Vec<f64>> {
    let text = String::from_utf8(scratch.bytes(name)).unwrap();
    let mut lines = text.lines();
    assert_eq!(
        lines.next().unwrap(),
        "layer,z_um,thickness_um,volume_mm3,lost_mm3,gained_mm3,deviation_percent,cusp_um,\
         area_percent,exposure_ms"
    );
    let number = |cell: &str| if cell.is_empty() { f64::NAN } else { cell.parse().unwrap() };
    lines.map(|line| line.split(',').map(number).collect()).collect()
}

#[test]
fn a_stack_has_the_layers_of_the_report() {
    let scratch = with_tower();
    let options = format!("{LIMITS} --deviation 2% --exposure-table times.csv");
    scratch
        .run(&format!("slice tower.stl --dpi 200 --adaptive {options} -o tower.tif"))
        .succeeds_quietly();
    let line =
        format!("lamp heights tower.stl --dpi 200 {options} --csv heights.csv --plot heights.svg");
    let said = String::from_utf8(scratch.run(&line).succeeds().stdout).unwrap();
    let layers = scratch.layers("tower.tif");
    let rows = report(&scratch, "heights.csv");
    assert_eq!(rows.len(), layers.len());
    assert!(said.contains("volume 2.00%") && said.contains("uniform 2.5mm"), "{said}");
    assert!(said.contains(&format!("{:>8}", layers.len())), "{said}");
    let mut top = 0.0;
    for (layer, row) in layers.iter().zip(&rows) {
        let info = &layer.info;
        let (z, thickness) = (info.z_um.unwrap(), info.thickness_um.unwrap());
        assert_eq!([row[0], row[1], row[2]], [f64::from(info.index), z, thickness]);
        assert_eq!(info.exposure_ms, Some(row[9]));
        assert!((z - top).abs() < 1e-9 && thickness % 10.0 == 0.0, "{z} {thickness}");
        assert!((100.0..=2500.0).contains(&thickness));
        let expected = if thickness > 500.0 { 4.0 * thickness - 1000.0 } else { 2.0 * thickness };
        assert!((row[9] - expected).abs() < 2e-3, "{row:?}");
        assert!(row[6] <= 2.0 || thickness == 100.0, "{row:?}");
        top = z + thickness;
    }
    assert_eq!(top, 76_200.0);
    let past = rows.iter().filter(|row| row[6] > 2.0).count();
    assert!(past < 15 && said.lines().nth(1).unwrap().contains(&format!("{past:>12}")), "{said}");
    let thick = rows.iter().filter(|row| row[2] == 2500.0).count();
    assert!(thick >= 7 && rows.len() > 100, "{thick} of {}", rows.len());
    let plot = String::from_utf8(scratch.bytes("heights.svg")).unwrap();
    for text in [
        "Layer thickness",
        "Volume deviation",
        "Volume lost and gained, from the bottom up",
        "volume 2.00%",
        "uniform 2.5mm",
        "z (mm)",
    ] {
        assert!(plot.contains(text), "{text}");
    }
}

#[test]
fn ranges_of_height_have_their_own_bounds() {
    let scratch = Scratch::new();
    scratch.mesh("cone.stl", &cone(5.0, 1.0, 4.0, 2_000));
    let bounds = "--cusp 30um@0..2mm,15um@2mm.. --min 5um";
    scratch.run(&format!("slice cone.stl --dpi 200 --adaptive {bounds} -q -o cone.tif")).succeeds();
    let said = scratch.run(&format!("lamp heights cone.stl {bounds} --csv heights.csv")).succeeds();
    let said = String::from_utf8(said.stdout).unwrap();
    assert!(said.contains("cusp 15.0..30.0um"), "{said}");
    let layers = scratch.layers("cone.tif");
    // Cusps of a slope of 45 degrees are t / sqrt(2): 42 um in the lower half, 21 um in the upper.
    assert_eq!(layers.len(), 48 + 96);
    for [z, thickness] in heights_of(&layers) {
        let most = if z + thickness <= 2000.0 { 42.0 } else { 21.0 };
        assert!(thickness <= most, "{z} {thickness}");
    }
    let rows = report(&scratch, "heights.csv");
    assert!(rows.iter().map(|row| [row[1], row[2]]).eq(heights_of(&layers)));
    // The recorded command leads to the same stack.
    let command = &layers[0].info.stack.as_ref().unwrap().commands[0];
    assert!(command.contains("--cusp 30um@0um..2mm,15um@2mm.."), "{command}");
    assert!(scratch.run(command).succeeds().stdout == scratch.bytes("cone.tif"));
    scratch
        .run("lamp heights cone.stl --cusp 30um@0..2mm")
        .is_refused_with(&["cone.stl: no bound holds from 2mm to 4mm, where the part is"]);
    for (wrong, why) in [
        ("2%@0..2mm,1%@1mm..", "0um..2mm and 1mm.. overlap"),
        ("2%@0..2mm,1%@3mm..", "0um..2mm and 3mm.. leave a gap"),
        ("2%@2", "`2` is not a range of height"),
    ] {
        let ran = scratch.run(&format!("lamp heights cone.stl --deviation {wrong}"));
        assert!(ran.statuses == [Some(2)] && ran.stderr.contains(why), "{ran:?}");
    }
}

/// Returns the volume of a stack's white pixels in cubic millimeters.
fn volume(layers: &[Layer]) -> f64 {
    let of_layer = |(layer, mask): (&Layer, &Mask)| {
        let [x, y] = layer.pitch.unwrap().mm();
        mask.white_pixels() as f64 * x * y * layer.info.thickness_um.unwrap() / 1000.0
    };
    layers.iter().zip(masks(layers)).map(of_layer).sum()
}

/// Figure 38: sections of a sphere of 14,137 mm3 are widest and narrowest at ends of layers.
#[test]
fn stacks_contain_a_sphere_or_lie_inside() {
    let scratch = Scratch::new();
    scratch.part("sphere.stl", Sample::Sphere, 100_000);
    let slice = "slice sphere.stl --dpi 200 --thickness 0.5mm";
    let of = |side: &str| {
        scratch.run(&format!("{slice} --side {side} -o {side}.tif")).succeeds_quietly();
        scratch.layers(&format!("{side}.tif"))
    };
    let [inside, both, outside] = ["inside", "both", "outside"].map(of);
    let section = |k: i32| PI * (225.0 - (f64::from(k) * 0.5 - 15.0).powi(2));
    let sum = |pick: fn(f64, f64) -> f64| {
        (0..60).map(|k| 0.5 * pick(section(k), section(k + 1))).sum::<f64>()
    };
    for (layers, expected) in [(&inside, sum(f64::min)), (&outside, sum(f64::max))] {
        let volume = volume(layers);
        assert!((volume / expected - 1.0).abs() < 1e-3, "{volume} for {expected}");
    }
    for (k, [i, b]) in masks(&inside).iter().zip(masks(&both)).map(|(i, b)| [*i, b]).enumerate() {
        let o = masks(&outside)[k];
        let all = || (0..b.height()).flat_map(|r| (0..b.width()).map(move |c| [c, r]));
        assert!(all().all(|[c, r]| i.is_white(c, r) <= b.is_white(c, r)), "{k}");
        assert!(all().all(|[c, r]| b.is_white(c, r) <= o.is_white(c, r)), "{k}");
    }
    let command = &outside[0].info.stack.as_ref().unwrap().commands[0];
    assert!(command.contains(" --side outside"), "{command}");
    assert!(scratch.run(command).succeeds().stdout == scratch.bytes("outside.tif"));

    // The report has the volume that the images have, and its layers.
    let adaptive = "--min 100um --max 1mm --step 10um --deviation 2%";
    for side in ["inside", "outside"] {
        let line = format!("lamp heights sphere.stl --side {side} {adaptive} --csv heights.csv");
        scratch.run(&line).succeeds();
        let rows = report(&scratch, "heights.csv");
        let slice = format!("slice sphere.stl --dpi 200 --side {side} --adaptive {adaptive}");
        scratch.run(&format!("{slice} -o {side}.tif")).succeeds_quietly();
        let layers = scratch.layers(&format!("{side}.tif"));
        assert!(rows.iter().map(|row| [row[1], row[2]]).eq(heights_of(&layers)), "{side}");
        let built: f64 = rows.iter().map(|row| row[3] - row[4] + row[5]).sum();
        let found = volume(&layers);
        assert!((found / built - 1.0).abs() < 1e-3, "{side}: {found} for {built}");
        let none = if side == "inside" { 5 } else { 4 };
        assert!(rows.iter().all(|row| row[none] == 0.0), "{side}");
    }
    for (options, why) in [
        ("--side inside --plane middle", "--side cuts layers at their tops: leave out --plane"),
        ("--side inside --antialias", "decides all pixels of a layer: leave out --antialias"),
        ("--side outside --gray --material lamp-suspension", "leave out --gray"),
        ("--side top", "possible values: both, inside, outside"),
    ] {
        let ran = scratch.run(&format!("slice sphere.stl {options} -o x.tif"));
        assert!(ran.statuses == [Some(2)] && ran.stderr.contains(why), "{ran:?}");
    }
}

/// Stairs are a quarter as rough as their cusps are high, unless a line says otherwise.
#[test]
fn roughness_bounds_layers() {
    let scratch = Scratch::new();
    scratch.mesh("cone.stl", &cone(5.0, 1.0, 4.0, 2_000));
    let layers = |options: &str| {
        let line = format!("lamp heights cone.stl --min 5um {options} --csv heights.csv");
        let said = String::from_utf8(scratch.run(&line).succeeds().stdout).unwrap();
        // Without exposures, which are not given.
        let rows = report(&scratch, "heights.csv");
        (said, rows.iter().map(|row| row[..9].to_vec()).collect::<Vec<_>>())
    };
    let (said, rough) = layers("--ra 5.9um");
    let (_, cusps) = layers("--cusp 23.6um");
    let (_, line) = layers("--ra 6.32um --ra-line 0.2,1.6um");
    assert!(said.contains("ra 5.90um") && rough == cusps && line == cusps, "{said}");
    // A slope of 45 degrees: 33 um have cusps of 23.3 um.
    assert!(rough.iter().all(|row| row[2] <= 33.0) && rough.len() == 122, "{}", rough.len());
    for (options, why) in [
        ("--ra 6um --cusp 9um", "cannot be used with"),
        ("--criterion ra", "--criterion ra needs a bound, such as --ra 6um"),
        ("--ra 6um --criterion volume", "--ra needs --criterion ra"),
        ("--ra-line 0.2,1um", "--ra-line needs a bound of roughness"),
        ("--ra 6um --ra-line 0.2", "`0.2` is no line of roughness"),
    ] {
        let ran = scratch.run(&format!("lamp heights cone.stl {options}"));
        assert!(ran.statuses == [Some(2)] && ran.stderr.contains(why), "{ran:?}");
    }
}

#[test]
fn every_stage_keeps_what_layers_say() {
    let scratch = with_tower();
    let slice = format!(
        "slice tower.stl --dpi 200 --adaptive {LIMITS} --deviation 5% --material lamp-suspension"
    );
    let said = scratch.run(&format!("{slice} -o plain.tif")).succeeds().stderr;
    let doubt = "lamp-suspension was measured at 320 to 1920 mJ/cm2";
    assert_eq!(said.matches(doubt).count(), 1, "{said}");
    let stages =
        "fix -q | lamp compensate --uniform 127um -q | dither -q | tile --mesh none -q > build.tif";
    scratch.run(&format!("{slice} -q | {stages}")).succeeds_quietly();
    let (plain, build) = (scratch.layers("plain.tif"), scratch.layers("build.tif"));
    assert_eq!(heights_of(&build), heights_of(&plain));
    for (plain, build) in plain.iter().zip(&build) {
        assert_eq!(build.info.exposure_ms, plain.info.exposure_ms);
        // 137.4 mJ/cm2 exp(t / 215.2 um) at 1.6 W/cm2.
        let ms = 137.4 / 1.6 * (plain.info.thickness_um.unwrap() / 215.2).exp();
        assert!((plain.info.exposure_ms.unwrap() - ms).abs() < 1e-3 * ms, "{ms}");
    }
    // The command recorded on the first page reproduces the stack.
    let command = &plain[0].info.stack.as_ref().unwrap().commands[0];
    let again = scratch.run(command).succeeds().stdout;
    assert!(again == scratch.bytes("plain.tif"));
    let said = scratch.run("lamp info build.tif").succeeds().stdout;
    let said = String::from_utf8(said).unwrap();
    assert!(said.contains("thickness:") && said.contains(" to 2500 um"), "{said}");
    assert!(said.contains(" s in all"), "{said}");
}

#[test]
fn threads_memory_and_the_order_of_facets_change_no_byte() {
    let scratch = with_tower();
    let slice = format!("slice tower.stl --dpi 100 --adaptive {LIMITS} --deviation 3%");
    scratch.run(&format!("{slice} -o a.tif")).succeeds_quietly();
    for options in ["--threads 1", "--threads 3 --memory 16MB"] {
        scratch.run(&format!("{slice} {options} -o b.tif")).succeeds_quietly();
        assert!(scratch.bytes("a.tif") == scratch.bytes("b.tif"), "{options}");
    }
    // A range has the same layers.
    scratch.run(&format!("{slice} --layers 5..9 -o range.tif")).succeeds_quietly();
    let (all, range) = (scratch.layers("a.tif"), scratch.layers("range.tif"));
    assert_eq!(masks(&all)[5..9], masks(&range));
    assert_eq!(heights_of(&all)[5..9], heights_of(&range));
}

/// Each layer's gray levels and exposure suit its own thickness and cure no deeper than the part.
#[test]
fn gray_layers_have_the_levels_of_their_thickness() {
    let scratch = with_tower();
    let gray = "--gray --material lamp-suspension";
    let slice = "slice tower.stl --dpi 200 --adaptive --min 100um --max 600um --step 10um";
    let said = scratch.run(&format!("{slice} --deviation 3% {gray} -o gray.tif")).succeeds().stderr;
    assert!(said.contains("layers get 2") && said.contains("at 320 to 1920 mJ/cm2"), "{said}");
    let layers = scratch.layers("gray.tif");
    assert!(layers.iter().filter(|layer| matches!(*layer.image, Image::Gray(_))).count() > 20);
    let line = "lamp cure gray.tif --material lamp-suspension --section y=0mm --part tower.stl --alone -o x.png";
    let said = String::from_utf8(scratch.run(line).succeeds().stdout).unwrap();
    let outside = |name: &str| -> f64 {
        let line = said.lines().find(|line| line.starts_with(name)).expect(&said);
        line.split_whitespace().nth(3).unwrap().parse().unwrap()
    };
    assert!(outside("gray") < 0.25 * outside("white"), "{said}");
}

/// Builds a plate of 1.03 mm with a narrower one on it.
fn steps() -> Mesh {
    let plate = |radius: f64, low: f64, high: f64| {
        cone(radius, radius, high - low, 400).map(|[x, y, z]| [x, y, z + low])
    };
    let facets = [plate(8.0, 0.0, 1.03), plate(3.0, 1.03, 2.0)];
    Mesh { facets: facets.into_iter().flat_map(|mesh| mesh.facets).collect() }
}

#[test]
fn layers_snap_to_flat_faces() {
    let scratch = Scratch::new();
    scratch.mesh("steps.stl", &steps());
    let slice = "slice steps.stl --dpi 300 --adaptive --deviation 90%";
    let boundary = |options: &str| {
        scratch.run(&format!("{slice} {options} -o steps.tif")).succeeds_quietly();
        let layers = scratch.layers("steps.tif");
        heights_of(&layers).iter().any(|[z, _]| (1029.0..=1030.0).contains(z))
    };
    assert!(boundary("--snap") && !boundary(""));
}

#[test]
fn budgets_are_kept() {
    let scratch = with_tower();
    let slice = format!("slice tower.stl --dpi 100 --adaptive {LIMITS}");
    scratch.run(&format!("{slice} --layers-budget 120 -q -o few.tif")).succeeds_quietly();
    let count = scratch.layers("few.tif").len();
    assert!((110..=120).contains(&count), "{count}");
    let time = "--time-budget 1h --layer-overhead 30s --exposure-table times.csv";
    scratch.run(&format!("{slice} {time} -q -o quick.tif")).succeeds_quietly();
    let layers = scratch.layers("quick.tif");
    let exposures = layers.iter().map(|layer| layer.info.exposure_ms.unwrap() / 1000.0);
    let seconds = exposures.sum::<f64>() + 30.0 * layers.len() as f64;
    assert!((3400.0..=3600.0).contains(&seconds), "{seconds}");
}

#[test]
fn what_cannot_be_is_said() {
    let scratch = with_tower();
    let usage = |line: &str, word: &str| {
        let ran = scratch.run(line);
        assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
        assert!(ran.stderr.contains(word) && !ran.stderr.contains("tower.stl:"), "{ran:?}");
    };
    usage("slice tower.stl --deviation 2%", "--deviation needs --adaptive");
    usage("slice tower.stl --adaptive --plane middle", "leave out --plane");
    usage("slice tower.stl --adaptive --thickness 50um", "cannot be used with");
    usage("slice tower.stl --adaptive --min 50um --max 25um", "between 50um and 25um thick");
    usage("slice tower.stl --adaptive --cusp 9um --criterion volume", "--criterion cusp");
    usage("lamp heights tower.stl --criterion cusp", "needs a bound, such as --cusp");
    usage("lamp heights tower.stl --time-budget 1h", "give --material or --exposure-table");
    usage("lamp heights tower.stl --plot x.pdf", "end its name in .svg, .png or .csv");
    usage("lamp heights tower.stl --plot x.svg --csv x.svg", "a table is CSV");
    usage("lamp heights tower.stl --deviation 2", "write 2% or 0.02");
    usage("lamp heights tower.stl --deviation 2%@..5mm,0%@5mm..", "--deviation must be above zero");
    usage("slice tower.stl --adaptive --cusp 0um", "above zero");
    usage(
        "slice tower.stl --adaptive --gray --material lamp-suspension --exposure-table times.csv",
        "cannot be used with",
    );
    scratch
        .run("lamp heights tower.stl --layers-budget 9")
        .is_refused_with(&["take 762 layers, more than the budget of 9 layers"]);
    scratch
        .run("lamp heights tower.stl --exposure-table times.csv")
        .is_refused_with(&["times.csv: the table covers 100um to 2.5mm"]);
    scratch.write("bad.csv", b"thickness_um,exposure_ms\n100,soon\n");
    scratch
        .run("lamp heights tower.stl --exposure-table bad.csv")
        .is_refused_with(&["bad.csv", "line 2", "soon"]);
    let ran = scratch.run("slice tower.stl --adaptive --exposure-table times.csv -o times.csv");
    assert!(ran.stderr.contains("times.csv: that is an input"), "{ran:?}");
}

#[test]
fn gaps_are_told_of() {
    let scratch = with_tower();
    scratch.run("lamp sample tower --facets 5000 --defect drop -o gaps.stl").succeeds();
    let ran = scratch.run(&format!("lamp heights gaps.stl {LIMITS}")).succeeds();
    assert!(ran.stderr.contains("do not balance: the mesh has gaps"), "{ran:?}");
    let ran = scratch.run(&format!("slice gaps.stl --dpi 100 --adaptive {LIMITS} -o gaps.tif"));
    assert!(ran.stderr.contains("decide the thickness of these layers"), "{ran:?}");
    scratch.run(&format!("lamp heights gaps.stl {LIMITS} -q")).succeeds_quietly();
}
