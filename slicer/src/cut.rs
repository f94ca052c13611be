//! A facet's crossings with planes and rows.
//!
//! Both facets on an edge find its point on a plane by the same arithmetic on
//! the same two endpoints, ordered by z. The points of a closed mesh on a
//! plane therefore form closed chains, whatever the rounding; and since a
//! point is past a row or it is not, every row is crossed an even number of
//! times. Only the column of a crossing depends on one facet alone.
//!
//! That takes no more than equal corners (0 equals -0) coming out equal, and an
//! even number of facets on each edge. An edge that is cut has its ends on both
//! sides of the plane, so it rises, however little, and its ends have an order,
//! whatever third corner ties with them. A facet without area that is cut has
//! two edges, too. An overflow would move a point to a row's end, the same for
//! both facets.

use std::ops::Range;

use crate::closure::EndSum;
use crate::gray::{DepthSpan, Sheet};
use crate::grid::PixelGrid;
use crate::placement::{PlacedFacet, facet_heights};
use crate::planes::Planes;
use crate::scan::{SortedFacet, Z, ceil_clamped};
use crate::table::Fill;

/// A crossing of a row: the row in the high half; in the low half the first
/// column whose centre is past it, and in the lowest bit the direction in
/// which the contour crosses. Sorting orders crossings along a layer's rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Crossing(u64);

impl Crossing {
    #[inline]
    fn new(row: u32, column: u32, rising: bool) -> Self {
        Self(u64::from(row) << 32 | u64::from(column) << 1 | u64::from(rising))
    }

    /// That of a row at a column in pixels. The last column is black: rounding takes
    /// no crossing past it.
    #[inline]
    pub(crate) fn at(grid: &PixelGrid, row: u32, column: f64, rising: bool) -> Self {
        Self::new(row, ceil_clamped(column, grid.width - 1), rising)
    }

    /// The other way round.
    pub(crate) fn reversed(self) -> Self {
        Self(self.0 ^ 1)
    }

    #[inline]
    pub(crate) fn row(self) -> usize {
        (self.0 >> 32) as usize
    }

    /// Column and direction in one, to sort by.
    #[inline]
    pub(crate) fn in_row(self) -> RowCrossing {
        RowCrossing(self.0 as u32)
    }
}

/// Where in its row a crossing is, and in which direction the contour goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct RowCrossing(u32);

impl RowCrossing {
    #[inline]
    pub(crate) fn column(self) -> u32 {
        self.0 >> 1
    }

    /// +1 or -1.
    #[inline]
    pub(crate) fn winding(self) -> i32 {
        (self.0 & 1) as i32 * 2 - 1
    }
}

/// Cuts facets into segments, and these into crossings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cutter<'a> {
    pub(crate) grid: &'a PixelGrid,
    pub(crate) planes: &'a Planes,
    pub(crate) fill: Fill,
}

/// What a worker finds of a layer.
#[derive(Debug, Default)]
pub(crate) struct LayerShare {
    pub(crate) crossings: Vec<Crossing>,
    /// Those of B-rep facets for which no point of the surface was found.
    pub(crate) kept: Vec<Crossing>,
    pub(crate) ends: EndSum,
    /// What lies below the section, for gray layers.
    pub(crate) spans: Vec<DepthSpan>,
}

impl LayerShare {
    /// Empties it; the lists keep their memory.
    pub(crate) fn clear(&mut self) {
        self.crossings.clear();
        self.kept.clear();
        self.spans.clear();
        self.ends = EndSum::default();
    }
}

/// A facet's section with a plane. Where the facet faces outwards, and the
/// segment goes from its start to its end, the part is on its left, as seen
/// from above.
pub(crate) struct Segment {
    pub(crate) ends: [SegmentEnd; 2],
    /// Whether the second end is the start.
    pub(crate) turned: bool,
}

/// An end of a segment.
#[derive(Clone, Copy)]
pub(crate) struct SegmentEnd {
    /// In pixels.
    pub(crate) at: [f64; 2],
    /// Which corners of the facet its edge joins.
    pub(crate) edge: [u8; 2],
}

