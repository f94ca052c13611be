//! Facets of parts, and the unit of their coordinates.

/// A triangle of a part's surface: three corners (x, y, z) in file units, as in STL,
/// counterclockwise seen from outside.
pub type Facet = [[f32; 3]; 3];

/// The unit of a file's coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Units {
    /// Millimeters.
    #[default]
    Millimetres,
    /// Centimeters.
    Centimetres,
    /// Meters.
    Metres,
    /// Micrometers.
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
    /// Returns the millimeters in one unit.
    pub fn mm(self) -> f64 {
        self.um() / 1000.0
    }

    /// Returns the micrometers in one unit: whole, so that multiplying a 32-bit
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

/// A placed facet: x and y in millimeters, z in micrometers.
pub type PlacedFacet = [[f64; 3]; 3];

/// Returns the lowest and the highest z of a facet.
#[inline]
pub fn facet_heights(facet: &PlacedFacet) -> (f64, f64) {
    let [a, b, c] = facet.map(|corner| corner[2]);
    (lesser(lesser(a, b), c), greater(greater(a, b), c))
}

/// Returns the lesser of two numbers. `f64::min` checks for NaN and takes several times as long.
#[inline]
pub(crate) fn lesser<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// Returns the greater of two numbers.
#[inline]
pub(crate) fn greater<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// Rounds corners to 32 bits, as in STL.
pub(crate) fn rounded(corners: [[f64; 3]; 3]) -> Facet {
    corners.map(|corner| corner.map(|c| c as f32))
}
