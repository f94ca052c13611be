//! Checks that pipelines of real processes give the same layers by pipe, file and folder.

use std::io::Read;
use std::process::Stdio;
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use lamp_fixtures::Sample;
use lamp_stack::{Layer, PageInfo, StackInfo};
use lamp_tests::{Scratch, masks, read_stack};

/// Coarse, so that slicing is fast.
const COARSE: &str = "--dpi 100 --thickness 1mm";
/// 400 x 400 pixels at 100 dpi: nine towers.
const AREA: &str = "--area 4x4in";

fn with_tower() -> Scratch {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 5_000);
    scratch
}

/// Returns the layers without the metadata of their stack.
fn without_stack(layers: &[Layer]) -> Vec<Layer> {
    let mut layers = layers.to_vec();
    layers.iter_mut().for_each(|layer| layer.info.stack = None);
    layers
}

fn stack_info(layers: &[Layer]) -> &StackInfo {
    layers[0].info.stack.as_ref().expect("the first page speaks of the stack")
}

#[test]
fn four_processes_make_a_build_of_the_right_size() {
    let scratch = with_tower();
    let tile = format!("tile {AREA} --mesh none");
    let line = format!("slice tower.stl {COARSE} | fix | dither | {tile} > build.tif");
    scratch.run(&line).succeeds_quietly();
    let layers = scratch.layers("build.tif");
    // 76.2 mm in layers of 1 mm.
    assert_eq!(layers.len(), 76);
    for (k, layer) in (0..).zip(&layers) {
        assert_eq!((layer.image.width(), layer.image.height()), (400, 400));
        let PageInfo { index, z_um, thickness_um, .. } = layer.info;
        assert_eq!((index, z_um, thickness_um), (k, Some(f64::from(k) * 1e3), Some(1e3)));
        assert_eq!(layer.pitch, lamp_stack::Pitch::of_dpi(100.0));
    }
    assert_eq!(stack_info(&layers).part, "tower");
    // Nine copies of a foot of 12.7 mm, of which a circle takes 50² π pixels.
    let white = masks(&layers)[0].white_pixels() as f64;
    let circles = 9.0 * 2_500.0 * std::f64::consts::PI;
    assert!((white / circles - 1.0).abs() < 0.01, "{white} white pixels, not {circles}");
}

#[test]
fn a_pipe_makes_the_bytes_that_stages_make_through_files() {
    let scratch = with_tower();
    let line = format!("slice tower.stl {COARSE} | fix | dither | tile {AREA} > piped.tif");
    scratch.run(&line).succeeds();
    scratch.run(&format!("slice tower.stl {COARSE} -o 1.tif")).succeeds();
    scratch.run("fix 1.tif -o 2.tif").succeeds();
    scratch.run("dither 2.tif -o 3.tif").succeeds();
    scratch.run(&format!("tile 3.tif {AREA} -o 4.tif")).succeeds();
    assert!(scratch.bytes("piped.tif") == scratch.bytes("4.tif"));
    // Two stages had nothing to do and kept every byte.
    assert!(scratch.bytes("1.tif") == scratch.bytes("2.tif"));
    assert!(scratch.bytes("2.tif") == scratch.bytes("3.tif"));
    assert!(scratch.bytes("3.tif") != scratch.bytes("4.tif"));
}

#[test]
fn threads_memory_and_the_name_of_the_program_change_no_byte() {
    let scratch = with_tower();
    let stages = |slice: &str, more: &str| {
        let line = format!(
            "{slice} tower.stl {COARSE} {more} | lamp fix {0} | lamp dither {0} | lamp tile {AREA} {0}",
            if more.contains("threads") { more } else { "" }
        );
        scratch.run(&line).succeeds().stdout
    };
    let plain = stages("slice", "");
    // Five of mesh alone are below the part's 76.
    assert_eq!(read_stack(plain.clone()).len(), 81);
    for more in ["--threads 1", "--threads 2", "--threads 7", "--memory 16MB", "--memory 1GB"] {
        assert!(stages("slice", more) == plain, "{more} changed the bytes");
    }
    assert!(stages("lamp slice", "") == plain);
}

