//! Defines the planes at which a part is cut, one per layer.

use std::collections::HashMap;
use std::iter;
use std::ops::Range;

use lamp_stack::{Grouped, Length};

use crate::error::SliceError;
use crate::gray::Side;
use crate::scan::count_at_or_below;

/// A limit above the number of layers that any machine builds.
const MAX_LAYERS: f64 = 4e6;

/// The default distance within which a vertex counts as lying on a plane: a micrometer.
///
/// A height of 0.7 mm is 0.699999988 in 32 bits, and files of six significant digits round heights
/// above 100 mm by half a micrometer, the part's bottom as well as the face.
pub const PLANE_TOLERANCE: Length = Length::from_um(1.0);

/// The plane of a layer at which its section is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PlaneRule {
    /// The layer's top: the section is swept down (002 section 3.2.2).
    #[default]
    Top,
    /// Halfway up.
    Middle,
    /// Just above the layer's bottom: a flat underside there belongs to the section.
    Bottom,
}

lamp_stack::named!(PlaneRule { Top = "top", Middle = "middle", Bottom = "bottom" });

/// Layers of any thickness, by the heights between them.
///
/// ```
/// use lamp_slicing::LayerHeights;
///
/// let heights = LayerHeights::new(vec![0.0, 100.0, 150.0])?;
/// assert_eq!(heights.thicknesses_um().collect::<Vec<_>>(), [100.0, 50.0]);
/// assert!(LayerHeights::new(vec![0.0, 100.0, 50.0]).is_err());
/// # Ok::<(), lamp_slicing::SliceError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LayerHeights {
    boundaries_um: Vec<f64>,
}

impl LayerHeights {
    /// Creates layers between rising boundaries in micrometers, the first layer's
    /// bottom first.
    ///
    /// # Errors
    /// Returns an error if there is no layer, a layer has no thickness or is not finite, or there
    /// are more layers than any machine builds.
    pub fn new(boundaries_um: Vec<f64>) -> Result<Self, SliceError> {
        let layers = boundaries_um.len().saturating_sub(1);
        if layers == 0 || layers as f64 >= MAX_LAYERS {
            return Err(SliceError::LayerCount { layers });
        }
        let is_good = |pair: &[f64]| pair[0] < pair[1] && (pair[1] - pair[0]).is_finite();
        if let Some(layer) = boundaries_um.windows(2).position(|pair| !is_good(pair)) {
            let [bottom, top] = [layer, layer + 1].map(|k| Length::from_um(boundaries_um[k]));
            return Err(SliceError::NoThickness { layer, bottom, top });
        }
        Ok(Self { boundaries_um })
    }

    /// Returns the boundaries in micrometers, one more than the number of layers.
    pub fn boundaries_um(&self) -> &[f64] {
        &self.boundaries_um
    }

    /// Returns the layers' thicknesses in micrometers, to the nanometer, so that the
    /// rounding of differences does not show.
    pub fn thicknesses_um(&self) -> impl Iterator<Item = f64> {
        self.boundaries_um.windows(2).map(|pair| to_nanometres(pair[1] - pair[0]))
    }
}

/// The planes at which a part is cut, one per layer, bottom first.
///
/// If all layers are of one thickness, the part's height is rounded to whole layers, at least one.
/// A plane above the part, in the layer that contains the part's top, is moved down to that top,
/// where flat tops still have their section.
///
/// A vertex within the tolerance of a plane counts as lying on it: above a plane at its layer's top
/// or middle, so that the section is the limit from below; below a plane at its layer's bottom, so
/// that the section is the limit from above. So each plane has a side height; vertices at or above
/// it are above the plane.
#[derive(Clone, Debug)]
pub(crate) struct Planes {
    /// The heights of sections.
    z_um: Vec<f64>,
    /// The heights that divide vertices above planes from those below.
    sides_um: Vec<f64>,
    tolerance_um: f64,
    /// The layers' boundaries.
    boundaries_um: Vec<f64>,
    spacing: Spacing,
    rule: PlaneRule,
    /// The planes of bodies that begin or end within a layer, where they differ from the part's.
    own: Vec<Self>,
    /// The number of each body's planes among these, plus one; 0 for bodies without their own.
    own_of: Vec<u32>,
}

