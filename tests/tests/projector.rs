//! Checks what `lamp projector` says of projectors and refuses, and the light that `lamp calibrate
//! projector` finds in pictures.

use std::fs::File;
use std::io::BufReader;

use lamp_planning::target::GrayPicture;
use lamp_tests::Scratch;
use serde_json::Value;

const LENS: &str = r#"
[lens]
radius = { value = "34.25 mm", source = "000 section 3.1.1" }
thickness = { value = "4.4 mm", source = "000 section 3.1.1" }
index = { value = 1.460, source = "000 section 3.1.1" }
object = { value = "152 mm", source = "000 section 3.1.1" }
image = { value = "132 mm", source = "000 section 3.1.1" }
divergence = { value = 1, source = "000 section 3.5.1" }
"#;

fn printed(scratch: &Scratch, line: &str) -> String {
    String::from_utf8(scratch.run(line).succeeds_quietly().stdout).unwrap()
}

#[test]
fn the_built_in_projectors_are_listed_and_shown() {
    let scratch = Scratch::new();
    let list = printed(&scratch, "lamp projector list");
    assert!(list.contains("zhao") && list.contains("27.88um"), "{list}");
    let shown = printed(&scratch, "lamp projector show jariwala");
    scratch.write("mine.toml", shown.as_bytes());
    let checked = printed(&scratch, "lamp projector check mine.toml");
    assert!(checked.contains("6.37x4.78mm") && checked.contains("2.570 mW/cm2"), "{checked}");
    let json: Value =
        serde_json::from_str(&printed(&scratch, "lamp projector list --json")).unwrap();
    assert_eq!(json["schema"], "lamp-projector-1");
    assert_eq!(json["projectors"][1]["cone_um"], 12.0);
    assert_eq!(json["projectors"][0]["chamber_um"], 200.0);
}

#[test]
fn a_lens_out_of_focus_is_refused_with_how_far() {
    let scratch = Scratch::new();
    let zhao = printed(&scratch, "lamp projector show zhao");
    scratch.write("off.toml", (zhao.clone() + LENS).as_bytes());
    scratch.run("lamp projector check off.toml").is_refused_with(&[
        "off.toml: lens: it is out of focus by 15.22mm",
        "at 147.22mm, not at 132mm",
    ]);
    let right = LENS.replace("1.460", "1.4816").replace("132 mm", "134.63 mm");
    scratch.write("sharp.toml", (zhao + &right).as_bytes());
    let sharp = printed(&scratch, "lamp projector check sharp.toml");
    assert!(sharp.contains("134.63mm behind its middle, 0.00mm off"), "{sharp}");
    let unknown = scratch.run("lamp projector show nobody");
    unknown.is_refused_with(&["nobody: there is no such file, nor a projector of that name"]);
}

/// A camera's picture of a display of 96 x 64 mirrors, upright and mirrored: two pixels a mirror, light that
/// spreads by 0.9 mirrors, and half as much light at the left edge as at the right one.
fn camera(shown: &GrayPicture) -> GrayPicture {
    const SIGMA: f64 = 0.9;
    let (columns, rows) = (240, 160);
    let erf = |end: f64| libm::erf(end / (SIGMA * 2.0_f64.sqrt()));
    let tap = |away: f64| (erf(away + 0.5) - erf(away - 0.5)) / 2.0;
    let lit =
        |row: usize, column: usize| f64::from(shown.levels[row * shown.columns + column]) / 65535.0;
    // The light of each row of mirrors along the camera's columns, averaged over a pixel.
    let along = |count: usize, pixels: usize, mirrored: bool| -> Vec<Vec<f64>> {
        let of_pixel = |pixel: usize| {
            let side = if mirrored { -1.0 } else { 1.0 };
            let at = |part: f64| side * (pixel as f64 + part - pixels as f64 / 2.0) / 2.0;
            let parts = (0..8).map(|k| at((f64::from(k) + 0.5) / 8.0)).collect::<Vec<_>>();
            let mirror = |mirror: usize| {
                let middle = mirror as f64 + 0.5 - count as f64 / 2.0;
                parts.iter().map(|at| tap(at - middle)).sum::<f64>() / 8.0
            };
            (0..count).map(mirror).collect()
        };
        (0..pixels).map(of_pixel).collect()
    };
    let (across, down) = (along(96, columns, true), along(64, rows, false));
    let mut levels = Vec::new();
    for down in &down {
        let of_row = |column: usize| (0..64).map(|row| down[row] * lit(row, column)).sum::<f64>();
        let sums: Vec<f64> = (0..96).map(of_row).collect();
        for (x, taps) in across.iter().enumerate() {
            let light: f64 = taps.iter().zip(&sums).map(|(tap, sum)| tap * sum).sum();
            let place = -(x as f64 + 0.5 - columns as f64 / 2.0) / 2.0 / 48.0;
            levels.push((65535.0 * (0.02 + light * (0.45 + 0.15 * place))).round() as u16);
        }
    }
    GrayPicture { columns, rows, levels }
}

