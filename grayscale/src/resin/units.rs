//! Doses, intensities, exposure times and gray levels, parsed from texts with units.

use std::fmt;
use std::ops::{Div, Mul};
use std::str::FromStr;

use lamp_stack::Length;
use thiserror::Error;

/// A quantity that is written as a number and a unit, as `131.5 mJ/cm2`.
///
/// ```
/// use lamp_grayscale::resin::{Dose, ExposureTime, Intensity};
///
/// let light: Intensity = "1.6 W/cm2".parse()?;
/// assert_eq!(light * ExposureTime::from_ms(200.0), Dose::from_mj_per_cm2(320.0));
/// # Ok::<(), lamp_grayscale::resin::QuantityError>(())
/// ```
pub trait Quantity: Copy + PartialOrd + FromStr<Err: fmt::Display> {
    /// The unit of [`number`](Self::number), as files write it.
    const UNIT: &'static str;
    /// An example of a text that parses, for messages.
    const EXAMPLE: &'static str;
    /// Creates the quantity of a number of its unit.
    fn of(number: f64) -> Self;
    /// Returns the number of its unit.
    fn number(self) -> f64;
}

impl Quantity for Length {
    const UNIT: &'static str = "um";
    const EXAMPLE: &'static str = "211 um";

    fn of(number: f64) -> Self {
        Self::from_um(number)
    }

    fn number(self) -> f64 {
        self.um()
    }
}

/// Why a text is not a quantity.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{text}` is not {what}: write a number of zero or more and a unit, such as {example}")]
pub struct QuantityError {
    text: String,
    what: &'static str,
    example: &'static str,
}

/// Parses a number and one of `units`, each with a factor to multiply by and one to
/// divide by: a tenth as a divisor of 10 stays exact.
fn parse(text: &str, units: &[(&str, f64, f64)]) -> Option<f64> {
    let text = text.trim().replace('²', "2");
    let number = |&(unit, times, over): &(&str, f64, f64)| {
        let number: f64 = text.strip_suffix(unit)?.trim_end().parse().ok()?;
        Some(number * times / over)
    };
    units.iter().find_map(number).filter(|number| number.is_finite() && *number >= 0.0)
}

macro_rules! quantity {
    (
        $(#[$doc:meta])*
        $name:ident, $what:literal, $unit_name:literal, $from:ident, $get:ident,
        $unit:literal, $example:literal, [$($other:expr),*]
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Default)]
        pub struct $name(f64);

        impl $name {
            #[doc = concat!("Creates the quantity of a number of ", $unit_name, ".")]
            pub const fn $from(number: f64) -> Self {
                Self(number)
            }

            #[doc = concat!("Returns the number of ", $unit_name, ".")]
            pub const fn $get(self) -> f64 {
                self.0
            }
        }

        impl Quantity for $name {
            const UNIT: &'static str = $unit;
            const EXAMPLE: &'static str = $example;

            fn of(number: f64) -> Self {
                Self(number)
            }

            fn number(self) -> f64 {
                self.0
            }
        }

        impl fmt::Display for $name {
            #[doc = concat!("Writes ", $unit_name, ", to the precision of the format if it has one.")]
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)?;
                f.write_str(concat!(" ", $unit))
            }
        }

        impl FromStr for $name {
            type Err = QuantityError;

            /// Parses a number of zero or more and its unit.
            ///
            /// # Errors
            /// Returns an error if the number or the unit is missing, unknown or impossible.
            fn from_str(text: &str) -> Result<Self, QuantityError> {
                let wrong =
                    || QuantityError { text: text.to_owned(), what: $what, example: $example };
                parse(text, &[($unit, 1.0, 1.0) $(, $other)*]).map(Self).ok_or_else(wrong)
            }
        }
    };
}

quantity! {
    /// The energy of light per unit of surface (002 eq. 27). Parsed from `mJ/cm2`, `J/cm2` or `J/m2`.
    Dose, "a dose", "mJ/cm²", from_mj_per_cm2, mj_per_cm2, "mJ/cm2", "131.5 mJ/cm2",
    [("J/cm2", 1000.0, 1.0), ("J/m2", 1.0, 10.0)]
}

