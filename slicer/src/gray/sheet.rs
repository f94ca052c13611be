//! A facet as part of a sheet that vertical lines meet.

use std::ops::Range;

use crate::cut::{Cutter, ceil_clamped};
use crate::placement::{PlacedFacet, heights};

/// Closer than this to a layer's plane, and to each other, facets are taken to
/// touch: far more than rounding, far less than anything cures.
const TOUCHING_UM: f64 = 1e-3;

/// The same sideways: a facet is met as if a pixel's centre could be this far
/// off.
const ASIDE_PIXELS: f64 = 1e-6;

/// What a row's vertical lines meet of a facet below a section: columns from
/// `start` to `end`, at depths along a straight line.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(crate) struct Span {
    pub(crate) row: u32,
    pub(crate) start: u32,
    pub(crate) end: u32,
    /// Below the layer's top, at the first column.
    depth_um: f32,
    um_per_column: f32,
    /// How far from the plane it may be on its other side, by rounding. Below
    /// zero where going down enters the part.
    signed_tie_um: f32,
}

impl Span {
    /// The depth below the layer's top at a column.
    #[inline]
    pub(crate) fn depth_um(&self, column: u32) -> f64 {
        f64::from(self.depth_um) + f64::from(self.um_per_column) * f64::from(column - self.start)
    }

    /// What a line that goes down through it loses: +1 or -1 of the winding
    /// number.
    #[inline]
    pub(crate) fn winding(&self) -> i32 {
        if self.signed_tie_um < 0.0 { -1 } else { 1 }
    }

    /// How far from another facet it counts as touching.
    #[inline]
    pub(crate) fn tie_um(&self) -> f64 {
        f64::from(self.signed_tie_um.abs())
    }

    /// The level that its depth has along all of its columns, where it has one.
    #[inline]
    pub(crate) fn is_level(&self) -> bool {
        self.um_per_column == 0.0
    }
}

/// A facet seen from above: x and y in pixels, z in micrometres.
pub(crate) struct Sheet {
    /// From the top row down.
    corners: [[f64; 3]; 3],
    /// From the first corner to the last, to the middle one, and from there.
    edges: [Edge; 3],
    /// The rows that it crosses, and among them the first past the middle.
    rows: Range<u32>,
    turn: u32,
    low_um: f64,
    high_um: f64,
    tie_um: f64,
    winding: i32,
}

/// An edge seen from above, from its upper row to its lower.
#[derive(Clone, Copy)]
struct Edge {
    upper: [f64; 3],
    /// Columns and micrometres for each row.
    slopes: [f64; 2],
}

impl Edge {
    fn new(upper: [f64; 3], lower: [f64; 3]) -> Self {
        let fall = lower[1] - upper[1];
        Self { upper, slopes: [(lower[0] - upper[0]) / fall, (lower[2] - upper[2]) / fall] }
    }

    /// The column where it crosses a row.
    #[inline]
    fn column(&self, row: u32) -> f64 {
        self.upper[0] + self.slopes[0] * (f64::from(row) - self.upper[1])
    }

    /// The height where it crosses a row, in micrometres.
    #[inline]
    fn height(&self, row: u32) -> f64 {
        self.upper[2] + self.slopes[1] * (f64::from(row) - self.upper[1])
    }
}

impl Sheet {
    /// A facet as vertical lines see it, where they can meet it.
    pub(crate) fn new(cutter: &Cutter<'_>, facet: &PlacedFacet) -> Option<Self> {
        let mut corners = facet.map(|[x, y, z_um]| {
            let [column, row] = cutter.grid.to_pixels(x, y);
            [column, row, z_um]
        });
        let [a, b, c] = corners;
        let [u, v] = [b, c].map(|to| [0, 1, 2].map(|axis| to[axis] - a[axis]));
        let cross = |i: usize, j: usize| u[i] * v[j] - u[j] * v[i];
        let area = cross(0, 1);
        if area == 0.0 {
            return None;
        }
        let um_per_pixel = (cross(1, 2).abs() + cross(2, 0).abs()) / area.abs();
        corners.sort_unstable_by(|a, b| a[1].total_cmp(&b[1]));
        let [upper, middle, lower] = corners;
        let [first, turn, end] = corners.map(|[column, row, _]| cutter.first_row([column, row]));
        if first == end {
            return None;
        }
        let (low_um, high_um) = heights(facet);
        Some(Self {
            corners,
            edges: [(upper, lower), (upper, middle), (middle, lower)].map(|(a, b)| Edge::new(a, b)),
            rows: first..end,
            turn,
            low_um,
            high_um,
            tie_um: TOUCHING_UM + ASIDE_PIXELS * um_per_pixel.min(1e6),
            // Rows count downwards: facets that face down turn clockwise in y.
            winding: if area > 0.0 { 1 } else { -1 },
        })
    }

