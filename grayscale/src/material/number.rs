//! The numbers of a material file, each with its source.

use std::fmt;
use std::marker::PhantomData;

use lamp_stack::{Length, nonempty_text};
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::resin::{DepthRange, Quantity, StraightLine};

/// A number with its unit and its source.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[serde(bound(serialize = "T: Quantity", deserialize = "T: Quantity"))]
pub struct Given<T> {
    /// The number.
    #[serde(with = "written")]
    pub value: T,
    /// Half the width of its 95% confidence interval, if known.
    #[serde(with = "written_or_none", default, skip_serializing_if = "Option::is_none")]
    pub plus_minus: Option<T>,
    /// The equation, table, figure or measurement.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// A number without a unit, and its source.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct GivenNumber {
    /// The number.
    pub value: f64,
    /// Half the width of its 95% confidence interval, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plus_minus: Option<f64>,
    /// The equation, table, figure or measurement.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// A straight line and its source.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[serde(bound(serialize = "T: Quantity", deserialize = "T: Quantity"))]
pub struct GivenLine<T> {
    /// The value in the dark.
    #[serde(with = "written")]
    pub at_zero: T,
    /// The increase to full white, or for each W/cm².
    #[serde(with = "written")]
    pub rise: T,
    /// The equation, table, figure or measurement.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

impl<T: Copy> GivenLine<T> {
    pub(super) fn line(&self) -> StraightLine<T> {
        StraightLine { at_zero: self.at_zero, rise: self.rise }
    }
}

/// The depths that a model holds for, and their source.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct GivenDepths {
    /// The shallowest.
    #[serde(with = "written")]
    pub from: Length,
    /// The deepest, if there is a limit.
    #[serde(with = "written_or_none", default, skip_serializing_if = "Option::is_none")]
    pub to: Option<Length>,
    /// The section, figure or measurement.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

impl GivenDepths {
    pub(super) fn depths(&self) -> DepthRange {
        DepthRange { from: self.from, to: self.to }
    }
}

/// A number that no cure model reads, kept for planning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Constant {
    /// The number.
    pub value: f64,
    /// Its unit.
    #[serde(deserialize_with = "nonempty_text")]
    pub unit: String,
    /// The equation, table, figure or measurement.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// Writes a number to the last bit, with an exponent if it would be long otherwise.
fn exact(number: f64) -> String {
    // Both ways read back as the same number; long rows of zeros are hard to read.
    let plain = number == 0.0 || (1e-6..1e15).contains(&number.abs());
    if plain { number.to_string() } else { format!("{number:e}") }
}

/// Writes a quantity so that reading gives the same number to the last bit.
fn text<T: Quantity>(value: T) -> String {
    format!("{} {}", exact(value.number()), T::UNIT)
}

struct TextOf<T>(PhantomData<T>);

impl<T: Quantity> Visitor<'_> for TextOf<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a number and its unit in quotes, such as \"{}\"", T::EXAMPLE)
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<T, E> {
        text.parse().map_err(E::custom)
    }
}

pub(super) mod written {
    use super::{Deserializer, PhantomData, Quantity, Serializer, TextOf, text};

    pub(in super::super) fn serialize<T: Quantity, S: Serializer>(
        value: &T,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        to.serialize_str(&text(*value))
    }

    pub(in super::super) fn deserialize<'de, T: Quantity, D: Deserializer<'de>>(
        from: D,
    ) -> Result<T, D::Error> {
        from.deserialize_str(TextOf(PhantomData))
    }
}

mod written_or_none {
    use super::{Deserializer, Quantity, Serializer, written};

    pub(super) fn serialize<T: Quantity, S: Serializer>(
        value: &Option<T>,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        match value {
            Some(value) => written::serialize(value, to),
            None => to.serialize_none(),
        }
    }

    // Called only if the key is there.
    pub(super) fn deserialize<'de, T: Quantity, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Option<T>, D::Error> {
        written::deserialize(from).map(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_numbers_are_written_short_and_read_back() {
        for (um, written) in [(423.333, "423.333 um"), (1e-92, "1e-92 um"), (-2.5e20, "-2.5e20 um")]
        {
            let length = Length::from_um(um);
            assert_eq!(text(length), written);
            assert_eq!(written.parse(), Ok(length));
        }
    }
}
