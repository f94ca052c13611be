//! Cuts facets with planes into segments, and these with rows into crossings.
//!
//! # Why rows are even
//! Both facets on an edge find its point on a plane by the same arithmetic on the
//! same two ends, sorted by z. The segments of a closed mesh on a plane therefore
//! form closed chains, whatever the rounding. Since each of their points is either
//! past a row or not, a chain crosses every row an even number of times. Only the
//! column of a crossing depends on one facet alone.
//!
//! This needs no more than equal results for equal corners (0 equals -0), and an
//! even number of facets on each edge. An edge that is cut has its ends on both
//! sides of the plane. So it rises, however little, and its ends have an order,
//! even if the third corner is as high as one of them. A facet without area that
//! is cut has two such edges, too. An overflow would move a point to a row's end,
//! but the same way for both facets.

use std::iter;
use std::ops::Range;

use crate::bodies::{FillRule, Turn};
use crate::closure::EndSum;
use crate::facet::{PlacedFacet, facet_heights};
use crate::gray::{DepthSpan, Sheet};
use crate::grid::PixelGrid;
use crate::planes::Planes;
use crate::scan::{SortedFacet, Z, ceil_clamped};

/// A crossing of a row in 64 bits: the row, the first column whose centre is past the
/// crossing, and in the lowest bit the direction of the contour. Sorted, crossings
/// are in the order of rows and columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Crossing(u64);

impl Crossing {
    #[inline]
    fn new(row: u32, column: u32, rising: bool) -> Self {
        Self(u64::from(row) << 32 | u64::from(column) << 1 | u64::from(rising))
    }

    /// Creates the crossing of a row at a column in pixels. The last column is black:
    /// rounding takes no crossing past it.
    #[inline]
    pub(crate) fn at(grid: &PixelGrid, row: u32, column: f64, rising: bool) -> Self {
        Self::new(row, ceil_clamped(column, grid.width - 1), rising)
    }

    /// Returns the crossing in the other direction.
    pub(crate) fn reversed(self) -> Self {
        Self(self.0 ^ 1)
    }

    #[inline]
    pub(crate) fn row(self) -> usize {
        (self.0 >> 32) as usize
    }

    /// Returns the column and direction.
    #[inline]
    pub(crate) fn in_row(self) -> RowCrossing {
        RowCrossing(self.0 as u32)
    }
}

/// A crossing in 32 bits, for small images: the row, and the column and direction below it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ShortCrossing(u32);

impl ShortCrossing {
    /// Returns whether all crossings of an image can be short.
    fn hold(grid: &PixelGrid) -> bool {
        grid.height <= 1 << 16 && grid.width <= 1 << 15
    }

    #[inline]
    fn new(crossing: Crossing) -> Self {
        Self((crossing.0 >> 16) as u32 | crossing.0 as u32)
    }

    #[inline]
    pub(crate) fn row(self) -> usize {
        (self.0 >> 16) as usize
    }

    /// Returns the column and direction.
    #[inline]
    pub(crate) fn in_row(self) -> RowCrossing {
        RowCrossing(self.0 & 0xFFFF)
    }
}

/// A crossing in its row: column and direction in 32 bits, to sort by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct RowCrossing(u32);

impl RowCrossing {
    #[inline]
    pub(crate) fn column(self) -> u32 {
        self.0 >> 1
    }

    /// Returns the step of the winding number, +1 or -1.
    #[inline]
    pub(crate) fn winding(self) -> i32 {
        (self.0 & 1) as i32 * 2 - 1
    }
}

/// A crossing in its row and the body that it is of, to sort by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct BodyCrossing {
    place: RowCrossing,
    body: u32,
}

impl BodyCrossing {
    #[inline]
    pub(crate) fn new(body: u32, place: RowCrossing) -> Self {
        Self { place, body }
    }
}

/// What a row's images are made of.
pub(crate) trait InRow: Copy + Default + Ord {
    /// Returns the first column past it.
    fn column(self) -> u32;

    /// Returns the step of the winding number.
    fn turn(self) -> Turn;
}

impl InRow for RowCrossing {
    #[inline]
    fn column(self) -> u32 {
        self.column()
    }

    #[inline]
    fn turn(self) -> Turn {
        Turn::new(0, self.winding())
    }
}

impl InRow for BodyCrossing {
    #[inline]
    fn column(self) -> u32 {
        self.place.column()
    }

    #[inline]
    fn turn(self) -> Turn {
        Turn::new(self.body, self.place.winding())
    }
}

/// Cuts facets into segments, and these into crossings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cutter<'a> {
    pub(crate) grid: &'a PixelGrid,
    pub(crate) planes: &'a Planes,
    pub(crate) rule: &'a FillRule,
}

impl<'a> Cutter<'a> {
    /// Returns the cutter of a body.
    pub(crate) fn of_body(self, body: u32) -> Self {
        Self { planes: self.planes.of_body(body), ..self }
    }
}

/// A segment that crosses rows.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RowSegment {
    /// The column and row of its upper end, in pixels.
    upper: [f64; 2],
    columns_per_row: f64,
    first: u32,
    /// The row after the last, times two, and whether the contour rises.
    end_and_rising: u32,
}

