//! Dithers by a square of thresholds that repeats over the image.

use std::sync::OnceLock;

use lamp_stack::{GrayMask, Mask, gray_runs};

use crate::dots::{Dots, Pattern, TooManyRuns};

/// Thresholds of `side` x `side` places, each the least level that is white there. A level
/// turns the nearest possible share of places white.
pub(crate) struct Screen {
    side: usize,
    least: Vec<u8>,
    /// The patterns of each level, made at its first use.
    levels: [OnceLock<Patterns>; 256],
}

/// Runs shorter than this are dithered pixel by pixel, as looking up the pattern costs as
/// much as this many pixels.
const SHORT: u32 = 16;

impl Screen {
    /// Creates the screen that fills its places in the order of their ranks, which are given
    /// row by row and are all the numbers below `side` squared.
    ///
    /// # Panics
    /// Panics if the side is not a power of two up to 256, or ranks are missing.
    pub(crate) fn new(side: usize, ranks: impl Iterator<Item = usize>) -> Self {
        let places = side * side;
        // White are the first round(level / 255 * places) ranks.
        let least: Vec<u8> = ranks.map(|rank| ((255 * rank + 127) / places + 1) as u8).collect();
        assert!(side.is_power_of_two() && side <= 256 && least.len() == places);
        Self { side, least, levels: [const { OnceLock::new() }; 256] }
    }

    /// Returns the least levels that are white in a row. Rows repeat.
    pub(crate) fn row(&self, row: usize) -> &[u8] {
        let first = row % self.side * self.side;
        &self.least[first..first + self.side]
    }

    /// Turns gray into dots. `shift` is the screen's column and row at the image's top left
    /// corner.
    pub(crate) fn dither(&self, gray: &GrayMask, shift: [u32; 2]) -> Result<Mask, TooManyRuns> {
        let mut dots = Dots::new(gray.width());
        let last = self.side as u32 - 1;
        // The side divides 2^32, so columns may wrap.
        let place = |column: u32| column.wrapping_add(shift[0]) & last;
        for (row, changes) in gray.rows().enumerate() {
            let row = row + shift[1] as usize;
            let least = self.row(row);
            for (start, end, level) in gray_runs(changes, gray.width()) {
                if level == 255 {
                    dots.push_white(start, end);
                } else if end - start < SHORT {
                    dots.push_each(start, end, |column| level >= least[place(column) as usize]);
                } else {
                    let pattern = self.patterns(level).row(row);
                    dots.push_pattern((start, end), pattern, place(start), last + 1);
                }
            }
            dots.finish_row()?;
        }
        Ok(dots.finish())
    }

    fn patterns(&self, level: u8) -> &Patterns {
        self.levels[usize::from(level)]
            .get_or_init(|| Patterns::new(self.least.chunks(self.side), level))
    }
}

/// The patterns of a level, one for each row of a screen.
struct Patterns {
    /// The end of each row's changes.
    ends: Vec<usize>,
    changes: Vec<u8>,
    end_white: Vec<bool>,
}

impl Patterns {
    fn new<'a>(rows: impl Iterator<Item = &'a [u8]>, level: u8) -> Self {
        let mut patterns = Self { ends: Vec::new(), changes: Vec::new(), end_white: Vec::new() };
        for least in rows {
            let ends_white = least.last().is_some_and(|&least| level >= least);
            let mut was = ends_white;
            for (column, &least) in least.iter().enumerate() {
                if (level >= least) != was {
                    patterns.changes.push(column as u8);
                    was = !was;
                }
            }
            patterns.ends.push(patterns.changes.len());
            patterns.end_white.push(ends_white);
        }
        patterns
    }

    /// Returns the pattern of a row. Rows repeat.
    fn row(&self, row: usize) -> Pattern<'_> {
        let row = row % self.ends.len();
        let first = if row == 0 { 0 } else { self.ends[row - 1] };
        Pattern { changes: &self.changes[first..self.ends[row]], ends_white: self.end_white[row] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_has_its_share_of_white() {
        for side in [1, 2, 16, 128] {
            let screen = Screen::new(side, 0..side * side);
            for level in 0..=255u8 {
                let white = screen.least.iter().filter(|&&least| level >= least).count();
                let exact = f64::from(level) / 255.0 * (side * side) as f64;
                assert!((white as f64 - exact).abs() <= 0.5, "{side}, {level}: {white}");
            }
        }
    }

    #[test]
    fn a_long_run_has_the_dots_of_its_pixels() {
        let screen = Screen::new(16, (0..256).map(|rank| rank * 91 % 256));
        let mut gray = GrayMask::new(100);
        for row in 0..40 {
            gray.push_runs([(row, 0), (60, 6 * row as u8 + 1)]).unwrap();
        }
        let shift = [5, 9];
        let dots = screen.dither(&gray, shift).unwrap();
        for row in 0..40 {
            for column in 0..100 {
                let level = if (row..row + 60).contains(&column) { 6 * row as u8 + 1 } else { 0 };
                let least = screen.row((row + shift[1]) as usize);
                let white = level >= least[(column + shift[0]) as usize % 16];
                assert_eq!(dots.is_white(column, row), white, "column {column}, row {row}");
            }
        }
    }
}
