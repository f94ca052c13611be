//! Finds where two copies overlap, and which are nearer to each other than a gap.

use std::collections::HashMap;

use lamp_stack::{Frame, Length, Mask, white_runs};

use super::{CopyName, CopyPlacement, Layout};
use lamp_offset::grow_one_bit;

impl Layout {
    /// Returns the pairs of copies that are nearer to each other than a gap, from the edges of
    /// pixels to the edges of pixels.
    pub fn nearer_than(&self, gap: Length) -> Vec<[CopyName; 2]> {
        let silhouettes = self.silhouettes();
        let margin = self.pixels_across(gap);
        let grown: HashMap<_, Mask> = silhouettes
            .iter()
            .map(|(key, mask)| (*key, self.grown_by(mask, margin, gap)))
            .collect();
        let numbers: Vec<u32> = self.numbers().collect();
        let name = |k: usize| self.copy_name(self.placements[k].part, numbers[k]);
        let mut near = Vec::new();
        for (k, one) in self.placements.iter().enumerate() {
            let moved = CopyPlacement { left: one.left + margin, top: one.top + margin, ..*one };
            let mask = &silhouettes[&(one.part, one.turn)];
            for (l, other) in self.placements[..k].iter().enumerate() {
                let around = &grown[&(other.part, other.turn)];
                if common_pixel([mask, around], [&moved, other]).is_some() {
                    near.push([name(l), name(k)]);
                }
            }
        }
        near
    }

    /// Returns an outline grown by a gap, which begins `margin` pixels above and to the left.
    fn grown_by(&self, outline: &Mask, margin: u32, gap: Length) -> Mask {
        let by = -i64::from(margin);
        let [width, height] = [outline.width(), outline.height()].map(|side| side + 2 * margin);
        let wide = outline.framed(Frame { left: by, top: by, width, height });
        match margin {
            0 => wide,
            _ => grown_by_gap(&wide, self.pitch.pixels(gap).map(|by| by.min(margin.into()) - 1e-6)),
        }
    }
}

/// Returns all pixels that come nearer than a gap to a white pixel, from edge to edge. The gap is
/// in pixels along rows and columns.
pub(super) fn grown_by_gap(mask: &Mask, gap: [f64; 2]) -> Mask {
    // Squares are nearer than the gap if a pixel that touches the one has its middle nearer to the
    // middle of the other.
    let near = grow_one_bit(mask, gap.map(|by| by - 0.5));
    grow_one_bit(&near, [1.0; 2])
}

/// Returns the column and row of a pixel of the build that is white in two placed masks.
pub(super) fn common_pixel(masks: [&Mask; 2], at: [&CopyPlacement; 2]) -> Option<(u32, u32)> {
    let [a, b] = at;
    let top = a.top.max(b.top);
    let bottom = (a.top + masks[0].height()).min(b.top + masks[1].height());
    let left = a.left.max(b.left);
    let right = (a.left + masks[0].width()).min(b.left + masks[1].width());
    if left >= right {
        return None;
    }
    (top..bottom).find_map(|row| {
        let [mut one, mut other] = [0, 1].map(|k| {
            let (row, left) = (masks[k].row(row - at[k].top), at[k].left);
            let runs = white_runs(row, masks[k].width());
            runs.map(move |(start, end)| (left + start, left + end)).peekable()
        });
        loop {
            let (&(a, a_end), &(b, b_end)) = (one.peek()?, other.peek()?);
            if a.max(b) < a_end.min(b_end) {
                return Some((a.max(b), row));
            }
            if a_end < b_end {
                one.next()
            } else {
                other.next()
            };
        }
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::testing::mask_of;
    use super::*;

    /// The distance between two pixels' squares along one side.
    fn between(one: u32, other: u32) -> f64 {
        f64::from(one.abs_diff(other).saturating_sub(1))
    }

    proptest! {
        /// Each pixel's square against the square of each white one.
        #[test]
        fn a_gap_is_between_the_edges_of_pixels(
            whites in prop::collection::vec((8usize..20, 8usize..20), 1..6),
            gap in prop_oneof![
                (1u32..9).prop_map(|gap| [f64::from(gap); 2]),
                (0.1..8.0f64, 0.1..8.0f64).prop_map(|(x, y)| [x, y]),
            ],
        ) {
            let mut rows = vec![vec![b'.'; 28]; 28];
            whites.iter().for_each(|&(column, row)| rows[row][column] = b'#');
            let rows: Vec<String> =
                rows.into_iter().map(|row| String::from_utf8(row).unwrap()).collect();
            let mask = mask_of(&rows.iter().map(String::as_str).collect::<Vec<_>>());
            let grown = grown_by_gap(&mask, gap);
            for row in 0..28 {
                for column in 0..28 {
                    let share = |&(x, y): &(usize, usize)| {
                        let [along, across] = [between(column, x as u32), between(row, y as u32)];
                        (along / gap[0]).hypot(across / gap[1])
                    };
                    let share = whites.iter().map(share).fold(f64::INFINITY, f64::min);
                    if (share - 1.0).abs() > 1e-6 {
                        prop_assert_eq!(grown.is_white(column, row), share < 1.0);
                    } else {
                        // A gap that is just kept may be there.
                        prop_assert!(!grown.is_white(column, row));
                    }
                }
            }
        }
    }
}
