//! Copies of a part on a build area.
//!
//! Source: 002 section 2.4.2.

use std::sync::Arc;

use lamp_stack::{
    Dpi, Held, Image, Layer, Length, Mask, MaskBuilder, PageInfo, Size, StackInfo, map_in_order,
};
use serde_json::json;
use thiserror::Error;

/// Build areas are at most so wide and high, in pixels, as the images that a
/// stack's reader takes.
const LARGEST_SIDE: u32 = 1 << 26;

/// How a part is laid out.
#[derive(Clone, Copy, Debug)]
pub struct TileOptions {
    /// The build area.
    pub area: Size,
    /// How many copies; as many as fit where `None`.
    pub copies: Option<u32>,
    /// The least distance between two copies' images.
    pub gap: Length,
}

impl Default for TileOptions {
    /// As many copies as fit on the alpha machine (4 x 4.5 in, 002 table 1),
    /// 1 mm apart. The gap is ours: the seed gives none.
    fn default() -> Self {
        let [width, height] = [4.0, 4.5].map(|inch| Length::from_um(inch * 25_400.0));
        Self { area: Size { width, height }, copies: None, gap: Length::from_mm(1.0) }
    }
}

/// Why a part cannot be laid out.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TileError {
    /// Not one copy fits.
    #[error(
        "the part's image is {part} pixels, larger than the build area of {area} ({area_mm}): give a larger --area"
    )]
    TooLarge {
        /// Width and height of the image.
        part: Pixels,
        /// Width and height of the area.
        area: Pixels,
        /// The area as lengths.
        area_mm: Size,
    },
    /// Not all copies fit.
    #[error(
        "{asked} copies were asked for, but only {most} fit on the build area of {area_mm}: give a larger --area, a smaller --gap or fewer --copies"
    )]
    TooMany {
        /// The copies asked for.
        asked: u32,
        /// The copies that fit.
        most: u32,
        /// The area as lengths.
        area_mm: Size,
    },
    /// The build area is larger than any reader of stacks takes.
    #[error("the build area of {area_mm} is more than 2^26 pixels wide or high")]
    AreaTooLarge {
        /// The area as lengths.
        area_mm: Size,
    },
    /// The copies have more runs than an image can hold.
    #[error("{copies} copies of {layer} have more runs than an image can hold: place fewer")]
    TooManyRuns {
        /// How many copies.
        copies: usize,
        /// The layer's name.
        layer: String,
    },
    /// The resolution is not known, so lengths have no meaning in pixels.
    #[error("{layer} has no resolution, so the build area has no size in pixels")]
    NoResolution {
        /// The layer's name.
        layer: String,
    },
    /// A gray layer.
    #[error("{layer} is gray: dither the stack first")]
    Gray {
        /// The layer's name.
        layer: String,
    },
    /// A layer of another resolution than the first.
    #[error("{layer} has another resolution than the first layer: a stack has one")]
    OtherResolution {
        /// The layer's name.
        layer: String,
    },
    /// A layer is not like the first.
    #[error("{layer} is {found} pixels where the first layer is {expected}: a stack has one size")]
    OtherSize {
        /// The layer's name.
        layer: String,
        /// Its size.
        found: Pixels,
        /// The first layer's size.
        expected: Pixels,
    },
}

/// A width and a height in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pixels {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl std::fmt::Display for Pixels {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} x {}", self.width, self.height)
    }
}

/// Lays copies of each layer out on a black build area, in rows from the top
/// left, the whole centred. Where the copies stand follows from the first
/// layer and is stated on its page, in pixels.
pub fn tile<E: From<TileError> + Send>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    options: TileOptions,
) -> impl Iterator<Item = Result<Layer, E>> {
    let mut layout: Option<Arc<Layout>> = None;
    let placed = layers.map(move |layer| {
        let layer = layer?;
        let layout = match &layout {
            Some(layout) => Arc::clone(layout),
            None => Arc::clone(layout.insert(Arc::new(Layout::new(&layer, &options)?))),
        };
        Ok(ToPlace { layer, layout })
    });
    map_in_order(placed, |ToPlace { layer, layout }| Ok(layout.place(layer)?))
}

