//! Checks that `lamp target scan`, `lamp calibrate scan` and `lamp compensate` agree on light that
//! spreads differently along and across the scan, and `lamp calibrate spread` on squares seen from the
//! side, with prints simulated by closed forms.

use std::fmt::Write as _;

use lamp_fixtures::SplitMix;
use lamp_stack::{Image, Layer, Mask, MaskBuilder, PageInfo, Pitch, StackInfo};
use lamp_tests::{Scratch, mask};
use serde_json::Value;

use crate::plot_tables::is_as_in_the_book;

const PITCH: f64 = 25_400.0 / 1500.0;

/// The share of a normal distribution below a number of standard deviations, by Simpson's rule.
fn below(z: f64) -> f64 {
    let z = z.clamp(-9.0, 9.0);
    let density = |t: f64| (-0.5 * t * t).exp() / std::f64::consts::TAU.sqrt();
    let step = z / 400.0;
    let inner = |k: u32| if k % 2 == 1 { 4.0 } else { 2.0 } * density(f64::from(k) * step);
    0.5 + step / 3.0 * (density(0.0) + density(z) + (1..400).map(inner).sum::<f64>())
}

/// The light at a place of a line of white runs, each with its share of white, all in um.
fn light(runs: &[[f64; 3]], sigma: f64, at: f64) -> f64 {
    let near = runs.iter().filter(|run| at - run[1] < 9.0 * sigma && run[0] - at < 9.0 * sigma);
    near.map(|&[start, end, share]| {
        share * (below((end - at) / sigma) - below((start - at) / sigma))
    })
    .sum()
}

/// How wide the light around a place stays above a threshold, or below it; zero if not there.
fn width_around(runs: &[[f64; 3]], sigma: f64, threshold: f64, middle: f64, is_white: bool) -> f64 {
    let holds = |at: f64| (light(runs, sigma, at) >= threshold) == is_white;
    if !holds(middle) {
        return 0.0;
    }
    let end = |sign: f64| {
        // By steps to the first place beyond, then halved.
        let step = sigma / 4.0;
        let past = (1..).map(|k| f64::from(k) * step).find(|away| !holds(middle + sign * away));
        let [mut inside, mut outside] = past.map(|past| [past - step, past]).unwrap();
        for _ in 0..40 {
            let half = f64::midpoint(inside, outside);
            if holds(middle + sign * half) { inside = half } else { outside = half }
        }
        inside
    };
    end(1.0) + end(-1.0)
}

/// The white runs of a line of pixels, in um.
fn runs(count: u32, is_white: impl Fn(u32) -> bool) -> Vec<[f64; 3]> {
    let mut runs: Vec<[f64; 3]> = Vec::new();
    for at in (0..count).filter(|&at| is_white(at)) {
        let [start, end] = [at, at + 1].map(|at| f64::from(at) * PITCH);
        match runs.last_mut() {
            Some(run) if (run[1] - start).abs() < 1e-6 => run[1] = end,
            _ => runs.push([start, end, 1.0]),
        }
    }
    runs
}

/// Measures the print of a target of one dose, and fills in its table.
fn filled(
    scratch: &Scratch,
    sigmas: [f64; 2],
    threshold: f64,
    mut error: impl FnMut() -> f64,
) -> String {
    let layers = scratch.layers("lines/lines.tif");
    let image = mask(&layers[0]);
    let row = (0..image.height()).find(|&row| !image.row(row).is_empty()).unwrap() + 100;
    let across = runs(image.width(), |column| image.is_white(column, row));
    let column = (0..image.width()).rev().find(|&column| image.is_white(column, 60)).unwrap() - 100;
    let along = runs(image.height(), |row| image.is_white(column, row));
    let table = String::from_utf8(scratch.bytes("lines/lines.csv")).unwrap();
    let count = table.lines().filter(|line| line.starts_with("across,line")).count();
    let mut measured = Vec::new();
    for (runs, sigma) in [(&across, sigmas[0]), (&along, sigmas[1])] {
        let lines = runs[..count].iter().map(|run| (run[0].midpoint(run[1]), true));
        let plate = &runs[count..2 * count + 1];
        let gaps = plate.windows(2).map(|pair| (pair[0][1].midpoint(pair[1][0]), false));
        for (middle, is_white) in lines.chain(gaps) {
            measured.push(width_around(runs, sigma, threshold, middle, is_white));
        }
    }
    let mut measured = measured.into_iter();
    let mut out = String::new();
    for line in table.lines() {
        if line.starts_with("across,") || line.starts_with("along,") {
            let width = measured.next().unwrap();
            let width = if width > 0.0 { width + error() } else { 0.0 };
            writeln!(out, "{line}{width:.3}").unwrap();
        } else {
            writeln!(out, "{line}").unwrap();
        }
    }
    assert_eq!(measured.next(), None);
    out
}

