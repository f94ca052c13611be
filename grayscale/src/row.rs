//! Rows of dots, gathered from the left.

/// A row's transitions, made from its white runs.
#[derive(Debug, Default)]
pub(crate) struct WhiteRuns {
    transitions: Vec<u32>,
}

impl WhiteRuns {
    /// Makes the pixels from `start` to `end` white. Runs come from the left
    /// and do not overlap.
    pub(crate) fn push(&mut self, start: u32, end: u32) {
        if self.transitions.last() == Some(&start) {
            self.transitions.pop();
        } else {
            self.transitions.push(start);
        }
        self.transitions.push(end);
    }

    /// Gives the transitions of a row of `width` pixels, and starts anew.
    pub(crate) fn finish(&mut self, width: u32, give: impl FnOnce(&[u32])) {
        if self.transitions.last() == Some(&width) {
            self.transitions.pop();
        }
        give(&self.transitions);
        self.transitions.clear();
    }
}