impl RowSegment {
    /// Returns the rows that it crosses.
    #[inline]
    pub(crate) fn rows(&self) -> Range<u32> {
        self.first..self.end_and_rising >> 1
    }

    /// Returns the column in pixels at which it crosses a row.
    #[inline]
    fn column(&self, row: u32) -> f64 {
        self.upper[0] + self.columns_per_row * (f64::from(row) - self.upper[1])
    }

    /// Returns which of so many equal strips of an image, from the left, holds its middle.
    #[inline]
    pub(crate) fn bin(&self, grid: &PixelGrid, bins: usize) -> usize {
        let middle = self.upper[0] + self.columns_per_row * (0.5 * self.rows().len() as f64);
        let bin = middle * (bins as f64 / f64::from(grid.width));
        ceil_clamped(bin, bins as u32 - 1) as usize
    }

    #[inline]
    fn is_rising(&self) -> bool {
        self.end_and_rising & 1 == 1
    }

    /// Returns its crossing of a row.
    #[inline]
    pub(crate) fn crossing(&self, grid: &PixelGrid, row: u32) -> Crossing {
        Crossing::at(grid, row, self.column(row), self.is_rising())
    }
}

/// The share of a layer that one worker finds.
#[derive(Debug, Default)]
pub(crate) struct LayerShare {
    crossings: Vec<Crossing>,
    /// Crossings of small images, where they need not be known by body.
    pub(crate) short: Vec<ShortCrossing>,
    /// Segments whose crossings would take more memory, where crossings need not be known by body.
    pub(crate) segments: Vec<RowSegment>,
    /// From which crossing on they are of which body; those before are of body 0.
    bodies: Vec<(u32, u32)>,
    /// Crossings of B-rep facets near which no point of the surface was found, and their
    /// bodies.
    pub(crate) kept: Vec<(u32, Crossing)>,
    pub(crate) ends: EndSum,
    /// Facets below the section, for gray layers.
    pub(crate) spans: Vec<DepthSpan>,
}

impl LayerShare {
    /// Empties the lists, which keep their memory.
    pub(crate) fn clear(&mut self) {
        self.crossings.clear();
        self.short.clear();
        self.segments.clear();
        self.bodies.clear();
        self.kept.clear();
        self.spans.clear();
        self.ends = EndSum::default();
    }

    /// Returns the crossings, to which those of a body are to be added.
    #[inline]
    pub(crate) fn of_body(&mut self, body: u32) -> &mut Vec<Crossing> {
        if self.bodies.last().map_or(0, |&(_, last)| last) != body {
            self.bodies.push((self.crossings.len() as u32, body));
        }
        &mut self.crossings
    }

    /// Returns all crossings but short ones and those of segments.
    pub(crate) fn crossings(&self) -> &[Crossing] {
        &self.crossings
    }

    /// Returns the crossings by body; a body may come several times.
    pub(crate) fn by_body(&self) -> impl Iterator<Item = (u32, &[Crossing])> {
        let starts = iter::once((0, 0)).chain(self.bodies.iter().copied());
        let ends = self.bodies.iter().map(|&(start, _)| start);
        let ends = ends.chain(iter::once(self.crossings.len() as u32));
        let part = |(start, end)| &self.crossings[start as usize..end as usize];
        starts.zip(ends).map(move |((start, body), end)| (body, part((start, end))))
    }
}

/// A facet's section with a plane. If the facet faces outwards, the part is on the
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
    /// the number of crossings that take as much memory. Segments that cross many rows are kept
    /// as such, and crossings of small images are short, if `needs_no_body`.
    #[inline]
    pub(crate) fn cut(
        &self,
        facet: &PlacedFacet,
        body: u32,
        needs_no_body: bool,
        layers: &Range<usize>,
        shares: &mut [LayerShare],
    ) -> usize {
        const AS_MUCH: usize = size_of::<RowSegment>() / size_of::<Crossing>();
        let mut count = 0;
        let salt = self.rule.salt(body);
        let is_short = needs_no_body && ShortCrossing::hold(self.grid);
        self.for_each_segment(facet, layers, |layer, segment| {
            let share = &mut shares[layer - layers.start];
            let [a, b] = segment.ends.map(|end| end.at);
            share.ends.add([a, b], salt);
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
    /// within `reach_um`. Returns the number of crossings that take as much memory.
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

    /// Calls `each` with the facet's segments in `layers`, from below.
    #[inline]
    pub(crate) fn for_each_segment(
        &self,
        facet: &PlacedFacet,
        layers: &Range<usize>,
        mut each: impl FnMut(usize, Segment),
    ) {
        let (low, high) = facet_heights(facet);
        // Most facets of a part in no order lie in another slab.
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
            let columns_per_row = (lower[0] - upper[0]) / (lower[1] - upper[1]);
            // Rows are below 2^31.
            let end_and_rising = end << 1 | u32::from(rising);
            RowSegment { upper, columns_per_row, first, end_and_rising }
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

    /// Returns the first row whose centre is at or below a point in pixels.
    #[inline]
    pub(crate) fn first_row(&self, point: [f64; 2]) -> u32 {
        ceil_clamped(point[1], self.grid.height)
    }
}
