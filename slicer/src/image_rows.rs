//! Makes the rows of a layer's image from its crossings.

use std::cmp::Ordering;

use lamp_stack::{Grouped, Mask};

use crate::bodies::{Doubts, LayerDoubts, Position, SharedPixels};
use crate::crossing::{BodyCrossing, InRow, RowCrossing};
use crate::grid::PixelGrid;

/// The maker of a layer's rows, from the top.
pub(crate) trait RowMaker {
    type Made;

    /// Returns a list to which the row's transitions are added.
    fn transitions(&mut self) -> &mut Vec<u32>;

    /// Ends a row, given its sorted crossings.
    fn end_row(&mut self, row: u32, places: &[impl InRow]);

    fn finish(self) -> Self::Made;
}

/// The rows of a mask.
pub(crate) struct MaskRows {
    width: u32,
    row_offsets: Vec<u32>,
    transitions: Vec<u32>,
}

impl MaskRows {
    pub(crate) fn new(grid: &PixelGrid) -> Self {
        let mut row_offsets = Vec::with_capacity(grid.height as usize + 1);
        row_offsets.push(0);
        Self { width: grid.width, row_offsets, transitions: Vec::new() }
    }
}

impl RowMaker for MaskRows {
    type Made = Mask;

    #[inline]
    fn transitions(&mut self) -> &mut Vec<u32> {
        &mut self.transitions
    }

    #[inline]
    fn end_row(&mut self, _row: u32, _places: &[impl InRow]) {
        self.row_offsets.push(self.transitions.len() as u32);
    }

    fn finish(self) -> Mask {
        let mask = Mask::new(self.width, self.row_offsets, self.transitions);
        mask.expect("sorted places without pairs increase strictly")
    }
}

/// Makes rows with `fill` from their sorted crossings. Returns the rows, and the numbers of the
/// rows for which `fill` returns false because they do not balance.
pub(crate) fn make_rows<M: RowMaker, C: InRow>(
    mut maker: M,
    height: u32,
    mut by_row: Grouped<C>,
    mut fill: impl FnMut(&[C], &mut Vec<u32>) -> bool,
) -> (M::Made, Vec<u32>) {
    maker.transitions().reserve(by_row.items().len());
    let mut stray_rows = Vec::new();
    for row in 0..height {
        let places = by_row.group_mut(row as usize);
        if !places.is_empty() {
            sort(places);
            if !fill(places, maker.transitions()) {
                stray_rows.push(row);
            }
        }
        maker.end_row(row, places);
    }
    (maker.finish(), stray_rows)
}

/// Sorts a row's items: two or four items, the usual numbers, without a branch.
#[inline]
fn sort<T: Copy + Ord>(items: &mut [T]) {
    match items {
        [a, b] => in_order(a, b),
        // The sorting network of four items with the fewest comparisons, five.
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

/// Puts the lesser of two items first.
#[inline]
fn in_order<T: Copy + Ord>(a: &mut T, b: &mut T) {
    (*a, *b) = ((*a).min(*b), (*a).max(*b));
}

/// Sorts the items of a row: few by insertion, without a call.
#[inline]
pub(crate) fn sort_by<T: Copy>(items: &mut [T], order: impl Fn(&T, &T) -> Ordering) {
    // Insertion takes time in proportion to the square of their number.
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

/// Adds a row's transitions, one at every crossing; two at the same column cancel. Returns true if
/// the number of crossings is even.
#[inline]
pub(crate) fn even_odd(places: &[RowCrossing], transitions: &mut Vec<u32>) -> bool {
    let start = transitions.len();
    // True for nearly all rows.
    if places.is_sorted_by(|a, b| a.column() < b.column()) {
        transitions.extend(places.iter().map(|place| place.column()));
        return places.len().is_multiple_of(2);
    }
    for place in places {
        // Before `start` are the transitions of the row above.
        if transitions.len() > start && transitions.last() == Some(&place.column()) {
            transitions.pop();
        } else {
            transitions.push(place.column());
        }
    }
    places.len().is_multiple_of(2)
}

/// Adds a row's transitions, wherever the winding number leaves or reaches zero; or at every
/// crossing, if the number is not zero at the end. Returns true if the number of crossings is even.
#[inline]
pub(crate) fn solid(
    places: &[RowCrossing],
    transitions: &mut Vec<u32>,
    outward: i32,
    doubts: &mut LayerDoubts,
) -> bool {
    // True for nearly all rows: a clean shell is entered and left alternately. One pass, without a
    // branch.
    let start = transitions.len();
    let (mut is_clean, mut least, mut winding) = (true, 0, outward);
    transitions.extend(places.iter().map(|place| {
        let column = place.column();
        is_clean &= (column >= least) & (place.winding() == winding);
        (least, winding) = (column + 1, -winding);
        column
    }));
    if is_clean {
        return places.len().is_multiple_of(2);
    }
    transitions.truncate(start);
    let mut of_row = Doubts::default();
    let is_even = wound(places, transitions, outward, &mut of_row);
    if of_row != Doubts::default() {
        doubts.of_bodies.entry(0).or_default().join(of_row);
    }
    is_even
}

/// Does the same for any row. Adds to the doubts about it.
fn wound(
    places: &[RowCrossing],
    transitions: &mut Vec<u32>,
    outward: i32,
    doubts: &mut Doubts,
) -> bool {
    let start = transitions.len();
    let (mut winding, mut column, mut rest) = (0, 0, places);
    while let Some(first) = rest.first() {
        let (before, here) = (winding, first.column());
        while let Some((place, others)) = rest.split_first()
            && place.column() == here
        {
            winding += place.winding();
            rest = others;
        }
        // `outward` is the winding within a single clean shell, where there is no doubt.
        if before != 0 && before != outward {
            doubts.add(outward * before, here - column);
        }
        if (before == 0) != (winding == 0) {
            transitions.push(here);
        }
        column = here;
    }
    if winding == 0 {
        return true;
    }
    transitions.truncate(start);
    let is_even = even_odd(places, transitions);
    // Without a sum of zero, signs mean nothing. An odd row is a stray row, not a doubt.
    *doubts = Doubts { unsigned_rows: u64::from(is_even), ..Doubts::default() };
    is_even
}

/// Adds a row's transitions, wherever the position leaves or enters the part. Returns true
/// if the row balances. Counts the pixels that bodies share, and doubtful pixels.
pub(crate) fn by_body(
    places: &[BodyCrossing],
    transitions: &mut Vec<u32>,
    position: &mut Position<'_>,
    shared: &mut SharedPixels<'_>,
    outward: i32,
    doubts: &mut LayerDoubts,
) -> bool {
    position.start_row(places.iter().map(|place| place.turn()));
    let (mut is_inside, mut column) = (false, 0);
    for group in places.chunk_by(|a, b| a.column() == b.column()) {
        let here = group[0].column();
        shared.add(position, here - column);
        for &(body, winding) in position.windings() {
            // Cutters may face either way.
            if winding != outward && position.has_signs(body) {
                let doubts = doubts.of_bodies.entry(body).or_default();
                doubts.add(outward * winding, here - column);
            }
        }
        group.iter().for_each(|place| position.cross(place.turn()));
        if position.is_inside() != is_inside {
            is_inside = !is_inside;
            transitions.push(here);
        }
        column = here;
    }
    let is_balanced = position.is_balanced();
    if is_balanced {
        for &body in position.unsigned() {
            doubts.of_bodies.entry(body).or_default().unsigned_rows += 1;
        }
    }
    is_balanced
}
