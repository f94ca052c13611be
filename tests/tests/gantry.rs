//! Checks jobs of machines that scan: their frames give every pixel its exposure.

use std::fs;

use lamp_fixtures::Sample;
use lamp_gantry::{Disturbance, Frame, Frames, GantryError, JobFolder, JobSwath, expose};
use lamp_stack::Image;
use lamp_tests::{Scratch, note};
use serde_json::Value;

/// A machine whose swaths are 100 pixels wide and share 10.
const MACHINE: &str = r#"name = "mine"
description = "A scanner"
[area]
value = "100x80mm"
source = "-"
[scan]
mirrors = [100, 48]
overlap = 10
speed = ["1mm/s", "500mm/s"]
acceleration = "2000mm/s2"
row_clock_hz = 22000
both_ways = true
source = "-"
[times]
recoat_s = 8
source = "-"
"#;

/// Four towers, 236 x 236 pixels.
fn with_build() -> Scratch {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 5_000);
    scratch.write("mine.toml", MACHINE.as_bytes());
    scratch
        .run("slice tower.stl --dpi 100 --thickness 1mm --material lamp-suspension -q -o tower.tif")
        .succeeds();
    scratch.run("tile tower.tif --area 60x60mm -o build.tif").succeeds();
    scratch
}

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).unwrap()
}

#[test]
fn every_white_pixel_of_a_build_gets_its_exposure() {
    let scratch = with_build();
    scratch.run("tile tower.tif --area 60x60mm --machine mine.toml --strips strips/").succeeds();
    for (line, folder) in [
        ("lamp job build.tif --machine mine.toml -o job/", "job"),
        ("lamp job strips/ --machine mine.toml -o cut/", "cut"),
        ("lamp job build.tif --machine mine.toml --seam time -o time/", "time"),
    ] {
        scratch.run(line).succeeds();
        let said = scratch.run(&format!("lamp expose {folder}/ --layers 20..23 --json --strict"));
        let found = json(&said.succeeds_quietly().stdout);
        let layers = found["layers"].as_array().unwrap();
        assert_eq!(layers.len(), 3);
        for layer in layers {
            let shares: Vec<f64> =
                layer["shares"].as_array().unwrap().iter().filter_map(Value::as_f64).collect();
            assert!(shares.iter().all(|share| (share - 1.0).abs() < 0.002), "{layer}");
            assert!(layer["white_px"].as_u64().unwrap() > 1000 && layer["lit_px"] == 0, "{layer}");
        }
    }
    // Strips were cut with the comb that a job cuts with.
    let layers =
        |folder: &str| json(&scratch.bytes(&format!("{folder}/job.json")))["layers"].clone();
    let (job, mut cut) = (layers("job"), layers("cut"));
    for layer in cut.as_array_mut().unwrap() {
        for swath in layer["swaths"].as_array_mut().unwrap() {
            let strip = swath.as_object_mut().unwrap().remove("strip").unwrap();
            assert_eq!(strip, format!("strip_{:03}.tif", swath["swath"].as_u64().unwrap()));
        }
    }
    assert_eq!(job, cut);
}

#[test]
fn a_tilted_display_gives_wide_white_its_exposure() {
    let scratch = with_build();
    // Mirrors of 4 pixels of 254 um, which pass about a pixel apart.
    let tilt = "[scan.tilt]\ndegrees = 14.036\nmirror_pitch = \"1016um\"\nsource = \"-\"\n";
    let tilted =
        MACHINE.replace("overlap = 10", "overlap = 0").replace("[100, 48]", "[30, 20]") + tilt;
    scratch.write("tilted.toml", tilted.as_bytes());
    scratch.run("lamp machine check tilted.toml").succeeds();
    let job = scratch.run("lamp job build.tif --machine tilted.toml -o job").succeeds();
    let text = String::from_utf8(job.stdout).unwrap();
    assert!(text.contains("mirrors of 1016.00 um pass every 246.3"), "{text}");
    let exposed = scratch.run("lamp expose job --layers 5..8 --json --strict").succeeds_quietly();
    let exposed = json(&exposed.stdout);
    for layer in exposed["layers"].as_array().unwrap() {
        assert!(layer["white_px"].as_u64().unwrap() > 1000, "{layer}");
        assert!(layer["edge_px"].as_u64().unwrap() > 0 && layer["lit_px"] == 0, "{layer}");
        let shares = layer["shares"].as_array().unwrap();
        assert!(shares.iter().all(|share| (share.as_f64().unwrap() - 1.0).abs() < 2e-4));
    }
    scratch.run("tile tower.tif --area 60x60mm --machine mine.toml --strips strips/").succeeds();
    let job =
        |words: &str| scratch.run(&format!("lamp job {words} --machine tilted.toml -o other"));
    job("strips/").is_refused_with(&["slanted swaths"]);
    job("build.tif --gray-by time").is_refused_with(&["neither gray nor seams"]);
}

