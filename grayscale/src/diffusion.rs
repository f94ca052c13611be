//! Dithers by error diffusion.
//!
//! Sources: R. W. Floyd and L. Steinberg, An adaptive algorithm for spatial
//! greyscale, 1976: the shares of the neighbours. R. A. Ulichney, Digital
//! Halftoning, 1987: varied thresholds against worms and checkerboards.

use lamp_stack::{GrayMask, Mask, gray_runs};

use crate::blue_noise::{SCREEN, SIDE};
use crate::dots::{Dots, TooManyRuns};

/// Levels are counted in sixteenths, so that errors divide without loss.
const WHITE: i32 = 255 * 16;

/// Dithers by error diffusion, from the top row down, each row from the left. Errors that
/// fall on black and white are dropped, so that no dot appears where there is no gray.
///
/// The thresholds are those of the blue-noise mask from `shift` on. Other thresholds give
/// other dots of the same density, so layers differ.
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

/// Returns the thresholds of a row, in sixteenths of a level. They keep half of the mask's
/// distance from the middle: more makes windows less even, less gives more layers the same
/// dots.
fn thresholds(least: &[u8]) -> [i32; SIDE] {
    std::array::from_fn(|column| WHITE / 2 + (i32::from(least[column]) - 128) * 8)
}

/// The errors passed on to this row's and the next row's pixels. Both rows have an extra
/// place on each side for errors that fall off the image; column c is at c + 1.
struct Errors {
    here: Vec<i32>,
    below: Vec<i32>,
    /// The runs that passed errors down, as first column and end.
    touched: Vec<(usize, usize)>,
    touched_here: Vec<(usize, usize)>,
    /// The error that the last settled pixel passes to its right neighbour.
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

    /// Starts to settle the pixels from `start` to `end`.
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

/// The errors around a run's pixels, from the left.
struct RunErrors<'a> {
    /// The errors passed on to the run's pixels.
    here: &'a [i32],
    /// The errors passed on to the pixels below them and below their neighbours.
    below: &'a mut [i32],
    /// The error passed on to the next pixel from its left.
    right: i32,
    settled: usize,
}

impl RunErrors<'_> {
    /// Returns whether the next pixel becomes white, and passes its error on.
    fn settle(&mut self, level: i32, threshold: i32) -> bool {
        let at = self.settled;
        let wanted = level + self.here[at] + self.right;
        let white = wanted >= threshold;
        let error = wanted - if white { WHITE } else { 0 };
        let [right, left_below, right_below] = [7, 3, 1].map(|share| error * share / 16);
        self.below[at] += left_below;
        // The remainder of the divisions goes straight down: no error is lost.
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
