//! Finds where two copies overlap, and which are nearer to each other than a gap.

use std::collections::HashMap;

use lamp_stack::{Frame, Length, Mask, white_runs};

use super::{CopyName, CopyPlacement, Layout};
use lamp_offset::grow_one_bit;

impl Layout {
    /// Returns the pairs of copies that are nearer to each other than a gap, as packing keeps it.
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
            _ => grow_one_bit(&wide, self.pitch.pixels(gap).map(|by| (by - 1e-6).ceil())),
        }
    }
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
