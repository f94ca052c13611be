//! Error diffusion.
//!
//! Source: R. W. Floyd and L. Steinberg, An adaptive algorithm for spatial
//! greyscale, 1976.

use lamp_stack::{GrayMask, Mask, MaskBuilder, gray_runs};

use crate::row::WhiteRuns;

/// Levels are counted in sixteenths, so that errors divide without loss.
const WHITE: i32 = 255 * 16;

/// Dithers by error diffusion, rows from the top, each from the left. Solid
/// black and white take no part: error that falls on them is dropped, so that
/// it cannot make dots where there is no gray.
pub(crate) fn diffuse(gray: &GrayMask) -> Mask {
    let width = gray.width();
    let mut mask = MaskBuilder::new(width);
    let mut white = WhiteRuns::default();
    let mut errors = Errors::new(width);
    for changes in gray.rows() {
        for (start, end, level) in gray_runs(changes, width) {
            if level == 255 {
                white.push(start, end);
                continue;
            }
            for column in start..end {
                if errors.settle(column, level) {
                    white.push(column, column + 1);
                }
            }
        }
        errors.next_row();
        white.finish(width, |row| mask.push_row(row).expect("runs come from the left"));
    }
    mask.finish()
}

/// The errors that wait for this row's and the next row's pixels. Both hold a
/// place more on each side, so that errors may fall off the image; column c
/// is at c + 1.
struct Errors {
    here: Vec<i32>,
    below: Vec<i32>,
    /// The columns where something waits below.
    touched: Vec<u32>,
    touched_here: Vec<u32>,
    /// What the last pixel settled gives to its right neighbour.
    right: i32,
    right_column: u32,
}

impl Errors {
    fn new(width: u32) -> Self {
        let places = width as usize + 2;
        Self {
            here: vec![0; places],
            below: vec![0; places],
            touched: Vec::new(),
            touched_here: Vec::new(),
            right: 0,
            right_column: u32::MAX,
        }
    }

    /// Whether a pixel becomes white; its error is passed on.
    fn settle(&mut self, column: u32, level: u8) -> bool {
        let at = column as usize + 1;
        let from_left = if self.right_column == column { self.right } else { 0 };
        let wanted = i32::from(level) * 16 + self.here[at] + from_left;
        let white = wanted * 2 >= WHITE;
        let error = wanted - if white { WHITE } else { 0 };
        let [right, left_below, right_below] = [7, 3, 1].map(|share| error * share / 16);
        self.below[at - 1] += left_below;
        self.below[at + 1] += right_below;
        // What division leaves over goes straight down: nothing is lost.
        self.below[at] += error - right - left_below - right_below;
        self.touched.push(column);
        (self.right, self.right_column) = (right, column + 1);
        white
    }

    fn next_row(&mut self) {
        for column in self.touched_here.drain(..) {
            self.here[column as usize..column as usize + 3].fill(0);
        }
        std::mem::swap(&mut self.here, &mut self.below);
        std::mem::swap(&mut self.touched_here, &mut self.touched);
        self.right_column = u32::MAX;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(level: u8, width: u32, height: u32) -> GrayMask {
        let mut gray = GrayMask::new(width);
        for _ in 0..height {
            gray.push_runs([(width, level)]).unwrap();
        }
        gray
    }

    #[test]
    fn the_mean_is_kept() {
        for level in [1, 13, 64, 127, 128, 200, 254] {
            let white = diffuse(&flat(level, 200, 200)).white_pixels() as f64;
            let expected = f64::from(level) / 255.0 * 40_000.0;
            // Errors leave only over the edges: at most one pixel for each
            // two on the rim.
            assert!((white - expected).abs() < 400.0, "{level}: {white} for {expected}");
        }
    }

    #[test]
    fn half_gray_is_a_checkerboard_at_its_start() {
        let dots = diffuse(&flat(128, 8, 2));
        assert_eq!(dots.row(0), [0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(dots.row(1), [1, 2, 3, 4, 5, 6, 7]);
    }

    #[test]
    fn rows_after_a_pause_start_without_error() {
        let mut gray = flat(120, 40, 3);
        gray.push_runs([]).unwrap();
        gray.push_runs([]).unwrap();
        gray.push_runs([(40, 120)]).unwrap();
        let dots = diffuse(&gray);
        assert_eq!(dots.row(5), dots.row(0));
    }
}
