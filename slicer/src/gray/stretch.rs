//! Finds the columns of a row that meet a facet, and the layers that look at each column.

use std::ops::Range;

use crate::planes::Planes;
use crate::scan::ceil_clamped;

/// Facets this near the part's lowest point stand on the platform. A flat underside that was turned
/// into its place is not exactly level.
const STANDING_UM: f64 = 1.0;

/// The columns of a row that meet a facet, with heights along the line from edge to edge.
pub(super) struct RowStretch {
    columns: Range<u32>,
    ends: [f64; 2],
    heights: [f64; 2],
    um_per_column: f64,
}

impl RowStretch {
    /// Creates the stretch between two points (x, z) of a facet's edges, if a pixel's center is
    /// between them. Heights are the facet's, regardless of rounding at its edges.
    #[inline]
    pub(super) fn new(
        ends: [[f64; 2]; 2],
        [low_um, high_um]: [f64; 2],
        width: u32,
    ) -> Option<Self> {
        let [long, short] = ends;
        let ends = [long[0], short[0]];
        let [a, b] = ends.map(|column| ceil_clamped(column, width));
        if a == b {
            return None;
        }
        let heights = [long[1], short[1]].map(|z| z.clamp(low_um, high_um));
        // A column is between the ends, so they differ.
        let um_per_column = (heights[1] - heights[0]) / (ends[1] - ends[0]);
        Some(Self { columns: a.min(b)..a.max(b), ends, heights, um_per_column })
    }

    /// Returns the columns.
    pub(super) fn columns(&self) -> Range<u32> {
        self.columns.clone()
    }

    /// Returns its rise from column to column.
    #[inline]
    pub(super) fn um_per_column(&self) -> f64 {
        self.um_per_column
    }

    /// Returns the heights of the lower and the higher end.
    #[inline]
    pub(super) fn heights(&self) -> [f64; 2] {
        let [a, b] = self.heights;
        [a.min(b), a.max(b)]
    }

    /// Returns the height at a column, clamped to the facet against rounding.
    #[inline]
    pub(super) fn height(&self, column: u32) -> f64 {
        let [low, high] = self.heights();
        let z = self.heights[0] + self.um_per_column * (f64::from(column) - self.ends[0]);
        z.clamp(low, high)
    }

    /// Calls `each` with the layers of a range that look at it, the columns that each layer looks
    /// at, and the depth of the first of these columns.
    #[inline]
    pub(super) fn for_each_look(
        &self,
        looks: &Looks<'_>,
        layers: Range<usize>,
        mut each: impl FnMut(usize, Range<u32>, f64),
    ) {
        let all = self.columns.clone();
        if self.um_per_column == 0.0 || all.len() == 1 {
            for layer in layers {
                let depth_um = looks.planes.top_um(layer) - self.height(all.start);
                if looks.depths(layer).contains(&depth_um) {
                    each(layer, all.clone(), depth_um);
                }
            }
        } else if all.len() <= layers.len() {
            self.for_each_look_of_few(looks, layers, each);
        } else {
            for layer in layers {
                if let Some((columns, depth_um)) = self.within(looks, layer) {
                    each(layer, columns, depth_um);
                }
            }
        }
    }

    /// The same for many layers and few columns: a sweep from the lowest column to the highest.
    #[inline]
    fn for_each_look_of_few(
        &self,
        looks: &Looks<'_>,
        layers: Range<usize>,
        mut each: impl FnMut(usize, Range<u32>, f64),
    ) {
        let Range { start, end } = self.columns;
        let count = end - start;
        let rises = self.um_per_column > 0.0;
        let height = |k: u32| self.height(if rises { start + k } else { end - 1 - k });
        // Columns from `low` on are not too deep; columns before `high` are not above the section.
        let (mut low, mut high, mut layer) = (0, 0, layers.start);
        while layer < layers.end {
            let (top_um, depths) = (looks.planes.top_um(layer), looks.depths(layer));
            while low < count && top_um - height(low) >= depths.end {
                low += 1;
            }
            if low == count {
                return;
            }
            high = high.max(low);
            while high < count && top_um - height(high) >= depths.start {
                high += 1;
            }
            if low < high {
                let columns = if rises { start + low..start + high } else { end - high..end - low };
                let depth_um = top_um - self.height(columns.start);
                each(layer, columns, depth_um);
                layer += 1;
            } else {
                // No column is in reach, so the sweep jumps to the layer of the next one.
                let low_um = height(low) - looks.tie_um;
                layer = looks.planes.near(low_um, low_um).start.max(layer + 1);
            }
        }
    }

