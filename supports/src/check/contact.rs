//! Compares a layer with the layer below.

use std::ops::Range;

use lamp_stack::Mask;

use super::components::{Component, Components, for_each_overlap, in_step};
use super::overhang::{OverhangLimit, OverhangPatch, Unheld, patches};

/// A layer's image and its components.
#[derive(Debug)]
pub(crate) struct Labelled {
    pub(crate) mask: Mask,
    pub(crate) components: Components,
}

impl Labelled {
    pub(crate) fn new(mask: Mask) -> Self {
        let components = Components::of(&mask);
        Self { mask, components }
    }

    pub(super) fn is_white(&self, component: u32) -> bool {
        self.components.all[component as usize].is_white
    }

    /// Returns whether one of the components holds a full square of pixels.
    pub(super) fn hold_square(&self, components: &[u32], side: u32) -> bool {
        self.hold_rectangle(components, [side; 2])
    }

    /// Returns whether one of the components holds a full rectangle of pixels, given its columns and
    /// rows.
    pub(super) fn hold_rectangle(&self, components: &[u32], sides: [u32; 2]) -> bool {
        components
            .iter()
            .any(|&component| self.components.holds_rectangle(&self.mask, component, sides))
    }

    /// Returns whether a component has pixels at the image's border.
    pub(crate) fn reaches_frame(&self, component: &Component) -> bool {
        let reaches = |range: &Range<u32>, end: u32| range.start == 0 || range.end == end;
        reaches(&component.columns, self.mask.width())
            || reaches(&component.rows, self.mask.height())
    }

    /// Returns the components of one color.
    pub(super) fn of_colour(&self, is_white: bool) -> impl Iterator<Item = &Component> {
        self.components.all.iter().filter(move |component| component.is_white == is_white)
    }
}

/// Pixels that a component has in common with one of the layer below.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Joint {
    pub(super) component: u32,
    pub(super) below: u32,
    pub(super) pixels: u64,
}

/// How a layer rests on the one below.
#[derive(Debug)]
pub(super) struct LayerContact {
    /// By component, then by the component below; of both colors.
    pub(super) joints: Vec<Joint>,
    /// Of supported components.
    pub(super) patches: Vec<OverhangPatch>,
}

impl LayerContact {
    /// Compares a layer with the one below. Overhangs reach farther than `limit`.
    pub(super) fn new(
        below: &Labelled,
        layer: &Labelled,
        limit: Option<OverhangLimit>,
        speck: u32,
    ) -> Self {
        let mut joints = Joints::new(layer.components.all.len());
        let mut unheld = Vec::new();
        let width = layer.mask.width();
        // 1e9 is beyond any image, and keeps the cast exact.
        let reach = limit.map_or(u32::MAX, |limit| limit.widths.floor().min(1e9) as u32);
        for row in 0..layer.mask.height() {
            let [under, over] = [below, layer].map(|layer| layer.mask.row(row));
            let [labels_under, labels] = [below, layer].map(|layer| layer.components.of_row(row));
            let is_near = |(a, b): (&u32, &u32)| a.abs_diff(*b) <= reach;
            // All white is within reach of white in its own row, so only joints are left to count.
            if in_step(under, over) && under.iter().zip(over).all(is_near) {
                joints.add_row([under, over], [labels_under, labels], width);
                continue;
            }
            for_each_overlap(under, over, width, |i, j, columns| {
                if (i ^ j) & 1 == 0 {
                    joints.add(labels[j], labels_under[i], columns.end - columns.start);
                } else if j & 1 == 1 {
                    let black = [i.checked_sub(1).map(|start| under[start]), under.get(i).copied()];
                    if let Some(columns) = beyond(&columns, black, reach) {
                        unheld.push(Unheld { row, columns, component: labels[j] });
                    }
                }
            });
        }
        let joints = joints.finish();
        // White that rests on nothing is an island, not an overhang.
        let is_held = |component: u32| {
            joints.binary_search_by_key(&component, |joint| joint.component).is_ok()
        };
        unheld.retain(|run| is_held(run.component));
        let patches = limit
            .map_or(Vec::new(), |limit| patches([&layer.mask, &below.mask], &unheld, limit, speck));
        Self { joints, patches }
    }
}

/// Returns the columns of a run that the white at the ends of the black below does not reach in
/// its own row.
#[inline]
fn beyond(columns: &Range<u32>, black: [Option<u32>; 2], reach: u32) -> Option<Range<u32>> {
    let [first, end] = black;
    let start = first.map_or(0, |start| start.saturating_add(reach)).max(columns.start);
    let end = end.map_or(u32::MAX, |end| end.saturating_sub(reach)).min(columns.end);
    (start < end).then_some(start..end)
}

/// Counts common pixels of pairs of components.
struct Joints {
    /// The pair that each component met last, which most rows meet again.
    last: Vec<Joint>,
    earlier: Vec<Joint>,
}

impl Joints {
    fn new(components: usize) -> Self {
        // Without pixels yet: `finish` drops such entries.
        let last = (0..components as u32).map(|component| Joint { component, below: 0, pixels: 0 });
        Self { last: last.collect(), earlier: Vec::new() }
    }

    #[inline]
    fn add(&mut self, component: u32, below: u32, pixels: u32) {
        let last = &mut self.last[component as usize];
        if last.below != below {
            self.earlier.push(*last);
            (last.below, last.pixels) = (below, 0);
        }
        last.pixels += u64::from(pixels);
    }

    /// Counts for rows that are in step.
    fn add_row(&mut self, rows: [&[u32]; 2], labels: [&[u32]; 2], width: u32) {
        let [under, over] = rows.map(|row| row.iter().chain([&width]));
        let mut start = 0;
        for ((a, b), (&below, &component)) in under.zip(over).zip(labels[0].iter().zip(labels[1])) {
            let end = *a.min(b);
            if end > start {
                self.add(component, below, end - start);
            }
            start = *a.max(b);
        }
    }

    fn finish(self) -> Vec<Joint> {
        let mut all = self.earlier;
        all.extend(self.last);
        all.retain(|joint| joint.pixels > 0);
        all.sort_unstable();
        all.dedup_by(|next, kept| {
            let same = (next.component, next.below) == (kept.component, kept.below);
            kept.pixels += if same { next.pixels } else { 0 };
            same
        });
        all
    }
}
