//! Design rules as TOML files (002 section 6.2 e asks for rules of the process).

use std::collections::HashSet;

use lamp_stack::{Builtin, Catalogued, Length, LengthError, nonempty_text};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use thiserror::Error;

use super::{LeastWidth, WidthRule};

/// Design rules, by which features or layers do not suit a process.
///
/// ```
/// use lamp_stack::Catalogued;
/// use lamp_supports::DesignRules;
///
/// let rules = DesignRules::builtin("lamp-mould").unwrap();
/// assert_eq!((rules.widths().count(), rules.bond.len()), (4, 1));
/// ```
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DesignRules {
    /// Their name, for commands: small letters, digits and `-`.
    pub name: String,
    /// Their purpose, in a line.
    #[serde(deserialize_with = "nonempty_text")]
    pub description: String,
    /// How wide walls and pins must be.
    #[serde(default)]
    pub thin: Vec<LeastWidthRule>,
    /// How wide slots and holes must be.
    #[serde(default)]
    pub slot: Vec<LeastWidthRule>,
    /// How deep white must cure.
    #[serde(default)]
    pub bond: Vec<BondRule>,
    /// How long pins and holes may be.
    #[serde(default)]
    pub aspect: Vec<AspectRule>,
}

/// A rule of a width: one of the widths is given.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct LeastWidthRule {
    /// Its name, for findings.
    #[serde(deserialize_with = "nonempty_text")]
    pub name: String,
    /// The least width.
    #[serde(default, deserialize_with = "some_length")]
    pub least: Option<Length>,
    /// The least width in widths of a pixel.
    pub least_px: Option<f64>,
    /// Of slots and holes: the least width in cure widths, by which light moves each edge.
    pub cure_widths: Option<f64>,
    /// Where it is from.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// A rule of cure depth: white that cures no deeper does not bond to the layer below.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct BondRule {
    /// Its name, for findings.
    #[serde(deserialize_with = "nonempty_text")]
    pub name: String,
    /// The depth in thicknesses of the layer, above which white must cure.
    #[serde(default = "one")]
    pub layers: f64,
    /// Where it is from.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// A rule of aspect ratio: how long pins and holes may be for their width.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct AspectRule {
    /// Its name, for findings.
    #[serde(deserialize_with = "nonempty_text")]
    pub name: String,
    /// The greatest length over width.
    pub most: f64,
    /// The width up to which a feature is a pin or a hole; if `None`, any width.
    #[serde(default, deserialize_with = "some_length")]
    pub widest: Option<Length>,
    /// Where it is from.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

fn one() -> f64 {
    1.0
}

/// Why rules contradict each other.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum RuleError {
    /// A rule of walls has no width, or several.
    #[error("rule {0}: give least or least-px")]
    Width(String),
    /// A rule of slots has no width, or several.
    #[error("rule {0}: give least, least-px or cure-widths")]
    SlotWidth(String),
    /// A depth or a ratio is no number in its range.
    #[error("rule {rule}: {key} must be from {least} to {most}")]
    OutOfRange {
        /// The rule.
        rule: String,
        /// The key of the number.
        key: &'static str,
        /// The least number.
        least: f64,
        /// The greatest number.
        most: f64,
    },
    /// A width is no number above zero.
    #[error("rule {0}: the width must be above zero, and no more than 30000 pixels or 1 m")]
    NotPositive(String),
    /// Two rules have one name.
    #[error("rule {0} is there twice: give it another name")]
    Twice(String),
}

/// The greatest widths: wider than any image.
const MOST_PIXELS: f64 = 30_000.0;
const MOST_MM: f64 = 1000.0;
/// The greatest number of cure widths, depth in layers, and aspect ratio.
const MOST: f64 = 1000.0;

impl DesignRules {
    /// Returns the rules of widths.
    pub fn widths(&self) -> impl Iterator<Item = WidthRule> {
        let of_color = |rules: &'_ [LeastWidthRule], is_of_white: bool| {
            let rule = move |rule: &LeastWidthRule| {
                let LeastWidthRule { name, source, least, least_px, cure_widths } = rule;
                let least = least
                    .map(LeastWidth::Length)
                    .or(least_px.map(LeastWidth::Pixels))
                    .or(cure_widths.map(LeastWidth::CureWidths))?;
                Some(WidthRule { name: name.clone(), source: source.clone(), is_of_white, least })
            };
            rules.iter().filter_map(rule).collect::<Vec<_>>()
        };
        of_color(&self.thin, true).into_iter().chain(of_color(&self.slot, false))
    }
}

macro_rules! builtin {
    ($name:literal) => {
        Builtin { name: $name, toml: include_str!(concat!("../../rules/", $name, ".toml")) }
    };
}

