//! Options of the exposure.

use std::path::PathBuf;

use clap::Args;
use lamp_grayscale::material::OVERCURES;
use lamp_pipeline::exposure::ExposureSettings;

use crate::args::lamp_option::LampOption;

pub(crate) const EXPOSURE: &str = "Exposure";

/// Options of the exposure.
#[derive(Args, Clone)]
pub(crate) struct ExposureArgs {
    /// Resin: a built-in material's name (see lamp material list) or a file
    ///
    /// Each page then states its exposure time
    #[arg(long, value_name = "MATERIAL", help_heading = EXPOSURE)]
    material: Option<PathBuf>,

    /// Depth that full white cures, in layers: 1 cures just the layer, more bonds it to the layer
    /// below [default: the material's, or 1]
    #[arg(long, value_name = "LAYERS", value_parser = parse_overcure)]
    #[arg(requires = "material", help_heading = EXPOSURE)]
    overcure: Option<f64>,

    #[command(flatten, next_help_heading = EXPOSURE)]
    lamp: LampOption,

    /// Exposure times by layer thickness, instead of a material: a table with the columns
    /// thickness_um and exposure_ms. Times between two rows are interpolated linearly
    #[arg(long, value_name = "FILE.csv", conflicts_with = "material", help_heading = EXPOSURE)]
    exposure_table: Option<PathBuf>,
}

impl From<&ExposureArgs> for ExposureSettings {
    fn from(args: &ExposureArgs) -> Self {
        match (&args.material, &args.exposure_table) {
            (Some(material), _) => Self::Material {
                material: material.clone(),
                overcure: args.overcure,
                lamp_intensity: args.lamp.light(),
            },
            (None, Some(table)) => Self::Table { exposure_table: table.clone() },
            (None, None) => Self::None {},
        }
    }
}

/// Parses the depth that white cures, in layers.
pub(crate) fn parse_overcure(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(layers) if OVERCURES.contains(&layers) => Ok(layers),
        _ => Err(format!(
            "`{text}` is not a depth in layers: write a number from 0.1 to 100, such as 1.5"
        )),
    }
}
