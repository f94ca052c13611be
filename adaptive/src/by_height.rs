//! Values that differ by height, such as the bounds of layers' errors.

use std::cmp::Ordering;
use std::fmt::{self, Display};
use std::str::FromStr;

use lamp_stack::Length;
use thiserror::Error;

use crate::swept_layer::SweptLayer;

/// Heights are sums of steps, whose rounding must not lead a layer into the next range.
const ROUNDING_UM: f64 = 1e-3;

/// Values for ranges of height, which follow each other from below without a gap. Heights are those
/// of the placed part, as pages state them.
///
/// The text of a value for all heights is the value alone; ranges stand behind values:
/// `2%@0mm..12mm,0.5%@12mm..`.
///
/// ```
/// use lamp_adaptive::{ByHeight, Share};
///
/// let bounds: ByHeight<Share> = "2%@..12mm, 0.5%@12mm..".parse()?;
/// assert_eq!(bounds.to_string(), "0.02@..12mm,0.005@12mm..");
/// assert!("2%@..12mm,0.5%@13mm..".parse::<ByHeight<Share>>().is_err());
/// # Ok::<(), lamp_adaptive::ByHeightError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ByHeight<T> {
    ranges: Vec<HeightRange<T>>,
}

/// A value for a range of height.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightRange<T> {
    /// The value.
    pub value: T,
    /// The lower end; `None` if it holds for all heights below the upper end.
    pub from: Option<Length>,
    /// The upper end; `None` if it holds for all heights above the lower end.
    pub to: Option<Length>,
}

/// Why a text or a list is no values by height.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ByHeightError {
    /// A value or a height cannot be read.
    #[error("{0}")]
    Unreadable(String),
    /// The text behind `@` is no range.
    #[error("`{0}` is not a range of height: write 0mm..12mm, or 12mm.. up to the top")]
    NotARange(String),
    /// A range ends where it begins, or below.
    #[error("the range {0} is empty: write the lower height first")]
    Empty(String),
    /// Two values hold at the same heights.
    #[error("{low} and {high} overlap: let the second range begin where the first ends")]
    Overlap {
        /// The range that begins lower.
        low: String,
        /// The other one.
        high: String,
    },
    /// No value holds between two ranges.
    #[error("{low} and {high} leave a gap: let the second range begin where the first ends")]
    Gap {
        /// The range below the gap.
        low: String,
        /// The range above it.
        high: String,
    },
}

impl<T> HeightRange<T> {
    /// Returns the ends as text: `0mm..12mm`, or `..` for all heights.
    pub fn ends(&self) -> String {
        let end = |end: Option<Length>| end.map_or_else(String::new, |end| end.to_string());
        format!("{}..{}", end(self.from), end(self.to))
    }
}

impl<T> ByHeight<T> {
    /// Creates values from their ranges, in any order.
    ///
    /// # Errors
    /// Returns an error if a range is empty, two overlap, or two leave a gap between them.
    pub fn new(mut ranges: Vec<HeightRange<T>>) -> Result<Self, ByHeightError> {
        let um = |end: Option<Length>, open: f64| end.map_or(open, Length::um);
        let low = |range: &HeightRange<T>| um(range.from, f64::NEG_INFINITY);
        let high = |range: &HeightRange<T>| um(range.to, f64::INFINITY);
        ranges.sort_by(|a, b| low(a).total_cmp(&low(b)));
        // A height of NaN has no order, and is refused, too.
        let rises =
            |range: &HeightRange<T>| low(range).partial_cmp(&high(range)) == Some(Ordering::Less);
        if let Some(range) = ranges.iter().find(|range| !rises(range)) {
            return Err(ByHeightError::Empty(range.ends()));
        }
        for pair in ranges.windows(2) {
            let [low_ends, high_ends] = [0, 1].map(|k: usize| pair[k].ends());
            if low(&pair[1]) < high(&pair[0]) {
                return Err(ByHeightError::Overlap { low: low_ends, high: high_ends });
            }
            if low(&pair[1]) > high(&pair[0]) {
                return Err(ByHeightError::Gap { low: low_ends, high: high_ends });
            }
        }
        match ranges.is_empty() {
            true => Err(ByHeightError::Unreadable("there is no value".to_owned())),
            false => Ok(Self { ranges }),
        }
    }

    /// Parses the text of values, each of them by `value`.
    ///
    /// # Errors
    /// Returns an error if a value or a range cannot be read, or as [`new`](Self::new) does.
    pub fn parse(
        text: &str,
        value: impl Fn(&str) -> Result<T, String>,
    ) -> Result<Self, ByHeightError> {
        let of_range = |part: &str| -> Result<HeightRange<T>, ByHeightError> {
            let read = |text: &str| value(text.trim()).map_err(ByHeightError::Unreadable);
            let Some((text, range)) = part.split_once('@') else {
                return Ok(HeightRange { value: read(part)?, from: None, to: None });
            };
            let wrong = || ByHeightError::NotARange(range.trim().to_owned());
            let (from, to) = range.split_once("..").ok_or_else(wrong)?;
            let end = |text: &str| match text.trim() {
                "" => Ok(None),
                // Zero is zero in any unit.
                "0" => Ok(Some(Length::default())),
                text => text.parse().map(Some).map_err(|_| wrong()),
            };
            Ok(HeightRange { value: read(text)?, from: end(from)?, to: end(to)? })
        };
        Self::new(text.split(',').map(of_range).collect::<Result<_, _>>()?)
    }

