//! Colors of surfaces, as files of parts give them.

use std::fmt;
use std::str::FromStr;

/// A color: red, green and blue from 0 to 255. Transparency does not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Color(pub [u8; 3]);

/// The colors that have names, in STEP (ISO 10303-46) and for people.
const NAMES: [(&str, Color); 8] = [
    ("black", Color([0, 0, 0])),
    ("blue", Color([0, 0, 255])),
    ("cyan", Color([0, 255, 255])),
    ("green", Color([0, 255, 0])),
    ("magenta", Color([255, 0, 255])),
    ("red", Color([255, 0, 0])),
    ("white", Color([255, 255, 255])),
    ("yellow", Color([255, 255, 0])),
];

impl Color {
    /// Returns the color of shares of full red, green and blue, rounded to 8 bits; `None` if a
    /// share is not from 0 to 1.
    ///
    /// ```
    /// use lamp_brep::Color;
    ///
    /// assert_eq!(Color::of_shares([1.0, 0.5, 0.0]), Some(Color([255, 128, 0])));
    /// assert_eq!(Color::of_shares([1.0, 2.0, 0.0]), None);
    /// ```
    pub fn of_shares(shares: [f64; 3]) -> Option<Self> {
        let is_share = |share: &f64| (0.0..=1.0).contains(share);
        let level = |share: f64| (share * 255.0).round() as u8;
        shares.iter().all(is_share).then(|| Self(shares.map(level)))
    }

    /// Returns the color of a name, such as `red`.
    pub fn of_name(name: &str) -> Option<Self> {
        let named = NAMES.iter().find(|(known, _)| name.eq_ignore_ascii_case(known));
        named.map(|(_, color)| *color)
    }
}

impl fmt::Display for Color {
    /// Writes `#rrggbb`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self([red, green, blue]) = self;
        write!(f, "#{red:02x}{green:02x}{blue:02x}")
    }
}

impl FromStr for Color {
    type Err = String;

    /// Parses `#rrggbb`, `#rrggbbaa`, whose transparency does not count, or a name.
    fn from_str(text: &str) -> Result<Self, String> {
        let digits = text.strip_prefix('#').filter(|digits| matches!(digits.len(), 6 | 8));
        let digits = digits.filter(|digits| digits.bytes().all(|byte| byte.is_ascii_hexdigit()));
        let of_digits = digits.and_then(|digits| u32::from_str_radix(&digits[..6], 16).ok());
        let of_digits = of_digits.map(|number| {
            let [_, color @ ..] = number.to_be_bytes();
            Self(color)
        });
        of_digits.or_else(|| Self::of_name(text)).ok_or_else(|| {
            let names: Vec<&str> = NAMES.iter().map(|(name, _)| *name).collect();
            format!("`{text}` is not a color: write \"#ff8000\" or one of {}", names.join(", "))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_are_read_as_they_are_written() {
        for (text, levels) in [
            ("#ff8000", [255, 128, 0]),
            ("#FF800040", [255, 128, 0]),
            ("red", [255, 0, 0]),
            ("Cyan", [0, 255, 255]),
        ] {
            assert_eq!(text.parse(), Ok(Color(levels)));
            assert_eq!(Color(levels).to_string().parse(), Ok(Color(levels)));
        }
        for wrong in
            ["", "#", "#ff80", "ff8000", "#ff800g", "#ff80001", "#+f8000", "#ü0000", "teal"]
        {
            assert!(wrong.parse::<Color>().unwrap_err().contains("not a color"), "{wrong}");
        }
    }
}
