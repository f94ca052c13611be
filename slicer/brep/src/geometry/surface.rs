//! Evaluates surfaces of faces: points, derivatives, domains and poles.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::curve::Curve;
use super::offset;
use super::spline::inside;
use super::spline_surface::SplineSurface;
use crate::kernel::Jet;
use crate::vector::{Axes, Vec3, add, scale};

/// A surface in millimeters, with the parameters of ISO 10303-42.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Surface {
    Plane(Axes),
    Cylinder {
        axes: Axes,
        radius: f64,
    },
    /// A cone: its radius at v = 0, and the growth of the radius per unit of v.
    Cone {
        axes: Axes,
        radius: f64,
        slope: f64,
    },
    Sphere {
        axes: Axes,
        radius: f64,
    },
    Torus {
        axes: Axes,
        major: f64,
        minor: f64,
        part: TorusPart,
    },
    Extrusion {
        curve: Curve,
        direction: Vec3,
    },
    /// A curve, given in the coordinates of `axes`, rotated about their z axis.
    Revolution {
        axes: Axes,
        curve: Curve,
    },
    Spline(Box<SplineSurface>),
    /// A surface moved along its normals.
    Offset {
        basis: Box<Surface>,
        by_mm: f64,
    },
}

/// The part of a torus on which a face lies, if the tube intersects itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TorusPart {
    Whole,
    /// Outside the self-intersection.
    Apple,
    /// Inside the self-intersection.
    Lemon,
}

/// A torus whose tube touches itself in its center.
pub(crate) const HORN_TORUS: &str = "horn torus";
/// The greatest relative difference of its radii.
const HORN: f64 = 1e-9;

/// Points closer than this are equal, in millimeters.
pub(super) const SAME_MM: f64 = 1e-6;

