//! Turns by multiples of an angle.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

/// Turns by all multiples of an angle that divides a right angle into at most 18 steps: `15deg`.
///
/// Images turn by right angles, so a part is sliced once for each angle below that.
///
/// ```
/// use lamp_build::FreeTurns;
///
/// let turns: FreeTurns = "15deg".parse()?;
/// assert_eq!(turns.degrees(), [15.0, 30.0, 45.0, 60.0, 75.0]);
/// # Ok::<(), lamp_build::FreeTurnsError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FreeTurns {
    /// The number of steps in a right angle.
    steps: u32,
}

/// A text is no angle that divides a right angle.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "`{0}` is not a number of degrees that divides a right angle into whole steps, at most 18: \
     write 5deg, 15deg, 22.5deg or 45deg"
)]
pub struct FreeTurnsError(String);

const MOST: u32 = 18;

impl FreeTurns {
    /// Returns the angles at which a part is sliced besides its own, in degrees.
    pub fn degrees(self) -> Vec<f64> {
        (1..self.steps).map(|step| self.step() * f64::from(step)).collect()
    }

    fn step(self) -> f64 {
        90.0 / f64::from(self.steps)
    }
}

impl fmt::Display for FreeTurns {
    /// Formats the angle: `15deg`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}deg", self.step())
    }
}

impl FromStr for FreeTurns {
    type Err = FreeTurnsError;

    /// Parses an angle with or without `deg`.
    fn from_str(text: &str) -> Result<Self, FreeTurnsError> {
        let number = text.strip_suffix("deg").or(text.strip_suffix('\u{b0}')).unwrap_or(text);
        let degrees: Option<f64> = number.trim().parse().ok();
        let steps = degrees.map(|degrees| 90.0 / degrees);
        let is_whole = |steps: &f64| {
            let whole = steps.round();
            // Not every part of 90 is a decimal: 12.857142857142858deg is a seventh.
            (1.0..=f64::from(MOST)).contains(&whole) && (steps - whole).abs() < 1e-6
        };
        let steps = steps.filter(is_whole).ok_or_else(|| FreeTurnsError(text.to_owned()))?;
        Ok(Self { steps: steps.round() as u32 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_divide_a_right_angle() {
        let parsed = |text: &str| text.parse::<FreeTurns>().map(|turns| turns.steps);
        for (text, steps) in [
            ("5deg", 18),
            ("15", 6),
            ("22.5 deg", 4),
            ("45\u{b0}", 2),
            ("12.857142857142858deg", 7),
            ("90deg", 1),
        ] {
            assert_eq!(parsed(text), Ok(steps), "{text}");
        }
        for wrong in [
            "",
            "deg",
            "0deg",
            "-15deg",
            "7deg",
            "4deg",
            "60deg",
            "120deg",
            "180deg",
            "360deg",
            "inf",
            "nan",
            "15rad",
            "15degrees",
        ] {
            assert!(parsed(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn stacks_and_turns_of_images_make_all_turns() {
        for steps in 1..=MOST {
            let turns = FreeTurns { steps };
            let again: FreeTurns = turns.to_string().parse().unwrap();
            assert_eq!(again, turns);
            let stacks: Vec<f64> = std::iter::once(0.0).chain(turns.degrees()).collect();
            let quarters = [0.0, 90.0, 180.0, 270.0];
            let all = quarters.iter().flat_map(|quarter| stacks.iter().map(move |at| at + quarter));
            let all: Vec<f64> = all.collect();
            assert_eq!(all.len(), 4 * steps as usize);
            for (turn, degrees) in all.iter().enumerate() {
                let exact = 90.0 * turn as f64 / f64::from(steps);
                assert!((degrees - exact).abs() < 1e-9, "{steps}: {degrees} {exact}");
            }
        }
    }
}
