//! Tries a strut in the images, layer by layer, as it is drawn.

use std::ops::Range;

use lamp_slicing::brep::vector::{Vec3, dot, sub};
use lamp_stack::Length;

use super::divide::WhiteRuns;
use super::rod::Rod;
use super::surface::Contact;
use super::window::{Raster, SupportWindow};
use super::{Rejection, Support};
use crate::check::LayerFacts;

/// The surroundings of an island.
pub(super) struct IslandSurroundings<'a> {
    pub(super) raster: Raster,
    /// All layers of the stack, whose heights are known.
    pub(super) layers: &'a [LayerFacts],
    /// The images below the island.
    pub(super) window: &'a SupportWindow,
    /// The first layer that a support may reach.
    pub(super) lowest: u32,
    /// The island's first layer, and its pixels there.
    pub(super) layer: u32,
    pub(super) island: &'a WhiteRuns,
    /// How deep the tips of pillars may meet white below.
    pub(super) contact_depth_mm: f64,
}

/// Returns the bottom and the thickness of a layer in millimeters, if its page states them.
pub(super) fn span_mm(layer: &LayerFacts) -> Option<[f64; 2]> {
    Some([layer.z_um? / 1000.0, layer.thickness_um? / 1000.0])
}

impl IslandSurroundings<'_> {
    /// Checks that a strut of this radius from the island to a contact holds the island, if it
    /// is drawn into the images, touches nothing on the way and stays in the part below.
    pub(super) fn try_strut(
        &self,
        strut: &Rod,
        contact: &Contact,
        radius_mm: f64,
    ) -> Result<(), Rejection> {
        let [low, high] = strut.heights();
        let mut below = Vec::new();
        let mut holds = false;
        for number in self.lowest..self.layers.len() as u32 {
            let middle = self.middle(number);
            if middle > high {
                break;
            }
            if middle < low {
                continue;
            }
            let section = strut.section(middle, &self.raster);
            if number < self.layer {
                self.check_solid(number, middle, &section, contact, radius_mm)?;
                let held = |(row, run): &(u32, _)| overlaps(&section, *row, run).next().is_some();
                holds = number + 1 == self.layer && self.island.iter().any(held);
            }
            self.check_rest(number, &section, &below)?;
            below = section;
        }
        if holds { Ok(()) } else { Err(Rejection::Unsteady) }
    }

    /// Checks that the leaning rods of a pillar, its first ones, are in black down to the junction at
    /// the bottom of a layer, and that each of their sections rests on the one below. The clearance
    /// grows from a pixel at the island to all of it.
    pub(super) fn try_leaning(
        &self,
        rods: &[Rod],
        leaning: usize,
        junction: u32,
        clearance_mm: f64,
    ) -> Result<(), Rejection> {
        let section = |rods: &[Rod], number: u32| united(rods, self.middle(number), &self.raster);
        let mut below = match junction.checked_sub(1) {
            Some(column) => section(&rods[leaning..], column),
            None => WhiteRuns::new(),
        };
        let (width, metric) = (self.raster.width_mm(), self.raster.metric());
        for number in junction..self.layer {
            let section = section(&rods[..leaning], number);
            let depth = self.middle(self.layer).mm() - self.middle(number).mm();
            let clear = (clearance_mm.min(depth) / width).max(metric.longer_side());
            let is_beyond = depth > self.contact_depth_mm;
            if is_beyond
                && section.iter().any(|(row, run)| self.is_white_near(number, *row, run, clear))
            {
                return Err(Rejection::Blocked);
            }
            self.check_rest(number, &section, &below)?;
            below = section;
        }
        let held = |(row, run): &(u32, _)| overlaps(&below, *row, run).next().is_some();
        if self.island.iter().any(held) { Ok(()) } else { Err(Rejection::Unsteady) }
    }

    fn is_white_near(&self, number: u32, row: u32, run: &Range<u32>, distance: f64) -> bool {
        let metric = self.raster.metric();
        let [_, far] = metric.pixels(distance).map(|pixels| pixels.floor() as u32);
        (row.saturating_sub(far)..=row.saturating_add(far)).any(|near| {
            let aside = (distance.powi(2) - metric.squared(0, near.abs_diff(row))).max(0.0).sqrt();
            let aside = aside as u32;
            let run = run.start.saturating_sub(aside)..run.end.saturating_add(aside);
            self.window.white_in(number, near, &run).next().is_some()
        })
    }

    /// Returns how many pixels of the island rest on supports that are apart.
    pub(super) fn covered<'s>(&self, supports: impl Iterator<Item = &'s Support>) -> u64 {
        let Some(below) = self.layer.checked_sub(1) else { return 0 };
        let pixels = |support: &Support| -> u64 {
            let section = united(&support.rods, self.middle(below), &self.raster);
            let shared = self.island.iter().flat_map(|(row, run)| overlaps(&section, *row, run));
            shared.map(|run| u64::from(run.end - run.start)).sum()
        };
        supports.map(pixels).sum()
    }

    /// Returns the height of the middle of a layer.
    fn middle(&self, number: u32) -> Length {
        let [bottom, thickness] = self.span_mm(number);
        Length::from_mm(bottom + thickness / 2.0)
    }

    fn span_mm(&self, number: u32) -> [f64; 2] {
        span_mm(&self.layers[number as usize]).expect("heights were found for all layers")
    }

    /// Checks that a section is white only beyond the contact, and black only before it.
    fn check_solid(
        &self,
        number: u32,
        middle: Length,
        section: &WhiteRuns,
        contact: &Contact,
        radius_mm: f64,
    ) -> Result<(), Rejection> {
        let [_, thickness] = self.span_mm(number);
        let pixel = self.raster.pitch.long_side().mm();
        // Images are off the surface by up to a pixel and a layer, and the surface off the
        // contact's plane.
        let slack = radius_mm / 4.0 + pixel + thickness * contact.normal[2].abs();
        let outside = |column: u32, row: u32| {
            let [x, y] = self.raster.place_mm([column, row].map(|place| f64::from(place) + 0.5));
            dot(sub([x, y, middle.mm()], contact.at_mm), contact.normal)
        };
        // Along a run the distance from a plane is linear, so the ends have the extremes.
        let ends =
            |row: u32, run: &Range<u32>| [outside(run.start, row), outside(run.end - 1, row)];
        for (row, run) in section {
            let white: Vec<_> = self.window.white_in(number, *row, run).collect();
            if white.iter().any(|run| ends(*row, run).iter().any(|&far| far > slack)) {
                return Err(Rejection::Blocked);
            }
            let starts = std::iter::once(run.start).chain(white.iter().map(|run| run.end));
            let stops = white.iter().map(|run| run.start).chain(std::iter::once(run.end));
            let mut black = starts.zip(stops).map(|(start, end)| start..end);
            if black.any(|run| !run.is_empty() && ends(*row, &run).iter().any(|&far| far < -slack))
            {
                return Err(Rejection::Through);
            }
        }
        Ok(())
    }

    /// Checks that at least half of a section rests on white that stands, or is such white already,
    /// and some of each of its components. `below` is the strut's section one layer below.
    fn check_rest(
        &self,
        number: u32,
        section: &WhiteRuns,
        below: &WhiteRuns,
    ) -> Result<(), Rejection> {
        // The first layer stands on the platform.
        if number == 0 {
            return Ok(());
        }
        let (mut all, mut resting, mut of_component) = (0, 0, 0);
        for (k, (row, run)) in section.iter().enumerate() {
            let is_joined = k > 0 && {
                let (above, other) = &section[k - 1];
                above + 1 == *row && other.start < run.end && run.start < other.end
            };
            if k > 0 && !is_joined && of_component == 0 {
                return Err(Rejection::Unsteady);
            }
            let mut held: Vec<_> = self.window.standing_in(number - 1, *row, run).collect();
            held.extend(self.window.standing_in(number, *row, run));
            held.extend(overlaps(below, *row, run));
            // White of both layers and the strut may overlap, and counts once.
            let held = covered(held);
            of_component = if is_joined { of_component + held } else { held };
            resting += held;
            all += run.end - run.start;
        }
        // A section between pixel centers has no pixels that could rest on others.
        let is_steady = section.is_empty() || (of_component > 0 && 2 * resting >= all);
        if is_steady { Ok(()) } else { Err(Rejection::Unsteady) }
    }
}

