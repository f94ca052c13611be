//! Reads PNG files, and folders of them, as stacks.

use std::fs;
use std::io::Cursor;

use lamp_stack::{Compression, Image, Layer, MaskBuilder, PageInfo, Pages, Pitch, StackError};
use png::{BitDepth, ColorType, Encoder, PixelDimensions, Unit};

/// Encodes rows of bytes as a PNG.
fn png(
    width: u32,
    kind: (ColorType, BitDepth),
    rows: &[u8],
    height: u32,
    set: impl FnOnce(&mut Encoder<'_, &mut Vec<u8>>),
) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, width, height);
    encoder.set_color(kind.0);
    encoder.set_depth(kind.1);
    set(&mut encoder);
    encoder.write_header().unwrap().write_image_data(rows).unwrap();
    file
}

const BITS: (ColorType, BitDepth) = (ColorType::Grayscale, BitDepth::One);
const PALETTE: (ColorType, BitDepth) = (ColorType::Indexed, BitDepth::One);

/// `#..#.#...#` over `..........`.
const ROWS: [u8; 4] = [0b1001_0100, 0b0100_0000, 0, 0];

fn bits() -> Vec<u8> {
    png(10, BITS, &ROWS, 2, |_| {})
}

fn read(file: Vec<u8>) -> Result<Layer, StackError> {
    let mut layers = Pages::from_stream(Cursor::new(file))?.layers();
    let layer = layers.next().expect("a page or an error");
    assert!(layers.next().is_none(), "a PNG is one page");
    layer
}

/// Formats rows as text: `#` and `.`, or gray levels.
fn picture(image: &Image) -> Vec<String> {
    match image {
        Image::Mask(mask) => (0..mask.height())
            .map(|row| {
                let pixel = |column| if mask.is_white(column, row) { '#' } else { '.' };
                (0..mask.width()).map(pixel).collect()
            })
            .collect(),
        Image::Gray(gray) => gray
            .rows()
            .map(|row| row.iter().map(|change| format!("{}:{} ", change.column, change.level)))
            .map(Iterator::collect)
            .collect(),
    }
}

#[test]
fn one_bit_pngs_are_masks() {
    let layer = read(bits()).unwrap();
    assert_eq!(picture(&layer.image), ["#..#.#...#", ".........."]);
    assert_eq!((layer.info, layer.pitch), (PageInfo::default(), None));

    let palette = |colours: &'static [u8]| {
        read(png(10, PALETTE, &ROWS, 2, |encoder| encoder.set_palette(colours))).map(|l| l.image)
    };
    let whites = palette(&[0, 0, 0, 255, 255, 255]).unwrap();
    assert_eq!(picture(&whites), ["#..#.#...#", ".........."]);
    let blacks = palette(&[255, 255, 255, 0, 0, 0]).unwrap();
    assert_eq!(picture(&blacks), [".##.#.###.", "##########"]);
    let grays = palette(&[0, 0, 0, 9, 9, 9]).unwrap();
    assert_eq!(picture(&grays)[0], "0:9 1:0 3:9 4:0 5:9 6:0 9:9 ");
    let error = palette(&[0, 0, 0]).unwrap_err().to_string();
    assert!(error.contains("palette has no entry 1"), "{error}");
    let error = palette(&[0, 0, 0, 255, 0, 0]).unwrap_err().to_string();
    assert!(error.contains("a picture in color is not read"), "{error}");
}

#[test]
fn pngs_of_more_bits_are_gray() {
    for (depth, row, expected) in [
        (BitDepth::Two, &[0b0011_1001][..], "1:255 2:170 3:85 "),
        (BitDepth::Four, &[0x0F, 0x81], "1:255 2:136 3:17 "),
        (BitDepth::Eight, &[0, 200, 200, 7], "1:200 3:7 "),
    ] {
        let file = png(4, (ColorType::Grayscale, depth), row, 1, |_| {});
        assert_eq!(picture(&read(file).unwrap().image), [expected], "{depth:?}");
    }
}

#[test]
fn pngs_of_colours_that_are_gray_are_gray() {
    for (colour, row) in [
        (ColorType::Rgb, &[0, 0, 0, 200, 200, 200, 7, 7, 7][..]),
        (ColorType::Rgba, &[0, 0, 0, 255, 200, 200, 200, 255, 7, 7, 7, 255]),
        (ColorType::GrayscaleAlpha, &[0, 255, 200, 255, 7, 255]),
    ] {
        let file = png(3, (colour, BitDepth::Eight), row, 1, |_| {});
        assert_eq!(picture(&read(file).unwrap().image), ["1:200 2:7 "], "{colour:?}");
    }
}

#[test]
fn resolution_and_description_are_read() {
    let info = PageInfo { index: 7, z_um: Some(700.0), ..PageInfo::default() };
    let described = |per_metre, unit, text: &str| {
        let file = png(10, BITS, &ROWS, 2, |encoder| {
            let dims = PixelDimensions { xppu: per_metre, yppu: per_metre, unit };
            encoder.set_pixel_dims(Some(dims));
            encoder.add_text_chunk("Description".to_owned(), text.to_owned()).unwrap();
        });
        read(file).unwrap()
    };
    let layer = described(59_055, Unit::Meter, r#"{"layer":7,"z_um":700}"#);
    assert_eq!((layer.info, layer.pitch), (info, Pitch::of_dpi(1500.0)));
    let layer = described(59_060, Unit::Meter, "a scan");
    assert_eq!((layer.info, layer.pitch), (PageInfo::default(), Pitch::of_dpi(59_060.0 * 0.0254)));
    assert_eq!(described(59_055, Unit::Unspecified, "").pitch, None);
}

#[test]
fn what_is_not_read_is_named() {
    let eight = |colour| (colour, BitDepth::Eight);
    let clear = |encoder: &mut Encoder<'_, &mut Vec<u8>>| encoder.set_trns(vec![0, 1]);
    for (file, words) in [
        (png(1, eight(ColorType::Rgb), &[1, 1, 3], 1, |_| {}), "a picture in color"),
        (png(1, eight(ColorType::Rgba), &[1, 3, 1, 255], 1, |_| {}), "a picture in color"),
        (png(1, eight(ColorType::Rgba), &[1, 1, 1, 254], 1, |_| {}), "transparency"),
        (png(1, eight(ColorType::GrayscaleAlpha), &[1, 1], 1, |_| {}), "transparency"),
        (animated(), "a picture file with several images"),
        (png(1, BITS, &[0], 1, clear), "transparency"),
        (png(1, (ColorType::Grayscale, BitDepth::Sixteen), &[1, 1], 1, |_| {}), "16-bit"),
        (interlaced(), "an interlaced PNG"),
    ] {
        let error = read(file).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("is not read here"), "{error}");
    }
}