#[test]
fn stages_read_files_and_standard_input_alike() {
    let scratch = with_tower();
    scratch.run(&format!("slice tower.stl {COARSE} -o tower.tif")).succeeds();
    let stack = scratch.bytes("tower.tif");
    for stage in ["fix", "dither", "tile", "lamp fix"] {
        let options = if stage == "tile" { AREA } else { "" };
        let from_file = scratch.run(&format!("{stage} tower.tif {options}")).succeeds().stdout;
        for dash in ["", "-"] {
            let line = format!("{stage} {dash} {options}");
            assert!(scratch.run_on(&line, &stack).succeeds().stdout == from_file, "{line}");
        }
        scratch.run(&format!("{stage} tower.tif {options} -o out.tif")).succeeds();
        assert!(scratch.bytes("out.tif") == from_file, "{stage} -o");
    }
}

#[test]
fn a_part_from_standard_input_gives_the_same_layers() {
    let scratch = with_tower();
    let named = scratch.run(&format!("slice tower.stl {COARSE}")).succeeds().stdout;
    let line = format!("slice - {COARSE}");
    let piped = scratch.run_on(&line, &scratch.bytes("tower.stl")).succeeds().stdout;
    let (named, piped) = (read_stack(named), read_stack(piped));
    assert_eq!(stack_info(&named).digest, stack_info(&piped).digest);
    assert!(without_stack(&named) == without_stack(&piped));
}

#[test]
fn a_folder_of_pages_is_the_same_stack() {
    let scratch = with_tower();
    scratch.run(&format!("slice tower.stl {COARSE} -o tower.tif")).succeeds();
    scratch.run(&format!("slice tower.stl {COARSE} -o pages/")).succeeds_quietly();
    let file = scratch.layers("tower.tif");
    assert!(scratch.layers("pages") == file);
    assert!(scratch.path("pages/layer_00075.tif").is_file());

    std::fs::create_dir(scratch.path("empty")).unwrap();
    scratch.run("fix pages -o empty").succeeds_quietly();
    assert!(scratch.layers("empty") == file);

    let from_folder = scratch.run(&format!("dither empty | tile {AREA}")).succeeds().stdout;
    let from_file = scratch.run(&format!("tile tower.tif {AREA}")).succeeds().stdout;
    assert!(from_folder == from_file);
    assert_eq!(scratch.names(), ["empty", "pages", "tower.stl", "tower.tif"]);
}

#[test]
fn a_classic_tiff_holds_the_same_layers() {
    let scratch = with_tower();
    scratch.run(&format!("slice tower.stl {COARSE} -o big.tif")).succeeds();
    scratch.run(&format!("slice tower.stl {COARSE} --classic -o classic.tif")).succeeds();
    let [big, classic] = ["big.tif", "classic.tif"].map(|name| scratch.bytes(name));
    assert_eq!((big[2], classic[2]), (43, 42));
    assert!(scratch.layers("big.tif") == scratch.layers("classic.tif"));
    // The stages accept both forms and convert between them.
    assert!(scratch.run("fix classic.tif").succeeds().stdout == big);
    assert!(scratch.run("fix big.tif --classic").succeeds().stdout == classic);
    assert!(scratch.run_on("dither --classic", &classic).succeeds().stdout == classic);
}

#[test]
fn a_range_of_layers_is_that_part_of_the_stack() {
    let scratch = with_tower();
    scratch.run(&format!("slice tower.stl {COARSE} -o all.tif")).succeeds();
    scratch.run(&format!("slice tower.stl {COARSE} -o pages/")).succeeds();
    let all = without_stack(&scratch.layers("all.tif"));
    for (range, wanted) in [("20..31", 20..31), ("..3", 0..3), ("74..", 74..76), ("5", 5..6)] {
        let wanted = &all[wanted];
        for line in [
            format!("slice tower.stl {COARSE} --layers {range}"),
            format!("fix all.tif --layers {range}"),
            format!("dither pages --layers {range}"),
            format!("slice tower.stl {COARSE} | fix --layers {range}"),
        ] {
            let some = read_stack(scratch.run(&line).succeeds_quietly().stdout);
            assert!(without_stack(&some) == wanted, "{line}");
            assert_eq!(stack_info(&some).part, "tower", "{line}");
        }
    }
    let line = format!("tile all.tif {AREA} --mesh none --layers 20..31");
    let tiled = read_stack(scratch.run(&line).succeeds().stdout);
    assert_eq!(
        tiled.iter().map(|layer| layer.info.index).collect::<Vec<_>>(),
        Vec::from_iter(20..31)
    );
}

#[test]
fn a_range_of_layers_written_as_a_folder_reads_back() {
    let scratch = with_tower();
    scratch.run(&format!("slice tower.stl {COARSE} -o all.tif")).succeeds();
    scratch.run("fix all.tif --layers 20..31 -o some/").succeeds();
    scratch.run(&format!("slice tower.stl {COARSE} --layers 20..31 -o sliced/")).succeeds();
    let all = without_stack(&scratch.layers("all.tif"));
    for folder in ["some", "sliced"] {
        assert!(without_stack(&scratch.layers(folder)) == all[20..31], "{folder}");
    }
}

