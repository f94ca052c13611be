//! Cuts facets with planes into segments, and these with rows into crossings.
//!
//! # Why rows are even
//! Both facets on an edge find its point on a plane by the same arithmetic on the
//! same two ends, sorted by z. The segments of a closed mesh on a plane therefore
//! form closed chains, whatever the rounding. Since each of their points is either
//! past a row or not, a chain crosses every row an even number of times. Only the
//! column of a crossing depends on one facet alone.
//!
//! This needs no more than equal results for equal corners (0 equals -0), and an even number of
//! facets on each edge. An edge that is cut has its ends on both sides of the plane. So it rises,
//! however little, and its ends have an order, even if the third corner is as high as one of them.
//! A degenerate facet (without area) that is cut also has two such edges. An overflow would move a
//! point to a row's end, but the same way for both facets.

use std::ops::Range;

use crate::crossing::{Crossing, RowSegment, ShortCrossing};
use crate::cutter::Cutter;
use crate::facet::{PlacedFacet, facet_heights};
use crate::gray::{DepthSpan, Edge, Sheet};
use crate::layer_share::LayerShare;
use crate::scan::{SortedFacet, Z, ceil_clamped};

/// A facet's section with a plane. If the facet faces outward, the part is on the
/// left of the way from start to end, seen from above.
pub(crate) struct Segment {
    pub(crate) ends: [SegmentEnd; 2],
    /// Whether the second end is the start.
    pub(crate) is_reversed: bool,
}

/// An end of a segment.
#[derive(Clone, Copy)]
pub(crate) struct SegmentEnd {
    /// Column and row in pixels.
    pub(crate) at: [f64; 2],
    /// The corners of the facet, 0 to 2, that its edge joins.
    pub(crate) edge: [u8; 2],
}

