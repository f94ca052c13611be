//! Inputs of `slice`: formats, placements, and warnings of parts that are hardly meant so.

use std::fs;
use std::io::Write;
use std::process::Stdio;
use std::time::{Duration, Instant};

use lamp_fixtures::{Mesh, Sample, build, sphere, three_mf, three_mf_model, torus};
use lamp_tests::{Scratch, masks};

const COARSE: &str = "--dpi 100 --thickness 1mm";

fn stl(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    mesh.write_stl("part", &mut bytes).unwrap();
    bytes
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packed.write_all(bytes).unwrap();
    packed.finish().unwrap()
}

#[test]
fn every_format_gives_the_same_layers_and_pipes_do() {
    let scratch = Scratch::new();
    let ring = torus(20.0, 8.0, 2_000);
    scratch.write("part.stl", &stl(&ring));
    // The content decides, not the name.
    scratch.write("part.stl.gz", &gzip(&stl(&ring)));
    scratch.write("part", ring.obj().as_bytes());
    let model = three_mf_model("millimeter", &ring.three_mf_object(1), "<item objectid=\"1\"/>\n");
    scratch.write("part.3mf", &three_mf(&model, &[]));
    scratch.run(&format!("slice part.stl {COARSE} -o stl.tif")).succeeds_quietly();
    let expected = scratch.layers("stl.tif");
    for name in ["part.stl.gz", "part", "part.3mf"] {
        scratch.run(&format!("slice {name} {COARSE} -o out.tif")).succeeds_quietly();
        let layers = scratch.layers("out.tif");
        assert!(masks(&layers) == masks(&expected), "{name}");
        assert_eq!(layers[0].info.stack.as_ref().unwrap().part, "part");
        let line = format!("slice - {COARSE} -o out.tif");
        scratch.run_on(&line, &scratch.bytes(name)).succeeds_quietly();
        assert!(masks(&scratch.layers("out.tif")) == masks(&expected), "{name} in a pipe");
    }
}

