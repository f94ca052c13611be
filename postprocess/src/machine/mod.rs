//! Machines: how large a build may be, and in what pixels and layers, in TOML
//! files.
//!
//! ```
//! use lamp_postprocess::machine::Machine;
//! use lamp_stack::Catalogued;
//!
//! let beta = Machine::builtin("beta").unwrap();
//! assert_eq!(beta.area.value, "23x23in".parse()?);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod file;

use lamp_stack::{Layer, Length, Size, nonempty_text};
use serde::Deserialize;
use thiserror::Error;

pub use file::MachineError;

/// What is known of a machine. What a source does not give is absent, and then
/// anything goes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Machine {
    /// Its name, for commands: small letters, digits and `-`.
    pub name: String,
    /// What it is, in a line.
    pub description: String,
    /// The build area.
    pub area: Area,
    /// The resolutions that it builds in.
    pub dpi: Option<DpiRange>,
    /// The layers that it builds in.
    pub thickness: Option<ThicknessRange>,
    /// The swaths that a scanning projector exposes.
    pub strips: Option<Strips>,
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

/// Why a machine does not build a layer.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum MachineLimit {
    /// Another resolution.
    #[error("{layer} has {dpi} dpi, and the machine {machine} builds in {least} to {most} dpi")]
    Dpi {
        /// The layer's name.
        layer: String,
        /// Its resolution.
        dpi: f64,
        /// The machine's name.
        machine: String,
        /// The coarsest that it builds in.
        least: f64,
        /// The finest that it builds in.
        most: f64,
    },
    /// Another thickness.
    #[error(
        "{layer} is {thickness} thick, and the machine {machine} builds in layers of {least} to {most}"
    )]
    Thickness {
        /// The layer's name.
        layer: String,
        /// Its thickness.
        thickness: Length,
        /// The machine's name.
        machine: String,
        /// The thinnest that it builds in.
        least: Length,
        /// The thickest that it builds in.
        most: Length,
    },
}

/// What thicknesses may miss a limit by, in micrometres: they are sums and
/// differences of heights.
const SLACK: f64 = 1e-3;

impl Machine {
    /// Checks that the machine builds in a layer's resolution and thickness,
    /// as far as both are known.
    ///
    /// # Errors
    /// Returns an error if it does not.
    pub fn check(&self, layer: &Layer) -> Result<(), MachineLimit> {
        if let (Some(DpiRange { least, most, .. }), Some(dpi)) = (&self.dpi, layer.dpi)
            && !(*least..=*most).contains(&dpi.get())
        {
            return Err(MachineLimit::Dpi {
                layer: layer.info.name(),
                dpi: dpi.get(),
                machine: self.name.clone(),
                least: *least,
                most: *most,
            });
        }
        if let (Some(ThicknessRange { least, most, .. }), Some(um)) =
            (&self.thickness, layer.info.thickness_um)
            && !(least.um() - SLACK..=most.um() + SLACK).contains(&um)
        {
            return Err(MachineLimit::Thickness {
                layer: layer.info.name(),
                thickness: Length::from_um(um),
                machine: self.name.clone(),
                least: *least,
                most: *most,
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::{Catalogued, Dpi, Mask, PageInfo};

    use super::*;

    fn layer(dpi: f64, thickness_um: f64) -> Layer {
        let info = PageInfo { thickness_um: Some(thickness_um), ..PageInfo::default() };
        Layer { info, dpi: Dpi::new(dpi), image: Mask::black(1, 1).into() }
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
}
