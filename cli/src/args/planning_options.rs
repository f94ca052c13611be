//! Options that planners of exposures share.

use std::num::NonZeroU8;
use std::path::PathBuf;

use clap::Args;
use lamp_grayscale::material::Material;
use lamp_pipeline::documents::{document_and_word, is_file, recorded_name};
use lamp_pipeline::heights::parse_share;
use lamp_pipeline::words::option;
use lamp_planning::{Light, SampleHeight};
use lamp_stack::quoted;

use crate::args::lamp_option::LampOption;
use crate::args::options::one_of_described;
use crate::exit::Exit;

/// The heights in a layer, as `--help` describes them.
pub(crate) const SAMPLE_HEIGHTS: [&str; 3] =
    ["Where light enters it", "Half-way", "Where it must reach the surface below"];

/// The target to cure, and the light that cures it.
#[derive(Args, Clone, Debug)]
pub(crate) struct PlanningOptions {
    /// Resin: a built-in material's name (see lamp material list) or a file. It must state how far
    /// light spreads ([spread]) and which dose cures ([working-curve])
    #[arg(long, value_name = "MATERIAL")]
    pub(crate) material: PathBuf,

    #[command(flatten)]
    lamp: LampOption,

    /// Lowest gray level that counts as part of the wanted solid
    #[arg(long, value_name = "LEVEL", default_value = "128", value_parser = parse_wanted)]
    pub(crate) wanted: NonZeroU8,

    /// Margin to the critical dose: wanted voxels should be this far above it, all others this far
    /// below [default: 5%, or 0% with --objective boundary]
    #[arg(long, value_name = "SHARE", value_parser = parse_margin)]
    pub(crate) dose_margin: Option<f64>,

    /// Stop when the plan is proved to be this close to the best one, as a share of the error
    /// without a plan
    #[arg(long, value_name = "SHARE", default_value = "0.1%", value_parser = parse_gap)]
    pub(crate) search_gap: f64,

    /// Height in its layer at which a voxel's dose is computed
    #[arg(long, value_name = "HEIGHT", default_value = "top")]
    #[arg(value_parser = one_of_described::<SampleHeight>(&SAMPLE_HEIGHTS))]
    pub(crate) dose_at: SampleHeight,
}

/// A resin under the light of a plan.
pub(crate) struct PlannedResin {
    pub(crate) material: Material,
    pub(crate) light: Light,
    /// A doubt about the lamp.
    pub(crate) doubt: Option<String>,
    /// The resin and the lamp as pages record them.
    pub(crate) words: String,
}

impl PlanningOptions {
    /// Returns the material under the lamp as it is now, and the light that it makes.
    pub(crate) fn resin(&self) -> Result<PlannedResin, Exit> {
        let (material, word) = document_and_word(&self.material)?;
        let (material, doubt) = self.lamp.material(material)?;
        let light = Light::of(&material, self.dose_at)?;
        Ok(PlannedResin { material, light, doubt, words: self.words(&word) })
    }

    /// Returns the material's file, unless the material is built in.
    pub(crate) fn file_mut(&mut self) -> Option<&mut PathBuf> {
        is_file::<Material>(&self.material).then_some(&mut self.material)
    }

    /// Returns the words that pages record, without the digest of a material's file.
    pub(crate) fn recorded_words(&self) -> String {
        self.words(&recorded_name::<Material>(&self.material).to_string_lossy())
    }

    fn words(&self, material: &str) -> String {
        let lamp = self.lamp.canonical().map(|light| option("lamp-intensity", &light));
        format!("--material {}{}", quoted(material), lamp.unwrap_or_default())
    }
}

fn parse_wanted(text: &str) -> Result<NonZeroU8, String> {
    text.parse().map_err(|_| format!("`{text}` is not a gray level: write 1 to 255"))
}

/// Parses a margin below 100%.
pub(crate) fn parse_margin(text: &str) -> Result<f64, String> {
    match parse_share(text)? {
        margin if margin < 1.0 => Ok(margin),
        _ => Err(format!("`{text}` is not below 100%: nothing would count as black")),
    }
}

/// Parses a gap above zero.
fn parse_gap(text: &str) -> Result<f64, String> {
    match parse_share(text)? {
        0.0 => Err("the best is never reached: write 0.1%".to_owned()),
        gap => Ok(gap),
    }
}
