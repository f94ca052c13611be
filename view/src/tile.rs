//! Tiles of images as PNG files.

use std::io;
use std::num::NonZeroU32;
use std::ops::Range;

use lamp_stack::{Image, mean_levels};

use crate::copies::Copies;

/// The width and height of a tile in pixels; at the right and lower border tiles have fewer.
pub(crate) const TILE_SIDE: u32 = 512;

/// A place in the pyramid of tiles of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TileAt {
    /// A pixel of the tile is the mean of 2^reduction x 2^reduction pixels.
    pub(crate) reduction: u32,
    /// The tile, counted from the left.
    pub(crate) x: u32,
    /// The tile, counted from the top.
    pub(crate) y: u32,
}

impl TileAt {
    /// Returns the side of the squares whose means are taken, and the columns and rows of the
    /// image, if there is such a tile.
    pub(crate) fn on(self, size: [u32; 2]) -> Option<(NonZeroU32, [Range<u32>; 2])> {
        let side = 1u32.checked_shl(self.reduction).and_then(NonZeroU32::new)?;
        // The address may name any reduction and place: products of both may exceed 32 bits.
        let step = u64::from(TILE_SIDE) * u64::from(side.get());
        let range = |at: u32, size: u32| {
            let start = u64::from(at).checked_mul(step)?;
            let start = u32::try_from(start).ok().filter(|&start| start < size)?;
            Some(start..(u64::from(start) + step).min(size.into()) as u32)
        };
        Some((side, [range(self.x, size[0])?, range(self.y, size[1])?]))
    }
}

/// How a tile's levels become colors.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Inks<'a> {
    /// Levels are shades of gray.
    Gray,
    /// Levels are the opacity of one color.
    One([u8; 3]),
    /// Levels are the opacity of the color of the copy in whose rectangle the pixel's middle is;
    /// beside copies, nothing is drawn.
    Each(&'a Copies),
}

/// Draws a tile of an image, if there is one at that place.
pub(crate) fn tile(image: &Image, at: TileAt, inks: Inks<'_>) -> Option<Vec<u8>> {
    let (side, [columns, rows]) = at.on([image.width(), image.height()])?;
    let size = [columns.len(), rows.len()].map(|pixels| pixels.div_ceil(side.get() as usize));
    let start = [columns.start, rows.start];
    let levels: Vec<u8> = mean_levels(image, columns, rows, side).flatten().collect();
    let pixels = match inks {
        Inks::Gray | Inks::One(_) => levels,
        Inks::Each(copies) => colored(copies, &levels, size, start, side),
    };
    Some(png(size.map(|pixels| pixels as u32), &pixels, inks).expect("memory takes any bytes"))
}

/// Returns red, green, blue and opacity of each pixel of a tile that begins at a column and a row.
fn colored(
    copies: &Copies,
    levels: &[u8],
    size: [usize; 2],
    start: [u32; 2],
    side: NonZeroU32,
) -> Vec<u8> {
    let mut pixels = vec![0; 4 * levels.len()];
    // The pixels of a tile whose middle is in a range of columns or rows.
    let within = |axis: usize, from: i64, length: u32| {
        let (half, side) = (i64::from(side.get() / 2), i64::from(side.get()));
        let first = |at: i64| {
            let pixel = at.saturating_sub(half).saturating_sub(i64::from(start[axis]));
            (pixel.saturating_add(side - 1).max(0) / side).min(size[axis] as i64) as usize
        };
        first(from)..first(from.saturating_add(length.into()))
    };
    // The first copy that holds a pixel names it, so it comes last.
    for copy in copies.all().iter().rev() {
        let [width, height] = copy.turned_size();
        let columns = within(0, copy.left, width);
        for row in within(1, copy.top, height) {
            for at in columns.clone().map(|column| row * size[0] + column) {
                pixels[4 * at..4 * at + 3].copy_from_slice(&copy.colour);
                pixels[4 * at + 3] = levels[at];
            }
        }
    }
    pixels
}

