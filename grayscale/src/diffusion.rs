//! Error diffusion.
//!
//! Sources: R. W. Floyd and L. Steinberg, An adaptive algorithm for spatial
//! greyscale, 1976: the shares that neighbours get. R. A. Ulichney, Digital
//! Halftoning, 1987: thresholds that vary, against worms and checkerboards.

use lamp_stack::{GrayMask, Mask, gray_runs};

use crate::blue_noise::{SCREEN, SIDE};
use crate::dots::{Dots, TooManyRuns};

/// Levels are counted in sixteenths, so that errors divide without loss.
const WHITE: i32 = 255 * 16;

/// Dithers by error diffusion, rows from the top, each from the left. Solid
/// black and white take no part: error that falls on them is dropped, so that
/// it cannot make dots where there is no gray.
///
/// A pixel's threshold is that of the blue-noise mask, which starts at `shift`:
/// other thresholds make other dots of the same density, so layers differ.
pub(crate) fn diffuse(gray: &GrayMask, shift: [u32; 2]) -> Result<Mask, TooManyRuns> {
    let width = gray.width();
    let mut dots = Dots::new(width);
    let mut errors = Errors::new(width);
    for (row, changes) in gray.rows().enumerate() {
        let thresholds = thresholds(SCREEN.row(row + shift[1] as usize));
        for (start, end, level) in gray_runs(changes, width) {
            if level == 255 {
                dots.push_white(start, end);
                continue;
            }
            let mut run = errors.of_run(start, end);
            dots.push_each(start, end, |column| {
                let place = column.wrapping_add(shift[0]) as usize % SIDE;
                run.settle(i32::from(level) * 16, thresholds[place])
            });
            errors.right = run.right;
        }
        errors.next_row();
        dots.finish_row()?;
    }
    Ok(dots.finish())
}

/// The thresholds of a row, in sixteenths of a level. They keep half of the
/// mask's distance from the middle: with more windows are less even, with less
/// more layers have the same dots.
fn thresholds(least: &[u8]) -> [i32; SIDE] {
    std::array::from_fn(|column| WHITE / 2 + (i32::from(least[column]) - 128) * 8)
}

/// The errors that wait for this row's and the next row's pixels. Both hold a
/// place more on each side, so that errors may fall off the image; column c
/// is at c + 1.
struct Errors {
    here: Vec<i32>,
    below: Vec<i32>,
    /// The runs that left something below, first column and end.
    touched: Vec<(usize, usize)>,
    touched_here: Vec<(usize, usize)>,
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

    /// The errors of the pixels from `start` to `end`, which are now settled.
    fn of_run(&mut self, start: u32, end: u32) -> RunErrors<'_> {
        let right = if self.right_column == start { self.right } else { 0 };
        self.right_column = end;
        let (start, end) = (start as usize, end as usize);
        self.touched.push((start, end));
        RunErrors {
            here: &self.here[start + 1..=end],
            below: &mut self.below[start..end + 2],
            right,
            settled: 0,
        }
    }

    fn next_row(&mut self) {
        for (start, end) in self.touched_here.drain(..) {
            self.here[start..end + 2].fill(0);
        }
        std::mem::swap(&mut self.here, &mut self.below);
        std::mem::swap(&mut self.touched_here, &mut self.touched);
        self.right_column = u32::MAX;
    }
}

/// The errors of a run's pixels, from the left.
struct RunErrors<'a> {
    /// What waits for the run's pixels.
    here: &'a [i32],
    /// What waits below them, and below their neighbours on both sides.
    below: &'a mut [i32],
    /// What waits for the next pixel from its left.
    right: i32,
    settled: usize,
}

impl RunErrors<'_> {
    /// Whether the next pixel becomes white; its error is passed on.
    fn settle(&mut self, level: i32, threshold: i32) -> bool {
        let at = self.settled;
        let wanted = level + self.here[at] + self.right;
        let white = wanted >= threshold;
        let error = wanted - if white { WHITE } else { 0 };
        let [right, left_below, right_below] = [7, 3, 1].map(|share| error * share / 16);
        self.below[at] += left_below;
        // What division leaves over goes straight down: nothing is lost.
        self.below[at + 1] += error - right - left_below - right_below;
        self.below[at + 2] += right_below;
        self.right = right;
        self.settled += 1;
        white
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
            let dots = diffuse(&flat(level, 200, 200), [0, 0]).unwrap();
            let expected = f64::from(level) / 255.0 * 40_000.0;
            // Errors leave only over the edges: at most one pixel for each
            // two on the rim.
            let white = dots.white_pixels() as f64;
            assert!((white - expected).abs() < 400.0, "{level}: {white} for {expected}");
        }
    }

    #[test]
    fn an_error_is_passed_on_whole_in_the_shares_of_the_paper() {
        let mut errors = Errors::new(3);
        let mut run = errors.of_run(1, 2);
        // An error of 160 sixteenths, and one that does not divide.
        assert!(!run.settle(160, WHITE / 2));
        assert_eq!((run.right, &*run.below), (70, &[30, 50, 10][..]));
        let mut run = errors.of_run(0, 1);
        assert!(run.settle(WHITE - 23, WHITE / 2));
        assert_eq!((run.right, run.below[0], run.below[2]), (-10, -4, 50 - 1));
        assert_eq!(run.below.iter().sum::<i32>() + run.right, 30 + 50 - 23);
    }

    #[test]
    fn rows_after_a_pause_start_without_error() {
        let mut gray = flat(120, 40, 3);
        let start = diffuse(&gray, [0, 0]).unwrap();
        for _ in 3..SIDE {
            gray.push_runs([]).unwrap();
        }
        gray.push_runs([(40, 120)]).unwrap();
        assert_eq!(diffuse(&gray, [0, 0]).unwrap().row(SIDE as u32), start.row(0));
    }
}
