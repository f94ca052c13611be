//! Checks of what a machine builds.

use lamp_stack::{Layer, Length, Pitch, Size};
use thiserror::Error;

use super::{BuildHeight, DpiRange, Machine, ThicknessRange};

/// A limit that a build exceeds. Every message has the machine's name, and both figures.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum MachineLimit {
    /// An area beyond the machine's.
    #[error("the area is {area}, and the machine {machine} builds on {most}")]
    Area {
        /// The area that is wanted.
        area: Size,
        /// The machine's name.
        machine: String,
        /// Its area.
        most: Size,
    },
    /// A part or an image that is not inside the area, turned by 90 degrees or not.
    #[error("{what} takes {footprint}, and the machine {machine} builds on {most}")]
    Footprint {
        /// The object that is too large.
        what: String,
        /// Its size along x and y.
        footprint: Size,
        /// The machine's name.
        machine: String,
        /// Its area.
        most: Size,
    },
    /// More than the height of a build.
    #[error("{what} is {height} high, and the machine {machine} builds {most} high")]
    Height {
        /// The object that is too high.
        what: String,
        /// From the platform to its top.
        height: Length,
        /// The machine's name.
        machine: String,
        /// Its height.
        most: Length,
    },
    /// Another resolution.
    #[error("{what} has {pitch:#}, and the machine {machine} builds in {least} to {most} dpi")]
    Dpi {
        /// The object with the resolution.
        what: String,
        /// The resolution.
        pitch: Pitch,
        /// The machine's name.
        machine: String,
        /// The coarsest that it builds in.
        least: f64,
        /// The finest that it builds in.
        most: f64,
    },
    /// Another thickness.
    #[error(
        "{what} is {thickness} thick, and the machine {machine} builds in layers of {least} to {most}"
    )]
    Thickness {
        /// The object with the thickness.
        what: String,
        /// The thickness.
        thickness: Length,
        /// The machine's name.
        machine: String,
        /// The thinnest that it builds in.
        least: Length,
        /// The thickest that it builds in.
        most: Length,
    },
    /// Other pixels than the panel's.
    #[error("the stack has {pitch:#}, and the panel of the machine {machine} has {panel:#}")]
    PanelPitch {
        /// The pitch of its pixels.
        pitch: Pitch,
        /// The machine's name.
        machine: String,
        /// The pitch of the panel's pixels.
        panel: Pitch,
    },
    /// A part that is larger than the panel.
    #[error(
        "the part takes {footprint}, and the panel of the machine {machine} has {}x{}mm: turn the \
         part, or cut it", panel_mm[0], panel_mm[1]
    )]
    Panel {
        /// The part's size along x and y.
        footprint: Size,
        /// The machine's name.
        machine: String,
        /// The width and height of its panel in millimeters.
        panel_mm: [f64; 2],
    },
}

/// The amount by which lengths may miss a limit, in micrometers: they are sums and differences of
/// heights.
const SLACK: f64 = 1e-3;

fn fits(length: Length, most: Length) -> bool {
    length.um() <= most.um() + SLACK
}

impl Machine {
    /// Checks that the machine builds in a layer's resolution and thickness,
    /// as far as both are known.
    ///
    /// # Errors
    /// Returns an error if it does not.
    pub fn check(&self, layer: &Layer) -> Result<(), MachineLimit> {
        if let Some(pitch) = layer.pitch {
            self.check_pitch(pitch, &layer.info.name())?;
        }
        match layer.info.thickness_um {
            Some(um) => self.check_thickness(Length::from_um(um), &layer.info.name()),
            None => Ok(()),
        }
    }

    /// Checks that the machine builds in a resolution, along both axes. `what` names the object that
    /// has it: `layer 12`.
    ///
    /// # Errors
    /// Returns an error if it does not.
    pub fn check_pitch(&self, pitch: Pitch, what: &str) -> Result<(), MachineLimit> {
        match self.dpi {
            Some(DpiRange { least, most, .. })
                if !pitch.dpi().iter().all(|dpi| (least..=most).contains(dpi)) =>
            {
                let (what, machine) = (what.to_owned(), self.name.clone());
                Err(MachineLimit::Dpi { what, pitch, machine, least, most })
            }
            _ => Ok(()),
        }
    }

    /// Checks that the machine builds layers of a thickness. `what` names the object that has it:
    /// `layer 12`.
    ///
    /// # Errors
    /// Returns an error if it does not.
    pub fn check_thickness(&self, thickness: Length, what: &str) -> Result<(), MachineLimit> {
        match self.thickness {
            Some(ThicknessRange { least, most, .. })
                // The lower limit gets the slack as well: `fits` takes the shorter length first.
                if !(fits(least, thickness) && fits(thickness, most)) =>
            {
                let (what, machine) = (what.to_owned(), self.name.clone());
                Err(MachineLimit::Thickness { what, thickness, machine, least, most })
            }
            _ => Ok(()),
        }
    }

