//! Slices for printers with a panel, and reads their files by every command and by other programs.

use lamp_stack::{GrayMask, Layer, Mask, PageInfo, Pitch, PrintStep, white_in_both};
use lamp_tests::{Scratch, ask_python, masks};

/// A printer of which every format can state all but moves, of which GOO and CTB need all. Its panel is wider than the tower and
/// the torus.
const PRINTER: &str = r#"name = "mine"
description = "A printer of mine"

[area]
value = "80x60mm"
source = "measured"

[height]
value = "90mm"
source = "measured"

[panel]
pixels = [400, 300]
pitch_um = [200, 200]
mirrored = [true, false]
printer = "Mine 400"
source = "measured"
first_layers = 1
transition_layers = 2

[panel.first]
exposure_s = 30
lift_mm = [5, 0]
lift_mm_per_min = [60, 0]
retract_mm_per_min = [120, 0]
source = "measured"

[panel.normal]
exposure_s = 3
lift_mm = [5, 0]
lift_mm_per_min = [60, 0]
retract_mm_per_min = [120, 0]
source = "measured"
"#;

/// A part without symmetry, in layers of 2 mm.
const SLICE: &str = "slice torus.stl tower.stl@26,0 --thickness 2mm -q";

const ENDINGS: [&str; 6] = ["goo", "ctb", "nanodlp", "sl1", "sl1s", "uvj"];

fn with_printer() -> Scratch {
    let scratch = Scratch::with_tower_and_torus();
    scratch.write("mine.toml", PRINTER.as_bytes());
    scratch.run(&format!("{SLICE} --machine mine.toml -o part.tif")).succeeds_quietly();
    scratch
}

fn exposures(layers: &[Layer]) -> Vec<Option<f64>> {
    layers.iter().map(|layer| layer.info.exposure_ms).collect()
}

fn levels(layers: &[Layer]) -> Vec<GrayMask> {
    layers.iter().map(|layer| layer.image.to_gray().into_owned()).collect()
}

#[test]
fn a_part_lies_in_the_middle_of_the_panel() {
    let scratch = with_printer();
    scratch.run(&format!("{SLICE} --dpi 127 -o plain.tif")).succeeds_quietly();
    let [placed, plain] = ["part.tif", "plain.tif"].map(|name| scratch.layers(name));
    assert_eq!(placed.len(), plain.len());
    let (mut left, mut right, mut top, mut bottom) = (400, 0, 300, 0);
    for (placed, plain) in masks(&placed).into_iter().zip(masks(&plain)) {
        assert_eq!((placed.width(), placed.height()), (400, 300));
        assert_eq!(placed.white_pixels(), plain.white_pixels());
        for row in (0..300).filter(|row| !placed.row(*row).is_empty()) {
            (top, bottom) = (top.min(row), bottom.max(row + 1));
            left = left.min(placed.row(row)[0]);
            right = right.max(*placed.row(row).last().unwrap());
        }
    }
    assert!((left + right).abs_diff(400) <= 1, "columns {left} to {right}");
    assert!((top + bottom).abs_diff(300) <= 1, "rows {top} to {bottom}");
    // The corner is where the part's own is, less the black around it.
    let [ours, theirs] = [&placed, &plain].map(|layers| layers[0].info.origin_mm.unwrap());
    let first = |layers: &[Layer]| {
        let mask = masks(layers)[3].clone();
        let row = (0..mask.height()).find(|row| !mask.row(*row).is_empty()).unwrap();
        [f64::from(mask.row(row)[0]) * 0.2, -f64::from(row) * 0.2]
    };
    for axis in 0..2 {
        let [a, b] = [ours[axis] + first(&placed)[axis], theirs[axis] + first(&plain)[axis]];
        assert!((a - b).abs() < 1e-5, "{a} {b}");
    }
}

