//! Panels that show a layer at once: screens and projectors of printers.

use lamp_stack::{Dpi, Length, Pitch, PrintRecord, PrintStep, Size, nonempty_text};
use serde::Deserialize;

use super::{Defaults, Machine, MachineError, MachineLimit};

/// A panel whose pixels expose a whole layer, and how its printer goes from layer to layer.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// The columns and rows.
    #[serde(deserialize_with = "crate::file::pair")]
    pub pixels: [u32; 2],
    /// The width and height of a pixel in micrometers.
    #[serde(deserialize_with = "crate::file::pair")]
    pub pitch_um: [f64; 2],
    /// Whether the panel shows images mirrored left to right, and top to bottom.
    #[serde(default, deserialize_with = "crate::file::pair")]
    pub mirrored: [bool; 2],
    /// The printer's name in its own files; the machine's if absent.
    pub printer: Option<String>,
    /// The section, table or data sheet of these.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
    /// The steps of the first layers, which hold the print to the platform.
    pub first: PanelStep,
    /// The number of first layers.
    pub first_layers: u32,
    /// The number of layers after them whose exposures lie evenly between both.
    #[serde(default)]
    pub transition_layers: u32,
    /// The steps of all others.
    pub normal: PanelStep,
}

/// How a printer exposes a layer and peels it off.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PanelStep {
    /// The exposure in seconds.
    pub exposure_s: f64,
    /// The light, from 0 to 255.
    #[serde(default = "full_light")]
    pub light: u16,
    /// The wait in seconds before the exposure.
    #[serde(default)]
    pub wait_before_s: f64,
    /// The wait in seconds between the exposure and the lift.
    #[serde(default)]
    pub wait_after_s: f64,
    /// The wait in seconds at the top of the lift.
    #[serde(default)]
    pub wait_lifted_s: f64,
    /// How far the platform lifts, in millimeters, in two stages.
    #[serde(default, deserialize_with = "crate::file::pair")]
    pub lift_mm: [f64; 2],
    /// How fast it lifts, in millimeters per minute.
    #[serde(default, deserialize_with = "crate::file::pair")]
    pub lift_mm_per_min: [f64; 2],
    /// The way back in millimeters, in two stages; in one if absent.
    #[serde(default, deserialize_with = "crate::file::some_pair")]
    pub retract_mm: Option<[f64; 2]>,
    /// How fast it comes back.
    #[serde(default, deserialize_with = "crate::file::pair")]
    pub retract_mm_per_min: [f64; 2],
    /// The section, table or data sheet.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

fn full_light() -> u16 {
    255
}

impl Panel {
    pub(super) fn check(&self) -> Result<(), MachineError> {
        if !self.pixels.iter().all(|side| (1..=65_535).contains(side)) {
            return Err(MachineError::Panel("pixels: each must be between 1 and 65535"));
        }
        // NaN lies in no range.
        if !self.pitch_um.iter().all(|pitch| (1.0..=1000.0).contains(pitch)) {
            return Err(MachineError::Panel("pitch_um: each must be between 1 and 1000"));
        }
        if self.pitch().is_none() {
            return Err(MachineError::Panel("pitch_um: each has at most four decimals"));
        }
        self.first.check()?;
        self.normal.check()
    }

    /// Returns the pitch of its pixels; `None` if [`pitch_um`](Self::pitch_um) has more decimals than
    /// a machine's file may give it.
    pub fn pitch(&self) -> Option<Pitch> {
        let [x, y] = self.pitch_um.map(|um| Dpi::of_pitch(Length::from_um(um)));
        Some(Pitch { x: x?, y: y? })
    }

    /// Returns the width and height in millimeters, without the noise of the product.
    pub fn size_mm(&self) -> [f64; 2] {
        [0, 1].map(|side| (f64::from(self.pixels[side]) * self.pitch_um[side]).round() / 1000.0)
    }
}

impl PanelStep {
    fn check(&self) -> Result<(), MachineError> {
        let times = [self.wait_before_s, self.wait_after_s, self.wait_lifted_s];
        let moves = [
            self.lift_mm,
            self.lift_mm_per_min,
            self.retract_mm.unwrap_or_default(),
            self.retract_mm_per_min,
        ];
        let possible = |number: &f64| (0.0..=1e4).contains(number);
        if !(1e-3..=1e4).contains(&self.exposure_s) {
            return Err(MachineError::Panel("exposure_s: it must be between 0.001 and 10000"));
        }
        if self.light > 255 {
            return Err(MachineError::Panel("light: it must be between 0 and 255"));
        }
        if !times.iter().chain(moves.as_flattened()).all(possible) {
            return Err(MachineError::Panel("each wait and move must be between 0 and 10000"));
        }
        let record = self.record();
        // A printer without moves of its own, as Prusa's, has none here.
        match record.lift_mm == [0.0; 2] || record.moves() {
            true => Ok(()),
            false => Err(MachineError::Panel(
                "each lift and retraction needs its speed, lift_mm_per_min and retract_mm_per_min",
            )),
        }
    }

