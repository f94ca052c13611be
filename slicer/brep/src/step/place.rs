//! Composes placements that turn, mirror and scale.

use crate::vector::{Axes, scale};

/// The placement of a shape: its points are scaled, then placed by axes. The axes are left-handed
/// if the shape is mirrored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    pub(crate) axes: Axes,
    pub(crate) scale: f64,
}

impl Place {
    pub(crate) const WORLD: Self = Self { axes: Axes::WORLD, scale: 1.0 };

    /// Returns the placement in the world of an `inner` placement within this one.
    pub(crate) fn then(&self, inner: &Self) -> Self {
        let moved = Axes { origin: scale(inner.axes.origin, self.scale), ..inner.axes };
        Self { axes: self.axes.then(&moved), scale: self.scale * inner.scale }
    }

    /// Returns the inverse: `self.then(&self.inverse())` is the world.
    pub(crate) fn inverse(&self) -> Self {
        let by = 1.0 / self.scale;
        let axes = self.axes.inverse();
        Self { axes: Axes { origin: scale(axes.origin, by), ..axes }, scale: by }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::{Vec3, distance};

    impl Place {
        fn point(&self, p: Vec3) -> Vec3 {
            self.axes.point(scale(p, self.scale))
        }
    }

    #[test]
    fn places_compose_and_invert() {
        let axes = Axes::new([1.0, 2.0, 3.0], [1.0, 1.0, 0.5], Some([0.0, 1.0, 0.0])).unwrap();
        let [x, y, z] = axes.directions;
        let mirrored = Axes { directions: [x, scale(y, -1.0), z], ..axes };
        assert!(mirrored.is_mirrored() && !axes.is_mirrored());
        let a = Place { axes: mirrored, scale: 2.0 };
        let b = Place { axes, scale: 0.1 };
        let p = [4.0, -5.0, 6.0];
        assert!(distance(a.then(&b).point(p), a.point(b.point(p))) < 1e-12);
        assert!(distance(a.inverse().point(a.point(p)), p) < 1e-12);
        assert!(distance(a.then(&a.inverse()).point(p), p) < 1e-12);
        assert!(a.then(&b).axes.is_mirrored() && !a.then(&a).axes.is_mirrored());
    }
}
