//! Follows narrow places from layer to layer: one pin, fin, slot or hole is one finding.

use lamp_stack::sets::{root, unite};

use super::findings::{Listed, NarrowFeature, Region};
use super::narrow::Narrow;

/// The least height of a narrow feature, as a share of its rule's limit: a wedge of 60 degrees is lower
/// where it is narrower, as where slopes begin and end.
const LEAST_HEIGHT: f64 = 0.75;
/// The fewest layers of a narrow feature: of thick layers, one or two are such a wedge.
const LEAST_LAYERS: u32 = 3;
/// The height, in its rule's limits, over which an edge may be wide enough and still be the same feature:
/// one about as long as a corner comes and goes with the rounding of pixels.
const GAP: f64 = 5.0;
/// How far apart, in limits, its places below and above may be.
const ASIDE: f64 = 2.0;
/// The most features that are compared for gaps.
const MOST_WITH_GAPS: usize = 2_000;

/// A narrow place of a layer, and the rule that it breaks.
#[derive(Clone, Debug)]
pub(super) struct Breach {
    pub(super) place: Narrow,
    /// The number of the rule in the options.
    pub(super) rule: usize,
    /// The rule's limit in widths of a pixel.
    pub(super) limit: f64,
}

/// The narrow features of the layers so far.
#[derive(Debug, Default)]
pub(super) struct Narrows {
    /// The number of layers of which a feature has some, where heights are not known.
    least_layers: u32,
    /// The width of a pixel in micrometers, if it is known.
    pixel_um: Option<f64>,
    /// The last layer's runs with the numbers of their features in `open`, sorted.
    last: Vec<(u32, u32, u32, usize)>,
    open: Vec<Growing>,
    ended: Listed<Growing>,
}

/// A feature that may go on.
#[derive(Clone, Debug)]
struct Growing {
    feature: NarrowFeature,
    /// The sum of its layers' thicknesses, if all are known.
    height_um: Option<f64>,
    /// The number of its layers.
    count: u32,
    /// The rectangles around it in its first and its last layer.
    ends: [Region; 2],
}

impl Narrows {
    pub(super) fn new(least_layers: u32, pixel_um: Option<f64>) -> Self {
        Self { least_layers, pixel_um, ..Self::default() }
    }

    /// Adds a layer's places. A place continues the places of the last layer with which it has pixels of
    /// a color in common.
    pub(super) fn add(&mut self, breaches: &[Breach], number: u32, thickness_um: Option<f64>) {
        if breaches.is_empty() && self.open.is_empty() {
            return;
        }
        let mut all = std::mem::take(&mut self.open);
        let before = all.len();
        all.extend(breaches.iter().map(|breach| Growing::new(breach, number, thickness_um)));
        let mut parents: Vec<u32> = (0..all.len() as u32).collect();
        let mut runs: Vec<_> = (before..)
            .zip(breaches)
            .flat_map(|(own, breach)| {
                let runs = breach.place.runs.iter();
                runs.map(move |(row, run)| (*row, run.start, run.end, own))
            })
            .collect();
        runs.sort_unstable();
        let (mut i, mut j) = (0, 0);
        while let (Some(a), Some(b)) = (self.last.get(i), runs.get(j)) {
            let alike = all[a.3].feature.is_white == all[b.3].feature.is_white;
            if a.0 == b.0 && a.1.max(b.1) < a.2.min(b.2) && alike {
                unite(&mut parents, a.3 as u32, b.3 as u32);
            }
            if (a.0, a.2) <= (b.0, b.2) { i += 1 } else { j += 1 }
        }
        let mut root_of = |item: usize| root(&mut parents, item as u32) as usize;
        let mut kept: Vec<usize> = (before..all.len()).map(&mut root_of).collect();
        kept.sort_unstable();
        kept.dedup();
        let mut merged: Vec<Option<Growing>> = vec![None; all.len()];
        for (k, growing) in all.into_iter().enumerate() {
            match &mut merged[root_of(k)] {
                Some(first) => first.unite(growing),
                none => *none = Some(growing),
            }
        }
        let place = |root: usize| kept.binary_search(&root).expect("it is kept");
        runs.iter_mut().for_each(|run| run.3 = place(root_of(run.3)));
        self.last = runs;
        self.open = kept.iter().filter_map(|&k| merged[k].take()).collect();
        merged.into_iter().flatten().for_each(|growing| self.end(growing));
    }

