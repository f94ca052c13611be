//! Files as other programs write them, files that are no parts, and names of outputs.

use std::fs;

use lamp_tests::{Scratch, masks};

/// The corners of a box of 5 x 6 x 2 mm, and its facets, counter-clockwise seen from outside.
const CORNERS: [[f32; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [5.0, 0.0, 0.0],
    [5.0, 6.0, 0.0],
    [0.0, 6.0, 0.0],
    [0.0, 0.0, 2.0],
    [5.0, 0.0, 2.0],
    [5.0, 6.0, 2.0],
    [0.0, 6.0, 2.0],
];
const FACETS: [[usize; 3]; 12] = [
    [0, 2, 1],
    [0, 3, 2],
    [4, 5, 6],
    [4, 6, 7],
    [0, 1, 5],
    [0, 5, 4],
    [1, 2, 6],
    [1, 6, 5],
    [2, 3, 7],
    [2, 7, 6],
    [3, 0, 4],
    [3, 4, 7],
];

fn binary_stl(header: &str, count: u32) -> Vec<u8> {
    let mut bytes = header.as_bytes().to_vec();
    bytes.resize(80, 0);
    bytes.extend(count.to_le_bytes());
    for facet in FACETS {
        bytes.extend([0; 12]);
        for number in facet.iter().flat_map(|&corner| CORNERS[corner]) {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

fn ascii_stl() -> String {
    let corner = |c: usize| {
        let [x, y, z] = CORNERS[c];
        format!("      vertex {x:.6e} {y:.6e} {z:.6e}\n")
    };
    let facet = |facet: &[usize; 3]| {
        let corners: String = facet.iter().map(|&c| corner(c)).collect();
        format!("  facet normal 0 0 1\n    outer loop\n{corners}    endloop\n  endfacet\n")
    };
    let facets: String = FACETS.iter().map(facet).collect();
    format!("solid box\n{facets}endsolid box\n")
}

fn obj() -> String {
    let vertices: String = CORNERS.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    let face = |[a, b, c]: &[usize; 3]| format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    vertices + &FACETS.iter().map(face).collect::<String>()
}

fn utf16(text: &str, mark: &str) -> Vec<u8> {
    format!("{mark}{text}").encode_utf16().flat_map(u16::to_be_bytes).collect()
}

/// The box as programs write it: by the closed form, 20 layers of 50 x 60 pixels of 0.1 mm.
#[test]
fn parts_are_read_as_the_field_writes_them() {
    let scratch = Scratch::new();
    let (stl, obj) = (ascii_stl(), obj());
    let with = |bytes: Vec<u8>, more: &[u8]| [&bytes, more].concat();
    let as_bytes = |text: String| text.into_bytes();
    let notes = "are left out";
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("2 bytes after", with(binary_stl("", 12), b"\r\n"), notes),
        ("a block of zeros after", with(binary_stl("solid box", 12), &[0; 444]), notes),
        ("no count", binary_stl("", 0), "declares 0 facets"),
        ("no count yet", binary_stl("", u32::MAX), "declares 4294967295 facets"),
        ("text in a header", binary_stl("<!DOCTYPE html>", 12), ""),
        ("words apart", as_bytes(stl.replace("endloop", "end loop")), ""),
        ("no normals", as_bytes(stl.replace(" normal 0 0 1", "")), ""),
        ("one line", as_bytes(stl.replace('\n', " ")), ""),
        ("returns", as_bytes(stl.replace('\n', "\r")), ""),
        ("no end", as_bytes(stl.replace("endsolid box\n", "")), "without `endsolid`"),
        ("colors", as_bytes(stl.replace("  facet", "color 1 0 0\n  facet")), "`color`"),
        ("comments", as_bytes(stl.replace("  facet", "# a facet\n  facet")), ""),
        ("Fortran", as_bytes(stl.replace("e0", "D+00")), ""),
        ("decimal commas", as_bytes(stl.replace('.', ",")), "decimal points"),
        ("zeros after", with(as_bytes(stl.clone()), &[0; 512]), notes),
        ("Ctrl-Z", with(as_bytes(stl.clone()), b"\x1a"), "is left out"),
        ("UTF-16", utf16(&stl, "\u{feff}"), ""),
        ("UTF-16 without a mark", utf16(&stl, ""), ""),
        ("UTF-8 with a mark", as_bytes(format!("\u{feff}{stl}")), ""),
        ("OBJ, lines that go on", as_bytes(obj.replace("f 1", "f \\\n1")), ""),
        ("OBJ, comments", as_bytes(obj.replace('\n', " # end\n")), ""),
        ("OBJ, g first", as_bytes(format!("g\n{obj}")), ""),
        ("OBJ, o first", as_bytes(format!("# a\no\n{obj}")), ""),
        ("OBJ, newmtl first", as_bytes(format!("newmtl a\nKd 1 1 1\n{obj}")), ""),
        ("OBJ, an edge", as_bytes(format!("{obj}f 1 2\n")), "1 face with fewer"),
        ("OBJ, lines and points", as_bytes(format!("{obj}l 1 2 3\np 4\n")), "begins with `l`"),
        ("OBJ in UTF-16", utf16(&obj, "\u{feff}"), ""),
        ("OBJ, returns", as_bytes(obj.replace('\n', "\r")), ""),
    ];
    for (name, bytes, note) in cases {
        scratch.write("box", &bytes);
        let line = "slice box --dpi 254 --plane middle --strict -o box.tif";
        let ran = scratch.run(line).succeeds();
        assert!(ran.stderr.contains(note), "{name}: {ran:?}");
        assert_eq!(ran.stderr.is_empty(), note.is_empty(), "{name}: {ran:?}");
        let layers = scratch.layers("box.tif");
        let whites: Vec<u64> = masks(&layers).iter().map(|mask| mask.white_pixels()).collect();
        assert_eq!(whites, [3000; 20], "{name}");
    }
}

#[test]
fn every_command_that_reads_a_part_prints_its_notes() {
    let scratch = Scratch::new();
    scratch.write("box.stl", &[&binary_stl("", 12)[..], b"xy"].concat());
    scratch.write("box.obj", (obj() + "l 1 2\n").as_bytes());
    scratch.run("slice box.stl -o box.tif").succeeds();
    for line in [
        "slice {} -o x.tif",
        "lamp mesh check {}",
        "lamp mesh repair {} -o x.stl",
        "lamp heights {} --dpi 254",
        "lamp orient {} --dpi 254",
        "lamp check {} --dpi 254",
        "lamp convert {} x.step",
        "lamp cure box.tif --material lamp-suspension --part box.stl --section y=3mm -o x.png",
    ] {
        for (name, note) in [("box.stl", "2 bytes after"), ("box.obj", "begins with `l`")] {
            if line.contains("{}") || name == "box.stl" {
                let ran = scratch.run(&line.replace("{}", name));
                assert!(ran.stderr.contains(note), "{line}: {ran:?}");
            }
        }
    }
}

/// One sniffer for all commands, whether they read parts, stacks or both.
#[test]
fn files_that_are_no_parts_are_named() {
    let scratch = Scratch::new();
    let iges = format!("{:72}S{:7}\n", "a part", 1).repeat(3);
    for (bytes, format, advice) in [
        (
            b" <!-- x -->\n<!DOCTYPE html><html></html>".as_slice(),
            "a web page",
            "download the file",
        ),
        (
            b"version https://git-lfs.github.com/spec/v1\noid sha256:12\nsize 684\n",
            "a Git LFS pointer",
            "git lfs pull",
        ),
        (iges.as_bytes(), "an IGES file", "export the part as STL, STEP"),
        (b"400 0 1 0\n16 Autodesk AutoCAD 19 ASM 223.0.1.7 NT\n", "a SAT file", "export"),
        (b"**ABCDEFGHIJKLMNOPQRSTUVWXYZ\n**PART1;\n", "a Parasolid file", "export"),
        (b"glTF\x02\0\0\0\0\0\0\0", "a glTF file", "export"),
        (b"ply\nformat binary_little_endian 1.0\nend_header\n\0\x01", "a PLY file", "export"),
        (b"<?xml version=\"1.0\"?><amf unit=\"inch\"></amf>", "an AMF file", "export"),
        (b"%PDF-1.4\n%\xE2\xE3\xCF\xD3\n", "a PDF file", "export"),
        (b"7z\xBC\xAF\x27\x1C\0\x04", "a 7z archive", "unpack"),
        (b"G21\nG90\nG28\nG1 X0 Y0 F1200\n", "a G-code file", "slice the part"),
    ] {
        scratch.write("part.stl", bytes);
        for command in [
            "slice part.stl -o x.tif",
            "lamp brep part.stl",
            "lamp mesh check part.stl",
            "lamp mesh repair part.stl -o x.stl",
            "lamp convert part.stl x.step",
            "lamp convert part.stl -o x.tif",
            "lamp orient part.stl",
            "lamp heights part.stl",
            "lamp check part.stl",
            "lamp info part.stl",
            "fix part.stl -o x.tif",
            "lamp view part.stl",
        ] {
            let ran = scratch.run(command);
            ran.clone().is_refused_with(&["part.stl", format, advice]);
            assert!(!ran.stderr.contains("header declares"), "{ran:?}");
        }
        let ran = scratch.run_on("lamp info -", bytes);
        assert!(ran.stderr.contains(format), "{ran:?}");
    }
    assert_eq!(scratch.names(), ["part.stl"]);
}

#[test]
fn a_step_file_is_one_behind_comments_and_in_gzip() {
    let scratch = Scratch::new();
    scratch.run("lamp sample tower -o tower.step").succeeds();
    let step = scratch.bytes("tower.step");
    let comment = format!("\u{feff}\n/* {} */\n", "made by a program ".repeat(9));
    scratch.write("tower", &[comment.as_bytes(), &step].concat());
    scratch.run("slice tower.step --dpi 100 --thickness 5mm -o a.tif").succeeds();
    scratch.run("slice tower --dpi 100 --thickness 5mm -o b.tif").succeeds();
    assert!(masks(&scratch.layers("a.tif")) == masks(&scratch.layers("b.tif")));
    scratch.run("lamp brep tower").succeeds();
    scratch.run("lamp convert tower part.stl").succeeds();
    scratch.run("lamp convert tower -o part.tif").is_wrong_usage(&["is a STEP part"]);
    scratch.run("lamp brep part.stl").is_refused_with(&["an STL file, not a STEP file"]);
}

#[test]
fn an_ending_of_another_format_is_refused() {
    let scratch = Scratch::new();
    scratch.write("box.stl", &binary_stl("", 12));
    scratch.run("slice box.stl --dpi 254 -o box.tif").succeeds();
    let before = scratch.names();
    let others = ["photon", "cbddlp", "phz", "zip", "pdf", "obj", "gcode", "mp4", "STEPX", "3MF"];
    for (line, writes, own) in [
        ("slice box.stl -o {}", "a stack is a TIFF", "svgz"),
        ("fix box.tif -o {}", "a stack is a TIFF", "png"),
        ("dither box.tif -o {}", "a stack is a TIFF", "stl"),
        ("tile box.tif -o {}", "a stack is a TIFF", "json"),
        ("lamp convert box.tif -o {}", "a stack is a TIFF", "bmp"),
        ("lamp join box.tif box.tif -o {}", "a stack is a TIFF", "csv"),
        ("lamp edit box.tif --union box.tif -o {}", "a stack is a TIFF", "toml"),
        ("lamp pack box.tif -o {}", ".lamp", "tif"),
        ("lamp show box.tif --layer 1 -o {}", "the picture is a PNG", "tif"),
        ("lamp mesh-out box.tif -o {}", "meshes are written as STL", "step"),
        ("lamp mesh repair box.stl -o {}", "meshes are written as STL", "tif"),
        ("lamp sample cube -o {}", "a sample is an STL", "png"),
        ("lamp split box.tif --every 9 -o {}", "a folder is written", "tif"),
        ("lamp report box.tif -o {}", "a report is a web page", "png"),
        ("slice box.stl -o x.tif --report {}", "written as JSON", "csv"),
        ("slice box.stl -o y.tif --report {}", "no stack is written there", "tif"),
        ("lamp heights box.stl --csv {}", "a table is CSV", "json"),
        ("lamp heights box.stl --plot {}", "a plot is an SVG, a PNG or a table", "html"),
        ("lamp compare box.tif box.tif --picture {}", "the picture is a PNG", "svg"),
    ] {
        for ending in others.iter().filter(|ending| **ending != "STEPX").chain([&own]) {
            let name = format!("x.{ending}");
            let ran = scratch.run(&line.replace("{}", &name)).is_wrong_usage(&[&name]);
            let is_own = *ending == own;
            assert!(!is_own || ran.stderr.contains(writes), "{ran:?}");
        }
        assert_eq!(scratch.names(), before, "{line}");
    }
    // All others say nothing.
    fs::create_dir(scratch.path("here.png")).unwrap();
    for name in ["x.part", "blade.v2", "plain", "x.TIFF", "x.tf8", "pages.cbddlp/", "here.png"] {
        scratch.run(&format!("fix box.tif -o {name}")).succeeds();
        assert!(scratch.path(name).exists(), "{name}");
    }
}
