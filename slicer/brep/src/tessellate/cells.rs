//! Scales parameters to a plane of cells in which a surface bends about equally both ways.

use spade::Point2;

use super::points::FaceNode;
use crate::geometry::Surface;
use crate::vector::{Vec3, along, distance, dot, length, middle, sub, unit};

/// The greatest ratio of a cell's length to its width. A cylinder is straight along its axis, so
/// its facets would otherwise be as long as the cylinder.
const LONGEST: f64 = 1000.0;

/// The map from parameters to the plane of the triangulation.
pub(super) struct CellScale {
    low: [f64; 2],
    /// The number of cells per unit of each parameter.
    cells: [f64; 2],
    /// The number of cells along each parameter.
    pub(super) count: [f64; 2],
}

impl CellScale {
    pub(super) fn new(surface: &Surface, polygons: &[Vec<FaceNode>], chord_mm: f64) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for node in polygons.iter().flatten() {
            for k in 0..2 {
                low[k] = low[k].min(node.uv[k]);
                high[k] = high[k].max(node.uv[k]);
            }
        }
        let size = [0, 1].map(|k| (high[k] - low[k]).max(1e-12));
        let (lengths, bends) = measure(surface, low, size);
        // Sag grows with the square of a cell's size, so the root is taken.
        let wanted = bends.map(|bend| (bend / chord_mm).sqrt().max(1.0));
        let cell = [0, 1].map(|k| lengths[k].max(1e-9) / wanted[k]);
        // A face without extent along one parameter has no bend there either.
        let most = LONGEST * cell[0].min(cell[1]).max(chord_mm);
        let count = [0, 1].map(|k| lengths[k].max(1e-9) / cell[k].min(most));
        Self { low, cells: [0, 1].map(|k| count[k] / size[k]), count }
    }

    pub(super) fn place(&self, uv: [f64; 2]) -> Point2<f64> {
        // Rounded, so that corners along a parameter line are exactly collinear.
        let at = |k: usize| {
            let x = (uv[k] - self.low[k]) * self.cells[k];
            (x * f64::from(1 << 30)).round() / f64::from(1 << 30)
        };
        Point2::new(at(0), at(1))
    }

    pub(super) fn uv(&self, p: Point2<f64>) -> [f64; 2] {
        [p.x / self.cells[0] + self.low[0], p.y / self.cells[1] + self.low[1]]
    }
}

/// Returns the lengths of a surface along u and v, and the sag of a single cell over
/// the whole surface along each.
fn measure(surface: &Surface, low: [f64; 2], size: [f64; 2]) -> ([f64; 2], [f64; 2]) {
    const STEPS: usize = 16;
    let at = |i: usize, j: usize| {
        let part = |k: usize| k as f64 / STEPS as f64;
        surface.point([low[0] + size[0] * part(i), low[1] + size[1] * part(j)])
    };
    let (mut lengths, mut bends) = ([0.0; 2], [0.0; 2]);
    for axis in 0..2 {
        for line in 0..=STEPS {
            let row: Vec<Vec3> =
                (0..=STEPS).map(|k| if axis == 0 { at(k, line) } else { at(line, k) }).collect();
            let long: f64 = row.windows(2).map(|pair| distance(pair[0], pair[1])).sum();
            lengths[axis] = f64::max(lengths[axis], long);
            for three in row.windows(3) {
                let off = sub(three[1], middle(three[0], three[2]));
                let way = unit(sub(three[2], three[0])).unwrap_or([0.0; 3]);
                let sag = length(along(off, way, -dot(off, way)));
                // Sag grows with the square of the step, and each sample spans two steps.
                let whole = sag * (STEPS * STEPS) as f64 / 4.0;
                bends[axis] = f64::max(bends[axis], whole);
            }
        }
    }
    (lengths, bends)
}

/// The sides of all polygons, sorted by height to find those near a point.
pub(super) struct Borders {
    rows: Vec<Vec<[[f64; 2]; 2]>>,
    step: f64,
}

/// The least distance between grid corners and sides, in cells.
const CLEAR: f64 = 0.3;

impl Borders {
    pub(super) fn new(polygons: &[Vec<FaceNode>], scale: &CellScale) -> Self {
        let count = scale.count[1].ceil().clamp(1.0, 1000.0) as usize;
        let step = scale.count[1] / count as f64;
        let mut rows = vec![Vec::new(); count];
        for polygon in polygons {
            let at = |node: &FaceNode| {
                let p = scale.place(node.uv);
                [p.x, p.y]
            };
            let next = polygon.iter().cycle().skip(1);
            for (a, b) in polygon.iter().zip(next) {
                let (a, b) = (at(a), at(b));
                let row = |y: f64| ((y / step).floor().max(0.0) as usize).min(count - 1);
                let (low, high) = (a[1].min(b[1]) - CLEAR, a[1].max(b[1]) + CLEAR);
                rows[row(low)..=row(high)].iter_mut().for_each(|list| list.push([a, b]));
            }
        }
        Self { rows, step }
    }

    fn row(&self, y: f64) -> &[[[f64; 2]; 2]] {
        &self.rows[((y / self.step).max(0.0) as usize).min(self.rows.len() - 1)]
    }

    pub(super) fn is_clear(&self, p: Point2<f64>) -> bool {
        self.row(p.y).iter().all(|[a, b]| {
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let long = dx * dx + dy * dy;
            let t = ((p.x - a[0]) * dx + (p.y - a[1]) * dy) / long;
            let t = if long > 0.0 { t.clamp(0.0, 1.0) } else { 0.0 };
            (p.x - a[0] - t * dx).hypot(p.y - a[1] - t * dy) > CLEAR
        })
    }

    pub(super) fn is_within(&self, p: Point2<f64>) -> bool {
        let crosses = |[a, b]: &&[[f64; 2]; 2]| {
            (a[1] > p.y) != (b[1] > p.y)
                && p.x < a[0] + (p.y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        };
        self.row(p.y).iter().filter(crosses).count() % 2 == 1
    }
}
