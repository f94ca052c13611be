//! Computes with points, directions and placed axes.

/// A point in millimeters, or a direction.
pub type Vec3 = [f64; 3];

/// Returns `a + b`.
pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Returns `a - b`.
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Returns `s a`.
pub fn scale(a: Vec3, s: f64) -> Vec3 {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// Returns `a + s b`.
pub fn along(a: Vec3, b: Vec3, s: f64) -> Vec3 {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

/// Returns the scalar product.
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the vector product.
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns the length.
pub fn length(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// Returns the distance between two points.
pub fn distance(a: Vec3, b: Vec3) -> f64 {
    length(sub(a, b))
}

/// Returns the point halfway between two.
pub fn middle(a: Vec3, b: Vec3) -> Vec3 {
    scale(add(a, b), 0.5)
}

/// Returns the direction with length 1, or `None` if its length is 0 or not finite.
pub fn unit(a: Vec3) -> Option<Vec3> {
    let length = length(a);
    // A shorter vector is the rounding error of a difference.
    (length > 1e-12 && length.is_finite()).then(|| scale(a, 1.0 / length))
}

/// A coordinate system: an origin and three directions of length 1 at right angles. It is
/// left-handed in mirrored parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axes {
    pub(crate) origin: Vec3,
    pub(crate) directions: [Vec3; 3],
}

impl Axes {
    pub(crate) const WORLD: Self =
        Self { origin: [0.0; 3], directions: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };

    /// Returns right-handed axes with this z axis, and `x` projected to be at a right angle to it.
    /// Without a usable `x`, the first world axis that is not parallel to z is used
    /// (ISO 10303-42, `first_proj_axis`).
    pub(crate) fn new(origin: Vec3, z: Vec3, x: Option<Vec3>) -> Option<Self> {
        let z = unit(z)?;
        let across = |x: Vec3| unit(along(x, z, -dot(x, z)));
        // The projection of a nearly parallel axis would be a rounding error.
        let default = if z[0].abs() < 1.0 - 1e-9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let x = x.and_then(unit).and_then(across).or_else(|| across(default))?;
        Some(Self { origin, directions: [x, cross(z, x), z] })
    }

    /// Returns whether the axes are left-handed.
    pub(crate) fn is_mirrored(&self) -> bool {
        let [x, y, z] = self.directions;
        dot(cross(x, y), z) < 0.0
    }

    /// Converts a point from these axes to the world's.
    pub(crate) fn point(&self, p: Vec3) -> Vec3 {
        add(self.origin, self.direction(p))
    }

    /// Converts a direction from these axes to the world's.
    pub(crate) fn direction(&self, d: Vec3) -> Vec3 {
        let [x, y, z] = self.directions;
        along(along(scale(x, d[0]), y, d[1]), z, d[2])
    }

    /// Converts a point from the world's axes to these.
    pub(crate) fn local(&self, p: Vec3) -> Vec3 {
        let d = sub(p, self.origin);
        self.directions.map(|axis| dot(axis, d))
    }

    /// Converts axes from these axes to the world's.
    pub(crate) fn then(&self, inner: &Axes) -> Axes {
        let directions = inner.directions.map(|axis| self.direction(axis));
        Axes { origin: self.point(inner.origin), directions }
    }

    /// Returns the axes, rotated by half a turn about x.
    pub(crate) fn turned(&self) -> Axes {
        let [x, y, z] = self.directions;
        // Conics are symmetric to x, so they run backward in these axes: t becomes -t.
        Axes { origin: self.origin, directions: [x, scale(y, -1.0), scale(z, -1.0)] }
    }

    /// Returns the inverse: `self.then(&self.inverse())` is the world.
    pub(crate) fn inverse(&self) -> Axes {
        let [x, y, z] = self.directions;
        // The directions are orthonormal, so the transpose is their inverse.
        let directions = [0, 1, 2].map(|k| [x[k], y[k], z[k]]);
        let origin = self.directions.map(|axis| -dot(axis, self.origin));
        Axes { origin, directions }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_without_x_is_whole_wherever_z_points() {
        for z in [[1.0, 0.0, 0.0], [-3.0, 0.0, 0.0], [0.0, 2.0, 0.0], [1.0, 1e-13, 0.0]] {
            for x in [None, Some(z), Some([0.0; 3])] {
                let [x, y, z] = Axes::new([0.0; 3], z, x).unwrap().directions;
                assert!(dot(x, y).abs() < 1e-12 && dot(x, z).abs() < 1e-12);
                assert!((length(x) - 1.0).abs() < 1e-12 && distance(cross(x, y), z) < 1e-12);
            }
        }
        assert_eq!(Axes::new([0.0; 3], [0.0; 3], None), None);
        assert_eq!(Axes::new([0.0; 3], [f64::NAN; 3], None), None);
    }

    #[test]
    fn a_frame_undone_is_the_world() {
        let axes = Axes::new([1.0, 2.0, 3.0], [1.0, 1.0, 0.5], Some([0.0, 1.0, 0.0])).unwrap();
        let p = [4.0, -5.0, 6.0];
        assert!(distance(axes.local(axes.point(p)), p) < 1e-12);
        assert!(distance(axes.then(&axes.inverse()).point(p), p) < 1e-12);
    }
}
