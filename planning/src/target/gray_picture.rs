//! PNG pictures of gray levels.

use std::io::{BufRead, Seek};

use png::{BitDepth, ColorType, Decoder, Encoder, EncodingError, Limits, Transformations};

use super::TargetError;

/// A picture with more pixels is rejected.
const MAX_PIXELS: u64 = 1 << 26;

/// A picture of gray levels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GrayPicture {
    /// Pixels of a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Row by row, 65535 for full white.
    pub levels: Vec<u16>,
}

impl GrayPicture {
    /// Reads a PNG of gray levels, of 16 bits or 8.
    ///
    /// # Errors
    /// Returns an error if the file is not a PNG, has colors, or has too many pixels.
    pub fn read(from: impl BufRead + Seek) -> Result<Self, TargetError> {
        let mut decoder = Decoder::new_with_limits(from, Limits { bytes: 1 << 28 });
        decoder.set_transformations(Transformations::IDENTITY);
        let mut reader = decoder.read_info()?;
        let info = reader.info();
        let (width, height) = (info.width, info.height);
        if u64::from(width) * u64::from(height) > MAX_PIXELS {
            return Err(TargetError::LargePicture { width, height });
        }
        let (colour, depth) = (info.color_type, info.bit_depth);
        let bytes_a_level = match (colour, depth) {
            (ColorType::Grayscale, BitDepth::Sixteen) => 2,
            (ColorType::Grayscale, BitDepth::Eight) => 1,
            _ => return Err(TargetError::NotGray { bits: depth as u8, colour }),
        };
        let (columns, rows) = (width as usize, height as usize);
        let mut bytes = vec![0; columns * rows * bytes_a_level];
        reader.next_frame(&mut bytes)?;
        reader.finish()?;
        let levels = match bytes_a_level {
            2 => bytes.chunks_exact(2).map(|two| u16::from_be_bytes([two[0], two[1]])).collect(),
            _ => bytes.iter().map(|&level| u16::from(level) * 257).collect(),
        };
        Ok(Self { columns, rows, levels })
    }

    /// Returns it as a PNG of 16 bits.
    ///
    /// # Errors
    /// Returns an error if it is empty, or larger than a PNG can be.
    pub fn to_png(&self) -> Result<Vec<u8>, EncodingError> {
        let levels: Vec<u8> = self.levels.iter().flat_map(|level| level.to_be_bytes()).collect();
        let [columns, rows] =
            [self.columns, self.rows].map(|count| u32::try_from(count).unwrap_or(0));
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, columns, rows);
        encoder.set_color(ColorType::Grayscale);
        encoder.set_depth(BitDepth::Sixteen);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&levels)?;
        writer.finish()?;
        Ok(bytes)
    }
}