fn animated() -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, 8, 1);
    encoder.set_animated(2, 0).unwrap();
    encoder.set_depth(BitDepth::One);
    let mut writer = encoder.write_header().unwrap();
    for frame in [0x0F, 0xF0] {
        writer.write_image_data(&[frame]).unwrap();
    }
    writer.finish().unwrap();
    file
}

fn interlaced() -> Vec<u8> {
    let mut file = bits();
    file[28] = 1;
    let mut crc = flate2::Crc::new();
    crc.update(&file[12..29]);
    file[29..33].copy_from_slice(&crc.sum().to_be_bytes());
    file
}

#[test]
fn a_cut_png_is_cut_off_and_a_damaged_one_damaged() {
    let whole = bits();
    for cut in 1..whole.len() {
        let error = read(whole[..cut].to_vec()).unwrap_err();
        assert!(matches!(error, StackError::CutOff { last_whole: None }), "{cut}: {error}");
    }
    for at in 8..whole.len() {
        for flip in [1, 0x20, 0x80] {
            let mut bad = whole.clone();
            bad[at] ^= flip;
            match read(bad) {
                Ok(layer) => assert!(at >= whole.len() - 12, "{at}: {layer:?}"),
                Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
            }
        }
    }
}

#[test]
fn a_chunk_that_claims_gigabytes_costs_only_an_error() {
    let mut file = bits();
    file[33..37].copy_from_slice(&0x7FFF_FFFFu32.to_be_bytes());
    let error = read(file).unwrap_err().to_string();
    assert!(error.contains("more than 1073741824 bytes"), "{error}");
}

#[test]
fn a_folder_of_pngs_is_a_stack() {
    let folder = tempfile::tempdir().unwrap();
    for column in [2u32, 9, 10] {
        let mut row = [0; 2];
        row[column as usize / 8] = 0x80 >> (column % 8);
        let file = png(16, BITS, &row, 1, |_| {});
        fs::write(folder.path().join(format!("layer{column}.PNG")), file).unwrap();
    }
    fs::write(folder.path().join("notes.txt"), "mine").unwrap();
    let pages: Vec<_> = Pages::open(folder.path()).unwrap().collect::<Result<_, _>>().unwrap();
    for ((index, page), column) in (0..).zip(pages).zip([2, 9, 10]) {
        assert_eq!(page.compression(), Compression::Png);
        let layer = page.decode().unwrap();
        let mut mask = MaskBuilder::new(16);
        mask.push_row(&[column, column + 1]).unwrap();
        assert_eq!((layer.info.index, layer.image), (index, mask.finish().into()));
    }

    fs::write(folder.path().join("layer3.tif"), "").unwrap();
    let error = Pages::open(folder.path()).unwrap_err();
    assert!(matches!(error, StackError::MixedPages { formats: ["PNG", "TIFF"] }), "{error}");
}

#[test]
fn a_png_is_known_by_its_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.dat");
    fs::write(&path, bits()).unwrap();
    let layers: Vec<_> = Pages::open(&path).unwrap().layers().map(Result::unwrap).collect();
    assert_eq!(picture(&layers[0].image), ["#..#.#...#", ".........."]);
}

#[test]
fn pixels_that_are_not_square_are_read_where_their_size_is_known() {
    let dpi = |x: f64, y: f64| Some(Pitch::of_two_dpi([x, y]));
    for (sides, unit, pitch) in [
        ([59_055, 59_055], Unit::Meter, dpi(1500.0, 1500.0)),
        // Rounding of other programs.
        ([2834, 2835], Unit::Meter, dpi(2834.0 * 0.0254, 2834.0 * 0.0254)),
        ([393, 394], Unit::Meter, dpi(393.0 * 0.0254, 393.0 * 0.0254)),
        ([8031, 3858], Unit::Meter, dpi(204.0, 98.0)),
        ([59_055, 59_155], Unit::Meter, dpi(1500.0, 59_155.0 * 0.0254)),
        ([1, 1], Unit::Unspecified, Some(None)),
        ([2, 1], Unit::Unspecified, None),
        ([100, 101], Unit::Unspecified, None),
        ([0, 2835], Unit::Meter, Some(None)),
        ([1, 2835], Unit::Meter, None),
    ] {
        let [xppu, yppu] = sides;
        let file = png(10, BITS, &ROWS, 2, |encoder| {
            encoder.set_pixel_dims(Some(PixelDimensions { xppu, yppu, unit }));
        });
        match read(file) {
            Ok(layer) => assert_eq!(Some(layer.pitch), pitch, "{sides:?}"),
            Err(StackError::RectangularPixels { .. }) => assert_eq!(pitch, None, "{sides:?}"),
            Err(error) => panic!("{error}"),
        }
    }
}
