//! Checks that `lamp calibrate` recovers the material behind made-up measurements.

use lamp_fixtures::{Sample, SplitMix};
use lamp_tests::{Scratch, workspace_root};
use serde_json::Value;

/// Returns the output of a command.
fn said(scratch: &Scratch, line: &str) -> String {
    String::from_utf8(scratch.run(line).succeeds().stdout).unwrap()
}

fn text(scratch: &Scratch, name: &str) -> String {
    String::from_utf8(scratch.bytes(name)).unwrap()
}

/// Returns the value, lower and upper end in the `nth` printed line of a name.
fn estimate(said: &str, name: &str, nth: usize) -> [f64; 3] {
    let line = said.lines().filter(|line| line.starts_with(name)).nth(nth);
    let line = line.unwrap_or_else(|| panic!("no {name} in:\n{said}"));
    let numbers: Vec<f64> =
        line[name.len()..].split_whitespace().map(|number| number.parse().unwrap()).collect();
    numbers.try_into().unwrap()
}

/// Runs a calibration that printed `table` again, and checks that its answer has the table's numbers: each
/// line of a number with an interval, and no others.
#[track_caller]
fn answers(scratch: &Scratch, line: &str, table: &str) -> Value {
    assert_eq!(said(scratch, &format!("{line} --report answer.json")), table);
    let answer: Value = serde_json::from_slice(&scratch.bytes("answer.json")).unwrap();
    let printed: Value = serde_json::from_str(&said(scratch, &format!("{line} --json"))).unwrap();
    assert_eq!(printed, answer);
    std::fs::remove_file(scratch.path("answer.json")).unwrap();
    let counts = ["points", "without_measure", "blank"].map(|key| answer[key].as_u64().unwrap());
    let numbers: Vec<u64> =
        table.lines().next().unwrap().split(&[' ', '(']).filter_map(|it| it.parse().ok()).collect();
    assert_eq!(numbers, [counts[0], counts.iter().sum(), counts[1], counts[2]], "{table}");
    let groups = answer["groups"].as_array().unwrap().iter();
    let groups = groups.flat_map(|group| group["parameters"].as_array().unwrap());
    let all: Vec<&Value> = answer["parameters"].as_array().unwrap().iter().chain(groups).collect();
    let mut told: Vec<[f64; 3]> = all
        .iter()
        .filter(|parameter| !parameter["low"].is_null())
        .map(|it| ["value", "low", "high"].map(|key| it[key].as_f64().unwrap()))
        .collect();
    for line in table.lines().filter(|line| line.contains('(')) {
        let numbers: Vec<f64> =
            line.split_whitespace().rev().map_while(|word| word.parse().ok()).collect();
        let [high, low, value] = numbers[..] else { continue };
        let is_near = |of: &[f64; 3]| {
            of.iter().zip([value, low, high]).all(|(a, b)| (a - b).abs() <= 6e-3 * b.abs())
        };
        let found = told.iter().position(is_near).unwrap_or_else(|| panic!("{line}: {told:?}"));
        told.remove(found);
    }
    assert_eq!(told, [[0.0; 3]; 0], "{table}");
    answer
}

#[track_caller]
fn holds([value, low, high]: [f64; 3], truth: f64) {
    assert!(low <= truth && truth <= high, "{truth} is not within {low} to {high}");
    assert!(low <= value && value <= high && high - low < truth, "{value}: {low} to {high}");
}

/// Films of the LAMP suspension (002 section 3.3.5) after 60 to 1200 ms, measured to
/// 5 um.
fn films() -> String {
    let mut noise = SplitMix(35);
    let mut csv = "exposure_ms,depth_um\n".to_owned();
    for ms in [60, 200, 300, 400, 600, 800, 1000, 1200] {
        for _ in 0..3 {
            let depth = 211.0 * (1.6 * f64::from(ms) / 131.5).ln();
            let measured = if depth > 0.0 { depth + 5.0 * noise.normal() } else { 0.0 };
            csv += &format!("{ms},{measured:.1}\n");
        }
    }
    csv
}

