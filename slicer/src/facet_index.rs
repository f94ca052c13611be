//! Finds a part's facets by height, in memory.

use std::ops::Range;

use lamp_stack::{Grouped, KeyCounts};

use crate::bodies::FillRule;
use crate::error::SliceError;
use crate::facet::{Facet, PlacedFacet, Units, facet_heights};
use crate::fill::Fill;
use crate::part::Part;
use crate::placed_part::PlacedPart;
use crate::placement::Placement;
use crate::survey::FacetSurvey;

/// A placed part, whose facets between two heights are found without examining the other facets. It
/// takes about 49 bytes per facet.
///
/// ```
/// use lamp_slicing::{FacetIndex, Part, Placement, Units};
///
/// let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0f32]];
/// let part = Part::from_facets("tetra", vec![[o, y, x], [o, x, z], [o, z, y], [x, y, z]]);
/// let facets = FacetIndex::new(part, &Placement::default(), Units::Millimetres)?;
/// // All but the bottom reach above 100 um.
/// assert_eq!(facets.between(100.0, 200.0).len(), 3);
/// # Ok::<(), lamp_slicing::SliceError>(())
/// ```
#[derive(Debug)]
pub struct FacetIndex {
    model: PlacedPart,
    bins: HeightBins,
    /// The facets, grouped by the bin in which they begin, with their pieces.
    facets: Grouped<(Facet, u32)>,
    /// For each bin, the facets of lower bins that reach into it, as positions in `facets`.
    from_below: Grouped<u32>,
    min: [f64; 3],
    max: [f64; 3],
    overlap: Option<[usize; 2]>,
}

/// Equal ranges of height.
#[derive(Clone, Copy, Debug)]
struct HeightBins {
    start_um: f64,
    height_um: f64,
    count: usize,
}

/// With more, facets would meet several bins each.
const MAX_BINS: f64 = 65_536.0;

impl HeightBins {
    /// Creates bins twice as high as the mean facet, so that most facets meet one or two.
    fn new(survey: &FacetSurvey) -> Self {
        let (start_um, end_um) = (survey.min[2], survey.max[2]);
        let height_um = 2.0 * survey.mean_height_um();
        let count = if height_um > 0.0 { (end_um - start_um) / height_um } else { 1.0 };
        let count = count.clamp(1.0, MAX_BINS).ceil();
        // A flat part has no height to divide by.
        let height_um = ((end_um - start_um) / count).max(f64::MIN_POSITIVE);
        Self { start_um, height_um, count: count as usize }
    }

    /// Returns the bin of a height; heights outside get the first or the last bin.
    #[inline]
    fn of(&self, z_um: f64) -> usize {
        // Casts saturate: heights below the first bin become 0.
        (((z_um - self.start_um) / self.height_um) as usize).min(self.count - 1)
    }

    /// Returns the bins that a facet meets.
    fn of_facet(&self, facet: &PlacedFacet) -> Range<usize> {
        let (low, high) = facet_heights(facet);
        self.of(low)..self.of(high) + 1
    }
}

impl FacetIndex {
    /// Reads a part into memory.
    ///
    /// # Errors
    /// Returns an error if the part is empty, not finite or 1000 km away, or cannot be
    /// read.
    ///
    /// # Panics
    /// Panics if the part has 2^32 facets.
    pub fn new(model: Part, placement: &Placement, units: Units) -> Result<Self, SliceError> {
        let part = model.clone();
        Self::of(PlacedPart::new(model, placement, units)).map_err(|error| part.reason(error))
    }

    fn of(model: PlacedPart) -> Result<Self, SliceError> {
        let survey = FacetSurvey::of(&model)?;
        survey.check_extent(&model)?;
        let bins = HeightBins::new(&survey);
        let (mut facets, mut from_below) = (KeyCounts::new(bins.count), KeyCounts::new(bins.count));
        let blocks = 0..model.model.block_count();
        // Counted first and put afterward, so that bins need no lists that grow.
        for block in blocks.clone() {
            model.for_each_in_block(block, |facet| {
                let met = bins.of_facet(facet);
                facets.add(met.start);
                (met.start + 1..met.end).for_each(|bin| from_below.add(bin));
            })?;
        }
        let (mut facets, mut from_below) = (facets.into_groups(), from_below.into_groups());
        for block in blocks {
            let (piece, _) = model.model.place_of(block);
            model.model.for_each_in_block(block, |facet| {
                let met = bins.of_facet(&model.transform_of(piece).placed(facet));
                // There is room for all facets, unless the file changed.
                let Some(place) = facets.put(met.start, (*facet, piece as u32)) else { return };
                for bin in met.start + 1..met.end {
                    from_below.put(bin, place);
                }
            })?;
        }
        model.model.check_unchanged()?;
        let (facets, from_below) = (facets.finish(), from_below.finish());
        let overlap = survey.overlap(&model);
        Ok(Self { model, bins, facets, from_below, min: survey.min, max: survey.max, overlap })
    }

