//! Builds images of dots, run by run from the top left.

use lamp_stack::{MAX_RUNS, Mask, MaskBuilder};

/// The dots make more runs than a reader of stacks takes.
#[derive(Debug)]
pub(crate) struct TooManyRuns;

/// Builds an image of dots. Within a row, runs must come from the left without overlap;
/// pixels between them are black.
pub(crate) struct Dots {
    mask: MaskBuilder,
    width: u32,
    /// The transitions of the row. Between calls their number is even.
    row: Vec<u32>,
    /// The number of transitions of the rows above.
    above: usize,
}

impl Dots {
    pub(crate) fn new(width: u32) -> Self {
        Self { mask: MaskBuilder::new(width), width, row: Vec::new(), above: 0 }
    }

    /// Makes the pixels from `start` to `end` white.
    pub(crate) fn push_white(&mut self, start: u32, end: u32) {
        if !self.reopen(start) {
            self.row.push(start);
        }
        self.row.push(end);
    }

    /// Whitens the pixels from `start` to `end` for which `is_white` is true.
    pub(crate) fn push_each(
        &mut self,
        start: u32,
        end: u32,
        mut is_white: impl FnMut(u32) -> bool,
    ) {
        let mut white = self.reopen(start);
        let mut len = self.row.len();
        // Room for a change at every pixel: each is written, and kept only where the color
        // changes.
        self.row.resize(len + (end - start) as usize + 1, 0);
        // Dots change color at random half of the time, which branches cannot predict.
        for column in start..end {
            let next = is_white(column);
            self.row[len] = column;
            len += usize::from(next != white);
            white = next;
        }
        self.row[len] = end;
        self.row.truncate(len + usize::from(white));
    }

    /// Repeats a pattern of `period` pixels from `start` to `end`, beginning with the
    /// pattern's column `phase`.
    pub(crate) fn push_pattern(
        &mut self,
        (start, end): (u32, u32),
        pattern: Pattern<'_>,
        phase: u32,
        period: u32,
    ) {
        let mut from = pattern.changes.partition_point(|&column| u32::from(column) <= phase);
        let white = pattern.ends_white ^ (from % 2 == 1);
        match (self.reopen(start), white) {
            (true, false) | (false, true) => self.row.push(start),
            _ => {}
        }
        // The pattern may begin left of the image: then this wraps, and wraps
        // back when columns are added.
        let mut origin = start.wrapping_sub(phase);
        while end.wrapping_sub(origin) > period {
            self.copy(&pattern.changes[from..], origin);
            (from, origin) = (0, origin.wrapping_add(period));
        }
        let rest = end.wrapping_sub(origin);
        let to = pattern.changes.partition_point(|&column| u32::from(column) < rest);
        self.copy(&pattern.changes[from.min(to)..to], origin);
        if self.row.len() % 2 == 1 {
            self.row.push(end);
        }
    }

    fn copy(&mut self, changes: &[u8], origin: u32) {
        self.row.extend(changes.iter().map(|&column| origin.wrapping_add(column.into())));
    }

    /// Reopens the run that ends at `start`, and returns whether there is one.
    fn reopen(&mut self, start: u32) -> bool {
        self.row.pop_if(|end| *end == start).is_some()
    }

    /// Ends a row.
    pub(crate) fn finish_row(&mut self) -> Result<(), TooManyRuns> {
        // A run to the edge of the image has no transition at its end: masks end as they are.
        self.row.pop_if(|end| *end == self.width);
        self.above += self.row.len();
        if self.above > MAX_RUNS {
            return Err(TooManyRuns);
        }
        self.mask.push_row(&self.row).expect("runs come from the left");
        self.row.clear();
        Ok(())
    }

    /// Returns the image of the finished rows.
    pub(crate) fn finish(self) -> Mask {
        self.mask.finish()
    }
}

/// A repeating row of dots.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pattern<'a> {
    /// The columns whose color differs from the color of the column to their left, which is the
    /// last column for column 0. Their number is even.
    pub(crate) changes: &'a [u8],
    /// The color of the last column.
    pub(crate) ends_white: bool,
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const WIDTH: u32 = 60;

    /// The call that adds a run of pixels.
    #[derive(Clone, Debug)]
    enum RunKind {
        Black,
        White,
        Each,
        Pattern,
    }

    fn given() -> impl Strategy<Value = RunKind> {
        prop_oneof![
            Just(RunKind::Black),
            Just(RunKind::White),
            Just(RunKind::Each),
            Just(RunKind::Pattern)
        ]
    }

    fn changes(period: &[bool]) -> Vec<u8> {
        let before = |at: usize| period[(at + period.len() - 1) % period.len()];
        (0..period.len()).filter(|&at| period[at] != before(at)).map(|at| at as u8).collect()
    }

    proptest! {
        #[test]
        fn pixels_are_what_they_were_given_as(
            runs in prop::collection::vec((1u32..25, given()), 1..12),
            period in prop::sample::select(vec![1usize, 4, 8, 16]),
            dots in prop::collection::vec(any::<bool>(), 16),
            shift in 0u32..16,
        ) {
            let tile = &dots[..period];
            let pattern_at = |column: u32| tile[(column + shift) as usize % period];
            let changes = changes(tile);
            let pattern = Pattern { changes: &changes, ends_white: tile[period - 1] };
            let mut image = Dots::new(WIDTH);
            let mut wanted = Vec::new();
            for (length, given) in runs {
                let start = wanted.len() as u32;
                let end = (start + length).min(WIDTH);
                if start == end {
                    break;
                }
                wanted.extend((start..end).map(|column| match given {
                    RunKind::Black => false,
                    RunKind::White => true,
                    RunKind::Each | RunKind::Pattern => pattern_at(column),
                }));
                let phase = (start + shift) % period as u32;
                match given {
                    RunKind::Black => {}
                    RunKind::White => image.push_white(start, end),
                    RunKind::Each => image.push_each(start, end, pattern_at),
                    RunKind::Pattern => {
                        image.push_pattern((start, end), pattern, phase, period as u32);
                    }
                }
            }
            wanted.resize(WIDTH as usize, false);
            image.finish_row().unwrap();
            let mask = image.finish();
            let found: Vec<bool> = (0..WIDTH).map(|column| mask.is_white(column, 0)).collect();
            prop_assert_eq!(found, wanted);
        }
    }
}
