//! A facet's lines along the rows of the image.
//!
//! As in the slicer, both facets on an edge find its point on a row by the same
//! arithmetic on the same two ends, so that a closed mesh makes closed chains.

use lamp_slicer::PlacedFacet;

use crate::row::{Slope, Toggle};

/// Rows of the image: x in millimetres, and y in rows, downwards.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rows {
    pub(crate) top_mm: f64,
    pub(crate) pitch_mm: f64,
    pub(crate) count: u32,
}

/// x in millimetres, y in rows, z in micrometres.
type Corner = [f64; 3];

/// An edge from its upper to its lower row.
#[derive(Clone, Copy)]
struct Edge {
    upper: Corner,
    per_row: [f64; 2],
}

impl Edge {
    fn new(upper: Corner, lower: Corner) -> Self {
        let rows = lower[1] - upper[1];
        Self { upper, per_row: [(lower[0] - upper[0]) / rows, (lower[2] - upper[2]) / rows] }
    }

    /// Where it crosses a row: x and z.
    #[inline]
    fn at(&self, row: u32) -> [f64; 2] {
        let below = f64::from(row) - self.upper[1];
        [self.upper[0] + self.per_row[0] * below, self.upper[2] + self.per_row[1] * below]
    }
}

/// The least whole number that is not below `value`, between 0 and `most`.
#[inline]
fn ceil_clamped(value: f64, most: u32) -> u32 {
    // Casts saturate, and cost less than rounding.
    let whole = value as i32;
    let ceiling = whole.saturating_add(i32::from(f64::from(whole) < value));
    ceiling.clamp(0, most as i32) as u32
}

/// A facet as rows meet it.
#[derive(Clone, Copy)]
pub(crate) struct RowFacet {
    /// From the top row down.
    corners: [Corner; 3],
    /// The rows that it crosses, and among them the first past the middle corner.
    rows: [u32; 3],
    turned: bool,
}

impl RowFacet {
    /// A facet that crosses some row.
    pub(crate) fn new(facet: &PlacedFacet, rows: &Rows) -> Option<Self> {
        let mut corners =
            facet.map(|[x, y, z_um]| [x, (rows.top_mm - y) / rows.pitch_mm - 0.5, z_um]);
        let mut turned = false;
        let mut order = |i: usize, j: usize| {
            if corners[j][1] < corners[i][1] {
                corners.swap(i, j);
                turned = !turned;
            }
        };
        order(0, 1);
        order(1, 2);
        order(0, 1);
        let rows = corners.map(|corner| ceil_clamped(corner[1], rows.count));
        (rows[0] < rows[2]).then_some(Self { corners, rows, turned })
    }

    /// The first row that it crosses, and the first that it does not any more.
    pub(crate) fn rows(&self) -> [u32; 2] {
        [self.rows[0], self.rows[2]]
    }

    /// Adds what some rows see of it between two heights (micrometres).
    pub(crate) fn cut(&self, rows: [u32; 2], z: [f64; 2], cuts: &mut Cuts) {
        let [upper, middle, lower] = self.corners;
        let long = Edge::new(upper, lower);
        let [first, end] = self.rows_between(z);
        let [first, turn, end] = [first.max(rows[0]), self.rows[1], end.min(rows[1])];
        let halves = [(upper, middle, first, end.min(turn)), (middle, lower, first.max(turn), end)];
        for (from, to, first, end) in halves {
            if first < end {
                let short = Edge::new(from, to);
                for row in first..end {
                    cuts.add(row, long.at(row), short.at(row), self.turned, z);
                }
            }
        }
    }

    /// The rows of what lies between two heights, and perhaps one more on each
    /// side, where rounding could decide.
    fn rows_between(&self, z: [f64; 2]) -> [u32; 2] {
        let (mut first, mut last) = (f64::MAX, f64::MIN);
        let mut reach = |row: f64| (first, last) = (first.min(row), last.max(row));
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (self.corners[from], self.corners[to]);
            if (z[0]..=z[1]).contains(&a[2]) {
                reach(a[1]);
            }
            for z in z {
                if (a[2] < z) != (b[2] < z) {
                    reach(a[1] + (b[1] - a[1]) * ((z - a[2]) / (b[2] - a[2])));
                }
            }
        }
        let within = |row: f64| ceil_clamped(row, self.rows[2]).max(self.rows[0]);
        [within(first - 1e-3), within(last + 1e-3)]
    }
}

/// What rows see of facets.
#[derive(Debug, Default)]
pub(crate) struct Cuts {
    pub(crate) toggles: Vec<Toggle>,
    pub(crate) slopes: Vec<Slope>,
}

impl Cuts {
    /// Adds a facet's line in a row, between its long and one of its short edges.
    #[inline]
    fn add(&mut self, row: u32, long: [f64; 2], short: [f64; 2], turned: bool, z: [f64; 2]) {
        let [bottom, top] = z;
        let (mut low, mut high) = if long[1] <= short[1] { (long, short) } else { (short, long) };
        // A corner on the layer's bottom counts as below it.
        if high[1] <= bottom || low[1] > top {
            return;
        }
        // Along the line from start to end, as the facet faces outwards, the part
        // is on the left, where z is up and x to the right.
        let (start, end) = if turned { (short, long) } else { (long, short) };
        let [from, to] = [low, high];
        let per_um = (to[0] - from[0]) / (to[1] - from[1]);
        let at = |z: f64| [from[0] + per_um * (z - from[1]), z];
        if from[1] <= bottom {
            low = at(bottom);
            let winding = if start[1] > end[1] { 1 } else { -1 };
            self.toggles.push(Toggle { row, x: low[0], winding });
        }
        if to[1] > top {
            high = at(top);
        }
        if low[0] != high[0] {
            let (left, right) = if low[0] < high[0] { (low, high) } else { (high, low) };
            let winding = if start[0] < end[0] { 1 } else { -1 };
            let heights = [left[1] - bottom, right[1] - bottom];
            self.slopes.push(Slope { row, x: [left[0], right[0]], heights, winding });
        }
    }
}
