//! Dithers by error diffusion.
//!
//! Sources: R. W. Floyd and L. Steinberg, An adaptive algorithm for spatial
//! greyscale, 1976, and F. Sierra, LIBVGA, 1990 ("Filter Lite"): the shares of the
//! neighbors. R. A. Ulichney, Digital Halftoning, 1987: rows that turn, and varied
//! thresholds, against worms and checkerboards.

use std::ops::Range;

use lamp_stack::{GrayMask, Mask, gray_runs};

use crate::blue_noise::{SCREEN, SIDE};
use crate::dots::{Dots, TooManyRuns};

/// Levels are counted in sixteenths, so that errors divide without loss.
const WHITE: i32 = 255 * 16;

/// How errors are passed on.
pub(crate) struct ErrorDiffusion {
    /// The sixteenths of a pixel's error that the next pixel gets.
    ahead: i32,
    /// The sixteenths for the pixels below the one before and below the next. The rest of the error
    /// goes straight down.
    below: [i32; 2],
    /// How much of the mask's thresholds differ from the middle, in sixteenths. The more, the
    /// better dots of a layer fill the holes of others, and the less even is a layer.
    strength: i32,
    /// Whether every other row goes from the right.
    turns: bool,
}

/// The strength with which thresholds differ as the mask's do.
const ALL: i32 = 16;

pub(crate) static FLOYD_STEINBERG: ErrorDiffusion =
    ErrorDiffusion { ahead: 7, below: [3, 1], strength: ALL, turns: false };

/// Thresholds differ just enough to make other dots in each layer.
pub(crate) static SIERRA_LITE: ErrorDiffusion =
    ErrorDiffusion { ahead: 8, below: [4, 0], strength: 1, turns: true };

impl ErrorDiffusion {
    /// Dithers from the top row down. Errors that fall on black and white are dropped, so that
    /// no dot appears where there is no gray.
    ///
    /// The thresholds are the blue-noise mask's from `shift` on. Other thresholds give other dots
    /// of the same density, so layers differ.
    pub(crate) fn dither(&self, gray: &GrayMask, shift: [u32; 2]) -> Result<Mask, TooManyRuns> {
        let width = gray.width();
        let mut dots = Dots::new(width);
        let mut errors = Errors::new(width);
        // Of gray pixels alone.
        let mut is_white = vec![false; width as usize];
        let mut runs: Vec<(u32, u32, u8)> = Vec::new();
        for (row, changes) in gray.rows().enumerate() {
            runs.clear();
            runs.extend(gray_runs(changes, width));
            // Equal thresholds would settle a flat gray the same way in every layer, and holes of
            // layers would lie on each other.
            let mask = SCREEN.row(row + shift[1] as usize);
            let least = |column: usize| mask[column.wrapping_add(shift[0] as usize) % SIDE];
            let settle = |&(start, end, level): &(u32, u32, u8)| {
                let columns = start as usize..end as usize;
                let whites = &mut is_white[columns.clone()];
                let level = i32::from(level) * 16;
                if self.turns && row % 2 == 1 {
                    self.settle::<false>(errors.of_run(columns), level, least, whites);
                } else {
                    self.settle::<true>(errors.of_run(columns), level, least, whites);
                }
            };
            let gray_ones = runs.iter().filter(|run| run.2 < 255);
            if self.turns && row % 2 == 1 {
                gray_ones.rev().for_each(settle);
            } else {
                gray_ones.for_each(settle);
            }
            errors.next_row();
            for &(start, end, level) in &runs {
                match level {
                    255 => dots.push_white(start, end),
                    _ => dots.push_each(start, end, |column| is_white[column as usize]),
                }
            }
            dots.finish_row()?;
        }
        Ok(dots.finish())
    }

    /// Settles the pixels of a run, to the right or to the left, and passes their errors on.
    fn settle<const TO_RIGHT: bool>(
        &self,
        run: RunErrors<'_>,
        level: i32,
        least: impl Fn(usize) -> u8,
        is_white: &mut [bool],
    ) {
        let RunErrors { columns, here, below, ahead: carried } = run;
        let count = is_white.len();
        // Below and next to black and white few errors come in: the mask makes the first dots.
        let strength = if here.iter().all(|&error| error == 0) { ALL } else { self.strength };
        let [before, next] = if TO_RIGHT { [0, 2] } else { [2, 0] };
        let edge = if TO_RIGHT { columns.start } else { columns.end };
        let is_start = carried.edge != edge;
        let mut ahead = carried.from(edge);
        for k in 0..count {
            let at = if TO_RIGHT { k } else { count - 1 - k };
            // Floyd and Steinberg (1976): the nearest of black and white, by the level and all
            // errors that have come in.
            let wanted = level + here[at] + ahead;
            let strength = if k == 0 && is_start { ALL } else { strength };
            let varied = (i32::from(least(columns.start + at)) - 128) * strength;
            is_white[at] = wanted >= WHITE / 2 + varied;
            let error = wanted - if is_white[at] { WHITE } else { 0 };
            let [to_ahead, to_before, to_next] =
                [self.ahead, self.below[0], self.below[1]].map(|share| error * share / 16);
            below[at + before] += to_before;
            below[at + next] += to_next;
            // The remainder of the divisions goes straight down: no error is lost.
            below[at + 1] += error - to_ahead - to_before - to_next;
            ahead = to_ahead;
        }
        let edge = if TO_RIGHT { columns.end } else { columns.start };
        *carried = Ahead { error: ahead, edge };
    }
}

