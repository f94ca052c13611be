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
    corners: [[f64; 3]; 3],
    edges: [Edge; 3],
    low_um: f64,
    high_um: f64,
    tie_um: f64,
    winding: i32,
}

/// An edge seen from above, from its first row to its last.
#[derive(Clone, Copy)]
struct Edge {
    upper: [f64; 3],
    /// Columns and micrometres for each row.
    slopes: [f64; 2],
    rows: [u32; 2],
}

impl Edge {
    fn new(cutter: &Cutter<'_>, a: [f64; 3], b: [f64; 3]) -> Self {
        let (upper, lower) = if a[1] < b[1] { (a, b) } else { (b, a) };
        let fall = lower[1] - upper[1];
        Self {
            upper,
            slopes: [(lower[0] - upper[0]) / fall, (lower[2] - upper[2]) / fall],
            rows: [upper, lower].map(|end| cutter.first_row([end[0], end[1]])),
        }
    }

    fn crosses(&self, row: u32) -> bool {
        (self.rows[0]..self.rows[1]).contains(&row)
    }

    /// Column and height where it crosses a row.
    #[inline]
    fn at(&self, row: u32) -> [f64; 2] {
        let below = f64::from(row) - self.upper[1];
        [self.upper[0] + self.slopes[0] * below, self.upper[2] + self.slopes[1] * below]
    }
}

impl Sheet {
    /// A facet as vertical lines see it, where they can meet it.
    pub(crate) fn new(cutter: &Cutter<'_>, facet: &PlacedFacet) -> Option<Self> {
        let corners = facet.map(|[x, y, z_um]| {
            let [column, row] = cutter.grid.to_pixels(x, y);
            [column, row, z_um]
        });
        let [a, b, c] = corners;
        let edges = [[a, b], [b, c], [c, a]].map(|[a, b]| Edge::new(cutter, a, b));
        if edges.iter().all(|edge| edge.rows[0] == edge.rows[1]) {
            return None;
        }
        let [u, v] = [b, c].map(|to| [0, 1, 2].map(|axis| to[axis] - a[axis]));
        let cross = |i: usize, j: usize| u[i] * v[j] - u[j] * v[i];
        let area = cross(0, 1);
        if area == 0.0 {
            return None;
        }
        let um_per_pixel = (cross(1, 2).abs() + cross(2, 0).abs()) / area.abs();
        let (low_um, high_um) = heights(facet);
        Some(Self {
            corners,
            edges,
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
        for row in self.rows_between(cutter, end_um, plane_um + self.tie_um) {
            if let Some(span) = self.span(row, top_um, &depths, cutter.grid.width) {
                each(span);
            }
        }
    }

    /// The rows of what lies between two heights, and perhaps one more on each
    /// side.
    fn rows_between(&self, cutter: &Cutter<'_>, low_um: f64, high_um: f64) -> Range<u32> {
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
        let height = cutter.grid.height;
        ceil_clamped(first - 0.5, height)..ceil_clamped(last + 0.5, height)
    }

    /// What a row meets of it at depths from the first, up to before the
    /// second.
    fn span(&self, row: u32, top_um: f64, depths: &Range<f64>, width: u32) -> Option<Span> {
        let mut crossed = self.edges.iter().filter(|edge| edge.crosses(row));
        let [a, b] = [crossed.next()?, crossed.next()?].map(|edge| edge.at(row));
        let [left, right] = if a[0] <= b[0] { [a, b] } else { [b, a] };
        let [start, end] = [left, right].map(|end| ceil_clamped(end[0], width));
        if start >= end {
            return None;
        }
        // Along the row from edge to edge, rounding never leaves the facet.
        let um_per_column = (left[1] - right[1]) / (right[0] - left[0]);
        let depth_at = |column: u32| {
            let depth = top_um - left[1] + um_per_column * (f64::from(column) - left[0]);
            depth.clamp(top_um - self.high_um, top_um - self.low_um)
        };
        let (start, end) = within(start..end, depth_at, um_per_column, depths)?;
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
    if um_per_column != 0.0 {
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
