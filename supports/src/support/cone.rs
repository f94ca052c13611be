//! Directions over a cone.

/// Returns unit vectors, even over a cone about straight down, by a spiral of the golden angle. The
/// first points straight down, the last ones are tilted by `max_tilt` degrees.
pub(super) fn directions(count: u32, max_tilt: f64) -> Vec<[f64; 3]> {
    // On a sphere, bands of equal height have equal areas.
    let height = 1.0 - max_tilt.to_radians().cos();
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let direction = |k: u32| {
        let share = f64::from(k) / f64::from(count.saturating_sub(1).max(1));
        let down = 1.0 - height * share;
        let across = (1.0 - down * down).max(0.0).sqrt();
        let (sin, cos) = (golden * f64::from(k)).sin_cos();
        [across * cos, across * sin, -down]
    };
    (0..count).map(direction).collect()
}

/// Returns the directions at an angle in radians from one, each a sixth of a turn from the next;
/// directions outside the cone are tilted by `max_tilt` degrees instead.
pub(super) fn beside(direction: [f64; 3], angle: f64, max_tilt: f64) -> [[f64; 3]; 6] {
    let [x, y, z] = direction;
    // A level direction across; straight down, any will do.
    let level = x.hypot(y);
    let (turn_x, turn_y) = if level > 1e-9 { (x / level, y / level) } else { (1.0, 0.0) };
    let [across, up] = [[-turn_y, turn_x, 0.0], [z * turn_x, z * turn_y, -level]];
    [0, 1, 2, 3, 4, 5].map(|sixth| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(sixth) / 6.0).sin_cos();
        let turned = [0, 1, 2]
            .map(|k| direction[k] * angle.cos() + (across[k] * cos + up[k] * sin) * angle.sin());
        within(turned, max_tilt)
    })
}

/// Returns a direction, turned into the cone if it is outside.
fn within([x, y, z]: [f64; 3], max_tilt: f64) -> [f64; 3] {
    let (sin, cos) = max_tilt.to_radians().sin_cos();
    let level = x.hypot(y);
    if -z >= cos || level == 0.0 { [x, y, z] } else { [x / level * sin, y / level * sin, -cos] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_fill_the_cone_evenly() {
        let all = directions(400, 45.0);
        assert_eq!(all[0].map(f64::abs), [0.0, 0.0, 1.0]);
        let tilt = |d: &[f64; 3]| (-d[2]).acos().to_degrees();
        assert!(all.iter().all(|d| tilt(d) < 45.0 + 1e-9));
        assert!((tilt(&all[399]) - 45.0).abs() < 1e-9);
        // Each direction of the cone has one nearby: 400 over its area are 3.9° apart on a square
        // grid.
        for k in 0..2_000u32 {
            let (tilt, turn) = (45.0 * f64::from(k % 40) / 39.0, f64::from(k / 40) * 7.2);
            let (sin, cos) = tilt.to_radians().sin_cos();
            let (y, x) = turn.to_radians().sin_cos();
            let at = [sin * x, sin * y, -cos];
            let nearest = all.iter().map(|d| (0..3).map(|k| d[k] * at[k]).sum::<f64>());
            let degrees = nearest.fold(-1.0, f64::max).acos().to_degrees();
            assert!(degrees < 4.0, "{tilt} {turn}: {degrees}");
        }
        assert_eq!(directions(1, 30.0).len(), 1);
    }

    #[test]
    fn directions_beside_one_stay_in_the_cone() {
        for direction in directions(50, 45.0) {
            for turned in beside(direction, 0.05, 45.0) {
                let dot = |b: [f64; 3]| (0..3).map(|k| turned[k] * b[k]).sum::<f64>();
                assert!((dot(turned) - 1.0).abs() < 1e-12);
                assert!(-turned[2] >= 45f64.to_radians().cos() - 1e-12);
                assert!(dot(direction).acos() < 0.0501);
                let is_inside = -direction[2] > 42f64.to_radians().cos();
                assert!(!is_inside || (dot(direction).acos() - 0.05).abs() < 1e-9);
            }
        }
    }
}
