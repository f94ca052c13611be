//! Reads BMP, PNM, JPEG, WebP and GIF files, and folders of them, as stacks.

use std::fs;
use std::io::Cursor;

use image::codecs::gif::GifEncoder;
use image::{DynamicImage, Frame, GrayImage, ImageFormat, RgbImage, RgbaImage};
use lamp_stack::{Compression, Image, Layer, Limits, PageFault, Pages, PictureFormat, StackError};

const WIDTH: u32 = 37;
const HEIGHT: u32 = 23;

/// Returns the level of a pixel of a picture with ramps, edges and black and white.
fn level(column: u32, row: u32) -> u8 {
    match (column / 9, row % 4) {
        (0, _) => 0,
        (1, _) => 255,
        (2, 0) => (column * 7) as u8,
        (_, row) => (40 * row + column) as u8,
    }
}

fn gray() -> GrayImage {
    GrayImage::from_fn(WIDTH, HEIGHT, |column, row| [level(column, row)].into())
}

/// Returns a picture with a change to one pixel of red, green, blue and opacity.
fn coloured(change: [u8; 4]) -> RgbaImage {
    RgbaImage::from_fn(WIDTH, HEIGHT, |column, row| {
        let level = level(column, row);
        let change = if (column, row) == (20, 9) { change } else { [0; 4] };
        [level ^ change[0], level ^ change[1], level ^ change[2], 255 ^ change[3]].into()
    })
}

fn encoded(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    picture.write_to(&mut file, format).unwrap();
    file.into_inner()
}

fn read_within(file: &[u8], limits: Limits) -> Result<Image, StackError> {
    let pages = Pages::from_stream(Cursor::new(file.to_owned()))?.with_limits(limits);
    let mut layers = pages.layers();
    let layer: Layer = layers.next().expect("a page or an error")?;
    assert!(layers.next().is_none(), "a picture is one page");
    Ok(layer.image.into_image())
}

fn read(file: &[u8]) -> Result<Image, StackError> {
    read_within(file, Limits::default())
}

/// Returns the levels of a gray image, row by row.
fn levels(image: &Image) -> Vec<u8> {
    let Image::Gray(gray) = image else { panic!("{image:?} is a mask") };
    let pixels = (0..gray.height()).flat_map(|row| (0..gray.width()).map(move |c| (c, row)));
    pixels.map(|(column, row)| gray.level(column, row)).collect()
}

const LOSSLESS: [ImageFormat; 4] =
    [ImageFormat::Bmp, ImageFormat::Pnm, ImageFormat::WebP, ImageFormat::Gif];

#[test]
fn lossless_pictures_keep_their_levels() {
    let rgb: RgbImage = DynamicImage::from(coloured([0; 4])).into_rgb8();
    for picture in [DynamicImage::from(gray()), rgb.into(), coloured([0; 4]).into()] {
        for format in LOSSLESS {
            // GIF has no gray pixels, and the encoder of PNM no opacity.
            let picture = match format {
                ImageFormat::Gif => DynamicImage::from(picture.to_rgba8()),
                ImageFormat::Pnm if picture.color().has_alpha() => picture.to_rgb8().into(),
                _ => picture.clone(),
            };
            let read = read(&encoded(&picture, format)).unwrap();
            assert!(levels(&read) == *gray(), "{format:?} of {:?}", picture.color());
        }
    }
}

#[test]
fn jpegs_are_gray_within_what_they_lose() {
    for picture in [DynamicImage::from(gray()), gray_in_colours()] {
        let read = levels(&read(&encoded(&picture, ImageFormat::Jpeg)).unwrap());
        let gray = gray();
        let off = read.iter().zip(gray.iter()).map(|(a, b)| u32::from(a.abs_diff(*b)));
        let mean = off.sum::<u32>() / (WIDTH * HEIGHT);
        assert!(mean < 20, "{mean}");
    }
}

fn gray_in_colours() -> DynamicImage {
    DynamicImage::from(coloured([0; 4])).into_rgb8().into()
}

