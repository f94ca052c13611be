//! Runs the fuzz targets on seeds, damaged seeds and other programs' files, and checks the seeds.
//!
//! After an intended change,
//! `LAMP_BLESS=1 cargo test -p lamp-tests hostile::`
//! rewrites the seeds in `fuzz/seeds`.

use std::fs;
use std::path::PathBuf;

use lamp_fixtures::SplitMix;
use lamp_tests::hostile::{self, Seed, classic_tiff, damage, seeds};
use lamp_tests::{note, read_stack, shared_data, workspace_root};

/// The number of damaged seeds for each target.
const MUTATIONS: u64 = 3000;

fn seeds_of(target: &str) -> Vec<Seed> {
    seeds().into_iter().filter(|seed| seed.target == target).collect()
}

/// Runs a target on its seeds, whole, truncated and damaged.
fn survives(target: &str, entry: fn(&[u8])) {
    let seeds = seeds_of(target);
    for Seed { bytes, .. } in &seeds {
        entry(bytes);
        let cuts = (0..bytes.len().min(160)).chain((160..bytes.len()).step_by(97));
        cuts.for_each(|end| entry(&bytes[..end]));
    }
    // Preparing a part takes milliseconds, and arrays of cells take seconds.
    let mutations =
        if matches!(target, "step" | "contours") { mutations() / 10 } else { mutations() };
    for number in 0..mutations {
        let mut numbers = SplitMix(number);
        let mut bytes = seeds[numbers.below(seeds.len())].bytes.clone();
        (0..=numbers.below(4)).for_each(|_| damage(&mut bytes, &mut numbers));
        entry(&bytes);
    }
}

/// Returns the number of damaged seeds, which `LAMP_MUTATIONS` in the environment raises.
fn mutations() -> u64 {
    let asked = std::env::var("LAMP_MUTATIONS");
    asked.map_or(MUTATIONS, |number| number.parse().expect("LAMP_MUTATIONS is a number"))
}

#[test]
fn no_stl_makes_the_slicer_panic_or_contradict_itself() {
    survives("stl", hostile::stl);
}

#[test]
fn no_obj_makes_the_slicer_panic_or_contradict_itself() {
    survives("obj", hostile::obj);
}

#[test]
fn no_contours_make_the_slicer_panic_or_contradict_itself() {
    survives("contours", hostile::contours);
}

#[test]
fn no_3mf_makes_the_slicer_panic_or_contradict_itself() {
    survives("three_mf", hostile::three_mf);
}

#[test]
fn no_step_makes_the_slicer_panic_or_leave_a_row_open() {
    survives("step", hostile::step);
}

#[test]
fn no_tiff_makes_the_reader_panic_or_contradict_itself() {
    survives("tiff", hostile::tiff);
}

#[test]
fn no_packed_stack_makes_the_reader_panic_or_contradict_itself() {
    survives("packed", hostile::packed);
}

#[test]
fn no_printer_s_file_makes_a_reader_panic_or_contradict_itself() {
    survives("printer", hostile::printer);
}

#[test]
fn no_codes_make_the_codec_panic_or_contradict_itself() {
    survives("g4", hostile::g4);
}

#[test]
fn no_stack_makes_a_check_panic_or_depend_on_where_its_rows_begin() {
    survives("check", hostile::check);
}

#[test]
fn no_facets_make_a_mesh_check_panic_or_a_repair_change_what_is_whole() {
    survives("mesh", hostile::facets);
}

#[test]
fn no_frames_and_no_job_make_their_readers_panic_or_contradict_themselves() {
    survives("scan", hostile::scan);
}

#[test]
fn no_table_of_variants_makes_its_reader_panic_or_contradict_itself() {
    survives("variants", hostile::variants);
}

#[test]
fn files_by_other_programs_hold_no_surprise() {
    for (kind, entry) in [("stl", hostile::stl as fn(&[u8])), ("tiff", hostile::tiff)] {
        let Some(folder) = shared_data(kind) else {
            note(&format!("there is no ../shared/data/{kind}: skipped"));
            continue;
        };
        for file in fs::read_dir(folder).unwrap() {
            entry(&fs::read(file.unwrap().path()).unwrap());
        }
    }
}

/// A directory that names a text many times costs it once, as with libtiff.
#[test]
fn the_first_entry_of_a_tag_counts() {
    let fields = [(256, 8), (256, 9), (257, 2), (257, 1), (262, 1)];
    let layer = &read_stack(classic_tiff(&fields, &[0xFF; 2]))[0];
    assert_eq!((layer.image.width(), layer.image.height()), (8, 2));
}

fn folder_of_seeds() -> PathBuf {
    workspace_root().join("fuzz/seeds")
}

#[test]
fn the_seeds_are_what_the_fixtures_make() {
    let bless = std::env::var("LAMP_BLESS").is_ok_and(|value| value == "1");
    let root = folder_of_seeds();
    if bless {
        // Outdated seeds are removed with the rest.
        drop(fs::remove_dir_all(&root));
    }
    let mut names = Vec::new();
    for seed in seeds() {
        let path = root.join(seed.target).join(seed.name);
        if bless {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, &seed.bytes).unwrap();
        }
        let same = fs::read(&path).is_ok_and(|bytes| bytes == seed.bytes);
        assert!(
            same,
            "{} is not what the fixtures make: LAMP_BLESS=1 cargo test -p lamp-tests hostile:: rewrites it",
            path.display()
        );
        names.push(path);
    }
    for target in fs::read_dir(&root).unwrap() {
        for file in fs::read_dir(target.unwrap().path()).unwrap() {
            let path = file.unwrap().path();
            assert!(names.contains(&path), "nothing makes {} any more: remove it", path.display());
        }
    }
}
