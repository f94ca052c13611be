//! The pitch of an image's pixels along x and y.

use std::fmt;
use std::str::FromStr;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use thiserror::Error;

use crate::length::{Dpi, Length, LengthError};

/// How far the centers of pixels are apart along x and y, kept as exact dots per inch.
///
/// Its text is what an option takes: `1500` or `1814x1337` for dots per inch, `14um` or `14x19um`
/// for distances. `{:#}` is for sentences: `1500 dpi`, `14 x 19 um`.
///
/// ```
/// use lamp_stack::Pitch;
///
/// let pitch: Pitch = "14x19um".parse()?;
/// assert_eq!(pitch.um(), [14.0, 19.0]);
/// assert_eq!(format!("{pitch} or {pitch:#}"), "14x19um or 14 x 19 um");
/// # Ok::<(), lamp_stack::LengthError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pitch {
    /// The resolution along x: across, between columns.
    pub x: Dpi,
    /// The resolution along y: down, between rows.
    pub y: Dpi,
}

/// The reason why work that needs square pixels refuses others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("its pixels are {pitch:#}, and {work} square pixels")]
pub struct NotSquare {
    /// The pitch of its pixels.
    pub pitch: Pitch,
    /// The work and its verb, such as `supports need`.
    pub work: &'static str,
}

impl Pitch {
    /// Creates the pitch of square pixels, or returns `None` if `dpi` is not between 1 and 100 000.
    pub fn of_dpi(dpi: f64) -> Option<Self> {
        Dpi::new(dpi).map(Self::from)
    }

    /// Creates a pitch from dots per inch along x and y, or returns `None` if one is not between 1
    /// and 100 000.
    pub fn of_two_dpi(dpi: [f64; 2]) -> Option<Self> {
        let [x, y] = dpi.map(Dpi::new);
        Some(Self { x: x?, y: y? })
    }

    /// Returns the dots per inch along x and y.
    pub fn dpi(self) -> [f64; 2] {
        [self.x, self.y].map(Dpi::get)
    }

    /// Returns the distances along x and y in millimeters.
    pub fn mm(self) -> [f64; 2] {
        [self.x, self.y].map(|axis| axis.pitch().mm())
    }

    /// Returns the distances along x and y in micrometers.
    pub fn um(self) -> [f64; 2] {
        [self.x, self.y].map(|axis| axis.pitch().um())
    }

    /// Returns the area of a pixel in square millimeters.
    pub fn pixel_mm2(self) -> f64 {
        let [x, y] = self.mm();
        x * y
    }

    /// Returns the shorter side of a pixel.
    pub fn short_side(self) -> Length {
        let [x, y] = self.um();
        Length::from_um(x.min(y))
    }

    /// Returns the longer side of a pixel.
    pub fn long_side(self) -> Length {
        let [x, y] = self.um();
        Length::from_um(x.max(y))
    }

    /// Returns the height of a pixel in widths of one: 1 if pixels are square.
    pub fn aspect(self) -> f64 {
        let [x, y] = self.um();
        if self.is_square() { 1.0 } else { y / x }
    }

    /// Returns a length along x and along y in pixels, not rounded.
    pub fn pixels(self, length: Length) -> [f64; 2] {
        [self.x, self.y].map(|axis| length.pixels(axis))
    }

    /// Returns the pitch of an image turned by a quarter: x and y change places.
    #[must_use]
    pub fn turned(self) -> Self {
        Self { x: self.y, y: self.x }
    }

    /// Returns whether pixels are as wide as high.
    pub fn is_square(self) -> bool {
        self.x == self.y
    }

    /// Returns the resolution of square pixels. `work` needs them, such as `supports need`.
    ///
    /// # Errors
    /// Returns an error if pixels are not square.
    pub fn square(self, work: &'static str) -> Result<Dpi, NotSquare> {
        if self.is_square() { Ok(self.x) } else { Err(NotSquare { pitch: self, work }) }
    }

