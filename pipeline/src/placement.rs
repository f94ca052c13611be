//! Scales, mirrors, rotates and moves a part.

use std::fmt;
use std::str::FromStr;

use lamp_slicing::{Axis, Placement};
use serde::{Deserialize, Serialize};

use crate::words::{list, optional};

/// How a part is placed, in the order of the fields.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct PlacementSettings {
    /// Factors along the axes.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub scale: Option<FiniteNumbers<3>>,

    /// Axes along which it is mirrored.
    #[serde(with = "list", skip_serializing_if = "Vec::is_empty")]
    pub mirror: Vec<Axis>,

    /// Turns about axes through the origin.
    #[serde(with = "list", skip_serializing_if = "Vec::is_empty")]
    pub rotate: Vec<Rotation>,

    /// The move at the end, in millimeters.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub translate: Option<FiniteNumbers<3>>,
}

impl PlacementSettings {
    /// Returns the placement of facets.
    pub fn placement(&self) -> Placement {
        let mut placement = Placement::default()
            .scaled(self.scale.map_or([1.0; 3], |FiniteNumbers(factors)| factors));
        for &axis in &self.mirror {
            let mut factors = [1.0; 3];
            factors[axis as usize] = -1.0;
            placement = placement.scaled(factors);
        }
        for &Rotation { axis, degrees } in &self.rotate {
            placement = placement.rotated(axis, degrees);
        }
        placement.translated(self.translate.map_or([0.0; 3], |FiniteNumbers(by_mm)| by_mm))
    }

    /// Returns the rotations with others after them, as `--rotate` takes them.
    pub fn rotation_with(&self, turns: impl Iterator<Item = (Axis, f64)>) -> String {
        let more = turns.map(|(axis, degrees)| Rotation { axis, degrees });
        let all: Vec<_> =
            self.rotate.iter().copied().chain(more).map(|turn| turn.to_string()).collect();
        all.join(",")
    }
}

/// Finite numbers with commas between: `X,Y` or `X,Y,Z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FiniteNumbers<const N: usize>(
    /// The numbers.
    pub [f64; N],
);

impl<const N: usize> fmt::Display for FiniteNumbers<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.map(|number| number.to_string()).join(","))
    }
}

impl<const N: usize> FromStr for FiniteNumbers<N> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|n| n.is_finite());
        let numbers = text.split(',').map(number).collect::<Option<Vec<_>>>();
        let numbers = numbers.and_then(|numbers| numbers.try_into().ok());
        numbers.map(Self).ok_or_else(|| format!("`{text}` is not {N} numbers"))
    }
}

/// A turn about an axis through the origin: `x:90`. Quarter turns are exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    /// The axis.
    pub axis: Axis,
    /// Counter-clockwise, seen from the axis's tip.
    pub degrees: f64,
}

impl fmt::Display for Rotation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.axis, self.degrees)
    }
}

impl FromStr for Rotation {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (axis, degrees) = text.split_once(':')?;
            let FiniteNumbers([degrees]) = degrees.parse().ok()?;
            Some(Self { axis: axis.trim().to_ascii_lowercase().parse().ok()?, degrees })
        };
        parse().ok_or_else(|| {
            format!("`{text}` is not a rotation: write AXIS:DEGREES, such as x:90 or z:-12.5")
        })
    }
}

/// Reads factors: one for all axes, or `X,Y,Z`.
///
/// # Errors
/// Returns a sentence if the text is no scale, or would leave nothing of a part.
pub fn parse_scale(text: &str) -> Result<FiniteNumbers<3>, String> {
    let one = text.parse().map(|FiniteNumbers([factor])| FiniteNumbers([factor; 3]));
    let factors = one.or_else(|_| text.parse()).map_err(|_| {
        format!("`{text}` is not a scale: write a factor, or X,Y,Z, such as 1.02,1.02,1.015")
    })?;
    match factors {
        FiniteNumbers(factors) if factors.contains(&0.0) => {
            Err(format!("`{text}` would leave nothing of the part"))
        }
        // A negative factor would mirror the part, which is more often a slip than a wish.
        FiniteNumbers(factors) if factors.iter().any(|&f| f < 0.0) => {
            Err(format!("`{text}` is below zero: mirror the part with --mirror"))
        }
        factors => Ok(factors),
    }
}

/// Reads a move in millimeters: `X,Y,Z`.
///
/// # Errors
/// Returns a sentence if the text is no move.
pub fn parse_translation(text: &str) -> Result<FiniteNumbers<3>, String> {
    let wrong =
        || format!("`{text}` is not a translation: write X,Y,Z in millimeters, such as -5,0,12.7");
    // Lengths of other options have units, so people add one here, too.
    text.trim_end_matches("mm").parse().map_err(|_| wrong())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_people_write() {
        assert_eq!(parse_scale("1.02"), Ok(FiniteNumbers([1.02; 3])));
        assert_eq!(parse_scale("1, 2,.5"), Ok(FiniteNumbers([1.0, 2.0, 0.5])));
        assert_eq!("x:90".parse(), Ok(Rotation { axis: Axis::X, degrees: 90.0 }));
        assert_eq!("Z: -12.5".parse(), Ok(Rotation { axis: Axis::Z, degrees: -12.5 }));
        assert_eq!(parse_translation("-5,0,1e4mm"), Ok(FiniteNumbers([-5.0, 0.0, 1e4])));
        for wrong in ["", "0", "-1", "1,2", "1,2,0", "1,2,3,4", "nan", "inf", "1e999", "two"] {
            assert!(parse_scale(wrong).is_err(), "{wrong}");
        }
        for wrong in ["", "x", "x90", "90", "w:90", "x:", "x:nan", "x:inf", "x:1:2"] {
            assert!(wrong.parse::<Rotation>().is_err(), "{wrong}");
        }
        for wrong in ["", "1", "1,2", "1,2,3,4", "1,nan,2", "1,2,inf"] {
            assert!(parse_translation(wrong).is_err(), "{wrong}");
        }
    }
}
