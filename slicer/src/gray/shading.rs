//! Defines the gray of layers where the part below is thinner than the layers.

use lamp_stack::FadingLevels;

use super::levels::LayerLevels;
use super::print_through::PrintThrough;
use crate::planes::Planes;

/// The gray of layers where the part is less deep than the light reaches. Gray layers are swept
/// down from their sections, which must be at their tops
/// ([`PlaneRule::Top`](crate::PlaneRule::Top)).
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Shading {
    /// No gray: pixels are white or black.
    #[default]
    White,
    /// Each layer alone: the level that cures the depth of the part below its top.
    ByDepth(LayerLevels),
    /// Layers whose doses add up, by the light that each level leaves in the resin below: down each
    /// column of pixels, white layers lose the least light that leaves the undersides in place.
    PrintThrough(LayerLevels<FadingLevels>),
}

/// The shading of a part whose planes are known.
#[derive(Debug)]
pub(crate) enum PlacedShading {
    White,
    ByDepth(LayerLevels),
    PrintThrough(PrintThrough),
}

impl PlacedShading {
    pub(crate) fn new(shading: &Shading, planes: &Planes) -> Self {
        match shading {
            Shading::White => Self::White,
            Shading::ByDepth(levels) => Self::ByDepth(levels.clone()),
            Shading::PrintThrough(levels) => {
                Self::PrintThrough(PrintThrough::new(levels.clone(), planes))
            }
        }
    }

    /// Returns the shading from which it was made.
    pub(crate) fn unplaced(&self) -> Shading {
        match self {
            Self::White => Shading::White,
            Self::ByDepth(levels) => Shading::ByDepth(levels.clone()),
            Self::PrintThrough(light) => Shading::PrintThrough(light.levels().clone()),
        }
    }

    /// Returns the distance below their sections down to which layers examine facets, if they do.
    pub(crate) fn reach_um(&self) -> Option<f64> {
        match self {
            Self::White => None,
            Self::ByDepth(levels) => Some(levels.reach_um()),
            Self::PrintThrough(light) => Some(light.within_um()),
        }
    }

    /// Returns the light of whole columns, if doses add up.
    pub(crate) fn print_through(&self) -> Option<&PrintThrough> {
        match self {
            Self::PrintThrough(light) => Some(light),
            _ => None,
        }
    }
}