#[test]
fn faults_of_a_job_are_named() {
    let scratch = with_build();
    scratch.run("lamp job build.tif --machine mine.toml -o job/").succeeds();
    let text = String::from_utf8(scratch.bytes("job/job.json")).unwrap();
    let job = json(text.as_bytes());
    let layer = &job["layers"][20];
    let swath =
        layer["swaths"].as_array().unwrap().iter().find(|swath| swath["swath"] == 1).unwrap();
    let pitch = job["pitch_um"].as_f64().unwrap() / 1000.0;
    let faults = [
        // A swath that is shifted by a pixel, a row that is dropped, a head that is twice as fast.
        ("x_mm", Value::from(swath["x_mm"].as_f64().unwrap() + pitch), "seam of swaths"),
        ("first_row", Value::from(swath["first_row"].as_u64().unwrap() + 1), "swath 1:"),
        (
            "speed_mm_per_s",
            Value::from(2.0 * layer["speed_mm_per_s"].as_f64().unwrap()),
            "swath 0:",
        ),
    ];
    for (key, value, named) in faults {
        let mut broken = job.clone();
        let layer = &mut broken["layers"][20];
        let place = if key == "speed_mm_per_s" {
            layer
        } else {
            let swaths = layer["swaths"].as_array_mut().unwrap();
            swaths.iter_mut().find(|swath| swath["swath"] == 1).unwrap()
        };
        place[key] = value;
        if key == "first_row" {
            place["frames"] = Value::from(place["frames"].as_u64().unwrap() - 1);
        }
        scratch.write("job/job.json", broken.to_string().as_bytes());
        let found = scratch.run("lamp expose job/ --layers 19..22 --strict");
        assert_eq!(found.statuses, [Some(3)], "{found:?}");
        let lines = String::from_utf8(found.stdout.clone()).unwrap();
        let off: Vec<&str> = lines.lines().filter(|line| line.contains("are off by")).collect();
        assert!(off.iter().any(|line| line.trim().starts_with(named)), "{key}: {lines}");
        // The layers below and above are as they should be.
        let wrong = lines.split("layer ").filter(|layer| layer.contains("are off by"));
        assert!(wrong.into_iter().all(|layer| layer.starts_with("20:")), "{key}: {lines}");
    }
    // A row without its frame is no job.
    let frames = swath["frames"].to_string();
    let less = text.replacen(&format!("\"frames\":{frames}"), "\"frames\":1", 1);
    scratch.write("job/job.json", less.as_bytes());
    scratch.run("lamp expose job/").is_refused_with(&["1 frames do not fit its rows"]);
    // Nor is a job of other pages, sizes or exposures than the build's, or with a head beyond reason.
    for (key, value, words) in [
        ("page", Value::from(999), "page 999 of the build is not layer 20"),
        ("exposure_ms", Value::from(1.0), "layer 20 has 1 ms, and the build states"),
        ("layer", Value::from(21), "not in their order"),
    ] {
        let mut other = job.clone();
        other["layers"][20][key] = value;
        scratch.write("job/job.json", other.to_string().as_bytes());
        for line in
            ["lamp expose job/ --layers 20..22", "lamp frames job/ --layer 19 --swath 1 -o f"]
        {
            scratch.run(line).is_refused_with(&[words]);
        }
    }
    let narrow = text.replacen("\"pixels\":[236,", "\"pixels\":[235,", 1);
    scratch.write("job/job.json", narrow.as_bytes());
    scratch.run("lamp expose job/").is_refused_with(&["its pixels are [235, 236]"]);
    let mut wild = job.clone();
    wild["layers"][20]["speed_mm_per_s"] = Value::from(1e300);
    scratch.write("job/job.json", wild.to_string().as_bytes());
    assert_eq!(scratch.run("lamp expose job/ --layers 20 --strict").statuses, [Some(3)]);
    for line in [
        "lamp expose job/ --offset 9:1um,1um",
        "lamp expose job/ --offset 1:1um,1um --offset 1:2um,1um",
    ] {
        scratch.run(line).is_wrong_usage(&["--offset", "0 to 2 at most once"]);
    }
    scratch.run("lamp expose strips/").is_refused_with(&["no folder of lamp job"]);
    // Another build under the same name is refused.
    scratch.write("job/job.json", text.as_bytes());
    scratch.run("lamp expose job/ --layers 20 --strict").succeeds();
    scratch.run("tile tower.tif --area 60x60mm --copies 1 -o build.tif").succeeds();
    for line in ["lamp expose job/ --layers 20", "lamp frames job/ --layer 20 --swath 1 -o f"] {
        scratch.run(line).is_refused_with(&["build.tif", "its digest differs"]);
    }
}