#[test]
fn a_working_curve_comes_back_from_its_films() {
    let scratch = Scratch::new();
    scratch.write("films.csv", films().as_bytes());
    let line = "lamp calibrate depth films.csv --intensity 1.6W/cm2 -o mine.toml --plot films.svg";
    let table = said(&scratch, line);
    assert!(table.starts_with("21 points of 24 rows (3 uncured, 0 blank left out)\n"), "{table}");
    holds(estimate(&table, "Ec (mJ/cm2)", 0), 131.5);
    holds(estimate(&table, "Dp (um)", 0), 211.0);
    let answer = answers(&scratch, line, &table);
    assert_eq!(
        (&answer["model"], &answer["parameters"][1]["unit"]),
        (&"jacobs".into(), &"um".into())
    );
    // The file states the same values and their origin.
    let file = text(&scratch, "mine.toml");
    for words in [
        "name = \"mine\"",
        "value = \"1600 mW/cm2\"",
        "source = \"given with films.csv\"",
        "[working-curve.critical-dose]",
        "plus-minus = \"",
        "source = \"calibrated from films.csv, 21 points\"",
        "[working-curve.measured.doses]\nfrom = \"320 mJ/cm2\"\nto = \"1920 mJ/cm2\"",
    ] {
        assert!(file.contains(words), "no {words} in:\n{file}");
    }
    let checked = said(&scratch, "lamp material check mine.toml");
    assert!(checked.contains("mine gives working-curve; at 1600 mW/cm2"), "{checked}");
    // Plots and files are the same each time, and no other file remains.
    let svg = scratch.bytes("films.svg");
    scratch.run(line).succeeds();
    assert_eq!((scratch.bytes("films.svg"), text(&scratch, "mine.toml")), (svg, file));
    assert_eq!(scratch.names(), ["films.csv", "films.svg", "mine.toml"]);
    let svg = text(&scratch, "films.svg");
    for words in ["Cure depth: films.csv", "cure depth (µm)", "dose of full white (mJ/cm²)", "Ec "]
    {
        assert!(svg.contains(words), "no {words}");
    }
    assert_eq!(svg.matches("<circle").count(), 21);
}

#[test]
fn the_light_may_be_the_materials() {
    let scratch = Scratch::new();
    scratch.write("films.csv", films().as_bytes());
    let by_option = said(&scratch, "lamp calibrate depth films.csv --intensity 1.6W/cm2");
    let by_material = said(&scratch, "lamp calibrate depth films.csv --material lamp-suspension");
    assert_eq!(by_option, by_material);
    let piped = scratch.run_on(
        "lamp calibrate depth - --intensity 1600mW/cm2 -o a.toml --name of-a-pipe",
        films().as_bytes(),
    );
    assert_eq!(String::from_utf8(piped.succeeds_quietly().stdout).unwrap(), by_option);
    assert!(text(&scratch, "a.toml").contains("calibrated from standard input, 21 points"));
    scratch
        .run("lamp calibrate depth films.csv")
        .is_refused_with(&["calibrate: films.csv: ", "--intensity, as 1.6W/cm2"]);
}

#[test]
fn the_gray_model_comes_back_from_its_films() {
    let scratch = Scratch::new();
    let mut noise = SplitMix(40);
    let mut csv = "gray,dose_mj_per_cm2,depth_um\n".to_owned();
    for gray in [0.2, 0.4, 0.5, 0.8, 1.0] {
        for times in [3.0, 5.0, 8.0, 13.0, 20.0] {
            // 002 equations 39 and 40.
            let white: f64 = 131.5 * times / gray;
            let depth = (193.1 + 22.1 * gray) * (gray * white / (101.8 + 35.6 * gray)).ln();
            csv += &format!("{gray},{white:.3},{:.2}\n", depth + 2.0 * noise.normal());
        }
    }
    scratch.write("gray.csv", csv.as_bytes());
    let line = "lamp calibrate depth gray.csv --intensity 1.6W/cm2 -o mine.toml --plot gray.png";
    let table = said(&scratch, line);
    holds(estimate(&table, "Ec(G) at zero (mJ/cm2)", 0), 101.8);
    holds(estimate(&table, "Ec(G) rise (mJ/cm2)", 0), 35.6);
    holds(estimate(&table, "Dp(G) at zero (um)", 0), 193.1);
    holds(estimate(&table, "Dp(G) rise (um)", 0), 22.1);
    let answer = answers(&scratch, line, &table);
    let [first, last] = [&answer["groups"][0], &answer["groups"][4]];
    assert_eq!((&first["of"], &last["at"]), (&"gray".into(), &1.0.into()));
    assert!(said(&scratch, "lamp material check mine.toml").contains("mine gives gray;"));
    assert!(text(&scratch, "mine.toml").contains("25 points; at-zero +- "));
    assert!(scratch.bytes("gray.png").starts_with(b"\x89PNG"));
    let ran = scratch.run("lamp calibrate depth gray.csv --model jacobs");
    assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
    assert!(ran.stderr.contains("--model gray"), "{ran:?}");
}