#[test]
fn every_format_comes_back_with_its_images_and_times() {
    let scratch = with_printer();
    let wanted = scratch.layers("part.tif");
    for ending in ENDINGS {
        let slice = format!("{SLICE} --machine mine.toml -o plate.{ending}");
        scratch.run(&slice).succeeds_quietly();
        scratch.run(&format!("lamp compare part.tif plate.{ending}")).succeeds();
        scratch.run(&format!("lamp convert plate.{ending} -q -o back.tif")).succeeds_quietly();
        let read = scratch.layers("back.tif");
        assert_eq!(masks(&read), masks(&wanted), "{ending}");
        let times = exposures(&read);
        assert_eq!(times[..4], [30_000.0, 21_000.0, 12_000.0, 3000.0].map(Some), "{ending}");
        assert!(times[4..].iter().all(|time| *time == Some(3000.0)));
        assert_eq!(read[9].info.z_um, Some(18_000.0));
        assert_eq!(read[0].pitch, Pitch::of_dpi(127.0));
        // A stack that came from a file makes the same file. Where the file has no speeds, the times of
        // moves are lost, once.
        let [mut from, mut file] = ["plate", "first"].map(str::to_owned);
        for kept in [["goo", "ctb", "uvj"].contains(&ending), true] {
            scratch.run(&format!("lamp convert {from}.{ending} -q -o back.tif")).succeeds_quietly();
            scratch.run(&format!("lamp convert back.tif -q -o {file}.{ending}")).succeeds_quietly();
            let [old, new] = [&from, &file].map(|name| scratch.bytes(&format!("{name}.{ending}")));
            assert!(!kept || old == new, "{ending}");
            [from, file] = [file, "second".to_owned()];
        }
    }
}

#[test]
fn an_option_gives_the_format_that_an_ending_does_not() {
    let scratch = with_printer();
    let formats = [
        ["tiff", "tif"],
        ["lamp", "lamp"],
        ["goo", "goo"],
        ["ctb", "ctb"],
        ["nanodlp", "nanodlp"],
        ["sl1", "sl1s"],
        ["uvj", "uvj"],
        ["svg", "svg"],
        ["cli", "cli"],
        ["dxf", "dxf"],
    ];
    for [format, ending] in formats {
        let slice = format!("{SLICE} --machine mine.toml");
        for line in ["lamp convert part.tif -q", "fix part.tif -q", &slice] {
            scratch.run(&format!("{line} -o plain.{ending}")).succeeds_quietly();
            scratch.run(&format!("{line} --format {format} -o build.v2")).succeeds_quietly();
            // An ending of the same format does not contradict.
            scratch.run(&format!("{line} --format {format} -o same.{ending}")).succeeds_quietly();
            let [plain, named, same] =
                [format!("plain.{ending}"), "build.v2".to_owned(), format!("same.{ending}")]
                    .map(|name| scratch.bytes(&name));
            assert!(plain == named && plain == same, "{line} {format}");
        }
    }
    for format in ["nanodlp", "sl1", "uvj"] {
        scratch.run(&format!("lamp convert part.tif --format {format} -q -o plate.zip")).succeeds();
        scratch.run(&format!("lamp convert part.tif -q -o plate.{format}")).succeeds();
        assert!(scratch.bytes("plate.zip") == scratch.bytes(&format!("plate.{format}")));
    }
    scratch
        .run("tile part.tif --mesh none --format uvj -q -o build --machine mine.toml")
        .succeeds();
    scratch.run("lamp convert build -q -o build.tif").succeeds();
    // A pipe takes what is written as it comes.
    let packed = scratch.run("lamp convert part.tif --format lamp").succeeds().stdout;
    scratch.write("piped", &packed);
    assert_eq!(scratch.layers("piped"), scratch.layers("part.tif"));
}

