//! The light across the mirrors of a display, from a picture or a table.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use image::{DynamicImage, ImageDecoder, ImageReader};
use lamp_stack::one_line;
use thiserror::Error;

use super::ScanLight;

/// The light of each mirror of a display.
///
/// # Guarantees
/// There is a value for each mirror. Each is between 0 and 1, and at least one is above 0.
#[derive(Clone, Debug, PartialEq)]
pub struct LightTable {
    /// The mirrors across the scan and along it.
    pub mirrors: [u32; 2],
    /// The light of each mirror, 0 to 1, row after row along the scan. Row 0 is the row of mirrors
    /// that meets a row of the image first.
    pub values: Vec<f32>,
}

/// Why a file is no light of a display.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LightError {
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The path names a folder, a pipe or a device.
    #[error("this is no file: name a gray picture or a .csv table")]
    NotAFile,
    /// A display with too many mirrors to hold their light.
    #[error(
        "{mirrors} mirrors are too many for a light file: leave [scan.light] out \
         above {MAX_MIRRORS} mirrors"
    )]
    TooManyMirrors {
        /// The number of mirrors.
        mirrors: u64,
    },
    /// The file is no picture that can be decoded.
    #[error("{0}: write the light as a gray PNG, or as a .csv table")]
    Picture(String),
    /// The picture has colors, an alpha channel or other samples.
    #[error("this picture has {samples} pixels: write a gray picture of 8 or 16 bits")]
    NotGray {
        /// The kind of its pixels.
        samples: String,
    },
    /// The picture has another size than the display.
    #[error("this picture is {}x{}, but the mirrors are {}x{}", found[0], found[1], mirrors[0], mirrors[1])]
    Size {
        /// The width and the height of the picture.
        found: [u32; 2],
        /// The mirrors across and along.
        mirrors: [u32; 2],
    },
    /// The table is longer than any table of the display.
    #[error("this table has more than {most} bytes, too many for {}x{} mirrors", mirrors[0], mirrors[1])]
    TooLong {
        /// The most bytes that are read.
        most: u64,
        /// The mirrors across and along.
        mirrors: [u32; 2],
    },
    /// The table is no text.
    #[error("byte {at} is not UTF-8 text: write the table as numbers with commas between them")]
    NotText {
        /// The index of the first such byte.
        at: usize,
    },
    /// A row of the table has another number of cells than mirrors lie across.
    #[error("line {line} has {cells} {}, but {across} mirrors lie across", numbers(*cells))]
    Cells {
        /// The line, from 1.
        line: usize,
        /// The number of cells.
        cells: usize,
        /// The mirrors across.
        across: u32,
    },
    /// The table has another number of rows than mirrors lie along the scan.
    #[error("this table has {rows} {}, but {along} mirrors lie along the scan", if *rows == 1 { "row" } else { "rows" })]
    Rows {
        /// The number of rows, at most one more than there are mirrors.
        rows: usize,
        /// The mirrors along.
        along: u32,
    },
    /// A cell that is no light.
    #[error("line {line}, column {column}: `{text}` is not a number from 0 to 1")]
    Number {
        /// The line, from 1.
        line: usize,
        /// The column, from 1.
        column: usize,
        /// The begin of the cell's text.
        text: String,
    },
    /// A light that is zero everywhere.
    #[error("every mirror is dark: write 1 for the brightest")]
    Dark,
}

fn numbers(count: usize) -> &'static str {
    if count == 1 { "number" } else { "numbers" }
}

/// The most mirrors whose light is read, far more than displays have: their values take a quarter
/// of a gibibyte.
const MAX_MIRRORS: u64 = 1 << 26;

/// The most bytes of a number in a table, with what is around it.
const BYTES_PER_NUMBER: u64 = 64;

/// The most bytes of comments in a table.
const COMMENT_BYTES: u64 = 1 << 20;

impl ScanLight {
    /// Reads the light of a display with these mirrors across the scan and along it. `folder` is
    /// the folder of the machine's file.
    ///
    /// A file whose name ends in `.csv` is a table: a line for each row of mirrors, numbers from 0
    /// to 1 with commas between them. Blank lines and lines that start with `#` are skipped.
    /// Another file is a gray picture, whose brightest level means 1.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, has another size, holds other numbers or is
    /// dark everywhere. A picture of another size is not decoded.
    pub fn read(&self, folder: &Path, mirrors: [u32; 2]) -> Result<LightTable, LightError> {
        let count = u64::from(mirrors[0]) * u64::from(mirrors[1]);
        if count > MAX_MIRRORS {
            return Err(LightError::TooManyMirrors { mirrors: count });
        }
        let path = folder.join(&self.file);
        // To open a pipe would wait for its writer.
        if !path.metadata()?.is_file() {
            return Err(LightError::NotAFile);
        }
        let file = File::open(&path)?;
        let is_table = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
        let values = if is_table {
            table(&text(file, mirrors)?, mirrors)?
        } else {
            picture(BufReader::new(file), mirrors)?
        };
        if values.iter().all(|value| *value == 0.0) {
            return Err(LightError::Dark);
        }
        Ok(LightTable { mirrors, values })
    }
}