#[test]
fn the_two_depth_model_comes_back_from_its_films() {
    let scratch = Scratch::new();
    let mut noise = SplitMix(3);
    let mut csv = "dose_mj_per_cm2,depth_um\n".to_owned();
    for mj in [5.0, 6.0, 8.0, 10.0, 14.0, 20.0, 30.0, 45.0, 70.0, 100.0_f64] {
        // 000 equation 3.8.
        let depth = 150.0 * (80.0 / 150.0 * (mj / 4.0 - 1.0) + 1.0).ln();
        csv += &format!("{mj},{:.2}\n", depth + 2.0 * noise.normal());
    }
    scratch.write("films.csv", csv.as_bytes());
    let line = "lamp calibrate depth films.csv --model two-depth --material sl-5510 -o mine.toml";
    let table = said(&scratch, line);
    holds(estimate(&table, "Ec (mJ/cm2)", 0), 4.0);
    holds(estimate(&table, "DpL (um)", 0), 80.0);
    holds(estimate(&table, "DpS (um)", 0), 150.0);
    answers(&scratch, line, &table);
    // The material keeps its other entries.
    let file = text(&scratch, "mine.toml");
    assert!(file.contains("name = \"sl-5510\"") && file.contains("[working-curve.critical-dose]"));
    assert!(file.contains("calibrated from films.csv, 10 points"));
    // Points on a straight line give no penetration depth of the solid.
    let straight = (1..9).map(|i| format!("{},{}\n", 10 * i, 30 * i - 20)).collect::<String>();
    scratch.write("straight.csv", format!("dose_mj_per_cm2,depth_um\n{straight}").as_bytes());
    let ran = scratch.run("lamp calibrate depth straight.csv --model two-depth").succeeds();
    assert!(
        ran.stderr.contains("lie on a straight line") && ran.stderr.contains("2200000 um"),
        "{ran:?}"
    );
}

/// Measurements, to 2 um, of squares of these sizes in pixels that grow by a line with the given
/// `E_c^w` and `D_p^w`.
fn squares(sizes: &[(f64, f64, f64)]) -> String {
    let mut noise = SplitMix(60);
    let mut csv = "feature_px,dose_mj_per_cm2,cured_um\n".to_owned();
    for &(pixels, critical, slope) in sizes {
        for dose in (60..=600).step_by(60).map(f64::from) {
            let width = (slope * (dose - critical)).max(0.0);
            let side = pixels * 25_400.0 / 1500.0 + 2.0 * width + 2.0 * noise.normal();
            csv += &format!("{pixels},{dose},{side:.2}\n");
        }
    }
    csv
}

#[test]
fn cure_widths_come_back_from_their_squares() {
    let scratch = Scratch::new();
    let sizes = [(25.0, 150.0, 0.08), (100.0, 120.0, 0.11), (450.0, 90.0, 0.16)];
    scratch.write("squares.csv", squares(&sizes).as_bytes());
    let line = "lamp calibrate width squares.csv --material lamp-no-absorber --name mine \
                -o mine.toml --plot squares.svg";
    let table = said(&scratch, line);
    let answer = answers(&scratch, line, &table);
    assert_eq!((&answer["r2"], &answer["groups"][0]["of"]), (&Value::Null, &"feature_um".into()));
    for (nth, (pixels, critical, slope)) in sizes.into_iter().enumerate() {
        assert!(table.contains(&format!("\n{pixels} px (")), "{table}");
        let found = estimate(&table, "Ec^w (mJ/cm2)", nth);
        holds(found, critical);
        holds(estimate(&table, "Dp^w (um/(mJ/cm2))", nth), slope);
        // 002 equation 61, with the curve of figure 78.
        let depths = found.map(|mj| 638.51 * (mj / 39.4).ln());
        for (found, depth) in estimate(&table, "Bd (um)", nth).into_iter().zip(depths) {
            assert!((found - depth).abs() < 0.05, "{found} for {depth}");
        }
    }
    let file = text(&scratch, "mine.toml");
    assert_eq!(file.matches("[[cure-width]]").count(), 3);
    assert!(file.contains("feature-size = \"423.333 um\""), "{file}");
    assert!(file.contains("638.51 um") && file.contains("calibrated from squares.csv, "));
    said(&scratch, "lamp material check mine.toml");
    // A second series replaces the sizes that it contains.
    scratch.write("more.csv", squares(&[(100.0, 110.0, 0.12), (900.0, 90.0, 0.16)]).as_bytes());
    said(&scratch, "lamp calibrate width more.csv --material mine.toml -o mine.toml");
    let file = text(&scratch, "mine.toml");
    assert_eq!(file.matches("[[cure-width]]").count(), 4);
    assert_eq!(file.matches("calibrated from more.csv").count(), 6);
    assert_eq!(file.matches("calibrated from squares.csv").count(), 6);
}

