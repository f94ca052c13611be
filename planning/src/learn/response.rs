//! The effect of a change of times on the number of cured voxels.

use lamp_stack::Length;

use crate::light::{LayerLight, Light};
use crate::speed::{PartError, Simulation, TimedPart};

/// The doses over which voxels that cross the critical dose are counted: 1 / 1.3 to 1.3 times the
/// present. Edges are pixels apart, so a smaller range would see all of them or none.
const RANGE: f64 = 1.3;

/// The matrix `G`: the number of voxels of layer k that are cured for one more second of layer n.
/// `G_kn = s_k q^(k-n)` for n ≤ k, with layers counted from the light.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// The voxels of each layer that cross the critical dose, per unit of dose of a wide white field.
    per_dose: Vec<f64>,
    /// The share that passes from the layer above, and the dose of a second.
    layers: Vec<LayerLight>,
}

impl Response {
    /// Computes the response at a part's times, in seconds.
    pub fn of(simulation: &Simulation<'_>, times: &[f64]) -> Self {
        let scaled = |share: f64| times.iter().map(|time| time * share).collect::<Vec<_>>();
        let (more, less) = (scaled(RANGE), scaled(1.0 / RANGE));
        let [more, less] = simulation.tally([&more, &less]);
        let doses = simulation.field_doses(times);
        // All voxels that become cured count, wanted or not: a change of dose moves both.
        let crossed = more
            .layers
            .iter()
            .zip(&less.layers)
            .map(|(more, less)| (more.over - less.over) + (less.under - more.under));
        // A central difference over the logarithm of the dose; d ln e = de / e.
        let per_log_dose = crossed.map(|voxels| voxels as f64 / (2.0 * RANGE.ln()));
        let per_dose = per_log_dose.zip(doses).map(|(voxels, dose)| voxels / dose).collect();
        let layers = simulation.layers().to_vec();
        Self { per_dose, layers }
    }

    /// Returns the same with another penetration depth: light fades by e over `share` times the
    /// depth of the model.
    ///
    /// # Errors
    /// Returns an error if the model's numbers are impossible.
    pub fn at_depth(&self, part: &TimedPart, light: &Light, share: f64) -> Result<Self, PartError> {
        let depth = Length::from_um(light.penetration_depth.um() * share);
        let other = part.per_second(&Light { penetration_depth: depth, ..*light })?;
        let layers = self
            .layers
            .iter()
            .zip(other)
            .map(|(layer, other)| LayerLight { passed: other.passed, ..*layer });
        Ok(Self { layers: layers.collect(), ..self.clone() })
    }

    /// Returns the voxels of each layer that a second of its own light cures: `s`.
    pub fn per_second(&self) -> Vec<f64> {
        self.per_dose.iter().zip(&self.layers).map(|(voxels, layer)| voxels * layer.own).collect()
    }

    /// Returns the number of additional voxels that are cured in each layer: `G dt`.
    pub fn apply(&self, changes: &[f64]) -> Vec<f64> {
        let mut dose = 0.0;
        let layers = self.layers.iter().zip(&self.per_dose).zip(changes);
        let cured = layers.map(|((layer, voxels), change)| {
            // 004 eq. 2.5: a change of time reaches the layers below as the light itself does.
            dose = dose * layer.passed + layer.own * change;
            dose * voxels
        });
        cured.collect()
    }
}
