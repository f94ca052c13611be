//! The cells of a chamber: across from the axis, deep from the glass.

/// The shape that a section of the chamber represents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChamberShape {
    /// Rotated around its axis: coordinates (r, z).
    Round,
    /// Extruded along a line, symmetric on both sides: coordinates (x, z).
    Straight,
}

/// A chamber in cells, row by row from the glass; a row begins at the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cells {
    /// The shape that the section represents.
    pub shape: ChamberShape,
    /// Cells of a row.
    pub across: usize,
    /// Cells from the glass to the other wall.
    pub deep: usize,
    /// The width of a cell, in micrometers.
    pub width_um: f64,
    /// The height of a cell, in micrometers.
    pub height_um: f64,
}

impl Cells {
    /// Returns the distance of the middle of a cell from the axis, in micrometers.
    pub fn middle_um(&self, across: usize) -> f64 {
        (across as f64 + 0.5) * self.width_um
    }

    /// Returns the part of the glass that a cell represents: the area of its ring or its width, in
    /// units of the first cell.
    pub fn weight(&self, across: usize) -> f64 {
        match self.shape {
            ChamberShape::Round => (2 * across + 1) as f64,
            ChamberShape::Straight => 1.0,
        }
    }

    /// Returns the number of cells.
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
