//! Counts islands on the images of a pose.

use lamp_slicer::{Part, SliceOptions, Slices};
use lamp_supports::{CheckOptions, Pose, check};

use super::OrientArgs;
use crate::exit::Exit;

impl OrientArgs {
    /// Slices a part in a pose, and counts the islands that hold more than specks.
    pub(super) fn islands_on_images(&self, part: &Part, pose: &Pose) -> Result<u64, Exit> {
        let options = SliceOptions {
            dpi: self.dpi,
            thickness: self.thickness,
            units: self.solid.units,
            placement: self.solid.placement().then(&pose.placement()),
            fill: self.solid.fill,
            // Facets are what the poses were measured on.
            polish: false,
            ..SliceOptions::default()
        };
        let slices = Slices::new(part.clone(), &options)?;
        let layers = slices.map(|layer| layer.map_err(Exit::from));
        Ok(check(layers, Ok, &CheckOptions::default())?.islands.count())
    }
}