    /// Ends all features, and returns them. Features that follow each other above a short gap are one.
    pub(super) fn finish(mut self) -> Listed<NarrowFeature> {
        std::mem::take(&mut self.open).into_iter().for_each(|growing| self.end(growing));
        let Listed { mut list, left_out } = std::mem::take(&mut self.ended);
        if list.len() <= MOST_WITH_GAPS {
            list.sort_by_key(|growing| (growing.feature.layers, growing.feature.at));
            let mut parents: Vec<u32> = (0..list.len() as u32).collect();
            for (upper, above) in (0..).zip(&list) {
                for (lower, below) in (0..upper).zip(&list) {
                    if self.is_continued(below, above) {
                        unite(&mut parents, lower, upper);
                    }
                }
            }
            let mut joined: Vec<Option<Growing>> = vec![None; list.len()];
            for (at, growing) in (0..).zip(list) {
                match &mut joined[root(&mut parents, at) as usize] {
                    Some(first) => first.unite(growing),
                    none => *none = Some(growing),
                }
            }
            list = joined.into_iter().flatten().collect();
        }
        Listed { list: list.into_iter().map(|growing| growing.feature).collect(), left_out }
    }

    /// Returns whether a feature goes on in another, above a short gap.
    fn is_continued(&self, below: &Growing, above: &Growing) -> bool {
        let [a, b] = [&below.feature, &above.feature];
        let Some(gap) = b.layers[0].checked_sub(a.layers[1] + 1) else { return false };
        let limit = a.limit.max(b.limit);
        let is_short = match below.height_um.zip(self.pixel_um) {
            Some((um, pixel_um)) => {
                f64::from(gap) * um / f64::from(below.count) <= GAP * limit * pixel_um
            }
            None => gap <= self.least_layers,
        };
        let aside = (ASIDE * limit).min(1e9) as u32;
        a.is_white == b.is_white && is_short && below.ends[1].is_near(&above.ends[0], [aside; 2])
    }

    /// Lists a feature, unless it is the low edge of something wider.
    fn end(&mut self, growing: Growing) {
        let layers = growing.count;
        let is_high = match growing.height_um.zip(self.pixel_um) {
            Some((height_um, pixel_um)) => {
                layers >= LEAST_LAYERS
                    && height_um > LEAST_HEIGHT * growing.feature.limit * pixel_um
            }
            None => layers >= self.least_layers,
        };
        if is_high {
            self.ended.push(growing);
        }
    }
}

impl Growing {
    fn new(breach: &Breach, layer: u32, height_um: Option<f64>) -> Self {
        let Breach { place, rule, limit } = breach;
        let feature = NarrowFeature {
            is_white: place.is_white,
            rule: *rule,
            layers: [layer; 2],
            width: place.width,
            limit: *limit,
            narrowest_layer: layer,
            at: place.at,
            length: place.length,
            region: place.region.clone(),
            runs: place.runs.clone(),
        };
        let ends = [place.region.clone(), place.region.clone()];
        Self { feature, height_um, count: 1, ends }
    }

    fn unite(&mut self, other: Self) {
        let Self { feature, height_um, count, ends: [first, last] } = other;
        let own = &mut self.feature;
        let is_later = feature.layers[0] > own.layers[1];
        let mut end = |end: usize, other: &Region, layer: u32| {
            if layer == own.layers[end] {
                self.ends[end].unite(other);
            } else if (layer < own.layers[0] && end == 0) || (layer > own.layers[1] && end == 1) {
                self.ends[end] = other.clone();
            }
        };
        end(0, &first, feature.layers[0]);
        end(1, &last, feature.layers[1]);
        self.count = if is_later { self.count + count } else { self.count.max(count) };
        own.layers = [own.layers[0].min(feature.layers[0]), own.layers[1].max(feature.layers[1])];
        own.length = own.length.max(feature.length);
        own.region.unite(&feature.region);
        if feature.width < own.width {
            (own.width, own.at, own.runs) = (feature.width, feature.at, feature.runs);
            (own.rule, own.narrowest_layer) = (feature.rule, feature.narrowest_layer);
            own.limit = feature.limit;
        }
        self.height_um = match (self.height_um, height_um) {
            (Some(own), Some(other)) if is_later => Some(own + other),
            (Some(own), Some(other)) => Some(own.max(other)),
            _ => None,
        };
    }
}
