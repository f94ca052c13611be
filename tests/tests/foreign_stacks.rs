//! Checks that every kind of TIFF and picture that libtiff, Pillow and the image crate write is
//! read with the same pixels.

use std::fs;

use image::RgbImage;
use lamp_fixtures::Sample;
use lamp_stack::{
    Destination, Format, GrayMask, Image, Layer, MaskBuilder, PageInfo, Pitch, StackError,
    write_stack,
};
use lamp_tests::{Packed, Scratch, ask, ask_python, packed};

/// A generator of reproducible pseudo-random numbers.
struct Dice(u64);

impl Dice {
    /// Returns a number below `limit`.
    fn below(&mut self, limit: u32) -> u32 {
        self.0 = self.0.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
        ((self.0 >> 33) % u64::from(limit)) as u32
    }
}

/// Widths near the widths of bytes, words, tiles and the longest code.
const WIDTHS: [u32; 16] = [1, 7, 8, 9, 31, 32, 33, 63, 64, 65, 239, 240, 241, 2559, 2560, 2561];

/// Returns rows that differ as much as possible, then rows like those above them.
fn mask(width: u32, dice: &mut Dice) -> Image {
    let alternating: Vec<u32> = (0..width).collect();
    let mut rows = vec![vec![], vec![0], alternating[1..].to_vec(), alternating, vec![width - 1]];
    for _ in 0..30 {
        let mut row = if dice.below(3) == 0 { vec![] } else { rows[rows.len() - 1].clone() };
        for column in &mut row {
            *column = (*column + dice.below(7)).saturating_sub(3).min(width - 1);
        }
        row.extend((0..dice.below(4)).map(|_| dice.below(width)));
        row.sort_unstable();
        row.dedup();
        rows.push(row);
    }
    let mut mask = MaskBuilder::new(width);
    for row in rows {
        mask.push_row(&row).unwrap();
    }
    Image::Mask(mask.finish())
}

/// Returns rows of long runs, ramps and noise.
fn gray(width: u32, dice: &mut Dice) -> Image {
    let mut gray = GrayMask::new(width);
    for row in 0..35 {
        let mut level = 0;
        let kind = row % 4;
        let pixel = |_| {
            level = match kind {
                0 => dice.below(256) as u8,
                1 => level.wrapping_add(3),
                _ if dice.below(20) == 0 => dice.below(256) as u8,
                _ => level,
            };
            (1, level)
        };
        gray.push_runs((0..width).map(pixel)).unwrap();
    }
    Image::Gray(gray)
}

/// Writes a stack of such images, and returns its layers.
fn stack(scratch: &Scratch, name: &str, image: fn(u32, &mut Dice) -> Image) -> Vec<Layer> {
    let mut dice = Dice(7);
    let layers: Vec<Layer> = (0..)
        .zip(WIDTHS)
        .map(|(index, width)| Layer {
            info: PageInfo { index, thickness_um: Some(100.0), ..PageInfo::default() },
            pitch: Pitch::of_dpi(300.0),
            image: image(width, &mut dice).into(),
        })
        .collect();
    let pages = layers.iter().cloned().map(Ok::<_, StackError>);
    write_stack(pages, Destination::File(scratch.path(name)), Format::Classic).unwrap();
    layers
}

const LAYOUTS: [&str; 7] = [
    "-r 1000",
    "-r 1",
    "-r 7 -f lsb2msb",
    "-t -w 16 -l 16",
    "-t -w 32 -l 16 -B",
    "-t -w 240 -l 32 -8",
    "-t -w 4096 -l 48 -f lsb2msb",
];

/// Writes the stack with libtiff in all the given ways, and reads each.
fn libtiff_writes(compressions: &[&str], image: fn(u32, &mut Dice) -> Image) {
    let scratch = Scratch::new();
    let layers = stack(&scratch, "ours.tif", image);
    for compression in compressions {
        for layout in LAYOUTS {
            let options = format!("-c {compression} {layout} ours.tif theirs.tif");
            let options: Vec<&str> = options.split(' ').collect();
            if ask(&scratch, "tiffcp", &options).is_none() {
                return;
            }
            let read = scratch.layers("theirs.tif");
            assert_eq!(read.len(), layers.len(), "tiffcp {options:?}");
            for (read, layer) in read.iter().zip(&layers) {
                assert!(read == layer, "{}, tiffcp {options:?}", layer.info.name());
            }
        }
    }
}

