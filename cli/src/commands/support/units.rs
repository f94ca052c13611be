//! Angles and curvatures on the command line.

use std::fmt;
use std::str::FromStr;

/// An angle of a support.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Degrees(pub(super) f64);

impl fmt::Display for Degrees {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}deg", self.0)
    }
}

impl FromStr for Degrees {
    type Err = String;

    /// Parses `45deg` or `45`.
    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim_end_matches("deg").trim_end().parse() {
            Ok(degrees) if (0.0..=80.0).contains(&degrees) => Ok(Self(degrees)),
            _ => Err(format!("`{text}` is no tilt: write an angle from 0deg to 80deg")),
        }
    }
}

/// A curvature in 1/mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Curvature(pub(super) f64);

impl fmt::Display for Curvature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/mm", self.0)
    }
}

impl FromStr for Curvature {
    type Err = String;

    /// Parses `1/mm`.
    fn from_str(text: &str) -> Result<Self, String> {
        match text.strip_suffix("/mm").and_then(|number| number.trim_end().parse().ok()) {
            Some(number) if (0.0..f64::INFINITY).contains(&number) => Ok(Self(number)),
            _ => Err(format!("`{text}` is no curvature: write 1/mm for a radius of 1 mm")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_and_curvatures_have_units() {
        assert_eq!("45deg".parse(), Ok(Degrees(45.0)));
        assert_eq!("0".parse(), Ok(Degrees(0.0)));
        assert_eq!("0.5/mm".parse(), Ok(Curvature(0.5)));
        for wrong in ["", "nan", "-1deg", "90", "45rad"] {
            assert!(wrong.parse::<Degrees>().is_err(), "{wrong}");
        }
        for wrong in ["", "1", "nan/mm", "-1/mm", "inf/mm", "1/in"] {
            assert!(wrong.parse::<Curvature>().is_err(), "{wrong}");
        }
    }
}
