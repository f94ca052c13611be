//! Height maps as PNG pictures: gray levels are heights.

use std::io::{BufRead, Seek};

use lamp_stack::Length;
use png::EncodingError;

use super::{GrayPicture, HeightMap, TargetError};

/// The scale of the pixels of a height map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapScale {
    /// The side of a pixel on the glass.
    pub pixel: Length,
    /// The height of full white.
    pub full: Length,
}

/// A height map, with its middle on the axis.
#[derive(Debug)]
pub(super) struct HeightPicture {
    name: String,
    picture: GrayPicture,
    scale: MapScale,
}

impl HeightPicture {
    /// Reads a PNG of gray levels, of 16 bits or 8.
    pub(super) fn read(
        name: &str,
        from: impl BufRead + Seek,
        scale: MapScale,
    ) -> Result<Self, TargetError> {
        let (pixel, full) = (scale.pixel, scale.full);
        if !(pixel.um() > 0.0 && pixel.um() <= 1e6 && full.um() > 0.0 && full.um() <= 1e6) {
            return Err(TargetError::Scale { pixel, full });
        }
        Ok(Self { name: name.to_owned(), picture: GrayPicture::read(from)?, scale })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn size_um(&self) -> [f64; 2] {
        [self.picture.columns, self.picture.rows].map(|count| count as f64 * self.scale.pixel.um())
    }

    /// Returns the height of the pixel that holds a point, 0 outside the picture.
    pub(super) fn height_um(&self, x: f64, y: f64) -> f64 {
        let pixel = self.scale.pixel.um();
        let [width, height] = [self.picture.columns, self.picture.rows].map(|count| count as f64);
        // The middle of the picture is on the axis, and its first row has the greatest y.
        let (column, row) = ((x / pixel + width / 2.0).floor(), (height / 2.0 - y / pixel).floor());
        if !((0.0..width).contains(&column) && (0.0..height).contains(&row)) {
            return 0.0;
        }
        let level = self.picture.levels[row as usize * self.picture.columns + column as usize];
        // Pictures of 8 bits were widened to 16 bits: full white is the same.
        f64::from(level) / f64::from(u16::MAX) * self.scale.full.um()
    }
}

impl HeightMap {
    /// Returns the map as a PNG of 16 bits, and its scale. [`Target::open`](super::Target::open)
    /// reads it.
    ///
    /// # Errors
    /// Returns an error if the map is empty, or larger than a PNG can be.
    pub fn to_png(&self) -> Result<(Vec<u8>, MapScale), EncodingError> {
        let highest_um = self.highest_um();
        let full_um = if highest_um > 0.0 { highest_um } else { 1.0 };
        let most = f64::from(u16::MAX);
        let level = |um: &f64| (um / full_um * most).round().clamp(0.0, most) as u16;
        let (columns, rows) = (self.grid.columns, self.grid.rows);
        let picture =
            GrayPicture { columns, rows, levels: self.heights_um.iter().map(level).collect() };
        let bytes = picture.to_png()?;
        let (pixel, full) = (Length::from_um(self.grid.pitch_um), Length::from_um(full_um));
        Ok((bytes, MapScale { pixel, full }))
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use png::{BitDepth, ColorType, Encoder};

    use super::*;
    use crate::target::Grid;

    const SCALE: MapScale = MapScale { pixel: Length::from_um(10.0), full: Length::from_um(500.0) };

    fn png(columns: u32, rows: u32, colour: ColorType, depth: BitDepth, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, columns, rows);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        bytes
    }

    fn read(bytes: &[u8]) -> Result<HeightPicture, String> {
        HeightPicture::read("map", Cursor::new(bytes), SCALE).map_err(|error| error.to_string())
    }

    #[test]
    fn levels_are_heights() {
        let data: Vec<u8> =
            [0_u16, 65535, 13107, 1].into_iter().flat_map(u16::to_be_bytes).collect();
        let map = read(&png(2, 2, ColorType::Grayscale, BitDepth::Sixteen, &data)).unwrap();
        assert_eq!(map.size_um(), [20.0, 20.0]);
        // The first row has the greatest y.
        let at = |x, y| map.height_um(x, y);
        assert_eq!([at(-5.0, 5.0), at(5.0, 5.0), at(-5.0, -5.0)], [0.0, 500.0, 100.0]);
        assert_eq!(
            [at(9.9, 9.9), at(10.1, 5.0), at(5.0, -10.1), at(f64::NAN, 0.0)],
            [500.0, 0.0, 0.0, 0.0]
        );
        let map = read(&png(1, 1, ColorType::Grayscale, BitDepth::Eight, &[51])).unwrap();
        assert_eq!(map.height_um(0.0, 0.0), 100.0);
    }

    #[test]
    fn a_written_map_reads_back() {
        let grid = Grid { columns: 3, rows: 2, pitch_um: 10.0 };
        let heights_um = vec![0.0, 20.0, 400.0, 123.456, 1e-3, 399.9];
        let map = HeightMap { grid, heights_um };
        let (bytes, scale) = map.to_png().unwrap();
        let read = HeightPicture::read("map", Cursor::new(&bytes), scale).unwrap();
        for (at, um) in map.heights_um.iter().enumerate() {
            let found = read.height_um(grid.x_um(at % 3), grid.y_um(at / 3));
            // Half a level.
            assert!((found - um).abs() <= 400.0 / 65535.0 / 2.0 + 1e-9, "{at}: {found}");
        }
        assert_eq!(read.height_um(10.0, 5.0), 400.0);
    }

    #[test]
    fn other_pictures_are_refused() {
        let colour = read(&png(1, 1, ColorType::Rgb, BitDepth::Eight, &[1, 2, 3])).unwrap_err();
        assert!(colour.contains("this has Rgb ones of 8 bits"), "{colour}");
        let whole = png(4, 4, ColorType::Grayscale, BitDepth::Eight, &[7; 16]);
        for end in [0, 8, 20, whole.len() - 20] {
            assert!(read(&whole[..end]).unwrap_err().contains("not a complete PNG"), "{end}");
        }
        let scale = MapScale { full: Length::from_um(f64::NAN), ..SCALE };
        assert!(HeightPicture::read("map", Cursor::new(&whole), scale).is_err());
    }
}
