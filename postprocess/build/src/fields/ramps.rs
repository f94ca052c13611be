//! Levels that rise where a swath begins and fall where it ends.

use std::ops::Range;

use lamp_stack::LevelChange;

/// The part of each level that each of two swaths exposes in the columns that they share.
pub(super) struct Ramps {
    overlap: u32,
    /// For each level, once it is used, the part that the second swath exposes, column by column.
    second: [Option<Box<[u8]>>; 256],
}

impl Ramps {
    pub(super) fn new(overlap: u32) -> Self {
        Self { overlap, second: [const { None }; 256] }
    }

    /// Adds the changes of a swath's row to a row without any: of runs `(start, end, level)`, whose
    /// levels rise up to the start of `plain` and fall from its end on. A last change may stand
    /// right of the row.
    pub(super) fn add(
        &mut self,
        runs: impl Iterator<Item = (u32, u32, u8)>,
        plain: Range<u32>,
        changes: &mut Vec<LevelChange>,
    ) {
        let (mut column, mut before) = (0, 0);
        let mut change = |column, level| {
            if level != before {
                changes.push(LevelChange { column, level });
                before = level;
            }
        };
        for (start, end, level) in runs {
            if start > column {
                change(column, 0);
            }
            column = end;
            if start < plain.start || end > plain.end {
                let second = self.second_shares(level);
                for column in start..end.min(plain.start) {
                    change(column, second[column as usize]);
                }
                if start.max(plain.start) < end.min(plain.end) {
                    change(start.max(plain.start), level);
                }
                for column in start.max(plain.end)..end {
                    change(column, level - second[(column - plain.end) as usize]);
                }
            } else {
                change(start, level);
            }
        }
        change(column, 0);
    }

    fn second_shares(&mut self, level: u8) -> &[u8] {
        let overlap = self.overlap;
        self.second[usize::from(level)]
            .get_or_insert_with(|| (0..overlap).map(|c| second_share(level, c, overlap)).collect())
    }
}

/// Returns the part of a level that the second of two swaths exposes in a shared column, counted
/// from the first shared one: it rises in equal steps. The first swath exposes the rest.
pub(super) fn second_share(level: u8, column: u32, overlap: u32) -> u8 {
    let (steps, all) = (u64::from(column) + 1, u64::from(overlap) + 1);
    // Rounded to the nearest level.
    ((2 * u64::from(level) * steps + all) / (2 * all)) as u8
}
