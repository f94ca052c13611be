//! Computes the cure by given times.

use lamp_stack::Mask;

use super::columns::{ColumnSet, PixelColumns};
use super::dose_curve::{DoseCurves, DoseGrid};
use super::gather::{Gather, LightBits, LightField};
use super::part::{PartError, TimedPart};
use super::tally::{GradualWrong, Tally, gradual_wrong};
use crate::blur::Blur;
use crate::light::{LayerLight, Light};

/// The share of the memory for columns, and the most that is useful.
const COLUMNS_SHARE: u64 = 4;
const MOST_COLUMN_BYTES: u64 = 64 << 20;

/// The most bytes that help a plan of times: more than that in
/// [`SpeedOptions::memory`](super::SpeedOptions::memory) changes nothing.
pub const MOST_SPEED_MEMORY: u64 = COLUMNS_SHARE * MOST_COLUMN_BYTES;

/// A part under a light, whose layers can be given times.
pub struct Simulation<'a> {
    gather: Gather<'a>,
    layers: Vec<LayerLight>,
    columns: PixelColumns,
    sampled: u32,
}

impl<'a> Simulation<'a> {
    /// Prepares a part, in `memory` bytes.
    ///
    /// # Errors
    /// Returns an error if the model's numbers are impossible.
    pub fn new(part: &'a TimedPart, light: &Light, memory: u64) -> Result<Self, PartError> {
        Self::prepared(part, light, memory, 1, LightBits::All)
    }

    /// Prepares a part to learn from it: light is rounded, so that more columns are equal. Each column
    /// stands for `least` pixels or more: the same part needed so many under a similar light.
    pub(crate) fn rounded(
        part: &'a TimedPart,
        light: &Light,
        memory: u64,
        least: u32,
    ) -> Result<Self, PartError> {
        Self::prepared(part, light, memory, least, LightBits::Twelve)
    }

    fn prepared(
        part: &'a TimedPart,
        light: &Light,
        memory: u64,
        least: u32,
        kept: LightBits,
    ) -> Result<Self, PartError> {
        let layers = reaches(part, light)?;
        let gather = Gather::new(part, light, kept);
        let bytes = (memory / COLUMNS_SHARE).min(MOST_COLUMN_BYTES);
        let (columns, sampled) = gather.columns(bytes as usize, least.isqrt());
        Ok(Self { gather, layers, columns, sampled })
    }

    /// Prepares a part as [`new`](Self::new) does, in a machine's light. No search sees its columns.
    pub(crate) fn in_field(
        part: &'a TimedPart,
        light: &Light,
        field: LightField,
        memory: u64,
    ) -> Result<Self, PartError> {
        let layers = reaches(part, light)?;
        let gather = Gather::in_field(part, light, LightBits::All, Some(field));
        let bytes = (memory / COLUMNS_SHARE).min(MOST_COLUMN_BYTES);
        let (columns, sampled) = match gather.all_in(bytes as usize) {
            Some(all) => (all, 1),
            None => (ColumnSet::new(layers.len()).finish(), 0),
        };
        Ok(Self { gather, layers, columns, sampled })
    }

    /// Changes the light. Light must spread as before, since the light of the
    /// columns depends on it.
    pub(crate) fn relight(&mut self, part: &TimedPart, light: &Light) -> Result<(), PartError> {
        self.layers = reaches(part, light)?;
        Ok(())
    }

    /// Counts the result of each set of times, in seconds, the layer nearest to the light first.
    ///
    /// # Panics
    /// Panics if the number of times is not the number of layers.
    pub fn tally<const N: usize>(&self, times: [&[f64]; N]) -> [Tally; N] {
        assert!(times.iter().all(|times| times.len() == self.layers.len()));
        let of =
            |columns: &PixelColumns| times.map(|times| Tally::of(columns, &self.layers, times));
        // The search may see a sample; counts are always of every voxel.
        if self.sampled == 1 {
            return of(&self.columns);
        }
        let mut sums = times.map(|_| Tally::none(self.layers.len()));
        for tallies in self.gather.tiles(|set| of(&set.finish())) {
            sums.iter_mut().zip(&tallies).for_each(|(sum, tally)| sum.add(tally));
        }
        sums
    }

