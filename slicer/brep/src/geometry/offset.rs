//! Evaluates surfaces offset along the normals of others.

use super::surface::{Surface, TorusPart};
use crate::kernel::Jet;
use crate::vector::{Axes, Vec3, along, cross, scale, sub, unit};

/// The step for differences of the normal, as a part of the domain. Its error only slows
/// the search for points.
const STEP: f64 = 1e-5;

impl Surface {
    /// Returns the surface moved along its normals (du × dv), or `None` if it would vanish.
    pub(crate) fn offset(self, by_mm: f64) -> Option<Surface> {
        if !by_mm.is_finite() {
            return None;
        }
        // In left-handed axes, du × dv points against z and inward.
        let turned = |axes: &Axes| if axes.is_mirrored() { -by_mm } else { by_mm };
        let outwards_mm = match &self {
            Self::Plane(axes)
            | Self::Cylinder { axes, .. }
            | Self::Sphere { axes, .. }
            | Self::Torus { axes, .. }
            | Self::Cone { axes, .. } => turned(axes),
            _ => by_mm,
        };
        let moved = match self {
            Self::Plane(mut axes) => {
                axes.origin = along(axes.origin, axes.directions[2], outwards_mm);
                Self::Plane(axes)
            }
            Self::Cylinder { axes, radius } => {
                Self::Cylinder { axes, radius: radius + outwards_mm }
            }
            Self::Sphere { axes, radius } => Self::Sphere { axes, radius: radius + outwards_mm },
            // A wider tube would intersect itself and have parts that the basis lacks.
            Self::Torus { axes, major, minor, part: TorusPart::Whole }
                if minor + outwards_mm <= major =>
            {
                Self::Torus { axes, major, minor: minor + outwards_mm, part: TorusPart::Whole }
            }
            Self::Cone { axes, radius, slope } => {
                // The slope is the tangent of the half angle, and sqrt(1 + tan²) = 1 / cos.
                let radius = radius + outwards_mm * (1.0 + slope * slope).sqrt();
                Self::Cone { axes, radius, slope }
            }
            basis => Self::Offset { basis: Box::new(basis), by_mm },
        };
        let size = match &moved {
            Self::Cylinder { radius, .. } | Self::Sphere { radius, .. } => *radius,
            Self::Torus { minor, .. } => *minor,
            _ => 1.0,
        };
        (size > 0.0).then_some(moved)
    }
}

/// Returns the point and the derivatives of a surface moved along the normals of `basis`.
pub(super) fn at(basis: &Surface, by_mm: f64, uv: [f64; 2]) -> Jet {
    let jet = basis.at(uv);
    let here = normal(basis, uv);
    // At a pole or an edge without a normal, use one close by.
    let [u, v] = uv;
    let steps = steps(basis);
    let moved = |axis: usize, by: f64| {
        let mut uv = [u, v];
        uv[axis] += by * steps[axis];
        uv
    };
    let slope = |axis: usize| -> Vec3 {
        let sides = [-1.0, 1.0].map(|by| normal(basis, moved(axis, by)));
        let [Some(low), Some(high)] = sides else { return [0.0; 3] };
        // The derivative of S + d n is S' + d n'; n' is a central difference.
        scale(sub(high, low), by_mm / (2.0 * steps[axis]))
    };
    let beside = || {
        let all = [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)];
        all.into_iter().find_map(|(axis, by)| normal(basis, moved(axis, by)))
    };
    let Some(normal) = here.or_else(beside) else { return jet };
    Jet {
        point: along(jet.point, normal, by_mm),
        du: along(jet.du, slope(0), 1.0),
        dv: along(jet.dv, slope(1), 1.0),
    }
}

fn normal(basis: &Surface, uv: [f64; 2]) -> Option<Vec3> {
    let jet = basis.at(uv);
    // The product of short vectors could underflow, so both are scaled first.
    unit(cross(unit(jet.du)?, unit(jet.dv)?))
}

fn steps(basis: &Surface) -> [f64; 2] {
    basis.domain().map(|domain| STEP * domain.map_or(1.0, |[low, high]| high - low))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Curve;
    use crate::vector::{Axes, distance};

    /// Returns a cylinder of radius 3 as an extruded circle.
    fn drum() -> Surface {
        let curve = Curve::Ellipse { axes: Axes::WORLD, radii: [3.0; 2] };
        Surface::Extrusion { curve, direction: [0.0, 0.0, 1.0] }
    }

    #[test]
    fn an_offset_lies_on_the_normals() {
        let offset = drum().offset(1.5).unwrap();
        let plain = Surface::Cylinder { axes: Axes::WORLD, radius: 3.0 }.offset(1.5).unwrap();
        for uv in [[0.0, 0.0], [1.0, 2.0], [4.0, -3.0]] {
            let (a, b) = (offset.at(uv), plain.at(uv));
            assert!(distance(a.point, b.point) < 1e-14);
            assert!(distance(a.du, b.du) < 1e-8 && distance(a.dv, b.dv) < 1e-8);
            let found = offset.project(a.point, None);
            assert!(distance(offset.point(found), a.point) < 1e-9);
        }
        assert_eq!(offset.kind(), "offset");
    }

    #[test]
    fn cones_and_tori_stay_what_they_are() {
        let cone = Surface::Cone { axes: Axes::WORLD, radius: 3.0, slope: 0.5 };
        let torus =
            Surface::Torus { axes: Axes::WORLD, major: 5.0, minor: 2.0, part: TorusPart::Whole };
        for surface in [cone, torus] {
            let offset = surface.clone().offset(0.7).unwrap();
            assert_eq!(offset.kind(), surface.kind());
            for uv in [[0.3, 0.2], [2.0, 1.0]] {
                let foot = surface.at(uv);
                let normal = unit(cross(foot.du, foot.dv)).unwrap();
                let p = along(foot.point, normal, 0.7);
                assert!(distance(offset.point(offset.project(p, None)), p) < 1e-14);
            }
        }
    }

    #[test]
    fn what_vanishes_is_nothing() {
        let ball = Surface::Sphere { axes: Axes::WORLD, radius: 3.0 };
        assert_eq!(ball.clone().offset(-3.0), None);
        assert_eq!(ball.offset(f64::NAN), None);
    }
}
