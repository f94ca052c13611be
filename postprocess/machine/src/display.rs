//! Displays of mirrors: how many, how large, how fast.

use lamp_stack::{Builtin, Catalogued, nonempty_text};
use serde::Deserialize;
use thiserror::Error;

/// A display of mirrors as its maker sells it. It is a part of a projector, and no machine.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Display {
    /// Its name, for machine files: small letters, digits and `-`.
    pub name: String,
    /// Its description, in a line.
    pub description: String,
    /// The mirrors across the scan and along it. The longer side lies across.
    pub mirrors: [u32; 2],
    /// The distance between the centers of two mirrors on the chip, in micrometers.
    pub pitch_um: f64,
    /// The most pictures of black and white that the display shows in a second.
    pub binary_rate_hz: f64,
    /// The maker's data sheet, its number, revision and date, and the tables.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// Why a display's numbers are impossible.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum DisplayError {
    /// Sides without mirrors, with too many, or in the wrong order.
    #[error("mirrors: each side must be between 1 and 65535, the longer side first")]
    Mirrors,
    /// A number that is not above zero.
    #[error("{0}: it must be above zero")]
    NotAboveZero(&'static str),
}

impl Catalogued for Display {
    const KIND: &'static str = "display";
    const BUILTINS: &'static [Builtin] = &[];
    type CheckError = DisplayError;

    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self) -> Result<(), DisplayError> {
        let [across, along] = self.mirrors;
        if !(1..=65_535).contains(&across) || !(1..=across).contains(&along) {
            return Err(DisplayError::Mirrors);
        }
        for (key, number) in [("pitch_um", self.pitch_um), ("binary_rate_hz", self.binary_rate_hz)]
        {
            if !(number > 0.0 && number.is_finite()) {
                return Err(DisplayError::NotAboveZero(key));
            }
        }
        Ok(())
    }
}
