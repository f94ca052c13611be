//! The settings that are the same for all layers of a plan.

use std::io;

use crate::blur::Blur;
use crate::light::LayerLight;
use crate::solver::Terms;
use crate::spool::Spool;
use crate::tiled::{TileGrid, Tiled};
use crate::voxels::levels::Levels;
use crate::voxels::options;
use crate::voxels::roles::RoleRules;

/// The settings that are the same for all layers.
#[derive(Debug)]
pub(crate) struct VoxelSetting {
    pub(crate) grid: TileGrid,
    pub(crate) blur: Blur<f32>,
    pub(crate) rules: RoleRules,
    pub(crate) terms: Terms<f32>,
    /// The dose from which on voxels that are not to be cured have a cost.
    pub(crate) most_of_dark: f32,
    pub(crate) levels: Levels,
    /// The layers, from the light.
    pub(crate) lights: Vec<LayerLight>,
    pub(crate) gap: f64,
    pub(crate) round_up: bool,
    pub(crate) has_min_level: bool,
    pub(crate) window: options::Window,
    /// Layers below a window that its light reaches.
    pub(crate) tail: usize,
    /// The distance around a tile within which light is chosen together with it.
    pub(crate) overlap: usize,
    /// The distance from places where a layer differs from its neighbors within which light may
    /// change.
    pub(crate) near: usize,
    /// About the most bytes to use.
    pub(crate) memory: Option<u64>,
    /// The number of voxels around the images.
    pub(crate) around: usize,
    /// The size of the images.
    pub(crate) image: [usize; 2],
}

impl VoxelSetting {
    /// Reads the part's image of a layer, counted from the light.
    pub(crate) fn read_wanted(&self, wanted: &mut Spool, layer: usize) -> io::Result<Tiled<u8>> {
        let [width, height] = self.image;
        let mut runs = wanted.read(self.lights.len() - 1 - layer)?;
        Tiled::of_rows(self.grid, 0, |row, values| {
            values.fill(0);
            if (self.around..self.around + height).contains(&row) {
                runs.row(&mut values[self.around..self.around + width], |value| value as u8);
            }
            Ok(())
        })
    }

    /// Returns the dose at which the slope of a voxel's cost changes, by the price of its dose:
    /// prices below 0 belong to voxels that are to be cured.
    pub(crate) fn aim(&self, price: f32) -> f32 {
        if price < 0.0 { self.terms.least } else { self.most_of_dark }
    }
}

/// The bits of a price that are not written down: it then has 12 significant ones. Any prices give
/// a bound, and whole numbers stay unchanged.
const LEFT_OUT: u32 = 12;

/// Returns the code of a price.
pub(crate) fn code(price: f32) -> u32 {
    price.to_bits() >> LEFT_OUT
}

/// Returns the price of a code.
pub(crate) fn price(code: u32) -> f32 {
    f32::from_bits(code << LEFT_OUT)
}
