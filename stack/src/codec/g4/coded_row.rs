//! Stores a row so that several transitions can be read or written at once.

use crate::image::mask::Mask;

/// The number of vertical codes decoded together.
pub(super) const AT_ONCE: usize = 4;
/// The number of transitions read together: one more than the codes.
pub(super) const LOOK: usize = AT_ONCE + 1;
/// The distance at which transitions stay in order when each moves by up to three pixels.
pub(super) const WIDE: u32 = 7;

/// A row's transitions, followed by [`LOOK`] places: the width, and more in wide steps.
///
/// A run of length zero stays as two transitions at one column. In T.6's words there is no change
/// there, but libtiff refers to both in the next row, and most programs read as libtiff decodes.
pub(super) struct CodedRow {
    pub(super) places: Vec<u32>,
    pub(super) len: usize,
    has_empty_runs: bool,
}

impl CodedRow {
    pub(super) fn black(width: u32) -> Self {
        let mut row = Self { places: Vec::new(), len: 0, has_empty_runs: false };
        row.end(width);
        row
    }

    /// Returns transition `i`, or the width after the last.
    #[inline]
    pub(super) fn at(&self, i: usize) -> u32 {
        self.places[i.min(self.len)]
    }

    /// Reserves space for the next transitions.
    #[inline]
    pub(super) fn make_room(&mut self) {
        if self.places.len() < self.len + LOOK {
            self.places.resize(2 * (self.len + LOOK), 0);
        }
    }

    /// Removes all transitions.
    #[inline]
    pub(super) fn clear(&mut self) {
        (self.len, self.has_empty_runs) = (0, false);
    }

    /// Toggles at a column.
    #[inline]
    pub(super) fn toggle(&mut self, column: u32, width: u32) {
        if column < width {
            self.has_empty_runs |= self.len > 0 && self.places[self.len - 1] == column;
            self.places[self.len] = column;
            self.len += 1;
            self.make_room();
        }
    }

    /// Appends the width after the last transition.
    #[inline]
    pub(super) fn end(&mut self, width: u32) {
        self.make_room();
        // Wide apart, so that no run behind the last transition counts as narrow.
        for (k, place) in self.places[self.len..][..LOOK].iter_mut().enumerate() {
            *place = width.saturating_add(WIDE * k as u32);
        }
    }

    /// Adds the row below a mask's rows, without its runs of length zero.
    #[inline]
    pub(super) fn push_to(&self, mask: &mut Mask) {
        if !self.has_empty_runs {
            return mask.push_padded(&self.places, self.len);
        }
        let mut row: Vec<u32> = Vec::new();
        for &column in &self.places[..self.len] {
            // An empty run changes no color: both of its transitions go.
            if row.pop_if(|last| *last == column).is_none() {
                row.push(column);
            }
        }
        mask.push(&row);
    }
}
