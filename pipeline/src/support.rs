//! How islands are held by supports.

use std::fmt;
use std::num::{NonZeroU8, NonZeroU32};
use std::str::FromStr;

use lamp_slicing::SurfaceName;
use lamp_stack::{FlowSection, Length, StrutSection};
use lamp_supports::{AvoidedSurface, CheckOptions, PillarSizes, SupportFoot, SupportOptions};
use serde::{Deserialize, Serialize};

use crate::words::{list, optional, text, words_of};

/// Changes when other bytes come of the same settings, stack and part.
pub const CODE: u32 = 4;

/// How islands are held.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct SupportSettings {
    /// Where supports end.
    #[serde(with = "text")]
    pub to: SupportFoot,
    /// Undersides flatter than this angle get supports, too.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub overhangs: Option<Degrees>,
    /// Distance of supports of such undersides.
    #[serde(with = "text")]
    pub spacing: Length,
    /// Surfaces that no support may touch.
    #[serde(with = "list", skip_serializing_if = "Vec::is_empty")]
    pub avoid: Vec<AvoidedSurface>,
    /// Least diameter of the tips of pillars.
    #[serde(with = "text")]
    pub tip: Length,
    /// Diameter of pillars.
    #[serde(with = "text")]
    pub pillar: Length,
    /// Diameter of the bases of pillars.
    #[serde(with = "text")]
    pub base: Length,
    /// Least distance between pillars and the part.
    #[serde(with = "text")]
    pub clearance: Length,
    /// Radius of supports, or half the chord of streamlined ones.
    #[serde(with = "text")]
    pub radius: Length,
    /// Section of supports to the part.
    #[serde(with = "text", skip_serializing_if = "is_round")]
    pub strut_section: StrutSection,
    /// Thickness of a streamlined section, as a share of its chord.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub thickness_ratio: Option<f64>,
    /// Direction of the flow along which the section lies, from x counterclockwise.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub flow: Option<FlowAngle>,
    /// Largest angle of a support to the vertical.
    #[serde(with = "text")]
    pub max_tilt: Degrees,
    /// Greatest length of a support.
    #[serde(with = "text")]
    pub max_length: Length,
    /// Least distance of a contact to edges where the surface turns by more than 30 degrees.
    #[serde(with = "text")]
    pub edge_clearance: Length,
    /// Largest curvature of the surface around a contact.
    #[serde(with = "text")]
    pub max_curvature: Curvature,
    /// Widest piece of an island that one support holds.
    #[serde(with = "text")]
    pub hold: Length,
    /// Directions to try.
    pub candidates: NonZeroU32,
    /// Supports to list for each place, at least one.
    pub keep: u16,
    /// Share of an island that its supports must hold.
    #[serde(with = "text")]
    pub least_support: f64,
    /// Side of the square that an island must hold.
    #[serde(with = "text")]
    pub speck: Length,
    /// Layers for which a thinner island must float.
    #[serde(with = "text")]
    pub speck_layers: NonZeroU32,
    /// Level from which a gray pixel is white.
    #[serde(with = "text")]
    pub threshold: NonZeroU8,
}

impl Default for SupportSettings {
    fn default() -> Self {
        let options = SupportOptions::default();
        Self {
            to: options.to,
            overhangs: options.overhangs.map(Degrees),
            spacing: options.spacing,
            avoid: options.avoid.into_iter().map(AvoidedSurface::Box).collect(),
            tip: options.pillar.tip,
            pillar: options.pillar.diameter,
            base: options.pillar.base,
            clearance: options.pillar.clearance,
            radius: options.radius,
            strut_section: StrutSection::Round,
            thickness_ratio: None,
            flow: None,
            max_tilt: Degrees(options.max_tilt),
            max_length: options.max_length,
            edge_clearance: options.edge_clearance,
            max_curvature: Curvature(options.max_curvature),
            hold: options.hold,
            candidates: options.candidates,
            keep: options.keep.try_into().unwrap_or(u16::MAX),
            least_support: options.least_support,
            speck: CheckOptions::default().speck,
            speck_layers: CheckOptions::default().speck_layers,
            threshold: options.threshold,
        }
    }
}

impl SupportSettings {
    /// Returns the settings as one text, defaults filled in.
    pub fn canonical(&self) -> String {
        format!("support{}", words_of(self))
    }

    /// Returns the options of the search for supports. Surfaces that are named, to be avoided, are of
    /// the part.
    pub fn options(&self) -> SupportOptions {
        let of_box = |surface: &AvoidedSurface| match surface {
            AvoidedSurface::Box(of_box) => Some(*of_box),
            AvoidedSurface::Named(_) => None,
        };
        SupportOptions {
            to: self.to,
            overhangs: self.overhangs.map(|angle| angle.0),
            spacing: self.spacing,
            avoid: self.avoid.iter().filter_map(of_box).collect(),
            pillar: PillarSizes {
                tip: self.tip,
                diameter: self.pillar,
                base: self.base,
                clearance: self.clearance,
            },
            candidates: self.candidates,
            max_tilt: self.max_tilt.0,
            edge_clearance: self.edge_clearance,
            max_curvature: self.max_curvature.0,
            max_length: self.max_length,
            keep: self.keep.into(),
            radius: self.radius,
            section: self.flow_section(),
            hold: self.hold,
            least_support: self.least_support,
            threshold: self.threshold,
        }
    }

