//! Lengths, sizes and resolutions, with parsers for text such as `100um` and `1500dpi`.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

/// A length, stored in micrometers.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Default)]
pub struct Length {
    um: f64,
}

impl Length {
    /// Creates a length from micrometers.
    pub const fn from_um(um: f64) -> Self {
        Self { um }
    }

    /// Creates a length from millimeters.
    pub const fn from_mm(mm: f64) -> Self {
        Self { um: mm * 1000.0 }
    }

    /// Returns the length in micrometers.
    pub const fn um(self) -> f64 {
        self.um
    }

    /// Returns the length in millimeters.
    pub const fn mm(self) -> f64 {
        self.um / 1000.0
    }

    /// Rounds to whole nanometers, which removes the rounding errors of sums and differences.
    pub fn to_whole_nm(self) -> Self {
        Self { um: (self.um * 1000.0).round() / 1000.0 }
    }

    /// Parses lengths along x and y, such as `25x40um` or `25um x 1mil`. A first one without a unit
    /// takes the unit of the second. Returns `None` if the text is not two lengths.
    pub fn pair(text: &str) -> Option<[Self; 2]> {
        let (x, y) = text.split_once(['x', 'X', '*'])?;
        let (x, x_unit) = split_unit(x).ok()?;
        let (y, y_unit) = split_unit(y).ok()?;
        let y_unit = y_unit?;
        let pair = [x * x_unit.unwrap_or(y_unit), y * y_unit];
        pair.iter().all(|um| um.is_finite()).then(|| pair.map(Self::from_um))
    }

    /// Returns the length in pixels at a resolution, not rounded.
    pub fn pixels(self, dpi: Dpi) -> f64 {
        self.um * dpi.get() / 25_400.0
    }
}

impl fmt::Display for Length {
    /// Formats in micrometers below one millimeter, and in millimeters above where that is exact.
    /// Two lengths never have the same text, and reading a text gives exactly its length.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.um.abs() >= 1000.0 && Self::from_mm(self.mm()) == *self {
            write!(f, "{}mm", self.mm())
        } else {
            write!(f, "{}um", self.um)
        }
    }
}

/// An error in the text of a length, a size or a resolution.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LengthError {
    /// The text does not start with a number.
    #[error(
        "`{0}` is not a length: write a number and a unit, such as 100um, 0.1mm, 4mil or 0.004in"
    )]
    NotALength(String),
    /// The number has no unit, or an unknown one.
    #[error("`{text}` has no known unit: add um, mm, cm, m, mil or in")]
    NoUnit {
        /// The given text.
        text: String,
    },
    /// The text is not two lengths with an `x` between them.
    #[error("`{0}` is not a size: write width x height and a unit, such as 4x4.5in or 100x80mm")]
    NotASize(String),
    /// The text is not a valid number of dots per inch.
    #[error(
        "`{0}` is not a resolution: write dots per inch, such as 1500, between 1 and 100000 and with at most four decimals"
    )]
    NotAResolution(String),
    /// The text is neither a resolution nor a pitch of pixels.
    #[error(
        "`{0}` is not a resolution: write dots per inch, such as 1500 or 1814x1337, between 1 and 100000, or how far pixels are apart, such as 14um or 14x19um, with at most four decimals"
    )]
    NotAPitch(String),
    /// Two numbers without a unit are so small that micrometers are meant.
    #[error(
        "`{0}` without a unit is dots per inch, which is very coarse: write {0}um for micrometers, or {0}dpi"
    )]
    CoarsePitch(String),
}

/// Splits `100um` into its number and the micrometers in its unit (`None` without a unit).
fn split_unit(text: &str) -> Result<(f64, Option<f64>), LengthError> {
    let text = text.trim();
    // Letters at the end are the unit, so `inf` and `nan` are no numbers.
    let digits = text.trim_end_matches(|c: char| c.is_alphabetic() || c == '"').trim_end();
    let number: f64 = match digits.parse() {
        // 1e999 reads as infinity.
        Ok(n) if f64::is_finite(n) => n,
        _ => return Err(LengthError::NotALength(text.to_owned())),
    };
    let um_per_unit = match text[digits.len()..].trim() {
        "" => None,
        // The micro sign and the Greek letter look alike, and both are in use.
        "um" | "µm" | "μm" => Some(1.0),
        "mm" => Some(1000.0),
        "cm" => Some(10_000.0),
        "m" => Some(1_000_000.0),
        "in" | "inch" | "\"" => Some(25_400.0),
        "mil" => Some(25.4),
        _ => return Err(LengthError::NoUnit { text: digits.to_owned() }),
    };
    Ok((number, um_per_unit))
}