    fn record(&self) -> PrintStep {
        let lifted = self.lift_mm[0] + self.lift_mm[1];
        PrintStep {
            exposure_s: self.exposure_s,
            light: self.light,
            light_off_s: 0.0,
            wait_before_s: self.wait_before_s,
            wait_after_s: self.wait_after_s,
            wait_lifted_s: self.wait_lifted_s,
            lift_mm: self.lift_mm,
            lift_mm_per_min: self.lift_mm_per_min,
            retract_mm: self.retract_mm.unwrap_or([lifted, 0.0]),
            retract_mm_per_min: self.retract_mm_per_min,
        }
    }
}

impl Machine {
    /// Returns the options of slicing for the machine, unless others are given: a panel's
    /// resolution where its file states none.
    pub fn slicing_defaults(&self) -> Defaults {
        let of_panel = || self.panel.as_ref().and_then(Panel::pitch);
        let pitch = self.defaults.pitch.or_else(of_panel);
        Defaults { pitch, ..self.defaults.clone() }
    }

    /// Returns how a printer with a panel exposes, as stacks and printers' files state it.
    pub fn print_record(&self) -> Option<PrintRecord> {
        let panel = self.panel.as_ref()?;
        Some(PrintRecord {
            printer: panel.printer.clone().unwrap_or_else(|| self.name.clone()),
            resin: String::new(),
            panel_px: panel.pixels,
            panel_mm: panel.size_mm(),
            mirrored: panel.mirrored,
            height_mm: self.height.as_ref().map_or(0.0, |height| height.value.mm()),
            first_layers: panel.first_layers,
            transition_layers: panel.transition_layers,
            first: panel.first.record(),
            normal: panel.normal.record(),
        })
    }

    /// Checks that a stack has the pixels of the machine's panel, if it has one.
    ///
    /// # Errors
    /// Returns an error if they are not.
    pub fn check_panel_pitch(&self, pitch: Pitch) -> Result<(), MachineLimit> {
        let Some(of_panel) = self.panel.as_ref().and_then(Panel::pitch) else { return Ok(()) };
        let pairs = of_panel.dpi().into_iter().zip(pitch.dpi());
        // A resolution with a few decimals is meant as the panel's.
        if pairs.into_iter().all(|(panel, stack)| (panel - stack).abs() <= 0.01) {
            return Ok(());
        }
        Err(MachineLimit::PanelPitch { pitch, machine: self.name.clone(), panel: of_panel })
    }