    /// Returns the rule for the whole part, given the rule for crossings.
    pub fn fill_rule(&self, fill: Fill) -> FillRule {
        self.model.model.fill_rule(fill)
    }

    /// Returns the numbers of the first two files whose boxes overlap.
    pub fn overlap(&self) -> Option<[usize; 2]> {
        self.overlap
    }

    /// Returns the least x and y in millimeters, and z in micrometers.
    pub fn min(&self) -> [f64; 3] {
        self.min
    }

    /// Returns the greatest x and y in millimeters, and z in micrometers.
    pub fn max(&self) -> [f64; 3] {
        self.max
    }

    /// Returns the facets that reach above `low_um` and do not begin above `high_um`, and their
    /// bodies, in an arbitrary but fixed order. Heights are in micrometers.
    pub fn between(&self, low_um: f64, high_um: f64) -> Vec<(PlacedFacet, u32)> {
        let (first, last) = (self.bins.of(low_um), self.bins.of(high_um));
        let facets = self.facets.items();
        let from_below = self.from_below.group(first).iter().map(|&facet| &facets[facet as usize]);
        let own = &facets[self.facets.range(first..last + 1)];
        let placed = from_below.chain(own).map(|facet| (self.placed(facet), facet.1));
        let is_met = |(facet, _): &(PlacedFacet, u32)| {
            let (low, high) = facet_heights(facet);
            low <= high_um && high > low_um
        };
        placed.filter(is_met).collect()
    }

    /// Calls `each` with every facet and its body.
    pub fn for_each(&self, mut each: impl FnMut(&PlacedFacet, u32)) {
        self.facets.items().iter().for_each(|facet| each(&self.placed(facet), facet.1));
    }

    fn placed(&self, (facet, piece): &(Facet, u32)) -> PlacedFacet {
        self.model.transform_of(*piece as usize).placed(facet)
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::tower;

    use super::*;
    use crate::placement::Axis;

    #[test]
    fn facets_are_found_by_height() {
        let mut facets = tower(3_000).facets;
        // A facet that spans all bins.
        facets.push([[0.0, 0.0, -5.0], [1.0, 0.0, 80.0], [0.0, 1.0, 80.0]]);
        for placement in [Placement::default(), Placement::default().rotated(Axis::X, 90.0)] {
            let model = Part::from_facets("tower", facets.clone());
            let body = FacetIndex::new(model, &placement, Units::Millimetres).unwrap();
            let (min, max) = (body.min()[2], body.max()[2]);
            let mut all = Vec::new();
            body.for_each(|facet, _| all.push(*facet));
            assert_eq!(all.len(), facets.len());
            for k in -1..12 {
                let low = min + (max - min) * f64::from(k) / 10.0;
                for high in [low, low + 1.0, low + 300.0, low + 30_000.0] {
                    let mut expected = all.clone();
                    expected.retain(|facet| {
                        let (a, b) = facet_heights(facet);
                        a <= high && b > low
                    });
                    let found = body.between(low, high).into_iter();
                    let mut found: Vec<_> = found.map(|(facet, _)| facet).collect();
                    for list in [&mut expected, &mut found] {
                        list.sort_by(|a, b| a.partial_cmp(b).unwrap());
                    }
                    assert!(found == expected, "{low} to {high}");
                }
            }
        }
    }

    #[test]
    fn a_flat_part_is_one_bin() {
        let flat = vec![[[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]]];
        let model = Part::from_facets("flat", flat);
        let body = FacetIndex::new(model, &Placement::default(), Units::Inches).unwrap();
        assert_eq!(body.between(25_399.0, 25_500.0).len(), 1);
        assert!(body.between(25_400.0, 25_500.0).is_empty());
    }
}
