//! Machines: how large and how high a build may be, in what pixels and layers, and how long
//! it takes, in TOML files.
//!
//! ```
//! use lamp_machine::Machine;
//! use lamp_stack::Catalogued;
//!
//! let beta = Machine::builtin("beta").unwrap();
//! assert_eq!(beta.area.value, "23x23in".parse()?);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod display;
mod fields;
mod file;
mod gamma;
mod light;
mod limit;
mod motion;
mod panel;
mod scan;
mod times;

use lamp_stack::{Length, Pitch, Size, nonempty_text};
use serde::Deserialize;

pub use display::{Display, DisplayError};
pub use fields::MachineFields;
pub use file::MachineError;
pub use gamma::MachineGamma;
pub use light::{LightError, LightTable};
pub use limit::MachineLimit;
pub use motion::{Acceleration, MotionError, Speed};
pub use panel::{Panel, PanelStep};
pub use scan::{MirrorFaults, Scan, ScanDirection, ScanError, ScanLight, ScanTilt};
pub use times::Times;

/// The known data of a machine. A value that a source does not give is absent, and then anything
/// goes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Machine {
    /// Its name, for commands: small letters, digits and `-`.
    pub name: String,
    /// Its description, in a line.
    pub description: String,
    /// The build area.
    pub area: Area,
    /// The height of a build.
    pub height: Option<BuildHeight>,
    /// The resolutions that it builds in.
    pub dpi: Option<DpiRange>,
    /// The layers that it builds in.
    pub thickness: Option<ThicknessRange>,
    /// The swaths that a scanning projector exposes.
    pub strips: Option<Strips>,
    /// How a display of mirrors scans a layer, in place of `strips`.
    pub scan: Option<Scan>,
    /// The fields that a projector exposes step by step, in place of `strips` and `scan`.
    pub fields: Option<MachineFields>,
    /// The panel that exposes a layer at once, in place of `strips`, `scan` and `fields`.
    pub panel: Option<Panel>,
    /// How much light a gray level gives, in proportion to it if absent.
    pub gamma: Option<MachineGamma>,
    /// How a blade spreads the next layer.
    pub recoating: Option<Recoating>,
    /// How long the steps of a layer take.
    pub times: Option<Times>,
    /// How it is usually sliced for.
    #[serde(default)]
    pub defaults: Defaults,
}

impl Machine {
    /// Returns the mirrors across a swath and the number of pixels that a swath shares with the
    /// next, of [`scan`](Self::scan) or of [`strips`](Self::strips). A tilted display has slanted
    /// swaths, which no strip fits.
    pub fn swaths(&self) -> Option<(u32, u32)> {
        let scan = self.scan.as_ref().filter(|scan| scan.tilt.is_none());
        let scan = scan.map(|scan| (scan.mirrors()[0], scan.overlap));
        scan.or_else(|| self.strips.as_ref().map(|strips| (strips.mirrors, strips.overlap)))
    }
}

/// A build area, and where it comes from.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Area {
    /// As `23x23in`.
    #[serde(deserialize_with = "file::size")]
    pub value: Size,
    /// The section, table or data sheet.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// How high a build may be, and where that comes from.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BuildHeight {
    /// From the platform to the top of the last layer, as `200mm`.
    #[serde(deserialize_with = "file::length")]
    pub value: Length,
    /// The section, table or data sheet.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// Resolutions, both ends included.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DpiRange {
    /// The coarsest.
    pub least: f64,
    /// The finest.
    pub most: f64,
    /// The section, table or data sheet.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// Thicknesses of layers, both ends included.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThicknessRange {
    /// The thinnest.
    #[serde(deserialize_with = "file::length")]
    pub least: Length,
    /// The thickest.
    #[serde(deserialize_with = "file::length")]
    pub most: Length,
    /// The section, table or data sheet.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// Options of slicing for a machine, unless others are given.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Defaults {
    /// The resolution, under the key `dpi` or `pitch`: as `600` or `"14x19um"`.
    #[serde(rename = "dpi", alias = "pitch", deserialize_with = "file::some_pitch")]
    pub pitch: Option<Pitch>,
    /// The thickness of layers.
    #[serde(deserialize_with = "file::some_length")]
    pub thickness: Option<Length>,
    /// Black pixels around the part's box.
    pub margin: Option<u32>,
}

/// The swaths that a scanning projector exposes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Strips {
    /// How many mirrors lie across its way: pixels of a swath.
    pub mirrors: u32,
    /// How many pixels a swath shares with the next.
    pub overlap: u32,
    /// The section, table or data sheet.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// How a blade spreads a layer of suspension.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recoating {
    /// The least and the greatest viscosity of the suspension, in centipoise.
    #[serde(deserialize_with = "file::pair")]
    pub viscosity_cp: [f64; 2],
    /// How far the blade goes, as `26cm`.
    #[serde(deserialize_with = "file::length")]
    pub travel: Length,
    /// The time of this travel.
    pub seconds: f64,
    /// The height of the blade above the surface that it covers, as `200um`.
    #[serde(deserialize_with = "file::length")]
    pub gap: Length,
    /// The section, table or data sheet.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

impl Machine {
    /// Returns the time from the end of a layer's exposure to the start of the next, in seconds, if it
    /// is known: as the machine's times have it, or the blade's way over the area at its speed. The
    /// blade goes along the longer side, and never less far than its travel (assumed; 002 section
    /// 4.2.2 gives one travel and its time).
    pub fn recoat_s(&self) -> Option<f64> {
        let measured = || self.times.as_ref()?.recoat_s;
        let by_blade = || {
            let Recoating { travel, seconds, .. } = self.recoating.as_ref()?;
            let area = self.area.value;
            let way = area.width.mm().max(area.height.mm()).max(travel.mm());
            Some(seconds * way / travel.mm())
        };
        measured().or_else(by_blade)
    }
}

impl Recoating {
    /// Returns the shear stress on what the blade passes, in pascals, for the least and the
    /// greatest viscosity: viscosity times speed divided by the gap, as for a Newtonian liquid
    /// whose speed falls evenly across the gap (002 section 4.2.2).
    pub fn shear_pa(&self) -> [f64; 2] {
        // The shear rate is speed over gap; millimeters cancel. A centipoise is 1/1000 Pa s.
        let per_second = self.travel.mm() / self.seconds / self.gap.mm();
        self.viscosity_cp.map(|centipoise| centipoise / 1000.0 * per_second)
    }

    /// Returns the [shear stress](Self::shear_pa) for the greatest viscosity, in pascals.
    pub fn greatest_shear_pa(&self) -> f64 {
        self.shear_pa()[1]
    }
}
