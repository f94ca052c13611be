//! The fields of a projector that steps.

use lamp_stack::nonempty_text;
use serde::Deserialize;

use super::MachineError;

/// The fields that a projector exposes one after another, in rows and columns, standing still.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MachineFields {
    /// The width and height of a field in pixels.
    #[serde(deserialize_with = "crate::file::pair")]
    pub pixels: [u32; 2],
    /// How many columns, and how many rows, a field shares with the next.
    pub overlap: u32,
    /// Seconds from the end of a field's exposure to the start of the next one's in its layer;
    /// unknown if absent.
    pub step_s: Option<f64>,
    /// The section, table or data sheet.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

impl MachineFields {
    pub(super) fn check(&self) -> Result<(), MachineError> {
        if !self.pixels.iter().all(|side| (1..=65_535).contains(side)) {
            return Err(MachineError::FieldPixels);
        }
        // A seam joins two fields of a row or a column, never three.
        if self.pixels.iter().any(|side| self.overlap >= side.div_ceil(2)) {
            return Err(MachineError::FieldOverlap);
        }
        // NaN lies in no range.
        match self.step_s {
            Some(seconds) if !(0.0..=1e6).contains(&seconds) => Err(MachineError::FieldStep),
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
    fn impossible_fields_are_refused() {
        let fields = |pixels: &str, more: &str| {
            machine(&format!("[fields]\npixels = {pixels}\n{more}\nsource = \"-\"\n"))
        };
        let good = fields("[2560, 1600]", "overlap = 4\nstep_s = 0.5").unwrap().fields.unwrap();
        assert_eq!((good.pixels, good.overlap, good.step_s), ([2560, 1600], 4, Some(0.5)));
        assert!(fields("[1, 1]", "overlap = 0").unwrap().fields.unwrap().step_s.is_none());
        for (pixels, more, words) in [
            ("[0, 1600]", "overlap = 0", "fields: pixels: each must be between 1 and 65535"),
            ("[2560, 65536]", "overlap = 0", "fields: pixels"),
            ("[2560]", "overlap = 0", "fields.pixels"),
            ("[2560, 1600]", "", "overlap"),
            ("[2560, 1600]", "overlap = 800", "fields: overlap"),
            ("[1600, 2560]", "overlap = 800", "fields: overlap"),
            ("[2560, 1600]", "overlap = 4\nstep_s = -1", "fields: step_s"),
            ("[2560, 1600]", "overlap = 4\nstep_s = nan", "fields: step_s"),
            ("[2560, 1600]", "overlap = 4\nstep = 1", "step_s"),
            (
                "[9, 9]",
                "overlap = 0\nsource = \"-\"\n[strips]\nmirrors = 9\noverlap = 0",
                "[fields] alone",
            ),
        ] {
            let error = fields(pixels, more).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
    }
}
