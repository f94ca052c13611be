//! The requirements for layer heights, and the heights found.

use std::fmt;

use lamp_stack::{Length, Pitch};

use crate::by_height::ByHeight;
use crate::criterion::{AreaDeviation, Criterion, CuspHeight, Roughness, VolumeDeviation};
use crate::error::HeightsError;
use crate::layered_part::LayeredPart;
use crate::search::{HeightSearch, Heights, Watch};
use crate::swept_layer::SweptLayer;
use crate::thicknesses::Thicknesses;

/// Pixels from a measured row to the next: features that a search must see are wider than that.
const PIXELS_PER_ROW: f64 = 4.0;

/// Returns how far apart rows are measured for images of a resolution.
pub fn row_pitch(pitch: Pitch) -> Length {
    Length::from_um(pitch.y.pitch().um() * PIXELS_PER_ROW)
}

/// The measure of a layer's error, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// [`VolumeDeviation`].
    Volume,
    /// [`CuspHeight`].
    Cusp,
    /// [`Roughness`].
    Ra,
    /// [`AreaDeviation`].
    Area,
}

lamp_stack::named!(Measure { Volume = "volume", Cusp = "cusp", Ra = "ra", Area = "area" });

impl Measure {
    /// Returns the criterion that measures, which is `roughness` for [`Ra`](Self::Ra).
    pub fn criterion(self, roughness: &Roughness) -> &dyn Criterion {
        match self {
            Self::Ra => roughness,
            Self::Volume => &VolumeDeviation,
            Self::Cusp => &CuspHeight,
            Self::Area => &AreaDeviation,
        }
    }
}

/// The goal that decides how far layers may err.
#[derive(Clone)]
pub enum Goal<'a> {
    /// Every layer is within its bound.
    Bounds(ByHeight<f64>),
    /// At most this many layers, with the smallest bound that allows it.
    Layers(u32),
    /// All layers together cost at most this much, with the smallest bound that allows it.
    Cost {
        /// Returns the cost of a layer by its thickness, as the seconds that it takes.
        of_layer: &'a dyn Fn(Length) -> f64,
        /// The most that they cost together.
        most: f64,
    },
}

impl fmt::Debug for Goal<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bounds(bounds) => write!(f, "Bounds({bounds})"),
            Self::Layers(layers) => write!(f, "Layers({layers})"),
            Self::Cost { most, .. } => write!(f, "Cost({most})"),
        }
    }
}

/// The requirements for layer heights.
#[derive(Clone, Debug)]
pub struct WantedHeights<'a> {
    /// The thicknesses that the machine builds.
    pub thicknesses: Thicknesses,
    /// The measure of a layer's error.
    pub measure: Measure,
    /// The roughness of stairs.
    pub roughness: Roughness,
    /// The goal that decides its bounds.
    pub goal: Goal<'a>,
    /// Makes layers end at flat faces.
    pub snap: bool,
}

/// The layers found, and the bounds that they keep.
#[derive(Clone, Debug)]
pub struct FoundHeights {
    /// The measure of a layer's error.
    pub measure: Measure,
    /// The roughness of stairs.
    pub roughness: Roughness,
    /// The largest errors of layers, unless no layer within the limits has one as small.
    pub bounds: ByHeight<f64>,
    /// The layers.
    pub heights: Heights,
}

/// Why found heights may be worse than their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum HeightsDoubt {
    /// The mesh has gaps, so that some rows were left out.
    OpenRows {
        /// How many rows, in all layers together.
        rows: u64,
        /// How many layers have such rows.
        layers: u64,
    },
    /// No row meets the part.
    NoVolume,
}

impl WantedHeights<'_> {
    /// Searches for the heights of a part. Calls `watch` for each layer found.
    ///
    /// # Errors
    /// Returns an error if the part is too high, or if no layers within the limits keep a budget.
    pub fn find(&self, part: &LayeredPart, watch: Watch<'_>) -> Result<FoundHeights, HeightsError> {
        let (measure, roughness) = (self.measure, self.roughness);
        let (thicknesses, criterion) = (&self.thicknesses, measure.criterion(&roughness));
        let search = HeightSearch { part, thicknesses, criterion, snap: self.snap, watch };
        let (bound, heights) = match &self.goal {
            Goal::Bounds(bounds) => {
                let (bounds, heights) = (bounds.clone(), search.heights(bounds.clone())?);
                return Ok(FoundHeights { measure, roughness, bounds, heights });
            }
            // A layer costs one, so that the cost counts layers.
            Goal::Layers(layers) => search.within_budget(|_| 1.0, (*layers).into())?,
            Goal::Cost { of_layer, most } => search.within_budget(of_layer, *most)?,
        };
        Ok(FoundHeights { measure, roughness, bounds: bound.into(), heights })
    }
}