fn picture(file: impl io::BufRead + io::Seek, mirrors: [u32; 2]) -> Result<Vec<f32>, LightError> {
    let undecoded = |error: image::ImageError| match error {
        image::ImageError::IoError(error) if error.kind() != io::ErrorKind::UnexpectedEof => {
            LightError::Io(error)
        }
        error => LightError::Picture(one_line(&error.to_string())),
    };
    let mut limits = image::Limits::default();
    [limits.max_image_width, limits.max_image_height] = mirrors.map(Some);
    // A picture of the right size has at most two bytes a mirror; the rest is the decoder's own.
    let pixels = u64::from(mirrors[0]) * u64::from(mirrors[1]);
    limits.max_alloc = Some(8 * pixels + (1 << 24));
    let reader = ImageReader::new(file).with_guessed_format()?;
    let mut decoder = reader.into_decoder().map_err(undecoded)?;
    let (width, height) = decoder.dimensions();
    if [width, height] != mirrors {
        return Err(LightError::Size { found: [width, height], mirrors });
    }
    decoder.set_limits(limits).map_err(undecoded)?;
    let color = decoder.color_type();
    let samples = || format!("{color:?}");
    if ![image::ColorType::L8, image::ColorType::L16].contains(&color) {
        return Err(LightError::NotGray { samples: samples() });
    }
    match DynamicImage::from_decoder(decoder).map_err(undecoded)? {
        DynamicImage::ImageLuma8(gray) => {
            Ok(gray.into_raw().into_iter().map(|level| f32::from(level) / 255.0).collect())
        }
        DynamicImage::ImageLuma16(gray) => {
            Ok(gray.into_raw().into_iter().map(|level| f32::from(level) / 65_535.0).collect())
        }
        _ => Err(LightError::NotGray { samples: samples() }),
    }
}

/// Reads the text of a table.
fn text(file: File, mirrors: [u32; 2]) -> Result<String, LightError> {
    let numbers = u64::from(mirrors[0]) * u64::from(mirrors[1]);
    let most = numbers * BYTES_PER_NUMBER + COMMENT_BYTES;
    let mut bytes = Vec::new();
    // One byte more than allowed shows that there is more.
    file.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(LightError::TooLong { most, mirrors });
    }
    String::from_utf8(bytes)
        .map_err(|error| LightError::NotText { at: error.utf8_error().valid_up_to() })
}

fn table(text: &str, mirrors: [u32; 2]) -> Result<Vec<f32>, LightError> {
    let [across, along] = mirrors;
    // Spreadsheets mark their files as UTF-8.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let (mut values, mut rows) = (Vec::new(), 0);
    for (line, row) in (1..).zip(text.lines()) {
        let row = row.trim();
        if row.is_empty() || row.starts_with('#') {
            continue;
        }
        rows += 1;
        if rows > along as usize {
            break;
        }
        let cells = row.split(',').count();
        if cells != across as usize {
            return Err(LightError::Cells { line, cells, across });
        }
        for (column, cell) in (1..).zip(row.split(',')) {
            // NaN lies in no range. -0 does, and is made 0 by adding it.
            match cell.trim().parse::<f32>() {
                Ok(value) if (0.0..=1.0).contains(&value) => values.push(value + 0.0),
                _ => return Err(LightError::Number { line, column, text: begin(cell) }),
            }
        }
    }
    if rows != along as usize {
        return Err(LightError::Rows { rows, along });
    }
    Ok(values)
}

/// Returns the begin of a cell for a message: without its quotes, a whole file may be one cell.
fn begin(cell: &str) -> String {
    one_line(&cell.chars().take(40).collect::<String>())
}

#[cfg(test)]
mod tests {
    use image::{ImageBuffer, Luma, Rgb};
    use tempfile::TempDir;

    use super::*;

    const MIRRORS: [u32; 2] = [3, 2];

    fn read(folder: &TempDir, name: &str) -> Result<LightTable, String> {
        let light = ScanLight { file: name.into(), source: "-".to_owned() };
        light.read(folder.path(), MIRRORS).map_err(|error| error.to_string())
    }

