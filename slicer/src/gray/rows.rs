//! What a shaded row is made of: gray levels, or the depths of the part.

use lamp_stack::{DepthLevels, GrayMask, Image, LevelChange, MaskBuilder};

/// Rows that get the depth of the part below each pixel.
pub(crate) trait ShadedRows {
    /// What a pixel becomes.
    type Pixel: Copy + PartialEq;

    /// A pixel outside the part.
    const OUTSIDE: Self::Pixel;
    /// A pixel below which the part is deeper than it matters.
    const DEEP: Self::Pixel;

    /// Returns a pixel below which the part is so deep, in micrometres.
    fn of_depth(&self, depth_um: f64) -> Self::Pixel;

    /// Adds the next row, given the columns at which its pixels change.
    fn push_row(&mut self, changes: &[(u32, Self::Pixel)]);
}

/// Gray levels that cure each depth by themselves.
pub(crate) struct LevelRows<'a> {
    levels: &'a DepthLevels,
    changes: Vec<LevelChange>,
    image: GrayMask,
}

impl<'a> LevelRows<'a> {
    pub(crate) fn new(levels: &'a DepthLevels, width: u32) -> Self {
        Self { levels, changes: Vec::new(), image: GrayMask::new(width) }
    }

    pub(crate) fn finish(self) -> Image {
        finished(self.image)
    }
}

impl ShadedRows for LevelRows<'_> {
    type Pixel = u8;

    const OUTSIDE: u8 = 0;
    const DEEP: u8 = 255;

    #[inline]
    fn of_depth(&self, depth_um: f64) -> u8 {
        self.levels.level(lamp_stack::Length::from_um(depth_um))
    }

    fn push_row(&mut self, changes: &[(u32, u8)]) {
        self.changes.clear();
        self.changes.extend(changes.iter().map(|&(column, level)| LevelChange { column, level }));
        self.image.push_row(&self.changes).expect("changes come from the left");
    }
}

/// Returns an image: 1-bit if no pixel is gray.
pub(crate) fn finished(image: GrayMask) -> Image {
    if image.rows().flatten().any(|change| change.level % 255 != 0) {
        return Image::Gray(image);
    }
    let mut mask = MaskBuilder::new(image.width());
    for row in image.rows() {
        let transitions: Vec<u32> = row.iter().map(|change| change.column).collect();
        mask.push_row(&transitions).expect("levels change at increasing columns");
    }
    Image::Mask(mask.finish())
}

/// The depth of the part below each pixel of a layer, in micrometres from the layer's top: zero
/// outside, infinite where it is deeper than light reaches.
#[derive(Debug)]
pub(crate) struct DepthRows {
    width: u32,
    row_offsets: Vec<u32>,
    changes: Vec<(u32, f32)>,
}

impl DepthRows {
    pub(crate) fn new(width: u32) -> Self {
        Self { width, row_offsets: vec![0], changes: Vec::new() }
    }

    pub(crate) fn width(&self) -> u32 {
        self.width
    }

    pub(crate) fn height(&self) -> u32 {
        (self.row_offsets.len() - 1) as u32
    }

    /// Returns the columns of a row at which the depth changes, and the new depths.
    #[inline]
    pub(crate) fn row(&self, row: u32) -> &[(u32, f32)] {
        let [from, to] = [0, 1].map(|k| self.row_offsets[row as usize + k] as usize);
        &self.changes[from..to]
    }

    /// Returns the depth at a pixel.
    pub(crate) fn at(&self, row: u32, column: u32) -> f64 {
        let changes = self.row(row);
        let before = changes.partition_point(|&(start, _)| start <= column);
        before.checked_sub(1).map_or(0.0, |last| changes[last].1.into())
    }
}

impl ShadedRows for DepthRows {
    type Pixel = f32;

    const OUTSIDE: f32 = 0.0;
    const DEEP: f32 = f32::INFINITY;

    #[inline]
    fn of_depth(&self, depth_um: f64) -> f32 {
        depth_um.max(0.0) as f32
    }

    fn push_row(&mut self, changes: &[(u32, f32)]) {
        self.changes.extend_from_slice(changes);
        self.row_offsets.push(self.changes.len() as u32);
    }
}