    /// Returns the columns that a layer looks at, and the depth of the first one.
    #[inline]
    fn within(&self, looks: &Looks<'_>, layer: usize) -> Option<(Range<u32>, f64)> {
        let Range { mut start, mut end } = self.columns;
        let (top_um, depths) = (looks.planes.top_um(layer), looks.depths(layer));
        let depth = |column: u32| top_um - self.height(column);
        let first = depth(start);
        let ends = [depths.start, depths.end].map(|depth| (first - depth) / self.um_per_column);
        let [near, far] = if self.um_per_column < 0.0 { ends } else { [ends[1], ends[0]] };
        // One column more on each side for rounding; the loops below are exact.
        let length = f64::from(end - start);
        end = start + (far + 2.0).clamp(0.0, length) as u32;
        start += (near - 1.0).clamp(0.0, length) as u32;
        while start < end && !depths.contains(&depth(start)) {
            start += 1;
        }
        while start < end && !depths.contains(&depth(end - 1)) {
            end -= 1;
        }
        (start < end).then(|| (start..end, depth(start)))
    }
}

/// Holds the data by which layers look at a facet.
pub(super) struct Looks<'a> {
    pub(super) planes: &'a Planes,
    pub(super) reach_um: f64,
    pub(super) tie_um: f64,
}

impl Looks<'_> {
    /// Returns the depths below a layer's top at which it looks at facets: from just above
    /// the section to the end of the exposure.
    #[inline]
    pub(super) fn depths(&self, layer: usize) -> Range<f64> {
        let top_um = self.planes.top_um(layer);
        let end_um = (top_um - self.reach_um).max(self.planes.bottom_um() + STANDING_UM);
        top_um - self.planes.z_um(layer) - self.tie_um..top_um - end_um
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Length;
    use proptest::prelude::*;

    use super::*;
    use crate::gray::Side;
    use crate::planes::{PLANE_TOLERANCE, PlaneRule};

    proptest! {
        #[test]
        fn layers_look_at_the_columns_in_their_depths(
            columns in [0.0..60.0, 0.0..60.0],
            heights in [0.0..900.0, 0.0..900.0],
            is_level in prop::bool::weighted(0.1),
            thickness_um in 10.0..120.0,
            reach_um in 5.0..400.0,
            low in 0usize..4,
        ) {
            let thickness = Length::from_um(thickness_um);
            let planes = Planes::uniform(
                [0.0, 900.0], thickness, PlaneRule::Top, PLANE_TOLERANCE, Side::Both,
            );
            let planes = planes.unwrap();
            let looks = Looks { planes: &planes, reach_um, tie_um: 0.01 };
            let heights = if is_level { [heights[0]; 2] } else { heights };
            let ends = [[columns[0], heights[0]], [columns[1], heights[1]]];
            if let Some(stretch) = RowStretch::new(ends, [0.0, 900.0], 50) {
                let layers = low.min(planes.len() - 1)..planes.len();
                let mut found = Vec::new();
                stretch.for_each_look(&looks, layers.clone(), |layer, columns, depth_um| {
                    found.push((layer, columns, depth_um));
                });
                let expected = layers.filter_map(|layer| {
                    let depth_um = |&column: &u32| planes.top_um(layer) - stretch.height(column);
                    let sees = |column: &u32| looks.depths(layer).contains(&depth_um(column));
                    let seen: Vec<u32> = stretch.columns().filter(sees).collect();
                    let (first, last) = (seen.first()?, seen.last()?);
                    Some((layer, *first..last + 1, depth_um(first)))
                });
                prop_assert_eq!(found, expected.collect::<Vec<_>>());
            }
        }
    }
}
