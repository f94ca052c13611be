//! Draws layers as PNG pictures.

use std::fmt;
use std::io::{self, Write};
use std::num::NonZeroU32;
use std::ops::Range;
use std::str::FromStr;

use lamp_stack::{Image, mean_levels, mean_levels_of_bands, write_gray_png};

/// A rectangle of an image, in pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureRegion {
    /// The columns.
    pub columns: Range<u32>,
    /// The rows.
    pub rows: Range<u32>,
}

impl PictureRegion {
    /// The whole of an image.
    pub fn of(image: &Image) -> Self {
        Self { columns: 0..image.width(), rows: 0..image.height() }
    }

    /// Returns the smallest region that contains all but black.
    pub fn of_content(image: &Image) -> Option<Self> {
        let of_row = |row| {
            let mut runs = image.runs(row);
            let (start, end, _) = runs.next()?;
            // A single run is the first and the last.
            let end = runs.last().map_or(end, |(_, end, _)| end);
            Some(Self { columns: start..end, rows: row..row + 1 })
        };
        (0..image.height()).filter_map(of_row).reduce(Self::joined)
    }

    /// Returns the smallest region that contains both.
    pub fn joined(self, other: Self) -> Self {
        let join = |a: Range<u32>, b: Range<u32>| a.start.min(b.start)..a.end.max(b.end);
        Self { columns: join(self.columns, other.columns), rows: join(self.rows, other.rows) }
    }

    /// Returns its width or height, whichever is greater, in widths of a pixel.
    pub(crate) fn longer_side(&self, aspect: f64) -> u32 {
        let high = (self.rows.len() as f64 * aspect).ceil();
        (self.columns.len() as u32).max(high as u32)
    }

    /// Returns the part of the region that lies on the image, if any.
    pub fn on(&self, image: &Image) -> Option<Self> {
        let columns = self.columns.start..self.columns.end.min(image.width());
        let rows = self.rows.start..self.rows.end.min(image.height());
        (!columns.is_empty() && !rows.is_empty()).then_some(Self { columns, rows })
    }
}

impl FromStr for PictureRegion {
    type Err = String;

    /// Parses `X,Y,W,H`: the left column, the top row, width and height.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("`{text}` is not a region: write X,Y,W,H in pixels, as 1000,400,64,64");
        let numbers: Result<Vec<u32>, _> =
            text.split(',').map(|number| number.trim().parse()).collect();
        match numbers.as_deref() {
            Ok(&[x, y, width, height]) if width > 0 && height > 0 => {
                // `on` cuts off the part beyond the image.
                Ok(Self { columns: x..x.saturating_add(width), rows: y..y.saturating_add(height) })
            }
            _ => Err(wrong()),
        }
    }
}

/// How much larger or smaller a picture is than its region: in width. Rows follow by the aspect of
/// pixels, their height in widths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureScale {
    /// How many picture pixels an image pixel is wide.
    Up(u32),
    /// How many image pixels a picture pixel is wide.
    Down(u32),
}

/// The most that a picture enlarges or reduces.
const MAX_FACTOR: u32 = 1000;

impl PictureScale {
    /// The width and height of a region's picture, in pixels.
    pub fn size(self, region: &PictureRegion, aspect: f64) -> [u64; 2] {
        let [up, down] = self.factors().map(u64::from);
        let width = (region.columns.len() as u64 * up).div_ceil(down);
        [width, RowScale::new(region.rows.clone(), self, aspect).height()]
    }

    /// Returns by how much the picture is enlarged, and by how much reduced.
    fn factors(self) -> [u32; 2] {
        match self {
            Self::Up(up) => [up, 1],
            Self::Down(down) => [1, down],
        }
    }

    /// Returns the scale, at most 1, at which a region's picture is at most `side` pixels wide
    /// and high, as far as scales go.
    pub fn fitting(region: &PictureRegion, side: u32, aspect: f64) -> Self {
        let longer = region.longer_side(aspect);
        Self::Down(longer.div_ceil(side).clamp(1, MAX_FACTOR))
    }
}

