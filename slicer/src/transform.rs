//! Defines the affine map of a part's facets from its file to its place on the machine.

use crate::facet::{Facet, PlacedFacet, Units};
use crate::placement::{Placement, affine};

/// The transform from file units to the placed part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Transform {
    /// Scales the axes. Most parts need only this.
    Scale([f64; 3]),
    Affine([[f64; 4]; 3]),
}

impl Transform {
    pub(crate) fn new(placement: &Placement, units: Units) -> Self {
        let mut rows = placement.rows();
        // Converts directly to micrometers: z in file units multiplied by these is exact.
        for (row, (unit, per_mm)) in
            rows.iter_mut().zip([(units.mm(), 1.0), (units.mm(), 1.0), (units.um(), 1000.0)])
        {
            let [x, y, z, shift] = *row;
            *row = [x * unit, y * unit, z * unit, shift * per_mm];
        }
        let is_scale = (0..12).all(|k| k % 4 == k / 4 || rows[k / 4][k % 4] == 0.0);
        match is_scale {
            true => Self::Scale(std::array::from_fn(|axis| rows[axis][axis])),
            false => Self::Affine(rows),
        }
    }

    /// Places a facet.
    #[inline]
    pub(crate) fn placed(&self, facet: &Facet) -> PlacedFacet {
        match self {
            Self::Scale(scale) => placed(facet, |corner| scaled(scale, corner)),
            Self::Affine(rows) => placed(facet, |corner| rows.map(|row| affine(&row, corner))),
        }
    }
}

#[inline]
pub(crate) fn scaled(scale: &[f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [x * scale[0], y * scale[1], z * scale[2]]
}

#[inline]
pub(crate) fn placed(facet: &Facet, place: impl Fn([f64; 3]) -> [f64; 3]) -> PlacedFacet {
    facet.map(|corner| place(corner.map(f64::from)))
}
