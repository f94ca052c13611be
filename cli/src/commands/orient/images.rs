//! Counts islands on the images of a pose.

use lamp_pipeline::part_file::PartFile;
use lamp_pipeline::solid::{SolidSettings, at_part};
use lamp_slicing::{Part, SliceError, SliceOptions, Slices};
use lamp_supports::{CheckOptions, Pose, check};

use super::OrientArgs;
use crate::exit::Exit;

impl OrientArgs {
    /// Slices a part in a pose, and counts the islands that hold more than specks.
    pub(super) fn islands_on_images(
        &self,
        solid: &SolidSettings,
        files: &[PartFile],
        part: &Part,
        pose: &Pose,
    ) -> Result<u64, Exit> {
        let options = SliceOptions {
            pitch: self.dpi.into(),
            thickness: self.thickness,
            units: solid.units,
            placement: solid.placement().then(&pose.placement()),
            fill: solid.fill,
            // Facets are what the poses were measured on.
            polish: false,
            ..SliceOptions::default()
        };
        let failed = |error: SliceError| Exit::from(at_part(error.into(), files));
        let slices = Slices::new(part.clone(), &options).map_err(failed)?;
        let layers = slices.map(|layer| layer.map_err(failed));
        Ok(check(layers, Ok, &CheckOptions::default())?.islands.count())
    }
}
