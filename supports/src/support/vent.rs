//! Plans holes that drain the pockets of a part.
//!
//! A part drains by gravity when it is lifted out of the resin, so a hole has to leave a pocket where
//! its floor is lowest, and to lead aside or down from there. The shortest way through the part ends at
//! black that reaches the image's border within its own layer: resin runs off there.
//!
//! Source: this project's own. 002 section 4.3 finds pockets, and leaves their holes to people.

use std::collections::VecDeque;
use std::num::NonZeroU8;
use std::ops::Range;

use lamp_stack::{Layer, Length};

use super::SupportError;
use super::fit::span_mm;
use super::rod::Rod;
use super::window::Raster;
use crate::check::{Findings, Labelled, Pocket, PocketKind};

/// A hole that is to drain a pocket.
#[derive(Clone, Debug, PartialEq)]
pub struct Vent {
    /// The rod to take out, from the pocket to the outside.
    pub rod: Rod,
    /// The distance between the pocket and the outside.
    pub wall: Length,
}

/// A pocket and the holes that may drain it.
#[derive(Clone, Debug, PartialEq)]
pub struct VentPlan {
    /// The pocket.
    pub pocket: Pocket,
    /// The holes to try, the best first. Empty if no wall is thin enough, or the pocket too narrow.
    pub vents: Vec<Vent>,
    /// Whether the hole would be wider than the pocket: it would cut more than the wall.
    pub is_too_wide: bool,
}

impl VentPlan {
    /// Returns the share of the pocket's volume that stays in it, by a check of the stack with holes.
    pub fn share_left(&self, found: &Findings) -> f64 {
        let pocket = &self.pocket;
        let meets = |other: &&Pocket| {
            let [first, last] = pocket.layers;
            matches!(other.kind, PocketKind::Trap | PocketKind::Cup)
                && other.layers[0] <= last
                && first <= other.layers[1]
                && pocket.region.is_near(&other.region, [0; 2])
        };
        let volumes = found.pockets.list.iter().filter(meets).map(|other| other.pixels_um);
        // A sum of nothing is -0.
        volumes.fold(0.0, |sum, um| sum + um) / pocket.pixels_um
    }
}

/// Plans holes for the cups and traps that a check has found, given the stack's layers once more. Whether
/// they drain is known from a check of the stack with the holes: see [`VentPlan::share_left`].
///
/// # Errors
/// Returns the first error of the layers, or one if the pages lack what is needed.
pub fn plan_vents<E: From<SupportError>>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    found: &Findings,
    [diameter, max_length]: [Length; 2],
    threshold: NonZeroU8,
) -> Result<Vec<VentPlan>, E> {
    let raster = Raster::of(found)?;
    if let Some(layer) = found.layers.iter().find(|layer| span_mm(layer).is_none()) {
        return Err(SupportError::NoHeight { index: layer.index }.into());
    }
    let bottom_mm = |layer: u32| span_mm(&found.layers[layer as usize]).map_or(0.0, |span| span[0]);
    // Suction ends when the part comes off the platform, so only these keep resin.
    let is_full = |pocket: &&Pocket| matches!(pocket.kind, PocketKind::Trap | PocketKind::Cup);
    let mut plans: Vec<VentPlan> = found
        .pockets
        .list
        .iter()
        .filter(is_full)
        .map(|pocket| {
            let sides = [&pocket.region.columns, &pocket.region.rows].map(ExactSizeIterator::len);
            let wide = raster.pitch.pixels(diameter);
            let is_too_wide = (0..2).any(|k| wide[k] > sides[k] as f64);
            VentPlan { pocket: pocket.clone(), vents: Vec::new(), is_too_wide }
        })
        .collect();
    // The layers that a hole may reach, the highest last.
    let mut kept: VecDeque<(u32, Outside)> = VecDeque::new();
    for (number, layer) in (0..).zip(layers) {
        let floors = plans.iter().map(|plan| plan.pocket.layers[0]).filter(|&at| at >= number);
        let Some(next) = floors.min() else { break };
        let image = layer?.image;
        if bottom_mm(next) - bottom_mm(number) > max_length.mm() {
            continue;
        }
        let layer = Labelled::new(image.into_image().into_mask(threshold));
        kept.retain(|(below, _)| bottom_mm(number) - bottom_mm(*below) <= max_length.mm());
        kept.push_back((number, Outside::of(&layer)));
        let here = |plan: &&mut VentPlan| plan.pocket.layers[0] == number && !plan.is_too_wide;
        for plan in plans.iter_mut().filter(here) {
            let component =
                layer.components.at(&layer.mask, plan.pocket.first[0], plan.pocket.first[1]);
            let floor: Vec<_> = layer.components.runs(&layer.mask, component).collect();
            let way = shortest(&floor, &kept, &raster, max_length, bottom_mm);
            let Some(way) = way else { continue };
            plan.vents = vents(&way, &floor, found, &raster, diameter);
        }
    }
    Ok(plans)
}