impl fmt::Display for PictureScale {
    /// Writes `4` or `1/8`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Up(up) => write!(f, "{up}"),
            Self::Down(down) => write!(f, "1/{down}"),
        }
    }
}

impl FromStr for PictureScale {
    type Err = String;

    /// Parses `4` (each pixel as 4 x 4) or `1/8` (the mean of 8 x 8).
    fn from_str(text: &str) -> Result<Self, String> {
        let (scale, factor) = match text.split_once('/') {
            Some(("1", factor)) => (Self::Down as fn(u32) -> Self, factor),
            _ => (Self::Up as fn(u32) -> Self, text),
        };
        match factor.trim().parse() {
            Ok(factor @ 1..=MAX_FACTOR) => Ok(scale(factor)),
            _ => Err(format!("`{text}` is not a scale: write 4 to enlarge, 1/8 to reduce")),
        }
    }
}

/// How rows of an image become rows of a picture whose pixels are square.
pub(crate) struct RowScale {
    rows: Range<u32>,
    up: f64,
    down: f64,
}

impl RowScale {
    pub(crate) fn new(rows: Range<u32>, scale: PictureScale, aspect: f64) -> Self {
        let [up, down] = scale.factors().map(f64::from);
        Self { rows, up: up * aspect, down }
    }

    /// Returns the place in the picture of an edge between rows, given the rows above it.
    pub(crate) fn place(&self, rows: u32) -> u64 {
        (f64::from(rows) * self.up / self.down).round() as u64
    }

    /// Returns the height of the picture.
    pub(crate) fn height(&self) -> u64 {
        let count = self.rows.len() as u32;
        if self.up >= self.down {
            return self.place(count);
        }
        // The last row of the picture has at least one of the image, whatever rounding makes of it.
        let mut height = u64::from(count.min(self.place(count) as u32));
        while height > 0 && self.first(height - 1) >= count {
            height -= 1;
        }
        while self.first(height) < count {
            height += 1;
        }
        height
    }

    /// Returns the first row of the image in a row of a reduced picture, counted from the top.
    fn first(&self, row: u64) -> u32 {
        (row as f64 * self.down / self.up).round() as u32
    }

    /// Returns bands of the image's rows, and the number of rows of the picture for each.
    pub(crate) fn bands(self) -> impl Iterator<Item = (Range<u32>, usize)> {
        let (top, count) = (self.rows.start, self.rows.len() as u32);
        let is_enlarged = self.up >= self.down;
        let bands = if is_enlarged { u64::from(count) } else { self.height() };
        (0..bands).map(move |band| {
            if is_enlarged {
                let row = band as u32;
                let times = self.place(row + 1) - self.place(row);
                return (top + row..top + row + 1, times as usize);
            }
            let end = self.first(band + 1).min(count);
            (top + self.first(band)..top + end, 1)
        })
    }
}

/// A gray picture, made row by row.
pub struct Picture<'a> {
    /// Its width in pixels.
    pub width: u32,
    /// Its height in pixels.
    pub height: u32,
    rows: Box<dyn Iterator<Item = Vec<u8>> + 'a>,
}

impl<'a> Picture<'a> {
    /// A picture of a region, which must lie on the image, whose pixels are `aspect` widths high.
    /// It is made row by row, so a large layer takes little memory.
    pub fn new(image: &'a Image, region: PictureRegion, scale: PictureScale, aspect: f64) -> Self {
        let [width, height] = scale.size(&region, aspect).map(|side| side as u32);
        let [up, down] = scale.factors();
        let side = NonZeroU32::new(down).expect("scales are not zero");
        let PictureRegion { columns, rows } = region;
        let bands = || RowScale::new(rows.clone(), scale, aspect).bands();
        let means = bands().map(|(band, _)| band);
        let means = mean_levels_of_bands(image, columns, means, side);
        let rows = means.zip(bands()).flat_map(move |(row, (_, times))| {
            let wide: Vec<u8> =
                row.iter().flat_map(|&level| std::iter::repeat_n(level, up as usize)).collect();
            std::iter::repeat_n(wide, times)
        });
        Self { width, height, rows: Box::new(rows) }
    }

