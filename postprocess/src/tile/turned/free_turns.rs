//! Turns by multiples of an angle.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use super::super::Turns;

/// Turns by all multiples of an angle that divides a full turn into at most 72: `15deg`.
///
/// ```
/// use lamp_postprocess::{FreeTurns, Turns};
///
/// let turns: FreeTurns = "15deg".parse()?;
/// // Images turn by right angles; the part is sliced at the angles between.
/// assert_eq!(turns.of_images(), Turns::Quarters);
/// assert_eq!(turns.degrees(), [15.0, 30.0, 45.0, 60.0, 75.0]);
/// # Ok::<(), lamp_postprocess::FreeTurnsError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FreeTurns {
    /// The number of turns.
    count: u32,
}

/// A text is no angle that divides a full turn.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "`{0}` divides no full turn into whole steps, at most 72: write 5deg, 15deg, 22.5deg or 45deg"
)]
pub struct FreeTurnsError(String);

const MOST: u32 = 72;

impl FreeTurns {
    /// Returns the turns of images among them.
    pub fn of_images(self) -> Turns {
        match self.count {
            count if count % 4 == 0 => Turns::Quarters,
            count if count % 2 == 0 => Turns::Half,
            _ => Turns::None,
        }
    }

    /// Returns the angles at which a part is sliced beside its own, in degrees, so that all turns are
    /// those of images.
    pub fn degrees(self) -> Vec<f64> {
        let stacks = self.count / self.of_images().count();
        (1..stacks).map(|stack| self.step() * f64::from(stack)).collect()
    }

    fn step(self) -> f64 {
        360.0 / f64::from(self.count)
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
        let count = degrees.map(|degrees| 360.0 / degrees);
        let is_whole = |count: &f64| {
            (1.0..=f64::from(MOST)).contains(count) && (count - count.round()).abs() < 1e-6
        };
        let count = count.filter(is_whole).ok_or_else(|| FreeTurnsError(text.to_owned()))?;
        Ok(Self { count: count.round() as u32 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_divide_a_full_turn() {
        let parsed = |text: &str| text.parse::<FreeTurns>().map(|turns| turns.count);
        for (text, count) in [
            ("5deg", 72),
            ("15", 24),
            ("22.5 deg", 16),
            ("45\u{b0}", 8),
            ("90deg", 4),
            ("120deg", 3),
            ("51.428571428571deg", 7),
            ("360deg", 1),
        ] {
            assert_eq!(parsed(text), Ok(count), "{text}");
        }
        for wrong in ["", "deg", "0deg", "-15deg", "7deg", "4deg", "100deg", "inf", "nan", "15rad"]
        {
            assert!(parsed(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn stacks_and_turns_of_images_make_all_turns() {
        for count in 1..=MOST {
            let turns = FreeTurns { count };
            let again: FreeTurns = turns.to_string().parse().unwrap();
            assert_eq!(again, turns);
            let quarters = match turns.of_images() {
                Turns::None => &[0.0][..],
                Turns::Half => &[0.0, 180.0],
                Turns::Quarters => &[0.0, 90.0, 180.0, 270.0],
            };
            let stacks = turns.degrees();
            let stacks = std::iter::once(&0.0).chain(&stacks);
            let mut all: Vec<f64> = stacks
                .flat_map(|stack| quarters.iter().map(move |quarter| stack + quarter))
                .collect();
            all.sort_by(f64::total_cmp);
            assert_eq!(all.len(), count as usize);
            for (turn, degrees) in all.iter().enumerate() {
                let exact = 360.0 * turn as f64 / f64::from(count);
                assert!((degrees - exact).abs() < 1e-9, "{count}: {degrees} {exact}");
            }
        }
    }
}
