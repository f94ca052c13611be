//! Checks that `lamp split` and `lamp join` reproduce the whole stack, byte for byte.

use lamp_fixtures::Sample;
use lamp_stack::{Destination, Format, GrayMask, Layer, PageInfo, Pitch, StackError};
use lamp_tests::Scratch;

const COARSE: &str = "--dpi 100 --thickness 1mm -q";

/// A part of 76 layers with gaps in its mesh, so that `fix` has work to do. It looks at neighboring
/// layers, so ranges are joined before it.
fn with_broken_tower() -> Scratch {
    let scratch = Scratch::new();
    scratch.run("lamp sample tower --facets 5k --defect drop --count 20 -o t.stl -q").succeeds();
    scratch
}

#[test]
fn ranges_sliced_apart_join_to_the_whole() {
    let scratch = with_broken_tower();
    for (k, range) in ["..20", "20..21", "21..60", "60.."].iter().enumerate() {
        let slice = format!("slice t.stl {COARSE} --layers {range}");
        scratch.run(&format!("{slice} -o {k}.tif")).succeeds_quietly();
        scratch.run(&format!("{slice} -o pages{k}/")).succeeds_quietly();
        // A mesh depends on the layers below, which are not in these stacks.
        let tiled = format!("{slice} | dither | tile --mesh none --classic -o tiled{k}.tif");
        scratch.run(&tiled).succeeds();
    }
    let slice = format!("slice t.stl {COARSE}");
    for (joined, whole) in [
        ("lamp join 0.tif 1.tif 2.tif 3.tif", ""),
        ("lamp join 0.tif 1.tif 2.tif 3.tif --classic", "| lamp convert --classic"),
        ("lamp join pages0 pages1/ pages2 pages3", ""),
        ("lamp join tiled0.tif tiled1.tif tiled2.tif tiled3.tif", "| dither | tile --mesh none"),
        ("lamp join 0.tif 1.tif 2.tif 3.tif | fix -q | tile", "| fix -q | tile"),
    ] {
        let whole = scratch.run(&format!("{slice} {whole}")).succeeds().stdout;
        assert!(scratch.run(joined).succeeds().stdout == whole, "{joined}");
    }
    scratch.run("lamp join 0.tif 1.tif 2.tif 3.tif -o pages/").succeeds_quietly();
    let pages = scratch.run("lamp convert pages").succeeds_quietly().stdout;
    assert!(pages == scratch.run(&slice).succeeds().stdout);
}

#[test]
fn a_stage_on_ranges_of_one_stack_does_what_it_does_on_all() {
    let scratch = with_broken_tower();
    scratch.run(&format!("slice t.stl {COARSE} -o all.tif")).succeeds();
    scratch.run("fix all.tif -q --layers ..40 -o low.tif").succeeds_quietly();
    scratch.run("fix all.tif -q --layers 40.. -o high.tif").succeeds_quietly();
    let whole = scratch.run("fix all.tif -q").succeeds_quietly().stdout;
    assert!(whole != scratch.bytes("all.tif"));
    assert!(scratch.run("lamp join low.tif high.tif").succeeds_quietly().stdout == whole);
}

/// Joins a folder's files in order of name, as a shell's `folder/*.tif` does.
fn joined(scratch: &Scratch, folder: &str) -> Vec<u8> {
    let files: Vec<_> =
        scratch.names_in(folder).iter().map(|name| format!("{folder}/{name}")).collect();
    scratch.run(&format!("lamp join {}", files.join(" "))).succeeds_quietly().stdout
}

#[test]
fn what_is_split_joins_to_the_same_bytes() {
    let scratch = with_broken_tower();
    scratch.run(&format!("slice t.stl {COARSE} | fix -q -o all.tif")).succeeds_quietly();
    let all = scratch.bytes("all.tif");
    scratch.run("lamp split all.tif --every 30 -o by30/").succeeds_quietly();
    scratch.run("lamp split all.tif --at 5,6,75 -o at").succeeds_quietly();
    scratch.run_on("lamp split - --every 1000 --classic -o one/", &all).succeeds_quietly();
    let expected = ["layers_00000-00029.tif", "layers_00030-00059.tif", "layers_00060-00075.tif"];
    assert_eq!(scratch.names_in("by30"), expected);
    assert_eq!(scratch.names_in("at").len(), 4);
    assert_eq!(scratch.names_in("one"), ["layers_00000-00075.tif"]);
    assert_eq!(scratch.bytes("one/layers_00000-00075.tif")[2], 42);
    for folder in ["by30", "at", "one"] {
        assert!(joined(&scratch, folder) == all, "{folder}");
    }
    // A range that is split again still refers to the whole.
    scratch.run("lamp split all.tif --layers 10..50 --every 25 -o middle/").succeeds_quietly();
    let middle = scratch.run("lamp convert all.tif --layers 10..50").succeeds_quietly().stdout;
    assert!(joined(&scratch, "middle") == middle);
    assert_eq!(scratch.names_in("middle"), ["layers_00010-00034.tif", "layers_00035-00049.tif"]);
}

