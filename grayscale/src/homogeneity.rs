//! Reports whether a resin averages dots of a size or cures each by itself.
//!
//! Source: 002 section 3.3.6 and figure 57. Checkerboards of one mean level cured to an even film
//! with squares of 17 um, and to distinct cured and uncured regions with squares of 85, 170 and 255
//! um. Nothing between 17 and 85 um was tried.

use lamp_stack::Length;

/// The widest dots that cured evenly.
pub const EVEN_DOTS: Length = Length::from_um(17.0);
/// The narrowest dots that did not.
pub const UNEVEN_DOTS: Length = Length::from_um(85.0);

/// The source rounds pixels of 1500 dpi to whole micrometers: 85 stands for 84.67.
const ROUNDING: f64 = 0.01;

/// How evenly a film cures under dots of some size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Homogeneity {
    /// Evenly: the dots are no wider than dots that cured evenly.
    Even,
    /// Unknown: the dots are wider than dots that cured evenly, and narrower than dots that did
    /// not.
    Unknown,
    /// Each dot by itself.
    Uneven,
}

/// Returns how evenly a film cures under dots of one pixel, as all methods make them.
///
/// ```
/// use lamp_grayscale::{Homogeneity, homogeneity};
///
/// let pitch = lamp_stack::Dpi::new(1500.0).unwrap().pitch();
/// assert_eq!(homogeneity(pitch), Homogeneity::Even);
/// ```
pub fn homogeneity(pitch: Length) -> Homogeneity {
    // 002 section 3.3.6 compares screens of 17 and 85 um, and none between.
    if pitch.um() <= EVEN_DOTS.um() * (1.0 + ROUNDING) {
        Homogeneity::Even
    } else if pitch.um() < UNEVEN_DOTS.um() * (1.0 - ROUNDING) {
        Homogeneity::Unknown
    } else {
        Homogeneity::Uneven
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Dpi;

    use super::*;

    #[test]
    fn pixels_of_the_study_and_of_machines() {
        for (dpi, expected) in [
            (2400.0, Homogeneity::Even),
            // 16.93 um, printed as 17.
            (1500.0, Homogeneity::Even),
            (1494.0, Homogeneity::Even),
            (1270.0, Homogeneity::Unknown),
            (400.0, Homogeneity::Unknown),
            // 84.67 um, printed as 85.
            (300.0, Homogeneity::Uneven),
            (100.0, Homogeneity::Uneven),
        ] {
            assert_eq!(homogeneity(Dpi::new(dpi).unwrap().pitch()), expected, "{dpi} dpi");
        }
    }
}
