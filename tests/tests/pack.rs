//! Packs stacks of all kinds, and reads them by every command, from files and pipes.

use std::fs;

use lamp_fixtures::Sample;
use lamp_tests::{Scratch, ask, shared_data};

/// A bore through the tower.
const EDITS: &[u8] =
    b"[[edit]]\nop = \"subtract\"\nz = [\"5mm\", \"30mm\"]\nbox = { x = [\"-5mm\", \"5mm\"], y = [\"-5mm\", \"5mm\"] }\n";

/// Stacks of all kinds, by their names and how they are made from `tower.tif` and `torus.tif`.
const KINDS: [(&str, &str); 9] = [
    ("tower.tif", ""),
    ("gray.tif", "slice torus.stl --dpi 150 --thickness 500um --gray --material lamp-suspension"),
    ("dots.tif", "dither gray.tif"),
    ("ordered.tif", "dither gray.tif --method ordered"),
    ("build.tif", "tile tower.tif:3 torus.tif:2 --area 150x150mm --cell 4mm"),
    ("gray_build.tif", "tile gray.tif --copies 2 --area 150x150mm"),
    ("adaptive.tif", "slice torus.stl --dpi 100 --adaptive"),
    ("classic.tif", "lamp convert tower.tif --classic"),
    ("one.tif", "lamp convert tower.tif --layers 30"),
];

fn with_kinds() -> Scratch {
    let scratch = Scratch::with_tower_and_torus();
    for (name, line) in KINDS.iter().filter(|(_, line)| !line.is_empty()) {
        scratch.run(&format!("{line} -q -o {name}")).succeeds();
    }
    scratch
}

#[test]
fn the_tiff_comes_back_byte_for_byte() {
    let scratch = with_kinds();
    for (name, _) in KINDS {
        let packed = name.replace(".tif", ".lamp");
        scratch.run(&format!("lamp pack {name} -q -o {packed}")).succeeds_quietly();
        scratch.run(&format!("lamp convert {packed} -q -o back.tif")).succeeds_quietly();
        let file = scratch.bytes(name);
        assert!(scratch.bytes("back.tif") == file, "{name}");
        assert!(scratch.bytes(&packed).len() < file.len(), "{name}");
        scratch.run(&format!("lamp verify {packed} -q")).succeeds_quietly();
        // Pipes give the same bytes, and --level 19 the same images.
        let piped = scratch.run_on("lamp pack - -q", &file).succeeds_quietly();
        assert!(piped.stdout == scratch.bytes(&packed), "{name}");
        let line = "lamp pack - -q --level 19 | lamp convert - -q";
        assert!(scratch.run_on(line, &file).succeeds_quietly().stdout == file, "{name}");
    }
}

#[test]
fn every_command_reads_and_writes_packed_stacks() {
    let scratch = Scratch::with_tower_and_torus();
    scratch.run("lamp pack tower.tif -q -o tower.lamp").succeeds_quietly();
    let packed = scratch.bytes("tower.lamp");
    for line in [
        "fix",
        "dither",
        "tile --copies 1",
        "lamp compensate --uniform 100um",
        "lamp check --json",
        "lamp info --json",
        "lamp show --layer 40 --draw ascii",
        "lamp show --layer 75 --draw ascii",
        "lamp convert --layers 70..",
        "lamp mesh-out -o -",
        "lamp report -o -",
    ] {
        let (name, options) = match line.strip_prefix("lamp ") {
            Some(line) => {
                let (name, options) = line.split_once(' ').unwrap_or((line, ""));
                (format!("lamp {name}"), options)
            }
            None => {
                let (name, options) = line.split_once(' ').unwrap_or((line, ""));
                (name.to_owned(), options)
            }
        };
        let of_tiff = scratch.run(&format!("{name} tower.tif {options} -q"));
        let of_packed = scratch.run(&format!("{name} tower.lamp {options} -q"));
        assert_eq!(of_packed.statuses, of_tiff.statuses, "{line}: {of_packed:?}");
        // Answers have the names of their inputs.
        if !line.contains("--json") && !line.contains("report") {
            assert!(of_packed.stdout == of_tiff.stdout, "{line}: {of_packed:?}");
        }
        let piped = scratch.run_on(&format!("{name} - {options} -q"), &packed);
        assert_eq!(piped.statuses, of_tiff.statuses, "{line}: {piped:?}");
    }
    scratch.run("lamp compare tower.tif tower.lamp").succeeds();
    scratch.run("slice tower.stl --dpi 100 --thickness 1mm -q -o sliced.lamp").succeeds_quietly();
    assert!(scratch.bytes("sliced.lamp") == packed);
    scratch.run("lamp convert sliced.lamp -q -o again.lamp").succeeds_quietly();
    assert!(scratch.bytes("again.lamp") == packed);
}

#[test]
fn ranges_are_joined_to_the_packed_whole() {
    let scratch = Scratch::with_tower_and_torus();
    scratch.run("lamp pack tower.tif -q -o tower.lamp").succeeds_quietly();
    for cut in [64, 17] {
        let slice = "slice tower.stl --dpi 100 --thickness 1mm -q";
        scratch.run(&format!("{slice} --layers ..{cut} -o low.lamp")).succeeds_quietly();
        scratch.run(&format!("{slice} --layers {cut}.. -o high.lamp")).succeeds_quietly();
        scratch.run("lamp join low.lamp high.lamp -q -o all.lamp").succeeds_quietly();
        scratch.run("lamp convert all.lamp -q -o all.tif").succeeds_quietly();
        assert!(scratch.bytes("all.tif") == scratch.bytes("tower.tif"), "cut at {cut}");
        let is_whole = scratch.bytes("all.lamp") == scratch.bytes("tower.lamp");
        assert!(is_whole || cut != 64, "frames of ranges cut at key frames are those of the whole");
    }
}

