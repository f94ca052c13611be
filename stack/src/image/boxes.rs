//! Rectangles around the white components of a mask.

use std::cmp::Reverse;
use std::ops::Range;

use crate::image::mask::{Mask, white_runs};
use crate::image::sets::{root, unite};

/// The rectangle around white pixels that touch at sides or corners.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WhiteBox {
    /// The columns, from the left.
    pub columns: Range<u32>,
    /// The rows, from the top.
    pub rows: Range<u32>,
    /// The number of white pixels that touch.
    pub pixels: u64,
}

impl WhiteBox {
    fn unite(&mut self, other: &Self) {
        let both = |a: &Range<u32>, b: &Range<u32>| a.start.min(b.start)..a.end.max(b.end);
        self.columns = both(&self.columns, &other.columns);
        self.rows = both(&self.rows, &other.rows);
        self.pixels += other.pixels;
    }
}

/// Returns the boxes of the components with the most pixels, at most `most` of them, largest first
/// and of equal ones the first by rows; and how many components there are.
///
/// Memory holds the components that a row has part of, not all.
///
/// ```
/// use lamp_stack::{Mask, largest_boxes};
///
/// // `.##...#` above `...#..#`: pixels that touch at a corner are one component.
/// let mask = Mask::new(7, vec![0, 3, 6], vec![1, 3, 6, 3, 4, 6])?;
/// let (boxes, count) = largest_boxes(&mask, 1);
/// assert_eq!((boxes[0].columns.clone(), boxes[0].pixels, count), (1..4, 3, 2));
/// # Ok::<(), lamp_stack::RunError>(())
/// ```
pub fn largest_boxes(mask: &Mask, most: usize) -> (Vec<WhiteBox>, u64) {
    let mut largest = Largest { most, boxes: Vec::new(), count: 0 };
    let mut above = LiveComponents::default();
    for (row, transitions) in (0..).zip(mask.rows()) {
        // A black row below a black row begins and ends nothing.
        if !transitions.is_empty() || !above.boxes.is_empty() {
            above = above.next(row, transitions, mask.width(), &mut largest);
        }
    }
    above.boxes.into_iter().for_each(|each| largest.add(each));
    largest.cut();
    (largest.boxes, largest.count)
}

/// The components that a row has part of.
#[derive(Default)]
struct LiveComponents {
    boxes: Vec<WhiteBox>,
    /// The row's runs, each with its component.
    runs: Vec<(Range<u32>, u32)>,
}

impl LiveComponents {
    /// Returns the components of the next row; components that end go to `largest`.
    fn next(self, row: u32, transitions: &[u32], width: u32, largest: &mut Largest) -> Self {
        let Self { mut boxes, runs: above } = self;
        let old = boxes.len();
        let here = white_runs(transitions, width);
        boxes.extend(here.clone().map(|(start, end)| WhiteBox {
            columns: start..end,
            rows: row..row + 1,
            pixels: u64::from(end - start),
        }));
        let mut parents: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut next = 0;
        for (run, (start, end)) in (old as u32..).zip(here) {
            // A run that ends where this one starts still touches it at a corner.
            while above.get(next).is_some_and(|(other, _)| other.end < start) {
                next += 1;
            }
            let touching = above[next..].iter().take_while(|(other, _)| other.start <= end);
            for &(_, component) in touching {
                unite(&mut parents, component, run);
            }
        }
        joined(boxes, &mut parents, old, largest)
    }
}