/// The distances between planes.
#[derive(Clone, Debug)]
enum Spacing {
    Even { thickness_um: f64, per_um: f64 },
    Uneven(PlaneBins),
}

impl Spacing {
    fn even(thickness_um: f64) -> Self {
        // Each facet looks its planes up, and a product is faster than a division.
        Self::Even { thickness_um, per_um: 1.0 / thickness_um }
    }
}

impl Planes {
    /// Creates the planes of a part between two heights (micrometers), for layers on a side of it.
    ///
    /// # Errors
    /// Returns an error if there would be more layers than any machine builds.
    pub(crate) fn uniform(
        [bottom_um, top_um]: [f64; 2],
        thickness: Length,
        rule: PlaneRule,
        tolerance: Length,
        side: Side,
    ) -> Result<Self, SliceError> {
        let thickness_um = thickness.um();
        // A part thinner than half a layer still gets one.
        let height = Length::from_um(top_um - bottom_um);
        let count = side.whole_layers(height, thickness, tolerance);
        // Negated, so that a thickness of NaN also fails.
        if !(thickness_um > 0.0 && count < MAX_LAYERS) {
            let height = Length::from_um(top_um - bottom_um).to_whole_nm();
            return Err(SliceError::TooManyLayers { height, thickness, layers: count });
        }
        let height = |k: f64| bottom_um + k * thickness_um;
        let plane = |k: u32| {
            let k = f64::from(k);
            match rule {
                PlaneRule::Top => height(k + 1.0).min(top_um),
                PlaneRule::Middle => height(k + 0.5).min(top_um),
                PlaneRule::Bottom => height(k).next_up(),
            }
        };
        let count = count as u32;
        let z_um: Vec<f64> = (0..count).map(plane).collect();
        let boundaries_um: Vec<f64> = (0..=count).map(|k| height(f64::from(k))).collect();
        let part_um = [bottom_um, top_um];
        let sides_um = sides(&z_um, &boundaries_um, part_um, rule, tolerance);
        let spacing = Spacing::even(thickness_um);
        let tolerance_um = tolerance.um();
        Ok(Self::common(z_um, sides_um, tolerance_um, boundaries_um, spacing, rule))
    }

    /// Creates the planes of given layers, of a part between two heights (micrometers).
    pub(crate) fn of(
        heights: &LayerHeights,
        [bottom_um, top_um]: [f64; 2],
        rule: PlaneRule,
        tolerance: Length,
    ) -> Self {
        let plane = |layer: &[f64]| {
            let [bottom, top] = [layer[0], layer[1]];
            let plane = match rule {
                PlaneRule::Top => top,
                PlaneRule::Middle => bottom + 0.5 * (top - bottom),
                // A flat underside at the bottom itself would have no section.
                PlaneRule::Bottom => return bottom.next_up(),
            };
            // A part that ends at the layer's bottom has its section in the layer below.
            let touching_um = tolerance.um().min(0.5 * (top_um - bottom_um));
            if bottom + touching_um < top_um { plane.min(top_um) } else { plane }
        };
        let boundaries_um = heights.boundaries_um.clone();
        let z_um: Vec<f64> = boundaries_um.windows(2).map(plane).collect();
        let sides_um = sides(&z_um, &boundaries_um, [bottom_um, top_um], rule, tolerance);
        let spacing = Spacing::Uneven(PlaneBins::new(&sides_um));
        Self::common(z_um, sides_um, tolerance.um(), boundaries_um, spacing, rule)
    }

    /// Creates a single plane, whose section is the limit from below.
    pub(crate) fn one(z: Length, tolerance: Length) -> Self {
        let (z_um, tolerance_um) = (z.um(), tolerance.um());
        let (sides_um, boundaries_um) = (vec![z_um - tolerance_um], vec![z_um - 1.0, z_um]);
        let spacing = Spacing::even(1.0);
        Self::common(vec![z_um], sides_um, tolerance_um, boundaries_um, spacing, PlaneRule::Top)
    }