#[test]
fn frames_have_the_rows_of_the_build() {
    let scratch = with_build();
    scratch.run("lamp job build.tif --machine mine.toml -o job/").succeeds();
    let written = scratch.run("lamp frames job/ --layer 20 --swath 1").succeeds_quietly().stdout;
    scratch
        .run("lamp frames build.tif --machine mine.toml --layer 20 --swath 1 -o f.frames")
        .succeeds_quietly();
    // The layer's own job begins anywhere, so it may go the other way; the header says which.
    let number =
        |bytes: &[u8], at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let build = &scratch.layers("build.tif")[20].image;
    for bytes in [written, scratch.bytes("f.frames")] {
        assert_eq!(&bytes[..8], b"LAMPFRM1");
        assert_eq!([8, 12, 16, 20, 24, 28].map(|at| number(&bytes, at)), [100, 48, 16, 20, 1, 90]);
        let mut position = i64::from_le_bytes(bytes[32..40].try_into().unwrap());
        let frames = u64::from_le_bytes(bytes[40..48].try_into().unwrap()) as usize;
        let step = number(&bytes, 56).cast_signed();
        assert_eq!(bytes.len(), 64 + frames * 48 * 16);
        for frame in bytes[64..].chunks_exact(48 * 16) {
            for (row, bits) in frame.chunks_exact(16).enumerate() {
                let row = position - row as i64;
                // Away from the seams, a mirror is bright where the build is white.
                for column in 10..90_u32 {
                    let bit = bits[column as usize / 8] >> (7 - column % 8) & 1 == 1;
                    let is_within = (0..i64::from(build.height())).contains(&row);
                    assert_eq!(bit, is_within && build.level(90 + column, row as u32) > 0);
                }
            }
            position += i64::from(step);
        }
    }
    scratch.run("lamp frames job/ --layer 20 --swath 1 --frames 60 -o one.png").succeeds_quietly();
    scratch
        .run("lamp frames job/ --layer 20 --swath 1 --frames ..20 -o few.png")
        .succeeds_quietly();
    assert_eq!(&scratch.bytes("one.png")[1..4], b"PNG");
    let few = scratch.bytes("few.png");
    assert!(few.windows(4).any(|four| four == b"acTL"));
    scratch
        .run("lamp expose job/ --layers 20 --columns 80..120 --rows 50..90 --picture d.png")
        .succeeds();
    assert_eq!(&scratch.bytes("d.png")[1..4], b"PNG");
}