    /// Returns the ranges, from below.
    pub fn ranges(&self) -> &[HeightRange<T>] {
        &self.ranges
    }

    /// Returns other values for the same ranges.
    pub fn map<U>(&self, value: impl Fn(&T) -> U) -> ByHeight<U> {
        let of_range = |range: &HeightRange<T>| HeightRange {
            value: value(&range.value),
            from: range.from,
            to: range.to,
        };
        ByHeight { ranges: self.ranges.iter().map(of_range).collect() }
    }

    /// Returns the heights of a part, given its ends in micrometers, for which there is no value.
    pub(crate) fn missing(&self, [bottom_um, top_um]: [f64; 2]) -> Option<[Length; 2]> {
        let [bottom, top] = [bottom_um, top_um].map(|um| Length::from_um(um).to_whole_nm());
        let (first, last) = (self.ranges[0].from, self.ranges[self.ranges.len() - 1].to);
        let is_beyond = |a: Length, b: Length| a.um() > b.um() + ROUNDING_UM;
        if let Some(first) = first.filter(|first| is_beyond(*first, bottom)) {
            return Some([bottom, first]);
        }
        last.filter(|last| is_beyond(top, *last)).map(|last| [last, top])
    }
}

impl ByHeight<f64> {
    /// Returns the least number of the ranges that a layer meets.
    pub fn of_layer(&self, layer: &SweptLayer) -> f64 {
        let last = self.ranges.len() - 1;
        let meets = |(k, range): &(usize, &HeightRange<f64>)| {
            // The last layer may reach above the part, and so above all ranges.
            let from = range.from.filter(|_| *k > 0);
            let to = range.to.filter(|_| *k < last);
            from.is_none_or(|from| layer.top_um() > from.um() + ROUNDING_UM)
                && to.is_none_or(|to| layer.bottom_um < to.um() - ROUNDING_UM)
        };
        let met = self.ranges.iter().enumerate().filter(meets);
        met.map(|(_, range)| range.value).fold(f64::INFINITY, f64::min)
    }

    /// Returns the least and the greatest number.
    pub fn least_and_most(&self) -> [f64; 2] {
        let numbers = || self.ranges.iter().map(|range| range.value);
        [numbers().fold(f64::INFINITY, f64::min), numbers().fold(f64::NEG_INFINITY, f64::max)]
    }
}

impl<T> From<T> for ByHeight<T> {
    /// Gives all heights the same value.
    fn from(value: T) -> Self {
        Self { ranges: vec![HeightRange { value, from: None, to: None }] }
    }
}

impl<T: Display> Display for ByHeight<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, range) in self.ranges.iter().enumerate() {
            let comma = if k == 0 { "" } else { "," };
            write!(f, "{comma}{}", range.value)?;
            if range.from.is_some() || range.to.is_some() {
                write!(f, "@{}", range.ends())?;
            }
        }
        Ok(())
    }
}

impl<T: FromStr<Err: Display>> FromStr for ByHeight<T> {
    type Err = ByHeightError;

    fn from_str(text: &str) -> Result<Self, ByHeightError> {
        Self::parse(text, |value| value.parse().map_err(|error: T::Err| error.to_string()))
    }
}

/// A share of a volume or an area: 0.02 is 2%.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Share(
    /// Zero or more.
    pub f64,
);

impl Display for Share {
    /// Formats shares below 1 as numbers, others in percent.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0 < 1.0 { write!(f, "{}", self.0) } else { write!(f, "{}%", self.0 * 100.0) }
    }
}

impl FromStr for Share {
    type Err = String;