/// A layer and where its copies stand.
struct ToPlace {
    layer: Layer,
    layout: Arc<Layout>,
}

impl Held for ToPlace {
    /// What the copies will take.
    fn bytes(&self) -> usize {
        self.layer.bytes().saturating_mul(self.layout.copies())
    }
}

/// Where copies stand.
#[derive(Debug)]
struct Layout {
    dpi: Dpi,
    part: Pixels,
    area: Pixels,
    options: TileOptions,
    /// The left columns of the copies of each row of copies, and its top row.
    rows: Vec<(u32, Vec<u32>)>,
}

impl Layout {
    fn new(first: &Layer, options: &TileOptions) -> Result<Self, TileError> {
        let dpi = first.dpi.ok_or_else(|| TileError::NoResolution { layer: first.info.name() })?;
        let part = size_of_image(&first.image);
        let area = Pixels {
            width: whole_pixels(options.area.width, dpi),
            height: whole_pixels(options.area.height, dpi),
        };
        if area.width.max(area.height) > LARGEST_SIDE {
            return Err(TileError::AreaTooLarge { area_mm: options.area });
        }
        if part.width > area.width || part.height > area.height {
            return Err(TileError::TooLarge { part, area, area_mm: options.area });
        }
        let gap = (options.gap.pixels(dpi).max(0.0) - 1e-6).ceil().max(0.0) as u32;
        // Larger gaps than the area mean one copy a row as well.
        let gap = gap.min(LARGEST_SIDE);
        let fit = |area: u32, part: u32| (area - part) / (part + gap) + 1;
        let (columns, rows) = (fit(area.width, part.width), fit(area.height, part.height));
        let most = columns.saturating_mul(rows);
        let copies = options.copies.unwrap_or(most);
        if copies > most || copies == 0 {
            return Err(TileError::TooMany { asked: copies, most, area_mm: options.area });
        }
        let columns = columns.min(copies);
        let lefts = positions(area.width, part.width, gap, columns);
        let tops = positions(area.height, part.height, gap, copies.div_ceil(columns));
        let in_row = |row: u32| (copies - row * columns).min(columns) as usize;
        let rows = (0..).zip(tops).map(|(row, top)| (top, lefts[..in_row(row)].to_vec())).collect();
        Ok(Self { dpi, part, area, options: *options, rows })
    }

    /// How many copies there are.
    fn copies(&self) -> usize {
        self.rows.iter().map(|(_, lefts)| lefts.len()).sum()
    }

    fn place(&self, layer: Layer) -> Result<Layer, TileError> {
        let found = size_of_image(&layer.image);
        if found != self.part {
            let layer = layer.info.name();
            return Err(TileError::OtherSize { layer, found, expected: self.part });
        }
        if layer.dpi != Some(self.dpi) {
            return Err(TileError::OtherResolution { layer: layer.info.name() });
        }
        let copies = self.copies();
        if copies.saturating_mul(layer.image.changes() + 1) > u32::MAX as usize {
            return Err(TileError::TooManyRuns { copies, layer: layer.info.name() });
        }
        match layer.image {
            Image::Gray(_) => Err(TileError::Gray { layer: layer.info.name() }),
            Image::Mask(mask) => Ok(Layer {
                image: Image::Mask(self.place_mask(&mask)),
                info: self.page_info(layer.info),
                dpi: layer.dpi,
            }),
        }
    }

