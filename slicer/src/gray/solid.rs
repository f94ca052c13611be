//! Finds the columns of a row that are part in all layers above whose light counts. Nearly all
//! undersides are below such columns.

use super::below::Below;

/// Columns of a row, from each start to its end.
pub(super) type Intervals = Vec<(u32, u32)>;

/// The columns of a row that are part in as many layers as count, or a few more, from a layer down.
///
/// A window of layers slides down. The columns that are part in all its layers follow from blocks
/// of half its length: from two whole blocks and the layers of a third.
#[derive(Default)]
pub(crate) struct SolidRow {
    width: u32,
    /// The columns that are part in all layers of the last two whole blocks, of the last one, and
    /// of the current block.
    last_two: Intervals,
    last: Intervals,
    begun: Intervals,
    /// The number of layers that the current block lacks.
    left: u32,
    /// The number of layers of each block except the first.
    block: u32,
}

impl SolidRow {
    /// Starts with the layer below an unknown layer, or with the part's last layer if it `is_top`:
    /// no light comes from above that layer.
    pub(crate) fn start(&mut self, width: u32, most_above: u32, is_top: bool) {
        self.width = width;
        // Two whole blocks are as long as the window.
        self.block = most_above.div_ceil(2).max(1);
        self.left = if is_top { self.block } else { (most_above / 2).max(1) };
        for (columns, all) in
            [(&mut self.last_two, is_top), (&mut self.last, is_top), (&mut self.begun, true)]
        {
            columns.clear();
            columns.extend(all.then_some((0, width)));
        }
    }

    /// Adds the columns that are part in all layers above that count, except some that are part in
    /// only a few more layers.
    pub(crate) fn push_columns(&self, to: &mut Intervals) {
        push_common(&self.last_two, self.begun.iter().copied(), to);
    }

    /// Goes down through a layer, given the undersides below its row. `spare` is a scratch list.
    pub(crate) fn go_down(&mut self, layer: usize, below: &[Below], spare: &mut Intervals) {
        let is_through = |piece: &&Below| piece.layer != layer as u32;
        let part = below.iter().filter(is_through).map(|piece| (piece.start, piece.end));
        spare.clear();
        push_common(&self.begun, part, spare);
        std::mem::swap(&mut self.begun, spare);
        self.left -= 1;
        if self.left == 0 {
            self.last_two.clear();
            push_common(&self.last, self.begun.iter().copied(), &mut self.last_two);
            std::mem::swap(&mut self.last, &mut self.begun);
            self.begun.clear();
            self.begun.push((0, self.width));
            self.left = self.block;
        }
    }
}

/// Adds the columns that are also in a part, whose pieces come from the left.
fn push_common(columns: &[(u32, u32)], part: impl Iterator<Item = (u32, u32)>, to: &mut Intervals) {
    let mut rest = columns;
    for (start, end) in part {
        while let Some(&(from, until)) = rest.first()
            && from < end
        {
            let (from, within) = (from.max(start), until.min(end));
            match to.last_mut() {
                _ if from >= within => {}
                Some((_, last)) if *last == from => *last = within,
                _ => to.push((from, within)),
            }
            // The columns go on in the next piece.
            if until > end {
                break;
            }
            rest = &rest[1..];
        }
        if rest.is_empty() {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const WIDTH: u32 = 40;

    /// Generates the part of a row in some layers, from the top down, as pieces with the layer of
    /// the underside.
    fn layers() -> impl Strategy<Value = Vec<Vec<Below>>> {
        let piece = (0u32..6, 1u32..30, prop::bool::weighted(0.2));
        let row = prop::collection::vec(piece, 0..4);
        prop::collection::vec(row, 1..40).prop_map(|rows| {
            let count = rows.len() as u32;
            let of_layer = |(k, row): (u32, Vec<(u32, u32, bool)>)| {
                let mut column = 0;
                let pieces = row.into_iter().map(|(gap, length, ends_here)| {
                    let start = (column + gap).min(WIDTH);
                    column = (start + length).min(WIDTH);
                    let layer = if ends_here { count - 1 - k } else { 1000 };
                    Below { start, end: column, layer }
                });
                pieces.filter(|piece| piece.start < piece.end).collect()
            };
            (0..).zip(rows).map(of_layer).collect()
        })
    }

    proptest! {
        #[test]
        fn solid_columns_are_part_in_all_layers_that_count(
            layers in layers(), most_above in 0u32..12, is_top: bool,
        ) {
            let is_part = |k: usize, column: u32| {
                let layer = (layers.len() - 1 - k) as u32;
                let here = |piece: &&Below| (piece.start..piece.end).contains(&column);
                layers[k].iter().find(here).is_some_and(|piece| piece.layer != layer)
            };
            let mut row = SolidRow::default();
            row.start(WIDTH, most_above, is_top);
            let mut spare = Vec::new();
            for (done, below) in layers.iter().enumerate() {
                row.go_down(layers.len() - 1 - done, below, &mut spare);
                let mut solid = Vec::new();
                row.push_columns(&mut solid);
                prop_assert!(solid.is_sorted_by(|a, b| a.1 < b.0));
                let is_solid = |column: u32| solid.iter().any(|&(from, to)| (from..to).contains(&column));
                // The layers that count, and all layers that can be looked at.
                let most_seen = 3 * most_above.div_ceil(2).max(1);
                let [counts, all] = [most_above, most_seen].map(|most| {
                    let first = (done + 1).saturating_sub(most as usize);
                    move |column: u32| (first..=done).all(|k| is_part(k, column))
                });
                let knows_enough = is_top || done + 1 >= most_above.max(2) as usize;
                for column in 0..WIDTH {
                    prop_assert!(!is_solid(column) || counts(column));
                    prop_assert!(is_solid(column) || !knows_enough || !all(column));
                }
            }
        }
    }
}