#[test]
fn doses_are_a_stack_that_cures_as_the_build_does() {
    let scratch = with_build();
    scratch.run("lamp split build.tif --every 12 -o parts/").succeeds();
    let part = scratch.names_in("parts").into_iter().find(|name| name.ends_with(".tif")).unwrap();
    fs::rename(scratch.path("parts").join(part), scratch.path("build.tif")).unwrap();
    scratch.run("lamp job build.tif --machine mine.toml -o job/").succeeds();
    scratch.run("lamp expose job/ -o doses.tif -q").succeeds();
    let (doses, build) = (scratch.layers("doses.tif"), scratch.layers("build.tif"));
    assert_eq!((doses.len(), build.len()), (12, 12));
    for (doses, build) in doses.iter().zip(&build) {
        // Level 200 of 255 is the exposure.
        let ratio = doses.info.exposure_ms.unwrap() / build.info.exposure_ms.unwrap();
        assert!((ratio - 1.275).abs() < 1e-12);
        for row in 0..build.image.height() {
            let white: Vec<_> = build.image.runs(row).map(|(a, b, _)| (a, b, 200)).collect();
            assert_eq!(doses.image.runs(row).collect::<Vec<_>>(), white);
        }
    }
    scratch.run("lamp verify doses.tif").succeeds();
    let cured = |stack: &str| {
        let line =
            format!("lamp cure {stack} --material lamp-suspension --section y=20mm -q -o c.png");
        String::from_utf8(scratch.run(&line).succeeds().stdout).unwrap()
    };
    // Gray stacks are drawn as white, too; their own line is the last.
    let area = |text: &str| -> f64 {
        let after = text.rsplit("cured ").next().unwrap().split_whitespace().next().unwrap();
        after.parse().unwrap_or_else(|_| panic!("{text}"))
    };
    let (of_build, of_doses) = (area(&cured("build.tif")), area(&cured("doses.tif")));
    assert!((of_build - of_doses).abs() < 0.01 * of_build, "{of_build} and {of_doses}");
    // A swath beside its place leaves a gap in one row of pixels.
    scratch.run("lamp expose job/ --offset 1:0.254mm,0mm -o shifted.tif -q").succeeds();
    let shifted = &scratch.layers("shifted.tif")[0];
    let commands = &shifted.info.stack.as_ref().unwrap().commands;
    assert_eq!(commands.last().unwrap(), "expose --offset 1:254um,0um");
    assert_ne!(shifted.image, doses[0].image);
}

#[test]
fn gray_layers_are_shown_in_time() {
    let scratch = Scratch::new();
    scratch.part("torus.stl", Sample::Torus, 5_000);
    scratch.write("mine.toml", MACHINE.as_bytes());
    let slice = "slice torus.stl --dpi 100 --thickness 1mm --gray --material lamp-suspension -q -o gray.tif";
    scratch.run(slice).succeeds();
    let line = "lamp job gray.tif --machine mine.toml -o job/";
    scratch.run(line).is_refused_with(&["gray.tif: layer", "--gray-by time"]);
    scratch.run(&format!("{line} --gray-by time --seam time")).succeeds();
    let found = scratch.run("lamp expose job/ --json --dose-tolerance 100").succeeds_quietly();
    let found = json(&found.stdout);
    // Within half of 48 rows, also for the faintest level.
    let worst = found["layers"].as_array().unwrap().iter().flat_map(|layer| {
        layer["shares"].as_array().unwrap()[1..2]
            .iter()
            .filter_map(Value::as_f64)
            .collect::<Vec<_>>()
    });
    assert!(worst.into_iter().all(|mean| (mean - 1.0).abs() < 0.02), "{found}");
}