    /// Parses what a person writes. Unlike [`FromStr`], it refuses two small numbers without a unit:
    /// they are dots per inch, and micrometers were meant.
    ///
    /// # Errors
    /// Returns an error as [`FromStr`] does, or if the unit is missing.
    pub fn stated(text: &str) -> Result<Self, LengthError> {
        let pitch: Self = text.parse()?;
        let mut letters = text.chars().filter(|letter| letter.is_alphabetic());
        let has_unit = letters.any(|letter| !matches!(letter, 'x' | 'X'));
        if text.contains(['x', 'X', '*']) && !has_unit && pitch.is_coarse() {
            return Err(LengthError::CoarsePitch(text.to_owned()));
        }
        Ok(pitch)
    }

    /// Returns whether its dots per inch could be micrometers.
    fn is_coarse(self) -> bool {
        self.dpi().iter().all(|dpi| *dpi < 100.0)
    }

    /// Returns the pixels per meter along x and y, rounded to whole numbers.
    pub(crate) fn per_metre(self) -> [u32; 2] {
        [self.x, self.y].map(Dpi::per_metre)
    }

    /// Returns numbers of dots per inch or micrometers and their unit: the unit in which all have at
    /// most four decimals.
    fn in_short(self) -> ([f64; 2], &'static str) {
        let is_short = |number: &f64| (number * 1e4).round() / 1e4 == *number;
        let of_um = |um| Dpi::of_pitch(Length::from_um(um));
        if !self.dpi().iter().all(is_short) && self.um().map(of_um) == [Some(self.x), Some(self.y)]
        {
            (self.um(), "um")
        } else {
            (self.dpi(), "dpi")
        }
    }
}

impl From<Dpi> for Pitch {
    fn from(dpi: Dpi) -> Self {
        Self { x: dpi, y: dpi }
    }
}

impl FromStr for Pitch {
    type Err = LengthError;

    /// Parses dots per inch, `1500` or `1814x1337`, or distances, `14um` or `14x19um`: one for both
    /// axes, or x and y.
    ///
    /// # Errors
    /// Returns an error if the text is neither, or if a number is out of range or has too many
    /// decimals.
    fn from_str(text: &str) -> Result<Self, LengthError> {
        let of_lengths =
            |[x, y]: [Length; 2]| Some(Self { x: Dpi::of_pitch(x)?, y: Dpi::of_pitch(y)? });
        let of_dpi = |text: &str| text.parse::<Dpi>().ok();
        let pitch = match text.split_once(['x', 'X', '*']) {
            None => of_dpi(text).map(Self::from).or_else(|| {
                let side = text.parse().ok()?;
                of_lengths([side; 2])
            }),
            Some((x, y)) => match of_dpi(x).zip(of_dpi(y)) {
                Some((x, y)) => Some(Self { x, y }),
                None => Length::pair(text).and_then(of_lengths),
            },
        };
        pitch.ok_or_else(|| LengthError::NotAPitch(text.to_owned()))
    }
}

impl fmt::Display for Pitch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([x, y], unit) = self.in_short();
        match (f.alternate(), self.is_square()) {
            (true, true) => write!(f, "{x} {unit}"),
            (true, false) => write!(f, "{x} x {y} {unit}"),
            (false, is_square) => {
                // Numbers without a unit are dots per inch.
                let is_clear = unit == "dpi" && (is_square || !self.is_coarse());
                let unit = if is_clear { "" } else { unit };
                if is_square { write!(f, "{x}{unit}") } else { write!(f, "{x}x{y}{unit}") }
            }
        }
    }
}

impl Serialize for Pitch {
    /// Writes dots per inch: a number for square pixels, and else one along x and one along y.
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        if self.is_square() { self.x.get().serialize(to) } else { self.dpi().serialize(to) }
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Pitch {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Pitch".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "Dots per inch: a number for square pixels, and else one along x and one along y.",
            "oneOf": [
                { "type": "number" },
                { "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 },
            ],
        })
    }
}