#[test]
fn a_format_that_contradicts_the_output_is_refused() {
    let scratch = with_printer();
    for (options, words) in [
        ("--format goo", &["a GOO file cannot be written to a pipe or a folder"][..]),
        ("--format uvj -o x/", &["a UVJ file cannot be written to a pipe or a folder"]),
        ("--format svg", &["a contour file (svg) cannot be written to a pipe or a folder"]),
        ("--format lamp -o x/", &["a packed stack cannot be written to a folder"]),
        ("--format goo -o x.ctb", &["x.ctb: .ctb names a CTB file", "--format goo writes a GOO"]),
        ("--format uvj -o x.tif", &["x.tif: .tif names a TIFF", "leave out --format"]),
        ("--format tiff -o x.svg", &["x.svg: .svg names a contour file (svg)"]),
        ("--format goo -o x.zip", &["x.zip: .zip names a packed file"]),
        ("--format goo -o x.png", &["x.png: .png names a PNG"]),
        ("--format goo -o x.json", &["x.json: .json names structured text"]),
        ("--format goo -o x.stl", &["--format, --classic and --machine are for stacks"]),
        ("--format goo --png -o x/", &["cannot be used with", "--png"]),
        ("--format gif -o x", &["'gif'", "nanodlp"]),
        ("-o x.zip", &["or give --format"]),
    ] {
        scratch.run(&format!("lamp convert part.tif {options}")).is_wrong_usage(words);
    }
    scratch.run("lamp pack part.tif --format goo -o x").is_wrong_usage(&["leave out --format"]);
    scratch
        .run("tile part.tif --mesh none --recipe r.json --format goo")
        .is_wrong_usage(&["--format is for a stack"]);
    scratch.run("lamp join part.tif --format lamp -o x.tif").is_wrong_usage(&[".tif names a TIFF"]);
    assert!(!scratch.names().iter().any(|name| name.starts_with('x')));
}

#[test]
fn every_command_reads_and_writes_the_files() {
    let scratch = with_printer();
    for ending in ENDINGS {
        scratch.run(&format!("lamp convert part.tif -q -o plate.{ending}")).succeeds_quietly();
        for line in ["fix", "dither", "lamp compensate --uniform 200um"] {
            let command = format!("{line} plate.{ending} -q -o out.{ending}");
            let plain = format!("{line} part.tif -q -o out.tif");
            for line in [command, plain] {
                scratch.run(&line).succeeds();
            }
            let [a, b] = [format!("out.{ending}"), "out.tif".to_owned()].map(|name| {
                scratch.run(&format!("lamp convert {name} -q -o images.tif")).succeeds_quietly();
                levels(&scratch.layers("images.tif"))
            });
            // CTB has no lowest bit.
            let kept: [u8; 256] = std::array::from_fn(|level| match (ending, level) {
                ("ctb", 0 | 1) => 0,
                ("ctb", level) => level as u8 | 1,
                (_, level) => level as u8,
            });
            let kept = |image: &GrayMask| image.with_levels(&kept);
            assert!(a == b.iter().map(kept).collect::<Vec<_>>(), "{line} {ending}");
        }
        for line in ["info", "check", "verify", "show", "report"] {
            let output = match line {
                "show" => " --layer 3 -o picture.png",
                "report" => " -o report.html",
                _ => "",
            };
            scratch.run(&format!("lamp {line} plate.{ending}{output}")).succeeds();
        }
    }
    // A pipe brings GOO files, and no archives.
    let goo = scratch.bytes("plate.goo");
    scratch.run_on("lamp convert - -q -o piped.tif", &goo).succeeds_quietly();
    assert_eq!(masks(&scratch.layers("piped.tif")), masks(&scratch.layers("part.tif")));
    let uvj = scratch.bytes("plate.uvj");
    scratch.run_on("lamp info -", &uvj).is_refused_with(&["cannot be read from a pipe"]);
}

/// Prints the white pixels of each layer of a GOO file: a decoder of its own.
const GOO_IN_PYTHON: &str = "
import struct
data = open('plate.goo', 'rb').read()
count, width, height = struct.unpack('>IHH', data[195310:195318])
at = struct.unpack('>I', data[195470:195474])[0]
for layer in range(count):
    top, exposure = struct.unpack('>ff', data[at + 6:at + 14])
    length = struct.unpack('>I', data[at + 66:at + 70])[0]
    code = data[at + 70:at + 70 + length]
    at += 70 + length + 2
    assert code[0] == 0x55 and code[-1] == 255 - sum(code[1:-1]) % 256
    k, white, pixels = 1, 0, 0
    while k < length - 1:
        first = code[k]
        assert first >> 6 in (0, 3)
        more = first >> 4 & 3
        run = int.from_bytes(code[k + 1:k + 1 + more], 'big') * 16 + first % 16
        k += 1 + more
        pixels += run
        white += run if first >> 6 == 3 else 0
    assert pixels == width * height
    print(white, round(top * 1000), round(exposure * 1000))