    /// A picture of rows of `width` levels.
    pub fn from_rows(width: u32, height: u32, rows: impl Iterator<Item = Vec<u8>> + 'a) -> Self {
        Self { width, height, rows: Box::new(rows) }
    }

    /// Returns the rows of levels.
    pub fn into_rows(self) -> impl Iterator<Item = Vec<u8>> {
        self.rows
    }

    /// Pictures of one height side by side, with a gray gutter between.
    pub fn side_by_side(pictures: Vec<Self>) -> Self {
        const GUTTER: usize = 8;
        let count = pictures.len() as u32;
        let width = pictures.iter().map(|p| p.width).sum::<u32>() + (count - 1) * GUTTER as u32;
        let height = pictures.iter().map(|p| p.height).min().unwrap_or(0);
        let mut rows: Vec<_> = pictures.into_iter().map(|picture| picture.rows).collect();
        let joined = (0..height).map(move |_| {
            let parts: Vec<Vec<u8>> = rows.iter_mut().filter_map(Iterator::next).collect();
            parts.join(&[128; GUTTER][..])
        });
        Self { width, height, rows: Box::new(joined) }
    }

    /// Writes the picture as an 8-bit gray PNG.
    pub fn write_png(self, out: impl Write) -> io::Result<()> {
        write_gray_png(out, self.width, self.height, self.rows)
    }
}

/// The rows of a region, which must lie on the image, level by level.
pub fn levels_of_region<'a>(
    image: &'a Image,
    region: &PictureRegion,
) -> impl Iterator<Item = Vec<u8>> + 'a {
    mean_levels(image, region.columns.clone(), region.rows.clone(), NonZeroU32::MIN)
}

#[cfg(test)]
mod tests {
    use lamp_stack::{GrayMask, Mask};

    use super::*;

    fn rows(picture: Picture<'_>) -> Vec<Vec<u8>> {
        let rows: Vec<_> = picture.rows.collect();
        assert_eq!(rows.len(), picture.height as usize);
        assert!(rows.iter().all(|row| row.len() == picture.width as usize));
        rows
    }

    fn image() -> Image {
        // `.##.#` and `#####`.
        Image::Mask(Mask::new(5, vec![0, 3, 4], vec![1, 3, 4, 0]).unwrap())
    }

    #[test]
    fn pixels_are_copied_enlarged_and_averaged() {
        let image = image();
        let all = PictureRegion::of(&image);
        let picture = |scale| rows(Picture::new(&image, all.clone(), scale, 1.0));
        assert_eq!(picture(PictureScale::Up(1)), [[0, 255, 255, 0, 255], [255; 5]]);
        assert_eq!(picture(PictureScale::Up(2))[1], [0, 0, 255, 255, 255, 255, 0, 0, 255, 255]);
        assert_eq!(picture(PictureScale::Down(2)), [[191, 191, 255]]);
    }

