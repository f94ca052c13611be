//! Pins and holes that are long for their width.
//!
//! A pin or a hole is a compact component that continues one component of the layer below, alone, and is
//! continued alone. Its width in a layer is the least distance of two parallel lines that hold it; its length
//! goes along the middles of its layers. Of its stretches of layers, the one counts that is longest for its
//! widest layer: the shaft of a pin with a collar, and no cone for its tip.

use std::collections::BTreeMap;

use super::AspectRule;
use super::balance::hull_of;
use super::contact::{Labelled, LayerContact};
use super::findings::{Listed, NarrowFeature, Region, SlenderFeature};
use super::metric::Metric;

/// The least side of the square that a section holds, in pixels.
const LEAST_SIDE: u32 = 2;

/// The section of a pin or a hole in a layer.
#[derive(Clone, Debug)]
pub(super) struct Section {
    component: u32,
    /// In widths of a pixel.
    width: f64,
    /// The mean of its pixels, as column and row.
    middle: [f64; 2],
}

/// Returns the compact components of a layer, in their order, unless they are wider than so many widths of a
/// pixel.
pub(super) fn sections(layer: &Labelled, widest: f64, metric: Metric) -> Vec<Section> {
    let most = metric.pixels(NarrowFeature::ELONGATED * widest);
    let mut sections = Vec::new();
    for (number, component) in (0..).zip(&layer.components.all) {
        let sides = [&component.columns, &component.rows].map(|range| range.end - range.start);
        let is_small = sides.iter().zip(most).all(|(side, most)| f64::from(*side) <= most);
        if !is_small
            || (!component.is_white && layer.reaches_frame(component))
            || !layer.hold_square(&[number], LEAST_SIDE)
        {
            continue;
        }
        let hull: Vec<[f64; 2]> = hull_of(layer, &[number])
            .iter()
            .map(|at| metric.place(at.map(|at| at as f64)))
            .collect();
        let (width, extent) = breadth(&hull);
        if width <= widest && extent < NarrowFeature::ELONGATED * width {
            sections.push(Section { component: number, width, middle: component.centroid() });
        }
    }
    sections
}

/// Returns the least distance of two parallel lines that hold a convex polygon, and its greatest extent.
fn breadth(hull: &[[f64; 2]]) -> (f64, f64) {
    let (mut least, mut greatest) = (f64::INFINITY, 0.0_f64);
    let mut far = 0;
    for (at, a) in hull.iter().enumerate() {
        let b = hull[(at + 1) % hull.len()];
        let along = [b[0] - a[0], b[1] - a[1]];
        let length = along[0].hypot(along[1]);
        let away =
            |c: [f64; 2]| (along[0] * (c[1] - a[1]) - along[1] * (c[0] - a[0])).abs() / length;
        // The farthest corner goes around with the sides.
        let next = |far: usize| (far + 1) % hull.len();
        for _ in 0..hull.len() {
            if away(hull[next(far)]) < away(hull[far]) {
                break;
            }
            far = next(far);
        }
        least = least.min(away(hull[far]));
        for c in [hull[far], hull[(far + hull.len() - 1) % hull.len()], hull[next(far)]] {
            let extent =
                f64::max((c[0] - a[0]).hypot(c[1] - a[1]), (c[0] - b[0]).hypot(c[1] - b[1]));
            greatest = greatest.max(extent);
        }
    }
    (least, greatest)
}

/// The pins and holes of the layers so far.
pub(super) struct Slenders {
    /// The greatest ratio and the greatest width in widths of a pixel of each rule.
    limits: Vec<[f64; 2]>,
    metric: Metric,
    /// Pins and holes that the last layer continues, by its components.
    live: BTreeMap<u32, Chain>,
    pub(super) ended: Listed<SlenderFeature>,
}

/// Sections that follow each other.
struct Chain {
    is_white: bool,
    /// Stretches that end with the last layer, each wider than all that begin later.
    stretches: Vec<Stretch>,
    length: f64,
    last_layer: u32,
    middle: [f64; 2],
    /// By rule.
    best: Vec<Option<SlenderFeature>>,
}

/// The layers from one on, up to the last.
struct Stretch {
    first_layer: u32,
    /// The length below it.
    below: f64,
    /// The width of the widest layer.
    width: f64,
    widest_layer: u32,
    /// The first pixel and the middle there.
    first: [u32; 2],
    middle: [f64; 2],
    /// The rectangle around its layers below the next stretch.
    region: Region,
}

impl Slenders {
    /// Creates the state before the first layer. Lengths of rules are in micrometers, and so is the width of a
    /// pixel.
    pub(super) fn new(rules: &[AspectRule], pixel_um: f64, metric: Metric) -> Self {
        let limits = rules.iter().map(|rule| {
            [rule.most, rule.widest.map_or(f64::INFINITY, |widest| widest.um() / pixel_um)]
        });
        let limits = limits.collect();
        Self { limits, metric, live: BTreeMap::new(), ended: Listed::default() }
    }