impl FromStr for Length {
    type Err = LengthError;

    /// Parses a number and its unit: `um`, `mm`, `cm`, `m`, `in` (or `inch`) or `mil`.
    ///
    /// # Errors
    /// Returns an error if the number is missing or the unit is missing or unknown.
    fn from_str(text: &str) -> Result<Self, LengthError> {
        match split_unit(text)? {
            // A finite number may leave the range of doubles with its unit.
            (number, Some(um)) if (number * um).is_finite() => Ok(Self::from_um(number * um)),
            (_, Some(_)) => Err(LengthError::NotALength(text.trim().to_owned())),
            (_, None) => Err(LengthError::NoUnit { text: text.trim().to_owned() }),
        }
    }
}

/// A width and a height, such as a build area's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// The size along x.
    pub width: Length,
    /// The size along y.
    pub height: Length,
}

impl FromStr for Size {
    type Err = LengthError;

    /// Parses `4x4.5in` or `100mm x 4in`. A width without a unit takes the height's unit.
    ///
    /// # Errors
    /// Returns an error if the text is not two positive lengths with an `x` between them.
    fn from_str(text: &str) -> Result<Self, LengthError> {
        let wrong = || LengthError::NotASize(text.to_owned());
        let [width, height] = Length::pair(text).ok_or_else(wrong)?.map(Length::um);
        let possible = |um: f64| um > 0.0 && um.is_finite();
        if !possible(width) || !possible(height) {
            return Err(wrong());
        }
        Ok(Self { width: Length::from_um(width), height: Length::from_um(height) })
    }
}

impl fmt::Display for Size {
    /// Formats in millimeters where that is exact, and else in micrometers.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { width, height } = self;
        if [width, height].iter().all(|side| Length::from_mm(side.mm()) == **side) {
            write!(f, "{}x{}mm", width.mm(), height.mm())
        } else {
            write!(f, "{}x{}um", width.um, height.um)
        }
    }
}

/// A resolution along one axis in dots per inch, between 1 and 100 000, exact as a fraction: a pitch
/// of 14 um is 12700/7 dpi.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dpi {
    /// The pixels in 127 mm, five inches, as a fraction of whole numbers in lowest terms: 25.4 mm
    /// has no exact binary fraction.
    in_five_inches: [f64; 2],
}

// Neither number is NaN.
impl Eq for Dpi {}

const METRES_PER_INCH: f64 = 0.0254;

impl Dpi {
    /// Creates a resolution, or returns `None` if `dpi` is not between 1 and 100 000.
    ///
    /// The resolution is the simplest fraction that rounds to `dpi`. So a quotient of whole numbers
    /// is held exactly if the square of its divisor is below some 10^12.
    pub fn new(dpi: f64) -> Option<Self> {
        (1.0..=100_000.0).contains(&dpi).then(|| {
            let [num, den] = simplest_fraction(dpi);
            let in_five_inches = if den % 5.0 == 0.0 { [num, den / 5.0] } else { [num * 5.0, den] };
            Self { in_five_inches }
        })
    }

    /// Returns the resolution of pixels whose centers are `pitch` apart, or `None` if that has more
    /// than four decimals in micrometers or is not between 0.254 um and 25.4 mm.
    pub fn of_pitch(pitch: Length) -> Option<Self> {
        let scaled = pitch.um * 1e4;
        let is_whole = (scaled - scaled.round()).abs() <= 1e-12 * scaled.abs();
        is_whole.then(|| Self::new(254_000_000.0 / scaled.round()))?
    }

