//! Poses: turns of a part, spread evenly over the directions that may point up.

use std::f64::consts::PI;
use std::fmt;

use lamp_slicing::{Axis, Placement};

/// A pose of a part: turns about x and then y, so that some direction of the part points up.
///
/// A turn about z would change no layer's shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    about_x: f64,
    about_y: f64,
}

impl Pose {
    /// The part as it is.
    pub const GIVEN: Self = Self { about_x: 0.0, about_y: 0.0 };

    /// Returns the pose that turns a direction up, to a tenth of a degree.
    pub fn with_up([x, y, z]: [f64; 3]) -> Self {
        // About x into the plane of x and z, above x; then about y.
        let about_x = if y == 0.0 && z == 0.0 { 0.0 } else { y.atan2(z) };
        let about_y = (-x).atan2(y.hypot(z));
        // Adding zero turns -0 into 0.
        let [about_x, about_y] =
            [about_x, about_y].map(|angle| (angle.to_degrees() * 10.0).round() / 10.0 + 0.0);
        Self { about_x, about_y }
    }

    /// Returns its turns, none of them by zero.
    pub fn turns(&self) -> impl Iterator<Item = (Axis, f64)> {
        [(Axis::X, self.about_x), (Axis::Y, self.about_y)]
            .into_iter()
            .filter(|&(_, degrees)| degrees != 0.0)
    }

    /// Returns the placement that turns the part.
    pub fn placement(&self) -> Placement {
        self.turns().fold(Placement::default(), |placed, (axis, by)| placed.rotated(axis, by))
    }

    /// Returns the unit vectors of the part that then point along x, along y and up.
    pub fn axes(&self) -> [[f64; 3]; 3] {
        let placed = self.placement();
        let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| placed.at(e));
        [0, 1, 2].map(|row| [0, 1, 2].map(|column| columns[column][row]))
    }

    /// Returns the direction of the part that points up.
    pub fn up(&self) -> [f64; 3] {
        self.axes()[2]
    }
}

impl fmt::Display for Pose {
    /// Formats as `slice --rotate` takes it: `x:37.4,y:-81.1`; empty for the part as it is.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, (axis, degrees)) in self.turns().enumerate() {
            let comma = if k > 0 { "," } else { "" };
            write!(f, "{comma}{axis}:{degrees}")?;
        }
        Ok(())
    }
}

/// Returns poses to compare: the given one, poses with an axis up, and `count` spread evenly over
/// the directions at most `cone_deg` from the one that points up in the given pose.
///
/// The directions lie on a Fibonacci spiral: at equal steps of height, each turned by the golden
/// angle from the one before.
pub fn poses(count: u32, cone_deg: f64) -> Vec<Pose> {
    let lowest = cone_deg.clamp(0.0, 180.0).to_radians().cos();
    let golden_angle = PI * (3.0 - 5.0_f64.sqrt());
    let spiral = (0..count).map(|k| {
        let z = 1.0 - (1.0 - lowest) * (f64::from(k) + 0.5) / f64::from(count);
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = (golden_angle * f64::from(k)).sin_cos();
        [radius * cos, radius * sin, z]
    });
    let axes = (0..6).map(|k| {
        let mut axis = [0.0; 3];
        axis[k % 3] = if k < 3 { 1.0 } else { -1.0 };
        axis
    });
    let axes = axes.filter(|&axis| axis[2] >= lowest - 1e-12);
    // The given pose already has this direction up.
    let others = axes.chain(spiral).filter(|up| up[2] < 1.0);
    std::iter::once(Pose::GIVEN).chain(others.map(Pose::with_up)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degrees_between(a: [f64; 3], b: [f64; 3]) -> f64 {
        let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        dot.clamp(-1.0, 1.0).acos().to_degrees()
    }

    #[test]
    fn a_pose_turns_its_direction_up() {
        for up in [[0.6, -0.48, 0.64], [-0.6, 0.0, -0.8], [0.0, -0.6, -0.8], [0.48, 0.6, -0.64]] {
            let pose = Pose::with_up(up);
            let [x, y, z] = pose.placement().at(up);
            assert!(x.abs() < 2e-3 && y.abs() < 2e-3 && z > 1.0 - 1e-5, "{pose}");
            assert!(degrees_between(pose.up(), up) < 0.1);
        }
    }

    #[test]
    fn axes_are_quarter_turns() {
        let texts: Vec<_> = poses(0, 180.0).iter().map(ToString::to_string).collect();
        assert_eq!(texts, ["", "y:-90", "x:90", "y:90", "x:-90", "x:180"]);
        let ups: Vec<_> = poses(0, 180.0).iter().map(Pose::up).collect();
        assert_eq!(ups[1..4], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]);
        assert_eq!(poses(0, 89.0), [Pose::GIVEN]);
        assert_eq!(poses(0, 90.0).len(), 5);
    }

    #[test]
    fn directions_are_evenly_spread() {
        for (cone_deg, share) in [(180.0, 1.0), (30.0, (1.0 - 0.75f64.sqrt()) / 2.0)] {
            let ups: Vec<_> = poses(500, cone_deg).iter().map(Pose::up).collect();
            let axes = ups.len() - 500;
            let spiral = &ups[axes..];
            assert!(spiral.iter().all(|&up| degrees_between(up, [0.0, 0.0, 1.0]) < cone_deg + 0.1));
            // The diameter of a disc that has its 500th of the area.
            let width_deg = 4.0 * (share / 500.0f64).sqrt().to_degrees();
            for (k, &up) in spiral.iter().enumerate() {
                let others = spiral.iter().enumerate().filter(|&(other, _)| other != k);
                let nearest =
                    others.map(|(_, &other)| degrees_between(up, other)).fold(360.0, f64::min);
                assert!((0.6..1.1).contains(&(nearest / width_deg)), "{nearest} {width_deg}");
            }
        }
    }
}