assert data[at:] == bytes(3) + b'\\x07\\0\\0\\0DLP\\0'
";

/// Prints the white pixels of each layer of a CTB file: a decoder of its own.
const CTB_IN_PYTHON: &str = "
import struct
data = open('plate.ctb', 'rb').read()
whole = lambda at: struct.unpack_from('<I', data, at)[0]
number = lambda at: struct.unpack_from('<f', data, at)[0]
assert whole(0) == 0x12FD0106 and whole(4) == 4
width, height, rows, count = whole(52), whole(56), whole(64), whole(68)
for layer in range(count):
    row = rows + 36 * layer
    at, length = whole(row + 12), whole(row + 16)
    code = data[at:at + length]
    k, white, pixels = 0, 0, 0
    while k < length:
        byte = code[k]
        k += 1
        run = 1
        if byte & 128:
            more = next(n for n in range(4) if not code[k] & 128 >> n)
            run = int.from_bytes(code[k:k + 1 + more], 'big') & (1 << 7 * (more + 1)) - 1
            k += 1 + more
        assert byte & 127 in (0, 127)
        pixels += run
        white += run if byte & 127 else 0
    assert pixels == width * height
    print(white, round(number(row) * 1000), round(number(row + 4) * 1000))
assert at + length == len(data)
";

/// Prints the white pixels of each image of an archive, whose names have `%d` for the number.
fn images_in_python(file: &str, names: &str, first: u32, layers: usize) -> String {
    format!(
        "
import io, zipfile
from PIL import Image
archive = zipfile.ZipFile('{file}')
assert archive.testzip() is None
for layer in range({first}, {first} + {layers}):
    image = Image.open(io.BytesIO(archive.read('{names}' % layer)))
    assert image.mode == 'L' and image.size == (400, 300)
    histogram = image.histogram()
    assert histogram[0] + histogram[255] == 400 * 300
    print(histogram[255], sum(image.crop((0, 0, 200, 300)).histogram()[255:]))
"
    )
}

#[test]
fn other_programs_see_the_same_layers() {
    let scratch = with_printer();
    for ending in ENDINGS {
        scratch.run(&format!("lamp convert part.tif -q -o plate.{ending}")).succeeds_quietly();
    }
    let layers = scratch.layers("part.tif");
    let line = |layer: &Layer| {
        let top = layer.info.z_um.unwrap() + 2000.0;
        let exposure = [30_000, 21_000, 12_000].get(layer.info.index as usize).unwrap_or(&3000);
        format!("{} {top} {exposure}\n", masks(std::slice::from_ref(layer))[0].white_pixels())
    };
    for script in [GOO_IN_PYTHON, CTB_IN_PYTHON] {
        let Some(said) = ask_python(&scratch, script) else { return };
        assert_eq!(said, layers.iter().map(line).collect::<String>());
    }
    if ask_python(&scratch, "import PIL").is_none() {
        return;
    }
    for (file, names, first) in [
        ("plate.nanodlp", "%d.png", 1),
        ("plate.sl1", "torustower%05d.png", 0),
        ("plate.uvj", "slice/%08d.png", 0),
    ] {
        let script = images_in_python(file, names, first, layers.len());
        let line = |mask: &&Mask| {
            let left = (0..300).map(|row| white_in_both(mask.row(row), &[0, 200], 400));
            let (all, left) = (mask.white_pixels(), left.sum::<u64>());
            format!("{all} {}\n", all - left)
        };
        let expected: String = masks(&layers).iter().map(line).collect();
        assert_eq!(ask_python(&scratch, &script).unwrap(), expected, "{file}");
    }
}

