//! Finds where two copies overlap.

use lamp_stack::{Mask, white_runs};

use super::CopyPlacement;

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