#[test]
fn times_of_a_build_are_those_of_its_job() {
    let scratch = with_build();
    let tile = "tile tower.tif --area 60x60mm --machine mine.toml --report r.json -o b.tif";
    scratch.run(tile).succeeds();
    let sums = scratch.run("lamp job b.tif --machine mine.toml -o job/ --json").succeeds_quietly();
    let (sums, report) = (json(&sums.stdout), json(&scratch.bytes("r.json")));
    let near = |a: &Value, b: f64| assert!((a.as_f64().unwrap() - b).abs() < 1e-6, "{a} and {b}");
    near(&report["build_s"], sums["seconds"].as_f64().unwrap());
    assert_eq!(
        (&report["swaths"], &report["black_swaths"]),
        (&sums["swaths"], &sums["empty_swaths"])
    );
    let told = scratch.run("lamp report b.tif --machine mine.toml --json").succeeds_quietly();
    near(&json(&told.stdout)["stacks"][0]["build_s"], sums["seconds"].as_f64().unwrap());
    let printed =
        scratch.run("tile tower.tif --area 60x60mm --machine mine.toml --time").succeeds();
    let printed = String::from_utf8(printed.stdout).unwrap();
    assert!(printed.contains(&format!(", {} in all", sums["swaths"])), "{printed}");
    // A machine that cannot scan a layer says so in place of a time.
    scratch.write("slow.toml", MACHINE.replace("\"500mm/s\"", "\"1.2mm/s\"").as_bytes());
    let slow = scratch.run("tile tower.tif --area 60x60mm --machine slow.toml --time").succeeds();
    let slow = String::from_utf8(slow.stdout).unwrap();
    assert!(slow.contains("not known") && slow.contains("at most 1.2 mm/s"), "{slow}");
}

#[test]
fn impossible_jobs_are_refused_and_leave_nothing() {
    let scratch = with_build();
    let job = |more: &str| scratch.run(&format!("lamp job build.tif -o job/ {more}"));
    job("").is_wrong_usage(&["--machine is missing"]);
    job("--machine beta").is_refused_with(&["beta", "[scan]"]);
    job("--machine mine.toml --layers 900..")
        .is_refused_with(&["build.tif", "begins with layer 0"]);
    job("--machine mine.toml --seam gray").is_refused_with(&["comb or time"]);
    for (from, to, words) in [
        ("\"500mm/s\"", "\"1.2mm/s\"", &["layer 0", "at most 1.2 mm/s", "expose at least"][..]),
        ("row_clock_hz = 22000", "row_clock_hz = 3", &["layer 0", "rows a second", "at most 3:"]),
        ("\"1mm/s\"", "\"2mm/s\"", &["layer 0", "passes", "more passes"]),
    ] {
        assert!(MACHINE.contains(from));
        scratch.write("other.toml", MACHINE.replace(from, to).as_bytes());
        job("--machine other.toml").is_refused_with(words);
    }
    scratch.run("lamp job - --machine mine.toml -o job/").is_wrong_usage(&["names its build"]);
    assert!(!scratch.path("job").exists());
    job("--machine mine.toml").succeeds();
    for (line, words) in [
        ("lamp frames job/ --layer 20 --swath 9 -o f", &["swaths 0 to 2"][..]),
        ("lamp frames job/ --layer 900 --swath 0 -o f", &["no layer 900"]),
        ("lamp frames job/ --layer 20 --swath 0 --pass 1 -o f", &["passes 0 to 0, and no 1"]),
    ] {
        scratch.run(line).is_refused_with(words);
    }
    scratch
        .run("lamp frames job/ --layer 20 --swath 0 --seam comb -o f")
        .is_wrong_usage(&["a job has its machine"]);
    scratch
        .run("lamp frames job/ --layer 20 --swath 0 --frames 9000 -o f")
        .is_wrong_usage(&["frames 0 to"]);
    scratch.run("lamp expose job/ --columns 900..").is_wrong_usage(&["--columns", "236"]);
    scratch.run("lamp expose job/ --layers 900").is_wrong_usage(&["no layer in this range"]);
    scratch.run("lamp expose job/ --picture d.png").is_wrong_usage(&["one layer"]);
    assert!(!scratch.path("f").exists());
}