    /// Checks that a part is no larger than the machine's panel, if it has one.
    ///
    /// # Errors
    /// Returns an error if it does not, even if it would turned by 90 degrees.
    pub fn check_on_panel(&self, footprint: Size) -> Result<(), MachineLimit> {
        let Some(panel) = &self.panel else { return Ok(()) };
        let [width, height] = panel.size_mm();
        // A hundredth of a pixel may be rounding.
        let slack = [0, 1].map(|side| panel.pitch_um[side] / 1e5);
        let fits = footprint.width.mm() <= width + slack[0];
        match fits && footprint.height.mm() <= height + slack[1] {
            true => Ok(()),
            false => Err(MachineLimit::Panel {
                footprint,
                machine: self.name.clone(),
                panel_mm: [width, height],
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::{Catalogued, Pitch};

    use crate::Machine;

    const PANEL: &str = "name = \"mine\"\ndescription = \"\"\n[area]\nvalue = \"100x40mm\"\nsource = \"-\"\n\
        [height]\nvalue = \"80mm\"\nsource = \"-\"\n\
        [panel]\npixels = [2000, 800]\npitch_um = [50, 50]\nmirrored = [true, false]\nsource = \"-\"\n\
        first_layers = 3\n\
        [panel.first]\nexposure_s = 30\nlift_mm = [3, 4]\nlift_mm_per_min = [60, 120]\nretract_mm_per_min = [200, 0]\nsource = \"-\"\n\
        [panel.normal]\nexposure_s = 2.5\nwait_before_s = 1\nlight = 200\nsource = \"-\"\n";

    fn machine(from: &str, to: &str) -> Result<Machine, String> {
        assert!(PANEL.contains(from), "{from}");
        Machine::from_toml(&PANEL.replacen(from, to, 1)).map_err(|error| error.to_string())
    }

    #[test]
    fn a_panel_becomes_the_record_of_a_stack() {
        let machine = machine("", "").unwrap();
        let record = machine.print_record().unwrap();
        assert_eq!(record.printer, "mine");
        assert_eq!((record.panel_px, record.panel_mm), ([2000, 800], [100.0, 40.0]));
        assert_eq!((record.height_mm, record.mirrored), (80.0, [true, false]));
        assert_eq!(record.first.retract_mm, [7.0, 0.0]);
        assert_eq!((record.normal.light, record.first.light), (200, 255));
        let exposures = [0, 2, 3].map(|layer| record.step(layer).exposure_s);
        assert_eq!(exposures, [30.0, 30.0, 2.5]);
        assert_eq!(machine.slicing_defaults().pitch, Pitch::of_dpi(508.0));
    }

    #[test]
    fn a_stack_must_fit_the_panel() {
        let square = machine("", "").unwrap();
        assert!(square.check_panel_pitch("508".parse().unwrap()).is_ok());
        let other = square.check_panel_pitch("600".parse().unwrap()).unwrap_err().to_string();
        assert_eq!(other, "the stack has 600 dpi, and the panel of the machine mine has 508 dpi");
        let wide = machine("[50, 50]", "[50, 60]").unwrap();
        let error = wide.check_panel_pitch("508".parse().unwrap()).unwrap_err().to_string();
        assert!(error.contains("the panel of the machine mine has 50 x 60 um"), "{error}");
        let pitch = "50x60um".parse().unwrap();
        assert!(wide.check_panel_pitch(pitch).is_ok());
        assert_eq!(wide.slicing_defaults().pitch, Some(pitch));
        assert!(square.check_on_panel("100x40mm".parse().unwrap()).is_ok());
        let error = square.check_on_panel("40x100mm".parse().unwrap()).unwrap_err().to_string();
        assert!(error.contains("the part takes 40x100mm, and the panel"), "{error}");
    }

    #[test]
    fn impossible_panels_are_refused() {
        for (from, to, words) in [
            ("[2000, 800]", "[2000, 800, 1]", "panel.pixels: a list of 3 is not a list of 2"),
            ("[3, 4]", "[3]", "panel.first.lift_mm: a list of 1 is not a list of 2"),
            ("exposure_s = 30", "exposure_s = \"30s\"", "the text \"30s\" is not a number"),
            ("[2000, 800]", "[2000, 0]", "panel: pixels: each must be"),
            ("[2000, 800]", "[65536, 800]", "panel: pixels: each must be"),
            ("[50, 50]", "[50, nan]", "panel: pitch_um: each must be"),
            ("[50, 50]", "[0.5, 50]", "panel: pitch_um: each must be"),
            ("[50, 50]", "[50.00001, 50]", "panel: pitch_um: each has at most"),
            ("exposure_s = 30", "exposure_s = 0", "panel: exposure_s: it must be"),
            ("exposure_s = 2.5\n", "", "exposure_s"),
            ("light = 200", "light = 256", "panel: light: it must be"),
            ("[3, 4]", "[3, -4]", "panel: each wait and move"),
            ("[3, 4]", "[3, inf]", "panel: each wait and move"),
            ("[60, 120]", "[60, 0]", "needs its speed"),
            ("[200, 0]", "[0, 0]", "needs its speed"),
            ("first_layers = 3", "first_layers = -3", "first_layers"),
            ("first_layers = 3", "first_layer = 3", "first_layer"),
            ("[panel.normal]", "[panel.usual]", "usual"),
        ] {
            let error = machine(from, to).unwrap_err();
            assert!(error.contains(words), "{to}: {error}");
        }
        let with_strips = format!("{PANEL}[strips]\nmirrors = 9\noverlap = 0\nsource = \"-\"\n");
        let error = Machine::from_toml(&with_strips).unwrap_err().to_string();
        assert!(error.contains("panel: the file has [strips], [scan] or [fields], too"), "{error}");
    }

    #[test]
    fn built_in_panels_are_as_large_as_their_areas() {
        let mut panels = 0;
        for machine in Machine::builtins() {
            let Some(panel) = &machine.panel else { continue };
            let area = machine.area.value;
            assert_eq!(panel.size_mm(), [area.width.mm(), area.height.mm()], "{}", machine.name);
            assert!(panel.printer.is_some() && machine.height.is_some(), "{}", machine.name);
            for source in [&panel.source, &panel.first.source, &panel.normal.source] {
                assert!(source.contains("UVtools 6.1.0"), "{source}");
            }
            panels += 1;
        }
        assert_eq!(panels, 10);
    }
}
