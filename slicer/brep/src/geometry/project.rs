//! Finds the parameters of a surface's point nearest to a given point.

use std::f64::consts::TAU;

use super::curve::Curve;
use super::surface::{SAME_MM, Surface, TorusPart};
use crate::kernel::Jet;
use crate::vector::{Vec3, distance, dot, length, sub};

/// The number of starts from which the nearest point is searched.
const MOST_SEEDS: usize = 6;
/// The distance by which seeds at a pole move toward the middle of the surface.
const OFF_POLE: f64 = 1e-3;

impl Surface {
    /// Returns the parameters from which to search for the point nearest to `p`.
    fn seeds(&self, p: Vec3) -> Vec<[f64; 2]> {
        match self {
            Self::Extrusion { curve: curve @ Curve::Line { .. }, .. } => {
                vec![[curve.project(p), 0.0]]
            }
            Self::Extrusion { curve, direction } => {
                let along = |&u: &f64| {
                    let d = sub(p, curve.at(u)[0]);
                    [u, dot(d, *direction) / dot(*direction, *direction)]
                };
                curve.samples().iter().map(along).collect()
            }
            Self::Revolution { axes, curve } => {
                let [x, y, z] = axes.local(p);
                let mut samples = curve.samples();
                // The profile need not lie in a plane through the axis, so the point is turned to
                // eight angles about it.
                let around = (0..8).map(|k| f64::from(k) * TAU / 8.0);
                samples.extend(around.map(|turn| {
                    let (sin, cos) = turn.sin_cos();
                    curve.project([x * cos - y * sin, x * sin + y * cos, z])
                }));
                let turn = |v: f64| {
                    let at = curve.at(v)[0];
                    [y.atan2(x) - at[1].atan2(at[0]), v]
                };
                samples.into_iter().map(turn).collect()
            }
            Self::Spline(spline) => spline.seeds(),
            Self::Offset { basis, .. } => basis.offset_seeds(p),
            _ => Vec::new(),
        }
    }

    /// Returns the seeds of an offset surface: a point has the same foot on its basis.
    fn offset_seeds(&self, p: Vec3) -> Vec<[f64; 2]> {
        let foot = self.project(p, None);
        self.seeds(p).into_iter().chain([foot]).collect()
    }

    /// Returns the parameters of the point nearest to `p`, searching near `hint` first.
    ///
    /// At a pole the undetermined parameter is arbitrary. Periodic parameters may be in any period.
    pub(crate) fn project(&self, p: Vec3, hint: Option<[f64; 2]>) -> [f64; 2] {
        self.project_near(p, hint, SAME_MM)
    }

    /// Returns the same for a point that may be off the surface: accepts the point found near
    /// `hint` if it is within `off_mm`.
    pub(crate) fn project_near(&self, p: Vec3, hint: Option<[f64; 2]>, off_mm: f64) -> [f64; 2] {
        let azimuth = |q: Vec3| q[1].atan2(q[0]);
        match self {
            Self::Plane(axes) => {
                let [u, v, _] = axes.local(p);
                [u, v]
            }
            Self::Cylinder { axes, .. } => {
                let q = axes.local(p);
                [azimuth(q), q[2]]
            }
            Self::Cone { axes, radius, slope } => {
                let q = axes.local(p);
                let off = q[0].hypot(q[1]) - radius;
                // The foot on the profile, a line with the direction (slope, 1).
                let v = (q[2] + slope * off) / (1.0 + slope * slope);
                [azimuth(q), v]
            }
            Self::Sphere { axes, .. } => {
                let q = axes.local(p);
                [azimuth(q), q[2].atan2(q[0].hypot(q[1]))]
            }
            Self::Torus { axes, major, part, .. } => {
                let q = axes.local(p);
                let out = q[0].hypot(q[1]);
                if *part == TorusPart::Lemon {
                    // The far side of the tube lies behind the axis, as seen from u.
                    return [azimuth(q) + TAU / 2.0, q[2].atan2(-out - major).rem_euclid(TAU)];
                }
                [azimuth(q), q[2].atan2(out - major)]
            }
            _ => self.search(p, hint, off_mm),
        }
    }

    fn search(&self, p: Vec3, hint: Option<[f64; 2]>, off_mm: f64) -> [f64; 2] {
        let near = hint.map(|hint| self.nearer(p, hint));
        // From a pole, the search leaves along a single line, which may lead away from the point.
        if let Some((apart, uv)) = near
            && apart < off_mm
            && (apart < SAME_MM || self.arbitrary(&self.at(uv)).is_none())
        {
            return uv;
        }
        let mut seeds: Vec<_> = self.seeds(p).into_iter().map(|uv| self.seed(p, uv)).collect();
        if seeds.len() > MOST_SEEDS {
            // A spline may have thousands of seeds: selecting is linear, sorting is not.
            seeds.select_nth_unstable_by(MOST_SEEDS, |a, b| a.0.total_cmp(&b.0));
            seeds.truncate(MOST_SEEDS);
        }
        seeds.sort_by(|a, b| a.0.total_cmp(&b.0));
        let found = seeds.into_iter().map(|(_, uv)| self.nearer(p, uv));
        // In near ties the hint wins.
        let better = |a: (f64, [f64; 2]), b: (f64, [f64; 2])| if b.0 < a.0 * 0.99 { b } else { a };
        near.into_iter().chain(found).reduce(better).map_or([0.0; 2], |(_, uv)| uv)
    }

