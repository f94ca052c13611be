//! Checks that tables of plots have the columns and axes that docs/command-line.md gives.

use std::collections::BTreeSet;
use std::fs;

use lamp_fixtures::{Sample, cavity_staircase};
use lamp_tests::{Scratch, workspace_root};

/// Commands whose measurements another test makes.
const ELSEWHERE: [&str; 4] = [
    "lamp calibrate gamma",
    "lamp calibrate kinetics",
    "lamp calibrate scan",
    "lamp calibrate spread",
];

/// Returns the columns that the book gives, and the axes of each command.
fn in_the_book() -> (String, BTreeSet<[String; 3]>) {
    let page = fs::read_to_string(workspace_root().join("docs/command-line.md")).unwrap();
    let (_, section) = page.split_once("## Plots as tables\n").unwrap();
    let (section, _) = section.split_once("\n## ").unwrap();
    let (mut columns, mut axes) = (Vec::new(), BTreeSet::new());
    for row in section.lines().filter(|line| line.starts_with("| `")) {
        match row.trim_matches(['|', ' ']).split(" | ").collect::<Vec<_>>()[..] {
            [names, _] => columns.extend(names.split('`').skip(1).step_by(2)),
            [command, x, y] => {
                axes.insert([command.trim_matches('`'), x, y].map(str::to_owned));
            }
            _ => panic!("{row}"),
        }
    }
    (columns.join(","), axes)
}

/// Returns the cells of a line whose texts may be in quotes.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut is_quoted) = (vec![String::new()], false);
    for letter in line.chars() {
        match letter {
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => cells.push(String::new()),
            letter => cells.last_mut().unwrap().push(letter),
        }
    }
    cells
}

/// Checks that a table has the columns and axes that the book gives for a command. Returns the axes.
#[track_caller]
pub(crate) fn is_as_in_the_book(
    scratch: &Scratch,
    command: &str,
    table: &str,
) -> BTreeSet<[String; 3]> {
    let text = String::from_utf8(scratch.bytes(table)).unwrap();
    let (columns, axes) = in_the_book();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some(&*columns));
    let mut found = BTreeSet::new();
    for line in lines {
        let cells = cells(line);
        let [_, x_axis, y_axis, _, kind, x, y, high] = &cells[..] else { panic!("{line}") };
        let number = |cell: &String| cell.parse::<f64>().is_ok_and(f64::is_finite);
        assert!(number(x) && number(y), "{line}");
        assert!(["point", "curve", "band"].contains(&&**kind), "{line}");
        assert_eq!(number(high), kind == "band", "{line}");
        found.insert([command.to_owned(), x_axis.clone(), y_axis.clone()]);
    }
    assert!(!found.is_empty() && found.is_subset(&axes), "{found:?} of {axes:?}");
    found
}

#[test]
fn every_plot_has_the_columns_and_axes_of_the_book() {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 2_000);
    scratch.stack("stairs.tif", cavity_staircase(1).layers());
    let films = [(100, 0.0), (320, 190.7), (640, 330.9), (1280, 476.4), (1920, 569.2)];
    let films: String = films.iter().map(|(dose, um)| format!("{dose},{um}\n")).collect();
    scratch.write("films.csv", format!("dose_mj_per_cm2,depth_um\n{films}").as_bytes());
    let squares: String = (1..=10)
        .map(|k| f64::from(60 * k))
        .map(|dose| format!("450,{dose},{}\n", (0.16 * (dose - 240.0)).max(0.0)))
        .collect();
    scratch
        .write("squares.csv", format!("feature_px,dose_mj_per_cm2,width_um\n{squares}").as_bytes());
    let mut filters = "lamp_mw_per_cm2,dose_mj_per_cm2,depth_um\n".to_owned();
    for lamp in [300.0, 900.0, 1600.0] {
        let critical: f64 = 109.0 + 0.01831 * lamp;
        for dose in [200.0, 400.0, 800.0, 1600.0] {
            filters += &format!("{lamp},{dose},{:.2}\n", 211.0 * (dose / critical).ln());
        }
    }
    scratch.write("filters.csv", filters.as_bytes());
    let mut absorber =
        "uv_absorber_g_per_100g,dose_mj_per_cm2,depth_um,feature_px,width_um\n".to_owned();
    for grams in [0.0, 0.1, 0.2_f64] {
        for dose in [200.0, 400.0, 800.0, 1600.0] {
            let depth = (dose / (100.0 + 100.0 * grams)).ln() / (0.003 + 0.01 * grams);
            let width = 0.1 * (dose - 300.0 - 300.0 * grams).max(0.0) + 0.001 * dose;
            absorber += &format!("{grams},{dose},{depth:.2},,\n{grams},{dose},,500,{width:.3}\n");
        }
    }
    scratch.write("absorber.csv", absorber.as_bytes());
    let job = "lamp plan speed stairs.tif --material pegda-sudan --search-gap 5% -o timed.tif";
    scratch.run(job).succeeds();
    scratch.run("lamp learn areas/ --start timed.tif --material pegda-sudan").succeeds();
    scratch.run("lamp learn heights/ --start timed.tif --material pegda-sudan").succeeds();
    let rows: String = (0..60).map(|layer| format!("{layer},20,{layer}\n")).collect();
    scratch.write("areas.csv", format!("layer,over_px,under_px\n{rows}").as_bytes());
    let heights = "x_mm,y_mm,z_mm,measured_mm,sd_um\n2.05,0.75,1.5,1.0,20\n3.05,0.75,3.0,2.5,20\n";
    scratch.write("heights.csv", heights.as_bytes());
    let mut found = BTreeSet::new();
    for (command, options) in [
        ("lamp calibrate depth", "films.csv"),
        ("lamp calibrate width", "squares.csv"),
        ("lamp calibrate lamp", "filters.csv"),
        ("lamp calibrate composition", "absorber.csv"),
        ("lamp heights", "tower.stl --min 1mm --max 2mm --step 0.5mm"),
        ("lamp plan speed", "stairs.tif --material pegda-sudan --search-gap 5% -o a.tif"),
        ("lamp plan voxels", "timed.tif --layers 22..42 --material pegda-sudan -o b.tif"),
        ("lamp learn", "areas/ --measured areas.csv --law single --gain 2e-6 -o c.csv"),
        ("lamp learn", "heights/ --measured heights.csv -o d.csv"),
    ] {
        scratch.run(&format!("{command} {options} --plot plot.csv")).succeeds();
        found.extend(is_as_in_the_book(&scratch, command, "plot.csv"));
    }
    let lens = "name = 'small'\ndescription = 'a'\n[[lens]]\ndiameter = '80 um'\nsag = '15 um'\n";
    scratch.write("small.toml", lens.as_bytes());
    for (command, options) in [
        ("lamp plan column-cure", "lens-array --projector zhao --material pegda-mw700 -o zhao/"),
        ("lamp plan ecpl", "small.toml --projector jariwala --material tmpta -o ecpl/"),
    ] {
        scratch.run(&format!("{command} {options}")).succeeds();
        let folder = options.rsplit(' ').next().unwrap();
        found.extend(is_as_in_the_book(&scratch, command, &format!("{folder}section.csv")));
    }
    let (_, mut axes) = in_the_book();
    axes.retain(|[command, ..]| !ELSEWHERE.contains(&&**command));
    assert_eq!(found, axes);
}
