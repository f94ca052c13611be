//! Marks of facets by which people name surfaces: colors and paint.

use std::ops::Range;

use lamp_brep::Color;

/// The marks of the facets of a mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct FacetMarks {
    /// The color of each facet; empty if none has one.
    pub(crate) colors: Vec<Option<Color>>,
    /// The facets that are painted for supports, in ascending order, and the digits that [`divided`]
    /// decodes.
    ///
    /// [`divided`]: crate::paint::divided
    pub(crate) painted: Vec<(usize, Box<str>)>,
}

impl FacetMarks {
    /// Returns the marks of a range of facets, which are counted from 0 again.
    pub(crate) fn of_range(&self, range: &Range<usize>) -> Self {
        let colors = self.colors.get(range.clone()).unwrap_or_default().to_vec();
        let painted = self.painted.iter().filter(|(facet, _)| range.contains(facet));
        let painted = painted.map(|(facet, digits)| (facet - range.start, digits.clone()));
        Self { colors, painted: painted.collect() }
    }
}

/// Returns the color of three corners, if all have the same.
pub(crate) fn of_corners([a, b, c]: [Option<Color>; 3]) -> Option<Color> {
    a.filter(|_| a == b && b == c)
}
