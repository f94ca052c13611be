//! Simulates what a stack cures along one line of pixels.
//!
//! An exposure cures down from its layer's top to the depth of its gray level.
//! Exposures do not add up, light does not spread sideways, and what is cured stays
//! cured: the single-layer experiment of 002 figure 67, repeated layer by layer.

use lamp_stack::{Image, Length};

/// The intervals of height in which a vertical line is inside something, as from and to
/// in micrometers. They rise and do not touch.
pub type SolidHeights = Vec<[f64; 2]>;

/// A line of an image's pixels, counted from the left or the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelLine {
    /// A row.
    Row(u32),
    /// A column.
    Column(u32),
}

impl PixelLine {
    /// Returns the number of an image's pixels on the line.
    pub fn len(self, image: &Image) -> u32 {
        match self {
            Self::Row(_) => image.width(),
            Self::Column(_) => image.height(),
        }
    }

    /// Returns whether the line crosses an image.
    pub fn crosses(self, image: &Image) -> bool {
        match self {
            Self::Row(row) => row < image.height(),
            Self::Column(column) => column < image.width(),
        }
    }

    /// Returns the runs along the line that are not black. Neighbors may have one level.
    ///
    /// # Panics
    /// Panics if the line does not cross the image.
    pub fn runs(self, image: &Image) -> Vec<LineRun> {
        match self {
            Self::Row(row) => image.runs(row).collect(),
            Self::Column(column) => {
                assert!(column < image.width(), "the line crosses the image");
                let mut runs: Vec<LineRun> = Vec::new();
                for row in 0..image.height() {
                    match (level_at(image, row, column), runs.last_mut()) {
                        (0, _) => {}
                        (level, Some(run)) if run.1 == row && run.2 == level => run.1 += 1,
                        (level, _) => runs.push((row, row + 1, level)),
                    }
                }
                runs
            }
        }
    }
}

/// A run along a line: its first pixel, the one after its last, and its level.
pub type LineRun = (u32, u32, u8);

fn level_at(image: &Image, row: u32, column: u32) -> u8 {
    match image {
        Image::Mask(mask) => {
            let before = mask.row(row).partition_point(|&change| change <= column);
            if before % 2 == 1 { 255 } else { 0 }
        }
        Image::Gray(gray) => {
            let changes = gray.row(row);
            let before = changes.partition_point(|change| change.column <= column);
            before.checked_sub(1).map_or(0, |last| changes[last].level)
        }
    }
}

/// The heights that exposures have cured along a line.
///
/// ```
/// use lamp_grayscale::{CuredLine, PixelLine};
/// use lamp_stack::{Image, Length, Mask};
///
/// let image = Image::Mask(Mask::new(4, vec![0, 2], vec![1, 3]).unwrap());
/// let mut cured = CuredLine::default();
/// // White cures 150 um down from the layer's top at 100 um.
/// let depth = |level: u8| Length::from_um(150.0 * f64::from(level) / 255.0);
/// cured.expose(PixelLine::Row(0), &image, Length::from_um(100.0), depth);
/// assert_eq!(cured.pixels()[..2], [vec![], vec![[-50.0, 100.0]]]);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CuredLine {
    pixels: Vec<SolidHeights>,
}

impl CuredLine {
    /// Exposes a layer on top of those before: each pixel cures from `top` down by the
    /// depth of its level. Layers must come from the bottom up.
    ///
    /// # Panics
    /// Panics if the line does not cross the image.
    pub fn expose(
        &mut self,
        line: PixelLine,
        image: &Image,
        top: Length,
        depth_of: impl Fn(u8) -> Length,
    ) {
        self.expose_runs(&line.runs(image), line.len(image), top, depth_of);
    }

    /// Exposes a layer, given the runs along the line and its number of pixels.
    pub fn expose_runs(
        &mut self,
        runs: &[LineRun],
        pixels: u32,
        top: Length,
        depth_of: impl Fn(u8) -> Length,
    ) {
        self.pixels.resize(self.pixels.len().max(pixels as usize), SolidHeights::new());
        for &(start, end, level) in runs {
            let depth = depth_of(level).um();
            if depth > 0.0 {
                for solid in &mut self.pixels[start as usize..end as usize] {
                    cure(solid, [top.um() - depth, top.um()]);
                }
            }
        }
    }

    /// Returns the heights at which each pixel of the line is solid.
    pub fn pixels(&self) -> &[SolidHeights] {
        &self.pixels
    }
}