/// The value and the interval in a printed line.
fn estimate(said: &str, name: &str) -> [f64; 3] {
    let line = said.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{said}"));
    let numbers: Vec<f64> =
        line[name.len()..].split_whitespace().map(|n| n.parse().unwrap()).collect();
    numbers.try_into().unwrap()
}

fn said(scratch: &Scratch, line: &str) -> String {
    String::from_utf8(scratch.run(line).succeeds().stdout).unwrap()
}

#[test]
fn both_spreads_come_back_from_a_simulated_print() {
    let scratch = Scratch::new();
    let line = "lamp target scan --doses 200mJ/cm2 --intensity 1W/cm2 -o lines/";
    let told = scratch.run(line).succeeds().stderr;
    assert!(told.contains("lines.tif of 1 exposure, and lines.csv to fill in"), "{told}");
    assert_eq!(scratch.layers("lines/lines.tif")[0].info.exposure_ms, Some(200.0));
    let truth = [30.0, 45.0, 90.0];
    let table = filled(&scratch, [truth[0], truth[1]], truth[2] / 200.0, || 0.0);
    scratch.write("exact.csv", table.as_bytes());
    let calibrate = "lamp calibrate scan exact.csv -o mine.toml --plot lines.svg";
    let exact = said(&scratch, calibrate);
    let answer: Value =
        serde_json::from_str(&said(&scratch, &format!("{calibrate} --json"))).unwrap();
    let again = said(&scratch, "lamp calibrate scan exact.csv --plot lines.csv");
    assert_eq!(again, exact);
    is_as_in_the_book(&scratch, "lamp calibrate scan", "lines.csv");
    let names = ["sigma across (um)", "sigma along (um)", "Ec of lines (mJ/cm2)"];
    for (parameter, name) in answer["parameters"].as_array().unwrap().iter().zip(names) {
        let (told, unit) = (&parameter["name"], &parameter["unit"]);
        assert_eq!(format!("{} ({})", told.as_str().unwrap(), unit.as_str().unwrap()), name);
        let [value, ..] = estimate(&exact, name);
        assert!((parameter["value"].as_f64().unwrap() / value - 1.0).abs() < 1e-3, "{answer}");
    }
    for (name, truth) in names.into_iter().zip(truth) {
        let [value, ..] = estimate(&exact, name);
        assert!((value / truth - 1.0).abs() < 1e-3, "{name}: {value} of {truth}");
    }
    let svg = String::from_utf8(scratch.bytes("lines.svg")).unwrap();
    assert!(svg.contains("gaps along, 200 mJ/cm²: spread 45.000 µm (45.000 to 45.000)"));
    let mut noise = SplitMix(7);
    let table = filled(&scratch, [truth[0], truth[1]], truth[2] / 200.0, || 2.0 * noise.normal());
    scratch.write("noisy.csv", table.as_bytes());
    let noisy = said(&scratch, "lamp calibrate scan noisy.csv --material zsg-amber -o noisy.toml");
    for (name, truth) in names.into_iter().zip(truth) {
        let [value, low, high] = estimate(&noisy, name);
        assert!(low < truth && truth < high, "{name}: {low} to {high}");
        assert!((value / truth - 1.0).abs() < 0.12, "{name}: {value} of {truth}");
    }
    // The light of a wide field stays, though the spread of the pixel that it was stated for does not.
    let light = |name: &str| -> Value {
        let answer = said(&scratch, &format!("lamp material show {name} --json"));
        serde_json::from_str::<Value>(&answer).unwrap()["materials"][0].clone()
    };
    let [before, after] = ["zsg-amber", "noisy.toml"].map(light);
    assert_eq!(before["light_mw_per_cm2"], after["light_mw_per_cm2"]);
    assert!(after["spread_um"].is_null() && after["spread_along_um"].as_f64().unwrap() > 40.0);
    let checked = said(&scratch, "lamp material check noisy.toml");
    assert!(checked.contains("across and ") && checked.contains("um along the scan"), "{checked}");
    let profile = "lamp material profile noisy.toml --dose 500mJ/cm2";
    scratch.run(profile).is_wrong_usage(&["along the scan", "give --beam"]);
}