#[test]
fn masks_that_libtiff_writes_are_read() {
    let group3 = ["g3:1d", "g3:2d", "g3:1d:fill", "g3:2d:fill"];
    libtiff_writes(&[&group3[..], &["g4", "lzw", "zip", "packbits", "none"]].concat(), mask);
}

#[test]
fn gray_pages_that_libtiff_writes_are_read() {
    libtiff_writes(&["lzw", "lzw:2", "zip", "zip:2", "packbits", "none"], gray);
}

/// Runs a script that writes images and prints the name, size, mode and hexadecimal bytes of
/// each; checks that LAMP reads the same.
fn python_writes(scratch: &Scratch, script: &str) {
    let script = format!(
        "from PIL import Image, ImageSequence, ImageOps, TiffImagePlugin\n\
         def tell(name, *images):\n    \
             for image in images: print(name, *image.size, image.mode, image.tobytes().hex())\n\
         pages = lambda name: [p.copy() for p in ImageSequence.Iterator(Image.open(name))]\n\
         {script}"
    );
    let Some(told) = ask_python(scratch, &script) else { return };
    let mut last = "";
    let mut layers = Vec::new().into_iter();
    for line in told.lines() {
        let [name, width, height, mode, hex] =
            line.split(' ').collect::<Vec<_>>().try_into().unwrap();
        if name != last {
            assert!(layers.next().is_none(), "{last} has more pages than were written");
            layers = scratch.layers(name).into_iter();
            last = name;
        }
        let layer: Layer = layers.next().unwrap_or_else(|| panic!("{name} lacks a page"));
        let size = format!("{width} {height}");
        assert_eq!(format!("{} {}", layer.image.width(), layer.image.height()), size, "{name}");
        assert_eq!(mode == "1", matches!(*layer.image, Image::Mask(_)), "{name}");
        assert!(packed(&layer.image) == rows_of_hex(hex, height), "{name}, {size}");
    }
    assert!(!last.is_empty(), "the script tells something");
}

fn rows_of_hex(hex: &str, height: &str) -> Packed {
    let bytes: Vec<u8> = hex
        .as_bytes()
        .chunks(2)
        .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap())
        .collect();
    let height: usize = height.parse().unwrap();
    bytes.chunks(bytes.len() / height).map(<[u8]>::to_vec).collect()
}

#[test]
fn tiffs_that_pillow_writes_are_read() {
    let scratch = Scratch::new();
    stack(&scratch, "masks.tif", mask);
    stack(&scratch, "grays.tif", gray);
    let script = r#"
for source, compressions in (
    ("masks", ["tiff_ccitt", "group3", "group4", "tiff_lzw", "tiff_adobe_deflate", "packbits", None]),
    ("grays", ["tiff_lzw", "tiff_adobe_deflate", "tiff_deflate", "packbits", None]),
):
    images = pages(source + ".tif")
    for compression in compressions:
        name = f"{source}_{compression}.tif"
        images[0].save(name, compression=compression, save_all=True, append_images=images[1:])
        tell(name, *images)
"#;
    python_writes(&scratch, script);
}

#[test]
fn pages_stored_on_their_side_are_turned_as_pillow_turns_them() {
    let scratch = Scratch::new();
    stack(&scratch, "masks.tif", mask);
    stack(&scratch, "grays.tif", gray);
    let script = r#"
for source, compression in ("masks", "group4"), ("grays", "tiff_lzw"):
    for orientation in range(1, 9):
        for k, image in enumerate(pages(source + ".tif")):
            name = f"{source}_{orientation}_{k}.tif"
            image.save(name, compression=compression, tiffinfo={274: orientation})
            image.getexif()[274] = orientation
            assert Image.open(name).tag_v2[274] == orientation
            tell(name, ImageOps.exif_transpose(image))
"#;
    python_writes(&scratch, script);
}

