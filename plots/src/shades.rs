//! Pictures of pixels by kind, each kind in a color.

use std::io::{self, Write};
use std::ops::Range;

use lamp_stack::write_rgb_png;

use crate::picture::{PictureRegion, PictureScale, RowScale};

/// The least that is shown around a region, in pixels, and the share of its size.
const LEAST_AROUND: u32 = 16;
const SHARE_AROUND: u32 = 4;
/// The most that small regions are enlarged.
const MOST_ENLARGED: u32 = 8;

/// The kind of a pixel. Of several pixels that share a picture's, the greatest wins.
pub trait Shade: Copy + Ord {
    /// The kind that is not painted.
    const NONE: Self;

    /// Returns red, green and blue.
    fn color(self) -> [u8; 3];
}

/// A picture of a region and what is around it, reduced or enlarged to come near to a size.
pub struct ShadedPicture {
    region: PictureRegion,
    down: u32,
    up: u32,
    /// The height of a pixel of the image in widths.
    aspect: f64,
}

impl ShadedPicture {
    /// A picture whose longer side has at most `side` pixels, of a region on an image of a width
    /// and a height, whose pixels are `aspect` widths high.
    pub fn new(region: PictureRegion, [width, height]: [u32; 2], side: u32, aspect: f64) -> Self {
        let grow = |range: Range<u32>, end: u32| {
            let by = LEAST_AROUND.max((range.end - range.start) / SHARE_AROUND);
            range.start.saturating_sub(by)..range.end.saturating_add(by).min(end)
        };
        let region =
            PictureRegion { columns: grow(region.columns, width), rows: grow(region.rows, height) };
        let longer = region.longer_side(aspect).max(1);
        let [down, up] = [longer.div_ceil(side), (side / longer).clamp(1, MOST_ENLARGED)];
        Self { region, down, up, aspect }
    }

    /// Returns the part of the image that shows.
    pub(crate) fn region(&self) -> &PictureRegion {
        &self.region
    }

    /// Returns how many pixels of the picture a pixel of the image is wide and high.
    pub(crate) fn scale(&self) -> [f64; 2] {
        let across = f64::from(self.up) / f64::from(self.down);
        [across, across * self.aspect]
    }

    /// Returns how the rows that show become rows of the picture.
    fn row_scale(&self) -> RowScale {
        let scale = match self.down {
            1 => PictureScale::Up(self.up),
            down => PictureScale::Down(down),
        };
        RowScale::new(self.region.rows.clone(), scale, self.aspect)
    }

    /// Returns the picture's width and height.
    pub(crate) fn size(&self) -> [u32; 2] {
        let width = (self.region.columns.len() as u32).div_ceil(self.down) * self.up;
        [width, self.row_scale().height() as u32]
    }

    /// Writes the picture as a PNG. `shade` is called with each row of the image that shows, from
    /// the top, to paint runs of columns.
    pub fn write_png<S: Shade>(
        &self,
        out: impl Write,
        shade: impl FnMut(u32, &mut dyn FnMut(Range<u32>, S)),
    ) -> io::Result<()> {
        let [width, height] = self.size();
        write_rgb_png(out, width, height, self.rows(shade))
    }

    /// Returns the picture's rows of red, green and blue.
    pub(crate) fn rows<'a, S: Shade + 'a>(
        &'a self,
        mut shade: impl FnMut(u32, &mut dyn FnMut(Range<u32>, S)) + 'a,
    ) -> impl Iterator<Item = Vec<u8>> + 'a {
        let Self { region: PictureRegion { columns, .. }, down, up, .. } = self;
        self.row_scale().bands().flat_map(move |(band, times)| {
            let mut shades = vec![S::NONE; columns.len().div_ceil(*down as usize)];
            for row in band {
                shade(row, &mut |run, shade| {
                    let run = run.start.max(columns.start)..run.end.min(columns.end);
                    if !run.is_empty() {
                        let first = (run.start - columns.start) / down;
                        let end = (run.end - columns.start).div_ceil(*down);
                        let places = &mut shades[first as usize..end as usize];
                        // One pixel of a finding must show among all that share its place.
                        places.iter_mut().for_each(|place| *place = shade.max(*place));
                    }
                });
            }
            let wide = shades.iter().flat_map(|shade| shade.color().repeat(*up as usize));
            std::iter::repeat_n(wide.collect::<Vec<u8>>(), times)
        })
    }
}