#[test]
fn tables_that_show_no_spread_are_refused() {
    let scratch = Scratch::new();
    let head = "direction,kind,feature_um,dose_mj_per_cm2,cured_um\n";
    let refused = |rows: &str, words: &[&str]| {
        scratch.write("a.csv", format!("{head}{rows}").as_bytes());
        scratch.run("lamp calibrate scan a.csv -o mine.toml").is_refused_with(words);
        assert!(!scratch.path("mine.toml").exists());
    };
    let across = "across,line,50,100,60\nacross,line,90,100,101\nacross,gap,90,100,80\n";
    refused(across, &["a.csv: 0 lines and gaps measured along the scan are too few"]);
    let alike = "along,line,50,100,60\n".repeat(3);
    refused(&format!("{across}{alike}"), &["along the scan are alike", "several widths"]);
    refused("across,line,50,100,NaN\n", &["line 2, column cured_um: `NaN` is not a number"]);
    refused("across,slit,50,100,9\n", &["slit is not `line` or `gap`"]);
    refused("across,line,50,100,\n", &["no row"]);
    let target = "lamp target scan -o lines --intensity 1W/cm2";
    for (line, word) in [
        (format!("{target} --doses 1mJ/cm2 --widths 3,3"), "--widths: 3 is given twice"),
        (format!("{target} --doses 1mJ/cm2 --widths 0,3"), "lines of 0 pixels"),
        (format!("{target} --doses 1mJ/cm2 --length 0um"), "above zero"),
        ("lamp target scan -o lines --doses 1mJ/cm2".to_owned(), "--intensity"),
    ] {
        scratch.run(&line).is_wrong_usage(&[word]);
    }
}

/// A rectangle of pixels.
fn block(size: [u32; 2], columns: [u32; 2], rows: [u32; 2]) -> Mask {
    let mut mask = MaskBuilder::new(size[0]);
    for row in 0..size[1] {
        let is_in = (rows[0]..rows[1]).contains(&row);
        mask.push_row(if is_in { &columns[..] } else { &[] }).unwrap();
    }
    mask.finish()
}