/// Returns the root mean square and the greatest difference of the mean of windows of 4 x 4 pixels,
/// 64 um wide, from what a gray layer wants there. Only windows that hold gray count.
fn window_errors(wanted: &Image, got: impl Fn(u32, u32) -> f64) -> [f64; 2] {
    let (mut squares, mut worst, mut count) = (0.0, 0.0_f64, 0);
    for (row, column) in (0..wanted.height() / 4)
        .flat_map(|row| (0..wanted.width() / 4).map(move |column| (4 * row, 4 * column)))
    {
        let places = || (0..16_u32).map(|at| (column + at % 4, row + at / 4));
        let levels = places().map(|(column, row)| wanted.level(column, row));
        if levels.clone().any(|level| (1..255).contains(&level)) {
            let want = levels.map(|level| f64::from(level) / 255.0).sum::<f64>() / 16.0;
            let error = places().map(|(column, row)| got(column, row)).sum::<f64>() / 16.0 - want;
            squares += error * error;
            worst = worst.max(error.abs());
            count += 1;
        }
    }
    assert!(count > 1000, "{count} gray windows");
    [(squares / f64::from(count)).sqrt(), worst]
}

#[test]
fn gray_in_time_has_no_grain() {
    // Layers of each part with much gray.
    for (part, layer) in [(Sample::Sphere, 30), (Sample::Blade, 905)] {
        compare_with_dots(part, layer);
    }
}

fn compare_with_dots(part: Sample, layer: u32) {
    let scratch = Scratch::new();
    scratch.part("part.stl", part, 24_000);
    let machine = MACHINE.replace("[100, 48]", "[1024, 768]");
    scratch.write("mine.toml", machine.as_bytes());
    // A pixel is 16 um.
    let slice = "slice part.stl --dpi 1587.5 --gray --material lamp-suspension -q";
    scratch.run(&format!("{slice} --layers {layer} -o gray.tif")).succeeds();
    scratch.run("dither gray.tif -q -o dots.tif").succeeds();
    scratch.run("lamp job gray.tif --machine mine.toml --gray-by time -q -o job/").succeeds();
    let folder = JobFolder::open(&scratch.path("job")).unwrap();
    let (job, pages) = (&folder.job, folder.build().unwrap());
    let (wanted, layer) = (pages.image(0).unwrap(), &job.layers[0]);
    let count = job.layout().count(job.pixels[0]).unwrap();
    let images = pages.swaths(0, 0..count, &job.layout()).unwrap();
    let mut doses = vec![0.0_f64; wanted.width() as usize * wanted.height() as usize];
    let show = |pass: &JobSwath, to: &mut dyn FnMut(&Frame<'_>)| {
        let swath = job.swath(pass, &images[pass.swath as usize])?;
        let mut frames = Frames::new(swath, &folder.mirrors);
        while let Some(frame) = frames.next() {
            to(&frame);
        }
        Ok::<_, GantryError>(())
    };
    let width = wanted.width() as usize;
    expose(job, layer, &wanted, &Disturbance::none(job), show, |first, columns, band| {
        for (row, band) in band.chunks(columns).enumerate() {
            for (column, &dose) in band.iter().enumerate() {
                doses[row * width + first as usize + column] = f64::from(dose) / layer.exposure_ms;
            }
        }
    })
    .unwrap();
    let time = window_errors(&wanted, |column, row| doses[row as usize * width + column as usize]);
    let dots = &scratch.layers("dots.tif")[0].image;
    let dots = window_errors(&wanted, |column, row| f64::from(dots.level(column, row)) / 255.0);
    let percent =
        |errors: [f64; 2]| errors.map(|error| format!("{:.3} %", error * 100.0)).join(", at most ");
    note(&format!(
        "doses of 64 um windows of a gray {}: in time {}, as dots {}",
        part.name(),
        percent(time),
        percent(dots)
    ));
    // Half a row of 768, and the sum of single floats.
    assert!(time[1] < 0.5 / 768.0 + 1e-4, "{time:?}");
    assert!(dots[0] > 20.0 * time[0], "{dots:?} and {time:?}");
}