    fn place_mask(&self, part: &Mask) -> Mask {
        let mut build = MaskBuilder::new(self.area.width);
        build.reserve(self.area.height as usize, self.copies() * part.transition_count());
        let mut done = 0;
        let mut row = Vec::new();
        for (top, lefts) in &self.rows {
            build.push_black(top - done);
            for transitions in part.rows() {
                row.clear();
                lefts.iter().for_each(|&left| self.place_row(transitions, left, &mut row));
                build.push_row(&row).expect("copies stand side by side on the area");
            }
            done = top + part.height();
        }
        build.push_black(self.area.height - done);
        build.finish()
    }

    /// Adds a copy's row to a build row.
    fn place_row(&self, transitions: &[u32], left: u32, row: &mut Vec<u32>) {
        if transitions.first() == Some(&0) && row.last() == Some(&left) {
            // The copy before is white up to here, and this one goes on.
            row.pop();
            row.extend(transitions[1..].iter().map(|column| left + column));
        } else {
            row.extend(transitions.iter().map(|column| left + column));
        }
        let right = left + self.part.width;
        if transitions.len() % 2 == 1 && right < self.area.width {
            row.push(right);
        }
    }

    /// What the part's page says, for the build.
    fn page_info(&self, mut info: PageInfo) -> PageInfo {
        if let Some(stack) = &mut info.stack {
            self.describe(stack, info.origin_mm);
        }
        for part_rows in [&mut info.stray_rows, &mut info.open_rows] {
            let rows = self.rows.iter().flat_map(|(top, _)| part_rows.iter().map(move |r| top + r));
            *part_rows = rows.collect();
        }
        // Build coordinates start at the area's lower left corner.
        info.origin_mm = Some([0.0, self.options.area.height.mm()]);
        info
    }

    fn describe(&self, stack: &mut StackInfo, part_origin_mm: Option<[f64; 2]>) {
        let TileOptions { area, gap, .. } = self.options;
        let copies: Vec<_> = self
            .rows
            .iter()
            .flat_map(|(top, lefts)| lefts.iter().map(move |left| [left, top]))
            .collect();
        stack.commands.push(format!("tile --area {area} --copies {} --gap {gap}", copies.len()));
        let placed = json!({
            "part_pixels": [self.part.width, self.part.height],
            "part_origin_mm": part_origin_mm,
            "copies": copies,
        });
        stack.other.insert("tile".to_owned(), placed);
    }
}

/// Where `count` parts stand along a side, centred.
fn positions(area: u32, part: u32, gap: u32, count: u32) -> Vec<u32> {
    let used = count * part + (count - 1) * gap;
    (0..count).map(|i| (area - used) / 2 + i * (part + gap)).collect()
}

/// The whole pixels of a length, where one that misses by rounding counts.
fn whole_pixels(length: Length, dpi: Dpi) -> u32 {
    (length.pixels(dpi) + 1e-6) as u32
}

