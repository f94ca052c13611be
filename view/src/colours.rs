//! The colours of overlays.

use crate::overlay::Overlay;

impl Overlay {
    /// The overlay's colour: red, green and blue.
    pub fn colour(self) -> [u8; 3] {
        match self {
            Self::Below => [86, 180, 233],
            Self::New => [0, 158, 115],
            Self::Added => [0, 114, 178],
            Self::Missing => [213, 94, 0],
            Self::Fixed => [240, 228, 66],
            Self::Stray => [230, 159, 0],
            Self::Findings => [204, 121, 167],
        }
    }
}
