//! Stores a row so that several transitions can be read or written at once.

/// The number of vertical codes decoded together.
pub(super) const AT_ONCE: usize = 4;
/// The number of transitions read together: one more than the codes.
pub(super) const LOOK: usize = AT_ONCE + 1;
/// The distance at which transitions stay in order when each moves by up to three pixels.
pub(super) const WIDE: u32 = 7;

/// A row's transitions, followed by [`LOOK`] places: the width, and more in wide steps.
pub(super) struct CodedRow {
    pub(super) places: Vec<u32>,
    pub(super) len: usize,
}

impl CodedRow {
    pub(super) fn black(width: u32) -> Self {
        let mut row = Self { places: Vec::new(), len: 0 };
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

    /// Toggles at a column; toggling twice cancels.
    #[inline]
    pub(super) fn toggle(&mut self, column: u32, width: u32) {
        if self.len > 0 && self.places[self.len - 1] == column {
            self.len -= 1;
        } else if column < width {
            self.places[self.len] = column;
            self.len += 1;
            self.make_room();
        }
    }

    /// Appends the width after the last transition.
    #[inline]
    pub(super) fn end(&mut self, width: u32) {
        self.make_room();
        for (k, place) in self.places[self.len..][..LOOK].iter_mut().enumerate() {
            *place = width.saturating_add(WIDE * k as u32);
        }
    }
}