    /// Returns the dots per inch.
    pub const fn get(self) -> f64 {
        let [num, den] = self.in_five_inches;
        num / (5.0 * den)
    }

    /// Returns a number of pixels and the millimeters that they take, both whole for resolutions of
    /// few decimals. Multiplied by the first and then divided by the second, the position of a
    /// pixel's edge or center that a double holds is exact in pixels.
    #[inline]
    pub fn pixels_in_mm(self) -> [f64; 2] {
        let [num, den] = self.in_five_inches;
        [num, den * 127.0]
    }

    /// Returns the pixels per meter, rounded to a whole number.
    pub(crate) fn per_metre(self) -> u32 {
        (self.get() / METRES_PER_INCH).round() as u32
    }

    /// Converts whole pixels per meter. Prefers whole dots per inch that round to the same
    /// number (59055 pixels per meter are 1500 dpi).
    pub(crate) fn from_per_metre(pixels: u32) -> Option<Self> {
        let exact = f64::from(pixels) * METRES_PER_INCH;
        let whole = Self::new(exact.round()).filter(|whole| whole.per_metre() == pixels);
        whole.or_else(|| Self::new(exact))
    }

    /// Returns the distance between two pixel centers, 25.4 mm / dpi.
    pub fn pitch(self) -> Length {
        let [num, den] = self.in_five_inches;
        Length::from_um(127_000.0 * den / num)
    }

    /// Returns the exact fraction for TIFF's rational tags, with the smallest sufficient power of
    /// ten (at most 10 000) as its denominator if there is one. A number that does not fit is
    /// rounded to four decimals.
    pub(crate) fn to_rational(self) -> (u32, u32) {
        let fits = |numbers: [f64; 2]| {
            let is_long = |n: f64| n.fract() == 0.0 && n <= f64::from(u32::MAX);
            numbers.iter().all(|&n| is_long(n)).then(|| (numbers[0] as u32, numbers[1] as u32))
        };
        let [num, den] = self.in_five_inches;
        let ratio = if num % 5.0 == 0.0 { [num / 5.0, den] } else { [num, 5.0 * den] };
        let [num, den] = ratio;
        let decimal =
            |power: f64| (power % den == 0.0).then(|| fits([power / den * num, power]))?;
        let decimals = [1.0, 10.0, 100.0, 1000.0, 10_000.0].into_iter();
        decimals.filter_map(decimal).next().or_else(|| fits(ratio)).unwrap_or_else(|| {
            // At most 100 000 times 10 000, which 32 bits hold.
            ((self.get() * 10_000.0).round() as u32, 10_000)
        })
    }
}

/// Returns the convergent of least denominator that rounds to `value`, by Euclid's algorithm.
fn simplest_fraction(value: f64) -> [f64; 2] {
    // A double of 1 or more is a whole number of 2^-52, so all of this is exact.
    let one = 1_u128 << 52;
    let (mut a, mut b) = ((value * one as f64) as u128, one);
    let (mut before, mut last) = ([0, 1], [1, 0]);
    loop {
        let next = [0, 1].map(|k| a / b * last[k] + before[k]);
        let [num, den] = next.map(|n: u128| n as f64);
        // The last convergent is the value itself, so b never becomes zero here.
        if num / den == value {
            return [num, den];
        }
        (a, b) = (b, a % b);
        (before, last) = (last, next);
    }
}

/// Returns whether pixels are square by their resolutions across and down: up to a thousandth, or
/// `rounding` if that is more. A resolution that is not above zero says nothing.
pub(crate) fn has_square_pixels(resolutions: [f64; 2], rounding: f64) -> bool {
    let [across, down] = resolutions;
    let are_stated = resolutions.iter().all(|side| side.is_finite() && *side > 0.0);
    !are_stated || (across - down).abs() <= (across.max(down) * 1e-3).max(rounding)
}

impl FromStr for Dpi {
    type Err = LengthError;

