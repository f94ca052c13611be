//! Errors of a part that is cured away from its place.

use std::f64::consts::TAU;

use super::profile::{Profile, WantedProfile};

/// Directions in which a part is compared: enough for a mean of squares that change like a cosine
/// and its square.
const DIRECTIONS: usize = 16;

impl WantedProfile {
    /// Returns the root mean square of cured minus wanted height, in micrometers, when the whole
    /// cured part is displaced by `aside_um`.
    ///
    /// All bitmaps come from one display, so one displacement moves the whole part and leaves its
    /// shape unchanged.
    pub fn rms_aside_um(&self, cured: &Profile, aside_um: f64) -> f64 {
        let [mut sum, mut area] = [0.0; 2];
        for x in 0..self.heights_um.len() {
            let (r, wanted) = (self.cells.middle_um(x), self.heights_um[x]);
            for direction in 0..DIRECTIONS {
                let angle = TAU * direction as f64 / DIRECTIONS as f64;
                let from = (r + aside_um * angle.cos()).hypot(aside_um * angle.sin());
                let height = cured.height_um(from);
                if wanted > 0.0 || height > 0.0 {
                    sum += self.cells.weight(x) * (height - wanted).powi(2);
                    area += self.cells.weight(x);
                }
            }
        }
        if area > 0.0 { (sum / area).sqrt() } else { 0.0 }
    }
}
