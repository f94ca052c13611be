//! Saddles of surfaces: where a section's contours meet.
//!
//! At the height of a saddle four contours come together in a cross; a little above
//! and below they part, two by two, this way and that. Within the chord of that height
//! facets may have them part the other way.

use crate::extent::Way;
use crate::placed::Placed;
use crate::polish::{Crossing, Fate};
use crate::turn::{Meets, SAME_MM, Turns};
use crate::vector::distance;

/// A point where a surface is level and bends both ways.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Saddle {
    /// The point, in millimetres.
    pub at_mm: [f64; 3],
    facet: u32,
    uv: [f64; 2],
    /// Whether the part is below.
    is_above: bool,
    /// The surface is z* + (a dx^2 + 2 b dx dy + c dy^2) / 2 here.
    form: [f64; 3],
    /// How u and v change with x and y.
    uv_by: [[f64; 2]; 2],
}

impl Saddle {
    /// The saddle of a facet's surface, if it has one over the facet.
    pub(crate) fn on(placed: &Placed, facet: u32) -> Option<Self> {
        let level = placed.level(facet, Way::UP)?;
        let ([xu, yu, _], [xv, yv, _]) = (level.jet.du, level.jet.dv);
        let det = xu * yv - xv * yu;
        let uv_by = [[yv / det, -xv / det], [-yu / det, xu / det]];
        let [[ux, uy], [vx, vy]] = uv_by;
        let [uu, uv, vv] = level.bend;
        let bend = |p: [f64; 2], q: [f64; 2]| {
            uu * p[0] * q[0] + uv * (p[0] * q[1] + p[1] * q[0]) + vv * p[1] * q[1]
        };
        let (x, y) = ([ux, vx], [uy, vy]);
        let form = [bend(x, x), bend(x, y), bend(y, y)];
        let [a, b, c] = form;
        // Not a ridge, along which one bend is rounding alone.
        let is_saddle = a * c - b * b < -1e-6 * (a * a + b * b + c * c);
        let is_above = placed.normal(facet, &level.jet)?[2] > 0.0;
        let saddle = Self { at_mm: level.jet.point, facet, uv: level.uv, is_above, form, uv_by };
        (is_saddle && a.is_finite()).then_some(saddle)
    }

    /// Whether it is the same as another that was found from another facet.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        distance(self.at_mm, other.at_mm) < SAME_MM && self.is_above == other.is_above
    }

    /// How far along y, and along x, facets may have contours part in another way
    /// in a section, in millimetres; nothing if the section is too far away.
    pub fn reach_mm(&self, placed: &Placed, z_mm: f64) -> Option<[f64; 2]> {
        let ([a, b, c], off) = (self.form, 2.0 * placed.tolerance_mm());
        let rise = (z_mm - self.at_mm[2]).abs();
        let y = (2.0 * a.abs() * (rise + off) / (b * b - a * c)).sqrt();
        let x = (2.0 * (rise + off) / a.abs()).sqrt() + (b / a).abs() * y;
        (rise <= off && x.is_finite()).then_some([y, x])
    }
}

impl Turns {
    /// The saddles near a section.
    pub fn saddles(&self, placed: &Placed, z_mm: f64) -> impl Iterator<Item = &Saddle> {
        self.saddles.iter().filter(move |saddle| saddle.reach_mm(placed, z_mm).is_some())
    }

    /// What a row of a section meets near a saddle.
    pub fn at_saddle(&self, placed: &Placed, saddle: &Saddle, y_mm: f64, z_mm: f64) -> Meets {
        let ([x, y, z], [a, b, c]) = (saddle.at_mm, saddle.form);
        let (dy, dz) = (y_mm - y, z_mm - z);
        let square = (b * b - a * c) * dy * dy + 2.0 * a * dz;
        if square < 0.0 {
            return Meets::Nothing;
        }
        let ends = [-1.0, 1.0].map(|side| (-b * dy + side * a.signum() * square.sqrt()) / a);
        let pair = ends.map(|dx| {
            let uv =
                [0, 1].map(|k| saddle.uv[k] + saddle.uv_by[k][0] * dx + saddle.uv_by[k][1] * dy);
            let (facet, x_mm) = (saddle.facet, x + dx);
            Crossing { facet, uv, x_mm, y_mm, z_mm, enters: false, fate: Fate::OnFacet }
        });
        self.settled(placed, pair)
    }
}