    /// Parses `1500` or `1500dpi`.
    ///
    /// # Errors
    /// Returns an error if the number is missing or out of range, or not a fraction that TIFF's
    /// rational tags hold.
    fn from_str(text: &str) -> Result<Self, LengthError> {
        let number = text.trim().trim_end_matches("dpi").trim_end();
        number
            .parse()
            .ok()
            .and_then(Self::new)
            .filter(|dpi| {
                let (num, den) = dpi.to_rational();
                f64::from(num) / f64::from(den) == dpi.get()
            })
            .ok_or_else(|| LengthError::NotAResolution(text.to_owned()))
    }
}

impl fmt::Display for Dpi {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.get().fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_parses() {
        for (text, um) in [
            ("100um", 100.0),
            ("100 µm", 100.0),
            ("0.1mm", 100.0),
            ("4mil", 101.6),
            ("0.004in", 101.6),
            ("1 inch", 25_400.0),
            ("-2mm", -2000.0),
            ("1e-1mm", 100.0),
            ("5cm", 50_000.0),
            ("1.2m", 1_200_000.0),
        ] {
            let length: Length = text.parse().unwrap();
            assert!((length.um() - um).abs() < 1e-9, "{text}");
        }
    }

    #[test]
    fn texts_are_read_as_the_lengths_that_they_are_of() {
        let next = |um: f64| f64::from_bits(um.to_bits() + 1);
        for um in [100.0, 1e3 / 3.0, 1000.0, 1270.0, next(1000.0), next(1270.0), -2540.0, 1e7 / 3.0]
        {
            let length = Length::from_um(um);
            assert_eq!(length.to_string().parse(), Ok(length), "{length}");
            let size = Size { width: length, height: Length::from_um(80_500.0) };
            assert!(um < 0.0 || size.to_string().parse() == Ok(size), "{size}");
        }
        assert_eq!(Length::from_um(next(1000.0)).to_string(), "1000.0000000000001um");
        assert_eq!(Length::from_mm(12.7).to_string(), "12.7mm");
    }

    #[test]
    fn a_length_needs_a_number_and_a_unit() {
        for text in ["", "mm", "100", "100furlong", "nanmm", "infmm", "1..2mm", "1e308in"] {
            assert!(text.parse::<Length>().is_err(), "{text}");
        }
    }

    #[test]
    fn a_size_shares_its_unit() {
        let size: Size = "4x4.5in".parse().unwrap();
        assert_eq!((size.width.mm(), size.height.mm()), (101.6, 114.3));
        let size: Size = "100mm x 4in".parse().unwrap();
        assert_eq!((size.width.mm(), size.height.mm()), (100.0, 101.6));
        for text in ["4x4", "4in", "x4in", "-4x4in", "0x4in"] {
            assert!(text.parse::<Size>().is_err(), "{text}");
        }
    }

    #[test]
    fn whole_resolutions_survive_as_whole_pixels_a_metre() {
        for dpi in (1..=100_000).map(|dpi| Dpi::new(dpi.into()).unwrap()) {
            assert_eq!(Dpi::from_per_metre(dpi.per_metre()), Some(dpi));
        }
        assert_eq!(Dpi::new(1500.0).unwrap().per_metre(), 59_055);
        // 203.2 dpi are 8000 pixels a meter.
        assert_eq!(Dpi::from_per_metre(8000), Dpi::new(203.2));
        assert_eq!(Dpi::from_per_metre(0), None);
    }

    #[test]
    fn resolutions_survive_as_rationals() {
        for dpi in [1500.0, 2400.0, 203.2, 72.25, 1.0, 99_999.999, 12_700.0 / 7.0] {
            let (num, den) = Dpi::new(dpi).unwrap().to_rational();
            assert_eq!(f64::from(num) / f64::from(den), dpi);
        }
        let rational = |dpi| Dpi::new(dpi).unwrap().to_rational();
        assert_eq!(rational(1500.0), (1500, 1));
        assert_eq!(rational(203.2), (2032, 10));
        assert_eq!(rational(12_700.0 / 7.0), (12_700, 7));
        // A number without a fraction of two 32-bit numbers is rounded.
        assert_eq!(rational(99_999.0 + 1e-7), (999_990_000, 10_000));
        assert!("0".parse::<Dpi>().is_err());
        assert!("1500.12345678".parse::<Dpi>().is_err());
        assert!("nan".parse::<Dpi>().is_err());
    }
}
