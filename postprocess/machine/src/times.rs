//! How long the steps of a layer take.

use lamp_stack::nonempty_text;
use serde::Deserialize;

use super::MachineError;

/// How long the steps of a layer take. Absent values are unknown.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Times {
    /// Seconds from the end of a layer's exposure to the start of the next one's; if absent, the
    /// seconds of the blade's travel count.
    pub recoat_s: Option<f64>,
    /// The exposure of layers that state none, in seconds.
    pub expose_s: Option<f64>,
    /// The speed of a scanning projector along a swath, in millimeters a second.
    pub swath_speed_mm_per_s: Option<f64>,
    /// Seconds from the end of a swath to the start of the next one; none if absent.
    pub swath_step_s: Option<f64>,
    /// The section, table or data sheet.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

impl Times {
    pub(super) fn check(&self, has_strips: bool) -> Result<(), MachineError> {
        let Self { recoat_s, expose_s, swath_speed_mm_per_s: speed, swath_step_s, .. } = self;
        // NaN lies in no range, so `nan` is refused, too. The error's message repeats the bounds.
        let possible = |number: f64| (1e-3..=1e6).contains(&number);
        if ![recoat_s, expose_s, speed, swath_step_s].into_iter().flatten().all(|&n| possible(n)) {
            return Err(MachineError::Times);
        }
        match (speed, swath_step_s) {
            (None, Some(_)) => Err(MachineError::StepWithoutSpeed),
            (Some(_), _) if !has_strips => Err(MachineError::SpeedWithoutStrips),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Catalogued;

    use crate::Machine;

    fn machine(more: &str) -> Result<Machine, String> {
        let text = format!(
            "name = \"mine\"\ndescription = \"\"\n[area]\nvalue = \"100x40mm\"\nsource = \"-\"\n{more}"
        );
        Machine::from_toml(&text).map_err(|error| error.to_string())
    }

    #[test]
    fn impossible_times_are_refused() {
        for (times, words) in [
            ("recoat_s = 0", "between 0.001 and 1000000"),
            ("expose_s = -1", "between"),
            ("recoat_s = inf", "between"),
            ("recoat_s = nan", "between"),
            ("swath_step_s = 1", "swath_step_s needs swath_speed_mm_per_s"),
            ("swath_speed_mm_per_s = 1", "swath_speed_mm_per_s needs [strips]"),
            ("recoat = 1", "recoat_s"),
        ] {
            let error = machine(&format!("[times]\n{times}\nsource = \"-\"\n")).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
        assert!(machine("[times]\nrecoat_s = 1\n").unwrap_err().contains("source"));
    }
}