    fn common(
        z_um: Vec<f64>,
        sides_um: Vec<f64>,
        tolerance_um: f64,
        boundaries_um: Vec<f64>,
        spacing: Spacing,
        rule: PlaneRule,
    ) -> Self {
        let (own, own_of) = (Vec::new(), Vec::new());
        Self { z_um, sides_um, tolerance_um, boundaries_um, spacing, rule, own, own_of }
    }

    /// Gives each body, between two heights (micrometers), the layers that it would have alone: its
    /// top and bottom may differ from the part's.
    pub(crate) fn with_bodies(mut self, bodies_um: &[[f64; 2]]) -> Self {
        let alone = self.clone();
        // Many bodies end at the same heights. They share one copy of the planes.
        let mut numbers: HashMap<Vec<(usize, [u64; 2])>, u32> = HashMap::new();
        for &body_um in bodies_um {
            let moves = alone.moves_of(body_um);
            let key = moves.iter().map(|&(layer, at)| (layer, at.map(f64::to_bits))).collect();
            let number = match moves.is_empty() {
                true => 0,
                false => *numbers.entry(key).or_insert_with(|| {
                    let mut planes = alone.clone();
                    for &(layer, [z_um, side_um]) in &moves {
                        planes.set(layer, z_um, side_um);
                    }
                    self.own.push(planes);
                    self.own.len() as u32
                }),
            };
            self.own_of.push(number);
        }
        self
    }

    /// Returns the planes that differ for a body between two heights, with their sides.
    ///
    /// Alone, a body's height is rounded to whole layers, and its last section is at its own top.
    /// If it meets fewer planes, the layer beyond them is cut at its end. If it begins at the
    /// bottom of a layer and meets one plane more, this plane is left out.
    fn moves_of(&self, [low_um, high_um]: [f64; 2]) -> Vec<(usize, [f64; 2])> {
        let ends = &self.boundaries_um;
        let holds = |layer: usize, z_um: f64| {
            layer < self.len() && ends[layer] <= z_um && z_um <= ends[layer + 1]
        };
        let tolerance_um = self.tolerance_um.min(0.5 * (high_um - low_um));
        let at_top = [high_um, high_um - tolerance_um];
        let at_bottom = [low_um.next_up(), low_um.next_up() + tolerance_um];
        let met = self.between(low_um, high_um);
        let wanted = match self.spacing {
            Spacing::Even { thickness_um, .. } => {
                ((high_um - low_um) / thickness_um).round().max(1.0) as usize
            }
            // A top within a given layer has its section there.
            Spacing::Uneven(_) => match self.rule {
                PlaneRule::Top
                    if ends.get(met.end).is_some_and(|&end| end + tolerance_um < high_um) =>
                {
                    met.len() + 1
                }
                _ => met.len().max(1),
            },
        };
        if met.len() < wanted {
            if met.is_empty() {
                let middle_um = 0.5 * (low_um + high_um);
                let at = match self.rule {
                    PlaneRule::Top => at_top,
                    PlaneRule::Middle => [middle_um, middle_um],
                    PlaneRule::Bottom => at_bottom,
                };
                let layer = (0..self.len()).find(|&layer| holds(layer, middle_um));
                return layer.map(|layer| (layer, at)).into_iter().collect();
            }
            return match self.rule {
                PlaneRule::Top | PlaneRule::Middle if holds(met.end, high_um) => {
                    vec![(met.end, at_top)]
                }
                PlaneRule::Bottom if met.start > 0 && holds(met.start - 1, low_um) => {
                    vec![(met.start - 1, at_bottom)]
                }
                _ => Vec::new(),
            };
        }
        let begins_with_layer = (ends[met.start] - low_um).abs() <= self.tolerance_um;
        match self.rule {
            PlaneRule::Bottom if met.len() > wanted && begins_with_layer => {
                let last = met.end - 1;
                vec![(last, [self.z_um[last], self.sides_um[last].max(high_um.next_up())])]
            }
            _ => Vec::new(),
        }
    }