fn size_of_image(image: &Image) -> Pixels {
    Pixels { width: image.width(), height: image.height() }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn layer(mask: Mask) -> Layer {
        Layer { info: PageInfo::default(), dpi: Dpi::new(25.4), image: Image::Mask(mask) }
    }

    /// At 25.4 dpi, one pixel is one millimetre.
    fn options(area: &str, copies: Option<u32>, gap_mm: f64) -> TileOptions {
        TileOptions { area: area.parse().unwrap(), copies, gap: Length::from_mm(gap_mm) }
    }

    fn tiled(mask: Mask, options: &TileOptions) -> Result<Layer, TileError> {
        tile(std::iter::once(Ok(layer(mask))), *options).next().unwrap()
    }

    fn lefts_and_tops(options: &TileOptions) -> Vec<(u32, Vec<u32>)> {
        Layout::new(&layer(Mask::black(32, 20)), options).unwrap().rows
    }

    #[test]
    fn copies_fill_the_area_and_stand_centred() {
        let rows = lefts_and_tops(&options("100x50mm", None, 2.0));
        assert_eq!(rows, [(4, vec![0, 34, 68]), (26, vec![0, 34, 68])]);
        let rows = lefts_and_tops(&options("100x50mm", Some(2), 2.0));
        assert_eq!(rows, [(15, vec![17, 51])]);
        let rows = lefts_and_tops(&options("100x50mm", Some(4), 2.0));
        assert_eq!(rows[1].1.len(), 1);
        assert_eq!(lefts_and_tops(&options("32x20mm", None, 9.0)), [(0, vec![0])]);
    }

    #[test]
    fn what_does_not_fit_is_said() {
        let error = |area, copies| {
            tiled(Mask::black(32, 20), &options(area, copies, 2.0)).unwrap_err().to_string()
        };
        assert!(error("31x100mm", None).contains("32 x 20 pixels"));
        assert!(error("100x50mm", Some(7)).contains("only 6 fit"));
        assert!(error("1e7x1e7in", None).contains("2^26 pixels"));
        let mut foreign = layer(Mask::black(1, 1));
        foreign.dpi = None;
        let refused = tile(std::iter::once(Ok(foreign)), options("9x9mm", None, 1.0)).next();
        assert!(matches!(refused, Some(Err(TileError::NoResolution { .. }))));
    }

    #[test]
    fn layers_of_another_size_are_refused() {
        let layers = [layer(Mask::black(32, 20)), layer(Mask::black(32, 21))];
        let options = options("100x50mm", None, 2.0);
        let mut build = tile(layers.into_iter().map(Ok), options);
        assert!(build.next().unwrap().is_ok());
        assert!(matches!(build.next(), Some(Err(TileError::OtherSize { .. }))));
    }

    #[test]
    fn layers_of_another_resolution_are_refused() {
        let other = Layer { dpi: Dpi::new(50.8), ..layer(Mask::black(32, 20)) };
        let layers = [layer(Mask::black(32, 20)), other];
        let mut build = tile(layers.into_iter().map(Ok), options("100x50mm", None, 2.0));
        assert!(build.next().unwrap().is_ok());
        assert!(matches!(build.next(), Some(Err(TileError::OtherResolution { .. }))));
    }

    #[test]
    fn a_gap_of_any_size_leaves_one_copy() {
        assert_eq!(lefts_and_tops(&options("100x50mm", None, 1e30)), [(15, vec![34])]);
    }

    #[test]
    fn stray_rows_are_named_where_they_are_now() {
        let mut part = layer(Mask::black(32, 20));
        part.info.stray_rows = vec![3];
        part.info.open_rows = vec![3, 4];
        let options = options("100x50mm", None, 2.0);
        let build =
            tile(std::iter::once(Ok::<_, TileError>(part)), options).next().unwrap().unwrap();
        assert_eq!(build.info.stray_rows, [7, 29]);
        assert_eq!(build.info.open_rows, [7, 8, 29, 30]);
    }

    proptest! {
        #[test]
        fn every_copy_is_the_part_and_the_rest_is_black(
            rows in prop::collection::vec(prop::collection::btree_set(0u32..16, 0..9), 1..8),
            gap in 0u32..3,
            copies in 1u32..6,
        ) {
            let mut mask = MaskBuilder::new(16);
            for row in &rows {
                mask.push_row(&row.iter().copied().collect::<Vec<_>>()).unwrap();
            }
            let part = mask.finish();
            let options = options("55x40mm", Some(copies), f64::from(gap));
            let layout = Layout::new(&layer(part.clone()), &options).unwrap();
            let Image::Mask(build) = tiled(part.clone(), &options).unwrap().image else { panic!() };
            let mut white = 0;
            for (top, lefts) in &layout.rows {
                for left in lefts {
                    for pixel in 0..16 * part.height() {
                        let (column, row) = (pixel % 16, pixel / 16);
                        let expected = part.is_white(column, row);
                        prop_assert_eq!(build.is_white(left + column, top + row), expected);
                        white += u64::from(expected);
                    }
                }
            }
            prop_assert_eq!(build.white_pixels(), white);
        }
    }
}