impl<'de> Deserialize<'de> for Pitch {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Stated {
            Square(f64),
            Two([f64; 2]),
        }
        let pitch = match Stated::deserialize(from)? {
            Stated::Square(dpi) => Self::of_dpi(dpi),
            Stated::Two(dpi) => Self::of_two_dpi(dpi),
        };
        pitch.ok_or_else(|| D::Error::custom("a resolution is between 1 and 100000 dpi"))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pitch(text: &str) -> Pitch {
        text.parse().unwrap()
    }

    #[test]
    fn both_spellings_are_read_and_written() {
        for (text, dpi, sentence) in [
            ("1500", [1500.0; 2], "1500 dpi"),
            ("1814x1337", [1814.0, 1337.0], "1814 x 1337 dpi"),
            ("203.2", [203.2; 2], "203.2 dpi"),
            ("14um", [12_700.0 / 7.0; 2], "14 um"),
            ("14x19um", [12_700.0 / 7.0, 25_400.0 / 19.0], "14 x 19 um"),
            ("46.6x46.5um", [254_000.0 / 466.0, 254_000.0 / 465.0], "46.6 x 46.5 um"),
        ] {
            assert_eq!(pitch(text).dpi(), dpi);
            assert_eq!(pitch(text).to_string(), text);
            assert_eq!(format!("{:#}", pitch(text)), sentence);
        }
        for (text, same) in [
            ("1500dpi", "1500"),
            ("1500x1500", "1500"),
            ("1814 x 1337 dpi", "1814x1337"),
            ("14um x 0.019mm", "14x19um"),
            ("0.5mil", "2000"),
        ] {
            assert_eq!(pitch(text), pitch(same), "{text}");
        }
        for text in
            ["", "x", "14x", "14x19x20um", "0.1um", "0", "1e9", "14.00001um", "-14um", "nan"]
        {
            assert!(text.parse::<Pitch>().is_err(), "{text}");
        }
    }

    #[test]
    fn two_small_numbers_need_a_unit() {
        for text in ["14x19", "46.6x46.5", "35X35", "99*99.9"] {
            let error = Pitch::stated(text).unwrap_err().to_string();
            assert!(error.contains(&format!("write {text}um for")), "{error}");
        }
        for text in ["14x19um", "14x19dpi", "14 x 19 dpi", "14", "99x100", "1814x1337", "14umx19um"]
        {
            let stated = Pitch::stated(text).unwrap();
            assert_eq!(Pitch::stated(&stated.to_string()), Ok(stated), "{text}");
        }
        assert!(Pitch::stated("14y19").is_err());
    }

    #[test]
    fn work_that_needs_square_pixels_says_so() {
        assert_eq!(pitch("14um").square("supports need"), Ok(Dpi::new(12_700.0 / 7.0).unwrap()));
        assert_eq!(
            pitch("14x19um").square("supports need").unwrap_err().to_string(),
            "its pixels are 14 x 19 um, and supports need square pixels"
        );
    }

    proptest! {
        #[test]
        fn pitches_are_exact(nm in prop::array::uniform2(2540_u32..25_400_000)) {
            // Tenths of nanometers.
            let pitch = Pitch::of_two_dpi(nm.map(|nm| 254_000_000.0 / f64::from(nm))).unwrap();
            prop_assert_eq!(pitch.um(), nm.map(|nm| f64::from(nm) / 1e4));
            prop_assert_eq!(pitch.to_string().parse(), Ok(pitch));
            let json = serde_json::to_string(&pitch).unwrap();
            prop_assert_eq!(serde_json::from_str::<Pitch>(&json).unwrap(), pitch);
            for (axis, nm) in [(pitch.x, nm[0]), (pitch.y, nm[1])] {
                let (num, den) = axis.to_rational();
                // num / den = 254 000 000 / nm.
                prop_assert_eq!(u64::from(num) * u64::from(nm), 254_000_000 * u64::from(den));
            }
        }
    }
}
