//! Pockets whose ways out are narrower than a drain must be.
//!
//! A ball's center fits where black is nowhere nearer to white than the ball's radius. These places
//! are checked like the black of the layers: a part of them without a way out is a pocket whose ways
//! out, if any, are too narrow. The platform is no obstacle: parts drain after they are taken off
//! it. Nor is gravity: parts are turned while they drain.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

use lamp_stack::{Mask, MaskBuilder, Pitch};
use rayon::prelude::*;

use super::LabeledLayer;
use super::contact::{Labelled, LayerContact};
use super::findings::{Listed, Pocket, PocketKind};
use super::metric::Metric;
use super::overhang::without;
use super::pockets::Hollows;

/// Where balls may be, layer by layer.
pub(super) struct Drain {
    radius_um: f64,
    pitch: Pitch,
    /// The layers within reach of unfinished layers.
    window: VecDeque<NearLayer>,
    /// How many layers of the window are done, and the number of the next.
    done: usize,
    next: u32,
    /// The top of the last layer.
    top_um: f64,
    last: Option<Labelled>,
    rooms: Hollows,
    /// The black body in which each place for a ball begins: by its first layer, row and column.
    within: Vec<([u32; 3], u32)>,
}

/// A layer near unfinished layers.
struct NearLayer {
    layer: Arc<LabeledLayer>,
    /// The height of its middle above the platform.
    middle_um: f64,
    thickness_um: f64,
    /// The black body of each component, as it was when the layer was added.
    bodies: Vec<Option<u32>>,
}

impl Drain {
    pub(super) fn new(diameter_um: f64, pitch: Pitch, rounding: u32) -> Self {
        Self {
            radius_um: diameter_um / 2.0,
            pitch,
            window: VecDeque::new(),
            done: 0,
            next: 0,
            top_um: 0.0,
            last: None,
            rooms: Hollows::new(rounding),
            within: Vec::new(),
        }
    }

    /// Adds a layer, given the black bodies of its components.
    pub(super) fn add(
        &mut self,
        layer: Arc<LabeledLayer>,
        thickness_um: f64,
        bodies: Vec<Option<u32>>,
    ) {
        let middle_um = self.top_um + thickness_um / 2.0;
        self.top_um += thickness_um;
        self.window.push_back(NearLayer { layer, middle_um, thickness_um, bodies });
    }

    /// Processes the layers that no later layer is near, or all layers at the end.
    pub(super) fn advance(&mut self, is_end: bool) {
        let Some(last_um) = self.window.back().map(|near| near.middle_um) else { return };
        let is_ready = |near: &&NearLayer| is_end || near.middle_um + self.radius_um <= last_um;
        let ready = self.window.iter().skip(self.done).take_while(is_ready).count();
        let numbers: Vec<usize> = (self.done..self.done + ready).collect();
        let rooms: Vec<Labelled> =
            numbers.into_par_iter().map(|number| Labelled::new(self.crowded(number))).collect();
        for (room, number) in rooms.into_iter().zip(self.done..) {
            // Only joints matter here: overhangs are found in the layers themselves.
            let contact = self.last.as_ref().map(|below| LayerContact::new(below, &room, None, 1));
            let near = &self.window[number];
            // The center of a ball that fits is in the layer's own black.
            for black in room.of_colour(false) {
                let [column, row] = black.first;
                let labelled = &near.layer.labelled;
                let component = labelled.components.at(&labelled.mask, column, row);
                if let Some(body) = near.bodies[component as usize] {
                    self.within.push(([self.next, row, column], body));
                }
            }
            self.rooms.add(&room, contact.as_ref(), self.next, near.thickness_um);
            self.next += 1;
            self.last = Some(room);
        }
        self.done += ready;
        // Layers out of reach of the next unfinished one are no longer needed.
        let Some(next_um) = self.window.get(self.done).map(|near| near.middle_um) else { return };
        while self.window[0].middle_um + self.radius_um <= next_um {
            self.window.pop_front();
            self.done -= 1;
        }
    }

    /// Returns the pockets whose ways out are all too narrow; `hollows` has all black.
    pub(super) fn finish(mut self, mut hollows: Hollows) -> Listed<Pocket> {
        hollows.finish();
        self.advance(true);
        self.rooms.finish();
        let Listed { mut list, left_out } = self.rooms.closed;
        list.retain(|pocket| {
            // Places were added by layer and first pixel, so they are in order.
            let body = self.within.binary_search_by_key(&pocket.born(), |(born, _)| *born);
            // A body without any way out is listed already, with the other pockets.
            body.is_ok_and(|place| hollows.is_open(self.within[place].1))
        });
        list.iter_mut().for_each(|pocket| pocket.kind = PocketKind::Narrow);
        Listed { list, left_out }
    }

