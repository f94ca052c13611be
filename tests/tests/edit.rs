//! Checks that `lamp edit` adds shapes, labels and other stacks, and records them on the pages.

use lamp_fixtures::Sample;
use lamp_stack::{Image, Layer, Mask};
use lamp_tests::{Scratch, mask, masks, workspace_root, write_gray_ramp};

/// Slices the 20 mm cube about zero, with its 10 mm hole, at 254 dpi: a pixel is 100 um.
fn with_cube() -> Scratch {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 2000);
    scratch.run("slice cube.stl --dpi 254 --thickness 500um -o cube.tif").succeeds_quietly();
    scratch
}

/// Returns whether a layer is white at a point of the part, in millimeters.
fn white_at(layer: &Layer, [x, y]: [f64; 2]) -> bool {
    let [x0, y1] = layer.info.origin_mm.unwrap();
    mask(layer).is_white(((x - x0) * 10.0) as u32, ((y1 - y) * 10.0) as u32)
}

fn bytes_of_pages(layers: &[Layer]) -> Vec<(&Image, u32)> {
    layers.iter().map(|layer| (&*layer.image, layer.info.index)).collect()
}

#[test]
fn the_example_of_the_documentation_does_what_it_says() {
    let docs = std::fs::read_to_string(workspace_root().join("docs/edit.md")).unwrap();
    let (_, from) = docs.split_once("```toml\n").unwrap();
    let (example, _) = from.split_once("```").unwrap();
    let scratch = with_cube();
    scratch.write("edits.toml", example.as_bytes());
    scratch.run("lamp edit cube.tif edits.toml -o out.tif").succeeds_quietly();
    let (before, after) = (scratch.layers("cube.tif"), scratch.layers("out.tif"));
    assert_eq!(after.len(), before.len());
    // Rotation by 90 degrees takes x, y to -y, x.
    let white = |index: usize, [x, y]: [f64; 2]| white_at(&after[index], [-y, x]);
    for (index, place, is) in [
        (0, [-7.5, 7.0], false), // in the pocket
        (9, [-7.5, 7.0], false),
        (10, [-7.5, 7.0], true),  // above it
        (28, [7.5, 2.0], false),  // in the bore: z 14.0 to 14.5
        (23, [7.5, 2.0], true),   // below it
        (21, [-8.6, 0.0], false), // in the film-cooling hole: z 10.5 to 11.0
        (18, [-8.6, 0.0], true),  // below it
        (26, [-8.6, 0.0], true),  // above it
        (39, [0.0, 0.0], true),   // the pin
        (39, [3.0, 3.0], false),  // the hole, above the rib
        (1, [3.0, 3.0], true),    // the rib
        (1, [3.0, -3.0], false),  // the hole
    ] {
        assert_eq!(white(index, place), is, "layer {index} at {place:?}");
    }
    // The numbers are in the lowest layer only.
    let lost = |index: usize, y: [f64; 2]| {
        let rows = (0..20).map(|k| y[0] + (y[1] - y[0]) * f64::from(k) / 20.0);
        rows.flat_map(|y| (0..100).map(move |k| [f64::from(k) / 10.0 - 1.0, y]))
            .filter(|place| !white(index, *place))
            .count()
    };
    for y in [[-9.0, -6.6], [6.6, 8.9]] {
        assert!(lost(0, y) > 200, "{}", lost(0, y));
        assert_eq!(lost(1, y), 0);
    }
    let stack = after[0].info.stack.as_ref().unwrap();
    assert!(stack.commands[1].starts_with(r#"edit [{"box":{"x":["-9mm","-6mm"]"#), "{stack:?}");
    assert_eq!(stack.digest, before[0].info.stack.as_ref().unwrap().digest);
    let (was, is) = (mask(&before[0]), mask(&after[0]));
    assert_eq!((is.width(), is.height()), (was.height() + 20, was.width() + 20));
}

#[test]
fn layers_that_no_edit_is_for_pass_byte_for_byte() {
    let scratch = with_cube();
    scratch.write("one.toml", b"[[edit]]\nz = [\"5mm\", \"5.5mm\"]\nbox = { x = [\"-1mm\", \"1mm\"], y = [\"-1mm\", \"1mm\"] }\n");
    scratch.run("lamp edit cube.tif one.toml -o files/").succeeds_quietly();
    scratch.run("lamp convert cube.tif -o same/").succeeds_quietly();
    let names = scratch.names_in("files");
    assert_eq!(names.len(), 40);
    let differ = names.iter().filter(|name| {
        let [a, b] = ["files", "same"].map(|folder| scratch.bytes(&format!("{folder}/{name}")));
        a != b
    });
    let mut differ: Vec<_> = differ.collect();
    differ.sort();
    // The first page records the edit, the eleventh is edited, and the last checks all.
    let (before, after) = (scratch.layers("cube.tif"), scratch.layers("files/"));
    assert_eq!(differ.len(), 3, "{differ:?}");
    assert_eq!(bytes_of_pages(&before)[..10], bytes_of_pages(&after)[..10]);
    assert_eq!(mask(&after[10]).white_pixels(), mask(&before[10]).white_pixels() + 400);
}

#[test]
fn damage_is_found_on_pages_that_pass_and_on_those_that_change() {
    let scratch = with_cube();
    scratch.write("one.toml", b"[[edit]]\nlayers = [20, 21]\nbox = { x = [\"-1mm\", \"1mm\"], y = [\"-1mm\", \"1mm\"] }\n");
    let whole = scratch.bytes("cube.tif");
    let line = |layer: u32| {
        let text = format!("{{\"layer\":{layer},");
        whole.windows(text.len()).position(|window| window == text.as_bytes()).unwrap()
    };
    // The strip stands between a line and the next directory.
    let damaged = |layer: u32| {
        let text_end = line(layer) + whole[line(layer)..].iter().position(|&b| b == 0).unwrap();
        let mut bytes = whole.clone();
        bytes[text_end + 40] ^= 0x10;
        bytes
    };
    scratch.write("edited.tif", &damaged(20));
    scratch.write("passed.tif", &damaged(10));
    for (stack, layer) in [("edited.tif", "layer 20"), ("passed.tif", "layer 10")] {
        let place = format!("{stack}: {layer}");
        for (command, edits) in [("lamp edit", "one.toml"), ("fix", ""), ("dither", "")] {
            for output in ["out.tif", "out.lamp", "packbits.tif --packbits"] {
                scratch
                    .run(&format!("{command} {stack} {edits} -o {output}"))
                    .is_refused_with(&[&place]);
                assert!(!scratch.path(output.split(' ').next().unwrap()).exists());
            }
        }
    }
}

#[test]
fn two_stacks_are_combined() {
    let scratch = with_cube();
    let square = "[[edit]]\nop = \"intersect\"\nz = [\"0mm\", \"10mm\"]\nbox = { x = [\"-20mm\", \"0mm\"], y = [\"-20mm\", \"20mm\"] }\n";
    scratch.write("left.toml", square.as_bytes());
    scratch.run("lamp edit cube.tif left.toml -o left.tif").succeeds_quietly();
    scratch.run("lamp edit cube.tif --difference left.tif -o right.tif").succeeds_quietly();
    scratch.run("lamp edit left.tif --union right.tif -o whole.tif").succeeds_quietly();
    scratch.run("lamp edit left.tif --intersect right.tif -o none.tif").succeeds_quietly();
    scratch.run("lamp edit cube.tif --xor cube.tif -o nothing.tif").succeeds_quietly();
    let white =
        |name: &str| scratch.layers(name).iter().map(|l| mask(l).white_pixels()).sum::<u64>();
    assert_eq!(
        bytes_of_pages(&scratch.layers("whole.tif")),
        bytes_of_pages(&scratch.layers("cube.tif"))
    );
    assert_eq!((white("none.tif"), white("nothing.tif")), (0, 0));
    // Below 10 mm the right half remains, above nothing.
    assert_eq!(white("right.tif") * 4, white("cube.tif"));
    let page = &scratch.layers("whole.tif")[0].info;
    let commands = &page.stack.as_ref().unwrap().commands;
    let other = &commands.last().unwrap()[..];
    assert!(
        other.contains(r#""op":"union""#) && other.contains("edit [") && other.contains("blake3:"),
        "{other}"
    );
    assert!(!other.contains("right.tif"), "{other}");
}

#[test]
fn every_copy_of_a_build_has_its_number_as_if_it_was_edited_before() {
    let scratch = with_cube();
    let label = |start: u32, copies: &str| {
        format!(
            "[[edit]]\nop = \"subtract\"\nz = [\"0mm\", \"1mm\"]\n{copies}\
             label = {{ text = \"{{n:03}}\", start = {start}, at = [[\"-9mm\", \"-9mm\"]], height = \"3mm\" }}\n"
        )
    };
    scratch.write("all.toml", label(8, "copies = true\n").as_bytes());
    let line =
        "tile cube.tif --mesh none --area 70x50mm --copies 6 | lamp edit - all.toml > build.tif";
    scratch.run(line).succeeds_quietly();
    let build = scratch.layers("build.tif");
    let tile = &build[0].info.stack.as_ref().unwrap().other["tile"];
    for k in 0..6 {
        scratch.write("one.toml", label(8 + k, "").as_bytes());
        scratch.run("lamp edit cube.tif one.toml -o one.tif").succeeds_quietly();
        let part = scratch.layers("one.tif");
        let place = &tile["copies"][k as usize];
        let frame = lamp_stack::Frame {
            left: place[0].as_i64().unwrap(),
            top: place[1].as_i64().unwrap(),
            width: part[0].image.width(),
            height: part[0].image.height(),
        };
        let cut: Vec<Mask> = build.iter().map(|layer| mask(layer).framed(frame)).collect();
        assert!(cut.iter().eq(part.iter().map(mask)), "copy {k}");
    }
}

#[test]
fn copies_have_the_serial_numbers_of_a_list() {
    let scratch = with_cube();
    let label = |keys: &str, text: &str| {
        format!(
            "[[edit]]\nop = \"subtract\"\nz = [\"0mm\", \"1mm\"]\n{keys}\n[edit.label]\n\
             text = \"{text}\"\nat = [[\"-9mm\", \"-9mm\"]]\nheight = \"2mm\"\n"
        )
    };
    let list = |copies: &str, column: &str| {
        format!("{}list = \"art/serials.csv\"\n{column}", label(copies, "#{list}"))
    };
    scratch.run("tile cube.tif --mesh none --area 70x50mm --copies 6 -o build.tif").succeeds();
    let build = scratch.layers("build.tif");
    let tile = &build[0].info.stack.as_ref().unwrap().other["tile"];
    let serials = ["A7", "B, 8", "C9", "D\"1", "E22", "F3"];
    let written = serials.map(|serial| {
        scratch
            .write("one.toml", label("", &format!("#{}", serial.replace('"', "\\\""))).as_bytes());
        scratch.run("lamp edit cube.tif one.toml -o one.tif").succeeds_quietly();
        scratch.layers("one.tif")
    });
    let cut = |layer: &Layer, k: usize| {
        let place = &tile["copies"][k];
        let part = &written[k][0].image;
        mask(layer).framed(lamp_stack::Frame {
            left: place[0].as_i64().unwrap(),
            top: place[1].as_i64().unwrap(),
            width: part.width(),
            height: part.height(),
        })
    };
    std::fs::create_dir(scratch.path("art")).unwrap();
    let whole = "A7\r\n\"B, 8\"\r\n C9\r\n\"D\"\"1\"\r\nE22\r\nF3\r\n\r\n";
    scratch.write("art/serials.csv", format!("\u{feff}{whole}").as_bytes());
    for (copies, chosen) in [("true", vec![0, 1, 2, 3, 4, 5]), ("[4, 2]", vec![1, 3])] {
        scratch.write("all.toml", list(&format!("copies = {copies}"), "").as_bytes());
        scratch.run("lamp edit build.tif all.toml -o out.tif").succeeds_quietly();
        for (after, before) in scratch.layers("out.tif").iter().zip(&build) {
            let index = after.info.index as usize;
            for (k, part) in written.iter().enumerate() {
                let as_written = mask(&part[index]);
                let expected = if chosen.contains(&k) { as_written } else { &cut(before, k) };
                assert_eq!(&cut(after, k), expected, "{copies}, copy {k}, layer {index}");
            }
        }
    }
    let out = scratch.layers("out.tif");
    let told = out[0].info.stack.as_ref().unwrap().commands.last().unwrap();
    assert!(told.contains(r#""list":{"name":"serials.csv","digest":"blake3:"#), "{told}");
    // Rows that name the copy are in any order.
    let named = "Copy,SN,by\n4,\"D\"\"1\",me\n2,\"B, 8\",you\n";
    scratch.write("art/serials.csv", named.as_bytes());
    scratch.write("two.toml", list("copies = [2, 4]", "column = \"SN\"\n").as_bytes());
    scratch.run("lamp edit build.tif two.toml -o two.tif").succeeds_quietly();
    assert_eq!(masks(&scratch.layers("two.tif")), masks(&out));
    // In the whole image, rows are for places.
    scratch.write("art/serials.csv", b"A7\n");
    scratch.write("one.toml", list("", "").as_bytes());
    scratch.run("lamp edit cube.tif one.toml -o one.tif").succeeds_quietly();
    assert_eq!(masks(&scratch.layers("one.tif")), masks(&written[0]));
    scratch.write("all.toml", list("copies = true", "").as_bytes());
    for (list, words) in [
        ("A\nB\n", &["all.toml", "art/serials.csv: line 2: the list ends, but copy 3 of 6"][..]),
        ("A\nB\nC\nD\nE\nF\nG\n", &["art/serials.csv: line 7: there is no copy 7"]),
        (
            "A\nB\nA\nD\nE\nF\n",
            &["all.toml", "edit 1", "art/serials.csv: line 3: A is also on line 1"],
        ),
    ] {
        scratch.write("art/serials.csv", list.as_bytes());
        scratch.run("lamp edit build.tif all.toml -o no.tif").is_refused_with(words);
    }
    scratch.write("art/serials.csv", whole.as_bytes());
    let ran = scratch.run("lamp edit build.tif all.toml -o art/serials.csv");
    assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
    scratch.write("art/serials.csv", &[0xff, 0xfe, b'A', 0]);
    scratch
        .run("lamp edit build.tif all.toml -o no.tif")
        .is_refused_with(&["art/serials.csv", "UTF-8"]);
    assert!(!scratch.path("no.tif").exists());
}

#[test]
fn a_chosen_copy_is_as_if_its_part_was_edited_before() {
    let scratch = with_cube();
    let notch = "op = \"subtract\"\nz = [\"2mm\", \"4mm\"]\n\
                 box = { x = [\"6mm\", \"9.5mm\"], y = [\"7mm\", \"8.2mm\"] }\n";
    scratch.write("part.toml", format!("[[edit]]\n{notch}").as_bytes());
    scratch.write("copy.toml", format!("[[edit]]\ncopies = [2]\n{notch}").as_bytes());
    scratch.run("lamp edit cube.tif part.toml -o notched.tif").succeeds_quietly();
    let build = |name: &str, second: &str| {
        let copy = |part: &str, place: &str| format!("{{\"part\": \"{part}\", {place}}}");
        let copies = [
            copy("cube.tif", "\"x_mm\": 1, \"y_mm\": 2"),
            copy(second, "\"x_mm\": 27, \"y_mm\": 3, \"turn\": 90, \"mirror\": true"),
            copy("cube.tif", "\"x_mm\": 3, \"y_mm\": 27, \"turn\": 180"),
        ];
        let text = format!("{{\"area_mm\": [60, 50], \"copies\": [{}]}}", copies.join(","));
        scratch.write("layout.json", text.as_bytes());
        let parts = if second == "cube.tif" { second } else { "cube.tif notched.tif" };
        scratch
            .run(&format!("tile {parts} --layout layout.json --mesh none -o {name}"))
            .succeeds_quietly();
        scratch.layers(name)
    };
    let expected = build("expected.tif", "notched.tif");
    let plain = build("build.tif", "cube.tif");
    scratch.run("lamp edit build.tif copy.toml -o after.tif").succeeds_quietly();
    let after = scratch.layers("after.tif");
    assert_eq!(masks(&after), masks(&expected));
    let changed = |(a, b): (&&Mask, &&Mask)| a != b;
    assert_eq!(masks(&after).iter().zip(&masks(&plain)).filter(|&pair| changed(pair)).count(), 4);
    scratch.run("lamp verify after.tif").succeeds();
    scratch.write("none.toml", format!("[[edit]]\ncopies = [1, 4]\n{notch}").as_bytes());
    scratch.run("lamp edit build.tif none.toml -o x.tif").is_refused_with(&[
        "build.tif",
        "no copy 4",
        "cube have the numbers 1 to 3",
    ]);
}

#[test]
fn stray_rows_move_with_the_image_or_stop_it() {
    let scratch = Scratch::new();
    scratch.run("lamp sample cube --facets 2000 --defect drop --seed 3 -o cube.stl").succeeds();
    scratch.run("slice cube.stl --dpi 254 --thickness 500um -o cube.tif").succeeds();
    let before = scratch.layers("cube.tif");
    let stray = before.iter().position(|layer| !layer.info.stray_rows.is_empty()).unwrap();
    scratch.write("pad.toml", b"[[edit]]\npad = { top = \"1mm\" }\n[[edit]]\nmirror = \"y\"\n");
    scratch.run("lamp edit cube.tif pad.toml -o out.tif").succeeds_quietly();
    let after = scratch.layers("out.tif");
    let height = before[0].image.height();
    let moved: Vec<u32> =
        before[stray].info.stray_rows.iter().rev().map(|row| height - 1 - row).collect();
    assert_eq!(after[stray].info.stray_rows, moved);
    for row in moved {
        assert_eq!(mask(&after[stray]).row(row), mask(&before[stray]).row(height - 1 - row));
    }
    scratch.write("turn.toml", b"[[edit]]\nrotate = 270\n");
    scratch
        .run("lamp edit cube.tif turn.toml -o out.tif")
        .is_refused_with(&["layer", "fix the stack first"]);
    scratch.run("fix cube.tif --max-width 1000 --min-confidence 0 -o fixed.tif").succeeds();
    scratch.run("lamp edit fixed.tif turn.toml -o out.tif").succeeds_quietly();
}

#[test]
fn gray_pages_are_edited_and_foreign_ones_have_their_corner_at_zero() {
    let scratch = Scratch::new();
    write_gray_ramp(&scratch.path("ramp.tif"), 256, 100);
    scratch.write("box.toml", b"[[edit]]\nop = \"subtract\"\nlayers = [0, 1]\nbox = { x = [\"0in\", \"1in\"], y = [\"0in\", \"0.5in\"] }\n");
    scratch.run("lamp edit ramp.tif box.toml -o out.tif").succeeds_quietly();
    let (before, after) = (&scratch.layers("ramp.tif")[0], &scratch.layers("out.tif")[0]);
    let (Image::Gray(before), Image::Gray(after)) = (&*before.image, &*after.image) else {
        panic!("gray")
    };
    assert_eq!(after.row(49), before.row(49));
    assert_eq!((after.row(50)[0].column, after.row(50)[0].level), (100, 100));
    scratch.write("gone.toml", b"[[edit]]\nz = [\"0mm\", \"1mm\"]\nbox = { x = [\"0in\", \"1in\"], y = [\"0in\", \"1in\"] }\n");
    scratch
        .run("lamp edit ramp.tif gone.toml -o out.tif")
        .is_refused_with(&["ramp.tif", "layers ="]);
}

#[test]
fn what_is_wrong_is_said_with_the_edit_and_the_key() {
    let scratch = with_cube();
    let before = ["bad.toml", "cube.stl", "cube.tif"];
    for (list, words) in [
        (
            "[[edit]]\nrotate = 90\n[[edit]]\nrotat = 90\n",
            &["bad.toml", "line 4", "edit 2", "`rotat`"][..],
        ),
        (
            "[[edit]]\nbox = { x = [\"1\", \"2mm\"], y = [\"1mm\", \"2mm\"] }\n",
            &["edit 1, box.x", "unit"],
        ),
        ("rotate = 90\n", &["bad.toml", "`rotate`"]),
        ("", &["bad.toml", "[[edit]]"]),
        ("[[edit]", &["bad.toml", "line 1", "TOML"]),
        (
            "[[edit]]\nbox = { x = [\"1km\", \"2km\"], y = [\"1mm\", \"2mm\"] }\n",
            &["edit 1, box.x"],
        ),
        (
            "[[edit]]\nbox = { x = [\"30mm\", \"40mm\"], y = [\"1mm\", \"2mm\"] }\n",
            &["bad.toml", "edit 1", "no pixel"],
        ),
        (
            "[[edit]]\nlabel = { text = \"\u{3a9}\", at = [[\"0mm\", \"0mm\"]], height = \"1mm\" }\n",
            &["edit 1", "\u{3a9}", "ASCII"],
        ),
        (
            "[[edit]]\nlabel = { text = \"SN {n}\", start = 17, at = [[\"5mm\", \"0mm\"]], height = \"3mm\" }\n",
            &["edit 1", "`SN 17` reaches outside", "x -10."],
        ),
        (
            "[[edit]]\nlabel = { text = \"{m}\", at = [[\"0mm\", \"0mm\"]], height = \"1mm\" }\n",
            &["edit 1", "`{m}`", "{n:04}"],
        ),
        (
            "[[edit]]\ncopies = true\nbox = { x = [\"1mm\", \"2mm\"], y = [\"1mm\", \"2mm\"] }\n",
            &["cube.tif", "tile"],
        ),
        ("[[edit]]\nstack = { file = \"none.tif\" }\n", &["none.tif"]),
    ] {
        scratch.write("bad.toml", list.as_bytes());
        scratch.run("lamp edit cube.tif bad.toml -o out.tif").is_refused_with(words);
        assert_eq!(scratch.names(), before);
    }
    scratch.write("high.toml", b"[[edit]]\nz = [\"1in\", \"2in\"]\nbox = { x = [\"1mm\", \"2mm\"], y = [\"1mm\", \"2mm\"] }\n");
    let said = scratch.run("lamp edit cube.tif high.toml -o out.tif").succeeds().stderr;
    assert!(said.contains("edit 1 applies to no layer"), "{said}");
}

/// Returns the TOML examples of the manual's section.
fn examples_of(heading: &str) -> String {
    let docs = std::fs::read_to_string(workspace_root().join("docs/edit.md")).unwrap();
    let (_, section) = docs.split_once(&format!("\n## {heading}\n")).unwrap();
    let section = section.split("\n## ").next().unwrap();
    let blocks = section.split("```toml\n").skip(1);
    blocks.map(|block| block.split("```").next().unwrap()).collect()
}

#[test]
fn the_examples_of_lofts_and_film_holes_drill_the_cube() {
    let scratch = with_cube();
    scratch.write("loft.toml", examples_of("Lofts").as_bytes());
    scratch.write("film.toml", examples_of("Film-cooling holes").as_bytes());
    scratch.run("lamp edit cube.tif loft.toml -o loft.tif").succeeds_quietly();
    scratch.run("lamp edit cube.tif film.toml -o film.tif").succeeds_quietly();
    let (loft, film) = (scratch.layers("loft.tif"), scratch.layers("film.tif"));
    // The loft begins 1 mm wide at x = -8, z = 4, where the cube's hole is not.
    for (y, is) in [(0.0, false), (0.4, false), (0.6, true)] {
        assert_eq!(white_at(&loft[8], [-7.95, y]), is, "{y}");
    }
    // Each axis of the row leaves the side x = 10 at its z: 3 mm, 5.4 mm and so on to 15 mm.
    let open = |z: f64| !white_at(&film[(z / 0.5) as usize], [9.95, 0.0]);
    for k in 0..6 {
        assert!(open(3.0 + 2.4 * f64::from(k)), "{k}");
    }
    assert!(!open(1.0) && !open(17.4));
}

#[test]
fn a_table_makes_a_stack_or_a_list_of_each_row() {
    let scratch = with_cube();
    let list = "[[edit]]\nop = \"subtract\"\nz = [\"0mm\", \"1mm\"]\n\
                box = { x = [\"6mm\", \"7mm\"], y = [\"-1mm\", \"1mm\"] }\n";
    scratch.write("edits.toml", list.as_bytes());
    scratch.write(
        "table.csv",
        b"name,1.box.x,1.z.2\nwide,\"[\"\"6mm\"\", \"\"8mm\"\"]\",\nhigh,,4mm\n",
    );
    let run = "lamp edit cube.tif edits.toml --variants table.csv";
    scratch.run(&format!("{run} --report n-{{name}}.json -o v-{{name}}.tif")).succeeds_quietly();
    scratch.run(&format!("{run} -o v-{{name}}.toml")).succeeds_quietly();
    let before = scratch.layers("cube.tif");
    for (name, layers, pixels) in [("wide", 2, 400), ("high", 8, 200)] {
        let after = scratch.layers(&format!("v-{name}.tif"));
        let lost = |k: usize| mask(&before[k]).white_pixels() - mask(&after[k]).white_pixels();
        let expected = |k: usize| if k < layers { pixels } else { 0 };
        assert!((0..40).all(|k| lost(k) == expected(k)), "{name}");
        let report = scratch.bytes(&format!("n-{name}.json"));
        let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
        assert_eq!(report["pixels_changed"], layers as u64 * pixels);
        let counts =
            serde_json::json!([{ "edit": 1, "layers": layers, "pixels": layers as u64 * pixels }]);
        assert_eq!((&report["schema"], &report["edits"]), (&"lamp-edit-1".into(), &counts));
        // The list alone makes the same stack.
        scratch.run(&format!("lamp edit cube.tif v-{name}.toml -o again.tif")).succeeds_quietly();
        assert_eq!(scratch.bytes("again.tif"), scratch.bytes(&format!("v-{name}.tif")));
    }
    let names = scratch.names();
    scratch.write("bad.csv", b"1.box.z\n3mm\n");
    let bad = "lamp edit cube.tif edits.toml --variants bad.csv -o w-{name}.tif";
    scratch.run(bad).is_refused_with(&["bad.csv", "`1.box.z`"]);
    scratch.run(&format!("{run} -o one.tif")).is_wrong_usage(&["{name}", "-o"]);
    scratch
        .run(&format!("{run} --report one.json -o w-{{name}}.tif"))
        .is_wrong_usage(&["--report"]);
    scratch
        .run("lamp edit - edits.toml --variants table.csv -o w-{name}.tif")
        .is_wrong_usage(&["name files"]);
    assert_eq!(scratch.names().len(), names.len() + 1);
}

#[test]
fn a_fault_of_a_list_names_the_list() {
    let scratch = with_cube();
    let crop = "[[edit]]\ncrop = { x = [\"90mm\", \"91mm\"], y = [\"0mm\", \"1mm\"] }\n";
    scratch.write("crop.toml", crop.as_bytes());
    let ran = scratch.run("lamp edit cube.tif crop.toml -o x.tif");
    ran.clone().is_refused_with(&["crop.toml: edit 1: nothing is left"]);
    assert!(!ran.stderr.contains("cube.tif"), "{ran:?}");
    // Without a list, the stack is at fault.
    scratch.part("torus.stl", Sample::Torus, 800);
    scratch.run("slice torus.stl --dpi 50 -o torus.tif").succeeds_quietly();
    scratch.run("lamp edit cube.tif --xor torus.tif -o x.tif").is_refused_with(&["cube.tif: "]);
    scratch.write("table.csv", b"1.crop.z\n1mm\n");
    scratch
        .run("lamp edit cube.tif crop.toml --variants table.csv -o v-{name}.tif")
        .is_refused_with(&["table.csv", "write a key that the edit lacks into the list first"]);
}

#[test]
fn an_edit_that_changes_no_pixel_gets_a_warning() {
    let scratch = with_cube();
    // In the cube's own hole.
    let list =
        "[[edit]]\nop = \"subtract\"\ncylinder = { at = [\"0mm\", \"0mm\"], diameter = \"4mm\" }\n";
    scratch.write("none.toml", list.as_bytes());
    let said = scratch.run("lamp edit cube.tif none.toml -v -o out.tif").succeeds().stderr;
    assert!(said.contains("warning: edit: edit 1 changes no pixel"), "{said}");
    assert!(said.contains("edit 1: 0 pixels changed in 40 layers"), "{said}");
    scratch.write("some.toml", list.replace("subtract", "add").as_bytes());
    let ran = scratch.run("lamp edit cube.tif some.toml --json -o out.tif").succeeds_quietly();
    let [before, after] = ["cube.tif", "out.tif"].map(|name| scratch.layers(name));
    let pixels: u64 = before
        .iter()
        .zip(&after)
        .map(|(before, after)| mask(after).white_pixels() - mask(before).white_pixels())
        .sum();
    let report: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
    assert_eq!(report["edits"][0]["pixels"], pixels);
    assert!(pixels > 40 * 1200);
}

#[test]
fn an_edit_that_changes_nothing_is_a_finding_with_strict() {
    let scratch = with_cube();
    let list = |z: &str, diameter: &str| {
        format!(
            "[[edit]]\nop = \"subtract\"\nz = [\"0mm\", \"5mm\"]\n\
             cylinder = {{ at = [\"0mm\", \"0mm\"], diameter = \"14mm\" }}\n\n\
             [[edit]]\nop = \"subtract\"\nz = [{z}]\n\
             cylinder = {{ at = [\"0mm\", \"0mm\"], diameter = \"{diameter}\" }}\n"
        )
    };
    // Above the cube, and in its own hole.
    let cases = [
        (list("\"30mm\", \"40mm\"", "14mm"), "edit 2 applies to no layer", 0),
        (list("\"5mm\", \"10mm\"", "4mm"), "edit 2 changes no pixel", 10),
    ];
    for (list, says, layers) in cases {
        scratch.write("none.toml", list.as_bytes());
        let line = "lamp edit cube.tif none.toml --strict --report edit.json -o out.tif --force";
        let ran = scratch.run(line);
        assert!(ran.statuses == [Some(3)] && ran.stderr.contains(says), "{ran:?}");
        assert!(!ran.stderr.contains("edit 1") && !ran.stderr.contains("warning"), "{ran:?}");
        assert!(!scratch.path("out.tif").exists());
        let report: serde_json::Value =
            serde_json::from_slice(&std::fs::read(scratch.path("edit.json")).unwrap()).unwrap();
        assert_eq!(report["edits"][1]["layers"], layers);
        assert_eq!(report["edits"][1]["pixels"], 0);
        assert!(report["edits"][0]["pixels"].as_u64().unwrap() > 0);
        let ran = scratch.run("lamp edit cube.tif none.toml --strict | lamp convert - -o out.tif");
        assert!(ran.statuses[0] == Some(3) && ran.statuses[1] != Some(0), "{ran:?}");
        assert!(!scratch.path("out.tif").exists());
    }
    let list = list("\"5mm\", \"10mm\"", "14mm");
    scratch.write("some.toml", list.as_bytes());
    scratch.run("lamp edit cube.tif some.toml --strict -o out.tif").succeeds_quietly();
}

/// A PBM of a plus sign, in which 1 is black, and a BMP of the same in 256 levels of gray.
fn plus_signs() -> (Vec<u8>, Vec<u8>) {
    let is_white = |column: u32, row: u32| column == 1 || row == 1;
    let bits = (0..9).map(|k| if is_white(k % 3, k / 3) { '0' } else { '1' });
    let pbm = format!("P1\n3 3\n{}\n", bits.collect::<String>()).into_bytes();
    let mut bmp = b"BM".to_vec();
    let words = |bmp: &mut Vec<u8>, words: &[u32]| {
        words.iter().for_each(|word| bmp.extend(word.to_le_bytes()));
    };
    words(&mut bmp, &[54 + 1024 + 12, 0, 54 + 1024]);
    words(&mut bmp, &[40, 3, 3, 1 | 8 << 16, 0, 12, 0, 0, 256, 0]);
    words(&mut bmp, &(0..256).map(|level| level * 0x01_01_01).collect::<Vec<_>>());
    for row in 0..3 {
        bmp.extend((0..3).map(|column| if is_white(column, row) { 128 } else { 127 }));
        bmp.push(0);
    }
    (pbm, bmp)
}

#[test]
fn a_picture_is_stamped_and_recorded_without_its_folder() {
    let scratch = with_cube();
    let (pbm, bmp) = plus_signs();
    std::fs::create_dir(scratch.path("art")).unwrap();
    scratch.write("art/plus.pbm", &pbm);
    scratch.write("art/plus.bmp", &bmp);
    let list = |file: &str, more: &str| {
        format!(
            "[[edit]]\nop = \"subtract\"\nz = [\"0mm\", \"1mm\"]\n\
             picture = {{ file = \"{file}\", at = [\"7mm\", \"5mm\"]{more} }}\n"
        )
    };
    let before = scratch.layers("cube.tif");
    for (file, bytes) in [("plus.pbm", &pbm), ("plus.bmp", &bmp)] {
        let wide = list(file, ", width = \"2.4mm\", align = \"center\"");
        scratch.write("art/stamp.toml", wide.as_bytes());
        scratch.run("lamp edit cube.tif art/stamp.toml -o out.tif").succeeds_quietly();
        let after = scratch.layers("out.tif");
        // Pixels of 0.8 mm, x 5.8 to 8.2 and y 5 to 7.4.
        for (place, is) in [
            ([6.2, 5.4], true),
            ([7.0, 5.1], false),
            ([5.9, 6.2], false),
            ([7.7, 6.7], true),
            ([7.7, 6.5], false),
            ([7.3, 7.3], false),
            ([7.3, 7.5], true),
        ] {
            assert_eq!(white_at(&after[1], place), is, "{file} at {place:?}");
        }
        let white = |layers: &[Layer], k: usize| mask(&layers[k]).white_pixels();
        assert_eq!(white(&after, 0) + 5 * 64, white(&before, 0));
        assert_eq!(white(&after, 2), white(&before, 2));
        let command = after[0].info.stack.as_ref().unwrap().commands.last().unwrap().clone();
        let digest = lamp_stack::digest_of(&bytes[..]).unwrap();
        let told = format!(r#""file":{{"name":"{file}","digest":"{digest}"}}"#);
        assert!(command.contains(&told) && !command.contains("art"), "{command}");
    }
    // By default a pixel is a pixel.
    scratch.write("art/stamp.toml", list("plus.bmp", "").as_bytes());
    scratch.run("lamp edit cube.tif art/stamp.toml -o out.tif").succeeds_quietly();
    let after = scratch.layers("out.tif");
    assert_eq!(mask(&after[0]).white_pixels() + 5, mask(&before[0]).white_pixels());
    // Gray pages are stamped, too; their corner is at zero.
    write_gray_ramp(&scratch.path("ramp.tif"), 256, 100);
    let gray = list("plus.bmp", "").replace("z = [\"0mm\", \"1mm\"]", "layers = [0, 1]");
    scratch.write("art/stamp.toml", gray.replace("7mm\", \"5mm", "1in\", \"0in").as_bytes());
    scratch.run("lamp edit ramp.tif art/stamp.toml -o out.tif").succeeds_quietly();
    let Image::Gray(stamped) = &*scratch.layers("out.tif")[0].image else { panic!("gray") };
    let level = |column: u32, row: u32| stamped.level(column, row);
    assert_eq!([100, 101, 102].map(|column| level(column, 97)), [100, 0, 102]);
    assert_eq!([100, 101, 102].map(|column| level(column, 98)), [0, 0, 0]);
    for (file, more, words) in [
        ("none.bmp", "", &["none.bmp", "No such file"][..]),
        ("stamp.toml", "", &["stamp.toml"]),
        ("../cube.tif", "", &["edit 1", "cube.tif has several pages"]),
        ("plus.bmp", ", width = \"0mm\"", &["edit 1, picture.width", "above zero"]),
        ("plus.bmp", ", width = \"9mm\"", &["edit 1: plus.bmp reaches outside", "x -10."]),
    ] {
        scratch.write("art/stamp.toml", list(file, more).as_bytes());
        scratch.run("lamp edit cube.tif art/stamp.toml -o bad.tif").is_refused_with(words);
    }
    scratch.write("art/stamp.toml", list("plus.bmp", "").as_bytes());
    let ran = scratch.run("lamp edit cube.tif art/stamp.toml -o art/plus.bmp");
    assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
}

#[test]
fn wrong_usage_is_status_2() {
    let scratch = with_cube();
    for line in [
        "lamp edit cube.tif",
        "lamp edit cube.tif --union cube.tif --xor cube.tif",
        "lamp edit cube.tif edits.toml --xor cube.tif",
        "lamp edit - --xor -",
        "lamp edit cube.tif --xor cube.tif -o ./cube.tif",
    ] {
        let ran = scratch.run(line);
        assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
    }
}

#[test]
fn a_build_keeps_what_is_not_in_its_copies() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 64);
    scratch.part("torus.stl", Sample::Torus, 800);
    for part in ["cube", "torus"] {
        let line = format!("slice {part}.stl --dpi 100 --thickness 1mm -o {part}.tif");
        scratch.run(&line).succeeds_quietly();
    }
    scratch.run("tile cube.tif --copies 2 -o build.tif").succeeds_quietly();
    // An edit of all heights does not change the layers of mesh.
    let rib =
        "[[edit]]\ncopies = true\nbox = { x = [\"-2mm\", \"2mm\"], y = [\"-1mm\", \"1mm\"] }\n";
    scratch.write("rib.toml", rib.as_bytes());
    scratch.run("lamp edit build.tif rib.toml -o ribbed.tif").succeeds_quietly();
    let (before, after) = (scratch.layers("build.tif"), scratch.layers("ribbed.tif"));
    assert_eq!(masks(&before)[..5], masks(&after)[..5]);
    assert!(masks(&before)[5..].iter().zip(&masks(&after)[5..]).all(|(a, b)| a != b));
    scratch.write("only.toml", rib.replace("copies", "op = \"intersect\"\ncopies").as_bytes());
    scratch.run("lamp edit build.tif only.toml -o x.tif").is_refused_with(&["intersect", "tile"]);
    // Nothing is lost outside the image.
    scratch
        .run("lamp edit cube.tif --union torus.tif -o x.tif")
        .is_refused_with(&["beyond its image", "pad"]);
    // Without metadata in the stack, the build still records the copies' places.
    let mut plain = scratch.layers("cube.tif");
    plain[0].info.stack = None;
    scratch.stack("plain.tif", plain);
    scratch.run("tile plain.tif --copies 2 -o build.tif").succeeds_quietly();
    let build = scratch.layers("build.tif");
    let stack = build[0].info.stack.as_ref().unwrap();
    assert_eq!(stack.other["tile"]["copies"].as_array().unwrap().len(), 2);
    assert_eq!(stack.part, "plain");
}