/// Prints the white pixels, the height in micrometers and the milliseconds of each layer in the order
/// of the G-code of an archive for Klipper.
const KLIPPER_IN_PYTHON: &str = "
import io, re, zipfile
from PIL import Image
archive = zipfile.ZipFile('plate.zip')
assert archive.testzip() is None and archive.read('.klipper') == b''
gcode, = [name for name in archive.namelist() if name.endswith('.gcode')]
z = white = 0
for line in archive.read(gcode).decode().splitlines():
    word = line.split(';')[0].split()
    if word[:1] == ['G1']:
        assert re.fullmatch('G1 Z[0-9.]+ F[0-9.]+', line)
        z = float(word[1][1:])
    elif word[:1] == ['M1451']:
        image = Image.open(io.BytesIO(archive.read(re.fullmatch('M1451 F\"(.*)\"', line)[1])))
        assert image.mode == 'L' and image.size == (400, 300)
        histogram = image.histogram()
        assert histogram[0] + histogram[255] == 400 * 300
        # The panel is mirrored left to right.
        white = histogram[255], sum(image.crop((200, 0, 400, 300)).histogram()[255:])
    elif word[:1] == ['M1400']:
        assert word[1] == 'S255'
        print(*white, round(z * 1000), word[2][1:])
";

#[test]
fn archives_for_klipper_come_back_and_others_read_them() {
    let scratch = with_printer();
    let layers = scratch.layers("part.tif");
    let slice = format!("{SLICE} --machine mine.toml --format klipper -o plate.zip");
    scratch.run(&slice).succeeds_quietly();
    scratch.run("lamp compare part.tif plate.zip").succeeds();
    scratch.run("lamp convert plate.zip -q -o back.tif").succeeds_quietly();
    let read = scratch.layers("back.tif");
    assert_eq!(masks(&read), masks(&layers));
    assert_eq!(exposures(&read)[..4], [30_000.0, 21_000.0, 12_000.0, 3000.0].map(Some));
    assert_eq!((read[9].info.z_um, read[0].pitch), (Some(18_000.0), Pitch::of_dpi(127.0)));
    // The archive keeps all that other formats have.
    scratch.run("lamp convert plate.zip --format uvj -q -o by-klipper").succeeds_quietly();
    scratch.run("lamp convert part.tif --format uvj -q -o at-once").succeeds_quietly();
    for name in ["by-klipper", "at-once"] {
        scratch.run(&format!("lamp convert {name} --format klipper -q -o {name}.zip")).succeeds();
    }
    assert!(scratch.bytes("by-klipper.zip") == scratch.bytes("at-once.zip"));
    if ask_python(&scratch, "import PIL").is_none() {
        return;
    }
    let line = |layer: &Layer| {
        let mask = &masks(std::slice::from_ref(layer))[0];
        let left = (0..300).map(|row| white_in_both(mask.row(row), &[0, 200], 400)).sum::<u64>();
        let top = layer.info.z_um.unwrap() + 2000.0;
        let exposure = [30_000, 21_000, 12_000].get(layer.info.index as usize).unwrap_or(&3000);
        format!("{} {left} {top} {exposure}\n", mask.white_pixels())
    };
    let expected: String = layers.iter().map(line).collect();
    assert_eq!(ask_python(&scratch, KLIPPER_IN_PYTHON).unwrap(), expected);
}

