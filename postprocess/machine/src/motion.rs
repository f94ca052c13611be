//! Speeds and accelerations, with parsers for text such as `100mm/s` and `2000mm/s2`.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, de};
use thiserror::Error;

/// A speed above zero, in millimeters a second.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Speed(f64);

/// An acceleration above zero, in millimeters a second squared.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Acceleration(f64);

impl Speed {
    /// Creates a speed, or returns `None` if it is not a finite number above zero.
    pub fn new(mm_per_s: f64) -> Option<Self> {
        is_possible(mm_per_s).then_some(Self(mm_per_s))
    }

    /// Returns the millimeters a second.
    pub const fn mm_per_s(self) -> f64 {
        self.0
    }
}

impl Acceleration {
    /// Creates an acceleration, or returns `None` if it is not a finite number above zero.
    pub fn new(mm_per_s2: f64) -> Option<Self> {
        is_possible(mm_per_s2).then_some(Self(mm_per_s2))
    }

    /// Returns the millimeters a second squared.
    pub const fn mm_per_s2(self) -> f64 {
        self.0
    }
}

/// NaN is not above zero, so it is refused, too.
fn is_possible(number: f64) -> bool {
    number > 0.0 && number.is_finite()
}

/// Why a text is no speed or no acceleration.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MotionError {
    /// The text is not a number above zero and a unit of speed.
    #[error(
        "`{0}` is not a speed: write a number above zero and um/s, mm/s, m/s or in/s, such as 100mm/s"
    )]
    NotASpeed(String),
    /// The text is not a number above zero and a unit of acceleration.
    #[error(
        "`{0}` is not an acceleration: write a number above zero and um/s2, mm/s2, m/s2 or in/s2, such as 2000mm/s2"
    )]
    NotAnAcceleration(String),
}

/// Splits `2000mm/s2` at the unit's end, and returns its number in millimeters.
fn millimeters(text: &str, per: &str) -> Option<f64> {
    let length = text.trim().strip_suffix(per)?;
    // Letters at the end are the unit, so `inf` and `nan` are no numbers.
    let digits = length.trim_end_matches(|c: char| c.is_alphabetic());
    let number: f64 = digits.trim_end().parse().ok()?;
    match &length[digits.len()..] {
        // Unlike a factor of 0.001, a division gives the nearest number.
        "um" => Some(number / 1000.0),
        "mm" => Some(number),
        "m" => Some(number * 1000.0),
        "in" => Some(number * 25.4),
        _ => None,
    }
}

impl FromStr for Speed {
    type Err = MotionError;

    /// Parses a number and its unit: `um/s`, `mm/s`, `m/s` or `in/s`.
    ///
    /// # Errors
    /// Returns an error if the unit is missing or unknown, or if the number is missing, not finite
    /// or not above zero.
    fn from_str(text: &str) -> Result<Self, MotionError> {
        let speed = millimeters(text, "/s").and_then(Self::new);
        speed.ok_or_else(|| MotionError::NotASpeed(text.to_owned()))
    }
}

impl FromStr for Acceleration {
    type Err = MotionError;

    /// Parses a number and its unit: `um/s2`, `mm/s2`, `m/s2` or `in/s2`.
    ///
    /// # Errors
    /// Returns an error if the unit is missing or unknown, or if the number is missing, not finite
    /// or not above zero.
    fn from_str(text: &str) -> Result<Self, MotionError> {
        let acceleration = millimeters(text, "/s2").and_then(Self::new);
        acceleration.ok_or_else(|| MotionError::NotAnAcceleration(text.to_owned()))
    }
}

impl fmt::Display for Speed {
    /// Formats in millimeters a second. Reading the text gives exactly the speed.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}mm/s", self.0)
    }
}

impl fmt::Display for Acceleration {
    /// Formats in millimeters a second squared. Reading the text gives exactly the acceleration.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}mm/s2", self.0)
    }
}

impl<'de> Deserialize<'de> for Speed {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        String::deserialize(from)?.parse().map_err(de::Error::custom)
    }
}

impl<'de> Deserialize<'de> for Acceleration {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        String::deserialize(from)?.parse().map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_parses() {
        for (text, mm) in [
            ("95.15mm/s", 95.15),
            ("1 mm/s", 1.0),
            (" 0.2m/s ", 200.0),
            ("500um/s", 0.5),
            ("2in/s", 50.8),
            ("1e2mm/s", 100.0),
        ] {
            assert_eq!(text.parse::<Speed>().unwrap().mm_per_s(), mm, "{text}");
            let squared = text.trim().to_owned() + "2";
            assert_eq!(squared.parse::<Acceleration>().unwrap().mm_per_s2(), mm, "{squared}");
        }
    }

    #[test]
    fn texts_are_read_as_the_numbers_that_they_are_of() {
        for mm in [95.15, 1.0 / 3.0, 1e-300, 1e300, f64::MIN_POSITIVE, f64::MAX, 0.1 + 0.2] {
            let (speed, acceleration) = (Speed(mm), Acceleration(mm));
            assert_eq!(speed.to_string().parse(), Ok(speed));
            assert_eq!(acceleration.to_string().parse(), Ok(acceleration));
        }
        assert_eq!(Speed(95.15).to_string(), "95.15mm/s");
        assert_eq!(Acceleration(2000.0).to_string(), "2000mm/s2");
    }

    #[test]
    fn other_texts_are_refused_with_what_to_write() {
        for text in [
            "",
            "/s",
            "mm/s",
            "1",
            "1mm",
            "1mm/",
            "1/s",
            "1cm/min",
            "1mm/h",
            "0mm/s",
            "-0mm/s",
            "-1mm/s",
            "nanmm/s",
            "infmm/s",
            "1e999mm/s",
            "1e308m/s",
            "1e-323um/s",
            "1..2mm/s",
            "1mm/s/s",
            "µ/s",
            "1Mm/s",
        ] {
            let error = text.parse::<Speed>().unwrap_err().to_string();
            assert!(error.contains("100mm/s") && error.contains(text), "{text}: {error}");
            let error = (text.to_owned() + "2").parse::<Acceleration>().unwrap_err().to_string();
            assert!(error.contains("2000mm/s2"), "{text}: {error}");
        }
        assert!("1mm/s2".parse::<Speed>().is_err() && "1mm/s".parse::<Acceleration>().is_err());
    }
}