#[test]
fn info_names_the_compression() {
    let scratch = Scratch::new();
    stack(&scratch, "masks.tif", mask);
    for (compression, words) in [
        ("g3:1d", "bytes, CCITT Group 3\n"),
        ("g3:2d", "bytes, CCITT Group 3, two-dimensional\n"),
        ("lzw", "bytes, LZW\n"),
        ("zip", "bytes, Deflate\n"),
        ("none", "bytes, uncompressed\n"),
    ] {
        if ask(&scratch, "tiffcp", &["-c", compression, "masks.tif", "theirs.tif"]).is_none() {
            return;
        }
        let said = scratch.run("lamp info theirs.tif").succeeds_quietly().stdout;
        let said = String::from_utf8(said).unwrap();
        assert!(said.contains(words), "{said}");
    }
}

#[test]
fn stages_read_pngs_from_files_folders_and_pipes() {
    let scratch = Scratch::new();
    stack(&scratch, "masks.tif", mask);
    fs::create_dir(scratch.path("pngs")).unwrap();
    for layer in 0..3 {
        let show = format!("lamp show masks.tif --layer {layer} -o pngs/{layer}.png");
        scratch.run(&show).succeeds_quietly();
    }
    let images = |name: &str| -> Vec<Image> {
        scratch.layers(name).into_iter().map(|layer| layer.image.into_image()).collect()
    };
    scratch.run("dither pngs -o all.tif").succeeds_quietly();
    assert_eq!(images("all.tif"), images("masks.tif")[..3]);
    scratch.run("dither pngs/2.png -o one.tif").succeeds_quietly();
    let png = scratch.bytes("pngs/2.png");
    fs::write(scratch.path("piped.tif"), scratch.run_on("dither", &png).succeeds_quietly().stdout)
        .unwrap();
    assert_eq!(images("one.tif"), images("masks.tif")[2..3]);
    assert_eq!(scratch.bytes("piped.tif"), scratch.bytes("one.tif"));

    fs::copy(scratch.path("one.tif"), scratch.path("pngs/3.tif")).unwrap();
    let words = ["dither: pngs: ", "PNG and TIFF pages", "move the others away"];
    scratch.run("dither pngs -o x.tif").is_refused_with(&words);
    scratch.run_on("lamp info", &png[..png.len() - 5]).is_refused_with(&["cut off"]);
}

/// Writes the layers of a sliced cube as a folder of pictures that end in `extension`.
fn cube_as_pictures(scratch: &Scratch, extension: &str) {
    fs::create_dir(scratch.path(extension)).unwrap();
    for layer in scratch.layers("cube.tif") {
        let mask = lamp_tests::mask(&layer);
        let level = |column, row| [255 * u8::from(mask.is_white(column, row)); 3];
        let picture = RgbImage::from_fn(mask.width(), mask.height(), |x, y| level(x, y).into());
        let name = format!("{extension}/{}.{extension}", layer.info.index);
        picture.save(scratch.path(&name)).unwrap();
    }
}