    /// Returns the image of a layer of the window that is white where the ball's center may not be.
    fn crowded(&self, number: usize) -> Mask {
        let mask = &self.window[number].layer.labelled.mask;
        let mut crowded = MaskBuilder::new(mask.width());
        let reaches = self.reaches(number);
        let (mut free, mut spare, mut row) = (Vec::new(), Vec::new(), Vec::new());
        for y in 0..mask.height() {
            free.clear();
            free.extend(black_runs(mask.row(y), mask.width()));
            for SidewaysReach { mask, aside } in &reaches {
                if free.is_empty() {
                    break;
                }
                remove_near(mask, y, aside, &mut free, &mut spare);
            }
            row.clear();
            transitions_without(&free, mask.width(), &mut row);
            crowded.push_row(&row).expect("the columns increase");
        }
        crowded.finish()
    }

    /// Returns the layers near one, the nearest first, and how far their white reaches.
    fn reaches(&self, number: usize) -> Vec<SidewaysReach<'_>> {
        let middle_um = self.window[number].middle_um;
        let mut reaches: Vec<(f64, SidewaysReach<'_>)> = Vec::new();
        for near in &self.window {
            let off_um = (near.middle_um - middle_um).abs();
            let aside = asides(self.radius_um, off_um, self.pitch);
            if !aside.is_empty() {
                reaches.push((off_um, SidewaysReach { mask: &near.layer.labelled.mask, aside }));
            }
        }
        // Near layers reach farthest, and leave farther ones little to do.
        reaches.sort_by(|a, b| a.0.total_cmp(&b.0));
        reaches.into_iter().map(|(_, reach)| reach).collect()
    }
}

/// A layer and how far its white reaches sideways, for each distance in rows.
struct SidewaysReach<'a> {
    mask: &'a Mask,
    aside: Vec<u32>,
}

/// Returns the greatest number of columns at which a pixel is nearer than `radius`, for each
/// distance in rows, given the distance of the layers.
fn asides(radius_um: f64, off_um: f64, pitch: Pitch) -> Vec<u32> {
    let (metric, width_um) = (Metric::of(Some(pitch)), pitch.um()[0]);
    // The margin takes up the rounding of a radius of whole pixels.
    let limit = (radius_um * radius_um * (1.0 - 1e-9) - off_um * off_um) / (width_um * width_um);
    let is_near = |columns: u32, rows: u32| metric.squared(columns, rows) < limit;
    let aside = |rows: u32| {
        let mut columns = (limit - metric.squared(0, rows)).sqrt() as u32;
        // Rounding may have made the root one too large.
        while columns > 0 && !is_near(columns, rows) {
            columns -= 1;
        }
        columns
    };
    (0u32..).take_while(|&rows| is_near(0, rows)).map(aside).collect()
}

/// Takes from the runs of row `y` what white of the rows around it reaches.
fn remove_near(
    mask: &Mask,
    y: u32,
    aside: &[u32],
    free: &mut Vec<Range<u32>>,
    spare: &mut Vec<Range<u32>>,
) {
    let mut remove = |row: u32, aside: u32| {
        spare.clear();
        free.iter().for_each(|run| without(run, mask.row(row), mask.width(), aside, spare));
        std::mem::swap(free, spare);
    };
    remove(y, aside[0]);
    for (rows, &aside) in (1..).zip(&aside[1..]) {
        // A row like the one before it reaches no farther.
        if let Some(row) = y.checked_sub(rows).filter(|&row| mask.row(row) != mask.row(row + 1)) {
            remove(row, aside);
        }
        let below = Some(y + rows).filter(|&row| row < mask.height());
        if let Some(row) = below.filter(|&row| mask.row(row) != mask.row(row - 1)) {
            remove(row, aside);
        }
    }
}

fn black_runs(row: &[u32], width: u32) -> impl Iterator<Item = Range<u32>> {
    let starts = std::iter::once(0).chain(row.iter().copied());
    let ends = row.iter().copied().chain([width]);
    starts.zip(ends).step_by(2).map(|(start, end)| start..end).filter(|run| !run.is_empty())
}

/// Adds the transitions of a row that is black in these runs.
fn transitions_without(black: &[Range<u32>], width: u32, row: &mut Vec<u32>) {
    let mut end = 0;
    for run in black {
        if run.start > end {
            row.extend([end, run.start]);
        }
        end = run.end;
    }
    if end < width {
        row.push(end);
    }
}
