//! Packs copies of one part in rows and columns.

use lamp_stack::Orientation;

use super::super::{CopyPlacement, Layout};

/// Places up to `wanted` copies of the only part in rows from the top left, centered.
pub(super) fn grid(
    layout: &Layout,
    turn: Orientation,
    wanted: u32,
    gap: u32,
) -> Vec<CopyPlacement> {
    let (part, area) = (layout.parts()[0].size(turn), layout.pixels());
    let (Some(columns), Some(rows)) =
        (most(area.width, part.width, gap), most(area.height, part.height, gap))
    else {
        return Vec::new();
    };
    // Sides of up to 2^26 pixels hold more tiny parts than a u32 counts.
    let copies = columns.saturating_mul(rows).min(wanted);
    if copies == 0 {
        return Vec::new();
    }
    let columns = columns.min(copies);
    let lefts = positions(area.width, part.width, gap, columns);
    let tops = positions(area.height, part.height, gap, copies.div_ceil(columns));
    let all = tops.flat_map(|top| lefts.clone().map(move |left| (left, top)));
    all.map(|(left, top)| CopyPlacement { part: 0, turn, left, top })
        .take(copies as usize)
        .collect()
}

/// Returns the number of parts that fit along a side, or `None` if not one does.
fn most(area: u32, part: u32, gap: u32) -> Option<u32> {
    // A part without pixels and a gap of 0 must not divide by zero.
    Some(area.checked_sub(part)? / (part + gap).max(1) + 1)
}

/// Returns where `count` parts stand along a side, centered.
fn positions(area: u32, part: u32, gap: u32, count: u32) -> impl Iterator<Item = u32> + Clone {
    let used = count * part + (count - 1) * gap;
    (0..count).map(move |i| (area - used) / 2 + i * (part + gap))
}