impl Catalogued for DesignRules {
    const KIND: &'static str = "rule";
    const BUILTINS: &'static [Builtin] = &[builtin!("lamp-mould"), builtin!("none")];
    type CheckError = RuleError;

    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self) -> Result<(), RuleError> {
        let names = self.thin.iter().chain(&self.slot).map(|rule| &rule.name);
        let names = names.chain(self.bond.iter().map(|rule| &rule.name));
        let mut seen = HashSet::new();
        for name in names.chain(self.aspect.iter().map(|rule| &rule.name)) {
            if !seen.insert(name.as_str()) {
                return Err(RuleError::Twice(name.clone()));
            }
        }
        let in_range = |rule: &str, key, value: f64, [least, most]: [f64; 2]| {
            let out = || RuleError::OutOfRange { rule: rule.to_owned(), key, least, most };
            if (least..=most).contains(&value) { Ok(()) } else { Err(out()) }
        };
        for rule in self.thin.iter().chain(&self.slot) {
            let name = rule.name.as_str();
            let is_slot = self.slot.iter().any(|slot| slot.name == name);
            let is_valid = match (rule.least, rule.least_px, rule.cure_widths) {
                (Some(least), None, None) => least.um() > 0.0 && least.mm() <= MOST_MM,
                (None, Some(pixels), None) => pixels > 0.0 && pixels <= MOST_PIXELS,
                (None, None, Some(widths)) if is_slot => {
                    in_range(name, "cure-widths", widths, [0.1, MOST])?;
                    true
                }
                _ if is_slot => return Err(RuleError::SlotWidth(name.to_owned())),
                _ => return Err(RuleError::Width(name.to_owned())),
            };
            if !is_valid {
                return Err(RuleError::NotPositive(name.to_owned()));
            }
        }
        for rule in &self.bond {
            in_range(&rule.name, "layers", rule.layers, [0.1, MOST])?;
        }
        for rule in &self.aspect {
            in_range(&rule.name, "most", rule.most, [1.0, MOST])?;
            let is_width = |widest: Length| widest.um() > 0.0 && widest.mm() <= MOST_MM;
            if !rule.widest.is_none_or(is_width) {
                return Err(RuleError::NotPositive(rule.name.clone()));
            }
        }
        Ok(())
    }
}

fn some_length<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Length>, D::Error> {
    let text = String::deserialize(from)?;
    text.parse().map(Some).map_err(|error: LengthError| D::Error::custom(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_rules_are_those_of_the_source() {
        let names: Vec<String> = DesignRules::builtins().map(|rules| rules.name).collect();
        assert_eq!(names, ["lamp-mould", "none"]);
        let rules = DesignRules::builtin("lamp-mould").unwrap();
        let widths: Vec<WidthRule> = rules.widths().collect();
        // 25 pixels of 1/1500 inch, and 500 um.
        let LeastWidth::Length(pixels) = widths[0].least else { panic!("{:?}", widths[0]) };
        assert!((pixels.um() - 25.0 * 25_400.0 / 1500.0).abs() < 0.5, "{pixels}");
        assert_eq!(widths[1].least, LeastWidth::Length(Length::from_um(500.0)));
        assert_eq!(widths[3].least, LeastWidth::CureWidths(2.0));
        assert_eq!((rules.bond[0].layers, rules.aspect.len()), (1.0, 0));
        assert_eq!(DesignRules::builtin("none").unwrap().widths().count(), 0);
    }

    #[test]
    fn wrong_rules_are_refused_by_their_names() {
        let rule = |lines: &str| {
            let text = "name = 'a'\ndescription = 'b'\n[[thin]]\nname = 'c'\nsource = 'd'";
            DesignRules::from_toml(&format!("{text}\n{lines}")).unwrap_err().to_string()
        };
        for (lines, why) in [
            ("", "rule c: give least or least-px"),
            ("least = '1mm'\nleast-px = 3", "rule c: give least or least-px"),
            ("least-px = 0", "above zero"),
            ("least-px = nan", "above zero"),
            ("least = '-2um'", "above zero"),
            ("least = '2 parsec'", "line 6"),
            ("most = 3", "line 6: thin[0]: unknown key"),
            ("cure-widths = 2", "rule c: give least or least-px"),
            (
                "least-px = 3\n[[slot]]\nname = 'e'\nsource = 'd'\nleast-px = 3\ncure-widths = 2",
                "rule e: give least, least-px or cure-widths",
            ),
            (
                "least-px = 3\n[[slot]]\nname = 'e'\nsource = 'd'\ncure-widths = 0",
                "rule e: cure-widths must be from 0.1 to 1000",
            ),
            (
                "least-px = 3\n[[bond]]\nname = 'e'\nsource = 'd'\nlayers = inf",
                "rule e: layers must be from 0.1 to 1000",
            ),
            (
                "least-px = 3\n[[aspect]]\nname = 'e'\nsource = 'd'\nmost = 0.5",
                "rule e: most must be from 1 to 1000",
            ),
            (
                "least-px = 3\n[[aspect]]\nname = 'e'\nsource = 'd'\nmost = 5\nwidest = '0mm'",
                "rule e: the width must be above zero",
            ),
            ("least-px = 3\n[[bond]]\nname = 'c'\nsource = 'd'", "rule c is there twice"),
            (
                "least-px = 3\n[[slot]]\nname = 'c'\nsource = 'd'\nleast-px = 3",
                "rule c is there twice",
            ),
        ] {
            assert!(rule(lines).contains(why), "{lines}: {}", rule(lines));
        }
    }
}