#[test]
fn the_line_of_an_ageing_lamp_comes_back_from_its_films() {
    let scratch = Scratch::new();
    let mut noise = SplitMix(36);
    let mut csv = "lamp_mw_per_cm2,exposure_ms,depth_um\n".to_owned();
    for mw in [512.0, 896.0, 1600.0] {
        for mj in [100.0, 320.0, 480.0, 640.0, 960.0, 1280.0, 1920.0_f64] {
            // 002 equation 36.
            let depth = 211.0 * (mj / (109.0 + 18.31 * mw / 1000.0)).ln();
            let measured = if depth > 0.0 { depth + noise.normal() } else { 0.0 };
            csv += &format!("{mw},{:.4},{measured:.2}\n", 1000.0 * mj / mw);
        }
    }
    scratch.write("filters.csv", csv.as_bytes());
    let line = "lamp calibrate lamp filters.csv -o mine.toml --plot lamp.svg";
    let table = said(&scratch, line);
    assert!(table.starts_with("18 points of 21 rows (3 uncured, 0 blank left out)\n"), "{table}");
    let answer = answers(&scratch, line, &table);
    for group in answer["groups"].as_array().unwrap() {
        let critical = group["parameters"][0]["value"].as_f64().unwrap();
        // The line of Ec(I), for each W/cm2.
        let [zero, rise] = [0, 1].map(|k| answer["parameters"][k]["value"].as_f64().unwrap());
        let line = zero + rise * group["at"].as_f64().unwrap() / 1000.0;
        assert!((critical - line).abs() < 1e-6, "{answer}");
    }
    holds(estimate(&table, "Ec(I) at zero (mJ/cm2)", 0), 109.0);
    let [_, low, high] = estimate(&table, "Ec(I) rise (mJ/cm2)", 0);
    assert!(low <= 18.31 && 18.31 <= high && low > 0.0, "{low} to {high}");
    holds(estimate(&table, "Dp (um)", 0), 211.0);
    let file = text(&scratch, "mine.toml");
    for words in ["[dimmed-lamp.lights]\nfrom = \"512 mW/cm2\"", "[working-curve.critical-dose]"] {
        assert!(file.contains(words), "no {words} in:\n{file}");
    }
    assert!(text(&scratch, "lamp.svg").contains("896 mW/cm"));
    // A material that has a working curve keeps it.
    said(&scratch, "lamp calibrate lamp filters.csv --material lamp-suspension -o kept.toml");
    let kept = text(&scratch, "kept.toml");
    assert!(kept.contains("value = \"131.5 mJ/cm2\"") && kept.contains("from filters.csv, 18"));
    let one: String = csv.lines().take(8).map(|line| format!("{line}\n")).collect();
    scratch.write("one.csv", one.as_bytes());
    scratch.run("lamp calibrate lamp one.csv").is_refused_with(&["1 light is too few"]);
}

/// Squares that did not grow show where growth begins, and commands know where it was measured.
#[test]
fn doses_outside_the_measured_ones_are_told() {
    let scratch = Scratch::new();
    scratch.write("squares.csv", squares(&[(450.0, 240.0, 0.16)]).as_bytes());
    let table = said(&scratch, "lamp calibrate width squares.csv --quiet -o mine.toml");
    assert!(
        table.starts_with("10 points of 10 rows (0 washed away, 0 blank left out)\n"),
        "{table}"
    );
    holds(estimate(&table, "Ec^w (mJ/cm2)", 0), 240.0);
    scratch.run("lamp sample cube -o cube.stl").succeeds();
    scratch.run("slice cube.stl --dpi 150 --thickness 5mm -o in.tif").succeeds();
    for (dose, told) in [(300, false), (900, true)] {
        let line =
            format!("lamp compensate in.tif --material mine.toml --dose {dose}mJ/cm2 -o out.tif");
        let said = scratch.run(&line).succeeds().stderr;
        let words = "layers get 900 mJ/cm2, but mine was measured at 60 to 600 mJ/cm2";
        assert_eq!(said.contains(words), told, "{said}");
    }
}

