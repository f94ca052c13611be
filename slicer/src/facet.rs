//! Facets of parts, and the unit of their coordinates.

/// A triangle of a part's surface: three corners (x, y, z) in file units, as
/// STL holds them, counter-clockwise seen from outside.
pub type Facet = [[f32; 3]; 3];

/// The unit of a file's coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Units {
    /// Millimetres.
    #[default]
    Millimetres,
    /// Centimetres.
    Centimetres,
    /// Metres.
    Metres,
    /// Micrometres.
    Micrometres,
    /// Inches.
    Inches,
    /// Feet.
    Feet,
}

lamp_stack::named!(Units {
    Millimetres = "mm",
    Centimetres = "cm",
    Metres = "m",
    Micrometres = "um",
    Inches = "inch" | "in",
    Feet = "ft" | "foot",
});

impl Units {
    /// Returns the millimetres in one unit.
    pub fn mm(self) -> f64 {
        self.um() / 1000.0
    }

    /// Returns the micrometres in one unit: whole, so that multiplying a 32-bit
    /// coordinate by it is exact.
    pub(crate) fn um(self) -> f64 {
        match self {
            Self::Micrometres => 1.0,
            Self::Millimetres => 1000.0,
            Self::Centimetres => 10_000.0,
            Self::Inches => 25_400.0,
            Self::Feet => 304_800.0,
            Self::Metres => 1_000_000.0,
        }
    }
}
