//! Chooses the part of a self-intersecting surface on which a face lies.

use super::surface::{SAME_MM, Surface, TorusPart};
use crate::vector::{Vec3, distance};

/// How much nearer the points of a face must be to the other part, as a factor.
const CLEARLY_NEARER: f64 = 0.5;

impl Surface {
    /// Returns a cone, or a torus whose tube intersects itself, with the part on which the points
    /// lie. Other surfaces stay unchanged. The part stays if the points do not decide.
    ///
    /// ISO 10303-42 has both halves of a cone, and a `TOROIDAL_SURFACE` with a tube wider than its
    /// ring also has the part around the axis; programs use them.
    pub(crate) fn part_at(self, points: impl FnOnce() -> Vec<Vec3>) -> Self {
        let Some(other) = self.other_part() else { return self };
        let points = points();
        let off = |surface: &Self| {
            let apart = |p: &Vec3| distance(surface.point(surface.project(*p, None)), *p);
            points.iter().map(apart).fold(0.0, f64::max)
        };
        let off_mm = off(&self);
        // Points where both parts meet must not decide, so the other one has to be clearly nearer.
        if off_mm > SAME_MM && off(&other) < CLEARLY_NEARER * off_mm { other } else { self }
    }

    /// Returns the other part of a self-intersecting surface.
    fn other_part(&self) -> Option<Self> {
        match self {
            // Behind the tip, radii are negative: a point with the radius -r at u has r at u + π.
            // Both have the same derivatives, so the normal stays.
            Self::Cone { axes, radius, slope } if *slope != 0.0 => {
                Some(Self::Cone { axes: *axes, radius: -radius, slope: -slope })
            }
            Self::Torus { axes, major, minor, part } => {
                let part = match part {
                    TorusPart::Whole => return None,
                    TorusPart::Apple => TorusPart::Lemon,
                    TorusPart::Lemon => TorusPart::Apple,
                };
                Some(Self::Torus { axes: *axes, major: *major, minor: *minor, part })
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::{Axes, cross, dot, sub, unit};

    #[test]
    fn points_behind_the_tip_of_a_cone_choose_that_half() {
        let cone = Surface::Cone { axes: Axes::WORLD, radius: 3.0, slope: 1.0 };
        let uv = [[0.3, -5.0], [2.0, -4.0], [4.0, -7.0]];
        let points = uv.map(|uv| cone.point(uv));
        let part = cone.clone().part_at(|| points.to_vec());
        for (p, uv) in points.into_iter().zip(uv) {
            let found = part.project(p, None);
            assert!(distance(part.point(found), p) < 1e-12, "{p:?}");
            let normal = |surface: &Surface, uv| {
                let jet = surface.at(uv);
                unit(cross(jet.du, jet.dv)).unwrap()
            };
            let (old, new) = (normal(&cone, uv), normal(&part, found));
            assert!(dot(sub(old, new), sub(old, new)) < 1e-24, "{old:?} {new:?}");
        }
        let before = [[0.3, 5.0], [2.0, -2.0]].map(|uv| cone.point(uv));
        assert_eq!(cone.clone().part_at(|| before.to_vec()), cone);
    }

    #[test]
    fn points_near_the_axis_choose_the_lemon() {
        let part = TorusPart::Apple;
        let torus = Surface::Torus { axes: Axes::WORLD, major: 8.0, minor: 50.0, part };
        let points = [[0.3, 3.0], [2.0, 3.3], [4.0, 3.1]].map(|uv| torus.point(uv));
        let lemon = torus.clone().part_at(|| points.to_vec());
        assert!(matches!(lemon, Surface::Torus { part: TorusPart::Lemon, .. }));
        let outside = [[0.3, 0.2], [2.0, 1.0]].map(|uv| torus.point(uv));
        assert_eq!(torus.clone().part_at(|| outside.to_vec()), torus);
    }
}