#[test]
fn without_a_cure_depth_there_is_no_broadening_depth() {
    let scratch = Scratch::new();
    scratch.write("squares.csv", squares(&[(450.0, 90.0, 0.16)]).as_bytes());
    let ran = scratch.run("lamp calibrate width squares.csv").succeeds();
    assert!(ran.stderr.contains("no broadening depth") && ran.stderr.contains("--depth-material"));
    assert!(!String::from_utf8(ran.stdout.clone()).unwrap().contains("Bd"));
    let line = "lamp calibrate width squares.csv --depth-material lamp-no-absorber -o mine.toml";
    assert!(said(&scratch, line).contains("Bd (um)"));
    // The depth's material is referenced, not copied.
    assert!(!text(&scratch, "mine.toml").contains("working-curve"));
    // At another resolution a pixel is another length.
    let widths = (1..5).map(|i| format!("450,{},{}\n", 100 * i, 10 * i - 5)).collect::<String>();
    let head = "feature_px,dose_mj_per_cm2,width_um\n";
    scratch.write("widths.csv", format!("{head}{widths}").as_bytes());
    let fine = said(&scratch, "lamp calibrate width widths.csv --dpi 2400 --quiet");
    assert!(fine.contains("450 px (4762.5 um): 4 points"), "{fine}");
    assert!(fine.contains("Ec^w (mJ/cm2)                   50.000"), "{fine}");
    // A line that would begin at a negative dose.
    let early = widths.replace(",5\n", ",105\n").replace(",15\n", ",115\n");
    let early = early.replace(",25\n", ",125\n").replace(",35\n", ",135\n");
    scratch.write("early.csv", format!("{head}{early}").as_bytes());
    let refused = &["early.csv: squares of 7.62mm: the line begins at a dose of -950.0 mJ/cm2"];
    scratch.run("lamp calibrate width early.csv --quiet").is_refused_with(refused);
}

#[test]
fn bad_measurements_get_a_sentence_and_leave_no_file() {
    let scratch = Scratch::new();
    let line = "lamp calibrate depth a.csv -o mine.toml --plot a.svg";
    for (csv, words) in [
        ("", &["the file is empty"][..]),
        ("dose_mj_per_cm2;depth_um\n1;2\n", &["line 1", "commas"]),
        ("dose_mj_per_cm2,depth_um\n100,2\nx,3\n", &["line 3, column dose_mj_per_cm2", "`x`"]),
        ("dose_mj_per_cm2,depth_um\n100,2,3\n", &["line 2", "3 columns"]),
        ("dose,depth_um\n100,2\n", &["column `dose` is not known", "dose_mj_per_cm2"]),
        ("dose_mj_per_cm2,depth_um\n100,2\n200,150\n", &["2 points are too few"]),
        ("dose_mj_per_cm2,depth_um\n100,2\n100,3\n100,4\n", &["1 dose is too few", "2 different"]),
        ("dose_mj_per_cm2,depth_um\n100,90\n200,50\n400,11\n", &["more dose cures less"]),
        ("dose_mj_per_cm2,depth_um\n100,50\n200,90\n400,51\n", &["scatter too much"]),
        ("dose_mj_per_cm2,depth_um\n100,9\n200,9\n400,9\n", &["all points measure 9.000 um"]),
        ("dose_mj_per_cm2,depth_um\n100,0\n200,0\n", &["no row cured or grew"]),
        ("dose_mj_per_cm2,gray,depth_um\n100,2,5\n", &["column gray", "2 is not a gray level"]),
    ] {
        scratch.write("a.csv", csv.as_bytes());
        let ran = scratch.run(line).is_refused_with(words);
        assert!(
            ran.stderr.starts_with("error: calibrate: a.csv: ") && ran.stdout.is_empty(),
            "{ran:?}"
        );
    }
    let beyond = b"dose_mj_per_cm2,depth_um\n320,190\n1e308,900\n640,300\n1000,400\n";
    scratch.write("a.csv", beyond);
    let words = ["line 3, column dose_mj_per_cm2: 1e308 is not a dose from 1e-6 to 1e9"];
    scratch.run(line).is_refused_with(&words);
    scratch.write("a.csv", b"\xff");
    scratch.run(line).is_refused_with(&["a.csv", "byte 0", "UTF-8"]);
    scratch.run("lamp calibrate depth none.csv").is_refused_with(&["none.csv"]);
    scratch.write("a.csv", films().as_bytes());
    let line = "lamp calibrate depth a.csv --material none.toml";
    scratch.run(line).is_refused_with(&["none.toml", "no such file", "lamp-suspension"]);
    assert_eq!(scratch.names(), ["a.csv"]);
}

#[test]
fn a_plot_that_cannot_be_written_leaves_no_material() {
    let scratch = Scratch::new();
    scratch.write("a.csv", films().as_bytes());
    std::fs::create_dir(scratch.path("folder.svg")).unwrap();
    let line = "lamp calibrate depth a.csv --intensity 1.6W/cm2 -o mine.toml --plot folder.svg";
    scratch.run(line).is_refused_with(&["folder.svg"]);
    assert_eq!(scratch.names(), ["a.csv", "folder.svg"]);
}