    /// Parses `2%` or `0.02`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (number, is_percent) = match text.trim().strip_suffix('%') {
            Some(number) => (number.trim_end(), true),
            None => (text.trim(), false),
        };
        match number.parse::<f64>() {
            // 2 is far more often meant to be 2% than 200%.
            Ok(number) if !is_percent && number >= 1.0 => {
                Err(format!("`{text}` is not below 1: write {number}% or {}", number / 100.0))
            }
            Ok(number) if number >= 0.0 && number.is_finite() => {
                Ok(Self(if is_percent { number / 100.0 } else { number }))
            }
            _ => Err(format!("`{text}` is not a share: write 2% or 0.02")),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use proptest::test_runner::Config;

    use super::*;

    fn layer(bottom_um: f64, top_um: f64) -> SweptLayer {
        SweptLayer { bottom_um, thickness_um: top_um - bottom_um, ..SweptLayer::default() }
    }

    #[test]
    fn a_layer_keeps_the_least_bound_that_it_meets() {
        let bounds: ByHeight<Share> = "0.5%@12mm..,2%@0..10mm,1%@10mm..12mm".parse().unwrap();
        let bounds = bounds.map(|Share(share)| *share);
        for (bottom, top, expected) in [
            (-50.0, -10.0, 0.02),
            (9_900.0, 10_000.0, 0.02),
            (9_900.0, 10_000.000_001, 0.02),
            (9_900.0, 10_001.0, 0.01),
            (9_900.0, 12_100.0, 0.005),
            (11_999.999_999, 12_100.0, 0.005),
            (90_000.0, 90_100.0, 0.005),
        ] {
            assert_eq!(bounds.of_layer(&layer(bottom, top)), expected, "{bottom} {top}");
        }
        assert_eq!(bounds.least_and_most(), [0.005, 0.02]);
    }

    #[test]
    fn ranges_follow_each_other() {
        let of = |text: &str| text.parse::<ByHeight<Share>>().unwrap_err().to_string();
        for (text, why) in [
            ("2%@0..12mm,1%@11mm..", "0um..12mm and 11mm.. overlap: let the second range begin"),
            ("2%@0..12mm,1%@13mm..", "0um..12mm and 13mm.. leave a gap: let the second range"),
            ("2%,1%@13mm..", ".. and 13mm.. overlap"),
            ("2%,1%", ".. and .. overlap"),
            ("2%@12mm..0", "the range 12mm..0um is empty"),
            ("2%@12..14", "`12..14` is not a range of height: write 0mm..12mm"),
            ("2%@12mm", "`12mm` is not a range"),
            ("2@12mm..", "`2` is not below 1: write 2% or 0.02"),
            ("", "`` is not a share"),
            ("2%@..12mm,", "`` is not a share"),
        ] {
            assert!(of(text).starts_with(why), "{text}: {}", of(text));
        }
    }

    #[test]
    fn heights_without_a_value_are_found() {
        let missing = |text: &str, ends: [f64; 2]| {
            let bounds: ByHeight<Share> = text.parse().unwrap();
            bounds.missing(ends).map(|ends| ends.map(Length::um))
        };
        assert_eq!(missing("1%", [-1e9, 1e9]), None);
        assert_eq!(missing("1%@0..12mm", [0.0, 12_000.000_5]), None);
        assert_eq!(missing("1%@0..12mm", [-5.0, 9_000.0]), Some([-5.0, 0.0]));
        assert_eq!(missing("1%@0..12mm", [0.0, 13_000.0]), Some([12_000.0, 13_000.0]));
        assert_eq!(missing("1%@..12mm,2%@12mm..", [-1e9, 1e9]), None);
    }

    #[test]
    fn shares_are_parsed() {
        for (text, share) in [("2%", 0.02), ("0.05", 0.05), ("150%", 1.5), (" 3 % ", 0.03)] {
            assert_eq!(text.parse(), Ok(Share(share)));
        }
        for wrong in ["", "-1%", "nan", "2 percent", "2", "inf%"] {
            assert!(wrong.parse::<Share>().is_err(), "{wrong}");
        }
    }

    proptest! {
        #![proptest_config(Config { failure_persistence: None, ..Config::default() })]

        #[test]
        fn texts_lead_back_to_their_values(
            um in prop::collection::btree_set(-1_000_000i64..1_000_000, 1..5),
            shares in prop::collection::vec(0u32..300_000, 6),
            [open_below, open_above] in [any::<bool>(); 2],
        ) {
            let height = |um: &i64| Some(Length::from_um(*um as f64 / 8.0));
            let mut ends: Vec<Option<Length>> = um.iter().map(height).collect();
            if open_below { ends.insert(0, None); }
            if open_above || ends.len() < 2 { ends.push(None); }
            let range = |(pair, share): (&[Option<Length>], &u32)| HeightRange {
                value: Share(f64::from(*share) / 100_000.0), from: pair[0], to: pair[1],
            };
            let mut ranges: Vec<_> = ends.windows(2).zip(&shares).map(range).collect();
            let values = ByHeight::new(ranges.clone()).unwrap();
            prop_assert_eq!(values.ranges(), &ranges[..]);
            let again: ByHeight<Share> = values.to_string().parse().unwrap();
            for (a, b) in again.ranges().iter().zip(values.ranges()) {
                prop_assert!((a.from, a.to) == (b.from, b.to));
                prop_assert!((a.value.0 - b.value.0).abs() < 1e-15 + 1e-15 * b.value.0);
            }
            prop_assert_eq!(again.to_string(), values.to_string());
            ranges.reverse();
            prop_assert_eq!(ByHeight::new(ranges).unwrap(), values);
        }
    }
}
