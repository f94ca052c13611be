//! The record of how a printer with a panel exposes a stack.

use serde::{Deserialize, Serialize};

use crate::layer::page_info::{PageInfo, StackInfo};
use crate::record::PageRecord;

/// How a printer with a panel exposes a stack, as its files state it. It belongs to the stack, and
/// goes with the first page.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PrintRecord {
    /// The printer's name, as its own files have it.
    pub printer: String,
    /// The resin's name or the profile's.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub resin: String,
    /// The columns and rows of the panel.
    pub panel_px: [u32; 2],
    /// The panel's width and height in millimeters.
    pub panel_mm: [f64; 2],
    /// Whether the panel shows images mirrored left to right, and top to bottom: then its files
    /// have them mirrored, too.
    pub mirrored: [bool; 2],
    /// The height in millimeters that the printer can build; 0 if it is not known.
    pub height_mm: f64,
    /// The number of first layers, which hold the print to the platform.
    pub first_layers: u32,
    /// The number of layers after them whose exposures lie between both.
    pub transition_layers: u32,
    /// The steps of the first layers.
    pub first: PrintStep,
    /// The steps of all others.
    pub normal: PrintStep,
}

/// How a printer exposes a layer and peels it off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PrintStep {
    /// The exposure in seconds.
    pub exposure_s: f64,
    /// The light, from 0 to 255.
    pub light: u16,
    /// The least time in seconds between two exposures; 0 leaves it to the moves and waits.
    pub light_off_s: f64,
    /// The wait in seconds before the exposure.
    pub wait_before_s: f64,
    /// The wait in seconds between the exposure and the lift.
    pub wait_after_s: f64,
    /// The wait in seconds at the top of the lift.
    pub wait_lifted_s: f64,
    /// How far the platform lifts in its two stages, in millimeters.
    pub lift_mm: [f64; 2],
    /// How fast it lifts, in millimeters per minute.
    pub lift_mm_per_min: [f64; 2],
    /// The way back in its two stages, in millimeters.
    pub retract_mm: [f64; 2],
    /// How fast it comes back, in millimeters per minute.
    pub retract_mm_per_min: [f64; 2],
}

/// The steps of a layer that differ from its stack's, on its own page.
impl PageRecord for PrintStep {
    const KEY: &'static str = "print_step";
}

impl PrintStep {
    /// Returns whether all its numbers are finite; numbers of damaged files may not be.
    pub(crate) fn is_finite(&self) -> bool {
        let times = [
            self.exposure_s,
            self.light_off_s,
            self.wait_before_s,
            self.wait_after_s,
            self.wait_lifted_s,
        ];
        let moves = [self.lift_mm, self.lift_mm_per_min, self.retract_mm, self.retract_mm_per_min];
        times.iter().chain(moves.as_flattened()).all(|number| number.is_finite())
    }

    /// Returns whether the platform lifts and comes back, each stage at a speed.
    pub fn moves(&self) -> bool {
        let moves = |mm: [f64; 2], speed: [f64; 2]| {
            let stages = mm.into_iter().zip(speed);
            mm.iter().sum::<f64>() > 0.0
                && stages.into_iter().all(|(mm, speed)| mm == 0.0 || speed > 0.0)
        };
        moves(self.lift_mm, self.lift_mm_per_min) && moves(self.retract_mm, self.retract_mm_per_min)
    }

    /// Returns the time from the start of the layer to the start of the next, in seconds.
    pub fn time_s(&self) -> f64 {
        let of_moves = |mm: [f64; 2], speed: [f64; 2]| -> f64 {
            let of_stage =
                |(mm, speed): (f64, f64)| if speed > 0.0 { mm / speed * 60.0 } else { 0.0 };
            mm.into_iter().zip(speed).map(of_stage).sum()
        };
        let moves = of_moves(self.lift_mm, self.lift_mm_per_min)
            + of_moves(self.retract_mm, self.retract_mm_per_min);
        let between = self.wait_before_s + self.wait_after_s + self.wait_lifted_s + moves;
        self.exposure_s + between.max(self.light_off_s)
    }
}

