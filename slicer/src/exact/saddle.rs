//! Finds saddles of surfaces, where a section's contours meet.
//!
//! At the height of a saddle, four contours meet in a cross. Slightly above and below they separate
//! in pairs, one way above and the other way below. Within the tolerance of that height, facets may
//! pair them the wrong way.

use lamp_brep::vector::distance;

use super::critical::{SAME_MM, Saddle};
use super::extent::AxisDirection;
use super::facet_point::{FacetPoint, RowContact};
use super::placed::PlacedSurfaces;

impl Saddle {
    /// Finds the saddle of a facet's surface, if there is one over the facet.
    pub(super) fn on(surfaces: &PlacedSurfaces, facet: u32) -> Option<Self> {
        let level = surfaces.level_point(facet, AxisDirection::UP)?;
        let ([xu, yu, _], [xv, yv, _]) = (level.jet.du, level.jet.dv);
        let det = xu * yv - xv * yu;
        // The inverse of the derivatives of x and y by u and v.
        let uv_by = [[yv / det, -xv / det], [-yu / det, xu / det]];
        let [[ux, uy], [vx, vy]] = uv_by;
        let [uu, uv, vv] = level.bend;
        // The chain rule for second derivatives. The first ones are zero here, so the parameters'
        // own bends drop out.
        let bend = |p: [f64; 2], q: [f64; 2]| {
            uu * p[0] * q[0] + uv * (p[0] * q[1] + p[1] * q[0]) + vv * p[1] * q[1]
        };
        let (x, y) = ([ux, vx], [uy, vy]);
        let form = [bend(x, x), bend(x, y), bend(y, y)];
        let [a, b, c] = form;
        // Excludes ridges, along which the surface bends only by rounding.
        let is_saddle = a * c - b * b < -1e-6 * (a * a + b * b + c * c);
        let is_above = surfaces.normal(facet, &level.jet)?[2] > 0.0;
        let saddle = Self { at_mm: level.jet.point, facet, uv: level.uv, is_above, form, uv_by };
        (is_saddle && a.is_finite()).then_some(saddle)
    }

    /// Returns the number of its body.
    pub(super) fn body(&self, surfaces: &PlacedSurfaces) -> u32 {
        surfaces.body_of(self.facet)
    }

    /// Returns whether another facet's saddle is the same point of the same body.
    pub(super) fn is_same(&self, other: &Self, surfaces: &PlacedSurfaces) -> bool {
        distance(self.at_mm, other.at_mm) < SAME_MM
            && self.is_above == other.is_above
            && self.body(surfaces) == other.body(surfaces)
    }

    /// Returns the extents along y and x in which facets may pair a section's contours the
    /// wrong way, in millimeters, or `None` if the section is too far away.
    pub(super) fn reach_mm(&self, surfaces: &PlacedSurfaces, z_mm: f64) -> Option<[f64; 2]> {
        let ([a, b, c], off) = (self.form, 2.0 * surfaces.tolerance_mm());
        let rise = (z_mm - self.at_mm[2]).abs();
        let y = (2.0 * a.abs() * (rise + off) / (b * b - a * c)).sqrt();
        let x = (2.0 * (rise + off) / a.abs()).sqrt() + (b / a).abs() * y;
        (rise <= off && x.is_finite()).then_some([y, x])
    }

    /// Returns a row's crossings near the saddle in a section.
    pub(super) fn contact(&self, surfaces: &PlacedSurfaces, y_mm: f64, z_mm: f64) -> RowContact {
        let ([x, y, z], [a, b, c]) = (self.at_mm, self.form);
        let (dy, dz) = (y_mm - y, z_mm - z);
        // The surface's quadratic form, solved for dx.
        let square = (b * b - a * c) * dy * dy + 2.0 * a * dz;
        if square < 0.0 {
            return RowContact::Nothing;
        }
        // With the sign of a, the left crossing comes first.
        let ends = [-1.0, 1.0].map(|side| (-b * dy + side * a.signum() * square.sqrt()) / a);
        surfaces.locate_pair(ends.map(|dx| {
            let uv = [0, 1].map(|k| self.uv[k] + self.uv_by[k][0] * dx + self.uv_by[k][1] * dy);
            FacetPoint::new(self.facet, uv, [x + dx, y_mm, z_mm], false)
        }))
    }
}
