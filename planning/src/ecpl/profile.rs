//! The section of a round part: heights by the distance from its axis.

use super::cells::Cells;
use super::reactor::{Chamber, Reaction};
use crate::target::{Grid, HeightMap};

/// The cured shape: the height of each column of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// The chamber's cells.
    pub cells: Cells,
    /// Heights above the glass, in micrometers, from the axis.
    pub heights_um: Vec<f64>,
    /// The radius of the solid on the glass, in micrometers.
    pub base_um: f64,
}

impl Profile {
    pub(super) fn of(chamber: &Chamber, reaction: &Reaction) -> Self {
        Self {
            cells: *reaction.cells(),
            heights_um: chamber.heights_um(reaction),
            base_um: chamber.base_um(reaction),
        }
    }

    /// Returns the profile that is a share of the way to another one.
    pub(super) fn toward(&self, other: &Self, share: f64) -> Self {
        let between = |from: f64, to: f64| from + share * (to - from);
        let heights = self.heights_um.iter().zip(&other.heights_um);
        Self {
            cells: self.cells,
            heights_um: heights.map(|(&from, &to)| between(from, to)).collect(),
            base_um: between(self.base_um, other.base_um),
        }
    }

    /// Returns the height at the axis, in micrometers.
    pub fn sag_um(&self) -> f64 {
        self.heights_um.first().copied().unwrap_or(0.0)
    }

    /// Returns the greatest height, in micrometers.
    pub fn highest_um(&self) -> f64 {
        self.heights_um.iter().copied().fold(0.0, f64::max)
    }

    /// Returns the height at a distance from the axis, in micrometers.
    pub fn height_um(&self, radius_um: f64) -> f64 {
        height_um(&self.cells, &self.heights_um, radius_um)
    }

    /// Returns the heights of columns around the axis.
    pub fn on(&self, grid: &Grid) -> HeightMap {
        grid.round(|radius_um| self.height_um(radius_um))
    }
}

/// Returns the height at a distance from the axis, linearly between middles of columns.
fn height_um(cells: &Cells, heights_um: &[f64], radius_um: f64) -> f64 {
    let at = (radius_um / cells.width_um - 0.5).max(0.0);
    let column = at.floor() as usize;
    let height = |column: usize| heights_um.get(column).copied().unwrap_or(0.0);
    height(column) + (at - at.floor()) * (height(column + 1) - height(column))
}

/// A round part to be made: the height of each column of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct WantedProfile {
    /// The chamber's cells.
    pub cells: Cells,
    /// Heights above the glass, in micrometers, from the axis.
    pub heights_um: Vec<f64>,
}

impl WantedProfile {
    /// Takes the heights at the middles of columns.
    pub fn new(cells: &Cells, height_um: impl Fn(f64) -> f64) -> Self {
        let heights_um = (0..cells.across).map(|x| height_um(cells.middle_um(x))).collect();
        Self { cells: *cells, heights_um }
    }

    /// Returns the height at a distance from the axis, in micrometers.
    pub fn height_um(&self, radius_um: f64) -> f64 {
        height_um(&self.cells, &self.heights_um, radius_um)
    }

    /// Returns the greatest height, in micrometers.
    pub fn highest_um(&self) -> f64 {
        self.heights_um.iter().copied().fold(0.0, f64::max)
    }

    /// Returns the most by which the cured profile is too low and too high, in micrometers.
    pub fn extremes_um(&self, cured: &Profile) -> [f64; 2] {
        let off = || self.heights_um.iter().zip(&cured.heights_um).map(|(wanted, um)| um - wanted);
        [off().fold(0.0, |most: f64, off| most.max(-off)), off().fold(0.0, f64::max)]
    }

    /// Returns the root mean square of cured minus wanted height, in micrometers, over the glass
    /// where either is above zero.
    pub fn rms_um(&self, cured: &Profile) -> f64 {
        self.rms_below(cured, f64::INFINITY)
    }

    /// Returns the same for the part up to a height.
    pub(super) fn rms_below(&self, cured: &Profile, most_um: f64) -> f64 {
        let [mut sum, mut area] = [0.0; 2];
        for (x, (wanted, height)) in self.heights_um.iter().zip(&cured.heights_um).enumerate() {
            if *wanted > 0.0 || *height > 0.0 {
                let weight = cured.cells.weight(x);
                sum += weight * (height - wanted.min(most_um)).powi(2);
                area += weight;
            }
        }
        if area > 0.0 { (sum / area).sqrt() } else { 0.0 }
    }
}
