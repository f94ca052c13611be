//! The cells of a chamber: across from the axis, deep from the glass.

/// What a section of the chamber stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChamberShape {
    /// Turned around its axis: coordinates (r, z).
    Round,
    /// Drawn out into a line that is alike on both sides: coordinates (x, z).
    Straight,
}

/// A chamber in cells, row by row from the glass; a row begins at the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cells {
    /// What the section stands for.
    pub shape: ChamberShape,
    /// Cells of a row.
    pub across: usize,
    /// Cells from the glass to the other wall.
    pub deep: usize,
    /// The width of a cell, in micrometres.
    pub width_um: f64,
    /// The height of a cell, in micrometres.
    pub height_um: f64,
}

impl Cells {
    /// Returns how far the middle of a cell lies from the axis, in micrometres.
    pub fn middle_um(&self, across: usize) -> f64 {
        (across as f64 + 0.5) * self.width_um
    }

    /// Returns the part of the glass that a cell stands for: its ring's area or its width, in
    /// units of the first cell's.
    pub fn weight(&self, across: usize) -> f64 {
        match self.shape {
            ChamberShape::Round => (2 * across + 1) as f64,
            ChamberShape::Straight => 1.0,
        }
    }

    /// Returns how many cells there are.
    pub const fn count(&self) -> usize {
        self.across * self.deep
    }

    /// Returns how strongly a cell exchanges with the one before it and the one after it, for an
    /// exchange of 1 between flat cells of equal size. Walls let nothing through.
    pub(super) fn exchange(&self, across: usize) -> [f64; 2] {
        let [before, after] = match self.shape {
            ChamberShape::Round => {
                [across as f64, across as f64 + 1.0].map(|r| r / (across as f64 + 0.5))
            }
            ChamberShape::Straight => [1.0; 2],
        };
        let inner = if across == 0 { 0.0 } else { before };
        [inner, if across + 1 == self.across { 0.0 } else { after }]
    }
}