#[test]
fn stages_read_folders_of_pictures_and_meshes_their_templates() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 64);
    scratch.run("slice cube.stl --dpi 100 --thickness 5mm -o cube.tif").succeeds();
    let images = |name: &str| -> Vec<Image> {
        scratch.layers(name).into_iter().map(|layer| layer.image.into_image()).collect()
    };
    let tile = |mesh: &str| {
        let line = format!("tile cube.tif --mesh {mesh} --area 60x60mm -o build.tif");
        scratch.run(&line).succeeds();
        images("build.tif")
    };
    scratch.run("lamp convert cube.tif --png -o png/").succeeds();
    let meshed = tile("png/layer_00000.png");
    for extension in ["bmp", "ppm", "jpg", "webp", "gif"] {
        cube_as_pictures(&scratch, extension);
        let line = format!("dither {extension} --method threshold -o {extension}.tif");
        scratch.run(&line).succeeds_quietly();
        assert!(images(&format!("{extension}.tif")) == images("cube.tif"), "{extension}");
        assert!(tile(&format!("{extension}/0.{extension}")) == meshed, "{extension}");
    }
    let of_gif = scratch.run("lamp info gif").succeeds_quietly().stdout;
    assert!(String::from_utf8(of_gif).unwrap().contains("bytes, GIF\n"));
    fs::copy(scratch.path("jpg/0.jpg"), scratch.path("gif/8.jpg")).unwrap();
    scratch.run("dither gif -o x.tif").is_refused_with(&["gif: ", "GIF and JPEG pages"]);
    let red = RgbImage::from_pixel(9, 9, [200, 0, 0].into());
    red.save(scratch.path("red.bmp")).unwrap();
    let words = ["red.bmp: ", "a picture in color is not read here"];
    scratch.run("tile cube.tif --mesh red.bmp -o x.tif").is_refused_with(&words);
}

#[test]
fn pictures_that_pillow_writes_are_read() {
    let scratch = Scratch::new();
    stack(&scratch, "masks.tif", mask);
    stack(&scratch, "grays.tif", gray);
    let script = r#"
for k, (mask, gray) in enumerate(zip(pages("masks.tif"), pages("grays.tif"))):
    for extension in "bmp", "pbm":
        mask.save(f"mask_{k}.{extension}")
        tell(f"mask_{k}.{extension}", mask)
    for extension in "bmp", "pgm", "gif":
        gray.save(f"gray_{k}.{extension}")
        tell(f"gray_{k}.{extension}", gray)
    gray.save(f"gray_{k}.webp", lossless=True)
    tell(f"gray_{k}.webp", gray)
"#;
    python_writes(&scratch, script);
}

#[test]
fn pngs_that_pillow_writes_are_read() {
    let scratch = Scratch::new();
    stack(&scratch, "masks.tif", mask);
    stack(&scratch, "grays.tif", gray);
    let script = r#"
for k, (mask, gray) in enumerate(zip(pages("masks.tif"), pages("grays.tif"))):
    mask.save(f"mask_{k}.png", dpi=(1500, 1500))
    tell(f"mask_{k}.png", mask)
    gray.save(f"gray_{k}.png")
    tell(f"gray_{k}.png", gray)
    for bits in 2, 4:
        palette = [level for i in range(1 << bits) for level in [(37 * i + 5) % 256] * 3]
        few = gray.point(lambda level: level % (1 << bits))
        few.putpalette(palette)
        few.save(f"few_{k}_{bits}.png", bits=bits)
        tell(f"few_{k}_{bits}.png", few.convert("L"))
"#;
    python_writes(&scratch, script);
    if scratch.names().iter().any(|name| name == "mask_0.png") {
        assert_eq!(scratch.layers("mask_0.png")[0].pitch, Pitch::of_dpi(1500.0));
    }
}