    /// Counts the result of each set of times in the columns that a search sees: an estimate, if
    /// they are a sample.
    pub(crate) fn estimate<const N: usize>(&self, times: [&[f64]; N]) -> [Tally; N] {
        times.map(|times| Tally::of(&self.columns, &self.layers, times))
    }

    /// Returns the wrong voxels of each layer where a voxel's cured share rises straight from 0 to 1
    /// over this range around the critical dose.
    pub(crate) fn gradual_wrong(&self, times: &[f64], half_range: f64) -> Vec<GradualWrong> {
        gradual_wrong(&self.columns, &self.layers, times, half_range)
    }

    /// Counts the wrong voxels of each layer, or of all together, where all doses are larger by some
    /// factors.
    pub(crate) fn dose_curves(&self, times: &[f64], grid: &DoseGrid, by_layer: bool) -> DoseCurves {
        DoseCurves::of(&self.columns, &self.layers, times, grid, by_layer)
    }

    /// Returns the dose of each layer under a wide white field.
    pub fn field_doses(&self, times: &[f64]) -> Vec<f64> {
        let mut dose = 0.0;
        let of_layer = |(layer, time): (&LayerLight, &f64)| {
            // 004 eq. 2.5 from layer to layer.
            dose = dose * layer.passed + layer.own * time;
            dose
        };
        self.layers.iter().zip(times).map(of_layer).collect()
    }

    /// Returns the times that bring every layer to a dose under a wide white field. A layer that
    /// the layers above bring to this dose has time zero.
    ///
    /// With the dose 2, a wide prism has its critical dose at its walls, where light has fallen to
    /// a half.
    pub fn times_for(&self, dose: f64) -> Vec<f64> {
        let mut above = 0.0;
        let of_layer = |layer: &LayerLight| {
            // A layer can get more light, but the light that reaches it from above cannot be
            // removed.
            let passed = above * layer.passed;
            above = passed.max(dose);
            (above - passed) / layer.own
        };
        self.layers.iter().map(of_layer).collect()
    }

    /// Returns the dose of a pixel in each layer, in units of the critical dose.
    pub fn doses_at(&self, pixel: [u32; 2], times: &[f64]) -> Vec<f64> {
        self.doses_of(&self.light_at(pixel), times)
    }

    /// Returns the pixels of each layer that are cured, the layer nearest to the light first. Images
    /// are larger than the part's: to each side by a number of pixels, which is returned, too.
    pub(crate) fn cured(&self, times: &[f64]) -> (Vec<Mask>, usize) {
        self.gather.cured(&self.layers, times)
    }

    /// Returns the light of a pixel in each layer.
    pub(crate) fn light_at(&self, pixel: [u32; 2]) -> Vec<f32> {
        self.gather.light_at(pixel)
    }

    /// Returns the dose of a pixel with this light in each layer.
    pub(crate) fn doses_of(&self, light: &[f32], times: &[f64]) -> Vec<f64> {
        let mut dose = 0.0;
        let of_layer = |((layer, time), light): ((&LayerLight, &f64), &f32)| {
            dose = dose * layer.passed + layer.own * time * f64::from(*light);
            dose
        };
        self.layers.iter().zip(times).zip(light).map(of_layer).collect()
    }

    /// Returns the light that reaches each layer in a second.
    pub(crate) fn layers(&self) -> &[LayerLight] {
        &self.layers
    }

    /// Returns the columns that a search sees.
    pub(crate) fn columns(&self) -> &PixelColumns {
        &self.columns
    }

    /// Returns the number of pixels that each column of a search stands for: 0 if it has none.
    pub(crate) fn sampled(&self) -> u32 {
        self.sampled
    }
}

/// Returns the light that reaches each layer in a second, for columns that have the light 1 under a
/// wide white field.
fn reaches(part: &TimedPart, light: &Light) -> Result<Vec<LayerLight>, PartError> {
    let field = Blur::<f32>::of_scan(part.spread_pixels(light)).sum();
    let per_second = part.per_second(light)?.into_iter();
    Ok(per_second.map(|layer| LayerLight { own: layer.own * field, ..layer }).collect())
}