impl Cutter<'_> {
    /// Adds the crossings of a body's facet in `layers` to the shares of those layers, and returns
    /// the number of crossings that need the same memory. If `needs_no_body`, segments that cross
    /// many rows are kept as segments, and crossings of small images are short. If
    /// `has_gray_edges`, edges are kept, too.
    #[inline]
    pub(crate) fn cut(
        &self,
        facet: &PlacedFacet,
        body: u32,
        needs_no_body: bool,
        has_gray_edges: bool,
        layers: &Range<usize>,
        shares: &mut [LayerShare],
    ) -> usize {
        // The number of crossings that take as much memory as one segment.
        const AS_MUCH: usize = size_of::<RowSegment>() / size_of::<Crossing>();
        let mut count = 0;
        let salt = self.rule.salt(body);
        let is_short = needs_no_body && ShortCrossing::hold(self.grid);
        self.for_each_segment(facet, layers, |layer, segment| {
            let share = &mut shares[layer - layers.start];
            let [a, b] = segment.ends.map(|end| end.at);
            share.ends.add([a, b], salt);
            if has_gray_edges {
                count += size_of::<Edge>() / size_of::<Crossing>();
                share.edges.push(Edge::new([a, b], segment.is_reversed, body));
            }
            let Some(segment) = self.row_segment(a, b, segment.is_reversed) else { return };
            let (rows, crossing) = (segment.rows(), |row| segment.crossing(self.grid, row));
            if needs_no_body && rows.len() > AS_MUCH {
                count += AS_MUCH;
                share.segments.push(segment);
            } else if is_short {
                count += rows.len().div_ceil(2);
                share.short.extend(rows.map(|row| ShortCrossing::new(crossing(row))));
            } else {
                count += rows.len();
                share.of_body(body).extend(rows.map(crossing));
            }
        });
        count
    }

    /// Adds the depths at which the rows of `layers` meet a body's facet below their sections,
    /// within `reach_um`. Returns the number of crossings that need the same memory.
    pub(crate) fn look_down(
        &self,
        facet: &PlacedFacet,
        body: u32,
        reach_um: f64,
        layers: &Range<usize>,
        shares: &mut [LayerShare],
    ) -> usize {
        let (low, high) = facet_heights(facet);
        let met = self.planes.near(low, high + reach_um);
        let met = met.start.max(layers.start)..met.end.min(layers.end);
        if met.is_empty() {
            return 0;
        }
        let Some(sheet) = Sheet::new(self, facet, body) else { return 0 };
        let mut count = 0;
        sheet.for_each_span(self, met, reach_um, |layer, span| {
            shares[layer - layers.start].spans.push(span);
            count += 1;
        });
        count * size_of::<DepthSpan>() / size_of::<Crossing>()
    }

    /// Adds the edges of a body's facet in the contours of `layers`. Returns the number of crossings
    /// that need the same memory.
    pub(crate) fn add_edges(
        &self,
        facet: &PlacedFacet,
        body: u32,
        layers: &Range<usize>,
        shares: &mut [LayerShare],
    ) -> usize {
        let mut count = 0;
        self.for_each_segment(facet, layers, |layer, segment| {
            let ends = segment.ends.map(|end| end.at);
            shares[layer - layers.start].edges.push(Edge::new(ends, segment.is_reversed, body));
            count += 1;
        });
        count * size_of::<Edge>() / size_of::<Crossing>()
    }

    /// Calls `each` with the facet's segments in `layers`, from below.
    #[inline]
    pub(crate) fn for_each_segment(
        &self,
        facet: &PlacedFacet,
        layers: &Range<usize>,
        mut each: impl FnMut(usize, Segment),
    ) {
        let (low, high) = facet_heights(facet);
        // Most facets of an unordered part are in another slab.
        if low >= self.planes.side_um(layers.end - 1) || high < self.planes.side_um(layers.start) {
            return;
        }
        let met = self.planes.between(low, high);
        let met = met.start.max(layers.start)..met.end.min(layers.end);
        if met.is_empty() {
            return;
        }
        let corners = facet.map(|[x, y, z_um]| {
            let [column, row] = self.grid.to_pixels(x, y);
            [column, row, z_um]
        });
        let sorted = SortedFacet::<Z>::new(corners);
        let [low, middle, high] = sorted.order;
        let long = [low, high];
        let short = [[low, middle], [middle, high]];
        let second_z = sorted.corners[1][Z];
        // Most facets meet a single plane, where one comparison replaces the search.
        let second = match met.len() {
            1 => met.start + usize::from(self.planes.side_um(met.start) <= second_z),
            _ => self.planes.at_or_below(second_z),
        };
        sorted.for_each_line(
            met,
            second,
            |layer| self.planes.z_um(layer),
            |layer, [a, b], half| {
                let ends =
                    [SegmentEnd { at: a, edge: long }, SegmentEnd { at: b, edge: short[half] }];
                each(layer, Segment { ends, is_reversed: sorted.is_flipped });
            },
        );
    }

    /// Returns a segment between two points of a plane, in pixels, if it crosses rows.
    #[inline]
    fn row_segment(&self, a: [f64; 2], b: [f64; 2], is_reversed: bool) -> Option<RowSegment> {
        let down = a[1] < b[1];
        let (upper, lower) = if down { (a, b) } else { (b, a) };
        let rising = down != is_reversed;
        let (first, end) = (self.first_row(upper), self.first_row(lower));
        (first < end).then(|| {
            // A row is between the ends, so they differ along y.
            let columns_per_row = (lower[0] - upper[0]) / (lower[1] - upper[1]);
            RowSegment::new(upper, columns_per_row, first..end, rising)
        })
    }

    /// Calls `each` with the row, the column in pixels and the direction of each
    /// crossing of a segment between two points of a plane.
    #[inline]
    pub(crate) fn for_each_crossing(
        &self,
        a: [f64; 2],
        b: [f64; 2],
        is_reversed: bool,
        mut each: impl FnMut(u32, f64, bool),
    ) {
        let Some(segment) = self.row_segment(a, b, is_reversed) else { return };
        segment.rows().for_each(|row| each(row, segment.column(row), segment.is_rising()));
    }

    /// Returns the first row whose center is at or below a point in pixels.
    #[inline]
    pub(crate) fn first_row(&self, point: [f64; 2]) -> u32 {
        ceil_clamped(point[1], self.grid.height)
    }
}