/// The black of a layer that reaches the image's border, as runs of each row.
struct Outside(Vec<Vec<Range<u32>>>);

impl Outside {
    fn of(layer: &Labelled) -> Self {
        let mut rows = vec![Vec::new(); layer.mask.height() as usize];
        for (number, component) in (0..).zip(&layer.components.all) {
            if !component.is_white && layer.reaches_frame(component) {
                for (row, run) in layer.components.runs(&layer.mask, number) {
                    rows[row as usize].push(run);
                }
            }
        }
        rows.iter_mut().for_each(|runs| runs.sort_unstable_by_key(|run| run.start));
        Self(rows)
    }

    /// Returns the run of a row that is nearest to another run, as two columns that face each other.
    fn nearest(&self, row: u32, run: &Range<u32>) -> Option<[u32; 2]> {
        let runs = &self.0[row as usize];
        let next = runs.partition_point(|outside| outside.start < run.end);
        let right = runs.get(next).map(|outside| [run.end - 1, outside.start]);
        let left = next.checked_sub(1).map(|last| {
            let outside = &runs[last];
            if outside.end <= run.start {
                return [run.start, outside.end - 1];
            }
            // They overlap: the middle of what they share.
            let middle = (outside.start.max(run.start) + outside.end.min(run.end) - 1) / 2;
            [middle; 2]
        });
        let gap = |pair: &[u32; 2]| pair[0].abs_diff(pair[1]);
        left.into_iter().chain(right).min_by_key(gap)
    }

    fn holds(&self, [column, row]: [i64; 2]) -> bool {
        let (Ok(column), Some(runs)) =
            (u32::try_from(column), usize::try_from(row).ok().and_then(|row| self.0.get(row)))
        else {
            return false;
        };
        let next = runs.partition_point(|run| run.start <= column);
        next.checked_sub(1).is_some_and(|last| runs[last].contains(&column))
    }
}

/// The shortest way out of a pocket's floor.
struct Way<'a> {
    /// The pixel of the floor, and the pixel outside, as column and row.
    pixels: [[u32; 2]; 2],
    /// The layers of the two.
    layers: [u32; 2],
    outside: &'a Outside,
}

/// Returns the shortest way from a floor to the outside of its layer or of one below, if it is no longer
/// than asked for.
fn shortest<'a>(
    floor: &[(u32, Range<u32>)],
    kept: &'a VecDeque<(u32, Outside)>,
    raster: &Raster,
    max_length: Length,
    bottom_mm: impl Fn(u32) -> f64,
) -> Option<Way<'a>> {
    let &(top, _) = kept.back()?;
    // Of equal ways, the one from the floor's middle counts.
    let middle = floor[floor.len() / 2].0;
    let mut floor: Vec<_> = floor.iter().collect();
    floor.sort_by_key(|(row, _)| row.abs_diff(middle));
    let (metric, width) = (raster.metric(), raster.width_mm());
    let [_, row_mm] = raster.pitch.mm();
    let mut best_mm = max_length.mm().next_up();
    let mut best = None;
    // Ways aside come first: of two equally long ways, people reach this one more easily.
    for (layer, outside) in kept.iter().rev() {
        let down = bottom_mm(top) - bottom_mm(*layer);
        if down >= best_mm {
            break;
        }
        for (row, run) in &floor {
            // No row farther away than this is nearer than the best.
            let reach = ((best_mm.powi(2) - down.powi(2)).max(0.0).sqrt() / row_mm).ceil() as u32;
            let rows = row.saturating_sub(reach)..=(row + reach).min(raster.size[1] - 1);
            for other in rows {
                let Some([from, to]) = outside.nearest(other, run) else { continue };
                let [aside, across] = [from.abs_diff(to), row.abs_diff(other)];
                let [aside, across] = metric.place([aside, across].map(f64::from));
                let length = (aside.hypot(across) * width).hypot(down);
                if length < best_mm {
                    best_mm = length;
                    let pixels = [[from, *row], [to, other]];
                    best = Some(Way { pixels, layers: [top, *layer], outside });
                }
            }
        }
    }
    best
}