#[test]
fn each_file_of_a_split_is_a_stack_in_itself() {
    let scratch = with_broken_tower();
    scratch.run(&format!("slice t.stl {COARSE} -o all.tif")).succeeds();
    scratch.run("lamp split all.tif --at 20,21 -o parts/").succeeds_quietly();
    for (name, range) in [("00000-00019", "..20"), ("00020-00020", "20"), ("00021-00075", "21..")] {
        // The range as sliced alone.
        let line = format!("slice t.stl {COARSE} --layers {range}");
        let alone = scratch.run(&line).succeeds_quietly().stdout;
        assert!(scratch.bytes(&format!("parts/layers_{name}.tif")) == alone, "{range}");
    }
}

/// Writes gray layers without a record of their source.
fn write_plain_stack(scratch: &Scratch, name: &str, indexes: &[u32]) {
    let layers = indexes.iter().map(|&index| {
        let mut gray = GrayMask::new(64);
        gray.push_runs([(index, 0), (1, index as u8), (20, 200)]).unwrap();
        let info = PageInfo { index, ..PageInfo::default() };
        Ok::<_, StackError>(Layer { info, pitch: Pitch::of_dpi(300.0), image: gray.into() })
    });
    lamp_stack::write_stack(layers, Destination::File(scratch.path(name)), Format::Big).unwrap();
}

#[test]
fn stacks_that_say_nothing_of_themselves_split_and_join_too() {
    let scratch = Scratch::new();
    write_plain_stack(&scratch, "gray.tif", &[3, 4, 5, 6, 7]);
    scratch.run("lamp split gray.tif --every 2 -o parts/").succeeds_quietly();
    assert_eq!(scratch.names_in("parts").len(), 3);
    assert!(joined(&scratch, "parts") == scratch.bytes("gray.tif"));
    write_plain_stack(&scratch, "gap.tif", &[3, 4, 6, 7]);
    let ran = scratch.run("lamp split gap.tif --every 3 -o x/");
    ran.is_refused_with(&["split: gap.tif: ", "layer 6 follows layer 4"]);
    assert_eq!(scratch.names(), ["gap.tif", "gray.tif", "parts"]);
}

#[test]
fn stacks_that_do_not_belong_together_are_both_named() {
    let scratch = with_broken_tower();
    scratch.part("cube.stl", Sample::Cube, 64);
    for (name, line) in [
        ("low", "slice t.stl --layers 0..10 --thickness 1mm --dpi 100"),
        ("next", "slice t.stl --layers 10..20 --thickness 1mm --dpi 100"),
        ("late", "slice t.stl --layers 11..20 --thickness 1mm --dpi 100"),
        ("dpi", "slice t.stl --layers 10..20 --thickness 1mm --dpi 200"),
        ("size", "slice t.stl --layers 10..20 --thickness 1mm --dpi 100 --margin 99"),
        ("thin", "slice t.stl --layers 10..20 --thickness 2mm --dpi 100"),
        ("cube", "slice cube.stl --layers 10..20 --thickness 1mm --dpi 100"),
        ("tiled", "tile next.tif"),
        ("moved", "tile low.tif --gap 2mm"),
    ] {
        scratch.run(&format!("{line} -q -o {name}.tif")).succeeds();
    }
    // The same name, another part.
    scratch.run("lamp sample tower --facets 6k -o t.stl -q").succeeds();
    let line = "slice t.stl --layers 10..20 --thickness 1mm --dpi 100 -q -o input.tif";
    scratch.run(line).succeeds();
    write_plain_stack(&scratch, "plain.tif", &[10]);
    let before = scratch.names();
    for (names, words) in [
        ("next low", &["starts with layer 0", "ends with layer 19", "in the order"][..]),
        ("low low", &["starts with layer 0", "ends with layer 9", "each layer once"]),
        ("low late", &["starts with layer 11", "ends with layer 9", "layers 10..11"]),
        ("low dpi", &["resolution is 200 dpi, not 100 dpi"]),
        ("low size", &["size is ", " pixels, not "]),
        ("low thin", &["command line is ", "--thickness 2mm", "--thickness 1mm"]),
        ("low cube", &[r#"part is "cube", not "t""#]),
        ("low input", &["input is \"blake3:"]),
        ("low plain", &[r#"part is unknown, not "t""#]),
        ("low tiled", &["size is "]),
        ("moved tiled", &["--gap 4mm"]),
    ] {
        let files: Vec<_> = names.split(' ').map(|name| format!("{name}.tif")).collect();
        let words = [&["join: ", &files[0], &files[1]], words].concat();
        for output in ["-o x.tif", "-o x/"] {
            let ran = scratch.run(&format!("lamp join {} {output}", files.join(" ")));
            ran.is_refused_with(&words);
            assert_eq!(scratch.names(), before, "{names}");
        }
    }
    scratch.run("lamp join low.tif next.tif -o both.tif").succeeds_quietly();
    assert_eq!(scratch.layers("both.tif").len(), 20);
}
