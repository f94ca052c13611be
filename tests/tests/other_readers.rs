//! Checks that other programs, if installed, read the same pixels from the pipeline's stacks.

use lamp_fixtures::Sample;
use lamp_stack::{Layer, Mask};
use lamp_tests::{Scratch, ask, ask_python, masks, packed_mask, plain_pages};

/// Makes a build by the real pipeline, as `build.tif` (`BigTIFF`) and `classic.tif`.
fn with_build() -> (Scratch, Vec<Layer>) {
    let scratch = Scratch::new();
    scratch.part("blade.stl", Sample::Blade, 24_000);
    let line = "slice blade.stl --dpi 100 --thickness 5mm | fix | dither \
                | tile --mesh none --area 170x80mm > build.tif";
    scratch.run(line).succeeds_quietly();
    scratch.run("fix build.tif --classic -o classic.tif").succeeds_quietly();
    let layers = scratch.layers("build.tif");
    assert_eq!(layers.len(), 25);
    (scratch, layers)
}

const STACKS: [&str; 2] = ["build.tif", "classic.tif"];

/// Returns `width height white`, one line for each page.
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
        let plain = plain_pages(&scratch.path("plain.tif"));
        assert_eq!(plain.len(), layers.len());
        for (k, (plain, ours)) in plain.iter().zip(masks(&layers)).enumerate() {
            assert!(*plain == packed_mask(ours), "page {k} of {name}");
        }
    }
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

#[test]
fn pillow_sees_the_same_pngs() {
    let (scratch, layers) = with_build();
    lamp_tests::write_gray_ramp(&scratch.path("ramp.tif"), 256, 3);
    scratch.run("lamp convert build.tif --png -o pngs/").succeeds_quietly();
    scratch.run("lamp convert ramp.tif -o ramp.png").succeeds_quietly();
    // Pages as libtiff decodes them. A PNG's line has no check of the TIFF's code, so the checks of
    // the lines themselves differ.
    let script = "\
        import json\n\
        from PIL import Image, ImageSequence\n\
        def line(text):\n    \
        line = json.loads(text)\n    \
        kept = line['check'].items()\n    \
        of_code = ('code', 'ends_white', 'text', 'chain')\n    \
        line['check'] = {key: value for key, value in kept if key not in of_code}\n    \
        return line\n\
        def same(png, page, mode):\n    \
        assert png.mode == page.mode == mode and png.size == page.size\n    \
        assert png.tobytes() == page.tobytes()\n    \
        assert [round(dpi, 2) for dpi in png.info['dpi']] == [100, 100]\n    \
        assert line(png.text['Description']) == line(page.tag_v2[270])\n\
        same(Image.open('ramp.png'), Image.open('ramp.tif'), 'L')\n\
        pages = 0\n\
        for page in ImageSequence.Iterator(Image.open('build.tif')):\n    \
        same(Image.open(f'pngs/layer_{pages:05}.png'), page, '1')\n    \
        pages += 1\n\
        print(pages)\n";
    let Some(pages) = ask_python(&scratch, script) else { return };
    assert_eq!(pages, format!("{}\n", layers.len()));
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