    /// Returns the planes at which a body is cut.
    #[inline]
    pub(crate) fn of_body(&self, body: u32) -> &Self {
        match self.own_of.get(body as usize) {
            // Most bodies begin and end with the part's layers.
            None | Some(0) => self,
            Some(&number) => &self.own[number as usize - 1],
        }
    }

    /// Returns planes for each height at which bodies are cut in a layer.
    pub(crate) fn each_at(&self, layer: usize) -> Vec<&Self> {
        let mut each = vec![self];
        for own in &self.own {
            if each.iter().all(|other| other.z_um[layer] != own.z_um[layer]) {
                each.push(own);
            }
        }
        each
    }

    /// Returns the heights between which bodies meet the planes of some layers, or lie on these
    /// planes.
    pub(crate) fn heights_um(&self, layers: &Range<usize>) -> [f64; 2] {
        let all = || iter::once(self).chain(&self.own);
        let low_um = all().map(|planes| planes.sides_um[layers.start]).fold(f64::MAX, f64::min);
        let last = layers.end - 1;
        let ends = all().flat_map(|planes| [planes.sides_um[last], planes.z_um[last]]);
        let high_um = ends.fold(f64::MIN, f64::max);
        [low_um, high_um]
    }

    /// Returns the planes with one of them moved: at most halfway to its neighbors, and not at all
    /// if it would leave the part between two heights.
    pub(crate) fn moved(&self, layer: usize, by_um: f64, part_um: [f64; 2]) -> Self {
        let mut planes = self.clone();
        let here = self.z_um[layer];
        let below = layer.checked_sub(1).map_or(f64::MIN, |below| self.z_um[below]);
        let above = self.z_um.get(layer + 1).copied().unwrap_or(f64::MAX);
        let moved = here + by_um.clamp((below - here) / 2.0, (above - here) / 2.0);
        let [bottom, top] = part_um;
        if moved > bottom && moved <= top {
            let side = planes.sides_um[layer] + (moved - here);
            planes.set(layer, moved, side);
        }
        planes
    }

    /// Moves a plane and its side.
    fn set(&mut self, layer: usize, z_um: f64, side_um: f64) {
        (self.z_um[layer], self.sides_um[layer]) = (z_um, side_um);
        if let Spacing::Uneven(bins) = &mut self.spacing {
            *bins = PlaneBins::new(&self.sides_um);
        }
    }

    /// Returns the heights of the layers.
    pub(crate) fn heights(&self) -> LayerHeights {
        LayerHeights { boundaries_um: self.boundaries_um.clone() }
    }

    /// Returns the number of layers.
    pub(crate) fn len(&self) -> usize {
        self.z_um.len()
    }

    /// Returns the depth below a layer's top, in micrometers, from which on a face counts as lying at
    /// its bottom.
    pub(crate) fn bottom_depth_um(&self, layer: usize) -> f64 {
        let thickness_um = self.thickness_um(layer);
        thickness_um - self.tolerance_um.min(0.5 * thickness_um)
    }

    /// Returns the height of a plane, in micrometers.
    #[inline]
    pub(crate) fn z_um(&self, layer: usize) -> f64 {
        self.z_um[layer]
    }

    /// Returns the height at and above which vertices are above a plane, in micrometers.
    #[inline]
    pub(crate) fn side_um(&self, layer: usize) -> f64 {
        self.sides_um[layer]
    }

    /// Returns the distance within which a vertex counts as lying on a plane, in micrometers.
    #[inline]
    pub(crate) fn tolerance_um(&self) -> f64 {
        self.tolerance_um
    }

    /// Returns the height of a layer's bottom, in micrometers, to the nanometer.
    pub(crate) fn layer_bottom_um(&self, layer: usize) -> f64 {
        to_nanometres(self.boundaries_um[layer])
    }