#[test]
fn a_compensated_block_prints_at_its_size_in_both_directions() {
    let scratch = Scratch::new();
    let image = block([256, 240], [50, 200], [40, 190]);
    let layer = Layer {
        info: PageInfo { stack: Some(StackInfo::default()), ..PageInfo::default() },
        pitch: Pitch::of_dpi(1500.0),
        image: Image::Mask(image).into(),
    };
    scratch.stack("block.tif", [layer]);
    let material = "name = \"mine\"\ndescription = \"\"\n[spread]\n\
                    sigma-across = { value = \"22 um\", source = \"lines\" }\n\
                    sigma-along = { value = \"48 um\", source = \"lines\" }\n\
                    critical-dose = { value = \"60 mJ/cm2\", source = \"lines\" }\n";
    scratch.write("mine.toml", material.as_bytes());
    let line = "lamp compensate block.tif --material mine.toml --dose 200mJ/cm2 -o out.tif";
    scratch.run(line).is_refused_with(&[
        "block.tif: layer 0",
        "along x and y",
        "--min-feature 0um",
    ]);
    scratch.run(&format!("{line} --min-feature 0um")).succeeds_quietly();
    let layers = scratch.layers("out.tif");
    // At 30 % of white, light ends 0.5244 σ outside of an edge.
    let inwards = layers[0].info.other["compensate"]["inwards_um"].clone();
    for (at, um) in [0.5244 * 22.0, 0.5244 * 48.0].into_iter().enumerate() {
        assert!((inwards[at].as_f64().unwrap() - um).abs() < 0.01, "{inwards}");
    }
    let Image::Gray(gray) = &*layers[0].image else { panic!("edges between pixels are gray") };
    let line = |count: u32, level: &dyn Fn(u32) -> u8| -> Vec<[f64; 3]> {
        let pixel = |at: u32| {
            let [start, end] = [at, at + 1].map(|at| f64::from(at) * PITCH);
            [start, end, f64::from(level(at)) / 255.0]
        };
        (0..count).map(pixel).filter(|pixel| pixel[2] > 0.0).collect()
    };
    let across = line(256, &|column| gray.level(column, 115));
    let along = line(240, &|row| gray.level(125, row));
    for (runs, sigma, middle) in [(across, 22.0, 125.0), (along, 48.0, 115.0)] {
        let printed = width_around(&runs, sigma, 0.3, middle * PITCH, true);
        // Uncompensated, 23 and 50 um would be too much. Gray of part of a pixel shines from all of
        // it, which moves both edges by up to p² z / 8 σ, 0.9 um here.
        assert!((printed - 150.0 * PITCH).abs() < 1.8, "{printed}");
    }
    // A dose that cures nothing, and a pair of distances.
    let dark = "lamp compensate block.tif --material mine.toml --dose 60mJ/cm2 -o out.tif";
    scratch.run(dark).is_refused_with(&["block.tif: layer 0 gets 60 mJ/cm2", "greater --dose"]);
    let pair = format!(
        "lamp compensate block.tif --uniform {}x{}um --min-feature 0um --one-bit",
        PITCH,
        3.0 * PITCH
    );
    scratch.run(&format!("{pair} -o out.tif")).succeeds_quietly();
    assert_eq!(mask(&scratch.layers("out.tif")[0]), &block([256, 240], [51, 199], [43, 187]));
    let grown = "lamp compensate block.tif --uniform -0x-40um -o out.tif";
    scratch.run(grown).succeeds_quietly();
    let mixed = "lamp compensate block.tif --uniform -25x40um -o out.tif";
    scratch.run(mixed).is_wrong_usage(&["give both alike"]);
}

/// Films of four gray levels, simulated, give gamma and the working curve back.
#[test]
fn films_of_gray_levels_give_gamma_back() {
    let scratch = Scratch::new();
    let mut noise = SplitMix(11);
    let mut table = "gray,dose_mj_per_cm2,depth_um\n0.25,100,0\n".to_owned();
    for gray in [1.0, 0.75, 0.5, 0.25] {
        for dose in [400.0, 800.0, 1600.0] {
            let depth = 125.0 * (dose * f64::powf(gray, 1.8) / 20.0).ln() + 5.0 * noise.normal();
            writeln!(table, "{gray},{dose},{depth:.1}").unwrap();
        }
    }
    scratch.write("films.csv", table.as_bytes());
    let fit = "lamp calibrate gamma films.csv -o mine.toml --plot fit.csv --report fit.json";
    scratch.run(fit).succeeds();
    is_as_in_the_book(&scratch, "lamp calibrate gamma", "fit.csv");
    let answer: Value = serde_json::from_slice(&scratch.bytes("fit.json")).unwrap();
    for (at, (name, truth)) in [("gamma", 1.8), ("Ec", 20.0), ("Dp", 125.0)].iter().enumerate() {
        let number = &answer["parameters"][at];
        assert_eq!(number["name"], *name);
        let [low, high] = ["low", "high"].map(|end| number[end].as_f64().unwrap());
        assert!(low < *truth && *truth < high && high - low < truth / 2.0, "{number}");
    }
    let toml = String::from_utf8(scratch.bytes("mine.toml")).unwrap();
    assert!(toml.contains("[gamma]") && toml.contains("[working-curve"), "{toml}");
    scratch.run("lamp material check mine.toml").succeeds();
    scratch.write("white.csv", b"dose_mj_per_cm2,depth_um\n400,370\n800,460\n1600,550\n3200,640\n");
    let white = scratch.run("lamp calibrate gamma white.csv");
    white.is_refused_with(&["white.csv", "1 gray level is too few: 3"]);
}

