//! The surfaces of faces.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::curve::Curve;
use super::spline::SplineSurface;
use crate::kernel::Jet;
use crate::vector::{Frame, Vec3, add, distance, dot, length, scale, sub};

/// A surface in millimetres, as ISO 10303-42 gives its parameters.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Surface {
    Plane(Frame),
    Cylinder {
        frame: Frame,
        radius: f64,
    },
    /// The radius at v = 0, and how much it grows with v.
    Cone {
        frame: Frame,
        radius: f64,
        slope: f64,
    },
    Sphere {
        frame: Frame,
        radius: f64,
    },
    Torus {
        frame: Frame,
        major: f64,
        minor: f64,
        part: TorusPart,
    },
    Extrusion {
        curve: Curve,
        direction: Vec3,
    },
    /// About the z axis of the frame, along which the curve's points are given too.
    Revolution {
        frame: Frame,
        curve: Curve,
    },
    Spline(Box<SplineSurface>),
}

/// What of a torus is meant: a tube wider than its way round meets itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TorusPart {
    Whole,
    /// Outside the points where it meets itself.
    Apple,
    /// Inside of them.
    Lemon,
}

/// How far apart points are held to be one, in millimetres.
const SAME_MM: f64 = 1e-6;

impl Surface {
    /// The name of its kind.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Plane(_) => "plane",
            Self::Cylinder { .. } => "cylinder",
            Self::Cone { .. } => "cone",
            Self::Sphere { .. } => "sphere",
            Self::Torus { .. } => "torus",
            Self::Extrusion { .. } => "extrusion",
            Self::Revolution { .. } => "revolution",
            Self::Spline(_) => "B-spline",
        }
    }

    /// The point and the first derivatives.
    pub(crate) fn at(&self, [u, v]: [f64; 2]) -> Jet {
        let jet = |frame: &Frame, p: Vec3, du: Vec3, dv: Vec3| Jet {
            point: frame.point(p),
            du: frame.direction(du),
            dv: frame.direction(dv),
        };
        let (sin, cos) = u.sin_cos();
        // A profile of radius r and height z, turned.
        let turned = |frame: &Frame, [r, z]: [f64; 2], [dr, dz]: [f64; 2]| {
            jet(frame, [r * cos, r * sin, z], [-r * sin, r * cos, 0.0], [dr * cos, dr * sin, dz])
        };
        match self {
            Self::Plane(frame) => jet(frame, [u, v, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            Self::Cylinder { frame, radius } => turned(frame, [*radius, v], [0.0, 1.0]),
            Self::Cone { frame, radius, slope } => {
                turned(frame, [radius + v * slope, v], [*slope, 1.0])
            }
            Self::Sphere { frame, radius: r } => {
                let (s, c) = v.sin_cos();
                turned(frame, [r * c, r * s], [-r * s, r * c])
            }
            Self::Torus { frame, major, minor: r, .. } => {
                let (s, c) = v.sin_cos();
                turned(frame, [major + r * c, r * s], [-r * s, r * c])
            }
            Self::Extrusion { curve, direction } => {
                let [point, du] = curve.at(inside(u, curve.domain(), curve.period()));
                Jet { point: add(point, scale(*direction, v)), du, dv: *direction }
            }
            Self::Revolution { frame, curve } => {
                let [p, d] = curve.at(inside(v, curve.domain(), curve.period()));
                let turn = |p: Vec3| [p[0] * cos - p[1] * sin, p[0] * sin + p[1] * cos, p[2]];
                let [x, y, _] = turn(p);
                jet(frame, turn(p), [-y, x, 0.0], turn(d))
            }
            Self::Spline(spline) => {
                let [period_u, period_v] = self.periods();
                let u = inside(u, Some(spline.u.domain()), period_u);
                let v = inside(v, Some(spline.v.domain()), period_v);
                let [point, du, dv] = spline.at(u, v);
                Jet { point, du, dv }
            }
        }
    }

    pub(crate) fn point(&self, uv: [f64; 2]) -> Vec3 {
        self.at(uv).point
    }

    /// After which lengths u and v come again.
    pub(crate) fn periods(&self) -> [Option<f64>; 2] {
        match self {
            Self::Plane(_) => [None, None],
            Self::Cylinder { .. } | Self::Cone { .. } | Self::Sphere { .. } => [Some(TAU), None],
            Self::Torus { part: TorusPart::Whole, .. } => [Some(TAU), Some(TAU)],
            Self::Torus { .. } => [Some(TAU), None],
            Self::Extrusion { curve, .. } => [curve.period(), None],
            Self::Revolution { curve, .. } => [Some(TAU), curve.period()],
            Self::Spline(spline) => spline.periods,
        }
    }

    /// Where u and v begin and end.
    pub(crate) fn domain(&self) -> [Option<[f64; 2]>; 2] {
        let round = Some([0.0, TAU]);
        match self {
            Self::Plane(_) => [None, None],
            Self::Cylinder { .. } | Self::Cone { .. } => [round, None],
            Self::Sphere { .. } => [round, Some([-FRAC_PI_2, FRAC_PI_2])],
            Self::Torus { part: TorusPart::Whole, .. } => [round, round],
            Self::Torus { major, minor, part, .. } => {
                let meet = (-major / minor).acos();
                let outside = [-meet, meet];
                let is_apple = *part == TorusPart::Apple;
                [round, Some(if is_apple { outside } else { [meet, TAU - meet] })]
            }
            Self::Extrusion { curve, .. } => [curve.domain(), None],
            Self::Revolution { curve, .. } => [round, curve.domain()],
            Self::Spline(spline) => [Some(spline.u.domain()), Some(spline.v.domain())],
        }
    }

    /// Sides of the domain that are one point: for u and for v, at which ends,
    /// the parameter and the point.
    pub(crate) fn poles(&self) -> Vec<Pole> {
        let pole = |axis: usize, at: f64| {
            let mut uv = [0.0; 2];
            uv[axis] = at;
            uv[1 - axis] = self.domain()[1 - axis].map_or(0.0, |domain| domain[0]);
            Pole { axis, at, point: self.point(uv) }
        };
        match self {
            Self::Cone { radius, slope, .. } if *slope != 0.0 => vec![pole(1, -radius / slope)],
            Self::Sphere { .. } => [-FRAC_PI_2, FRAC_PI_2].map(|v| pole(1, v)).into(),
            Self::Torus { part: TorusPart::Apple | TorusPart::Lemon, .. } => {
                self.domain()[1].into_iter().flatten().map(|v| pole(1, v)).collect()
            }
            Self::Revolution { frame, curve } => {
                let on_axis = |v: &f64| {
                    let [x, y, _] = frame.local(self.point([0.0, *v]));
                    x.hypot(y) < SAME_MM
                };
                curve.domain().into_iter().flatten().filter(on_axis).map(|v| pole(1, v)).collect()
            }
            Self::Spline(spline) => {
                let ends = [spline.u.domain(), spline.v.domain()];
                let sides = [(0, false), (0, true), (1, false), (1, true)];
                let is_pole = |&(axis, last): &(usize, bool)| spline.is_pole(axis, last);
                let poles = sides.into_iter().filter(is_pole);
                poles.map(|(axis, last)| pole(axis, ends[axis][usize::from(last)])).collect()
            }
            _ => Vec::new(),
        }
    }

    /// The box of all control points, for surfaces that have them: no point of
    /// the surface lies outside.
    pub(crate) fn control_box(&self) -> Option<[Vec3; 2]> {
        let Self::Spline(spline) = self else { return None };
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for p in &spline.points {
            for k in 0..3 {
                bounds[0][k] = bounds[0][k].min(p[k] / p[3]);
                bounds[1][k] = bounds[1][k].max(p[k] / p[3]);
            }
        }
        Some(bounds)
    }

    /// Parameters from which the nearest point to `p` is looked for.
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
            Self::Revolution { frame, curve } => {
                let [x, y, z] = frame.local(p);
                let mut samples = curve.samples();
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
            _ => Vec::new(),
        }
    }

    /// The parameters of the point nearest to `p`, looked for near `hint` first.
    ///
    /// At a pole the parameter that has no meaning there is any. What comes
    /// again after a period lies in any of them.
    pub(crate) fn project(&self, p: Vec3, hint: Option<[f64; 2]>) -> [f64; 2] {
        let azimuth = |q: Vec3| q[1].atan2(q[0]);
        match self {
            Self::Plane(frame) => {
                let [u, v, _] = frame.local(p);
                [u, v]
            }
            Self::Cylinder { frame, .. } => {
                let q = frame.local(p);
                [azimuth(q), q[2]]
            }
            Self::Cone { frame, radius, slope } => {
                let q = frame.local(p);
                let off = q[0].hypot(q[1]) - radius;
                let v = (q[2] + slope * off) / (1.0 + slope * slope);
                [azimuth(q), v]
            }
            Self::Sphere { frame, .. } => {
                let q = frame.local(p);
                [azimuth(q), q[2].atan2(q[0].hypot(q[1]))]
            }
            Self::Torus { frame, major, part, .. } => {
                let q = frame.local(p);
                let out = q[0].hypot(q[1]);
                if *part == TorusPart::Lemon {
                    // The tube's far side: behind the axis, as seen from u.
                    return [azimuth(q) + TAU / 2.0, q[2].atan2(-out - major).rem_euclid(TAU)];
                }
                [azimuth(q), q[2].atan2(out - major)]
            }
            _ => self.search(p, hint),
        }
    }

    fn search(&self, p: Vec3, hint: Option<[f64; 2]>) -> [f64; 2] {
        let near = hint.map(|hint| self.nearer(p, hint));
        if let Some((apart, uv)) = near
            && apart < SAME_MM
        {
            return uv;
        }
        let mut seeds: Vec<_> =
            self.seeds(p).into_iter().map(|uv| (distance(self.point(uv), p), uv)).collect();
        seeds.sort_by(|a, b| a.0.total_cmp(&b.0));
        let found = seeds.into_iter().take(6).map(|(_, uv)| self.nearer(p, uv));
        // The hint wins what is as good as even.
        let better = |a: (f64, [f64; 2]), b: (f64, [f64; 2])| if b.0 < a.0 * 0.99 { b } else { a };
        near.into_iter().chain(found).reduce(better).map_or([0.0; 2], |(_, uv)| uv)
    }

    /// Goes from parameters to the foot of `p` (Gauss-Newton), and says how far
    /// `p` lies from it.
    fn nearer(&self, p: Vec3, start: [f64; 2]) -> (f64, [f64; 2]) {
        let (domain, periods) = (self.domain(), self.periods());
        let clamp = |x: f64, axis: usize| match (domain[axis], periods[axis]) {
            (Some([low, high]), None) => x.clamp(low, high),
            _ => x,
        };
        let mut uv = start;
        let mut best = (f64::INFINITY, start);
        for _ in 0..30 {
            let jet = self.at(uv);
            let d = sub(p, jet.point);
            let apart = length(d);
            if apart >= best.0 * (1.0 - 1e-9) && best.0 < SAME_MM {
                break;
            }
            if apart < best.0 {
                best = (apart, uv);
            }
            let (a, b, c) = (dot(jet.du, jet.du), dot(jet.du, jet.dv), dot(jet.dv, jet.dv));
            let (e, f) = (dot(d, jet.du), dot(d, jet.dv));
            let det = a * c - b * b;
            let step = if det > 1e-14 * a * c {
                [(e * c - f * b) / det, (f * a - e * b) / det]
            } else {
                // At a pole only one parameter has a meaning.
                [if a > c { e / a } else { 0.0 }, if c >= a && c > 0.0 { f / c } else { 0.0 }]
            };
            let next = [clamp(uv[0] + step[0], 0), clamp(uv[1] + step[1], 1)];
            if !(next[0].is_finite() && next[1].is_finite()) || next == uv {
                break;
            }
            uv = next;
        }
        best
    }
}

/// A side of a surface's domain that is one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pole {
    /// Which parameter is constant along the side: 0 for u, 1 for v.
    pub(crate) axis: usize,
    /// Its value.
    pub(crate) at: f64,
    pub(crate) point: Vec3,
}

/// A parameter within the domain, where it comes again.
fn inside(t: f64, domain: Option<[f64; 2]>, period: Option<f64>) -> f64 {
    match (domain, period) {
        (Some([low, high]), Some(period)) if t < low || t > high => {
            low + (t - low).rem_euclid(period)
        }
        _ => t,
    }
}
