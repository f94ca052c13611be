//! Computes the light of whole columns, for gray levels whose doses add up.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use lamp_stack::{FadingLevels, LevelSteps};

use crate::gray::LayerLevels;
use crate::planes::Planes;

/// Light from more than this many penetration depths above does not count: less than a 4000th of it
/// is left, which moves no surface by more than a micrometer.
const LOOK_UP_DEPTHS: f64 = 8.3;

/// Layers look slightly below their bottoms, so that rounding hides no underside there.
const BEYOND_UM: f64 = 0.1;

/// The light that all layers of a part leave below them.
#[derive(Debug)]
pub(crate) struct PrintThrough {
    levels: LayerLevels<FadingLevels>,
    tops_um: Vec<f64>,
    /// The critical doses at each layer's top if it and all layers above it are white.
    white: Vec<f64>,
    reach_um: f64,
    within_um: f64,
    /// The greatest number of layers above a layer that count.
    most_above: u32,
    /// For each layer, the first layer whose top its light reaches.
    first_in_reach: Vec<u32>,
    known: Mutex<HashMap<Surroundings, Arc<LevelsByDepth>>>,
}

impl PrintThrough {
    pub(crate) fn new(levels: LayerLevels<FadingLevels>, planes: &Planes) -> Self {
        let tops_um: Vec<f64> = (0..planes.len()).map(|layer| planes.top_um(layer)).collect();
        let mut white = vec![0.0; tops_um.len()];
        let (mut reach_um, mut most_um, mut above) = (0.0_f64, 0.0_f64, None);
        for layer in (0..tops_um.len()).rev() {
            let own = levels.of_layer(layer);
            let faded = |(from, share): (f64, f64)| {
                share * ((tops_um[layer] - from) / own.depth_um(255)).exp()
            };
            white[layer] = own.share(255) + above.map_or(0.0, faded);
            above = Some((tops_um[layer], white[layer]));
            // Beer-Lambert: share e^(-depth / Dp) falls to 1, the critical dose, at Dp ln(share).
            let reach = own.depth_um(255) * white[layer].ln();
            // Where even white falls short, the underside within the layer must still be found.
            reach_um = reach_um.max(reach).max(planes.thickness_um(layer));
            most_um = most_um.max(planes.thickness_um(layer));
        }
        let within_um = most_um + BEYOND_UM;
        let known = Mutex::default();
        let reaches =
            |top_um: &f64| tops_um.partition_point(|below_um| top_um - below_um >= reach_um) as u32;
        let (most_above, first_in_reach) = (0, tops_um.iter().map(reaches).collect());
        let mut light =
            Self { levels, tops_um, white, reach_um, within_um, most_above, first_in_reach, known };
        let above = |layer| (light.end_above(layer) - 1 - layer) as u32;
        light.most_above = (0..light.len()).map(above).max().unwrap_or(0);
        light
    }

    /// Returns the light that each level of each layer leaves below.
    pub(crate) fn levels(&self) -> &LayerLevels<FadingLevels> {
        &self.levels
    }

    /// Returns the greatest number of layers above a layer that count.
    pub(crate) fn most_above(&self) -> u32 {
        self.most_above
    }

    /// Returns the depth that layers examine: their own thickness. Further down, the layers below
    /// have the depths.
    pub(crate) fn within_um(&self) -> f64 {
        self.within_um
    }

    pub(crate) fn of_layer(&self, layer: usize) -> &FadingLevels {
        self.levels.of_layer(layer)
    }

    /// Returns the first layer that is too far up to count for a layer.
    pub(crate) fn end_above(&self, layer: usize) -> usize {
        let far_um = self.tops_um[layer] + LOOK_UP_DEPTHS * self.of_layer(layer).depth_um(255);
        self.tops_um.partition_point(|top_um| *top_um <= far_um)
    }

    /// Returns the number of layers.
    pub(crate) fn len(&self) -> usize {
        self.tops_um.len()
    }

    /// Returns the distance between a layer's top and the top of the layer below, if there is one.
    pub(crate) fn step_um(&self, layer: usize) -> f64 {
        layer.checked_sub(1).map_or(f64::INFINITY, |below| self.distance_um(layer, below))
    }

    /// Returns the distance between a layer's top and the top of a layer below.
    pub(crate) fn distance_um(&self, layer: usize, below: usize) -> f64 {
        self.tops_um[layer] - self.tops_um[below]
    }

    /// Returns the light that the layers below leave at a depth under a layer's top if all of them,
    /// down to there, have the least level. No pixel of the part is black, so that outlines stay.
    pub(crate) fn least_below(&self, layer: usize, depth_um: f64) -> f64 {
        let here_um = self.tops_um[layer] - depth_um;
        let below = (0..layer).rev().take_while(|&below| self.tops_um[below] > here_um);
        below.map(|below| self.of_layer(below).left(1, self.tops_um[below] - here_um)).sum()
    }

    /// Returns the first layer below whose depths count for a layer.
    pub(crate) fn first_below(&self, layer: usize) -> usize {
        let far_um = self.tops_um[layer] - self.reach_um;
        self.tops_um.partition_point(|top_um| *top_um < far_um)
    }