impl Cutter<'_> {
    /// Adds the facet's crossings in `layers` to the shares of those layers,
    /// and says how many there are.
    #[inline]
    pub(crate) fn cut(
        &self,
        facet: &PlacedFacet,
        layers: &Range<usize>,
        shares: &mut [LayerShare],
    ) -> usize {
        let mut count = 0;
        self.for_each_segment(facet, layers, |layer, segment| {
            let share = &mut shares[layer - layers.start];
            let [a, b] = segment.ends.map(|end| end.at);
            share.ends.add(a, b, segment.turned, self.fill);
            count += self.cross_rows(a, b, segment.turned, &mut share.crossings);
        });
        count
    }

    /// Adds what the rows of `layers` meet of the facet below their sections, as
    /// deep as they are exposed, and says how many crossings would take as much
    /// memory.
    pub(crate) fn look_down(
        &self,
        facet: &PlacedFacet,
        reach_um: f64,
        layers: &Range<usize>,
        shares: &mut [LayerShare],
    ) -> usize {
        let (low, high) = facet_heights(facet);
        let met = self.planes.between(low, high + reach_um);
        let met = met.start.max(layers.start)..met.end.min(layers.end);
        if met.is_empty() {
            return 0;
        }
        let Some(sheet) = Sheet::new(self, facet) else { return 0 };
        let mut count = 0;
        sheet.for_each_span(self, met, reach_um, |layer, span| {
            shares[layer - layers.start].spans.push(span);
            count += 1;
        });
        count * size_of::<DepthSpan>() / size_of::<Crossing>()
    }

    /// Gives the facet's segments in `layers`, from below.
    #[inline]
    pub(crate) fn for_each_segment(
        &self,
        facet: &PlacedFacet,
        layers: &Range<usize>,
        mut each: impl FnMut(usize, Segment),
    ) {
        let (low, high) = facet_heights(facet);
        // Most facets of a part in no order lie in another slab.
        if low >= self.planes.z_um(layers.end - 1) || high < self.planes.z_um(layers.start) {
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
        let second = self.planes.at_or_below(sorted.corners[1][Z]);
        sorted.for_each_line(
            met,
            second,
            |layer| self.planes.z_um(layer),
            |layer, [a, b], half| {
                let ends =
                    [SegmentEnd { at: a, edge: long }, SegmentEnd { at: b, edge: short[half] }];
                each(layer, Segment { ends, turned: sorted.is_flipped });
            },
        );
    }

    /// Adds the crossings of rows with a segment between two points of a
    /// plane, in pixels.
    #[inline]
    fn cross_rows(
        &self,
        a: [f64; 2],
        b: [f64; 2],
        turned: bool,
        list: &mut Vec<Crossing>,
    ) -> usize {
        let before = list.len();
        self.for_each_crossing(a, b, turned, |row, column, rising| {
            list.push(Crossing::at(self.grid, row, column, rising));
        });
        list.len() - before
    }

    /// Gives where a segment between two points of a plane crosses rows: the row,
    /// the column in pixels and the direction.
    #[inline]
    pub(crate) fn for_each_crossing(
        &self,
        a: [f64; 2],
        b: [f64; 2],
        turned: bool,
        mut each: impl FnMut(u32, f64, bool),
    ) {
        let down = a[1] < b[1];
        let (upper, lower) = if down { (a, b) } else { (b, a) };
        let rising = down != turned;
        let (first, end) = (self.first_row(upper), self.first_row(lower));
        if first >= end {
            return;
        }
        let slope = (lower[0] - upper[0]) / (lower[1] - upper[1]);
        for row in first..end {
            each(row, upper[0] + slope * (f64::from(row) - upper[1]), rising);
        }
    }

    /// The first row that a point in pixels is past: whose centre is at or
    /// below it.
    #[inline]
    pub(crate) fn first_row(&self, point: [f64; 2]) -> u32 {
        ceil_clamped(point[1], self.grid.height)
    }
}