#[test]
fn one_bit_files_are_masks() {
    // `#.#` over `..#`: PBM has 1 for black.
    for pbm in [&b"P1 3 2\n0 1 0\n1 1 0\n"[..], b"P4\n3 2\n\x40\xC0"] {
        let Image::Mask(mask) = read(pbm).unwrap() else { panic!("gray") };
        assert_eq!((mask.row(0), mask.row(1)), (&[0, 1, 2][..], &[2][..]));
    }
    // The lowest row is the first.
    let rows = [0b0010_0000, 0, 0, 0, 0b1010_0000, 0, 0, 0];
    let Image::Mask(mask) = read(&bmp_of_bits([[0; 3], [255; 3]], rows)).unwrap() else {
        panic!("gray")
    };
    assert_eq!((mask.row(0), mask.row(1)), (&[0, 1, 2][..], &[2][..]));
    let inverted = read(&bmp_of_bits([[255; 3], [0; 3]], rows)).unwrap();
    assert_eq!(inverted, Image::Mask(mask.inverted()));
    // Two grays are levels, and so is black and white of more bits.
    assert_eq!(
        levels(&read(&bmp_of_bits([[9; 3], [70; 3]], rows)).unwrap()),
        [70, 9, 70, 9, 9, 70]
    );
    let white = DynamicImage::from(GrayImage::from_pixel(3, 1, [255].into()));
    assert_eq!(levels(&read(&encoded(&white, ImageFormat::Pnm)).unwrap()), [255; 3]);
}

/// Returns a BMP of 3 x 2 pixels of one bit.
fn bmp_of_bits(palette: [[u8; 3]; 2], rows: [u8; 8]) -> Vec<u8> {
    let number = |number: u32| number.to_le_bytes();
    let mut file = b"BM".to_vec();
    file.extend([number(70), number(0), number(62)].concat());
    file.extend([number(40), number(3), number(2)].concat());
    file.extend([1, 0, 1, 0]);
    file.extend([number(0), number(8), number(2835), number(2835), number(2), number(0)].concat());
    palette.iter().for_each(|[r, g, b]| file.extend([*b, *g, *r, 0]));
    file.extend(rows);
    file
}

#[test]
fn what_is_not_gray_is_refused() {
    let refused = |picture: &DynamicImage, format| {
        let error = read(&encoded(picture, format)).unwrap_err().to_string();
        assert!(error.contains("is not read here"), "{error}");
        error
    };
    for format in LOSSLESS {
        let mut colour = DynamicImage::from(coloured([0, 0x10, 0, 0]));
        if format == ImageFormat::Pnm {
            colour = colour.to_rgb8().into();
        }
        assert!(refused(&colour, format).contains("a picture in color"), "{format:?}");
    }
    let clear = coloured([0, 0, 0, 0xFF]).into();
    for format in [ImageFormat::Gif, ImageFormat::WebP, ImageFormat::Bmp] {
        assert!(refused(&clear, format).contains("transparency"), "{format:?}");
    }
    let deep = DynamicImage::from(gray()).into_luma16().into();
    assert!(refused(&deep, ImageFormat::Pnm).contains("16-bit"));
}

#[test]
fn several_images_in_one_file_are_refused() {
    let mut gif = Vec::new();
    let mut encoder = GifEncoder::new(&mut gif);
    encoder.encode_frames([coloured([0; 4]), coloured([0; 4])].map(Frame::new)).unwrap();
    drop(encoder);
    let pbm = b"P4\n3 2\n\x40\xC0";
    for file in [gif, [pbm, &pbm[..]].concat()] {
        let error = read(&file).unwrap_err().to_string();
        assert!(error.contains("a picture file with several images"), "{error}");
    }
}

#[test]
fn a_cut_picture_is_an_error() {
    for format in LOSSLESS.into_iter().chain([ImageFormat::Jpeg]) {
        let whole = encoded(&coloured_for(format), format);
        for cut in 1..whole.len() {
            let read = read(&whole[..cut]);
            assert!(read.is_err(), "{format:?}, {cut} of {} bytes", whole.len());
            let error = read.unwrap_err().to_string();
            assert!(!error.contains('\n'), "{error}");
        }
    }
}

/// Returns the gray picture in the colors that a format's encoder takes.
fn coloured_for(format: ImageFormat) -> DynamicImage {
    match format {
        ImageFormat::Gif => coloured([0; 4]).into(),
        _ => gray().into(),
    }
}

#[test]
fn damaged_pictures_are_images_or_errors() {
    for format in LOSSLESS.into_iter().chain([ImageFormat::Jpeg]) {
        let whole = encoded(&coloured_for(format), format);
        for at in (0..whole.len()).step_by(whole.len() / 300 + 1) {
            for flip in [1, 0x20, 0x80, 0xFF] {
                let mut bad = whole.clone();
                bad[at] ^= flip;
                if let Err(error) = read(&bad) {
                    assert!(!error.to_string().contains('\n'), "{error}");
                }
            }
        }
    }
}

