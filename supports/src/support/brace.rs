//! Braces between tall pillars.
//!
//! A pillar that is slender bends as the platform moves. Between neighbors, struts at 45 degrees
//! zigzag from column to column, as far apart as columns may be slender.

use std::collections::BTreeSet;
use std::f64::consts::FRAC_1_SQRT_2;

use lamp_slicing::brep::vector::Vec3;
use lamp_stack::{Layer, Length, Mask};

use super::divide::WhiteRuns;
use super::fit::span_mm;
use super::free::is_white_near;
use super::pillar::{BASE_HEIGHT_MM, TIP_LENGTH_MM};
use super::rod::Rod;
use super::window::Raster;
use super::{Support, SupportError, SupportOptions, SupportPlan};
use crate::check::{Findings, Metric};

/// The height of a column in diameters from which it needs braces (15 mm for 1 mm in
/// `PrusaSlicer`, as `max_solo_pillar_height_mm`).
const SLENDER: f64 = 15.0;

/// The farthest neighbor that a brace reaches (`support_max_pillar_link_distance`).
const FARTHEST_MM: f64 = 10.0;

/// The neighbors that a column is tied to, so that it cannot bend to any side.
const NEIGHBORS: usize = 2;

/// The least distance of braces up a column, in diameters.
const APART: f64 = 5.0;

/// Struts between pillars.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Braces {
    /// The struts to draw.
    pub rods: Vec<Rod>,
    /// The pillars that are slender, but too far from others or too near to the part for braces.
    pub alone: usize,
}

/// A column: the middle of its foot, and its top.
struct Column {
    foot: Vec3,
    top_mm: f64,
    diameter: Length,
}

impl Column {
    fn is_slender(&self) -> bool {
        self.top_mm - self.foot[2] > SLENDER * self.diameter.mm()
    }
}

/// A strut between two columns, by their numbers.
struct Brace {
    columns: [usize; 2],
    rod: Rod,
}

/// Adds braces between the pillars of a plan, given the stack's layers once more. Braces keep their
/// distance from the part.
///
/// # Errors
/// Returns the first error of the layers, or one if the pages lack what is needed.
pub fn plan_braces<E: From<SupportError>>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    found: &Findings,
    plan: &mut SupportPlan,
    options: &SupportOptions,
) -> Result<(), E> {
    let raster = Raster::of(found)?;
    let pillars = plan.supports().filter(|it| it.is_pillar());
    let columns: Vec<Column> = pillars.filter_map(column).collect();
    let mut braces = zigzags(&columns);
    let metric = raster.metric();
    let clearance = raster.widths(options.pillar.clearance).max(metric.longer_side());
    let highest = braces.iter().map(|brace| brace.rod.heights()[1].mm()).fold(f64::MIN, f64::max);
    for (facts, layer) in found.layers.iter().zip(layers) {
        let [bottom, thickness] =
            span_mm(facts).ok_or(SupportError::NoHeight { index: facts.index })?;
        if bottom > highest {
            break;
        }
        let middle = Length::from_mm(bottom + thickness / 2.0);
        let mask = layer?.image.into_image().into_mask(options.threshold);
        braces.retain(|brace| {
            let [low, high] = brace.rod.heights();
            if middle < low || middle > high {
                return true;
            }
            // At 45 degrees a section moves aside by the layer's thickness, and is √2 diameters long:
            // half of it rests on the one below.
            let is_steady = thickness <= FRAC_1_SQRT_2 * brace.rod.diameters[0].mm();
            is_steady && !meets(&brace.rod.section(middle, &raster), &mask, clearance, metric)
        });
    }
    let braced: BTreeSet<usize> = braces.iter().flat_map(|brace| brace.columns).collect();
    let slender = (0..columns.len()).filter(|k| columns[*k].is_slender());
    let alone = slender.filter(|k| !braced.contains(k)).count();
    plan.braces = Braces { rods: braces.into_iter().map(|brace| brace.rod).collect(), alone };
    Ok(())
}

/// Returns whether white is within a distance of a section.
fn meets(section: &WhiteRuns, mask: &Mask, distance: f64, metric: Metric) -> bool {
    section.iter().any(|(row, run)| is_white_near(mask, *row, run, distance, metric))
}

/// Returns the column of a pillar, if it has one.
fn column(pillar: &Support) -> Option<Column> {
    let [.., top, foot] = pillar.path_mm[..] else { return None };
    if top[..2] != foot[..2] {
        return None;
    }
    let tip = if pillar.path_mm.len() == 2 { TIP_LENGTH_MM } else { 0.0 };
    Some(Column { foot, top_mm: top[2] - tip, diameter: pillar.diameter })
}

/// Returns struts between slender columns and the nearest of the columns that are at least half
/// as high.
fn zigzags(columns: &[Column]) -> Vec<Brace> {
    let apart = |a: usize, b: usize| {
        let [a, b] = [a, b].map(|k| columns[k].foot);
        (a[0] - b[0]).hypot(a[1] - b[1])
    };
    let mut pairs = BTreeSet::new();
    for a in (0..columns.len()).filter(|a| columns[*a].is_slender()) {
        let half = f64::midpoint(columns[a].foot[2], columns[a].top_mm);
        // Columns that touch need none.
        let is_near = |b: &usize| {
            let far = apart(a, *b);
            far > columns[a].diameter.mm() && far <= FARTHEST_MM && columns[*b].top_mm >= half
        };
        let mut near: Vec<usize> = (0..columns.len()).filter(is_near).collect();
        near.sort_by(|b, c| apart(a, *b).total_cmp(&apart(a, *c)));
        pairs.extend(near.into_iter().take(NEIGHBORS).map(|b| [a.min(b), a.max(b)]));
    }
    let zigzag = |[a, b]: [usize; 2]| {
        let (far, diameter) = (apart(a, b), columns[a].diameter);
        let low = columns[a].foot[2] + BASE_HEIGHT_MM;
        let high = columns[a].top_mm.min(columns[b].top_mm);
        let step = far.max(APART * diameter.mm());
        let count = ((high - low - far) / step).floor().max(-1.0) as i64 + 1;
        (0..count).map(move |k| {
            // From the one to the other, and back.
            let ends = if k % 2 == 0 { [a, b] } else { [b, a] };
            let z = low + step * k as f64;
            let [from, to] = ends.map(|k| columns[k].foot);
            let ends = [[from[0], from[1], z], [to[0], to[1], z + far]];
            let thin = Length::from_um(diameter.um() / 2.0);
            Brace { columns: [a, b], rod: Rod::new(ends, [thin; 2]) }
        })
    };
    pairs.into_iter().flat_map(zigzag).collect()
}