/// Writes strips of Group 4 with runs of length zero, as some programs do, and has Pillow, and so
/// libtiff, decode them. The encoder keeps the rows above as libtiff does.
#[test]
fn group_4_with_runs_of_length_zero_is_read_as_pillow_reads_it() {
    let scratch = Scratch::new();
    let script = r#"
import random, struct
ZERO = "00110101 000111 0111 1000 1011 1100 1110 1111 10011 10100 00111 01000 001000 000011 110100 110101 101010 101011 0100111 0001100 0001000 0010111 0000011 0000100 0101000 0101011 0010011 0100100 0011000 00000010 00000011 00011010 00011011".split()
ONE = "0000110111 010 11 10 011 0011 0010 00011 000101 000100 0000100 0000101 0000111 00000100 00000111 000011000 0000010111 0000011000 0000001000 00001100111 00001101000 00001101100 00000110111 00000101000 00000010111 00000011000 000011001010 000011001011 000011001100 000011001101 000001101000 000001101001 000001101010".split()
VERTICAL = "0000010 000010 010 1 011 000011 0000011".split()
WIDTH, HEIGHT = 32, 24

def coded(row, above, dice):
    bits, raw, a0, white, passes, added, k = "", [], 0, 0, 0, 0, 0
    run = lambda colour, length: (ONE if colour else ZERO)[length]
    at = lambda i: above[i] if i < len(above) else WIDTH
    while a0 < WIDTH:
        i = next((i for i in range(white, len(above), 2) if above[i] > a0), len(above)) if raw else 2 * passes
        a1 = row[k] if k < len(row) else WIDTH
        a2 = row[k + 1] if k + 1 < len(row) else WIDTH
        b1, b2, shift = at(i), at(i + 1), a1 - at(i)
        choice = dice.random()
        if choice < 0.3 and added < 3:
            part = dice.randrange(a1 - a0 + 1)
            bits += "001" + run(white, part) + run(1 - white, 0)
            a0 += part; raw += [a0, a0]; added += 1
        elif choice < 0.4 and b1 - a0 <= 3 and a1 < WIDTH:
            bits += VERTICAL[3 - (b1 - a0)] + "001" + run(1 - white, 0) + run(white, a1 - a0)
            raw += [a0, a0, a1]; a0 = a1; white = 1 - white; k += 1
        elif b2 < a1:
            bits += "0001"; a0 = b2; passes += 1
        elif abs(shift) <= 3 and choice < 0.95:
            bits += VERTICAL[shift + 3]; raw.append(a1); a0 = a1; white = 1 - white; k += 1
        else:
            bits += "001" + run(white, a1 - a0) + run(1 - white, a2 - a1)
            raw += [a1, a2]; a0 = a2; k += 2
    return bits, [column for column in raw if column < WIDTH]

def tiff(strip):
    fields = [(256, 3, WIDTH), (257, 3, HEIGHT), (258, 3, 1), (259, 3, 4), (262, 3, 1), (273, 4, 122), (277, 3, 1), (278, 3, HEIGHT), (279, 4, len(strip))]
    entries = b"".join(struct.pack("<HHII", tag, kind, 1, value) for tag, kind, value in fields)
    return b"II*\0\x08\0\0\0" + struct.pack("<H", len(fields)) + entries + b"\0" * 4 + strip

for seed in range(40):
    dice = random.Random(seed)
    rows, above, bits = [], [], ""
    for _ in range(HEIGHT):
        row = list(rows[-1]) if rows and dice.random() < 0.7 else []
        row = [min(max(column + dice.randrange(-2, 3), 0), WIDTH - 1) for column in row]
        row = sorted(set(row + [dice.randrange(WIDTH) for _ in range(dice.randrange(3))]))
        rows.append(row)
        code, above = coded(row, above, dice)
        bits += code
    bits += "000000000001" * 2
    bits += "0" * (-len(bits) % 8)
    strip = bytes(int(bits[i:i + 8], 2) for i in range(0, len(bits), 8))
    name = f"runs_{seed}.tif"
    open(name, "wb").write(tiff(strip))
    image = Image.open(name)
    pixels = b"".join(
        sum(1 << WIDTH - 1 - c for c in range(WIDTH) if sum(t <= c for t in row) % 2).to_bytes(WIDTH // 8, "big")
        for row in rows
    )
    assert image.tobytes() == pixels, f"Pillow reads {name} otherwise"
    tell(name, image)
"#;
    python_writes(&scratch, script);
}

/// Writes a folder of PNGs of these names, one gray level each, from 1.
fn folder_of(scratch: &Scratch, folder: &str, names: &[&str]) {
    fs::create_dir(scratch.path(folder)).unwrap();
    for (level, name) in (1u8..).zip(names) {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, 9, 4);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.write_header().unwrap().write_image_data(&[level; 36]).unwrap();
        scratch.write(&format!("{folder}/{name}"), &file);
    }
}

