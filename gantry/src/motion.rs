//! How long the head moves.

use lamp_machine::Scan;

/// The least time of a move between two rests, in seconds, at constant acceleration: a triangle of
/// speeds, or a trapezoid if the way is long enough to reach the greatest speed.
///
/// With the way d, the speed V and the acceleration a, that is 2 sqrt(d / a) up to d = V^2 / a, and
/// d / V + V / a beyond.
pub fn move_s(way_mm: f64, speed_mm_per_s: f64, acceleration_mm_per_s2: f64) -> f64 {
    let (way, speed, acceleration) = (way_mm.abs(), speed_mm_per_s, acceleration_mm_per_s2);
    if way * acceleration <= speed * speed {
        2.0 * (way / acceleration).sqrt()
    } else {
        way / speed + speed / acceleration
    }
}

/// How the head moves along the swaths of a layer, and between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Motion {
    /// The speed on swaths.
    pub scan_mm_per_s: f64,
    /// The greatest speed elsewhere.
    pub most_mm_per_s: f64,
    pub acceleration_mm_per_s2: f64,
    /// The rest before each swath.
    pub settle_s: f64,
}

impl Motion {
    pub(crate) fn new(scan: &Scan, scan_mm_per_s: f64) -> Self {
        Self {
            scan_mm_per_s,
            most_mm_per_s: scan.speed[1].mm_per_s().max(scan_mm_per_s),
            acceleration_mm_per_s2: scan.acceleration.mm_per_s2(),
            settle_s: scan.settle_s,
        }
    }

    /// The way on which the head reaches the speed of a swath, or stops after it.
    pub(crate) fn run_up_mm(&self) -> f64 {
        self.scan_mm_per_s * self.scan_mm_per_s / (2.0 * self.acceleration_mm_per_s2)
    }

    /// The time of a swath from rest to rest: the run-up, the way in the light, the stop.
    pub(crate) fn swath_s(&self, way_mm: f64) -> f64 {
        way_mm / self.scan_mm_per_s + 2.0 * self.scan_mm_per_s / self.acceleration_mm_per_s2
    }

    /// The time between two rests, given as x and y: both axes move at once. A swath begins after it,
    /// so the head settles.
    pub(crate) fn step_s(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        let axis = |axis: usize| {
            move_s(to[axis] - from[axis], self.most_mm_per_s, self.acceleration_mm_per_s2)
        };
        axis(0).max(axis(1)) + self.settle_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moves_are_triangles_and_trapezoids() {
        // 10 mm at 1000 mm/s2: half of it takes sqrt(2 * 5 / 1000) s.
        assert!((move_s(10.0, 200.0, 1000.0) - 0.2).abs() < 1e-12);
        // 100 mm at 200 mm/s: 0.2 s and 20 mm up, the same down, 60 mm between.
        assert!((move_s(-100.0, 200.0, 1000.0) - 0.7).abs() < 1e-12);
        assert_eq!(move_s(0.0, 200.0, 1000.0), 0.0);
        // Both forms agree where they meet.
        assert!((move_s(40.0, 200.0, 1000.0) - move_s(40.0 + 1e-9, 200.0, 1000.0)).abs() < 1e-9);
    }
}