/// Joins the boxes of each set, of which those from `old` on are the runs of the row.
fn joined(
    boxes: Vec<WhiteBox>,
    parents: &mut [u32],
    old: usize,
    largest: &mut Largest,
) -> LiveComponents {
    let mut sets: Vec<Option<WhiteBox>> = vec![None; boxes.len()];
    let mut columns = Vec::with_capacity(boxes.len() - old);
    for (member, each) in boxes.into_iter().enumerate() {
        if member >= old {
            columns.push(each.columns.clone());
        }
        match &mut sets[root(parents, member as u32) as usize] {
            Some(set) => set.unite(&each),
            set => *set = Some(each),
        }
    }
    let mut live = LiveComponents::default();
    let mut numbers = vec![u32::MAX; sets.len()];
    for (run, columns) in (old..).zip(columns) {
        let set = root(parents, run as u32) as usize;
        if let Some(each) = sets[set].take() {
            numbers[set] = live.boxes.len() as u32;
            live.boxes.push(each);
        }
        live.runs.push((columns, numbers[set]));
    }
    sets.into_iter().flatten().for_each(|ended| largest.add(ended));
    live
}

/// The largest boxes so far.
struct Largest {
    most: usize,
    boxes: Vec<WhiteBox>,
    count: u64,
}

impl Largest {
    fn add(&mut self, each: WhiteBox) {
        self.count += 1;
        self.boxes.push(each);
        // Cutting at twice the number keeps the cost of sorting in proportion.
        if self.boxes.len() > 2 * self.most + 64 {
            self.cut();
        }
    }

    fn cut(&mut self) {
        self.boxes.sort_by_key(|each| (Reverse(each.pixels), each.rows.start, each.columns.start));
        self.boxes.truncate(self.most);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::mask_of;

    /// Flood fill, pixel by pixel.
    fn flooded(mask: &Mask) -> Vec<WhiteBox> {
        let mut seen = vec![vec![false; mask.width() as usize]; mask.height() as usize];
        let mut boxes = Vec::new();
        for (row, column) in (0..mask.height()).flat_map(|r| (0..mask.width()).map(move |c| (r, c)))
        {
            let mut todo = vec![(row, column)];
            let mut found: Option<WhiteBox> = None;
            while let Some((row, column)) = todo.pop() {
                if !mask.is_white(column, row)
                    || std::mem::replace(&mut seen[row as usize][column as usize], true)
                {
                    continue;
                }
                let pixel = WhiteBox { columns: column..column + 1, rows: row..row + 1, pixels: 1 };
                match &mut found {
                    Some(found) => found.unite(&pixel),
                    none => *none = Some(pixel),
                }
                for (down, right) in
                    (-1..=1).flat_map(|down| (-1..=1).map(move |right| (down, right)))
                {
                    let (row, column) =
                        (row.checked_add_signed(down), column.checked_add_signed(right));
                    todo.extend(
                        row.zip(column)
                            .filter(|&(row, column)| row < mask.height() && column < mask.width()),
                    );
                }
            }
            boxes.extend(found);
        }
        boxes.sort_by_key(|each| (Reverse(each.pixels), each.rows.start, each.columns.start));
        boxes
    }

    proptest! {
        #[test]
        fn boxes_are_those_of_a_flood_fill(
            rows in prop::collection::vec(prop::collection::btree_set(0u32..24, 0..14), 0..14),
            most in 0usize..5,
        ) {
            let rows: Vec<Vec<u32>> = rows.into_iter().map(|row| row.into_iter().collect()).collect();
            let mask = mask_of(24, rows.iter().map(Vec::as_slice));
            let (boxes, count) = largest_boxes(&mask, most);
            let all = flooded(&mask);
            prop_assert_eq!(count, all.len() as u64);
            prop_assert_eq!(&boxes[..], &all[..all.len().min(most)]);
        }
    }

    #[test]
    fn of_many_components_the_largest_are_kept() {
        // Row k has a run of k + 1 pixels and an empty row below it.
        let rows: Vec<Vec<u32>> = (0..400).flat_map(|k| [vec![1, k + 2], vec![]]).collect();
        let mask = mask_of(500, rows.iter().map(Vec::as_slice));
        let (boxes, count) = largest_boxes(&mask, 3);
        assert_eq!(count, 400);
        assert_eq!(boxes.iter().map(|each| each.pixels).collect::<Vec<_>>(), [400, 399, 398]);
    }
}
