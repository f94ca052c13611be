//! Checks the output and the errors of `lamp material`.

use std::fs;

use lamp_tests::{Scratch, workspace_root};

const NAMES: [&str; 7] = [
    "lamp-no-absorber",
    "lamp-suspension",
    "pegda-mw700",
    "pegda-sudan",
    "sl-5510",
    "tmpta",
    "zsg-amber",
];

fn said(scratch: &Scratch, line: &str) -> String {
    String::from_utf8(scratch.run(line).succeeds_quietly().stdout).unwrap()
}

#[test]
fn list_has_a_line_for_each_material() {
    let text = said(&Scratch::new(), "lamp material list");
    let rows: Vec<Vec<&str>> =
        text.lines().skip(1).map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(rows.iter().map(|row| row[0]).collect::<Vec<_>>(), NAMES);
    assert_eq!(rows[1][1..6], ["1600", "mW/cm2", "working-curve,", "gray,", "dimmed-lamp"]);
    // No light and no model is printed if the source has none.
    assert_eq!(rows[4][1..4], ["-", "working-curve,", "two-depth"]);
    assert_eq!(rows[5][1..4], ["14", "mW/cm2", "kinetics"]);
    assert_eq!(rows[6][1..3], ["3185.57", "mW/cm2"]);
    assert_eq!(rows[6][3..8], ["working-curve,", "spread", "145.6um,", "gamma", "2.404"]);
}

#[test]
fn show_prints_the_file() {
    for name in NAMES {
        let file = workspace_root().join(format!("grayscale/materials/{name}.toml"));
        let text = said(&Scratch::new(), &format!("lamp material show {name}"));
        assert_eq!(text, fs::read_to_string(file).unwrap());
    }
}

#[test]
fn show_prints_a_checked_file_as_it_was_written() {
    let scratch = Scratch::new();
    let good = said(&scratch, "lamp material show lamp-suspension") + "# mine\n";
    scratch.write("mine.toml", good.as_bytes());
    assert_eq!(said(&scratch, "lamp material show mine.toml"), good);
    assert_eq!(said(&scratch, "lamp material show mine.toml | lamp material show -"), good);
    scratch.write("mine.toml", good.replace("211 um", "0 um").as_bytes());
    let ran = scratch.run("lamp material show mine.toml");
    let ran = ran.is_refused_with(&["mine.toml", "above zero"]);
    // The table is named once.
    assert_eq!(ran.stderr.matches("above zero").count(), 1, "{ran:?}");
}

#[test]
fn check_tells_of_cure_widths() {
    let scratch = Scratch::new();
    let size = |size: &str| {
        format!(
            "[[cure-width]]\nfeature-size = \"{size}\"\n\
             critical-dose = {{ value = \"80 mJ/cm2\", source = \"a\" }}\n\
             sensitivity = {{ value = \"0.2 um/(mJ/cm2)\", source = \"a\" }}\n"
        )
    };
    let head = "name = \"w\"\ndescription = \"a\"\n".to_owned();
    scratch.write("w.toml", (head.clone() + &size("423.333 um")).as_bytes());
    let one = said(&scratch, "lamp material check w.toml");
    assert!(one.contains("in order and gives cure-width (1 size, 423.333um), but w has"), "{one}");
    let head = said(&scratch, "lamp material show lamp-suspension");
    scratch.write("w.toml", (head + &size("7.62 mm") + &size("423.333 um")).as_bytes());
    let two = said(&scratch, "lamp material check w.toml");
    assert!(two.contains("dimmed-lamp, cure-width (2 sizes, 423.333um to 7.62mm); at"), "{two}");
}