    /// Gives what the rows of a layer meet of it, from just above the section to
    /// where the exposure ends.
    pub(crate) fn for_each_span(
        &self,
        cutter: &Cutter<'_>,
        layer: usize,
        reach_um: f64,
        mut each: impl FnMut(Span),
    ) {
        let planes = cutter.planes;
        let (plane_um, top_um) = (planes.z_um(layer), planes.top_um(layer));
        // A vertex on the plane is above it.
        if self.low_um >= plane_um {
            return;
        }
        // What reaches the part's lowest point stands on the platform.
        let end_um = (top_um - reach_um).max(planes.bottom_um());
        let depths = top_um - plane_um - self.tie_um..top_um - end_um;
        for row in self.rows_between(end_um, plane_um + self.tie_um) {
            if let Some(span) = self.span(row, top_um, &depths, cutter.grid.width) {
                each(span);
            }
        }
    }

    /// The rows of what lies between two heights, and perhaps one more on each
    /// side.
    fn rows_between(&self, low_um: f64, high_um: f64) -> Range<u32> {
        let (mut first, mut last) = (f64::MAX, f64::MIN);
        let mut reach = |row: f64| (first, last) = (first.min(row), last.max(row));
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (self.corners[from], self.corners[to]);
            if (low_um..=high_um).contains(&a[2]) {
                reach(a[1]);
            }
            for z_um in [low_um, high_um] {
                if (a[2] < z_um) != (b[2] < z_um) {
                    reach(a[1] + (b[1] - a[1]) * ((z_um - a[2]) / (b[2] - a[2])));
                }
            }
        }
        let Range { start, end } = self.rows;
        ceil_clamped(first - 0.5, end).max(start)..ceil_clamped(last + 0.5, end)
    }

    /// What a row meets of it at depths from the first, up to before the
    /// second.
    fn span(&self, row: u32, top_um: f64, depths: &Range<f64>, width: u32) -> Option<Span> {
        let [long, first, second] = &self.edges;
        let short = if row < self.turn { first } else { second };
        let columns = [long.column(row), short.column(row)];
        let [a, b] = columns.map(|column| ceil_clamped(column, width));
        if a == b {
            return None;
        }
        // Along the row from edge to edge, rounding never leaves the facet.
        let [left, right] = if a < b { [0, 1] } else { [1, 0] };
        let heights = [long.height(row), short.height(row)];
        let um_per_column = (heights[left] - heights[right]) / (columns[right] - columns[left]);
        let depth_at = |column: u32| {
            let across = f64::from(column) - columns[left];
            let depth = top_um - heights[left] + um_per_column * across;
            depth.clamp(top_um - self.high_um, top_um - self.low_um)
        };
        let (start, end) = within(a.min(b)..a.max(b), depth_at, um_per_column, depths)?;
        Some(Span {
            row,
            start,
            end,
            depth_um: depth_at(start) as f32,
            um_per_column: um_per_column as f32,
            signed_tie_um: (f64::from(self.winding) * self.tie_um) as f32,
        })
    }
}

/// The columns where depths along a straight line are in a range.
fn within(
    columns: Range<u32>,
    depth_at: impl Fn(u32) -> f64,
    um_per_column: f64,
    depths: &Range<f64>,
) -> Option<(u32, u32)> {
    let Range { mut start, mut end } = columns;
    // Most facets are a few columns wide.
    if um_per_column != 0.0 && end - start > 4 {
        let first = depth_at(start);
        let ends = [depths.start, depths.end].map(|depth| (depth - first) / um_per_column);
        let [near, far] = if um_per_column > 0.0 { ends } else { [ends[1], ends[0]] };
        // A column more on each side, to be sure; the loops below are exact.
        let length = f64::from(end - start);
        end = start + (far + 2.0).clamp(0.0, length) as u32;
        start += (near - 1.0).clamp(0.0, length) as u32;
    }
    while start < end && !depths.contains(&depth_at(start)) {
        start += 1;
    }
    while start < end && !depths.contains(&depth_at(end - 1)) {
        end -= 1;
    }
    (start < end).then_some((start, end))
}