    /// Adds a layer, given its thickness in widths of a pixel.
    pub(super) fn add(
        &mut self,
        layer: &Labelled,
        sections: &[Section],
        contact: Option<&LayerContact>,
        number: u32,
        thickness: f64,
    ) {
        let mut below = std::mem::take(&mut self.live);
        let joints = contact.map_or(&[][..], |contact| &contact.joints);
        let mut above: BTreeMap<u32, u32> = BTreeMap::new();
        for joint in joints.iter().filter(|joint| below.contains_key(&joint.below)) {
            *above.entry(joint.below).or_default() += 1;
        }
        for section in sections {
            let start = joints.partition_point(|joint| joint.component < section.component);
            let own = joints[start..].iter().take_while(|it| it.component == section.component);
            let own: Vec<u32> = own.map(|joint| joint.below).collect();
            let component = &layer.components.all[section.component as usize];
            let continued = match own[..] {
                [one] if above.get(&one) == Some(&1) => below.remove(&one),
                _ => None,
            };
            let mut chain = continued.unwrap_or_else(|| Chain {
                is_white: component.is_white,
                stretches: Vec::new(),
                length: 0.0,
                last_layer: number,
                middle: section.middle,
                best: vec![None; self.limits.len()],
            });
            let [x, y] = [0, 1].map(|k| section.middle[k] - chain.middle[k]);
            let [x, y] = self.metric.place([x, y]);
            let step = thickness.hypot(x.hypot(y));
            let mut stretch = Stretch {
                first_layer: number,
                // Its length begins at its first middle.
                below: chain.length + step - thickness,
                width: section.width,
                widest_layer: number,
                first: component.first,
                middle: section.middle,
                region: component.region(),
            };
            if let Some(narrower) = chain.pop(&self.limits, section.width) {
                stretch.region.unite(&narrower.region);
                (stretch.first_layer, stretch.below) = (narrower.first_layer, narrower.below);
                if narrower.width == stretch.width {
                    stretch.widest_layer = narrower.widest_layer;
                    (stretch.first, stretch.middle) = (narrower.first, narrower.middle);
                }
            }
            chain.stretches.push(stretch);
            chain.length += step;
            (chain.last_layer, chain.middle) = (number, section.middle);
            self.live.insert(section.component, chain);
        }
        below.into_values().for_each(|chain| self.end(chain));
    }

    /// Ends all pins and holes.
    pub(super) fn finish(&mut self) {
        std::mem::take(&mut self.live).into_values().for_each(|chain| self.end(chain));
    }

    /// Lists a pin or a hole that breaks a rule, by the rule of the greatest ratio.
    fn end(&mut self, mut chain: Chain) {
        chain.pop(&self.limits, f64::INFINITY);
        let breaks = |(found, [most, _]): (SlenderFeature, &[f64; 2])| {
            (found.length > most * found.width).then_some((found, *most))
        };
        let found = chain
            .best
            .into_iter()
            .zip(&self.limits)
            .filter_map(|(best, limit)| breaks((best?, limit)));
        if let Some((found, _)) = found.max_by(|a, b| a.1.total_cmp(&b.1)) {
            self.ended.push(found);
        }
    }
}

impl Chain {
    /// Ends the stretches that are no wider than a width, and returns the longest of them.
    fn pop(&mut self, limits: &[[f64; 2]], width: f64) -> Option<Stretch> {
        let mut longest: Option<Stretch> = None;
        while let Some(mut stretch) = self.stretches.pop_if(|stretch| stretch.width <= width) {
            if let Some(later) = longest {
                stretch.region.unite(&later.region);
            }
            let length = self.length - stretch.below;
            for (rule, (best, [_, widest])) in self.best.iter_mut().zip(limits).enumerate() {
                let is_best = best
                    .as_ref()
                    .is_none_or(|best| length * best.width > best.length * stretch.width);
                if stretch.width <= *widest && is_best {
                    *best = Some(SlenderFeature {
                        is_white: self.is_white,
                        rule,
                        layers: [stretch.first_layer, self.last_layer],
                        length,
                        width: stretch.width,
                        widest_layer: stretch.widest_layer,
                        first: stretch.first,
                        middle: stretch.middle,
                        region: stretch.region.clone(),
                    });
                }
            }
            longest = Some(stretch);
        }
        longest
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// The breadth of a polygon is the least over many directions, and its extent the greatest.
        #[test]
        fn breadths_are_the_least_over_all_directions(
            corners in prop::collection::vec((0..60i64, 0..60i64), 8..30),
        ) {
            let hull = super::super::balance::convex_hull(corners.iter().map(|(x, y)| [*x, *y]).collect());
            prop_assume!(hull.len() > 2);
            let hull: Vec<[f64; 2]> = hull.iter().map(|at| at.map(|at| at as f64)).collect();
            let across = |degrees: f64| {
                let (sin, cos) = degrees.to_radians().sin_cos();
                let places = hull.iter().map(|[x, y]| x * cos + y * sin);
                let [low, high] = places.fold([f64::MAX, f64::MIN], |[low, high], at| [low.min(at), high.max(at)]);
                high - low
            };
            let all: Vec<f64> = (0..18_000).map(|step| across(f64::from(step) / 100.0)).collect();
            let [low, high] = all.iter().fold([f64::MAX, 0.0], |[low, high], at| [low.min(*at), f64::max(high, *at)]);
            let (width, extent) = breadth(&hull);
            prop_assert!(width <= low + 1e-9 && width >= low - 0.02, "{width} for {low}");
            prop_assert!(extent <= high + 0.01 && extent >= high - 0.01, "{extent} for {high}");
        }
    }
}
