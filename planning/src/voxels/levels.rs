//! Gray levels and their light.

use crate::light::Light;

/// The light of each gray level that may be exposed.
#[derive(Clone, Debug)]
pub(crate) struct Levels {
    light: [f32; 256],
    model: Light,
    least: u8,
}

impl Levels {
    /// Creates the levels of a model; `least` is the lowest that is not black.
    pub(crate) fn new(model: &Light, least: u8) -> Self {
        let light = std::array::from_fn(|level| model.of_level(level as u8) as f32);
        Self { light, model: *model, least }
    }

    /// Returns the light of a level.
    pub(crate) fn light(&self, level: u8) -> f32 {
        self.light[usize::from(level)]
    }

    /// Returns the light of all levels.
    pub(crate) fn lights(&self) -> &[f32; 256] {
        &self.light
    }

    /// Returns the light of the lowest level that is not black.
    pub(crate) fn least_light(&self) -> f32 {
        self.light(self.least)
    }

    /// Returns the level nearest to a light.
    pub(crate) fn nearest(&self, light: f64) -> u8 {
        self.without_dim(self.model.level_of(light))
    }

    /// Returns the lowest level that has at least a light.
    pub(crate) fn at_least(&self, light: f64) -> u8 {
        let nearest = self.model.level_of(light);
        // A light equal to a level's up to its last bits stays at that level.
        let enough = self.model.of_level(nearest) >= light - 1e-6;
        // Rounding down could leave a target just short of its dose.
        self.without_dim(if enough { nearest } else { nearest.saturating_add(1) })
    }

    fn without_dim(&self, level: u8) -> u8 {
        match level {
            dim if dim < self.least => {
                // The nearer of black and the least level, by light and not by level.
                if 2.0 * self.light(dim) < self.least_light() { 0 } else { self.least }
            }
            level => level,
        }
    }
}