    /// Returns the height of a layer's top, where its exposure begins, in micrometers.
    #[inline]
    pub(crate) fn top_um(&self, layer: usize) -> f64 {
        self.boundaries_um[layer + 1]
    }

    /// Returns the height of the first layer's bottom, in micrometers.
    pub(crate) fn bottom_um(&self) -> f64 {
        self.boundaries_um[0]
    }

    /// Returns the thickness of a layer, in micrometers; to the nanometer for given layers.
    pub(crate) fn thickness_um(&self, layer: usize) -> f64 {
        match self.spacing {
            Spacing::Even { thickness_um, .. } => thickness_um,
            Spacing::Uneven(_) => to_nanometres(self.depth_um(&(layer..layer + 1))),
        }
    }

    /// Returns the height of some layers together, in micrometers.
    pub(crate) fn depth_um(&self, layers: &Range<usize>) -> f64 {
        self.boundaries_um[layers.end] - self.boundaries_um[layers.start]
    }

    /// Returns the layers whose planes are between two vertices at these heights.
    #[inline]
    pub(crate) fn between(&self, low_um: f64, high_um: f64) -> Range<usize> {
        self.at_or_below(low_um)..self.at_or_below(high_um)
    }

    /// Returns the layers whose sections are from `low_um` up to `high_um`, and perhaps one more at
    /// each end.
    #[inline]
    pub(crate) fn near(&self, low_um: f64, high_um: f64) -> Range<usize> {
        self.between(low_um - self.tolerance_um, high_um)
    }

    /// Returns the number of planes that a vertex at a height is above.
    #[inline]
    pub(crate) fn at_or_below(&self, z_um: f64) -> usize {
        match &self.spacing {
            Spacing::Even { per_um, .. } => {
                // A quotient of even planes is off by rounding and moved ends: the walk corrects
                // it.
                let guess = (z_um - self.sides_um[0]) * per_um + 1.0;
                count_at_or_below(&self.sides_um, z_um, guess)
            }
            Spacing::Uneven(bins) => bins.at_or_below(z_um),
        }
    }
}

/// Returns the heights that divide vertices above planes from vertices below, at most a tolerance
/// away from the planes. No vertex is on two planes, and no plane touches both a part's bottom and
/// top. A part that begins within a given layer, but as near its plane as rounding, begins there.
fn sides(
    z_um: &[f64],
    boundaries_um: &[f64],
    [bottom_um, top_um]: [f64; 2],
    rule: PlaneRule,
    tolerance: Length,
) -> Vec<f64> {
    let is_near = |distance_um: f64| distance_um <= tolerance.um();
    let side = |(&z, layer): (&f64, &[f64])| {
        let begins_there = bottom_um > layer[0] && is_near(z - bottom_um) && !is_near(top_um - z);
        let ends_there = top_um < layer[1] && is_near(top_um - z) && !is_near(z - bottom_um);
        let room_um = match rule {
            PlaneRule::Top | PlaneRule::Middle if begins_there => z - layer[0],
            PlaneRule::Top | PlaneRule::Middle => z - layer[0].max(bottom_um),
            PlaneRule::Bottom if ends_there => layer[1] - z,
            PlaneRule::Bottom => layer[1].min(top_um) - z,
        };
        let tolerance_um = tolerance.um().min(0.5 * room_um.max(0.0));
        if rule == PlaneRule::Bottom { z + tolerance_um } else { z - tolerance_um }
    };
    z_um.iter().zip(boundaries_um.windows(2)).map(side).collect()
}

fn to_nanometres(um: f64) -> f64 {
    Length::from_um(um).to_whole_nm().um()
}

/// Finds planes with uneven distances, by the same number of even bins.
#[derive(Clone, Debug)]
struct PlaneBins {
    start_um: f64,
    per_um: f64,
    last: usize,
    planes_um: Grouped<f64>,
}