quantity! {
    /// The power of light per unit of surface. Parsed from `mW/cm2`,
    /// `W/cm2` or `W/m2`.
    Intensity, "an intensity", "mW/cm²", from_mw_per_cm2, mw_per_cm2, "mW/cm2", "1.6 W/cm2",
    [("W/cm2", 1000.0, 1.0), ("W/m2", 1.0, 10.0)]
}

quantity! {
    /// The power of light, as of a ray. Parsed from `mW` or `W`.
    Power, "a power", "milliwatts", from_mw, mw, "mW", "8e-11 mW",
    [("W", 1000.0, 1.0)]
}

quantity! {
    /// The time for which a layer is exposed. Parsed from `ms` or `s`.
    ExposureTime, "an exposure time", "milliseconds", from_ms, ms, "ms", "200 ms",
    [("s", 1000.0, 1.0)]
}

quantity! {
    /// The growth of an edge per dose: the sensitivity `D_p^w` of the cure width (002
    /// section 3.4.3). Parsed from `um/(mJ/cm2)` or the equal `mm/(J/cm2)`.
    WidthSensitivity, "a width sensitivity", "µm per mJ/cm²",
    from_um_per_mj_per_cm2, um_per_mj_per_cm2, "um/(mJ/cm2)", "0.2 um/(mJ/cm2)",
    [("mm/(J/cm2)", 1.0, 1.0)]
}

quantity! {
    /// How many moles of a species are in a volume. Parsed from `mol/m3` or the equal `mmol/l`.
    Concentration, "a concentration", "mol/m³", from_mol_per_m3, mol_per_m3,
    "mol/m3", "1.05 mol/m3", [("mmol/l", 1.0, 1.0)]
}

quantity! {
    /// The rate constant of a reaction between two species. Parsed from `m3/(mol s)` or
    /// `l/(mol s)`.
    RateConstant, "a rate constant", "m³/(mol s)", from_m3_per_mol_s, m3_per_mol_s,
    "m3/(mol s)", "1.66 m3/(mol s)", [("l/(mol s)", 1.0, 1000.0)]
}

quantity! {
    /// How much light a mole absorbs: the decadic molar absorptivity. Parsed from `m2/mol`.
    Absorptivity, "an absorptivity", "m²/mol", from_m2_per_mol, m2_per_mol,
    "m2/mol", "15 m2/mol", []
}

quantity! {
    /// How fast a species spreads in a resin. Parsed from `m2/s` or `um2/s`.
    Diffusivity, "a diffusivity", "m²/s", from_m2_per_s, m2_per_s, "m2/s", "1e-10 m2/s",
    [("um2/s", 1.0, 1e12)]
}

/// 002 eq. 27: 1 W/cm² for 1 ms is 1 mJ/cm².
impl Mul<ExposureTime> for Intensity {
    type Output = Dose;

    fn mul(self, time: ExposureTime) -> Dose {
        Dose(self.0 * time.0 / 1000.0)
    }
}

/// 002 eq. 27, solved for the time.
impl Div<Intensity> for Dose {
    type Output = ExposureTime;

    fn div(self, light: Intensity) -> ExposureTime {
        ExposureTime(self.0 * 1000.0 / light.0)
    }
}

/// A gray level G: 0 is black and exposes nothing, 1 is white and exposes
/// fully (002 algorithm 15). It is the share of the light that arrives
/// (002 eq. 33, which takes the measured 1.004 G - 0.003 for G).
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct GrayLevel(f64);

impl GrayLevel {
    /// No exposure.
    pub const BLACK: Self = Self(0.0);
    /// Full exposure.
    pub const WHITE: Self = Self(1.0);

    /// Returns the level `g` if that is from 0 to 1.
    pub fn new(g: f64) -> Option<Self> {
        (0.0..=1.0).contains(&g).then_some(Self(g))
    }

