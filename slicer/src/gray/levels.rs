//! Holds the gray levels of each layer.

use std::collections::BTreeMap;

use lamp_stack::{DepthLevels, Length};

use crate::planes::LayerHeights;

/// The gray levels of every layer of a part: [`DepthLevels`], or
/// [`FadingLevels`](lamp_stack::FadingLevels) where doses add up.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerLevels<L = DepthLevels> {
    distinct: Vec<L>,
    /// The position of each layer's levels in `distinct`; further layers have the first levels.
    of_layer: Vec<u32>,
}

impl<L> From<L> for LayerLevels<L> {
    /// Gives all layers the same levels.
    fn from(levels: L) -> Self {
        Self { distinct: vec![levels], of_layer: Vec::new() }
    }
}

impl<L> LayerLevels<L> {
    /// Creates the levels of layers whose exposures differ. `of_thickness` returns the levels for a
    /// thickness; it is called once for each thickness, to the nanometer.
    ///
    /// # Errors
    /// Returns the first error of `of_thickness`.
    pub fn by_thickness<E>(
        heights: &LayerHeights,
        mut of_thickness: impl FnMut(Length) -> Result<L, E>,
    ) -> Result<Self, E> {
        let mut distinct = Vec::new();
        let mut known = BTreeMap::new();
        let of_layer = heights.thicknesses_um().map(|um| -> Result<u32, E> {
            // Thicknesses are above zero, so their bits have the same order.
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

    /// Returns the number of a layer's levels among the distinct ones.
    pub(crate) fn number_of(&self, layer: usize) -> usize {
        self.of_layer.get(layer).map_or(0, |&index| index as usize)
    }

    /// Returns distinct levels by their number.
    pub(crate) fn numbered(&self, number: usize) -> &L {
        &self.distinct[number]
    }

    pub(crate) fn of_layer(&self, layer: usize) -> &L {
        self.numbered(self.number_of(layer))
    }
}

impl LayerLevels {
    /// Returns the depth from which on all pixels are white in all layers.
    pub(crate) fn reach_um(&self) -> f64 {
        self.distinct.iter().map(|levels| levels.reach().um()).fold(0.0, f64::max)
    }
}
