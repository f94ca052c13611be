//! The light of gray levels on a machine's resin.

use lamp_stack::nonempty_text;
use serde::Deserialize;

use super::MachineError;

/// How much light, or cure, a gray level of the machine gives, for gray edges.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MachineGamma {
    /// The exponent of light over level: light = level ^ value, each as a share of white's.
    pub value: Option<f64>,
    /// In place of it, pairs of a level and its light, each from 0 to 255 and rising; straight
    /// between them.
    pub levels: Option<Vec<[f64; 2]>>,
    /// The least level that cures, from 1 to 255.
    #[serde(default = "one")]
    pub least_level: u8,
    /// The section, table or data sheet.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

fn one() -> u8 {
    1
}

impl MachineGamma {
    pub(super) fn check(&self) -> Result<(), MachineError> {
        let fault = |why| Err(MachineError::Gamma(why));
        if self.least_level == 0 {
            return fault("least_level: it must be between 1 and 255");
        }
        match (self.value, &self.levels) {
            // NaN lies in no range.
            (Some(value), None) if !(0.1..=10.0).contains(&value) => {
                fault("value: it must be between 0.1 and 10")
            }
            (None, Some(pairs)) => {
                let ends = [pairs.first(), pairs.last()];
                let is_rising =
                    pairs.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] < pair[1][1]);
                match ends == [Some(&[0.0; 2]), Some(&[255.0; 2])] && is_rising {
                    true => Ok(()),
                    false => fault(
                        "levels: pairs of level and light must rise from [0, 0] to [255, 255]",
                    ),
                }
            }
            (Some(_), Some(_)) => fault("write value or levels, not both"),
            _ => Ok(()),
        }
    }

    /// Returns the level that gives each share of light, of 255. A level below half of
    /// [`least_level`](Self::least_level) is 0, and any other at least that.
    pub fn levels_of_light(&self) -> [u8; 256] {
        std::array::from_fn(|light| {
            let level = self.exact(light as f64);
            let least = f64::from(self.least_level);
            if light == 0 || level < least / 2.0 { 0 } else { level.max(least).round() as u8 }
        })
    }

    /// Returns the level of a light, not rounded.
    fn exact(&self, light: f64) -> f64 {
        let straight = [[0.0; 2], [255.0; 2]];
        let pairs = self.levels.as_deref().unwrap_or(&straight);
        let bent = self.value.map_or(light, |value| 255.0 * (light / 255.0).powf(1.0 / value));
        let above = pairs.partition_point(|pair| pair[1] < bent).clamp(1, pairs.len() - 1);
        let [[level, from], [next, to]] = [pairs[above - 1], pairs[above]];
        level + (next - level) * (bent - from) / (to - from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gamma(value: Option<f64>, levels: Option<&[[f64; 2]]>, least_level: u8) -> MachineGamma {
        let levels = levels.map(<[_]>::to_vec);
        MachineGamma { value, levels, least_level, source: "-".to_owned() }
    }

    const MEASURED: [[f64; 2]; 4] = [[0.0, 0.0], [60.0, 5.0], [128.0, 90.0], [255.0, 255.0]];

    /// The light of a level, by the definition of the keys.
    fn light_of(of: &MachineGamma, level: f64) -> f64 {
        match (&of.levels, of.value) {
            (Some(pairs), _) => {
                let next = pairs.iter().position(|pair| pair[0] >= level).unwrap().max(1);
                let ([a, from], [b, to]) = (pairs[next - 1], pairs[next]);
                from + (to - from) * (level - a) / (b - a)
            }
            (None, value) => 255.0 * (level / 255.0).powf(value.unwrap_or(1.0)),
        }
    }

    #[test]
    fn the_light_of_the_level_is_the_share() {
        for of in [
            gamma(Some(2.2), None, 1),
            gamma(Some(0.5), None, 1),
            gamma(None, Some(&MEASURED), 1),
            gamma(None, None, 1),
            gamma(Some(2.2), None, 60),
            gamma(None, Some(&MEASURED), 101),
        ] {
            of.check().unwrap();
            let table = of.levels_of_light();
            assert_eq!((table[0], table[255]), (0, 255));
            assert!(table.is_sorted());
            for (light, level) in (0..).map(f64::from).zip(table) {
                let (level, least) = (f64::from(level), f64::from(of.least_level));
                let nearby = |by: f64| light_of(&of, (level + by).clamp(0.0, 255.0));
                if level > least {
                    // The exact level is within half a level.
                    assert!((nearby(-0.5)..=nearby(0.5) + 1e-9).contains(&light), "{of:?} {light}");
                } else if level == least {
                    let half = if least > 1.0 { light_of(&of, least / 2.0) } else { 0.0 };
                    assert!(half <= light && light <= nearby(0.5), "{of:?} {light}");
                } else {
                    assert_eq!(level, 0.0);
                    assert!(light <= light_of(&of, least / 2.0), "{of:?} {light}");
                }
            }
        }
        // (1/2)^(1/2.2) of 255 is 186.1; light 90 of the table is level 128.
        assert_eq!(gamma(Some(2.2), None, 1).levels_of_light()[128], 186);
        assert_eq!(gamma(None, Some(&MEASURED), 1).levels_of_light()[90], 128);
        assert_eq!(gamma(None, None, 60).levels_of_light()[29..31], [0, 60]);
    }

    #[test]
    fn impossible_curves_are_refused() {
        for (of, words) in [
            (gamma(Some(0.0), None, 1), "value: it must be"),
            (gamma(Some(f64::NAN), None, 1), "value: it must be"),
            (gamma(Some(2.0), None, 0), "least_level: it must be"),
            (gamma(Some(2.0), Some(&MEASURED), 1), "not both"),
            (gamma(None, Some(&[]), 1), "levels: pairs"),
            (gamma(None, Some(&[[0.0; 2]]), 1), "levels: pairs"),
            (
                gamma(None, Some(&[[0.0; 2], [9.0, 9.0], [9.0, 20.0], [255.0; 2]]), 1),
                "levels: pairs",
            ),
            (gamma(None, Some(&[[0.0; 2], [9.0, f64::NAN], [255.0; 2]]), 1), "levels: pairs"),
            (gamma(None, Some(&[[0.0; 2], [200.0; 2]]), 1), "levels: pairs"),
        ] {
            let said = of.check().unwrap_err().to_string();
            assert!(said.contains(words), "{said}");
        }
    }
}