/// A built-in printer with pixels of 14 x 19 um: every millimeter is right, in its file and back.
#[test]
fn rectangular_pixels_keep_millimeters() {
    let scratch = Scratch::with_tower_and_torus();
    let part = "slice torus.stl tower.stl@26,0 --thickness 10mm -q";
    scratch.run(&format!("{part} --machine saturn4ultra16k -o plate.goo")).succeeds_quietly();
    scratch.run("lamp convert plate.goo -q -o plate.tif").succeeds_quietly();
    scratch.run(&format!("{part} --dpi 1500 -o square.tif")).succeeds_quietly();
    let [placed, square] = ["plate.tif", "square.tif"].map(|name| scratch.layers(name));
    assert_eq!(placed.len(), square.len());
    let pitch = placed[0].pitch.unwrap();
    assert_eq!(pitch.um(), [14.0, 19.0]);
    for (layer, square) in masks(&placed).into_iter().zip(masks(&square)) {
        assert_eq!((layer.width(), layer.height()), (15_120, 6230));
        let [mm2, expected] = [(layer, pitch.pixel_mm2()), (square, (25.4_f64 / 1500.0).powi(2))]
            .map(|(mask, pixel)| mask.white_pixels() as f64 * pixel);
        assert!((mm2 - expected).abs() < 2e-4 * expected, "{mm2} mm2, not {expected}");
    }
}

/// Every pixel lies where the difference of both sizes puts it, and times are the machine's.
#[test]
fn a_stack_of_no_printer_moves_to_a_panel() {
    let scratch = with_printer();
    for margin in [0, 1, 2, 150] {
        scratch
            .run(&format!("{SLICE} --dpi 127 --margin {margin} -o plain.tif"))
            .succeeds_quietly();
        scratch
            .run("lamp convert plain.tif --machine mine.toml -q -o moved.goo")
            .succeeds_quietly();
        scratch.run("lamp convert moved.goo -q -o moved.tif").succeeds_quietly();
        let [plain, moved] = ["plain.tif", "moved.tif"].map(|name| scratch.layers(name));
        assert_eq!(plain.len(), moved.len());
        for (plain, moved) in masks(&plain).into_iter().zip(masks(&moved)) {
            let sides = [plain.width(), plain.height()].map(f64::from);
            let [left, top] = [(400.0, sides[0]), (300.0, sides[1])]
                .map(|(panel, side)| ((panel - side) / 2.0_f64).ceil() as i64);
            assert_eq!((moved.width(), moved.height()), (400, 300));
            assert_eq!(moved.white_pixels(), plain.white_pixels());
            for row in 0..plain.height() {
                if plain.row(row).is_empty() {
                    continue;
                }
                let put: Vec<u32> =
                    plain.row(row).iter().map(|c| (i64::from(*c) + left) as u32).collect();
                assert_eq!(moved.row((i64::from(row) + top) as u32), put);
            }
        }
        let wanted = scratch.layers("part.tif");
        let times = [30_000.0, 21_000.0, 12_000.0].into_iter().chain(std::iter::repeat(3000.0));
        assert_eq!(exposures(&moved), times.take(wanted.len()).map(Some).collect::<Vec<_>>());
    }
    // The stack keeps the command, and a stack of the panel passes as it is.
    scratch.run("lamp convert plain.tif --machine mine.toml -q -o moved.tif").succeeds_quietly();
    let moved = scratch.layers("moved.tif");
    let stack = moved[0].info.stack.as_ref().unwrap();
    assert!(stack.commands.last().unwrap().starts_with("convert --machine mine.toml@blake3:"));
    scratch.run("lamp convert part.tif --machine mine.toml -q -o same.tif").succeeds_quietly();
    assert_eq!(masks(&scratch.layers("same.tif")), masks(&scratch.layers("part.tif")));
    // The corner in the part's coordinates moves with the image.
    let plain = scratch.layers("plain.tif");
    let corner = |layers: &[Layer]| {
        let mask = masks(layers)[3];
        let row = (0..mask.height()).find(|row| !mask.row(*row).is_empty()).unwrap();
        let [x, y] = layers[3].info.origin_mm.unwrap();
        [x + f64::from(mask.row(row)[0]) * 0.2, y - f64::from(row) * 0.2]
    };
    for (a, b) in corner(&plain).into_iter().zip(corner(&moved)) {
        assert!((a - b).abs() < 2e-6, "{a} {b}");
    }
}