    /// Returns the first layer whose top a layer's light reaches.
    pub(crate) fn first_in_reach(&self, layer: usize) -> u32 {
        self.first_in_reach[layer]
    }

    /// Returns the levels by depth of a layer under this number of white layers, or under white as
    /// far up as it counts.
    pub(crate) fn levels_by_depth(
        &self,
        layer: usize,
        white_above: Option<usize>,
    ) -> Arc<LevelsByDepth> {
        let around = Surroundings::of(self, layer, white_above);
        if let Some(known) = self.known.lock().expect("no thread failed").get(&around) {
            return Arc::clone(known);
        }
        // Without the lock, so that no thread waits. Two may do the same work, with one result.
        let levels = Arc::new(around.levels(&self.levels, self.reach_um));
        self.known.lock().expect("no thread failed").insert(around, Arc::clone(&levels));
        levels
    }

    /// Returns the critical doses that white layers above leave at a layer's top.
    fn light_above(&self, layer: usize, white_above: Option<usize>) -> f64 {
        let depth_um = self.of_layer(layer).depth_um(255);
        let faded = |above: usize| ((self.tops_um[layer] - self.tops_um[above]) / depth_um).exp();
        match white_above {
            None => self.white.get(layer + 1).map_or(0.0, |white| white * faded(layer + 1)),
            Some(count) => (layer + 1..=layer + count)
                .map(|above| self.of_layer(above).share(255) * faded(above))
                .sum(),
        }
    }
}

/// The data that determines a layer's levels by depth, rounded: layers with equal surroundings
/// share the levels, whichever layer is first.
#[derive(Debug, PartialEq, Eq, Hash)]
struct Surroundings {
    levels: usize,
    /// The critical doses from above, in millionths.
    above: i64,
    /// The distances down to the tops of the layers below, in nanometers, and the numbers of their
    /// levels.
    below: Vec<(i64, usize)>,
}

impl Surroundings {
    fn of(light: &PrintThrough, layer: usize, white_above: Option<usize>) -> Self {
        let above = light.light_above(layer, white_above);
        let tops_um = &light.tops_um;
        let below = (light.first_below(layer)..layer).rev().map(|below| {
            let down_nm = (tops_um[layer] - tops_um[below]) * 1000.0;
            (down_nm.round() as i64, light.levels.number_of(below))
        });
        let below = below.collect();
        Self { levels: light.levels.number_of(layer), above: (above * 1e6).round() as i64, below }
    }

    fn levels(&self, all: &LayerLevels<FadingLevels>, reach_um: f64) -> LevelsByDepth {
        let own = all.numbered(self.levels);
        let above = self.above as f64 / 1e6;
        let white_um = own.depth_um(255);
        let left = |depth_um: f64| {
            let least = self.below.iter().map(|&(down_nm, levels)| {
                let depth_um = depth_um - down_nm as f64 / 1000.0;
                if depth_um > 0.0 { all.numbered(levels).left(1, depth_um) } else { 0.0 }
            });
            1.0 - above * (-depth_um / white_um).exp() - least.sum::<f64>()
        };
        let (mut from_um, mut step_um, mut rising_um) = (0.0, 1.0, 0.0_f64);
        let steps_um = (0..255).map(|step| {
            let is_above = |depth_um: f64| own.is_above(step, depth_um, left(depth_um));
            // Steps follow each other closely, so the search starts near the previous one.
            let (mut low, mut high) = (from_um, from_um + 2.0 * step_um);
            while high < reach_um && !is_above(high) {
                (low, high) = (high, high + 2.0 * (high - from_um));
            }
            high = high.min(reach_um);
            // A hundredth of a micrometer is far below any error of a cure depth.
            while high - low > 0.01 {
                let middle = f64::midpoint(low, high);
                if is_above(middle) { high = middle } else { low = middle }
            }
            step_um = (high - from_um).max(0.1);
            from_um = low;
            // Levels must not fall with depth, whatever the search finds.
            rising_um = high.max(rising_um);
            rising_um
        });
        let steps_um: Vec<f64> = steps_um.collect();
        // The depth at which white itself leaves the critical dose.
        let falls_short_um = white_um * (above + own.share(255)).ln();
        let [first_um, white_um] = [steps_um[1], steps_um[254]];
        LevelsByDepth { first_um, white_um, steps: LevelSteps::new(steps_um), falls_short_um }
    }
}

/// The levels of a layer whose columns above are known.
#[derive(Debug)]
pub(crate) struct LevelsByDepth {
    /// The depth up to which the least level is enough.
    pub(crate) first_um: f64,
    /// The depth from which on white is needed.
    pub(crate) white_um: f64,
    steps: LevelSteps,
    /// The depth that even white does not cure.
    pub(crate) falls_short_um: f64,
}

impl LevelsByDepth {
    /// Returns the level of a pixel with this depth of part below it.
    #[inline]
    pub(crate) fn level(&self, depth_um: f64) -> u8 {
        self.steps.level(depth_um).max(1)
    }
}