    /// Returns the level nearest to `g`, which must not be NaN.
    pub(crate) fn clamped(g: f64) -> Self {
        Self(g.clamp(0.0, 1.0))
    }

    /// Returns the level as a number from 0 to 1.
    pub const fn get(self) -> f64 {
        self.0
    }

    /// Creates the level of an 8-bit pixel: 0 is black, 255 white.
    pub fn from_u8(level: u8) -> Self {
        Self(f64::from(level) / 255.0)
    }

    /// Returns the nearest 8-bit level.
    pub fn to_u8(self) -> u8 {
        (self.0 * 255.0).round() as u8
    }
}

/// 002 eq. 34: a gray level passes its share of the light.
impl Mul<GrayLevel> for Dose {
    type Output = Self;

    fn mul(self, gray: GrayLevel) -> Self {
        Self(self.0 * gray.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_parses() {
        for (text, mj) in [
            ("131.5 mJ/cm2", 131.5),
            ("131.5mJ/cm²", 131.5),
            ("1.6 J/cm2", 1600.0),
            ("140 J/m2", 14.0),
            (" 1e2 mJ/cm2 ", 100.0),
            ("0 mJ/cm2", 0.0),
        ] {
            assert_eq!(text.parse(), Ok(Dose::from_mj_per_cm2(mj)), "{text}");
        }
        for (text, mw) in [("1.6 W/cm2", 1600.0), ("0.2064 mW/cm2", 0.2064), ("140 W/m²", 14.0)] {
            assert_eq!(text.parse(), Ok(Intensity::from_mw_per_cm2(mw)), "{text}");
        }
        for (text, ms) in [("200ms", 200.0), ("1.2 s", 1200.0)] {
            assert_eq!(text.parse(), Ok(ExposureTime::from_ms(ms)), "{text}");
        }
    }

    #[test]
    fn a_width_sensitivity_is_a_length_for_a_dose() {
        for text in ["1.2 um/(mJ/cm2)", "1.2um/(mJ/cm²)", "1.2 mm/(J/cm2)"] {
            let parsed: WidthSensitivity = text.parse().unwrap();
            assert_eq!(parsed.um_per_mj_per_cm2(), 1.2, "{text}");
            assert_eq!(parsed.to_string().parse(), Ok(parsed));
        }
        for text in ["1.2 um", "1.2 um/mJ/cm2", "1.2 mJ/cm2", "-1 um/(mJ/cm2)"] {
            assert!(text.parse::<WidthSensitivity>().is_err(), "{text}");
        }
    }

    #[test]
    fn a_quantity_needs_a_possible_number_and_its_own_unit() {
        for text in ["", "131.5", "mJ/cm2", "131.5 mW/cm2", "-1 mJ/cm2", "inf J/cm2", "nan J/m2"] {
            let error = text.parse::<Dose>().unwrap_err().to_string();
            assert!(error.contains("is not a dose") && error.contains("131.5 mJ/cm2"), "{error}");
        }
        assert!("1e308 W/cm2".parse::<Intensity>().is_err());
        assert!("200".parse::<ExposureTime>().is_err());
    }

    #[test]
    fn the_lamp_for_a_time_is_a_dose() {
        // 002 section 3.3.5: 200 ms to 1200 ms at 1.6 W/cm².
        let light: Intensity = "1.6 W/cm2".parse().unwrap();
        for (ms, mj) in [(200.0, 320.0), (1200.0, 1920.0)] {
            let (time, dose) = (ExposureTime::from_ms(ms), Dose::from_mj_per_cm2(mj));
            assert_eq!(light * time, dose);
            assert_eq!(dose / light, time);
        }
    }

    #[test]
    fn eight_bits_survive() {
        for level in 0..=255 {
            assert_eq!(GrayLevel::from_u8(level).to_u8(), level);
        }
        assert_eq!(GrayLevel::from_u8(0), GrayLevel::BLACK);
        assert_eq!(GrayLevel::from_u8(255), GrayLevel::WHITE);
        for g in [-0.001, 1.001, f64::NAN] {
            assert_eq!(GrayLevel::new(g), None);
        }
    }
}