/// Returns the section of rods that follow each other along a line, a run a row.
fn united(rods: &[Rod], height: Length, raster: &Raster) -> WhiteRuns {
    let mut runs: WhiteRuns = rods.iter().flat_map(|rod| rod.section(height, raster)).collect();
    runs.sort_unstable_by_key(|(row, run)| (*row, run.start));
    runs.dedup_by(|(row, run), (last_row, last)| {
        let is_same = row == last_row;
        if is_same {
            last.end = last.end.max(run.end);
        }
        is_same
    });
    runs
}

/// Returns what a run of a row shares with others, which have at most one run a row.
fn overlaps(others: &WhiteRuns, row: u32, run: &Range<u32>) -> impl Iterator<Item = Range<u32>> {
    let found = others.binary_search_by_key(&row, |(row, _)| *row).ok();
    let shared = found.map(|k| others[k].1.start.max(run.start)..others[k].1.end.min(run.end));
    shared.filter(|run| !run.is_empty()).into_iter()
}

/// Returns how many columns lie in any of the ranges.
fn covered(mut ranges: Vec<Range<u32>>) -> u32 {
    ranges.sort_unstable_by_key(|range| range.start);
    let (mut end, mut count) = (0, 0);
    for range in ranges {
        count += range.end.saturating_sub(range.start.max(end));
        end = end.max(range.end);
    }
    count
}

