//! The gray level of a depth.

use std::collections::BTreeMap;

use lamp_stack::Length;

use crate::planes::LayerHeights;

/// Which gray level cures how deep, for one time of exposure.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthLevels {
    reach_um: f64,
    /// From the depth at `i` on, the level is above `i`.
    steps_um: Box<[f64; 255]>,
}

impl DepthLevels {
    /// The levels of a resin: `depth_of` says how deep a gray level from 0 to 1
    /// cures, and never less for a whiter one. Depths from `reach` on are white.
    pub fn new(reach: Length, depth_of: impl Fn(f64) -> Length) -> Self {
        // Half way between two levels, the nearer one changes.
        let step = |i: usize| depth_of((i as f64 + 0.5) / 255.0).um();
        Self { reach_um: reach.um(), steps_um: Box::new(std::array::from_fn(step)) }
    }

    /// Returns the level from 0 to 255 whose gray cures a depth, to the nearest
    /// level. No depth is black.
    pub fn level(&self, depth: Length) -> u8 {
        self.of_um(depth.um())
    }

    #[inline]
    pub(crate) fn of_um(&self, depth_um: f64) -> u8 {
        if depth_um <= 0.0 {
            0
        } else if depth_um >= self.reach_um {
            255
        } else {
            self.steps_um.partition_point(|&step| step <= depth_um) as u8
        }
    }

    /// From this depth on, all is white.
    fn reach_um(&self) -> f64 {
        self.reach_um
    }
}

/// The gray levels of every layer of a part.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerLevels {
    distinct: Vec<DepthLevels>,
    /// Which of them each layer has; the first for layers beyond.
    of_layer: Vec<u32>,
}

impl From<DepthLevels> for LayerLevels {
    /// The same levels in all layers.
    fn from(levels: DepthLevels) -> Self {
        Self { distinct: vec![levels], of_layer: Vec::new() }
    }
}

impl LayerLevels {
    /// The levels of layers whose exposures differ: `of_thickness` says them for
    /// each thickness, to the nanometre.
    ///
    /// # Errors
    /// Those of `of_thickness`.
    pub fn by_thickness<E>(
        heights: &LayerHeights,
        mut of_thickness: impl FnMut(Length) -> Result<DepthLevels, E>,
    ) -> Result<Self, E> {
        let mut distinct = Vec::new();
        let mut known = BTreeMap::new();
        let of_layer = heights.thicknesses_um().map(|um| -> Result<u32, E> {
            // Thicknesses are above zero, and so in the order of their bits.
            if let Some(&index) = known.get(&um.to_bits()) {
                return Ok(index);
            }
            let index = distinct.len() as u32;
            distinct.push(of_thickness(Length::from_um(um))?);
            known.insert(um.to_bits(), index);
            Ok(index)
        });
        let of_layer = of_layer.collect::<Result<_, E>>()?;
        Ok(Self { distinct, of_layer })
    }

    pub(crate) fn of_layer(&self, layer: usize) -> &DepthLevels {
        &self.distinct[self.of_layer.get(layer).map_or(0, |&index| index as usize)]
    }

    /// From this depth on, all is white in all layers.
    pub(crate) fn reach_um(&self) -> f64 {
        self.distinct.iter().map(DepthLevels::reach_um).fold(0.0, f64::max)
    }
}