/// Squares of four gray levels, simulated and measured from the side, give the light back, and a material that
/// planners take.
#[test]
fn profiles_of_squares_give_their_light_back() {
    let scratch = Scratch::new();
    let grays = "lamp target grays --dpi 1500 --square 500um --expose 4s -o grays.tif";
    scratch.run(grays).succeeds();
    let pages = scratch.layers("grays.tif");
    let Image::Gray(image) = &*pages[0].image else { panic!("it is gray") };
    let row: Vec<[u32; 2]> = image.row(70).iter().map(|it| [it.column, it.level.into()]).collect();
    // 59 pixels of gap and 30 of square.
    let levels =
        [[59, 255], [89, 0], [148, 191], [178, 0], [237, 128], [267, 0], [326, 64], [356, 0]];
    assert_eq!(row, levels);
    let [sigma, fading, gamma, critical, dose, side] = [60.0, 125.0, 1.8, 20.0, 600.0, 500.0];
    let mut noise = SplitMix(11);
    let square = [[-side / 2.0, side / 2.0, 1.0]];
    let mut table = "gray,side_um,x_um,depth_um,dose_mj_per_cm2\n".to_owned();
    let mut undosed = "gray,side_um,x_um,depth_um\n".to_owned();
    for gray in [1.0, 0.75, 0.5, 0.25] {
        for step in -7..=7 {
            let at = f64::from(step) * 50.0;
            let share = light(&square, sigma, at) * light(&square, sigma, 0.0);
            let depth = fading * (dose * f64::powf(gray, gamma) * share / critical).ln();
            let [x, depth] = [at, depth].map(|um| um + 4.0 * noise.normal());
            let depth = depth.max(0.0);
            writeln!(table, "{gray},{side},{x:.1},{depth:.1},{dose}").unwrap();
            writeln!(undosed, "{gray},{side},{x:.1},{depth:.1}").unwrap();
        }
    }
    scratch.write("profiles.csv", table.as_bytes());
    scratch.write("light.csv", undosed.as_bytes());
    let fit = "lamp calibrate spread profiles.csv --intensity 20mW/cm2 -o mine.toml --plot fit.csv --report fit.json";
    scratch.run(fit).succeeds();
    is_as_in_the_book(&scratch, "lamp calibrate spread", "fit.csv");
    let answer: Value = serde_json::from_slice(&scratch.bytes("fit.json")).unwrap();
    let holds = |name: &str, truth: f64| {
        let all = answer["parameters"].as_array().unwrap();
        let number = all.iter().find(|it| it["name"] == name).unwrap();
        let [low, high] = ["low", "high"].map(|end| number[end].as_f64().unwrap());
        assert!(low < truth && truth < high, "{number}");
        // The critical dose, at the end of a logarithm, is known to 15 %.
        assert!((number["value"].as_f64().unwrap() / truth - 1.0).abs() < 0.15, "{number}");
    };
    for (name, truth) in [("sigma", sigma), ("Dp", fading), ("gamma", gamma), ("Ec", critical)] {
        holds(name, truth);
    }
    let toml = String::from_utf8(scratch.bytes("mine.toml")).unwrap();
    for part in ["[spread.sigma]", "[gamma]", "[working-curve"] {
        assert!(toml.contains(part), "{toml}");
    }
    scratch.run("lamp material check mine.toml").succeeds();
    // Without doses, the working curve stays as it is.
    scratch.run("lamp calibrate spread light.csv -o light.toml").succeeds();
    let toml = String::from_utf8(scratch.bytes("light.toml")).unwrap();
    assert!(toml.contains("[spread") && !toml.contains("working-curve"), "{toml}");
}