#[test]
fn wrong_usage_is_status_2() {
    let scratch = Scratch::new();
    scratch.write("a.csv", films().as_bytes());
    for (line, words) in [
        ("lamp calibrate", "Usage"),
        ("lamp calibrate depth a.csv --plot a.pdf", "an SVG, a PNG or a table"),
        ("lamp calibrate depth a.csv -o -", "name a file with -o"),
        ("lamp calibrate depth a.csv -o a.csv", "written as TOML"),
        ("lamp calibrate depth a.csv -o a.svg --plot a.svg", "written as TOML"),
        ("lamp calibrate depth a.csv --intensity 0W/cm2", "above zero"),
        ("lamp calibrate depth a.csv --intensity 1e99W/cm2", "1e-6 and 1e9 mW/cm2"),
        ("lamp calibrate depth a.csv --intensity 1.6W/cm2 -o My_Resin.toml", "--name"),
        ("lamp calibrate depth a.csv --name mine", "--output"),
    ] {
        let ran = scratch.run(line);
        assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
        assert!(ran.stderr.contains(words), "no `{words}` in {ran:?}");
    }
    assert_eq!(scratch.names(), ["a.csv"]);
}

#[test]
fn the_example_of_the_documentation_is_what_it_says() {
    let docs = std::fs::read_to_string(workspace_root().join("docs/calibration.md")).unwrap();
    let block = |kind: &str| -> &str {
        let start = docs.split_once(&format!("```{kind}\n")).unwrap().1;
        start.split_once("```").unwrap().0
    };
    let scratch = Scratch::new();
    scratch.write("depths.csv", block("csv").as_bytes());
    let (line, printed) = block("text").split_once('\n').unwrap();
    assert_eq!(said(&scratch, line.strip_prefix("$ ").unwrap()), printed);
}

/// Films and squares of suspensions with the absorber of 002 table 8, by made-up laws: `1/D` and `E_c`
/// at zero, and their rise for each g of absorber for 100 g of monomer.
fn absorber() -> String {
    let mut noise = SplitMix(84);
    let mut csv = "uv_absorber_g_per_100g,photoinitiator_g_per_100g,dose_mj_per_cm2,depth_um,\
                   feature_px,cured_um\n"
        .to_owned();
    for grams in [0.0, 0.0625, 0.125, 0.1875, 0.25_f64] {
        let line = |zero: f64, rise: f64| zero + rise * grams;
        let (penetration, critical) = (1.0 / line(0.0016, 0.016), line(40.0, 240.0));
        for mj in [30.0, 150.0, 250.0, 400.0, 600.0, 900.0, 1400.0_f64] {
            let depth = penetration * (mj / critical).ln();
            let depth = if depth > 0.0 { depth + 4.0 * noise.normal() } else { 0.0 };
            csv += &format!("{grams},6,{mj},{depth:.2},,\n");
        }
        let (slope, broad) = (1.0 / line(5.0, 30.0), line(80.0, 600.0));
        for mj in (1..=10).map(|k| 60.0 * f64::from(k)) {
            // 500 pixels of 1500 dpi, as in 002 section 3.4.5 and beyond.
            let side = 8466.667 + 2.0 * (slope * (mj - broad).max(0.0) + 1.5 * noise.normal());
            csv += &format!("{grams},6,{mj},,500,{side:.3}\n");
        }
    }
    csv
}