impl FoundHeights {
    /// Returns the criterion that measures a layer's error.
    pub fn criterion(&self) -> &dyn Criterion {
        self.measure.criterion(&self.roughness)
    }

    /// Returns how many layers exceed their bounds.
    pub fn past(&self, heights: &Heights) -> usize {
        let criterion = self.criterion();
        let is_past = |layer: &&SweptLayer| criterion.measure(layer) > self.bounds.of_layer(layer);
        heights.layers.iter().filter(is_past).count()
    }

    /// Returns the thicknesses of the layers, bottom first.
    pub fn thicknesses(&self) -> impl Iterator<Item = Length> {
        self.heights.layers.iter().map(|layer| Length::from_um(layer.thickness_um))
    }

    /// Returns why the heights may be worse than their numbers, if they may.
    pub fn doubt(&self) -> Option<HeightsDoubt> {
        let left_out = self.heights.layers.iter().filter(|layer| layer.rows_left_out > 0);
        let (layers, rows) = left_out.fold((0, 0), |(layers, rows), layer| {
            (layers + 1, rows + u64::from(layer.rows_left_out))
        });
        if rows > 0 {
            Some(HeightsDoubt::OpenRows { rows, layers })
        } else {
            (self.heights.volumes_mm3()[2] == 0.0).then_some(HeightsDoubt::NoVolume)
        }
    }
}

#[cfg(test)]
mod tests {
    use lamp_slicing::{FacetIndex, Fill, Part, Placement, Units};

    use super::*;

    #[test]
    fn a_goal_is_kept_by_its_own_measure() {
        // A tetrahedron, 1 mm high.
        let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0f32]];
        let facets = vec![[o, y, x], [o, x, z], [o, z, y], [x, y, z]];
        let model = Part::from_facets("tetra", facets);
        let facets = FacetIndex::new(model, &Placement::default(), Units::Millimetres).unwrap();
        let pitch = row_pitch(Pitch::of_dpi(10_160.0).unwrap());
        let part = LayeredPart::new(facets, pitch, Fill::EvenOdd).unwrap();
        let [min, max, step] = [10.0, 100.0, 1.0].map(Length::from_um);
        let thicknesses = Thicknesses::new(min, max, step).unwrap();
        let find = |measure, goal| {
            let wanted = WantedHeights {
                thicknesses: thicknesses.clone(),
                measure,
                roughness: Roughness::default(),
                goal,
                snap: false,
            };
            wanted.find(&part, Watch::default())
        };
        let bounded = find(Measure::Volume, Goal::Bounds(0.05.into())).unwrap();
        // Next to the tip even the thinnest layers exceed the bound.
        let layers = &bounded.heights.layers;
        let thinnest = layers.iter().filter(|layer| layer.thickness_um == 10.0).count();
        let past = bounded.past(&bounded.heights);
        assert!(0 < past && past <= thinnest && thinnest < layers.len(), "{past} of {thinnest}");
        assert_eq!(bounded.doubt(), None);
        let few = find(Measure::Cusp, Goal::Layers(20)).unwrap();
        assert!(few.heights.layers.len() <= 20 && few.bounds.least_and_most()[0] > 0.0);
        let cost = Goal::Cost { of_layer: &|_| 30.0, most: 20.0 * 30.0 };
        assert_eq!(find(Measure::Cusp, cost).unwrap().heights, few.heights);
        // A quarter of the cusp.
        let [cusps, smooth] = [(Measure::Cusp, 24.0), (Measure::Ra, 6.0)]
            .map(|(measure, bound)| find(measure, Goal::Bounds(bound.into())).unwrap().heights);
        assert_eq!(cusps, smooth);
        let nine = find(Measure::Area, Goal::Layers(9));
        assert!(matches!(nine, Err(HeightsError::Budget { .. })));
    }
}