impl PrintRecord {
    /// Returns the steps of a layer, counted from 0 at the platform. The exposures of transition
    /// layers fall evenly from the first layers' to the others'.
    ///
    /// ```
    /// use lamp_stack::{PrintRecord, PrintStep};
    ///
    /// let [first, normal] = [30.0, 2.0].map(|exposure_s| PrintStep { exposure_s, ..PrintStep::default() });
    /// let print = PrintRecord { first_layers: 1, transition_layers: 3, first, normal, ..PrintRecord::default() };
    /// let exposures: Vec<f64> = (0..6).map(|layer| print.step(layer).exposure_s).collect();
    /// assert_eq!(exposures, [30.0, 23.0, 16.0, 9.0, 2.0, 2.0]);
    /// ```
    pub fn step(&self, layer: u32) -> PrintStep {
        let Some(past) = layer.checked_sub(self.first_layers) else { return self.first };
        if past >= self.transition_layers {
            return self.normal;
        }
        let part = (f64::from(past) + 1.0) / (f64::from(self.transition_layers) + 1.0);
        let [first, normal] = [self.first, self.normal].map(|step| step.exposure_s);
        PrintStep { exposure_s: first + (normal - first) * part, ..self.normal }
    }

    /// Returns the steps of a layer as its own page has them, or else as [`step`](Self::step) does. The
    /// page's exposure counts in any case.
    pub fn step_of_page(&self, layer: u32, page: &PageInfo) -> PrintStep {
        let step = page.record::<PrintStep>().unwrap_or_else(|| self.step(layer));
        let exposure_s = page.exposure_ms.map_or(step.exposure_s, |ms| ms / 1000.0);
        PrintStep { exposure_s, ..step }
    }
}

const KEY: &str = "print";

impl StackInfo {
    /// Returns how a printer with a panel exposes the stack, if that is known.
    pub fn print_record(&self) -> Option<PrintRecord> {
        self.other.get(KEY).and_then(|value| PrintRecord::deserialize(value).ok())
    }

    /// Sets how a printer with a panel exposes the stack.
    pub fn set_print_record(&mut self, record: &PrintRecord) {
        self.other.insert(KEY.to_owned(), super::value_of(record));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layer_takes_its_exposure_and_its_way() {
        let step = PrintStep {
            exposure_s: 2.5,
            wait_before_s: 1.0,
            wait_after_s: 0.5,
            wait_lifted_s: 0.25,
            lift_mm: [3.0, 4.0],
            lift_mm_per_min: [60.0, 240.0],
            retract_mm: [7.0, 0.0],
            retract_mm_per_min: [210.0, 0.0],
            ..PrintStep::default()
        };
        // 3 s and 1 s up, 2 s down.
        assert_eq!(step.time_s(), 2.5 + 1.75 + 6.0);
        assert_eq!(PrintStep { light_off_s: 20.0, ..step }.time_s(), 22.5);
        assert!(step.moves() && !PrintStep::default().moves());
        assert!(!PrintStep { lift_mm_per_min: [60.0, 0.0], ..step }.moves());
    }

    #[test]
    fn the_record_goes_with_the_stack() {
        let mut stack = StackInfo::default();
        assert_eq!(stack.print_record(), None);
        let record = PrintRecord {
            printer: "ELEGOO Mars 3".to_owned(),
            panel_px: [4098, 2560],
            panel_mm: [143.43, 89.6],
            mirrored: [true, false],
            ..PrintRecord::default()
        };
        stack.set_print_record(&record);
        let text = serde_json::to_string(&stack).unwrap();
        let read: StackInfo = serde_json::from_str(&text).unwrap();
        assert_eq!(read.print_record(), Some(record));
    }
}