#[test]
fn laws_over_an_ingredient_make_materials_between() {
    let scratch = Scratch::new();
    scratch.write("absorber.csv", absorber().as_bytes());
    let line = "lamp calibrate composition absorber.csv -o laws.toml --plot absorber.svg";
    let table = said(&scratch, line);
    assert!(table.starts_with("80 points of 85 rows (5 uncured"), "{table}");
    answers(&scratch, line, &table);
    for (name, truth) in [
        ("1/Dp(c) at zero (1/um)", 0.0016),
        ("1/Dp(c) rise (1/um)", 0.016),
        ("Ec(c) at zero (mJ/cm2)", 40.0),
        ("Ec(c) rise (mJ/cm2)", 240.0),
        ("1/Dp^w(c) at zero ((mJ/cm2)/um)", 5.0),
        ("1/Dp^w(c) rise ((mJ/cm2)/um)", 30.0),
        ("Ec^w(c) at zero (mJ/cm2)", 80.0),
        ("Ec^w(c) rise (mJ/cm2)", 600.0),
    ] {
        holds(estimate(&table, name, 0), truth);
    }
    // 002 eq. 61 at 0.125 g: D_p^d is 1/0.0036 um, E_c^d 70 and E_c^w 155 mJ/cm2.
    holds(estimate(&table, "Bd (um)", 2), (155.0_f64 / 70.0).ln() / 0.0036);
    assert!(text(&scratch, "absorber.svg").contains("Cure width: absorber.csv"));
    let checked = said(&scratch, "lamp material check laws.toml");
    assert!(
        checked.contains("law over uv-absorber (0 to 0.25 g per 100 g of monomer)"),
        "{checked}"
    );
    let made = "lamp material make laws.toml --uv-absorber 0.1 --name tenth -o tenth.toml";
    let made = scratch.run(made).succeeds();
    assert!(
        made.stderr.contains("holds with 6 g per 100 g of monomer of photoinitiator"),
        "{made:?}"
    );
    let file = text(&scratch, "tenth.toml");
    let given = |after: &str| -> [f64; 2] {
        let (_, rest) = file.split_once(after).unwrap_or_else(|| panic!("no {after} in {file}"));
        ["value = \"", "plus-minus = \""].map(|key| {
            let (_, number) = rest.split_once(key).unwrap();
            number.split(' ').next().unwrap().parse().unwrap()
        })
    };
    for (table, truth) in [
        ("[working-curve.critical-dose]", 64.0),
        ("[working-curve.penetration-depth]", 1.0 / 0.0032),
        ("[cure-width.critical-dose]", 140.0),
        ("[cure-width.sensitivity]", 1.0 / 8.0),
    ] {
        let [value, half] = given(table);
        assert!((value - truth).abs() <= half && half < 0.2 * truth, "{table}: {value} {half}");
    }
    let many = scratch.run("lamp material make laws.toml -o many.toml");
    many.is_wrong_usage(&["laws.toml has [[law]] tables: give the amount with --uv-absorber"]);
    let piped = scratch.run_on("lamp material make -", &scratch.bytes("laws.toml"));
    piped.is_wrong_usage(&["standard input has [[law]] tables"]);
    scratch.stack("part.tif", lamp_fixtures::cavity_staircase(1).layers());
    scratch.part("cube.stl", Sample::Cube, 64);
    for line in [
        "slice cube.stl --dpi 100 --material laws.toml -o x.tif",
        "lamp compensate part.tif --material laws.toml --dose 200mJ/cm2 -o x.tif",
        "lamp cure part.tif --material laws.toml --section x=0mm -o x.png",
    ] {
        scratch.run(line).is_refused_with(&["laws", "make a material of one amount with lamp"]);
    }
    let outside = scratch.run("lamp material make laws.toml --uv-absorber 0.3");
    outside.is_refused_with(&["laws.toml", "measured with 0 to 0.25 g", "not with 0.3"]);
    let none = scratch.run("lamp material make laws.toml --photoinitiator 5");
    none.is_refused_with(&["no [[law]] over photoinitiator"]);
    let best =
        "lamp material make laws.toml --objective bd --thickness 100um --overcure 3 -o best.toml";
    let best = scratch.run(best).succeeds();
    // B_d falls over the absorber (002 figure 89): without any it is ln(80/40)/0.0016, 433 um, and
    // 300 um take 40 exp(0.48) mJ/cm2.
    assert!(best.stderr.contains("0 g per 100 g of monomer of uv-absorber: 6"), "{best:?}");
    assert!(best.stderr.contains("cures 300.0 um, and edges grow by 0 um"), "{best:?}");
    scratch.run("lamp material make laws.toml --objective bd").is_wrong_usage(&["--thickness"]);
    // Both ingredients at once tell no law (002 section 3.4.8 d).
    let both = absorber().replacen("0,6,150", "0,5,150", 1);
    scratch.write("both.csv", both.as_bytes());
    scratch.run("lamp calibrate composition both.csv").is_refused_with(&["both uv_absorber"]);
}

/// Squares under the lights of 002 section 3.4.5.
#[test]
fn cure_widths_follow_the_lamp() {
    let scratch = Scratch::new();
    let mut noise = SplitMix(80);
    let mut csv = "lamp_mw_per_cm2,exposure_ms,feature_px,width_um\n".to_owned();
    for mw in [480.0, 800.0, 1600.0_f64] {
        let (slope, broad) = (1.0 / (3.0 + 0.002 * mw), 60.0 + 0.03 * mw);
        for mj in (1..=10).map(|k| 50.0 * f64::from(k)) {
            let width = slope * (mj - broad).max(0.0) + 0.5 * noise.normal();
            csv += &format!("{mw},{:.4},500,{width:.3}\n", 1000.0 * mj / mw);
        }
    }
    scratch.write("filters.csv", csv.as_bytes());
    let line = "lamp calibrate lamp filters.csv --material lamp-suspension -o mine.toml";
    let table = said(&scratch, line);
    answers(&scratch, line, &table);
    holds(estimate(&table, "1/Dp^w(I) at zero ((mJ/cm2)/um)", 0), 3.0);
    holds(estimate(&table, "Ec^w(I) at zero (mJ/cm2)", 0), 60.0);
    scratch.stack("part.tif", lamp_fixtures::cavity_staircase(1).layers());
    let compensate = "lamp compensate part.tif --min-feature 0um --dose 200mJ/cm2";
    let known = format!("{compensate} --material mine.toml --lamp-intensity 50% -o known.tif");
    let known = scratch.run(&known).succeeds();
    assert!(!known.stderr.contains("cure width"), "{known:?}");
    let weak = format!("{compensate} --material mine.toml --lamp-intensity 20% -o weak.tif");
    let weak = scratch.run(&weak).succeeds();
    assert!(weak.stderr.contains("measured under 480 to 1600 mW/cm2"), "{weak:?}");
    // Without the law, widths stay, and a line says so.
    scratch.write("squares.csv", squares(&[(450.0, 100.0, 0.16)]).as_bytes());
    let add = "lamp calibrate width squares.csv --material lamp-suspension -o stays.toml";
    said(&scratch, add);
    let stays = format!("{compensate} --material stays.toml --lamp-intensity 50% -o stays.tif");
    let stays = scratch.run(&stays).succeeds();
    assert!(stays.stderr.contains("cure widths stay, though real ones move"), "{stays:?}");
}

