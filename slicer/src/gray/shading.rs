//! Defines the gray of layers where the part below is thinner than the layers, and on which side of
//! the part layers lie.

use lamp_stack::{FadingLevels, Length};

use super::levels::LayerLevels;
use super::print_through::PrintThrough;
use crate::planes::Planes;

/// The gray of layers where the part is less deep than the light reaches, or their side of the part.
/// Unless pixels show the section alone, layers are swept down from sections at their tops
/// ([`PlaneRule::Top`](crate::PlaneRule::Top)).
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Shading {
    /// No gray: pixels are white where the section is.
    #[default]
    White,
    /// Each layer alone: the level that cures the depth of the part below its top.
    ByDepth(LayerLevels),
    /// Layers whose doses add up, by the light that each level leaves in the resin below: down each
    /// column of pixels, white layers lose the least light that leaves the undersides in place.
    PrintThrough(LayerLevels<FadingLevels>),
    /// No gray: pixels are white where the part fills the layer from its bottom to its top.
    Inside,
    /// No gray: pixels are white where the part is anywhere in the layer.
    Outside,
}

/// The side of the part's surface on which a stack lies.
///
/// A layer's section at its top, swept down, lies on both: inside the part where this widens
/// downward, and outside where it narrows. If the stack is to be polished down to the part, it must
/// contain it; a core whose casting is to be polished must lie inside.
///
/// Source: Kulkarni and Dutta, by 002 section 3.2.1.2 and figure 38.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// Both: each layer is its section.
    #[default]
    Both,
    /// The stack lies inside the part: each layer is the intersection of all sections in it.
    Inside,
    /// The stack contains the part: each layer is the union of all sections in it.
    Outside,
}

lamp_stack::named!(Side { Both = "both", Inside = "inside", Outside = "outside" });

impl Side {
    /// Returns the number of whole layers of a part: at least one, and up to its top or beyond. A
    /// stack inside the part ends below its top, one outside above, and others as near as they can.
    /// Tops are off by less than `tolerance`.
    ///
    /// ```
    /// use lamp_slicing::Side;
    /// use lamp_stack::Length;
    ///
    /// let [height, thickness, tolerance] = [1030.0, 100.0, 1.0].map(Length::from_um);
    /// let layers = |side: Side| side.whole_layers(height, thickness, tolerance);
    /// assert_eq!([Side::Inside, Side::Both, Side::Outside].map(layers), [10.0, 10.0, 11.0]);
    /// ```
    pub fn whole_layers(self, height: Length, thickness: Length, tolerance: Length) -> f64 {
        let layers = height.um() / thickness.um();
        // A tolerance of half a layer would lose the layer.
        let tolerance = (tolerance.um() / thickness.um()).min(0.5);
        let whole = match self {
            Self::Both => layers.round(),
            Self::Inside => (layers + tolerance).floor(),
            Self::Outside => (layers - tolerance).ceil(),
        };
        whole.max(1.0)
    }
}

/// The shading of a part whose planes are known.
#[derive(Debug)]
pub(crate) enum PlacedShading {
    White,
    ByDepth(LayerLevels),
    PrintThrough(PrintThrough),
    Inside { reach_um: f64 },
    Outside { reach_um: f64 },
}

impl Shading {
    /// Returns the side of the part on which layers lie.
    pub(crate) fn side(&self) -> Side {
        match self {
            Self::Inside => Side::Inside,
            Self::Outside => Side::Outside,
            Self::White | Self::ByDepth(_) | Self::PrintThrough(_) => Side::Both,
        }
    }
}

impl From<Side> for Shading {
    fn from(side: Side) -> Self {
        match side {
            Side::Both => Self::White,
            Side::Inside => Self::Inside,
            Side::Outside => Self::Outside,
        }
    }
}

impl PlacedShading {
    pub(crate) fn new(shading: &Shading, planes: &Planes) -> Self {
        let thicknesses = (0..planes.len()).map(|layer| planes.thickness_um(layer));
        let reach_um = thicknesses.fold(0.0, f64::max);
        match shading {
            Shading::White => Self::White,
            Shading::ByDepth(levels) => Self::ByDepth(levels.clone()),
            Shading::PrintThrough(levels) => {
                Self::PrintThrough(PrintThrough::new(levels.clone(), planes))
            }
            Shading::Inside => Self::Inside { reach_um },
            Shading::Outside => Self::Outside { reach_um },
        }
    }

    /// Returns the shading from which it was made.
    pub(crate) fn unplaced(&self) -> Shading {
        match self {
            Self::White => Shading::White,
            Self::ByDepth(levels) => Shading::ByDepth(levels.clone()),
            Self::PrintThrough(light) => Shading::PrintThrough(light.levels().clone()),
            Self::Inside { .. } => Shading::Inside,
            Self::Outside { .. } => Shading::Outside,
        }
    }

    /// Returns the distance below their sections down to which layers examine facets, if they do.
    pub(crate) fn reach_um(&self) -> Option<f64> {
        match self {
            Self::White => None,
            Self::ByDepth(levels) => Some(levels.reach_um()),
            Self::PrintThrough(light) => Some(light.within_um()),
            Self::Inside { reach_um } | Self::Outside { reach_um } => Some(*reach_um),
        }
    }

    /// Returns whether all images are masks.
    pub(crate) fn is_one_bit(&self) -> bool {
        matches!(self, Self::White | Self::Inside { .. } | Self::Outside { .. })
    }

    /// Returns the light of whole columns, if doses add up.
    pub(crate) fn print_through(&self) -> Option<&PrintThrough> {
        match self {
            Self::PrintThrough(light) => Some(light),
            _ => None,
        }
    }
}
