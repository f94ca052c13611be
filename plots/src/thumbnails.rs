//! Small pictures of many layers: as a contact sheet, or as an animation.

use std::io::{self, Write};

use lamp_stack::{Layer, Pitch, write_gray_animation};

use crate::PlotError;
use crate::caption::{CAPTION_HEIGHT, caption};
use crate::picture::{Picture, PictureRegion, PictureScale};

/// The level around thumbnails and behind their captions. Neither black nor white, so that the
/// edges of images show.
const BACKGROUND: u8 = 72;
/// The pixels between the thumbnails of a sheet.
const GUTTER: usize = 12;
/// A sheet is as much wider than high, about.
const SHEET_ASPECT: f64 = 1.4;

/// A small picture of a layer and its name.
pub struct Thumbnail {
    rows: Vec<Vec<u8>>,
    caption: Vec<Vec<u8>>,
}

impl Thumbnail {
    /// Draws a region of a layer, which must lie on its image.
    ///
    /// # Errors
    /// Returns an error if the layer's name cannot be drawn.
    pub fn new(
        layer: &Layer,
        region: PictureRegion,
        scale: PictureScale,
    ) -> Result<Self, PlotError> {
        let aspect = layer.pitch.map_or(1.0, Pitch::aspect);
        let rows = Picture::new(&layer.image, region, scale, aspect).into_rows().collect();
        Ok(Self { rows, caption: caption(&layer.info.name(), BACKGROUND)? })
    }

    /// Returns the rows of the thumbnail above its name, filled up to a size.
    fn framed(&self, size: CellSize) -> impl Iterator<Item = Vec<u8>> {
        let empty = size.height - self.rows.len();
        let rows = self.rows.iter().chain(&self.caption);
        let filled = rows.map(move |row| {
            let mut row = row.clone();
            row.resize(size.width, BACKGROUND);
            row
        });
        filled.chain(std::iter::repeat_n(vec![BACKGROUND; size.width], empty))
    }
}

/// The size of the largest thumbnail, in pixels, without its caption.
#[derive(Clone, Copy)]
struct CellSize {
    width: usize,
    height: usize,
}

impl CellSize {
    fn of(thumbnails: &[Thumbnail]) -> Self {
        let widths = thumbnails.iter().flat_map(|each| [&each.rows, &each.caption]);
        Self {
            width: widths.map(|rows| rows.first().map_or(0, Vec::len)).max().unwrap_or(0),
            height: thumbnails.iter().map(|each| each.rows.len()).max().unwrap_or(0),
        }
    }

    fn height_with_caption(self) -> usize {
        self.height + CAPTION_HEIGHT as usize
    }
}

/// Puts thumbnails on a sheet, row by row from the top left.
pub fn contact_sheet(thumbnails: Vec<Thumbnail>) -> Picture<'static> {
    let cell = CellSize::of(&thumbnails);
    let (cell_width, cell_height) = (cell.width + GUTTER, cell.height_with_caption() + GUTTER);
    // Columns c and rows n / c with c · width = aspect · height · n / c: c is the root of this.
    let across = SHEET_ASPECT * (thumbnails.len() * cell_height) as f64 / cell_width as f64;
    let columns = (across.sqrt().round() as usize).clamp(1, thumbnails.len());
    let width = columns * cell_width + GUTTER;
    let height = thumbnails.len().div_ceil(columns) * cell_height + GUTTER;
    let blank = move || std::iter::repeat_n(vec![BACKGROUND; width], GUTTER);
    let mut thumbnails = thumbnails.into_iter();
    let bands = std::iter::from_fn(move || {
        let band: Vec<Thumbnail> = thumbnails.by_ref().take(columns).collect();
        (!band.is_empty()).then_some(band)
    });
    let rows = bands.flat_map(move |band| {
        let mut rows = vec![vec![BACKGROUND; GUTTER]; cell.height_with_caption()];
        for thumbnail in band {
            for (row, part) in rows.iter_mut().zip(thumbnail.framed(cell)) {
                row.extend(part);
                row.extend([BACKGROUND; GUTTER]);
            }
        }
        // The last band may have fewer thumbnails.
        rows.iter_mut().for_each(|row| row.resize(width, BACKGROUND));
        blank().chain(rows)
    });
    Picture::from_rows(width as u32, height as u32, rows.chain(blank()))
}

/// Writes thumbnails as an animated PNG.
pub fn write_animation(
    thumbnails: &[Thumbnail],
    per_second: u16,
    out: impl Write,
) -> io::Result<()> {
    let cell = CellSize::of(thumbnails);
    let size = [cell.width as u32, cell.height_with_caption() as u32];
    let pictures = thumbnails.iter().map(|each| each.framed(cell).flatten().collect());
    write_gray_animation(out, size, per_second, pictures)
}