    /// Checks that an area is no larger than the machine's.
    ///
    /// # Errors
    /// Returns an error if it is.
    pub fn check_area(&self, area: Size) -> Result<(), MachineLimit> {
        let most = self.area.value;
        if fits(area.width, most.width) && fits(area.height, most.height) {
            return Ok(());
        }
        Err(MachineLimit::Area { area, machine: self.name.clone(), most })
    }

    /// Checks that a footprint is inside the area, as it is or turned by 90 degrees. `what` names
    /// the object that has it: `the part`.
    ///
    /// # Errors
    /// Returns an error if it does not.
    pub fn check_footprint(&self, footprint: Size, what: &str) -> Result<(), MachineLimit> {
        let Size { width, height } = footprint;
        // A part may lie turned on a build area that is no square. An area to fill lies as the
        // machine has it, so `check_area` turns nothing.
        let turned = Size { width: height, height: width };
        if self.check_area(footprint).or(self.check_area(turned)).is_ok() {
            return Ok(());
        }
        let (what, machine, most) = (what.to_owned(), self.name.clone(), self.area.value);
        Err(MachineLimit::Footprint { what, footprint, machine, most })
    }

    /// Checks that a build may be as high. `what` names the object that reaches up to there: `layer
    /// 12`.
    ///
    /// # Errors
    /// Returns an error if it may not.
    pub fn check_height(&self, height: Length, what: &str) -> Result<(), MachineLimit> {
        match self.height {
            Some(BuildHeight { value: most, .. }) if !fits(height, most) => {
                let (what, machine) = (what.to_owned(), self.name.clone());
                Err(MachineLimit::Height { what, height, machine, most })
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::{Catalogued, Mask, PageInfo};

    use super::*;

    fn layer(dpi: f64, thickness_um: f64) -> Layer {
        let info = PageInfo { thickness_um: Some(thickness_um), ..PageInfo::default() };
        Layer { info, pitch: Pitch::of_dpi(dpi), image: Mask::black(1, 1).into() }
    }

    fn size(text: &str) -> Size {
        text.parse().unwrap()
    }

    #[test]
    fn layers_beyond_the_limits_are_named() {
        let beta = Machine::builtin("beta").unwrap();
        for (dpi, thickness) in [(1500.0, 100.0), (2400.0, 25.0), (2000.0, 100.0 + 1e-9)] {
            assert_eq!(beta.check(&layer(dpi, thickness)), Ok(()));
        }
        let coarse = beta.check(&layer(100.0, 100.0)).unwrap_err().to_string();
        assert!(
            coarse.starts_with("layer 0 has 100 dpi, and the machine beta builds in 1500 to 2400")
        );
        let thick = beta.check(&layer(1500.0, 1000.0)).unwrap_err().to_string();
        assert!(thick.contains("1mm thick") && thick.contains("25um to 100um"), "{thick}");
        let any = Machine { dpi: None, thickness: None, ..beta };
        assert_eq!(any.check(&layer(1.0, 1e6)), Ok(()));
    }

    #[test]
    fn areas_are_as_they_lie_and_parts_may_be_turned() {
        let alpha = Machine::builtin("alpha").unwrap();
        for area in ["4x4.5in", "101.6x114.3mm", "1x1mm"] {
            assert_eq!(alpha.check_area(size(area)), Ok(()));
        }
        assert_eq!(
            alpha.check_area(size("9x9in")).unwrap_err().to_string(),
            "the area is 228.6x228.6mm, and the machine alpha builds on 101.6x114.3mm"
        );
        assert!(alpha.check_area(size("4.5x4in")).is_err());
        assert_eq!(alpha.check_footprint(size("4.5x4in"), "the part"), Ok(()));
        for footprint in ["4.1x4.5in", "4.5x4.1in", "115x1mm", "1x115mm"] {
            assert!(alpha.check_footprint(size(footprint), "the part").is_err(), "{footprint}");
        }
    }

    #[test]
    fn a_machine_without_a_height_builds_any() {
        let alpha = Machine::builtin("alpha").unwrap();
        assert_eq!(alpha.check_height(Length::from_mm(1e6), "the part"), Ok(()));
        let height = BuildHeight { value: Length::from_mm(80.0), source: "here".to_owned() };
        let low = Machine { height: Some(height), ..alpha };
        assert_eq!(low.check_height(Length::from_mm(80.0), "the part"), Ok(()));
        assert_eq!(
            low.check_height(Length::from_mm(80.1), "the part").unwrap_err().to_string(),
            "the part is 80.1mm high, and the machine alpha builds 80mm high"
        );
    }
}