impl PlaneBins {
    /// Sorts planes, the lowest first, into bins.
    fn new(planes_um: &[f64]) -> Self {
        // As many bins as planes, so that most bins have one plane or a few.
        let [start_um, end_um] = [planes_um[0], planes_um[planes_um.len() - 1]];
        let count = planes_um.len();
        // All planes are in one bin if they have the same height.
        let per_um = if end_um > start_um { count as f64 / (end_um - start_um) } else { 0.0 };
        let empty = Self { start_um, per_um, last: count - 1, planes_um: Grouped::default() };
        let planes_um = Grouped::new(count, || planes_um.iter().map(|&z| (empty.bin(z), z)));
        Self { planes_um, ..empty }
    }

    /// Returns the bin of a height; heights outside get the first or the last bin.
    #[inline]
    fn bin(&self, z_um: f64) -> usize {
        (((z_um - self.start_um) * self.per_um) as usize).min(self.last)
    }

    /// Returns the number of planes at or below a height.
    ///
    /// Bins rise with heights, regardless of rounding: planes in lower bins are lower, and planes
    /// in higher bins are higher.
    // Not inlined, so that the even planes' search stays small enough to be.
    #[inline(never)]
    fn at_or_below(&self, z_um: f64) -> usize {
        let bin = self.bin(z_um);
        let planes_um = self.planes_um.group(bin);
        let below = self.planes_um.range(bin..bin + 1).start;
        below + planes_um.partition_point(|&plane| plane <= z_um)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use proptest::test_runner::Config;

    use super::*;

    fn uniform(height_um: f64, thickness_um: f64, rule: PlaneRule) -> Result<Planes, SliceError> {
        let thickness = Length::from_um(thickness_um);
        Planes::uniform([0.0, height_um], thickness, rule, PLANE_TOLERANCE, Side::Both)
    }

    fn planes(height_um: f64, rule: PlaneRule) -> Vec<f64> {
        uniform(height_um, 100.0, rule).unwrap().z_um
    }

    #[test]
    fn a_height_of_whole_layers_has_its_planes() {
        assert_eq!(planes(300.0, PlaneRule::Top), [100.0, 200.0, 300.0]);
        assert_eq!(planes(300.0, PlaneRule::Middle), [50.0, 150.0, 250.0]);
        let bottom = planes(300.0, PlaneRule::Bottom);
        assert!(bottom[0] > 0.0 && bottom[0] < 1e-300 && bottom.len() == 3);
    }

    #[test]
    fn other_heights_round_to_whole_layers() {
        assert_eq!(planes(349.9, PlaneRule::Top), [100.0, 200.0, 300.0]);
        assert_eq!(planes(350.0, PlaneRule::Top), [100.0, 200.0, 300.0, 350.0]);
        // 32-bit coordinates differ slightly from decimal heights.
        assert_eq!(planes(299.99999, PlaneRule::Top), [100.0, 200.0, 299.99999]);
        assert_eq!(planes(300.00001, PlaneRule::Top), [100.0, 200.0, 300.0]);
        assert_eq!(planes(1.0, PlaneRule::Top), [1.0]);
        assert_eq!(planes(1.0, PlaneRule::Middle), [1.0]);
        assert_eq!(planes(0.0, PlaneRule::Top), [0.0]);
    }

    #[test]
    fn a_vertex_on_a_plane_is_above_it() {
        let planes = uniform(1e5, 100.0, PlaneRule::Top).unwrap();
        assert_eq!(planes.between(0.0, 100.0), 0..1);
        assert_eq!(planes.between(100.0, 200.0), 1..2);
        assert_eq!(planes.between(100.0, 199.0), 1..2);
        assert_eq!(planes.between(99.0, 198.9), 1..1);
        assert_eq!(planes.between(-1e9, 1e9), 0..1000);
        for (k, z) in planes.z_um.iter().enumerate() {
            assert_eq!(planes.at_or_below(z - 1.0), k + 1);
            assert_eq!(planes.at_or_below((z - 1.0).next_down()), k);
        }
    }

    #[test]
    fn absurd_counts_are_refused() {
        for thickness in [1e-9, -100.0, 0.0, f64::NAN] {
            let planes = uniform(1e5, thickness, PlaneRule::Top);
            assert!(planes.is_err(), "{thickness}");
        }
    }

    #[test]
    fn even_heights_given_one_by_one_are_the_uniform_planes() {
        let boundaries = |count: u32| (0..=count).map(|k| 0.3 + f64::from(k) * 33.1).collect();
        for (top_um, count) in [(331.4, 10), (330.0, 10), (345.0, 10), (0.4, 1)] {
            let heights = LayerHeights::new(boundaries(count)).unwrap();
            for rule in [PlaneRule::Top, PlaneRule::Middle, PlaneRule::Bottom] {
                let thickness = Length::from_um(33.1);
                let part_um = [0.3, top_um];
                let uniform =
                    Planes::uniform(part_um, thickness, rule, PLANE_TOLERANCE, Side::Both).unwrap();
                let given = Planes::of(&heights, part_um, rule, PLANE_TOLERANCE);
                assert_eq!(given.boundaries_um, uniform.boundaries_um, "{top_um}");
                for (a, b) in given.z_um.iter().zip(&uniform.z_um) {
                    assert!((a - b).abs() < 1e-12, "{top_um} {rule:?}");
                }
                for layer in 0..uniform.len() {
                    assert_eq!(given.thickness_um(layer), 33.1);
                    assert_eq!(given.layer_bottom_um(layer), uniform.layer_bottom_um(layer));
                }
            }
        }
    }

    #[test]
    fn layers_above_the_part_keep_their_planes() {
        let heights = LayerHeights::new(vec![-10.0, 0.0, 40.0, 100.0, 150.0, 155.0]).unwrap();
        let planes = Planes::of(&heights, [0.0, 90.0], PlaneRule::Top, PLANE_TOLERANCE);
        assert_eq!(planes.z_um, [0.0, 40.0, 90.0, 150.0, 155.0]);
        assert_eq!(planes.top_um(2), 100.0);
        assert_eq!(planes.depth_um(&(1..4)), 150.0);
        assert_eq!(planes.thickness_um(4), 5.0);
    }

    #[test]
    fn heights_rise() {
        let nowhere = [vec![], vec![1.0], vec![0.0, 0.0], vec![0.0, 2.0, 1.0], vec![0.0, f64::NAN]];
        for boundaries in nowhere {
            assert!(LayerHeights::new(boundaries.clone()).is_err(), "{boundaries:?}");
        }
        let error = LayerHeights::new(vec![0.0, 5.0, 5.0]).unwrap_err().to_string();
        assert_eq!(error, "layer 1 would lie between 5um and 5um: heights of layers must rise");
    }

    proptest! {
        #![proptest_config(Config { failure_persistence: None, ..Config::default() })]

        /// Thicknesses that differ by a factor of up to a million.
        #[test]
        fn uneven_planes_are_found_exactly(
            start in -1e6..1e6f64,
            powers in prop::collection::vec(-3.0..3.0f64, 1..200),
            asked in prop::collection::vec(-0.2..1.2f64, 50),
        ) {
            let mut boundaries = vec![start];
            for power in powers {
                boundaries.push(boundaries[boundaries.len() - 1] + 10f64.powf(power));
            }
            let height = boundaries[boundaries.len() - 1] - start;
            let heights = LayerHeights::new(boundaries).unwrap();
            for rule in [PlaneRule::Top, PlaneRule::Middle, PlaneRule::Bottom] {
                let part_um = [start, start + 0.9 * height];
                let planes = Planes::of(&heights, part_um, rule, PLANE_TOLERANCE);
                let near = planes.sides_um.iter().flat_map(|z| [*z, z.next_down(), z.next_up()]);
                for z in near.chain(asked.iter().map(|share| start + share * height)) {
                    let counted = planes.sides_um.iter().filter(|plane| **plane <= z).count();
                    prop_assert_eq!(planes.at_or_below(z), counted);
                }
            }
        }
    }
}