    /// Returns the section of streamlined supports.
    fn flow_section(&self) -> Option<FlowSection> {
        if self.strut_section == StrutSection::Round {
            return None;
        }
        let (sin, cos) = self.flow.map_or(0.0, |flow| flow.0).to_radians().sin_cos();
        // Nine digits are short in plans, and make quarter turns exact; zero has no sign.
        let [cos, sin] = [cos, sin].map(|part| (part * 1e9).round() / 1e9 + 0.0);
        let thickness_ratio = self.thickness_ratio.unwrap_or(THICKNESS_RATIO);
        Some(FlowSection { section: self.strut_section, thickness_ratio, flow: [cos, sin, 0.0] })
    }

    /// Returns the names of surfaces to avoid.
    pub fn avoided_names(&self) -> impl Iterator<Item = SurfaceName> {
        self.avoid.iter().filter_map(|surface| match surface {
            AvoidedSurface::Box(_) => None,
            AvoidedSurface::Named(name) => Some(*name),
        })
    }

    /// Returns the options of the search for islands.
    pub fn check_options(&self) -> CheckOptions {
        CheckOptions {
            threshold: self.threshold,
            speck: self.speck,
            speck_layers: self.speck_layers,
            least_support: self.least_support,
            ..CheckOptions::default()
        }
    }
}

/// The thickness of streamlined supports, as a share of their chord.
const THICKNESS_RATIO: f64 = 0.4;

fn is_round(section: &StrutSection) -> bool {
    *section == StrutSection::Round
}

/// A level direction, by its angle to x in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowAngle(pub f64);

impl fmt::Display for FlowAngle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}deg", self.0)
    }
}

impl FromStr for FlowAngle {
    type Err = String;

    /// Parses `90deg` or `90`.
    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim_end_matches("deg").trim_end().parse() {
            Ok(degrees) if (-360.0..=360.0).contains(&degrees) => Ok(Self(degrees)),
            _ => Err(format!("`{text}` is not a direction: write an angle to x, such as 90deg")),
        }
    }
}

/// An angle of a support.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Degrees(pub f64);

impl fmt::Display for Degrees {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}deg", self.0)
    }
}

impl FromStr for Degrees {
    type Err = String;

    /// Parses `45deg` or `45`.
    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim_end_matches("deg").trim_end().parse() {
            Ok(degrees) if (0.0..=80.0).contains(&degrees) => Ok(Self(degrees)),
            _ => Err(format!("`{text}` is not a tilt: write an angle from 0deg to 80deg")),
        }
    }
}

/// A curvature in 1/mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curvature(pub f64);

impl fmt::Display for Curvature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/mm", self.0)
    }
}

impl FromStr for Curvature {
    type Err = String;

    /// Parses `1/mm`.
    fn from_str(text: &str) -> Result<Self, String> {
        match text.strip_suffix("/mm").and_then(|number| number.trim_end().parse().ok()) {
            Some(number) if (0.0..f64::INFINITY).contains(&number) => Ok(Self(number)),
            _ => Err(format!("`{text}` is not a curvature: write 1/mm for a radius of 1 mm")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flows_have_directions() {
        let flow = |angle: &str| {
            let flow = Some(angle.parse().unwrap());
            let strut_section = StrutSection::Ellipse;
            let settings = SupportSettings { strut_section, flow, ..SupportSettings::default() };
            settings.options().section.unwrap().flow
        };
        assert_eq!(flow("90deg"), [0.0, 1.0, 0.0]);
        assert_eq!(flow("-180"), [-1.0, 0.0, 0.0]);
        assert_eq!(flow("30deg"), [0.866_025_404, 0.5, 0.0]);
        assert_eq!(SupportSettings::default().options().section, None);
        assert!(["361deg", "nan", "x"].iter().all(|text| text.parse::<FlowAngle>().is_err()));
    }

    #[test]
    fn angles_and_curvatures_have_units() {
        assert_eq!("45deg".parse(), Ok(Degrees(45.0)));
        assert_eq!("0".parse(), Ok(Degrees(0.0)));
        assert_eq!("0.5/mm".parse(), Ok(Curvature(0.5)));
        for wrong in ["", "nan", "-1deg", "90", "45rad"] {
            assert!(wrong.parse::<Degrees>().is_err(), "{wrong}");
        }
        for wrong in ["", "1", "nan/mm", "-1/mm", "inf/mm", "1/in"] {
            assert!(wrong.parse::<Curvature>().is_err(), "{wrong}");
        }
    }
}