#[test]
fn every_command_warns_of_a_folder_that_lacks_a_page() {
    let scratch = Scratch::new();
    folder_of(&scratch, "pages", &["00001.png", "00002.png", "00004.png", "00005.png"]);
    folder_of(&scratch, "steps", &["10.png", "20.png", "30.png", "40.png"]);
    let warning = "pages: page 00003.png is missing (00004.png follows 00002.png)";
    let commands = [
        "lamp convert IN -o out.tif",
        "lamp info IN",
        "lamp show IN --layer 2 -o layer.png",
        "lamp verify IN",
        "lamp check IN",
        "lamp compare IN IN",
        "lamp report IN -o report.html",
        "lamp mesh-out IN -o mesh.stl",
        "lamp pack IN -o packed.lamp",
        "lamp join IN -o joined.tif",
        "lamp split IN --every 3 -o split/",
        "lamp edit IN --difference IN -o edited.tif",
        "dither IN --method threshold -o dithered.tif",
        "fix IN -o fixed.tif",
    ];
    for command in commands {
        let name = command.split(' ').find(|word| *word != "lamp").unwrap();
        let said = scratch.run(&command.replace("IN", "pages")).stderr;
        assert_eq!(said.matches(&format!("{name}: {warning}\n")).count(), 1, "{command}: {said}");
        let said = scratch.run(&command.replace("IN", "steps").replace("-o ", "-o s_")).stderr;
        assert!(!said.contains("missing"), "{command}: {said}");
    }
    for command in ["fix pages --strict -o x.tif", "lamp check pages --strict"] {
        let ran = scratch.run(command);
        assert_eq!(ran.statuses, [Some(3)], "{command}: {}", ran.stderr);
        assert!(ran.stderr.contains("page 00003.png is missing"), "{}", ran.stderr);
        assert!(!scratch.path("x.tif").exists());
    }
    let ran = scratch.run("lamp check steps --strict");
    assert!(!ran.stderr.contains("missing"), "{ran:?}");
}

#[test]
fn pictures_that_are_no_pages_are_left_out_of_a_folder() {
    let scratch = Scratch::new();
    let names = ["00001.png", "00002.png", "00003.png", "thumb.png", "._00001.png"];
    folder_of(&scratch, "pages", &names);
    fs::write(scratch.path("pages/Thumbs.db"), b"x").unwrap();
    let said = scratch.run("lamp convert pages -o out.tif").succeeds().stderr;
    assert!(
        said.contains("._00001.png, thumb.png are left out: their names are not page names"),
        "{said}"
    );
    assert!(said.contains("Thumbs.db is left out: it is not a picture"), "{said}");
    assert_eq!(scratch.layers("out.tif").len(), 3);
    assert_eq!(scratch.run("fix pages --strict -o x.tif").statuses, [Some(3)]);

    fs::rename(scratch.path("pages/thumb.png"), scratch.path("pages/2.png")).unwrap();
    let words = ["pages: ", "00002.png", "2.png", "have the same page number"];
    scratch.run("lamp convert pages -o x.tif").is_refused_with(&words);
}

#[test]
fn a_folder_of_ours_that_lacks_pages_is_refused_under_any_name() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 64);
    scratch.run("slice cube.stl --dpi 50 --thickness 2mm -o cube/").succeeds();
    let names = scratch.names();
    assert!(names.iter().any(|name| name == "cube"), "{names:?}");
    // Names that jump lack no page: the texts of ours say so.
    fs::rename(scratch.path("cube/layer_00009.tif"), scratch.path("cube/layer_00019.tif")).unwrap();
    scratch.run("fix cube --strict -o fixed.tif").succeeds_quietly();
    for (lost, words) in [
        ("cube/layer_00004.tif", "the folder lacks a page: layer 5"),
        ("cube/layer_00019.tif", "was written with more layers"),
        ("cube/layer_00000.tif", "the folder lacks a page: layer 1"),
    ] {
        fs::rename(scratch.path(lost), scratch.path("lost.tif")).unwrap();
        scratch.run("fix cube -o x.tif").is_refused_with(&[words]);
        fs::rename(scratch.path("lost.tif"), scratch.path(lost)).unwrap();
    }
}