/// Returns the least distance between two segments.
///
/// Source: C. Ericson, *Real-Time Collision Detection*, 2005, section 5.1.9.
pub(super) fn distance_mm([a, b]: [Vec3; 2], [c, d]: [Vec3; 2]) -> f64 {
    let (u, v, w) = (sub(b, a), sub(d, c), sub(a, c));
    let (uu, uv, vv, uw, vw) = (dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w));
    let crossed = uu * vv - uv * uv;
    // Parallel lines are equally far apart everywhere, so any point will do.
    let s = if crossed > 0.0 { ((uv * vw - vv * uw) / crossed).clamp(0.0, 1.0) } else { 0.0 };
    let t = (uv * s + vw) / vv;
    // The point of one axis that is nearest to the other's line may be past its end.
    let s = if (0.0..=1.0).contains(&t) {
        s
    } else {
        ((uv * t.clamp(0.0, 1.0) - uw) / uu).clamp(0.0, 1.0)
    };
    let t = t.clamp(0.0, 1.0);
    let apart = |k: usize| w[k] + s * u[k] - t * v[k];
    (0..3).map(|k| apart(k).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn columns_count_once() {
        assert_eq!(covered(vec![5..9, 1..3, 2..4, 8..9, 3..3]), 7);
        assert_eq!(covered(vec![]), 0);
    }

    proptest! {
        #[test]
        fn segments_are_as_near_as_their_nearest_points(
            ends in prop::array::uniform4(prop::array::uniform3(-5i32..5)),
        ) {
            let [a, b, c, d] = ends.map(|end| end.map(f64::from));
            prop_assume!(a != b && c != d);
            let at = |p: Vec3, q: Vec3, s: f64| -> Vec3 { std::array::from_fn(|k| p[k] + s * (q[k] - p[k])) };
            let steps = || (0..=40).map(|k| f64::from(k) / 40.0);
            let pairs = steps().flat_map(|s| steps().map(move |t| (s, t)));
            let sampled = pairs.map(|(s, t)| {
                let apart = sub(at(a, b, s), at(c, d, t));
                dot(apart, apart).sqrt()
            });
            let (least, found) = (sampled.fold(f64::INFINITY, f64::min), distance_mm([a, b], [c, d]));
            prop_assert!(found < least + 1e-9 && found > least - 0.5, "{found} {least}");
        }
    }
}
