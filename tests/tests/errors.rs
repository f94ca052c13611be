//! Checks errors: one sentence, a status for usage or input, no file under its final name.

use std::fs;
use std::io::Cursor;

use lamp_fixtures::Sample;
use lamp_stack::Pages;
use lamp_tests::{Ran, Scratch};

/// Makes a folder with a good part, a good stack and many kinds of bad files.
fn with_all_sorts() -> Scratch {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 64);
    scratch.run("slice cube.stl --dpi 100 --thickness 1mm -o cube.tif").succeeds();
    let stl = scratch.bytes("cube.stl");
    scratch.write("empty.stl", b"");
    scratch.write("text.stl", b"A recipe for pancakes.\n");
    scratch.write("truncated.stl", &stl[..84 + 50 * 20 + 17]);
    scratch.write("lying.stl", &with_count(&stl[..stl.len() - 7], u32::MAX));
    // With a hole, it is whole neither with 10 facets nor with all.
    scratch.write("modest.stl", &with_count(&stl[..stl.len() - 50], 10));
    scratch.write("none.stl", &with_count(&stl[..84], 0));
    scratch.write("nan.stl", &with_nan(&stl, 5));
    scratch
        .write("ascii.stl", b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0");
    fs::create_dir(scratch.path("folder")).unwrap();
    scratch.write("folder/kept", b"");
    scratch
}

/// Returns a binary STL whose header claims a wrong number of facets.
fn with_count(stl: &[u8], count: u32) -> Vec<u8> {
    [&stl[..80], &count.to_le_bytes(), &stl[84..]].concat()
}

