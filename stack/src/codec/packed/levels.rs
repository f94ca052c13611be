//! Codes the levels of a gray image, given its columns.

use super::rows::Reference;
use super::streams::{Cursor, Streams};
use crate::image::gray::{GrayMask, LevelChange};
use crate::image::mask::Mask;

/// The columns of a gray image's changes, as rows of transitions, and their levels.
pub(super) struct Split {
    pub(super) columns: Mask,
    pub(super) levels: Vec<u8>,
}

impl Split {
    pub(super) fn of(gray: &GrayMask) -> Self {
        let (ends, changes) = gray.row_ends_and_changes();
        let offsets = [&[0], ends].concat();
        let columns = changes.iter().map(|change| change.column).collect();
        let columns = Mask::new(gray.width(), offsets, columns).expect("columns increase");
        Self { columns, levels: changes.iter().map(|change| change.level).collect() }
    }

    /// Returns the levels of a row's changes.
    fn of_row(&self, row: u32) -> &[u8] {
        &self.levels[self.columns.changes_of(row)]
    }
}

/// Codes the levels of an image as their distances from the levels of the nearest changes in the
/// reference rows. `below` is the image of [`Reference::Below`].
pub(super) fn encode(image: &Split, below: Option<&Split>, out: &mut Streams) {
    for row in 0..image.columns.height() {
        let (columns, levels) = (image.columns.row(row), image.of_row(row));
        let reference = match (below, row) {
            (Some(below), row) => Some((below, row)),
            (None, 0) => None,
            (None, row) => Some((image, row - 1)),
        };
        let (at, of) = reference
            .map_or((&[][..], &[][..]), |(like, row)| (like.columns.row(row), like.of_row(row)));
        let nearest = NearestLevels { at, of, counts_agree: at.len() == columns.len(), j: 0 };
        // Modulo 256, so that each distance is a byte.
        out.levels
            .extend(nearest.of_all(columns).zip(levels).map(|(near, l)| l.wrapping_sub(near)));
    }
}

/// Decodes the levels of the changes at these columns. Returns `None` if they are damaged.
pub(super) fn decode(
    columns: &Mask,
    below: Option<&Split>,
    from: &mut Cursor<'_>,
) -> Option<GrayMask> {
    let mut gray = GrayMask::new(columns.width());
    let (mut made, mut above) = (Vec::<LevelChange>::new(), Vec::new());
    for (row, columns) in columns.rows().enumerate() {
        let (residuals, rest) = from.levels.split_at_checked(columns.len())?;
        from.levels = rest;
        let (at, of): (Vec<u32>, Vec<u8>);
        let (at, of) = match below {
            Some(below) => (below.columns.row(row as u32), below.of_row(row as u32)),
            None => {
                (at, of) = above.iter().map(|c: &LevelChange| (c.column, c.level)).unzip();
                (&at[..], &of[..])
            }
        };
        let nearest = NearestLevels { at, of, counts_agree: at.len() == columns.len(), j: 0 };
        made.clear();
        made.extend(nearest.of_all(columns).zip(residuals).zip(columns).map(
            |((near, &residual), &column)| LevelChange {
                column,
                level: near.wrapping_add(residual),
            },
        ));
        gray.push_row(&made).ok()?;
        std::mem::swap(&mut made, &mut above);
    }
    Some(gray)
}

/// Finds levels of a reference row for the columns of a row, from the left.
struct NearestLevels<'a> {
    at: &'a [u32],
    of: &'a [u8],
    counts_agree: bool,
    j: usize,
}

impl<'a> NearestLevels<'a> {
    /// Returns for each column the level of its change in the reference row: the one of its number,
    /// or the nearest where their counts differ. Without any, 0.
    fn of_all(mut self, columns: &'a [u32]) -> impl Iterator<Item = u8> + 'a {
        columns.iter().enumerate().map(move |(i, &column)| {
            if self.counts_agree {
                self.j = i;
            } else {
                let distance = |j: usize| self.at[j].abs_diff(column);
                // Of two that are as near, the right one.
                while self.j + 1 < self.at.len() && distance(self.j + 1) <= distance(self.j) {
                    self.j += 1;
                }
            }
            self.of.get(self.j).copied().unwrap_or(0)
        })
    }
}

impl Split {
    /// Returns the reference that the rows of an image of these columns are coded against.
    pub(super) fn reference(below: Option<&Self>) -> Reference<'_> {
        below.map_or(Reference::Above, |below| Reference::Below(&below.columns))
    }
}