#[test]
fn a_picture_of_dots_gives_a_projector_its_light() {
    let scratch = Scratch::new();
    let small = printed(&scratch, "lamp projector show jariwala")
        .replace("columns = 1024", "columns = 96")
        .replace("rows = 768", "rows = 64");
    scratch.write("small.toml", small.as_bytes());
    scratch
        .run("lamp target dots --projector small.toml --dot 4 --period 16 -q -o dots.tif")
        .succeeds();
    scratch.run("lamp convert dots.tif --png -q -o dots/").succeeds();
    let dots = std::fs::read_dir(scratch.path("dots")).unwrap().map(|entry| entry.unwrap().path());
    let dots = dots.filter(|path| path.extension().is_some_and(|ending| ending == "png"));
    let dots = dots.map(|path| image::open(path).unwrap().into_luma16()).next().unwrap();
    let (columns, rows) = (dots.width() as usize, dots.height() as usize);
    let dots = GrayPicture { columns, rows, levels: dots.into_raw() };
    scratch.write("camera.png", &camera(&dots).to_png().unwrap());
    let line = "lamp calibrate projector camera.png --shown dots.tif --projector small.toml";
    let json = printed(&scratch, &format!("{line} --pixel 3um --json"));
    let answer: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(
        (&answer["model"], &answer["schema"]),
        (&"projector".into(), &"lamp-calibrate-1".into())
    );
    let number = |name: &str| {
        let of = answer["parameters"].as_array().unwrap().iter().find(|it| it["name"] == name);
        of.unwrap_or_else(|| panic!("{name} of {answer}"))["value"].as_f64().unwrap()
    };
    assert!((number("sigma") / (0.9 * 6.0) - 1.0).abs() < 5e-3, "{answer}");
    assert!((number("pitch") / 6.0 - 1.0).abs() < 1e-4, "{answer}");
    assert!(
        number("turned").abs() < 0.01 && (number("dark") - 2.0 / 0.45).abs() < 0.01,
        "{answer}"
    );
    let files = "--name mine -o mine.toml --flat-field light.png";
    let run = scratch.run(&format!("{line} {files}")).succeeds();
    let table = String::from_utf8(run.stdout).unwrap();
    assert!(
        table.contains("the picture is mirrored, as from below") && !table.contains("pitch"),
        "{table}"
    );
    // Without --pixel the pitch stays, and the spread is in its mirrors.
    let mine = String::from_utf8(scratch.bytes("mine.toml")).unwrap();
    let kept = small.lines().find(|line| line.starts_with("value = \"6.222")).unwrap();
    assert!(mine.contains(kept) && mine.contains("calibrated from camera.png"), "{mine}");
    let shown = printed(&scratch, "lamp projector check mine.toml --json");
    let sigma =
        serde_json::from_str::<Value>(&shown).unwrap()["projectors"][0]["sigma_um"].as_f64();
    assert!((sigma.unwrap() / (0.9 * 560.0 / 90.0) - 1.0).abs() < 5e-3, "{shown}");
    // The light is half as bright at one side.
    let light =
        GrayPicture::read(BufReader::new(File::open(scratch.path("light.png")).unwrap())).unwrap();
    assert_eq!((light.columns, light.rows), (96, 64));
    let of = |column: usize| f64::from(light.levels[32 * 96 + column]) / 65535.0;
    let wanted = |place: f64| (0.45 + 0.15 * place / 48.0) / (0.45 + 0.15 * 47.5 / 48.0);
    for (column, place) in [(20, -27.5), (70, 22.5), (95, 47.5)] {
        assert!(
            (of(column) / wanted(place) - 1.0).abs() < 0.01,
            "{column}: {} for {}",
            of(column),
            wanted(place)
        );
    }
    // Plans take both.
    let plan = "lamp plan column-cure dome.toml --projector mine.toml --material pegda-mw700 --voxel 6um \
                --flat-field light.png -q -o plan/";
    let dome =
        "name = \"dome\"\ndescription = \"\"\n[[lens]]\ndiameter = \"150 um\"\nsag = \"20 um\"\n";
    scratch.write("dome.toml", dome.as_bytes());
    scratch.run(plan).succeeds();
    let refused = |line: &str, words: &[&str]| scratch.run(line).is_refused_with(words);
    let misused = |line: &str, words: &[&str]| scratch.run(line).is_wrong_usage(words);
    misused(&format!("{line} --flat-field mine.toml"), &["mine.toml", ".png"]);
    misused(&format!("{line} --flat-field camera.png"), &["camera.png"]);
    misused(&format!("{line} --flat-field light.tif"), &["light.tif", ".png"]);
    refused(&line.replace("camera.png", "dots.tif"), &["dots.tif", "this picture is a TIFF"]);
    refused(&line.replace("camera.png", "-"), &["a picture is read from a file"]);
    let other = line.replace("small.toml", "zhao");
    refused(&other, &["dots.tif", "96 x 64 pixels", "1024 x 768 mirrors"]);
    let many = line.replace("dots.tif", "plan/bitmaps.tif");
    refused(&many, &["plan/bitmaps.tif", "images, but a picture shows one", "lamp split --layers"]);
    misused(
        "lamp target dots --projector small.toml --dot 10 --period 20",
        &["dots of 10 pixels need a period of 30"],
    );
    misused("lamp target dots --projector small.toml --period 64", &["a period of 64", "two rows"]);
    misused(&format!("{line} -o -"), &["name a file"]);
    refused(&format!("{line} --pixel 5mm"), &["camera.png", "pixel must be"]);
}
