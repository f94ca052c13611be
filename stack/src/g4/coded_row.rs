//! A row that several transitions can be looked at, or written, at once.

/// How many vertical codes are taken together.
pub(super) const AT_ONCE: usize = 4;
/// Those, and the place after them.
pub(super) const LOOK: usize = AT_ONCE + 1;
/// Transitions so far apart stay in order when each moves by three pixels.
pub(super) const WIDE: u32 = 7;

/// A row's transitions, and [`LOOK`] places behind the last: the width, and on
/// from there in wide steps.
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

    /// Transition `i`; the width behind the last.
    #[inline]
    pub(super) fn at(&self, i: usize) -> u32 {
        self.places[i.min(self.len)]
    }

    /// Makes room for the next transitions.
    #[inline]
    pub(super) fn make_room(&mut self) {
        if self.places.len() < self.len + LOOK {
            self.places.resize(2 * (self.len + LOOK), 0);
        }
    }

    /// Toggles at a column; toggling there again cancels.
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

    /// Puts the width behind the last transition.
    #[inline]
    pub(super) fn end(&mut self, width: u32) {
        self.make_room();
        for (k, place) in self.places[self.len..][..LOOK].iter_mut().enumerate() {
            *place = width.saturating_add(WIDE * k as u32);
        }
    }
}