/// Layers this close touch: exposure times are rounded to the microsecond, which takes up to a
/// nanometer off the depth that just cures a layer.
const TOUCHING_UM: f64 = 2e-3;

/// Adds the interval that an exposure cures, merged with the intervals that it meets.
fn cure(solid: &mut SolidHeights, [mut from, to]: [f64; 2]) {
    while let Some(&[before, reached]) = solid.last() {
        if reached < from - TOUCHING_UM {
            break;
        }
        from = from.min(before);
        solid.pop();
    }
    solid.push([from, to]);
}

/// Heights of layers that touch differ in the last digits: they are sums of thicknesses.
const SAME_UM: f64 = 1e-6;

/// Adds an interval below a line's intervals, which come from the top down, and joins it with the
/// last of them where they touch.
pub fn add_below(solid: &mut SolidHeights, [from, to]: [f64; 2]) {
    match solid.last_mut() {
        Some(above) if above[0] <= to + SAME_UM => above[0] = from,
        _ => solid.push([from, to]),
    }
}

/// Returns the length of `a` that is outside `b`.
pub fn excess(a: &[[f64; 2]], b: &[[f64; 2]]) -> Length {
    let mut length = 0.0;
    for &[from, to] in a {
        let shared = |&[low, high]: &[f64; 2]| (high.min(to) - low.max(from)).max(0.0);
        length += to - from - b.iter().map(shared).sum::<f64>();
    }
    Length::from_um(length)
}

#[cfg(test)]
mod tests {
    use lamp_stack::GrayMask;

    use super::*;

    fn um(um: f64) -> Length {
        Length::from_um(um)
    }

    /// Rows of level 0, 100, 200 and 255, each twice.
    fn image() -> Image {
        let mut gray = GrayMask::new(9);
        for _ in 0..4 {
            gray.push_runs([(2, 0), (2, 100), (2, 200), (2, 255)]).unwrap();
        }
        Image::Gray(gray)
    }

    #[test]
    fn each_level_reaches_its_depth() {
        let depth_of = |level| um(f64::from(level));
        for (line, solids) in [
            (PixelLine::Row(1), vec![vec![], vec![[900.0, 1000.0]], vec![[745.0, 1000.0]]]),
            (PixelLine::Column(6), vec![vec![[745.0, 1000.0]]; 3]),
        ] {
            let mut cured = CuredLine::default();
            cured.expose(line, &image(), um(1000.0), depth_of);
            assert_eq!(cured.pixels().len(), line.len(&image()) as usize);
            for (pixel, solid) in [0, 3, 7].into_iter().zip(solids) {
                let of_column = matches!(line, PixelLine::Column(_));
                let pixel = if of_column { pixel / 3 } else { pixel };
                assert_eq!(cured.pixels()[pixel], solid, "{line:?} {pixel}");
            }
        }
        assert!(PixelLine::Row(3).crosses(&image()) && !PixelLine::Row(4).crosses(&image()));
        assert!(PixelLine::Column(8).crosses(&image()) && !PixelLine::Column(9).crosses(&image()));
    }

    #[test]
    fn layers_grow_together_or_leave_gaps() {
        let mut cured = CuredLine::default();
        for (top, depth) in [(100.0, 100.0), (200.0, 60.0), (300.0, 100.0), (400.0, 350.0)] {
            cured.expose(PixelLine::Row(0), &image(), um(top), |level| {
                um(if level == 255 { depth } else { 0.0 })
            });
            let expected: &[[f64; 2]] = match top as u32 {
                100 => &[[0.0, 100.0]],
                200 => &[[0.0, 100.0], [140.0, 200.0]],
                300 => &[[0.0, 100.0], [140.0, 300.0]],
                _ => &[[0.0, 400.0]],
            };
            assert_eq!(cured.pixels()[7], expected);
        }
        assert!(cured.pixels()[3].is_empty());
    }

    #[test]
    fn excess_is_what_the_other_lacks() {
        let a = [[0.0, 10.0], [20.0, 30.0]];
        let b = [[5.0, 22.0], [24.0, 25.0]];
        assert_eq!([excess(&a, &b), excess(&b, &a)].map(Length::um), [12.0, 10.0]);
        assert_eq!(
            [excess(&a, &[]), excess(&[], &a), excess(&a, &a)].map(Length::um),
            [20.0, 0.0, 0.0]
        );
    }
}