#[test]
fn large_pictures_are_refused_before_they_are_decoded() {
    // A BMP, a GIF and a PGM that claim 60,000 x 60,000 pixels.
    let mut bmp = bmp_of_bits([[0; 3], [255; 3]], [0; 8]);
    bmp[18..20].copy_from_slice(&60_000u16.to_le_bytes());
    bmp[22..24].copy_from_slice(&60_000u16.to_le_bytes());
    let mut gif = encoded(&coloured([0; 4]).into(), ImageFormat::Gif);
    gif[6..10].copy_from_slice(&[0x60, 0xEA, 0x60, 0xEA]);
    let pgm = b"P5 60000 60000 255\n".to_vec();
    for file in [bmp, gif, pgm] {
        let error = read(&file).unwrap_err();
        let StackError::Malformed { fault: PageFault::PictureBytes(bytes), .. } = error else {
            panic!("{error}")
        };
        assert!(bytes >= 3_600_000_000, "{bytes}");
    }
    let mut limits = Limits::default();
    limits.png_bytes = 100;
    let file = encoded(&gray().into(), ImageFormat::Bmp);
    let error = read_within(&file, limits).unwrap_err().to_string();
    assert!(error.contains("more than 100 bytes"), "{error}");
}

#[test]
fn a_folder_of_pictures_is_a_stack() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    for column in [2u32, 9, 10] {
        let mut row = [1; 16];
        row[column as usize] = 0;
        let row: Vec<String> = row.iter().map(u8::to_string).collect();
        write(&format!("layer{column}.PBM"), format!("P1 16 1\n{}", row.join(" ")).as_bytes());
    }
    let pages: Vec<_> = Pages::open(folder.path()).unwrap().collect::<Result<_, _>>().unwrap();
    for ((index, page), column) in (0..).zip(pages).zip([2, 9, 10]) {
        assert_eq!(page.compression(), Compression::Picture(PictureFormat::Pnm));
        let layer = page.decode().unwrap();
        let Image::Mask(mask) = &*layer.image else { panic!("gray") };
        assert_eq!((layer.info.index, mask.row(0)), (index, &[column, column + 1][..]));
    }

    write("layer11.bmp", b"");
    let error = Pages::open(folder.path()).unwrap_err();
    assert!(matches!(error, StackError::MixedPages { formats: ["BMP", "PNM"] }), "{error}");
    // Beside TIFFs or PNGs, other pictures are no pages.
    write("layer0.png", b"");
    let error = Pages::open(folder.path()).unwrap().next().unwrap().unwrap_err();
    assert!(error.to_string().contains("layer0.png"), "{error}");
}

#[test]
fn runs_are_limited() {
    let mut limits = Limits::default();
    limits.runs = 100;
    let error = read_within(&encoded(&gray().into(), ImageFormat::Bmp), limits).unwrap_err();
    let expected = StackError::Malformed { page: 0, fault: PageFault::TooManyRuns };
    assert_eq!(error.to_string(), expected.to_string());
}

#[test]
fn pictures_whose_pixels_are_not_square_are_refused() {
    let gray = DynamicImage::from(gray());
    let refused = |file: &[u8]| match read(file) {
        Ok(_) => false,
        Err(StackError::RectangularPixels { .. }) => true,
        Err(error) => panic!("{error}"),
    };
    let bmp = encoded(&gray, ImageFormat::Bmp);
    for (sides, is_refused) in [
        ([11_811u32, 11_811], false),
        ([11_811, 11_812], false),
        ([0, 0], false),
        ([8031, 3858], true),
    ] {
        let mut bmp = bmp.clone();
        bmp[38..46].copy_from_slice(&sides.map(u32::to_le_bytes).concat());
        assert_eq!(refused(&bmp), is_refused, "{sides:?}");
    }
    let jpeg = encoded(&gray, ImageFormat::Jpeg);
    let jfif =
        jpeg.windows(5).position(|window| window == b"JFIF\0").expect("it has a JFIF segment");
    for (unit, sides, is_refused) in [
        (1, [300u16, 300], false),
        (1, [204, 98], true),
        (0, [1, 1], false),
        (0, [2, 1], true),
        (2, [80, 80], false),
        (0, [0, 0], false),
    ] {
        let mut jpeg = jpeg.clone();
        jpeg[jfif + 7] = unit;
        jpeg[jfif + 8..jfif + 12].copy_from_slice(&sides.map(u16::to_be_bytes).concat());
        assert_eq!(refused(&jpeg), is_refused, "{unit} {sides:?}");
    }
    let gif = encoded(&coloured([0; 4]).into(), ImageFormat::Gif);
    for (ratio, is_refused) in [(0, false), (49, false), (113, true)] {
        let mut gif = gif.clone();
        gif[12] = ratio;
        assert_eq!(refused(&gif), is_refused, "{ratio}");
    }
}
