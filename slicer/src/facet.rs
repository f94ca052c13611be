//! Facets of parts, and the unit of their coordinates.

/// A triangle of a part's surface: three corners (x, y, z) in file units, as
/// STL holds them, counter-clockwise seen from outside.
pub type Facet = [[f32; 3]; 3];

/// The unit of coordinates in a file that names none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Units {
    /// Millimetres.
    #[default]
    Millimetres,
    /// Inches.
    Inches,
}

lamp_stack::named!(Units { Millimetres = "mm", Inches = "inch" });

impl Units {
    /// Returns the millimetres in one unit.
    pub fn mm(self) -> f64 {
        match self {
            Self::Millimetres => 1.0,
            Self::Inches => 25.4,
        }
    }

    /// Returns the micrometres in one unit: whole, so that multiplying a 32-bit
    /// coordinate by it is exact.
    pub(crate) fn um(self) -> f64 {
        match self {
            Self::Millimetres => 1000.0,
            Self::Inches => 25_400.0,
        }
    }
}