/// Returns a binary STL with a corner that is not a number.
fn with_nan(stl: &[u8], facet: usize) -> Vec<u8> {
    let mut stl = stl.to_vec();
    let corner = 84 + 50 * facet + 12;
    stl[corner..corner + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    stl
}

/// Runs a command that must fail, and checks that the folder is unchanged.
#[track_caller]
fn fails(scratch: &Scratch, line: &str) -> Ran {
    let before = scratch.names();
    let ran = scratch.run(line);
    assert!(!ran.stderr.contains("panicked"), "{ran:?}");
    assert!(ran.stdout.is_empty(), "{line} wrote something");
    assert_eq!(scratch.names(), before, "{line}");
    ran
}

#[track_caller]
fn is_wrong_usage(scratch: &Scratch, line: &str, words: &[&str]) {
    let ran = fails(scratch, line);
    assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
    for word in words {
        assert!(ran.stderr.contains(word), "no `{word}` in {ran:?}");
    }
}

#[track_caller]
fn is_bad_input(scratch: &Scratch, line: &str, words: &[&str]) {
    let ran = fails(scratch, line).is_refused_with(words);
    let name = line.trim_start_matches("lamp ").split(' ').next().unwrap();
    assert!(ran.stderr.starts_with(&format!("error: {name}: ")), "{ran:?}");
}

#[test]
fn wrong_usage_is_status_2_and_says_what_to_write() {
    let scratch = with_all_sorts();
    for (line, words) in [
        ("slice cube.stl --frobnicate -o x.tif", &["--frobnicate"][..]),
        ("slice", &["<PART>"]),
        ("slice cube.stl --thickness 100 -o x.tif", &["`100` has no known unit", "add um"]),
        ("slice cube.stl --thickness 0um -o x.tif", &["above zero"]),
        ("slice cube.stl --thickness -1um -o x.tif", &["below zero"]),
        ("slice cube.stl --thickness thick -o x.tif", &["`thick` is not a length", "100um"]),
        ("slice cube.stl --dpi 0 -o x.tif", &["`0` is not a resolution", "1500"]),
        ("slice cube.stl --layers 7..3 -o x.tif", &["`7..3` contains no layer"]),
        ("slice cube.stl --layers a..b -o x.tif", &["not a range of layers", "A..B"]),
        ("slice cube.stl --memory lots -o x.tif", &["`lots` is not an amount of memory", "64MB"]),
        ("slice cube.stl --threads 0 -o x.tif", &["--threads"]),
        ("slice cube.stl --origin 0,0 -o x.tif", &["--size"]),
        ("slice cube.stl --origin 0 --size 3x3mm -o x.tif", &["`0` is not a point", "X,Y"]),
        ("slice cube.stl --units furlong -o x.tif", &["furlong", "inch"]),
        ("slice cube.stl --fill odd -o x.tif", &["even-odd", "solid"]),
        ("slice cube.stl --scale 0 -o x.tif", &["leave nothing"]),
        ("slice cube.stl --scale -1 -o x.tif", &["below zero", "--mirror"]),
        ("slice cube.stl --scale 1,2 -o x.tif", &["`1,2` is not a scale", "X,Y,Z"]),
        ("slice cube.stl --mirror w -o x.tif", &["w", "x, y, z"]),
        ("slice cube.stl --rotate 90 -o x.tif", &["`90` is not a rotation", "x:90"]),
        ("slice cube.stl --rotate x:inf -o x.tif", &["`x:inf` is not a rotation"]),
        ("slice cube.stl --translate -5,0 -o x.tif", &["`-5,0` is not a translation", "X,Y,Z"]),
        ("slice - cube.stl - -o x.tif", &["only once"]),
        ("tile cube.tif --area 5mm -o x.tif", &["`5mm` is not a size", "4x4.5in"]),
        ("tile cube.tif --area 0x5mm -o x.tif", &["--area"]),
        ("tile cube.tif --copies 0 -o x.tif", &["--copies"]),
        ("tile cube.tif --gap -1mm -o x.tif", &["below zero"]),
        (
            "dither cube.tif --method magic -o x.tif",
            &["magic", "blue-noise", "ordered", "floyd-steinberg", "sierra-lite", "threshold"],
        ),
        ("lamp sample teapot -o x.stl", &["teapot", "blade"]),
        ("lamp sample tower --facets 999 -o x.stl", &["at least 1000 facets, not 999"]),
        ("lamp sample tower --facets some -o x.stl", &["`some` is not a count", "750k"]),
        ("lamp sample tower --seed 5 -o x.stl", &["--defect"]),
        ("lamp show cube.tif -o x.png", &["--layer"]),
        ("lamp show cube.tif --layer 3 --zoom 2/3 -o x.png", &["`2/3` is not a scale", "1/8"]),
        ("lamp show cube.tif --layer 3 --region 1,2,3 -o x.png", &["is not a region", "X,Y,W,H"]),
        ("lamp show cube.tif --layer 3 --region 96,0,1,1 -o x.png", &["outside", "96 x 81"]),
        ("lamp show cube.tif --layer 3 --region 0,81,1,1 -o x.png", &["outside", "96 x 81"]),
        ("lamp convert cube.tif --png -o x", &["into a folder", "-o pictures/"]),
        ("lamp convert cube.tif --png", &["into a folder"]),
        ("lamp convert cube.tif --png --classic -o x/", &["--classic"]),
        ("lamp convert cube.tif --classic -o x.png", &["--classic is for TIFFs"]),
        ("fix cube.tif -o x.png", &["x.png: a stack is a TIFF", "lamp convert"]),
        (
            "lamp convert cube.tif --layers 3 -o x.jpg",
            &["a stack is a TIFF, a packed stack or a printer's file: end its name in .tif"],
        ),
        ("lamp show cube.tif --layer 3 -o x.jpg", &["a PNG: end its name in .png"]),
        (
            "lamp show cube.tif --layer five -o x.png",
            &["'five'", "'--layer <N>'", "a whole number"],
        ),
        ("lamp show cube.tif --layers 1..9/0 -o x.png", &["A..B/N", "every Nth layer"]),
        (
            "fix cube.tif --max-width=-3 -o x.tif",
            &["'-3'", "'--max-width <ROWS>'", "of at least 0"],
        ),
        ("fix cube.tif -q -v -o x.tif", &["--quiet", "--verbose"]),
        ("tile cube.tif --mesh hex -o x.tif", &["--mesh hex", "hexagon, square, none"]),
        ("tile cube.tif --wall 0um -o x.tif", &["'--wall <LENGTH>'", "above zero"]),
        ("lamp convert cube.tif --png -o /", &["name the folder"]),
        ("lamp join -o x.tif", &["<STACK>"]),
        ("lamp join cube.tif - -o x.tif", &["standard input", "name files"]),
        ("lamp split cube.tif -o x/", &["--every", "--at"]),
        ("lamp split cube.tif --every 5 --at 5 -o x/", &["--every", "--at"]),
        ("lamp split cube.tif --every 0 -o x/", &["`0` is not a number of layers"]),
        ("lamp split cube.tif --at 9,5 -o x/", &["ascending order", "--at 500,900"]),
        ("lamp split cube.tif --every 5", &["--output"]),
        ("lamp split cube.tif --every 5 -o -", &["name the folder"]),
        ("lamp frobnicate", &["frobnicate"]),
        ("lamp", &["Usage"]),
    ] {
        is_wrong_usage(&scratch, line, words);
    }
}

#[test]
fn a_part_that_cannot_be_sliced_is_named_with_what_is_wrong() {
    let scratch = with_all_sorts();
    for (name, words) in [
        ("missing.stl", &["No such file"][..]),
        ("folder", &["not a file"]),
        ("empty.stl", &["empty"]),
        ("text.stl", &["a text file, neither an STL"]),
        ("truncated.stl", &["cut off after facet 20", "export it again"]),
        ("lying.stl", &["declares 4294967295 facets", "export it again"]),
        ("modest.stl", &["declares 10 facets", "bytes follow"]),
        ("none.stl", &["no facets"]),
        ("nan.stl", &["facet 5 ", "not a finite number"]),
        ("ascii.stl", &["facet 0 ", "export the part again"]),
        ("cube.tif", &["a TIFF file, neither an STL"]),
    ] {
        let place = format!("{name}: ");
        let words = [&[place.as_str()], words].concat();
        is_bad_input(&scratch, &format!("slice {name} -o x.tif"), &words);
        is_bad_input(&scratch, &format!("slice {name} -o x/"), &words);
        // The next stage gets the error, too.
        let ran = scratch.run(&format!("slice {name}")).is_refused_with(&words);
        let told = Pages::from_stream(Cursor::new(ran.stdout)).unwrap().next().unwrap();
        let told = told.unwrap_err().to_string();
        assert!(words.iter().all(|word| told.contains(word)), "{told}");
    }
}

#[test]
fn of_several_parts_the_bad_one_is_named() {
    let scratch = with_all_sorts();
    for (parts, words) in [
        ("cube.stl missing.stl", &["slice: missing.stl: ", "No such file"][..]),
        ("cube.stl cube.stl nan.stl", &["slice: nan.stl: facet 5 ", "not a finite number"]),
        ("none.stl cube.stl", &["slice: none.stl: ", "no facets"]),
        (
            "cube.stl cube.stl cube.stl --layers 200..",
            &["slice: cube.stl and 2 more: ", "0 to 199"],
        ),
    ] {
        is_bad_input(&scratch, &format!("slice {parts} -o x.tif"), words);
    }
}

#[test]
fn a_part_that_does_not_fit_the_options_is_refused() {
    let scratch = with_all_sorts();
    for (options, words) in [
        ("--layers 200..", &["layers 200 and above were asked for", "layers 0 to 199"][..]),
        ("--origin 0,0 --size 5x5mm", &["sticks out of the frame", "-10.000 to 10.000"]),
        ("--units inch --dpi 100000 --margin 99999999", &["pixels", "--units", "--dpi"]),
        ("--thickness 0.00001um", &["layers", "--thickness"]),
        ("--translate 0,-2e9,0", &["2.000e9 mm from the origin", "--translate"]),
    ] {
        let words = [&["cube.stl: "], words].concat();
        is_bad_input(&scratch, &format!("slice cube.stl {options} -o x.tif"), &words);
    }
}

#[test]
fn a_stack_that_cannot_be_read_is_named_with_what_is_wrong() {
    let scratch = with_all_sorts();
    let stages = [
        "fix",
        "dither",
        "tile",
        "lamp info",
        "lamp show --layer 0",
        "lamp convert",
        "lamp join cube.tif",
        "lamp split --every 5",
    ];
    for (name, words) in [
        ("missing.tif", &["No such file"][..]),
        ("folder", &["holds no page: no .tif, no .png"]),
        ("cube.stl", &["neither a TIFF stack nor a picture", "slice it first"]),
        ("text.stl", &["neither a TIFF stack nor a picture"]),
        ("empty.stl", &["empty"]),
    ] {
        let place = format!("{name}: ");
        let words = [&[place.as_str()], words].concat();
        for stage in stages {
            let output = match stage {
                "lamp info" => "",
                "lamp show --layer 0" => "-o x.png",
                "lamp split --every 5" => "-o x/",
                _ => "-o x.tif",
            };
            is_bad_input(&scratch, &format!("{stage} {name} {output}"), &words);
        }
    }
}

#[test]
fn a_stack_that_does_not_fit_the_options_is_refused() {
    let scratch = with_all_sorts();
    for (line, words) in [
        ("tile cube.tif --area 20x20mm -o x.tif", &["96 x 81", "78 x 78", "--area"][..]),
        ("tile cube.tif --copies 21 --mesh none -o x.tif", &["only 20 fit", "101.6x114.3mm"]),
        ("fix cube.tif --layers 20.. -o x.tif", &["layer"]),
        ("fix cube.tif --layers 20.. -o x/", &["layer"]),
        ("lamp info cube.tif --layers 20..", &["no layer is in that range"]),
        ("lamp convert cube.tif --layers 20.. --png -o x/", &["no layer is in that range"]),
        ("lamp split cube.tif --at 20 -o x/", &["start with layer 20", "layers 0 to 19"]),
        ("lamp split cube.tif --at 0,5 -o x/", &["start with layer 0"]),
        ("lamp show cube.tif --layer 20 -o x.png", &["no layer 20", "the last is 19"]),
    ] {
        let words = [&["cube.tif: "], words].concat();
        is_bad_input(&scratch, line, &words);
    }
}

/// A name that would color a terminal and forge a second line.
#[test]
fn names_of_files_cannot_steer_the_terminal() {
    let scratch = with_all_sorts();
    let name = "\u{1b}[31mred\nfix: all is well.tif";
    let escaped = r"\u{1b}[31mred\nfix: all is well.tif";
    for (command, options) in [("fix", &[][..]), ("lamp", &["info"]), ("slice", &["--dpi"])] {
        let ran = scratch.command(command).args(options).arg(name).output().unwrap();
        let said = String::from_utf8(ran.stderr).unwrap();
        assert!(!ran.status.success() && !said.contains('\u{1b}'), "{said:?}");
        assert!(!said.lines().any(|line| line.starts_with("fix: all is well")), "{said:?}");
        let is_usage = ran.status.code() == Some(2);
        assert!(is_usage || said.contains(escaped), "{said:?}");
    }
    scratch.write(name, &scratch.bytes("cube.tif"));
    let ran = scratch.command("lamp").args(["info", name]).output().unwrap();
    let said = String::from_utf8(ran.stdout).unwrap();
    assert!(ran.status.success() && !said.contains('\u{1b}'), "{said:?}");
}

#[test]
fn an_output_that_cannot_be_written_is_named() {
    let scratch = with_all_sorts();
    for line in [
        "slice cube.stl -o no/x.tif",
        "slice cube.stl -o no/x/",
        "fix cube.tif -o no/x.tif",
        "tile cube.tif -o no/x.tif",
        "lamp sample cube -o no/x.stl",
        "lamp show cube.tif --layer 3 -o no/x.png",
        "lamp convert cube.tif --layers 3 -o no/x.png",
        "lamp convert cube.tif --png -o no/x/",
        "lamp join cube.tif -o no/x.tif",
        "lamp split cube.tif --every 5 -o no/x/",
    ] {
        is_bad_input(&scratch, line, &["no/x", "there is no folder no"]);
    }
    for line in [
        "slice cube.stl -o folder",
        "fix cube.tif -o folder/",
        "dither cube.tif -o folder",
        "lamp convert cube.tif --png -o folder",
        "lamp split cube.tif --every 5 -o folder",
    ] {
        is_bad_input(&scratch, line, &["folder", "--force replaces a folder"]);
    }
    // A file cannot be replaced by a folder.
    is_bad_input(&scratch, "fix cube.tif -o cube.stl/", &["cube.stl"]);
    let kept: Vec<_> = fs::read_dir(scratch.path("folder")).unwrap().collect();
    assert_eq!(kept.len(), 1);
}

#[test]
fn a_failure_leaves_the_file_that_was_there() {
    let scratch = with_all_sorts();
    scratch.write("x.tif", b"precious");
    for line in
        ["slice nan.stl -o x.tif", "fix text.stl -o x.tif", "tile cube.tif --copies 99 -o x.tif"]
    {
        assert_eq!(fails(&scratch, line).statuses, [Some(1)]);
        assert_eq!(scratch.bytes("x.tif"), b"precious", "{line}");
    }
    scratch.run("fix cube.tif -o x.tif").succeeds_quietly();
    assert_eq!(scratch.bytes("x.tif"), scratch.bytes("cube.tif"));
}

#[test]
fn a_stack_may_replace_the_file_it_is_read_from() {
    let scratch = with_all_sorts();
    let before = scratch.layers("cube.tif");
    scratch.run("fix cube.tif -o cube.tif").succeeds_quietly();
    assert!(scratch.layers("cube.tif") == before);
}

#[test]
fn help_and_version_are_no_errors() {
    let scratch = Scratch::new();
    for name in
        ["lamp", "slice", "fix", "dither", "tile", "lamp convert", "lamp join", "lamp split"]
    {
        let help = scratch.run(&format!("{name} --help")).succeeds_quietly();
        let help = String::from_utf8(help.stdout).unwrap();
        let example = if name == "lamp" { "slice blade.stl | fix" } else { "Examples:" };
        assert!(help.contains(example) && help.contains("--quiet"), "{help}");
        if name.contains(' ') {
            continue;
        }
        let version = scratch.run(&format!("{name} -V")).succeeds_quietly();
        let version = String::from_utf8(version.stdout).unwrap();
        assert!(version.trim().ends_with(env!("CARGO_PKG_VERSION")), "{version}");
    }
}

#[test]
fn quiet_silences_all_but_errors() {
    let scratch = Scratch::new();
    scratch
        .run("lamp sample tower --facets 5k --defect drop --quiet -o broken.stl")
        .succeeds_quietly();
    let line = "slice broken.stl --dpi 100 --thickness 1mm";
    assert!(scratch.run(&format!("{line} | fix")).succeeds().stderr.contains("do not balance"));
    scratch.run(&format!("{line} --quiet | fix -q")).succeeds_quietly();
    scratch.run("slice missing.stl --quiet").is_refused_with(&["missing.stl"]);
}