/// Squares along and across the scan, and of twenty layers (002 section 3.4.8 a and b).
#[test]
fn widths_have_directions_and_layers() {
    let scratch = Scratch::new();
    let mut noise = SplitMix(348);
    let doses = || (1..=10).map(|k| 50.0 * f64::from(k));
    let mut csv = "direction,feature_px,dose_mj_per_cm2,width_um\n".to_owned();
    for (direction, slope) in [("across", 0.1), ("along", 0.2)] {
        for mj in doses() {
            let width = slope * (mj - 100.0_f64).max(0.0) + 0.5 * noise.normal();
            csv += &format!("{direction},500,{mj},{width:.3}\n");
        }
    }
    scratch.write("two.csv", csv.as_bytes());
    let line = "lamp calibrate width two.csv --material lamp-suspension -o two.toml";
    let table = said(&scratch, line);
    answers(&scratch, line, &table);
    assert!(table.contains("500 px (8466.67 um), along the scan: 10 points"), "{table}");
    holds(estimate(&table, "Dp^w (um/(mJ/cm2))", 0), 0.1);
    holds(estimate(&table, "Dp^w (um/(mJ/cm2))", 1), 0.2);
    assert!(text(&scratch, "two.toml").contains("direction = \"across\""));
    let mut csv = "layers,feature_px,dose_mj_per_cm2,width_um\n".to_owned();
    // Doses of layers of 100 um, whose white fades over 215.2 um, layer by layer.
    let above: f64 = (1..20).map(|layer| (-100.0 * f64::from(layer) / 215.2).exp()).sum();
    for (layers, above) in [(1, 0.0), (20, above)] {
        for mj in doses() {
            let width = 0.1 * (mj * (1.0 + 0.2 * above) - 100.0_f64).max(0.0);
            csv += &format!("{layers},500,{mj},{:.3}\n", width + 0.5 * noise.normal());
        }
    }
    scratch.write("blocks.csv", csv.as_bytes());
    let line = "lamp calibrate width blocks.csv --material lamp-suspension -o blocks.toml";
    scratch.run(line).is_wrong_usage(&["give --thickness"]);
    let line = &format!("{line} --thickness 100um");
    let table = said(&scratch, line);
    answers(&scratch, line, &table);
    holds(estimate(&table, "share of doses above (1)", 0), 0.2);
    assert!(text(&scratch, "blocks.toml").contains("[many-layers]\nvalue = 0."));
    // Without squares of one layer there is no line.
    let of_many = csv.lines().filter(|line| !line.starts_with("1,"));
    let of_many: String = of_many.flat_map(|line| [line, "\n"]).collect();
    scratch.write("many.csv", of_many.as_bytes());
    let line = "lamp calibrate width many.csv --material lamp-suspension --thickness 100um";
    scratch.run(line).is_refused_with(&["many.csv", "print squares of one layer too"]);
    // A check names both, and compensate says what counts.
    let checked = said(&scratch, "lamp material check two.toml");
    assert!(checked.contains("(1 size, 8.466667mm, across and along the scan)"), "{checked}");
    assert!(said(&scratch, "lamp material check blocks.toml").contains(", many-layers 0."));
    scratch.stack("part.tif", lamp_fixtures::cavity_staircase(1).layers());
    for (material, counts) in [("blocks", true), ("two", false)] {
        let line = format!(
            "lamp compensate part.tif --dose 200mJ/cm2 --min-feature 0um --material {material}.toml -o x.tif"
        );
        let ran = scratch.run(&line).succeeds();
        let share = "of the doses of layers above counts";
        assert_eq!(ran.stderr.contains(share), counts, "{ran:?}");
    }
}