/// The shell turns `slice <(zcat part.stl.gz)` into a name that stands for a pipe.
#[cfg(unix)]
#[test]
fn a_pipe_with_a_name_is_read_to_its_end() {
    let scratch = Scratch::new();
    let bytes = stl(&torus(20.0, 8.0, 5_000));
    scratch.write("part.stl", &bytes);
    scratch.run(&format!("slice part.stl {COARSE} -o file.tif")).succeeds_quietly();
    let mut slice = scratch.command(&format!("slice /dev/stdin {COARSE} -o pipe.tif"));
    let mut child = slice.stdin(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(&bytes).unwrap();
    assert!(child.wait().unwrap().success());
    let [file, pipe] = ["file.tif", "pipe.tif"].map(|name| scratch.layers(name));
    assert!(masks(&file) == masks(&pipe));
    let command = &pipe[0].info.stack.as_ref().unwrap().commands[0];
    assert!(command.starts_with("slice - --dpi"), "{command}");
}

#[test]
fn parts_are_placed_each_by_itself() {
    let scratch = Scratch::new();
    let ring = torus(20.0, 8.0, 2_000);
    scratch.mesh("ring.stl", &ring);
    scratch.mesh("a@b.stl", &ring.map(|[x, y, z]| [12.7 - y, x - 50.8, z]));
    let line = format!("slice ring.stl a@b.stl {COARSE} -o out.tif");
    scratch.run(&line).succeeds_quietly();
    let expected = scratch.layers("out.tif");
    let line = format!("slice ring.stl ring.stl@12.7,-2in,0,90 {COARSE} -o out.tif");
    scratch.run(&line).succeeds_quietly();
    let layers = scratch.layers("out.tif");
    assert!(masks(&layers) == masks(&expected));
    let command = &layers[0].info.stack.as_ref().unwrap().commands[0];
    assert!(command.starts_with("slice ring.stl ring.stl@12.7,-50.8,0,90 --dpi 100 "), "{command}");
    scratch.run("slice ring.stl@1,x -o out.tif").is_wrong_usage(&["`1,x` is not a placement"]);
    // A section of the part needs it where it was.
    let cure = "lamp cure out.tif --material lamp-suspension --section y=0mm -o section.png";
    let placed = format!("{cure} --part ring.stl --part ring.stl@12.7,-50.8,0,90");
    scratch.run(&placed).succeeds();
    let elsewhere = format!("{cure} --quiet --part ring.stl --part ring.stl");
    scratch
        .run(&elsewhere)
        .is_refused_with(&["sliced from ring.stl ring.stl@12.7", "same placements"]);
}

#[test]
fn a_folder_is_named_as_one() {
    let scratch = Scratch::new();
    fs::create_dir(scratch.path("folder")).unwrap();
    scratch.run("slice folder/ -o x.tif").is_refused_with(&["is a folder", "name the part's file"]);
}

/// Parts in meters and micrometers: warned of, refused with --strict, and right with their unit.
#[test]
fn a_wrong_unit_is_told() {
    let scratch = Scratch::new();
    let ball = sphere(25.4, 2_000);
    scratch.mesh("ball.stl", &ball);
    scratch.run(&format!("slice ball.stl {COARSE} -o out.tif")).succeeds_quietly();
    let expected = scratch.layers("out.tif");
    for (unit, per_mm, words) in [
        ("m", 0.001, "smaller than any casting: if its file is in meters, give --units m"),
        ("um", 1000.0, "larger than any machine builds: if its file is in micrometers"),
    ] {
        scratch.mesh("part.stl", &ball.map(|corner| corner.map(|c| c * per_mm)));
        let line = format!("slice part.stl {COARSE} --layers 0..2 -o out.tif");
        // Silence is for what nobody needs to look at.
        let ran = scratch.run(&format!("{line} -q")).succeeds();
        assert!(ran.stderr.contains(words), "{ran:?}");
        let ran =
            scratch.run(&format!("slice part.stl {COARSE} --layers 0..2 --strict -o strict.tif"));
        assert!(ran.statuses == [Some(3)] && ran.stderr.contains(words), "{ran:?}");
        assert!(!scratch.path("strict.tif").exists());
        let line = format!("slice part.stl {COARSE} --units {unit} --strict -o out.tif");
        scratch.run(&line).succeeds_quietly();
        let layers = scratch.layers("out.tif");
        // 32-bit coordinates in another unit end in other digits.
        let [here, there] = [&layers, &expected]
            .map(|layers| masks(layers).iter().map(|mask| mask.white_pixels() as f64).sum::<f64>());
        assert!(layers.len() == expected.len() && (here / there - 1.0).abs() < 1e-3, "{unit}");
        let ran = scratch.run(&format!("lamp heights part.stl --dpi 100 --max 5mm --units {unit}"));
        assert_eq!(ran.succeeds().stderr, "");
    }
}

#[test]
fn a_stack_without_white_is_told() {
    let scratch = Scratch::new();
    // Flat in z, and thinner than the rows are apart.
    let sheet = build(Sample::Cube, 200).unwrap().map(|[x, y, z]| [x, y * 1e-4, z]);
    scratch.mesh("sheet.stl", &sheet);
    let ran = scratch.run(&format!("slice sheet.stl {COARSE} -q -o out.tif")).succeeds();
    assert!(ran.stderr.contains("no layer has a white pixel"), "{ran:?}");
    scratch.mesh(
        "blank.stl",
        &Mesh {
            facets: build(Sample::Cube, 200)
                .unwrap()
                .facets
                .iter()
                .flat_map(|&[a, b, c]| [[a, b, c], [a, c, b]])
                .collect(),
        },
    );
    let ran =
        scratch.run(&format!("slice blank.stl {COARSE} --fill even-odd --strict -o strict.tif"));
    assert!(ran.statuses == [Some(3)] && ran.stderr.contains("no layer has a white"), "{ran:?}");
    assert!(!scratch.path("strict.tif").exists());
    let ran =
        scratch.run(&format!("slice blank.stl {COARSE} --fill even-odd --strict | lamp info -"));
    assert_eq!((ran.statuses[0], ran.statuses[1]), (Some(3), Some(1)), "{ran:?}");
}

#[test]
fn overlaps_are_told_unless_parts_unite() {
    let scratch = Scratch::new();
    scratch.mesh("ball.stl", &sphere(10.0, 500));
    let line = |more: &str| format!("slice ball.stl ball.stl@15,0 {COARSE} {more} -o out.tif");
    let ran = scratch.run(&line("--fill even-odd")).succeeds();
    assert!(ran.stderr.contains("boxes of ball.stl and ball.stl overlap"), "{ran:?}");
    assert!(ran.stderr.contains("--fill solid"), "{ran:?}");
    let ran = scratch.run(&line("--strict --fill even-odd"));
    assert_eq!(ran.statuses, [Some(3)], "{ran:?}");
    scratch.run(&line("--strict")).succeeds_quietly();
}

#[test]
fn a_wild_vertex_is_refused_at_once_unless_it_is_trusted() {
    let scratch = Scratch::new();
    let mut ball = sphere(10.0, 200);
    ball.facets[57][1] = [3.0, 4.0, 1e5];
    scratch.mesh("ball.stl", &ball);
    for more in ["", "--rotate x:31,y:12", "--adaptive", "--dpi 2400 --thickness 10um"] {
        let begin = Instant::now();
        scratch.run(&format!("slice ball.stl {more} -o out.tif")).is_refused_with(&[
            "ball.stl: facet 57 has a corner at 3, 4, 100000",
            "--trust-extent",
        ]);
        assert!(begin.elapsed() < Duration::from_secs(10), "{more}");
    }
    // Trusted, it is sliced, and recorded so that lamp cure can open it again.
    let line = "slice ball.stl --dpi 100 --layers 0..20 --trust-extent -o out.tif";
    let ran = scratch.run(line).succeeds();
    assert!(ran.stderr.contains("larger than any machine builds"), "{ran:?}");
    let layers = scratch.layers("out.tif");
    let command = &layers[0].info.stack.as_ref().unwrap().commands[0];
    assert!(command.contains(" --trust-extent "), "{command}");
    // Few facets are no reason to doubt one of them, but rows without end are.
    scratch
        .mesh("long.stl", &build(Sample::Cube, 64).unwrap().map(|corner| corner.map(|c| c * 1e4)));
    scratch
        .run("slice long.stl -o out.tif")
        .is_refused_with(&["rows are more than any machine exposes", "--trust-extent"]);
}

#[test]
fn real_files_have_no_wild_vertices() {
    let Some(folder) = lamp_tests::shared_data("stl") else {
        return lamp_tests::note("there is no ../shared/data/stl: skipped");
    };
    let scratch = Scratch::new();
    for file in fs::read_dir(folder).unwrap() {
        let path = file.unwrap().path();
        let line = format!("slice {} --dpi 72 --thickness 5mm -o out.tif", path.display());
        let ran = scratch.run(&line);
        assert!(!ran.stderr.contains("far outside"), "{ran:?}");
    }
}