fn png([width, height]: [u32; 2], pixels: &[u8], inks: Inks<'_>) -> io::Result<Vec<u8>> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_depth(png::BitDepth::Eight);
    // The tile goes over the loopback address, where time counts more than bytes.
    encoder.set_compression(png::Compression::Fastest);
    match inks {
        Inks::Gray => encoder.set_color(png::ColorType::Grayscale),
        Inks::One(colour) => {
            // A palette of one color with 256 opacities takes one byte a pixel, not four.
            encoder.set_color(png::ColorType::Indexed);
            encoder.set_palette(colour.repeat(256));
            encoder.set_trns((0..=255).collect::<Vec<u8>>());
        }
        Inks::Each(_) => encoder.set_color(png::ColorType::Rgba),
    }
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroU8;

    use lamp_stack::{GrayMask, Mask};
    use proptest::prelude::*;

    use super::*;

    fn pixels(file: &[u8]) -> (u32, u32, Vec<u8>) {
        let mut decoder = png::Decoder::new(io::Cursor::new(file));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        (info.width, info.height, pixels)
    }

    #[test]
    fn tiles_cover_the_image_and_no_more() {
        let at = |reduction, x, y| TileAt { reduction, x, y }.on([1025, 512]);
        let side = |side| NonZeroU32::new(side).unwrap();
        assert_eq!(at(0, 2, 0), Some((side(1), [1024..1025, 0..512])));
        assert_eq!(at(1, 1, 0), Some((side(2), [1024..1025, 0..512])));
        assert_eq!(at(31, 0, 0), Some((side(1 << 31), [0..1025, 0..512])));
        for (reduction, x, y) in [(0, 3, 0), (0, 0, 1), (1, 2, 0), (32, 0, 0), (31, u32::MAX, 0)] {
            assert_eq!(at(reduction, x, y), None, "{reduction} {x} {y}");
        }
    }

    #[test]
    fn a_colour_s_opacity_is_the_level() {
        // `#.` over `##`.
        let image = Image::Mask(Mask::new(2, vec![0, 2, 3], vec![0, 1, 0]).unwrap());
        let at = |reduction| TileAt { reduction, x: 0, y: 0 };
        let drawn = pixels(&tile(&image, at(0), Inks::One([1, 2, 3])).unwrap());
        assert_eq!(drawn, (2, 2, vec![1, 2, 3, 255, 1, 2, 3, 0, 1, 2, 3, 255, 1, 2, 3, 255]));
        assert_eq!(pixels(&tile(&image, at(1), Inks::Gray).unwrap()), (1, 1, vec![191]));
    }
    /// The color of each pixel is the color of the first copy whose rectangle has its middle.
    #[test]
    fn tiles_have_the_colors_of_copies() {
        let tile_record = serde_json::json!({
            "part_pixels": [300, 500],
            "copies": [[-40, 7], [290, -100], [700, 650], [561, 0]],
            "turns": ["0", "90", "0", "0"],
        });
        let other = [("tile".to_owned(), tile_record)].into_iter().collect();
        let stack = lamp_stack::StackInfo { other, ..lamp_stack::StackInfo::default() };
        let info = lamp_stack::PageInfo { stack: Some(stack), ..lamp_stack::PageInfo::default() };
        let copies = Copies::of(&info);
        let image = Image::Mask(Mask::black(1100, 900).inverted());
        for (reduction, x, y) in [(0, 0, 0), (0, 1, 1), (0, 2, 0), (1, 0, 0), (3, 0, 0), (9, 0, 0)]
        {
            let drawn =
                pixels(&tile(&image, TileAt { reduction, x, y }, Inks::Each(&copies)).unwrap());
            let side = 1u32 << reduction;
            for (at, pixel) in (0..).zip(drawn.2.chunks_exact(4)) {
                let middle = |tile: u32, pixel: u32| (tile * TILE_SIDE + pixel) * side + side / 2;
                let [column, row] = [middle(x, at % drawn.0), middle(y, at / drawn.0)];
                let wanted =
                    copies.at(column, row).map(|copy| copies.all()[copy.number - 1].colour);
                let wanted = wanted.map_or([0; 4], |[r, g, b]| [r, g, b, 255]);
                assert_eq!(pixel, wanted, "{column} {row} at {reduction}");
            }
        }
    }

    /// Gray images of any size up to two and a half tiles, of long runs and of short ones.
    fn images() -> impl Strategy<Value = Image> {
        let side = || prop_oneof![1u32..40, 480..1300u32];
        (side(), side(), 0usize..400, any::<bool>(), any::<u64>()).prop_map(
            |(width, height, longest, is_mask, seed)| {
                let mut random = seed | 1;
                let mut next = move || {
                    // xorshift: G. Marsaglia, 2003.
                    random ^= random << 13;
                    random ^= random >> 7;
                    random ^= random << 17;
                    random
                };
                let mut gray = GrayMask::new(width);
                for _ in 0..height {
                    let mut left = width;
                    gray.push_runs(std::iter::from_fn(|| {
                        let run = left.min(1 + (next() % (longest as u64 + 1)) as u32);
                        left -= run;
                        (run > 0).then(|| (run, next() as u8))
                    }))
                    .unwrap();
                }
                let gray = Image::Gray(gray);
                if is_mask {
                    Image::Mask(gray.into_mask(NonZeroU8::new(128).unwrap()))
                } else {
                    gray
                }
            },
        )
    }

    /// The same, pixel by pixel.
    fn slow_tile(levels: &[Vec<u8>], at: TileAt) -> (u32, u32, Vec<u8>) {
        let [width, height] = [levels[0].len(), levels.len()];
        let side = 1usize << at.reduction;
        let starts = |tile: u32, size: usize| -> Vec<usize> {
            let first = tile as usize * 512 * side;
            (first..size.min(first + 512 * side)).step_by(side).collect()
        };
        let [columns, rows] = [starts(at.x, width), starts(at.y, height)];
        let mean = |top: usize, left: usize| {
            let (mut sum, mut pixels) = (0u64, 0u64);
            for row in &levels[top..height.min(top + side)] {
                for &level in &row[left..width.min(left + side)] {
                    sum += u64::from(level);
                    pixels += 1;
                }
            }
            (sum as f64 / pixels as f64).round() as u8
        };
        let means = rows.iter().flat_map(|&top| columns.iter().map(move |&left| (top, left)));
        (
            columns.len() as u32,
            rows.len() as u32,
            means.map(|(top, left)| mean(top, left)).collect(),
        )
    }

    fn painted(image: &Image) -> Vec<Vec<u8>> {
        let row = |row: u32| {
            let mut levels = vec![0; image.width() as usize];
            for (start, end, level) in image.runs(row) {
                levels[start as usize..end as usize].fill(level);
            }
            levels
        };
        (0..image.height()).map(row).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Every tile at a scale, of images as they are and as cured at a threshold.
        #[test]
        fn every_tile_is_the_mean_of_its_pixels(
            image in images(),
            reduction in 0u32..12,
            threshold in prop::option::of(1u8..),
        ) {
            let mut levels = painted(&image);
            let shown = match threshold.and_then(NonZeroU8::new) {
                Some(threshold) => {
                    let cured = |level: u8| if level >= threshold.get() { 255 } else { 0 };
                    levels.iter_mut().flatten().for_each(|level| *level = cured(*level));
                    Image::Mask(image.into_mask(threshold))
                }
                None => image,
            };
            let tiles = |size: u32| size.div_ceil(512 << reduction);
            for y in 0..=tiles(shown.height()) {
                for x in 0..=tiles(shown.width()) {
                    let at = TileAt { reduction, x, y };
                    let file = tile(&shown, at, Inks::Gray);
                    if x == tiles(shown.width()) || y == tiles(shown.height()) {
                        prop_assert!(file.is_none(), "{at:?}");
                        continue;
                    }
                    // Not by the macro, which would print millions of pixels.
                    prop_assert!(pixels(&file.unwrap()) == slow_tile(&levels, at), "{at:?}");
                }
            }
        }
    }
}