/// Exposures that are the old printer's become the new one's; a layer's own stays.
#[test]
fn a_stack_of_another_printer_gets_the_new_ones_exposures() {
    let scratch = with_printer();
    let other = PRINTER
        .replace("Mine 400", "Other")
        .replace("exposure_s = 30", "exposure_s = 40")
        .replace("exposure_s = 3\n", "exposure_s = 10\n")
        .replace("lift_mm = [5, 0]", "lift_mm = [7, 0]");
    scratch.write("other.toml", other.as_bytes());
    scratch.run("lamp convert part.tif -q -o plate.goo").succeeds_quietly();
    scratch.run("lamp convert plate.goo -q -o read.tif").succeeds_quietly();
    let mut layers = scratch.layers("read.tif");
    layers[5].info.exposure_ms = Some(4321.0);
    layers[6].info.set_record(&PrintStep { wait_lifted_s: 9.0, ..PrintStep::default() });
    let of_before = layers[0].info.stack.as_ref().unwrap().print_record().unwrap();
    scratch.stack("own.tif", layers);
    let ran = scratch.run("lamp convert own.tif --machine other.toml -o other.tif").succeeds();
    assert!(ran.stderr.contains("1 layer with other moves than the rest"), "{}", ran.stderr);
    let read = scratch.layers("other.tif");
    let record = read[0].info.stack.as_ref().unwrap().print_record().unwrap();
    assert_eq!((record.printer.as_str(), of_before.printer.as_str()), ("Other", "Mine 400"));
    assert_eq!(record.normal.lift_mm, [7.0, 0.0]);
    let times = exposures(&read);
    let first = [40_000.0, 30_000.0, 20_000.0, 10_000.0, 10_000.0, 4321.0, 10_000.0];
    assert_eq!(times[..7], first.map(Some));
    assert!(!read[6].info.has_record::<PrintStep>());
    scratch.run("lamp convert other.tif -q -o other.goo").succeeds_quietly();
    scratch.run("lamp convert other.goo -q -o again.tif").succeeds_quietly();
    assert_eq!(exposures(&scratch.layers("again.tif"))[..7], first.map(Some));
}

/// Each level is that of its share's light, by the definition of the exponent.
#[test]
fn gray_edges_follow_the_curve_of_a_machine() {
    let scratch = with_printer();
    let gamma = "[gamma]\nvalue = 2.2\nleast_level = 60\nsource = \"measured\"\n";
    scratch.write("curved.toml", format!("{PRINTER}{gamma}").as_bytes());
    for machine in ["mine", "curved"] {
        let slice = format!("{SLICE} --antialias --machine {machine}.toml -o {machine}.tif");
        scratch.run(&slice).succeeds_quietly();
    }
    let of_share = |share: u8| {
        let level = 255.0 * (f64::from(share) / 255.0).powf(1.0 / 2.2);
        if level < 30.0 { 0 } else { level.max(60.0).round() as u8 }
    };
    let [shares, curved] = ["mine.tif", "curved.tif"].map(|name| levels(&scratch.layers(name)));
    let mut seen = [false; 256];
    assert_eq!(shares.len(), curved.len());
    for (shares, curved) in shares.iter().zip(&curved) {
        for (row, column) in (0..300).flat_map(|row| (0..400).map(move |column| (row, column))) {
            let share = shares.level(column, row);
            seen[usize::from(share)] = true;
            assert_eq!(curved.level(column, row), of_share(share), "{share}");
        }
    }
    assert!(seen.iter().filter(|seen| **seen).count() > 100);
    let gray = "--gray --material lamp-suspension --antialias";
    scratch
        .run(&format!("slice torus.stl {gray} --machine curved.toml -o out.tif"))
        .is_wrong_usage(&["the [gamma] of mine", "leave out --gray or --antialias"]);
    scratch.write("bad.toml", format!("{PRINTER}{}", gamma.replace("2.2", "0")).as_bytes());
    scratch
        .run("slice torus.stl --antialias --machine bad.toml -o out.tif")
        .is_refused_with(&["gamma: value: it must be between 0.1 and 10"]);
}