    fn of_table(text: impl AsRef<[u8]>) -> Result<LightTable, String> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("light.csv"), text).unwrap();
        read(&folder, "light.csv")
    }

    fn of_gray<T: image::Primitive>(
        name: &str,
        width: u32,
        levels: &[T],
    ) -> Result<LightTable, String>
    where
        Luma<T>: image::PixelWithColorType<Subpixel = T>,
        [T]: image::EncodableLayout,
    {
        let folder = tempfile::tempdir().unwrap();
        let height = levels.len() as u32 / width;
        let gray = ImageBuffer::<Luma<T>, _>::from_raw(width, height, levels.to_vec()).unwrap();
        gray.save(folder.path().join(name)).unwrap();
        read(&folder, name)
    }

    #[test]
    fn tables_and_pictures_of_both_depths_are_the_same_light() {
        let table = of_table("\u{feff}# camera\n0, 0.2,0.4\n\n 0.6,0.8,1\r\n").unwrap();
        assert_eq!((table.mirrors, table.values.len()), (MIRRORS, 6));
        let bytes = [0_u8, 51, 102, 153, 204, 255];
        let words = bytes.map(|level| u16::from(level) * 257);
        for gray in [
            of_gray("light.png", 3, &bytes),
            of_gray("light.png", 3, &words),
            of_gray("light.pgm", 3, &bytes),
            of_gray("light.pgm", 3, &words),
        ] {
            let gray = gray.unwrap();
            assert_eq!(gray.mirrors, MIRRORS);
            let difference = gray.values.iter().zip(&table.values).map(|(a, b)| (a - b).abs());
            assert!(difference.fold(0.0, f32::max) < 1e-6, "{gray:?}");
        }
    }

    #[test]
    fn tables_that_are_no_light_are_refused_with_their_line() {
        for (text, words) in [
            ("", "this table has 0 rows, but 2 mirrors"),
            ("1,1,1\n", "1 row, but 2 mirrors"),
            ("1,1,1\n1,1,1\n1,1,1\n", "3 rows, but 2 mirrors"),
            ("# light\n1,1\n1,1,1\n", "line 2 has 2 numbers, but 3 mirrors"),
            ("1,1,1\n1,1,1,1\n", "line 2 has 4 numbers"),
            ("1;1;1\n1;1;1\n", "line 1 has 1 number, but 3 mirrors lie across"),
            ("1,1,1\n1,nan,1\n", "line 2, column 2: `nan` is not a number from 0 to 1"),
            ("1,1,1\n1,1,inf\n", "line 2, column 3"),
            ("-0.1,1,1\n1,1,1\n", "line 1, column 1: `-0.1`"),
            ("1,1,1.001\n1,1,1\n", "line 1, column 3"),
            ("1,,1\n1,1,1\n", "line 1, column 2: ``"),
            ("1,a\u{1b}b,1\n1,1,1\n", "`a b`"),
            ("0,0,-0\n0,0,0\n", "every mirror is dark"),
        ] {
            let error = of_table(text).unwrap_err();
            assert!(error.contains(words), "{text:?}: {error}");
        }
        assert!(of_table([b'1', 0xff]).unwrap_err().contains("byte 1 is not UTF-8"));
        let long = format!("#{}\n1,1,1\n1,1,1\n", " ".repeat((1 << 20) + 400));
        assert!(of_table(long).unwrap_err().contains("too many for 3x2 mirrors"));
        let wide = format!("{}\n", "9".repeat(1000));
        assert!(of_table(format!("1,1,{wide}1,1,1\n")).unwrap_err().len() < 200);
    }

    #[test]
    fn pictures_that_are_no_light_are_refused() {
        let error = of_gray("light.png", 2, &[255_u8; 6]).unwrap_err();
        assert!(error.contains("is 2x3, but the mirrors are 3x2"), "{error}");
        assert!(of_gray("light.png", 3, &[0_u8; 6]).unwrap_err().contains("dark"));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("light.png");
        ImageBuffer::from_pixel(3, 2, Rgb([9_u8; 3])).save(&path).unwrap();
        assert!(read(&folder, "light.png").unwrap_err().contains("Rgb8 pixels: write a gray"));
        assert!(read(&folder, ".").unwrap_err().contains("no file"));
        assert!(read(&folder, "none.png").is_err() && read(&folder, "none.csv").is_err());
        std::fs::write(&path, "no picture").unwrap();
        assert!(read(&folder, "light.png").unwrap_err().contains("gray PNG"));
    }

    #[test]
    fn damaged_pictures_are_refused_or_read_but_never_panic() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("light.png");
        let gray = ImageBuffer::from_raw(3, 2, vec![1_u8, 2, 3, 4, 5, 6]);
        ImageBuffer::<Luma<u8>, _>::save(&gray.unwrap(), &path).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for end in 0..whole.len() {
            std::fs::write(&path, &whole[..end]).unwrap();
            // Only the last bytes may be missing: they hold no pixels.
            assert!(read(&folder, "light.png").is_err() || end + 12 >= whole.len(), "{end}");
        }
        for at in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[at] ^= 0x55;
            std::fs::write(&path, damaged).unwrap();
            let _ = read(&folder, "light.png");
        }
    }

    #[test]
    fn huge_pictures_are_refused_before_they_are_decoded() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("light.pgm"), "P5 65535 65535 255\n").unwrap();
        let error = read(&folder, "light.pgm").unwrap_err();
        assert!(error.contains("65535x65535, but the mirrors are 3x2"), "{error}");
        let light = ScanLight { file: "light.pgm".into(), source: "-".to_owned() };
        let error = light.read(folder.path(), [65_535; 2]).unwrap_err();
        assert!(error.to_string().contains("4294836225 mirrors are too many"), "{error}");
    }
}