    /// Returns the parameter that is arbitrary at a pole.
    fn arbitrary(&self, jet: &Jet) -> Option<usize> {
        let spans = self.domain().map(|side| side.map_or(1.0, |[low, high]| high - low));
        let slopes = [length(jet.du) * spans[0], length(jet.dv) * spans[1]];
        slopes.iter().position(|slope| *slope < SAME_MM)
    }

    /// Returns the distance of a seed from `p`. Seeds at a pole first move off it a little: at the
    /// pole all are equally near, and only some lead to the point.
    fn seed(&self, p: Vec3, mut uv: [f64; 2]) -> (f64, [f64; 2]) {
        let jet = self.at(uv);
        let Some(axis) = self.arbitrary(&jet) else { return (distance(jet.point, p), uv) };
        let across = 1 - axis;
        if let Some([low, high]) = self.domain()[across] {
            uv[across] += OFF_POLE * ((low + high) / 2.0 - uv[across]);
        }
        (distance(self.point(uv), p), uv)
    }

    /// Searches for the foot of `p` by Gauss-Newton, and returns its distance and
    /// parameters.
    fn nearer(&self, p: Vec3, start: [f64; 2]) -> (f64, [f64; 2]) {
        let (domain, periods) = (self.domain(), self.periods());
        let clamp = |x: f64, axis: usize| match (domain[axis], periods[axis]) {
            (Some([low, high]), None) => x.clamp(low, high),
            _ => x,
        };
        // Near a pole a step may be many periods long, which would lose all digits.
        let short = |step: f64, axis: usize| match periods[axis] {
            Some(period) => step.clamp(-period / 4.0, period / 4.0),
            None => step,
        };
        let mut uv = start;
        let mut best = (f64::INFINITY, start);
        for _ in 0..30 {
            let jet = self.at(uv);
            let d = sub(p, jet.point);
            let apart = length(d);
            // Away from the surface a step may lead off before it leads nearer.
            if apart >= best.0 * (1.0 - 1e-9) && best.0 < SAME_MM {
                break;
            }
            if apart < best.0 {
                best = (apart, uv);
            }
            // The normal equations of the step, by Cramer's rule.
            let (a, b, c) = (dot(jet.du, jet.du), dot(jet.du, jet.dv), dot(jet.dv, jet.dv));
            let (e, f) = (dot(d, jet.du), dot(d, jet.dv));
            let det = a * c - b * b;
            // Relative to the squared lengths, so that the units of u and v do not matter.
            let step = if det > 1e-14 * a * c {
                [(e * c - f * b) / det, (f * a - e * b) / det]
            } else {
                // At a pole only one parameter is determined.
                [if a > c { e / a } else { 0.0 }, if c >= a && c > 0.0 { f / c } else { 0.0 }]
            };
            let next = [0, 1].map(|axis| clamp(uv[axis] + short(step[axis], axis), axis));
            if !(next[0].is_finite() && next[1].is_finite()) || next == uv {
                break;
            }
            uv = next;
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::spline::{Knots, weighted};
    use crate::geometry::spline_surface::SplineSurface;

    /// Returns an eighth of a sphere of radius 5 mm as a rational surface with three sides: the
    /// line v = 1 is its pole.
    fn eighth() -> Surface {
        let knots = || Knots::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], 3).unwrap();
        let w = std::f64::consts::FRAC_1_SQRT_2;
        let arc = [([1.0, 0.0], 1.0), ([1.0, 1.0], w), ([0.0, 1.0], 1.0)];
        let control = |k: usize| {
            let ([x, y], wu) = arc[k / 3];
            let ([out, up], wv) = arc[k % 3];
            weighted([5.0 * out * x, 5.0 * out * y, 5.0 * up], wu * wv)
        };
        let surface = SplineSurface::new(knots(), knots(), (0..9).map(control).collect());
        Surface::Spline(Box::new(surface.unwrap()))
    }

    #[test]
    fn points_beside_a_pole_find_their_feet() {
        let surface = eighth();
        for turn in [0.1_f64, 0.4, 0.8, 1.2, 1.5] {
            for tilt in [0.0005_f64, 0.02, 0.05] {
                for radius in [5.0, 4.95, 5.05] {
                    let out = radius * tilt.sin();
                    let p = [out * turn.cos(), out * turn.sin(), radius * tilt.cos()];
                    // From nowhere, and from the pole itself, where the search is stuck.
                    for hint in [None, Some([0.9, 1.0]), Some([0.0, 1.0])] {
                        let foot = surface.project_near(p, hint, 0.25);
                        let apart = distance(surface.point(foot), p);
                        let most = (radius - 5.0).abs() + 1e-6;
                        assert!(apart < most, "{turn} {tilt} {radius} {hint:?}: {apart}");
                    }
                }
            }
        }
    }
}