#[test]
fn what_lies_beyond_the_panel_is_refused() {
    let scratch = with_printer();
    // A dot of white at a corner of an image that is a pixel wider on each side.
    let mask_of = |column: u32| {
        let ends: Vec<u32> = [column, column + 1].into_iter().filter(|end| *end < 402).collect();
        Mask::new(402, vec![0, ends.len() as u32], ends).unwrap()
    };
    let with_dot = |column: u32, pitch: Option<Pitch>| Layer {
        info: PageInfo { thickness_um: Some(50.0), ..PageInfo::default() },
        pitch,
        image: mask_of(column).into(),
    };
    let pitch = Pitch::of_dpi(127.0);
    let convert = |column, pitch| {
        scratch.stack("dot.tif", [with_dot(column, pitch)]);
        scratch.run("lamp convert dot.tif --machine mine.toml -q -o out.goo")
    };
    for column in [1, 200, 400] {
        convert(column, pitch).succeeds_quietly();
    }
    scratch.run("lamp convert out.goo -q -o out.tif").succeeds_quietly();
    assert_eq!(masks(&scratch.layers("out.tif"))[0].row(150), [399]);
    for column in [0, 401] {
        convert(column, pitch).is_refused_with(&["layer 0", "402 x 1", "400 x 300", "mine"]);
    }
    convert(200, None).is_refused_with(&["layer 0", "does not state its resolution", "mine"]);
    convert(200, Pitch::of_dpi(300.0)).is_refused_with(&["300 dpi", "mine has 127 dpi"]);
    scratch
        .run("lamp convert part.tif --machine alpha -q -o out.tif")
        .is_wrong_usage(&["alpha has no [panel]"]);
    scratch
        .run("lamp convert torus.stl torus.step --machine mine.toml")
        .is_wrong_usage(&["--machine are for stacks"]);
}

#[test]
fn what_does_not_fit_a_printer_is_refused() {
    let scratch = with_printer();
    let slice = |more: &str| scratch.run(&format!("slice tower.stl {more} -q -o plate.goo"));
    slice("--machine saturn4ultra16k --dpi 300").is_wrong_usage(&["300 dpi", "14 x 19 um"]);
    slice("--machine mine.toml --dpi 300").is_wrong_usage(&["300 dpi", "mine", "127 dpi"]);
    slice("--machine mine.toml --margin 5").is_wrong_usage(&["--margin has no effect on mine"]);
    slice("--machine mine.toml --translate 0,2,0")
        .is_wrong_usage(&["--translate has no effect", "--size 80x60mm"]);
    slice("--dpi 14x19").is_wrong_usage(&["write 14x19um for micrometers, or 14x19dpi"]);
    scratch.write("margin.toml", format!("{PRINTER}[defaults]\nmargin = 3\n").as_bytes());
    slice("--machine margin.toml").is_refused_with(&["panel: [defaults] has a margin"]);
    let limits = "[defaults]\nthickness = \"5um\"\n[thickness]\nleast = \"10um\"\nmost = \"1mm\"\nsource = \"-\"\n";
    scratch.write("thin.toml", format!("{PRINTER}{limits}").as_bytes());
    let ran = slice("--machine thin.toml").is_refused_with(&["defaults: a layer is 5um thick"]);
    assert_eq!(ran.stderr.matches("5um thick").count(), 1, "{}", ran.stderr);
    slice("--machine mine.toml --scale 1.3").is_refused_with(&["99.1mm", "90mm"]);
    slice("--machine mine.toml --scale 4").is_refused_with(&["the part takes"]);
    slice("--dpi 100 --thickness 1mm").is_refused_with(&["does not say which printer", "[panel]"]);
    slice("--machine mine.toml --classic").is_wrong_usage(&["--classic is for TIFFs"]);
    scratch
        .run("slice torus.stl --machine mine.toml --origin -30,30 --size 60x60mm -q -o plate.goo")
        .is_refused_with(&["300 x 300 pixels", "Mine 400 has 400 x 300"]);
    assert!(!scratch.names().contains(&"plate.goo".to_owned()));
}
