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
    /// The most pictures of black and white that the display shows in a second, if it is known.
    pub binary_rate_hz: Option<f64>,
    /// The maker's data sheet, its number, revision and date, and the tables; or who else states
    /// the numbers.
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

macro_rules! builtin {
    ($name:literal) => {
        Builtin { name: $name, toml: include_str!(concat!("../displays/", $name, ".toml")) }
    };
}

impl Catalogued for Display {
    const KIND: &'static str = "display";
    const BUILTINS: &'static [Builtin] =
        &[builtin!("dlp7000"), builtin!("dlp9500"), builtin!("dlp9000x")];
    type CheckError = DisplayError;

    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self) -> Result<(), DisplayError> {
        let [across, along] = self.mirrors;
        if !(1..=65_535).contains(&across) || !(1..=across).contains(&along) {
            return Err(DisplayError::Mirrors);
        }
        for (key, number) in
            [("pitch_um", Some(self.pitch_um)), ("binary_rate_hz", self.binary_rate_hz)]
        {
            // NaN is not above zero.
            if number.is_some_and(|number| !(number > 0.0 && number.is_finite())) {
                return Err(DisplayError::NotAboveZero(key));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: &str = "name = \"mine\"\ndescription = \"\"\nmirrors = [8, 6]\npitch_um = 10.5\nbinary_rate_hz = 100\nsource = \"-\"\n";

    #[test]
    fn built_in_displays_are_whole_and_say_that_they_are_no_machines() {
        for builtin in Display::BUILTINS {
            let display = Display::from_toml(builtin.toml).unwrap();
            assert_eq!(display.name, builtin.name);
            assert!(display.description.contains("a display, no machine"));
            // Numbers of others than the maker's sheet say so.
            let sheet = display.source.contains("data sheet DLPS");
            assert!(sheet || display.source.contains("data sheet was not"), "{}", display.source);
        }
    }

    #[test]
    fn errors_name_the_key_and_what_to_do() {
        assert_eq!(Display::from_toml(WHOLE).unwrap().mirrors, [8, 6]);
        for (from, to, words) in [
            ("[8, 6]", "[6, 8]", "mirrors: each side"),
            ("[8, 6]", "[8, 0]", "mirrors: each side"),
            ("[8, 6]", "[65536, 6]", "mirrors: each side"),
            ("10.5", "0", "pitch_um: it must be above zero"),
            ("10.5", "nan", "pitch_um: it must be above zero"),
            ("= 100", "= inf", "binary_rate_hz: it must be above zero"),
            ("\"-\"", "\"\"", "source: this is empty"),
        ] {
            assert!(WHOLE.contains(from), "{from}");
            let error = Display::from_toml(&WHOLE.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