#[test]
fn check_says_in_a_sentence_what_a_file_allows() {
    let scratch = Scratch::new();
    for (name, words) in [
        ("lamp-suspension", "1600 mW/cm2, full white cures 100um in 136.7 ms"),
        ("pegda-mw700", "depths of 180um or more"),
        ("sl-5510", "add [intensity]"),
        ("pegda-sudan", "working-curve, spread 50um; at 7.394 mW/cm2"),
        // A wide field is brighter than the pixel for which its intensity is stated.
        ("zsg-amber", "gamma 2.404; at 3185.57 mW/cm2, full white cures 100um in 62.9 ms"),
        ("tmpta", "in order and gives kinetics, but tmpta has no cure model: add [working-curve]"),
    ] {
        said(&scratch, &format!("lamp material show {name} > {name}.toml"));
        let text = said(&scratch, &format!("lamp material check {name}.toml"));
        assert!(text.starts_with(&format!("{name}.toml: ")), "{text}");
        assert!(text.contains(words), "{text}");
        assert_eq!(text.lines().count(), 1, "{text}");
    }
    let text = said(&scratch, "lamp material show sl-5510 | lamp material check -");
    assert!(text.starts_with("standard input: "), "{text}");
}

#[test]
fn the_example_of_the_documentation_is_a_material() {
    let text = fs::read_to_string(workspace_root().join("docs/materials.md")).unwrap();
    let (_, from) = text.split_once("```toml\n").unwrap();
    let (example, _) = from.split_once("```").unwrap();
    let checked = Scratch::new().run_on("lamp material check -", example.as_bytes()).succeeds();
    let said = String::from_utf8(checked.stdout).unwrap();
    let words = "mine gives working-curve, gray, cure-width (1 size, 423.3um), spread 34um, gamma 2.2; at 1600";
    assert!(said.contains(words), "{said}");
}

/// The second block of TOML in docs/materials.md.
fn composition() -> String {
    let text = fs::read_to_string(workspace_root().join("docs/materials.md")).unwrap();
    let block = text.split("```toml\n").nth(2).unwrap();
    block.split_once("```").unwrap().0.to_owned()
}

/// The same with the third block of TOML, and another share of the first peak.
fn with_peaks(share: &str) -> String {
    let text = fs::read_to_string(workspace_root().join("docs/materials.md")).unwrap();
    let peaks = text.split("```toml\n").nth(3).unwrap().split_once("```").unwrap().0;
    assert!(peaks.contains("value = 0.7,"));
    let is_kept =
        |line: &&str| !line.starts_with("wavelength") && !line.starts_with("absorptivity");
    let kept: Vec<_> = composition().lines().filter(is_kept).map(str::to_owned).collect();
    kept.join("\n") + "\n" + &peaks.replace("value = 0.7,", &format!("value = {share},"))
}

#[test]
fn a_composition_makes_a_material() {
    let scratch = Scratch::new();
    scratch.write("composition.toml", composition().as_bytes());
    let made = scratch.run("lamp material make composition.toml -o made.toml").succeeds();
    assert!(made.stderr.contains("calibrate before you build"), "{made:?}");
    let printed = scratch.run("lamp material make composition.toml --quiet").succeeds_quietly();
    assert_eq!(printed.stdout, scratch.bytes("made.toml"));
    let file = String::from_utf8(printed.stdout).unwrap();
    for words in ["name = \"six-percent\"", "[constants.volume-shrinkage]", "002 equation 58"] {
        assert!(file.contains(words), "no {words} in {file}");
    }
    let line = "lamp material profile made.toml --dose 400mJ/cm2 --beam 17um";
    assert!(said(&scratch, line).starts_with("cured "));
    // More absorber cures less deep, from a higher dose on (002 section 3.4.6).
    let numbers = |text: &str| -> [f64; 2] {
        let made = scratch.run_on("lamp material make - --quiet", text.as_bytes()).succeeds();
        let made = String::from_utf8(made.stdout).unwrap();
        let value = |table: &str| -> f64 {
            let (_, rest) =
                made.split_once(&format!("[working-curve.{table}]\nvalue = \"")).unwrap();
            rest.split(' ').next().unwrap().parse().unwrap()
        };
        [value("critical-dose"), value("penetration-depth")]
    };
    // By eq. 59 less of the light is lost on the way.
    let alone =
        composition().replace("[shrinkage]", "attenuated-by = \"photoinitiator\"\n[shrinkage]");
    let [all, alone] = [composition(), alone].map(|text| numbers(&text));
    assert!(alone[0] < 0.5 * all[0] && alone[1] == all[1], "{alone:?} {all:?}");
    let [one, two] = ["0.7", "0.3"].map(|share| numbers(&with_peaks(share)));
    assert!(two[1] > one[1], "{one:?} {two:?}");
    let [few, more] =
        ["2 mmol/l", "4 mmol/l"].map(|c| numbers(&composition().replace("2 mmol/l", c)));
    assert!(more[0] > few[0] && more[1] < few[1], "{few:?} {more:?}");
    scratch.write("bad.toml", composition().replace("0.55", "1.55").as_bytes());
    let words = ["bad.toml", "ceramic.share must be from 0 to below 1"];
    scratch.run("lamp material make bad.toml").is_refused_with(&words);
    let over = scratch.run("lamp material make composition.toml -o composition.toml");
    assert!(over.stderr.contains("that is an input"), "{over:?}");
}