#[test]
fn strips_and_edited_stacks_come_back_byte_for_byte() {
    let scratch = Scratch::with_tower_and_torus();
    scratch
        .run("tile tower.tif --area 60x60mm --strips strips --mirrors 100 --overlap 20 -q -o b.tif")
        .succeeds_quietly();
    scratch.write("edits.toml", EDITS);
    scratch.run("lamp edit tower.tif edits.toml -q -o edited.tif").succeeds_quietly();
    assert_eq!(scratch.run("lamp compare tower.tif edited.tif -q").statuses, [Some(1)]);
    for name in ["strips/strip_000.tif", "strips/strip_002.tif", "edited.tif"] {
        scratch.run(&format!("lamp pack {name} -q -o a.lamp")).succeeds_quietly();
        scratch.run("lamp convert a.lamp -q -o back.tif").succeeds_quietly();
        assert!(scratch.bytes("back.tif") == scratch.bytes(name), "{name}");
    }
    // Both commands write packed what they write as a TIFF.
    scratch.run("lamp edit tower.tif edits.toml -q -o edited.lamp").succeeds_quietly();
    scratch.run("lamp convert edited.lamp -q -o back.tif").succeeds_quietly();
    assert!(scratch.bytes("back.tif") == scratch.bytes("edited.tif"));
}

#[test]
fn libtiff_finds_no_difference() {
    let scratch = Scratch::with_tower_and_torus();
    scratch.run("lamp convert tower.tif --classic -q -o tower_classic.tif").succeeds_quietly();
    // Codes and strips of another program, which packing keeps or replaces.
    for (codes, rows) in [("g4", "400"), ("g4", "16"), ("packbits", "32")] {
        let arguments = ["-c", codes, "-r", rows, "tower_classic.tif", "theirs.tif"];
        if ask(&scratch, "tiffcp", &arguments).is_none() {
            return;
        }
        scratch.run("lamp pack theirs.tif -q -o theirs.lamp").succeeds_quietly();
        scratch.run("lamp convert theirs.lamp -q -o back.tif").succeeds_quietly();
        // Decoded and written by libtiff alone, both are the same file except for their tags.
        for (file, plain) in [("theirs.tif", "theirs_plain.tif"), ("back.tif", "back_plain.tif")] {
            ask(&scratch, "tiffcp", &["-c", "none", "-r", "400", file, plain]);
        }
        ask(&scratch, "tiffcmp", &["-t", "theirs_plain.tif", "back_plain.tif"]);
    }
}

#[test]
fn damage_is_told_in_one_sentence_and_leaves_no_file() {
    let scratch = Scratch::new();
    scratch.part("torus.stl", Sample::Torus, 2_000);
    scratch.run("slice torus.stl --dpi 100 --thickness 200um -q -o torus.lamp").succeeds_quietly();
    let bytes = scratch.bytes("torus.lamp");
    for cut in [3, 8, 20, bytes.len() / 2, bytes.len() - 1] {
        scratch.write("cut.lamp", &bytes[..cut]);
        scratch
            .run("lamp convert cut.lamp -q -o cut.tif")
            .is_refused_with(&["cut.lamp", "cut off"]);
    }
    for at in (9..bytes.len()).step_by(bytes.len() / 23) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 4;
        scratch.write("damaged.lamp", &damaged);
        scratch.run("lamp convert damaged.lamp -q -o cut.tif").is_refused_with(&["damaged.lamp"]);
        let told =
            scratch.run("lamp verify damaged.lamp -q").is_refused_with(&["not proven whole"]);
        assert!(told.stdout.starts_with(b"damaged.lamp: "), "{told:?}");
    }
    assert!(!scratch.names().contains(&"cut.tif".to_owned()));
    scratch.run("lamp pack torus.lamp -o torus.tif").is_wrong_usage(&["torus.tif", ".lamp"]);
    scratch.run("lamp pack torus.lamp -o folder/").is_wrong_usage(&["folder/", "one file"]);
    scratch.run("lamp pack torus.lamp --level 40 -o a.lamp").is_wrong_usage(&["1 to 19"]);
}

#[test]
fn tiffs_of_other_programs_become_what_convert_makes_of_them() {
    let Some(folder) = shared_data("tiff") else { return };
    let scratch = Scratch::new();
    let mut compared = 0;
    for file in fs::read_dir(&folder).expect("it can be listed") {
        let file = file.expect("it can be listed").path();
        let classic =
            if is_classic(&fs::read(&file).expect("it can be read")) { "--classic" } else { "" };
        let file = file.display();
        let line = format!("lamp convert {file} {classic} -q -o as.tif");
        if scratch.run(&line).statuses != [Some(0)] {
            continue;
        }
        scratch.run(&format!("lamp pack {file} -q -o as.lamp")).succeeds_quietly();
        scratch.run("lamp convert as.lamp -q -o back.tif").succeeds_quietly();
        assert!(scratch.bytes("back.tif") == scratch.bytes("as.tif"), "{file}");
        compared += 1;
    }
    assert!(compared > 0, "no file of {folder:?} could be read");
}

fn is_classic(file: &[u8]) -> bool {
    file.starts_with(b"II*\0") || file.starts_with(b"MM\0*")
}