#[test]
fn tiled_copies_are_the_part_and_nothing_else() {
    let scratch = with_tower();
    scratch.run(&format!("slice tower.stl {COARSE} --layers 60..63 -o part.tif")).succeeds();
    scratch.run(&format!("tile part.tif {AREA} --mesh none --gap 2mm -o build.tif")).succeeds();
    let (part, build) = (scratch.layers("part.tif"), scratch.layers("build.tif"));
    let copies = stack_info(&build).other["tile"]["copies"].as_array().expect("a list").clone();
    // Images of 128 x 102 pixels, 8 apart, on 400 x 400.
    assert_eq!(copies.len(), 9);
    for (part, build) in masks(&part).into_iter().zip(masks(&build)) {
        for copy in &copies {
            let at = |i: usize| copy[i].as_u64().expect("a number of pixels") as u32;
            let same = |column: u32, row: u32| {
                part.is_white(column, row) == build.is_white(at(0) + column, at(1) + row)
            };
            assert!((0..part.height()).all(|row| (0..part.width()).all(|c| same(c, row))));
        }
        assert_eq!(build.white_pixels(), copies.len() as u64 * part.white_pixels());
    }
}

#[test]
fn the_demo_is_what_the_four_binaries_make() {
    let scratch = Scratch::new();
    let said = scratch.run("lamp demo shown --facets 24k").succeeds();
    assert_eq!(said.stderr, "");
    let said = String::from_utf8(said.stdout).unwrap();
    assert!(said.contains("24016 facets") && said.contains("1270 layers of 6000 x 6750"), "{said}");
    let names = scratch.names_in("shown");
    let pictures = ["layer_00050.png", "layer_00449.png", "layer_00965.png", "layer_01174.png"];
    let stacks = ["alpha.png", "alpha.tif", "blade.stl", "build.tif", "job"];
    assert_eq!(names, [&stacks, &pictures[..], &["layers.png", "scanner.toml"]].concat());
    for name in pictures.iter().chain(&["layers.png", "alpha.png"]) {
        let picture = scratch.bytes(&format!("shown/{name}"));
        let mut reader = png::Decoder::new(std::io::Cursor::new(picture)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        // A picture of a layer, in black and white and with gray edges.
        assert!([0, 255].iter().all(|level| pixels.contains(level)), "{name}");
    }
    scratch
        .run("slice shown/blade.stl | fix | dither | tile --mesh none > by_hand.tif")
        .succeeds_quietly();
    assert!(scratch.bytes("shown/build.tif") == scratch.bytes("by_hand.tif"));
    let (_, line) = said.rsplit_once("slice ").expect("it says how");
    let (line, _) = line.rsplit_once("> shown/alpha.tif").expect("it says how");
    let in_mesh = scratch.run(&format!("slice {line}")).succeeds_quietly().stdout;
    assert!(scratch.bytes("shown/alpha.tif") == in_mesh);
    scratch.run("lamp job shown/alpha.tif --machine shown/scanner.toml -o shown/again").succeeds();
    assert!(scratch.bytes("shown/job/job.json") == scratch.bytes("shown/again/job.json"));
    let in_mesh = read_stack(in_mesh);
    assert_eq!((in_mesh.len(), in_mesh[0].info.index), (20, 444));
}

#[test]
fn a_stage_that_is_killed_leaves_no_process_at_work() {
    let scratch = Scratch::new();
    let mut fix = scratch.command("fix");
    fix.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut fix = fix.spawn().expect("fix starts");
    // It waits for its input, which stays open.
    let input = fix.stdin.take();
    let mut errors = fix.stderr.take().expect("a pipe");
    thread::sleep(Duration::from_secs(2));
    assert!(fix.try_wait().expect("a child can be waited for").is_none(), "it does not wait");
    fix.kill().expect("it can be ended");
    // The pipe ends with the last process that could still write into it.
    let (sender, ended) = mpsc::channel();
    thread::spawn(move || sender.send(errors.read_to_end(&mut Vec::new())));
    let ended = ended.recv_timeout(Duration::from_secs(20));
    assert!(matches!(ended, Ok(Ok(_))), "a process goes on");
    drop(input);
    fix.wait().expect("a child can be waited for");
}