#[test]
fn a_line_of_light_has_a_profile() {
    let scratch = Scratch::new();
    let line = "lamp material profile lamp-suspension --dose 600mJ/cm2";
    let text = said(&scratch, &format!("{line} --beam 17um"));
    assert!(text.starts_with("cured 29.620 um wide at the surface, 320.28 um deep"), "{text}");
    assert_eq!(text.lines().count(), 13);
    // Equation 46: fitted numbers.
    let wide = said(&scratch, &format!("{line} --beam 60um --critical-dose 90mJ/cm2"));
    assert!(wide.starts_with("cured 116.87 um wide"), "{wide}");
    // The spread of the material is the beam; an old lamp needs less dose.
    assert!(said(&scratch, "lamp material profile pegda-sudan --dose 20mJ/cm2").contains(" wide"));
    let old = said(&scratch, &format!("{line} --beam 17um --lamp-intensity 50%"));
    // 17 sqrt(2 ln(600/(109 + 18.31 0.8))).
    assert!(old.starts_with("cured 30.215 um wide"), "{old}");
    scratch.run(line).is_wrong_usage(&["no [spread]", "--beam"]);
    let ran = scratch.run("lamp material profile lamp-suspension --dose 100mJ/cm2 --beam 17um");
    let words = "lines get 100 mJ/cm2, but lamp-suspension was measured at 320 to 1920";
    assert!(ran.succeeds().stderr.contains(words));
}

#[test]
fn bad_files_are_refused_and_say_what_to_do() {
    let scratch = Scratch::new();
    let good = said(&scratch, "lamp material show lamp-suspension");
    let spoilt = |from: &str, to: &str| {
        assert!(good.contains(from));
        scratch.write("mine.toml", good.replacen(from, to, 1).as_bytes());
    };
    for (from, to, words) in [
        ("131.5 mJ/cm2", "131.5", &["working-curve.critical-dose.value", "`131.5`", "mJ/cm2"][..]),
        ("211 um", "0 um", &["working-curve.penetration-depth", "above zero"]),
        ("[intensity]", "[light]", &["unknown key `light`", "`intensity`"]),
        ("name = ", "name = =", &["line 1", "TOML", "lamp material show"]),
    ] {
        spoilt(from, to);
        let ran = scratch.run("lamp material check mine.toml").is_refused_with(words);
        assert!(ran.stderr.starts_with("error: material: mine.toml: "), "{ran:?}");
        assert!(ran.stdout.is_empty());
    }
    scratch.write("image.tif", b"II\x2b\0\x08\0\xff\xfe");
    scratch.run("lamp material check image.tif").is_refused_with(&["image.tif", "byte 6", "UTF-8"]);
    scratch.write("long.toml", &vec![b'#'; (1 << 20) + 1]);
    scratch.run("lamp material check long.toml").is_refused_with(&["1 MiB"]);
    scratch.run("lamp material check none.toml").is_refused_with(&["none.toml"]);
    scratch.run("lamp material check .").is_refused_with(&["."]);
}

#[test]
fn wrong_usage_is_status_2() {
    for line in ["lamp material", "lamp material show"] {
        let ran = Scratch::new().run(line);
        assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
    }
    Scratch::new().run("lamp material show teapot").is_refused_with(&NAMES);
}
