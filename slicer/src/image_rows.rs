//! Makes the rows of a layer's image from its crossings.

use std::cmp::Ordering;

use lamp_stack::{Grouped, Mask};

use crate::bodies::{Position, SharedPixels};
use crate::cut::{BodyCrossing, InRow, RowCrossing};
use crate::gray::{ShadedRows, Shader};
use crate::grid::PixelGrid;

/// The rows of a layer's image, to be filled from the top.
pub(crate) struct ImageRows<'a, R: ShadedRows> {
    width: u32,
    height: u32,
    shader: Option<Shader<'a, R>>,
}

impl<'a, R: ShadedRows> ImageRows<'a, R> {
    pub(crate) fn new(grid: &PixelGrid, shader: Option<Shader<'a, R>>) -> Self {
        Self { width: grid.width, height: grid.height, shader }
    }

    /// Fills all rows with what `fill` makes of their crossings, once they are sorted. Returns the
    /// mask, the shaded rows, and the rows for which `fill` returns false since they do not balance.
    pub(crate) fn filled<C: InRow>(
        mut self,
        mut by_row: Grouped<C>,
        mut fill: impl FnMut(&[C], &mut Vec<u32>) -> bool,
    ) -> (Mask, Option<R>, Vec<u32>) {
        let mut row_offsets = Vec::with_capacity(self.height as usize + 1);
        row_offsets.push(0);
        let mut transitions = Vec::with_capacity(by_row.items().len());
        let mut stray_rows = Vec::new();
        for row in 0..self.height {
            let places = by_row.group_mut(row as usize);
            if !places.is_empty() {
                sort(places);
                if !fill(places, &mut transitions) {
                    stray_rows.push(row);
                }
            }
            row_offsets.push(transitions.len() as u32);
            if let Some(shader) = &mut self.shader {
                shader.push_row(row, places);
            }
        }
        let mask = Mask::new(self.width, row_offsets, transitions);
        let mask = mask.expect("sorted places without pairs increase strictly");
        (mask, self.shader.map(Shader::finish), stray_rows)
    }
}

/// Sorts what a row has: two or four, as most rows have, without a branch.
#[inline]
fn sort<T: Copy + Ord>(items: &mut [T]) {
    match items {
        [a, b] => in_order(a, b),
        [a, b, c, d] => {
            in_order(a, b);
            in_order(c, d);
            in_order(a, c);
            in_order(b, d);
            in_order(b, c);
        }
        _ => sort_by(items, Ord::cmp),
    }
}

/// Puts the lesser of two first.
#[inline]
fn in_order<T: Copy + Ord>(a: &mut T, b: &mut T) {
    (*a, *b) = ((*a).min(*b), (*a).max(*b));
}

/// Sorts the items of a row: few by insertion, without a call.
#[inline]
pub(crate) fn sort_by<T: Copy>(items: &mut [T], order: impl Fn(&T, &T) -> Ordering) {
    if items.len() > 16 {
        return items.sort_unstable_by(order);
    }
    for end in 1..items.len() {
        let item = items[end];
        let mut at = end;
        while at > 0 && order(&items[at - 1], &item).is_gt() {
            items[at] = items[at - 1];
            at -= 1;
        }
        items[at] = item;
    }
}

/// Adds a row's transitions, one at every crossing, where two at one column cancel.
/// Returns true if the number of crossings is even.
#[inline]
pub(crate) fn even_odd(places: &[RowCrossing], transitions: &mut Vec<u32>) -> bool {
    let start = transitions.len();
    // Nearly all rows.
    if places.is_sorted_by(|a, b| a.column() < b.column()) {
        transitions.extend(places.iter().map(|place| place.column()));
        return places.len().is_multiple_of(2);
    }
    for place in places {
        if transitions.len() > start && transitions.last() == Some(&place.column()) {
            transitions.pop();
        } else {
            transitions.push(place.column());
        }
    }
    places.len().is_multiple_of(2)
}

/// Adds a row's transitions, wherever the winding number leaves or reaches zero.
/// Returns true if it is zero at the end.
pub(crate) fn non_zero(places: &[RowCrossing], transitions: &mut Vec<u32>) -> bool {
    let mut winding = 0;
    for group in places.chunk_by(|a, b| a.column() == b.column()) {
        let before = winding;
        winding += group.iter().map(|place| place.winding()).sum::<i32>();
        if (before == 0) != (winding == 0) {
            transitions.push(group[0].column());
        }
    }
    winding == 0
}

/// Adds a row's transitions, wherever the position leaves or enters the part. Returns true
/// if the row balances. Counts the pixels that bodies share.
pub(crate) fn by_body(
    places: &[BodyCrossing],
    transitions: &mut Vec<u32>,
    position: &mut Position<'_>,
    shared: &mut SharedPixels<'_>,
) -> bool {
    position.leave_all();
    shared.start_row();
    for group in places.chunk_by(|a, b| a.column() == b.column()) {
        let (before, column) = (position.is_inside(), group[0].column());
        for place in group {
            position.cross(place.turn());
            shared.cross(place.turn().body(), column);
        }
        if position.is_inside() != before {
            transitions.push(column);
        }
    }
    position.is_balanced()
}
