//! `--turns`: turns of images, or by multiples of an angle.

use std::ffi::OsStr;
use std::fmt;

use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};
use clap::{Arg, Command};
use lamp_build::{FreeTurns, Turns};

/// The turns that packing may use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum TurnsArg {
    /// Turns of images.
    Images(Turns),
    /// Turns that take stacks sliced at other angles, too.
    Free(FreeTurns),
}

/// As `--turns` takes it.
impl fmt::Display for TurnsArg {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Images(turns) => turns.fmt(f),
            Self::Free(turns) => turns.fmt(f),
        }
    }
}

/// Parses names and angles.
#[derive(Clone)]
pub(super) struct TurnsParser;

impl TypedValueParser for TurnsParser {
    type Value = TurnsArg;

    fn parse_ref(
        &self,
        command: &Command,
        option: Option<&Arg>,
        value: &OsStr,
    ) -> Result<TurnsArg, clap::Error> {
        let parsed = StringValueParser::new().try_map(|text| -> Result<TurnsArg, String> {
            if let Ok(turns) = text.parse() {
                return Ok(TurnsArg::Images(turns));
            }
            if !text.starts_with(|first: char| first.is_ascii_digit()) {
                return Err("write none, half, quarters or an angle, as 15deg".to_owned());
            }
            let free: FreeTurns = text.parse().map_err(|wrong| format!("{wrong}"))?;
            let is_right = free.degrees().is_empty();
            Ok(if is_right { TurnsArg::Images(Turns::Quarters) } else { TurnsArg::Free(free) })
        });
        parsed.parse_ref(command, option, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let values = [
            ("none", "Parts stay as they were sliced"),
            ("half", "By 180 degrees"),
            ("quarters", "By 90, 180 and 270 degrees"),
            (
                "15deg",
                "By all multiples of this or another angle that divides a right angle into at most \
                 18, by outlines. No build is written, but a script: it slices the parts at the \
                 angles that this takes, and lays the build out",
            ),
        ];
        let values = values.map(|(name, help)| PossibleValue::new(name).help(help));
        Some(Box::new(values.into_iter()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn right_angles_are_turns_of_images() {
        let parsed = |text: &str| {
            let option = Arg::new("turns").value_parser(TurnsParser);
            let matches = Command::new("tile").no_binary_name(true).arg(option);
            let matches =
                matches.try_get_matches_from([text]).map_err(|error| error.to_string())?;
            Ok::<_, String>(*matches.get_one::<TurnsArg>("turns").unwrap())
        };
        for (text, turns) in
            [("half", Turns::Half), ("quarters", Turns::Quarters), ("90deg", Turns::Quarters)]
        {
            assert_eq!(parsed(text), Ok(TurnsArg::Images(turns)), "{text}");
        }
        assert_eq!(parsed("15deg"), Ok(TurnsArg::Free("15deg".parse().unwrap())));
        assert!(parsed("7deg").unwrap_err().contains("at most 18"));
        assert!(parsed("some").unwrap_err().contains("none, half, quarters or an angle"));
    }
}
