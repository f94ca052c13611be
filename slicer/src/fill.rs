//! Defines the rule that decides what is inside a body.

/// The rule that decides what is inside a body.
///
/// ```
/// use lamp_slicing::Fill;
///
/// // Where two shells overlap, contours wind around a point twice.
/// assert!(Fill::Solid.is_inside(2) && !Fill::EvenOdd.is_inside(2));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fill {
    /// Pixels that contours wind around are white. The facets' orientation gives the sign, so
    /// overlapping shells unite, and shells that face inward are voids. A row whose signs do not
    /// add up is filled by even-odd.
    #[default]
    Solid,
    /// Every crossing toggles the color, as in 002 section 2.3.4. Overlapping shells and files cut
    /// each other.
    EvenOdd,
}

lamp_stack::named!(Fill { Solid = "solid" | "nonzero" | "non-zero", EvenOdd = "even-odd" });

impl Fill {
    /// Returns true if a point with this winding number is inside.
    #[inline]
    pub fn is_inside(self, winding: i32) -> bool {
        match self {
            Self::Solid => winding != 0,
            Self::EvenOdd => winding % 2 != 0,
        }
    }
}
