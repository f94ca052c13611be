//! Other programs open what the pipeline makes, and see the same pixels.
//! A program that is not installed is skipped, which is said.

use std::fs::File;
use std::process::Command;

use lamp_fixtures::Part;
use lamp_stack::{Layer, Mask};
use lamp_tests::{Scratch, masks, note};
use tiff::decoder::{Decoder, DecodingResult};

/// A build made by the real pipeline, as `build.tif` (`BigTIFF`) and as
/// `classic.tif`.
fn with_build() -> (Scratch, Vec<Layer>) {
    let scratch = Scratch::new();
    scratch.part("blade.stl", Part::Blade, 24_000);
    let line = "slice blade.stl --dpi 100 --thickness 5mm | fix | dither \
                | tile --area 170x80mm > build.tif";
    scratch.run(line).succeeds_quietly();
    scratch.run("fix build.tif --classic -o classic.tif").succeeds_quietly();
    let layers = scratch.layers("build.tif");
    assert_eq!(layers.len(), 25);
    (scratch, layers)
}

const STACKS: [&str; 2] = ["build.tif", "classic.tif"];

/// Runs another program in the folder and returns what it printed; `None`
/// where it is not installed.
#[track_caller]
fn ask(scratch: &Scratch, program: &str, arguments: &[&str]) -> Option<String> {
    let asked = Command::new(program).args(arguments).current_dir(scratch).output();
    let Ok(out) = asked else {
        note(&format!("{program} is not installed: skipped"));
        return None;
    };
    let (said, warned) =
        (String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
    assert!(out.status.success() && warned.is_empty(), "{program} {arguments:?}: {said}{warned}");
    Some(said.into_owned())
}

/// `width height white`, a line for each page.
fn sizes_and_areas(layers: &[Layer]) -> String {
    let line =
        |mask: &&Mask| format!("{} {} {}\n", mask.width(), mask.height(), mask.white_pixels());
    masks(layers).iter().map(line).collect()
}

#[test]
fn libtiff_lists_the_pages_without_a_warning() {
    let (scratch, layers) = with_build();
    for name in STACKS {
        let Some(text) = ask(&scratch, "tiffinfo", &[name]) else { return };
        let image = &layers[0].image;
        for fact in [
            &*format!("Image Width: {} Image Length: {}", image.width(), image.height()),
            "Resolution: 100, 100 pixels/inch",
            "Bits/Sample: 1",
            "Compression Scheme: CCITT Group 4",
            "Photometric Interpretation: min-is-black",
        ] {
            assert_eq!(text.matches(fact).count(), layers.len(), "{fact}: {text}");
        }
        assert!(text.contains(r#"{"layer":24,"z_um":120000,"thickness_um":5000"#), "{text}");
    }
}

#[test]
fn libtiff_decodes_every_page_to_the_same_pixels() {
    let (scratch, layers) = with_build();
    for name in STACKS {
        if ask(&scratch, "tiffcp", &["-c", "none", name, "plain.tif"]).is_none() {
            return;
        }
        let plain = plain_pages(&scratch);
        assert_eq!(plain.len(), layers.len());
        for (k, (plain, ours)) in plain.iter().zip(masks(&layers)).enumerate() {
            assert!(*plain == packed(ours), "page {k} of {name}");
        }
    }
}

/// Rows of bytes of eight pixels each, the first in the highest bit.
type Packed = Vec<Vec<u8>>;

/// The pages of `plain.tif`, read by a decoder that shares nothing with ours.
fn plain_pages(scratch: &Scratch) -> Vec<Packed> {
    let mut decoder = Decoder::new(File::open(scratch.path("plain.tif")).unwrap()).unwrap();
    let mut pages = Vec::new();
    loop {
        let (width, _) = decoder.dimensions().unwrap();
        let DecodingResult::U8(bytes) = decoder.read_image().unwrap() else {
            panic!("1-bit pixels come in bytes");
        };
        pages.push(bytes.chunks(width.div_ceil(8) as usize).map(<[u8]>::to_vec).collect());
        if !decoder.more_images() {
            return pages;
        }
        decoder.next_image().unwrap();
    }
}

fn packed(mask: &Mask) -> Packed {
    let byte = |row, first: u32| {
        (first..first + 8).fold(0, |byte, column| byte << 1 | u8::from(mask.is_white(column, row)))
    };
    let row = |row| (0..mask.width()).step_by(8).map(|first| byte(row, first)).collect();
    (0..mask.height()).map(row).collect()
}

#[test]
fn pillow_sees_the_same_pages() {
    let (scratch, layers) = with_build();
    if ask_python(&scratch, "import PIL").is_none() {
        return;
    }
    for name in STACKS {
        let script = format!(
            "from PIL import Image, ImageSequence\n\
             for page in ImageSequence.Iterator(Image.open('{name}')):\n    \
             assert page.mode == '1' and page.info['dpi'] == (100, 100)\n    \
             print(*page.size, page.histogram()[255])\n"
        );
        assert_eq!(ask_python(&scratch, &script).unwrap(), sizes_and_areas(&layers), "{name}");
    }
}

/// Runs a script; `None` where there is no Python or it has no Pillow.
#[track_caller]
fn ask_python(scratch: &Scratch, script: &str) -> Option<String> {
    let has_pillow = Command::new("python3").args(["-c", "import PIL"]).output();
    if !has_pillow.is_ok_and(|out| out.status.success()) {
        note("python3 with Pillow is not installed: skipped");
        return None;
    }
    ask(scratch, "python3", &["-c", script])
}

#[test]
fn imagemagick_sees_the_same_pages() {
    let (scratch, layers) = with_build();
    for name in STACKS {
        let asked = ["-precision", "15", "-format", "%w %h %[fx:mean*w*h]\n", name];
        let Some(text) = ask(&scratch, "identify", &asked) else { return };
        // It prints a mean, so the area may miss a whole number by a hair.
        let rounded = |line: &str| {
            let (size, area) = line.rsplit_once(' ').unwrap();
            format!("{size} {}\n", area.parse::<f64>().unwrap().round())
        };
        assert_eq!(
            text.lines().map(rounded).collect::<String>(),
            sizes_and_areas(&layers),
            "{name}"
        );
    }
}