impl Surface {
    /// Returns the name of its kind.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Plane(_) => "plane",
            Self::Cylinder { .. } => "cylinder",
            Self::Cone { .. } => "cone",
            Self::Sphere { .. } => "sphere",
            Self::Torus { major, minor, .. } if (major - minor).abs() <= HORN * minor => HORN_TORUS,
            Self::Torus { .. } => "torus",
            Self::Extrusion { .. } => "extrusion",
            Self::Revolution { .. } => "revolution",
            Self::Spline(_) => "B-spline",
            Self::Offset { .. } => "offset",
        }
    }

    /// Returns the point and the first derivatives.
    pub(crate) fn at(&self, [u, v]: [f64; 2]) -> Jet {
        let jet = |axes: &Axes, p: Vec3, du: Vec3, dv: Vec3| Jet {
            point: axes.point(p),
            du: axes.direction(du),
            dv: axes.direction(dv),
        };
        // A profile of radius r and height z, rotated about the axis.
        let turned = |axes: &Axes, [r, z]: [f64; 2], [dr, dz]: [f64; 2]| {
            let (sin, cos) = u.sin_cos();
            jet(axes, [r * cos, r * sin, z], [-r * sin, r * cos, 0.0], [dr * cos, dr * sin, dz])
        };
        match self {
            Self::Plane(axes) => jet(axes, [u, v, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            Self::Cylinder { axes, radius } => turned(axes, [*radius, v], [0.0, 1.0]),
            Self::Cone { axes, radius, slope } => {
                turned(axes, [radius + v * slope, v], [*slope, 1.0])
            }
            Self::Sphere { axes, radius: r } => {
                let (s, c) = v.sin_cos();
                turned(axes, [r * c, r * s], [-r * s, r * c])
            }
            Self::Torus { axes, major, minor: r, .. } => {
                let (s, c) = v.sin_cos();
                turned(axes, [major + r * c, r * s], [-r * s, r * c])
            }
            Self::Extrusion { curve, direction } => {
                let [point, du] = curve.at(inside(u, curve.domain(), curve.period()));
                Jet { point: add(point, scale(*direction, v)), du, dv: *direction }
            }
            Self::Revolution { axes, curve } => {
                let [p, d] = curve.at(inside(v, curve.domain(), curve.period()));
                let (sin, cos) = u.sin_cos();
                let turn = |p: Vec3| [p[0] * cos - p[1] * sin, p[0] * sin + p[1] * cos, p[2]];
                let [x, y, _] = turn(p);
                jet(axes, turn(p), [-y, x, 0.0], turn(d))
            }
            Self::Spline(spline) => spline.at(spline.inside([u, v])),
            Self::Offset { basis, by_mm } => offset::at(basis, *by_mm, [u, v]),
        }
    }

    /// Evaluates many parameters at once.
    pub(crate) fn evaluate(&self, uv: &[[f64; 2]], jets: &mut [Jet]) {
        match self {
            // Without periods, parameters need no copy.
            Self::Spline(spline) if spline.periods == [None; 2] => spline.evaluate(uv, jets),
            Self::Spline(spline) => {
                let uv: Vec<_> = uv.iter().map(|&uv| spline.inside(uv)).collect();
                spline.evaluate(&uv, jets);
            }
            _ => jets.iter_mut().zip(uv).for_each(|(jet, &uv)| *jet = self.at(uv)),
        }
    }

    pub(crate) fn point(&self, uv: [f64; 2]) -> Vec3 {
        self.at(uv).point
    }

    /// Returns the periods of u and v where the surface is closed.
    pub(crate) fn periods(&self) -> [Option<f64>; 2] {
        match self {
            Self::Plane(_) => [None, None],
            Self::Cylinder { .. } | Self::Cone { .. } | Self::Sphere { .. } => [Some(TAU), None],
            Self::Torus { part: TorusPart::Whole, .. } => [Some(TAU), Some(TAU)],
            Self::Torus { .. } => [Some(TAU), None],
            Self::Extrusion { curve, .. } => [curve.period(), None],
            Self::Revolution { curve, .. } => [Some(TAU), curve.period()],
            Self::Spline(spline) => spline.periods,
            Self::Offset { basis, .. } => basis.periods(),
        }
    }

    /// Returns the ranges of u and v, where bounded.
    pub(crate) fn domain(&self) -> [Option<[f64; 2]>; 2] {
        let round = Some([0.0, TAU]);
        match self {
            Self::Plane(_) => [None, None],
            Self::Cylinder { .. } | Self::Cone { .. } => [round, None],
            Self::Sphere { .. } => [round, Some([-FRAC_PI_2, FRAC_PI_2])],
            Self::Torus { part: TorusPart::Whole, .. } => [round, round],
            Self::Torus { major, minor, part, .. } => {
                // Here the tube meets the axis: major + minor cos v = 0.
                let meet = (-major / minor).acos();
                let outside = [-meet, meet];
                let is_apple = *part == TorusPart::Apple;
                [round, Some(if is_apple { outside } else { [meet, TAU - meet] })]
            }
            Self::Extrusion { curve, .. } => [curve.domain(), None],
            Self::Revolution { curve, .. } => [round, curve.domain()],
            Self::Spline(spline) => [Some(spline.u.domain()), Some(spline.v.domain())],
            Self::Offset { basis, .. } => basis.domain(),
        }
    }

    /// Returns the sides of the domain that are a single point.
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
            Self::Revolution { axes, curve } => {
                let on_axis = |v: &f64| {
                    let [x, y, _] = axes.local(self.point([0.0, *v]));
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
            // A pole with a single normal stays a pole.
            Self::Offset { basis, .. } => {
                basis.poles().into_iter().map(|at| pole(at.axis, at.at)).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Returns whether the surface is closed both ways, so that it bounds a body by itself.
    pub(crate) fn is_closed(&self) -> bool {
        let (periods, poles) = (self.periods(), self.poles());
        (0..2).all(|axis| {
            periods[axis].is_some() || poles.iter().filter(|pole| pole.axis == axis).count() == 2
        })
    }

    /// Returns the box of the control points, if there are any. It encloses the surface.
    pub(crate) fn control_box(&self) -> Option<[Vec3; 2]> {
        let Self::Spline(spline) = self else { return None };
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        // Weights are positive, as the reader checks, so the surface is in the hull of these
        // points.
        for p in &spline.points {
            for k in 0..3 {
                bounds[0][k] = bounds[0][k].min(p[k] / p[3]);
                bounds[1][k] = bounds[1][k].max(p[k] / p[3]);
            }
        }
        Some(bounds)
    }
}

/// A side of a surface's domain that is a single point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pole {
    /// The parameter that is constant along the side: 0 for u, 1 for v.
    pub(crate) axis: usize,
    /// The value of that parameter.
    pub(crate) at: f64,
    pub(crate) point: Vec3,
}
