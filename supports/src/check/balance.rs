//! The center of gravity of a body as it is built (002 section 4.1.1).

use super::contact::Labelled;
use super::findings::{OffBalance, Region};
use super::metric::Metric;

/// A body that stands on the platform.
pub(super) struct Base {
    /// The convex hull of its pixels in the first layer: corners of pixels, counter-clockwise
    /// where y grows.
    hull: Vec<[i64; 2]>,
    region: Region,
    weight: Weight,
    off: Option<OffBalance>,
}

/// The sum of a body's pixels times the thickness of their layers, and their first moments.
#[derive(Default)]
pub(super) struct Weight {
    mass: f64,
    moments: [f64; 2],
}

impl Weight {
    /// Adds what a layer has of the body.
    pub(super) fn grow(&mut self, layer: &Labelled, components: &[u32], thickness_um: f64) {
        for &component in components {
            let component = &layer.components.all[component as usize];
            // Weight is in proportion to thickness; density and pixel area cancel in the center.
            let moments = component.moments().map(|moment| moment * thickness_um);
            self.unite(&Self { mass: component.area as f64 * thickness_um, moments });
        }
    }

    pub(super) fn unite(&mut self, other: &Self) {
        self.mass += other.mass;
        self.moments = [0, 1].map(|k| self.moments[k] + other.moments[k]);
    }
}

impl Base {
    /// Starts a body from components of the first layer.
    pub(super) fn of(layer: &Labelled, components: &[u32]) -> Self {
        let region = layer.components.all[components[0] as usize].region();
        Self { hull: hull_of(layer, components), region, weight: Weight::default(), off: None }
    }

    /// Joins another body to this one.
    pub(super) fn unite(&mut self, other: Self) {
        let mut corners = std::mem::take(&mut self.hull);
        // Points within either hull are within the hull of both, so corners are enough.
        corners.extend(other.hull);
        self.hull = convex_hull(corners);
        self.region.unite(&other.region);
        self.weight.unite(&other.weight);
        self.off = match (self.off.take(), other.off) {
            (Some(mut a), Some(b)) => {
                a.layer = a.layer.min(b.layer);
                // At equal distances the lower layer counts.
                let worse = (b.off_pixels, a.worst_layer) > (a.off_pixels, b.worst_layer);
                Some(if worse { OffBalance { layer: a.layer, ..b } } else { a })
            }
            (a, b) => a.or(b),
        };
    }

    /// Adds what floated until now.
    pub(super) fn carry(&mut self, floating: &Weight) {
        self.weight.unite(floating);
    }

    /// Adds what a layer has of the body.
    pub(super) fn grow(
        &mut self,
        layer: &Labelled,
        components: &[u32],
        number: u32,
        thickness_um: f64,
        metric: Metric,
    ) {
        self.weight.grow(layer, components, thickness_um);
        let Weight { mass, moments } = self.weight;
        let centre = moments.map(|moment| moment / mass);
        let off_pixels = distance(&self.hull, centre, metric);
        if off_pixels == 0.0 || mass == 0.0 {
            return;
        }
        let first = self.off.as_ref().map_or(number, |off| off.layer);
        if self.off.as_ref().is_none_or(|off| off_pixels > off.off_pixels) {
            let base = self.region.clone();
            let off = OffBalance { layer: first, worst_layer: number, off_pixels, centre, base };
            self.off = Some(off);
        }
    }

    /// Returns how the body is off balance, with its base, if it ever is.
    pub(super) fn off(self) -> Option<OffBalance> {
        // Bodies that joined later have enlarged the base since.
        self.off.map(|off| OffBalance { base: self.region, ..off })
    }
}

/// Returns the convex hull of components: corners of pixels, counter-clockwise where y grows.
pub(super) fn hull_of(layer: &Labelled, components: &[u32]) -> Vec<[i64; 2]> {
    let mut corners = Vec::new();
    for &component in components {
        for (row, columns) in layer.components.runs(&layer.mask, component) {
            // A pixel stands on all of its area: the hull is of corners, not of centers.
            let [top, bottom] = [row, row + 1].map(i64::from);
            let [left, right] = [columns.start, columns.end].map(i64::from);
            corners.extend([[left, top], [right, top], [left, bottom], [right, bottom]]);
        }
    }
    convex_hull(corners)
}

/// Returns the convex hull of points, counter-clockwise, without points on its sides (Andrew's
/// monotone chain).
pub(super) fn convex_hull(mut points: Vec<[i64; 2]>) -> Vec<[i64; 2]> {
    points.sort_unstable();
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    // Rising points give the one half, falling points the other.
    let mut hull = half_hull(points.iter().copied());
    hull.extend(half_hull(points.iter().rev().copied()));
    hull
}

/// Returns one half of the hull, without its last point.
fn half_hull(points: impl Iterator<Item = [i64; 2]>) -> Vec<[i64; 2]> {
    let mut half: Vec<[i64; 2]> = Vec::new();
    for point in points {
        while let [.., a, b] = half[..]
            && (b[0] - a[0]) * (point[1] - a[1]) <= (b[1] - a[1]) * (point[0] - a[0])
        {
            half.pop();
        }
        half.push(point);
    }
    half.pop();
    half
}

/// Returns the distance of a point from a convex hull, in widths of a pixel: zero inside.
fn distance(hull: &[[i64; 2]], point: [f64; 2], metric: Metric) -> f64 {
    let corners = hull.iter().map(|corner| metric.place(corner.map(|place| place as f64)));
    let point = metric.place(point);
    let sides: Vec<_> = corners.clone().zip(corners.cycle().skip(1)).collect();
    // Inside is left of all sides, as the corners go counter-clockwise.
    let is_left = |[a, b]: [[f64; 2]; 2]| {
        (b[0] - a[0]) * (point[1] - a[1]) >= (b[1] - a[1]) * (point[0] - a[0])
    };
    if sides.iter().all(|(a, b)| is_left([*a, *b])) {
        return 0.0;
    }
    let to_side = |(a, b): &([f64; 2], [f64; 2])| {
        let along = [b[0] - a[0], b[1] - a[1]];
        let from = [point[0] - a[0], point[1] - a[1]];
        // Corners of a hull differ, so no side has length zero.
        let length = along[0] * along[0] + along[1] * along[1];
        let part = ((from[0] * along[0] + from[1] * along[1]) / length).clamp(0.0, 1.0);
        (from[0] - part * along[0]).hypot(from[1] - part * along[1])
    };
    sides.iter().map(to_side).fold(f64::INFINITY, f64::min)
}