/// The errors passed on to this row's and the next row's pixels. Both rows have an extra
/// place on each side for errors that fall off the image; column c is at c + 1.
struct Errors {
    here: Vec<i32>,
    below: Vec<i32>,
    /// The runs that passed errors down.
    touched: Vec<Range<usize>>,
    touched_here: Vec<Range<usize>>,
    ahead: Ahead,
}

/// The error that the last settled pixel passes to the next one, which is beyond an edge.
struct Ahead {
    error: i32,
    edge: usize,
}

impl Ahead {
    const NONE: Self = Self { error: 0, edge: usize::MAX };

    /// Returns the error for the pixel beyond an edge.
    fn from(&self, edge: usize) -> i32 {
        if self.edge == edge { self.error } else { 0 }
    }
}

/// The errors around a run's pixels.
struct RunErrors<'a> {
    columns: Range<usize>,
    /// The errors passed on to the run's pixels.
    here: &'a [i32],
    /// The errors passed on to the pixels below them and below their neighbors.
    below: &'a mut [i32],
    ahead: &'a mut Ahead,
}

impl Errors {
    fn new(width: u32) -> Self {
        let places = width as usize + 2;
        Self {
            here: vec![0; places],
            below: vec![0; places],
            touched: Vec::new(),
            touched_here: Vec::new(),
            ahead: Ahead::NONE,
        }
    }

    fn of_run(&mut self, columns: Range<usize>) -> RunErrors<'_> {
        self.touched.push(columns.clone());
        RunErrors {
            here: &self.here[columns.start + 1..=columns.end],
            below: &mut self.below[columns.start..columns.end + 2],
            ahead: &mut self.ahead,
            columns,
        }
    }

    fn next_row(&mut self) {
        // Only what was touched is cleared: a row may be wide and hold little gray.
        for run in self.touched_here.drain(..) {
            self.here[run.start..run.end + 2].fill(0);
        }
        std::mem::swap(&mut self.here, &mut self.below);
        std::mem::swap(&mut self.touched_here, &mut self.touched);
        self.ahead = Ahead::NONE;
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
        for (level, method) in [1, 13, 64, 127, 128, 200, 254]
            .into_iter()
            .flat_map(|level| [(level, &FLOYD_STEINBERG), (level, &SIERRA_LITE)])
        {
            let dots = method.dither(&flat(level, 200, 200), [0, 0]).unwrap();
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
        let settle = |errors: &mut Errors, column: usize, level| {
            let run = errors.of_run(column..column + 1);
            FLOYD_STEINBERG.settle::<true>(run, level, |_| 128, &mut [false]);
        };
        // An error of 160 sixteenths, and one that does not divide.
        settle(&mut errors, 1, 160);
        assert_eq!((errors.ahead.from(2), &*errors.below), (70, &[0, 30, 50, 10, 0][..]));
        settle(&mut errors, 0, WHITE - 23);
        assert_eq!((errors.ahead.from(1), errors.below[0], errors.below[2]), (-10, -4, 50 - 1));
        assert_eq!(errors.below.iter().sum::<i32>() + errors.ahead.error, 30 + 50 + 10 - 23);
    }

    #[test]
    fn rows_that_turn_are_the_mirror_image_of_rows_that_do_not() {
        let levels = [40, 99, 200, 17, 130];
        let rows = [[false; 5]; 2].map(|mut row| row.as_mut_slice().to_vec());
        let [mut right, mut left] = rows;
        let mut errors = [Errors::new(5), Errors::new(5)];
        for (k, level) in levels.into_iter().enumerate() {
            let (there, level) = (4 - k, level * 16);
            let run = errors[0].of_run(k..k + 1);
            SIERRA_LITE.settle::<true>(run, level, |_| 128, &mut right[k..=k]);
            let run = errors[1].of_run(there..there + 1);
            SIERRA_LITE.settle::<false>(run, level, |_| 128, &mut left[there..=there]);
        }
        left.reverse();
        errors[1].below.reverse();
        assert_eq!((right, &errors[0].below), (left, &errors[1].below));
    }

    #[test]
    fn rows_after_a_pause_start_without_error() {
        let mut gray = flat(120, 40, 3);
        let start = FLOYD_STEINBERG.dither(&gray, [0, 0]).unwrap();
        for _ in 3..SIDE {
            gray.push_runs([]).unwrap();
        }
        gray.push_runs([(40, 120)]).unwrap();
        assert_eq!(FLOYD_STEINBERG.dither(&gray, [0, 0]).unwrap().row(SIDE as u32), start.row(0));
    }
}
