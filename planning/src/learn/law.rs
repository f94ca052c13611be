//! The laws that change times by the errors of a print (004 section 3.1).

use crate::speed::Wrong;

/// No time is shorter, in seconds (004 listing A.6).
pub const SHORTEST: f64 = 0.01;

/// How errors change times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// 004 eq. 3.5: each layer's time changes by its own error, times a gain in seconds a pixel.
    Single {
        /// The gain.
        gain: f64,
    },
    /// 004 eq. 3.6 to 3.8: by the mean error of the layers around, and by the errors of the
    /// layers below, whose doses it adds to.
    Multi(MultiLaw),
}

/// The numbers of 004 eq. 3.6 to 3.8, as listing A.6 has them.
///
/// Misprints of 004: eq. 3.6 divides a + 2 terms by a; here, the error is a mean. Eq. 3.8 lost its
/// coefficient, which listing A.6 has as `coef2`. The listing weights layers by the inverse square
/// of their number from the light; the inverse square of their distance must be meant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MultiLaw {
    /// The gain of a layer's own mean error, in seconds a pixel.
    pub gain: f64,
    /// The number of layers in a mean: `interv`. The mean takes the layers below where too much is
    /// cured, and the layers above where too little is.
    pub mean_of: usize,
    /// The number of layers above that change with a layer: `chng`.
    pub reach: usize,
    /// Their gain at a distance of one layer, in seconds a pixel; it falls with the square of
    /// the distance: `coef2`.
    pub reach_gain: f64,
}

impl Law {
    /// The gain of eq. 3.5 in 004's prints, in seconds per pixel of 10 um.
    pub const GAIN: f64 = 6e-6;

    /// Returns 004's numbers for several layers.
    pub fn multi(gain: f64) -> Self {
        // Both gains change together, so one number sets the law.
        let reach_gain = 8e-5 * gain / Self::GAIN;
        Self::Multi(MultiLaw { gain, mean_of: 10, reach: 350, reach_gain })
    }

    /// Returns the next times, in seconds, from the errors of a print with the present ones. An
    /// error is the number of voxels that should have been cured minus the number that should not,
    /// for each layer from the light on. `low` and `high` bound the times.
    pub fn next(&self, times: &[f64], errors: &[f64], [low, high]: [&[f64]; 2]) -> Vec<f64> {
        let changes = self.linear(errors, errors);
        let bounds = low.iter().zip(high);
        let next = times.iter().zip(changes).zip(bounds);
        next.map(|((time, change), (low, high))| {
            (time + change).clamp(low.max(SHORTEST), high.max(SHORTEST))
        })
        .collect()
    }

    /// Returns the changes of times that errors cause, without bounds; they are linear in `errors`.
    /// Where `signs` are negative, too much is cured.
    pub fn linear(&self, errors: &[f64], signs: &[f64]) -> Vec<f64> {
        match self {
            Self::Single { gain } => errors.iter().map(|error| gain * error).collect(),
            Self::Multi(law) => law.changes(errors, signs),
        }
    }

    /// Returns the gain, in seconds a pixel.
    pub fn gain(&self) -> f64 {
        match self {
            Self::Single { gain } | Self::Multi(MultiLaw { gain, .. }) => *gain,
        }
    }
}

impl MultiLaw {
    fn changes(&self, errors: &[f64], signs: &[f64]) -> Vec<f64> {
        let mut changes = vec![0.0; errors.len()];
        for layer in (0..errors.len()).filter(|&layer| signs[layer] != 0.0) {
            let around = if signs[layer] < 0.0 {
                layer..(layer + self.mean_of).min(errors.len())
            } else {
                (layer + 1).saturating_sub(self.mean_of)..layer + 1
            };
            let count = around.len() as f64;
            let mean = errors[around].iter().sum::<f64>() / count;
            // 004 eq. 3.5, with the mean error of eq. 3.6 instead of the layer's own.
            changes[layer] += self.gain * mean;
            for distance in 1..=self.reach.min(layer) {
                // 004 eq. 3.8: layers nearer to the light change as well, since part of their dose
                // passes down to this one.
                changes[layer - distance] += self.reach_gain * mean / (distance * distance) as f64;
            }
        }
        changes
    }
}

/// Returns the errors of a print: positive where too little is cured.
pub fn errors_of(layers: &[Wrong]) -> Vec<f64> {
    layers.iter().map(|wrong| wrong.under as f64 - wrong.over as f64).collect()
}