    #[test]
    fn a_region_is_cut_to_the_image() {
        let image = image();
        let region: PictureRegion = "3,1,99,99".parse().unwrap();
        let region = region.on(&image).unwrap();
        assert_eq!(rows(Picture::new(&image, region, PictureScale::Up(1), 1.0)), [[255, 255]]);
        assert_eq!("5,0,1,1".parse::<PictureRegion>().unwrap().on(&image), None);
        for wrong in ["", "1,2,3", "1,2,0,4", "a,b,c,d", "1,2,3,4,5"] {
            assert!(wrong.parse::<PictureRegion>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn content_is_found() {
        let mask = Mask::new(9, vec![0, 0, 2, 3, 3], vec![3, 5, 8]).unwrap();
        let region = PictureRegion::of_content(&Image::Mask(mask)).unwrap();
        assert_eq!(region, PictureRegion { columns: 3..9, rows: 1..3 });
        assert_eq!(PictureRegion::of_content(&Image::Mask(Mask::black(9, 9))), None);
    }

    /// The middle third of the image's rows is white, and so is the middle third of the picture.
    #[test]
    fn rows_are_as_high_as_pixels() {
        for (scale, aspect) in [
            (PictureScale::Up(1), 19.0 / 14.0),
            (PictureScale::Up(3), 19.0 / 14.0),
            (PictureScale::Up(1), 14.0 / 19.0),
            (PictureScale::Up(2), 14.0 / 19.0),
            (PictureScale::Down(2), 19.0 / 14.0),
            (PictureScale::Down(7), 14.0 / 19.0),
            (PictureScale::Up(1), 0.001),
        ] {
            let count = 300;
            let mut rows = vec![vec![]; 100];
            rows.extend(vec![vec![0]; 100]);
            rows.extend(vec![vec![]; 100]);
            let mut mask = lamp_stack::MaskBuilder::new(90);
            rows.iter().for_each(|row| mask.push_row(row).unwrap());
            let image = Image::Mask(mask.finish());
            let [up, down] = scale.factors().map(f64::from);
            let high = f64::from(count) * aspect * up / down;
            let drawn = self::rows(Picture::new(&image, PictureRegion::of(&image), scale, aspect));
            assert!((drawn.len() as f64 - high).abs() <= 1.0, "{scale:?} {aspect}");
            for (k, row) in drawn.iter().enumerate() {
                // Within a row of the picture of the edges, either may be.
                let place = (k as f64 + 0.5) / high * 3.0;
                let is_near = (place - 1.0).abs().min((place - 2.0).abs()) < 3.0 / high;
                let level = if (1.0..2.0).contains(&place) { 255 } else { 0 };
                assert!(is_near || row[0] == level, "{scale:?} {aspect} {k}");
            }
        }
    }

    #[test]
    fn scales_parse() {
        assert_eq!("4".parse(), Ok(PictureScale::Up(4)));
        assert_eq!("1/8".parse(), Ok(PictureScale::Down(8)));
        for wrong in ["", "0", "1/0", "2/3", "-1", "0.5", "1/5000"] {
            assert!(wrong.parse::<PictureScale>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_picture_is_reduced_to_fit() {
        let fitting = |width: u32, height, side| {
            let region = PictureRegion { columns: 5..5 + width, rows: 0..height };
            PictureScale::fitting(&region, side, 1.0)
        };
        assert_eq!(fitting(400, 10, 400), PictureScale::Down(1));
        assert_eq!(fitting(401, 10, 400), PictureScale::Down(2));
        assert_eq!(fitting(10, 1201, 400), PictureScale::Down(4));
        assert_eq!(fitting(1 << 26, 1, 1), PictureScale::Down(1000));
    }

    #[test]
    fn gray_levels_show_and_a_png_reads_back() {
        let mut gray = GrayMask::new(4);
        gray.push_runs([(1, 0), (2, 100), (1, 255)]).unwrap();
        let image = Image::Gray(gray);
        let mut png = Vec::new();
        Picture::new(&image, PictureRegion::of(&image), PictureScale::Up(1), 1.0)
            .write_png(&mut png)
            .unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut pixels = vec![0; 4];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, [0, 100, 100, 255]);
    }

    #[test]
    fn pictures_stand_side_by_side() {
        let image = image();
        let one = || Picture::new(&image, PictureRegion::of(&image), PictureScale::Up(1), 1.0);
        let both = rows(Picture::side_by_side(vec![one(), one()]));
        assert_eq!(both[0][..6], [0, 255, 255, 0, 255, 128]);
        assert_eq!(both[1].len(), 18);
    }
}
