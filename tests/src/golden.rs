//! Compares images with golden ones, pixel for pixel.

use std::fs::{self, File};
use std::io::{BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};

use lamp_stack::{Mask, MaskBuilder};
use png::{BitDepth, ColorType, Compression, Decoder, Encoder};

use crate::binaries::{target_dir, workspace_root};

/// The command that rewrites the golden images after an intended change.
const BLESS_COMMAND: &str = "LAMP_BLESS=1 cargo test -p lamp-tests golden::";

/// A folder of golden images: 1-bit `name.png` files.
#[derive(Clone, Debug)]
pub struct Golden {
    images: PathBuf,
    differences: PathBuf,
    bless: bool,
}

/// The effect of blessing on a golden image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// There was no image of that name.
    New,
    /// The image differed.
    Changed,
}

impl Golden {
    /// Opens the project's golden images, in `fixtures/golden`. `LAMP_BLESS=1` in the
    /// environment rewrites them.
    pub fn of_the_project() -> Self {
        let bless = std::env::var("LAMP_BLESS").is_ok_and(|value| value == "1");
        Self::new(
            workspace_root().join("fixtures/golden"),
            target_dir().join("golden-differences"),
            bless,
        )
    }

    /// Opens the golden images in a folder; pictures of differences go to another.
    pub fn new(images: PathBuf, differences: PathBuf, bless: bool) -> Self {
        Self { images, differences, bless }
    }

    /// Returns the names of the images, sorted.
    ///
    /// # Panics
    /// Panics if the folder cannot be read.
    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.images).expect("there are golden images");
        let paths = entries.map(|entry| entry.expect("it can be listed").path());
        let name = |path: PathBuf| Some(path.file_stem()?.to_string_lossy().into_owned());
        let mut names: Vec<String> = paths.filter_map(name).collect();
        names.sort();
        names
    }

    /// Compares an image with the golden one of that name, or replaces that one.
    ///
    /// # Errors
    /// Returns a text if they differ: by how much, the path of a picture of the
    /// difference, and how to bless the change.
    ///
    /// # Panics
    /// Panics if a file cannot be written.
    pub fn check(&self, name: &str, actual: &Mask) -> Result<Option<Change>, String> {
        let path = self.images.join(format!("{name}.png"));
        let expected = read_mask(&path);
        if expected.as_ref() == Some(actual) {
            return Ok(None);
        }
        if self.bless {
            fs::create_dir_all(&self.images).expect("the folder can be made");
            write_mask(&path, actual);
            return Ok(Some(if expected.is_some() { Change::Changed } else { Change::New }));
        }
        Err(match expected {
            Some(expected) => self.describe(name, &expected, actual),
            None => format!("{name}: there is no golden image; {BLESS_COMMAND} makes it"),
        })
    }

    fn describe(&self, name: &str, expected: &Mask, actual: &Mask) -> String {
        let shades = difference(expected, actual);
        let pixels = shades.iter().flatten().filter(|&&shade| shade.differs()).count();
        let picture = self.differences.join(format!("{name}.png"));
        fs::create_dir_all(&self.differences).expect("the folder can be made");
        write_shades(&picture, &shades);
        let size = |mask: &Mask| format!("{} x {}", mask.width(), mask.height());
        format!(
            "{name}: {pixels} pixels differ from the golden image ({} now, {} there); {} shows \
             what is gone in red and what is new in blue; if the change is meant, \
             {BLESS_COMMAND} rewrites the image",
            size(actual),
            size(expected),
            picture.display(),
        )
    }
}

/// The comparison of a pixel in two images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shade {
    /// White in both.
    White,
    /// Black in both.
    Black,
    /// White expected, black found.
    Gone,
    /// Black expected, white found.
    New,
}

impl Shade {
    /// Returns whether the images differ here.
    pub fn differs(self) -> bool {
        matches!(self, Self::Gone | Self::New)
    }

    fn rgb(self) -> [u8; 3] {
        match self {
            Self::White => [255; 3],
            Self::Black => [128; 3],
            Self::Gone => [220, 0, 0],
            Self::New => [0, 90, 255],
        }
    }
}

/// Compares two images pixel by pixel, on the larger of their sizes. Outside an
/// image all is black.
pub fn difference(expected: &Mask, actual: &Mask) -> Vec<Vec<Shade>> {
    let width = expected.width().max(actual.width());
    let height = expected.height().max(actual.height());
    let shade = |column, row| match (expected.is_white(column, row), actual.is_white(column, row)) {
        (true, true) => Shade::White,
        (false, false) => Shade::Black,
        (true, false) => Shade::Gone,
        (false, true) => Shade::New,
    };
    (0..height).map(|row| (0..width).map(|column| shade(column, row)).collect()).collect()
}

fn write_shades(path: &Path, shades: &[Vec<Shade>]) {
    let width = shades.first().map_or(0, Vec::len);
    let pixels: Vec<u8> = shades.iter().flatten().flat_map(|shade| shade.rgb()).collect();
    write_png(path, [width, shades.len()], (ColorType::Rgb, BitDepth::Eight), &pixels);
}

fn write_mask(path: &Path, mask: &Mask) {
    let row_bits = |row| (0..mask.width()).map(move |column| mask.is_white(column, row));
    let bytes = |row| {
        let bits: Vec<bool> = row_bits(row).collect();
        let byte = |bits: &[bool]| {
            bits.iter().enumerate().map(|(i, &bit)| u8::from(bit) << (7 - i)).sum::<u8>()
        };
        bits.chunks(8).map(byte).collect::<Vec<u8>>()
    };
    let pixels: Vec<u8> = (0..mask.height()).flat_map(bytes).collect();
    let size = [mask.width() as usize, mask.height() as usize];
    write_png(path, size, (ColorType::Grayscale, BitDepth::One), &pixels);
}

fn write_png(path: &Path, size: [usize; 2], format: (ColorType, BitDepth), pixels: &[u8]) {
    let mut out = BufWriter::new(File::create(path).expect("the folder can be written to"));
    let mut encoder = Encoder::new(&mut out, size[0] as u32, size[1] as u32);
    encoder.set_color(format.0);
    encoder.set_depth(format.1);
    encoder.set_compression(Compression::High);
    let mut writer = encoder.write_header().expect("the size is right");
    writer.write_image_data(pixels).expect("the pixels fill the size");
    writer.finish().expect("the file can be written");
    out.flush().expect("the file can be written");
}

/// Reads a golden image; returns `None` if there is no such file.
fn read_mask(path: &Path) -> Option<Mask> {
    let file = File::open(path).ok()?;
    let mut reader = Decoder::new(BufReader::new(file)).read_info().expect("a PNG");
    let info = reader.info();
    assert_eq!(
        (info.color_type, info.bit_depth),
        (ColorType::Grayscale, BitDepth::One),
        "{}: golden images are of 1 bit a pixel",
        path.display()
    );
    let mut mask = MaskBuilder::new(info.width);
    let (width, height) = (info.width, info.height);
    for _ in 0..height {
        let row = reader.next_row().expect("a whole PNG").expect("as many rows as it says");
        let bit = |column: u32| row.data()[column as usize / 8] >> (7 - column % 8) & 1 == 1;
        let toggles = |&c: &u32| bit(c) != (c > 0 && bit(c - 1));
        let transitions: Vec<u32> = (0..width).filter(toggles).collect();
        mask.push_row(&transitions).expect("columns in rising order");
    }
    Some(mask.finish())
}