/// Returns the holes along a way, the best first.
fn vents(
    way: &Way<'_>,
    floor: &[(u32, Range<u32>)],
    found: &Findings,
    raster: &Raster,
    diameter: Length,
) -> Vec<Vent> {
    let (metric, width, radius) = (raster.metric(), raster.width_mm(), diameter.mm() / 2.0);
    let [from, to] = way.pixels.map(|pixel| pixel.map(|at| f64::from(at) + 0.5));
    let [[high, above], [low, thickness]] = way.layers.map(|layer| {
        span_mm(&found.layers[layer as usize]).expect("heights were found for all layers")
    });
    let place = |[x, y]: [f64; 2], height: f64| [x, y, height];
    let rod = |ends: [[f64; 3]; 2]| Rod::new(ends, [diameter; 2]);
    let [across, down] = metric.place([to[0] - from[0], to[1] - from[1]]);
    // In widths of a pixel.
    let aside = across.hypot(down);
    if aside == 0.0 {
        // Straight down, from the floor's layer to the black below.
        let ends = [place(raster.place_mm(from), high + above), place(raster.place_mm(to), low)];
        let wall = Length::from_mm((high - low - thickness).max(0.0));
        return vec![Vent { rod: rod(ends), wall }];
    }
    let along = [0, 1].map(|k| (to[k] - from[k]) / aside);
    // Walls may be curved, so that the ends reach on by a radius, as far as black goes.
    let reach = |start: [f64; 2], sign: f64, is_black: &dyn Fn([i64; 2]) -> bool| {
        let side = metric.shorter_side();
        let steps = (radius / (width * side)).ceil() as u32;
        let at = |step: u32| [0, 1].map(|k| start[k] + sign * f64::from(step) * side * along[k]);
        let black = (1..=steps).take_while(|step| is_black(at(*step).map(|at| at.floor() as i64)));
        black.count() as f64 * side
    };
    let is_floor = |[column, row]: [i64; 2]| {
        let holds = |(y, run): &(u32, Range<u32>)| {
            i64::from(*y) == row && u32::try_from(column).is_ok_and(|column| run.contains(&column))
        };
        floor.iter().any(holds)
    };
    let inside = reach(from, -1.0, &is_floor);
    let outside = reach(to, 1.0, &|at| way.outside.holds(at));
    let slope = (low - high) / aside;
    // Resin runs off where the hole is as low as the floor. A hole that touches the floor's layer from
    // above does so by a narrow strip; if that is lost between pixels, it sinks by a third of its radius.
    let hole = |sunk: f64| {
        let end = |at: f64| {
            let pixel = [0, 1].map(|k| from[k] + at * along[k]);
            place(raster.place_mm(pixel), high + radius * (1.0 - sunk) + slope * at)
        };
        let ends = [end(-inside), end(aside + outside)];
        // From center to center, less half a pixel at both ends: of one that is higher than wide,
        // more the more the way leads along y.
        let pixel = 1.0 + (metric.pixel_area() - 1.0) * (down / aside).powi(2);
        let wall = ((aside - pixel) * width).hypot(high - low);
        Vent { rod: rod(ends), wall: Length::from_mm(wall) }
    };
    vec![hole(0.0), hole(1.0 / 3.0)]
}
