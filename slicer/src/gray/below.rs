//! Finds what is below the pixels of a layer: the underside of the part, or only part as far as
//! light reaches.

use super::print_through::PrintThrough;
use super::rows::DepthRows;

/// Rounding of depths, which must not open gaps between layers.
const TIE_UM: f64 = 0.01;

/// The columns of a row, from `start` to `end`, whose undersides are in one layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Below {
    pub(crate) start: u32,
    pub(crate) end: u32,
    /// The layer that has the depth of the underside, or [`DEEP`] if light does not reach it.
    pub(crate) layer: u32,
}

/// Represents the layer of an underside that light does not reach.
pub(crate) const DEEP: u32 = u32::MAX;

/// Returns whether the part continues into the layer below. The first layer has none below it, but
/// may stand on the platform.
#[inline]
fn is_through(depth_um: f64, step_um: f64) -> bool {
    depth_um.is_infinite() || depth_um > step_um - TIE_UM
}

/// Adds the undersides below a row of a layer, from the undersides of the layer below if it is
/// known.
pub(crate) fn push_below(
    light: &PrintThrough,
    layer: usize,
    rows: &DepthRows,
    row: u32,
    layer_below: Option<&[Below]>,
    list: &mut Vec<Below>,
) {
    let first = list.len();
    let step_um = light.step_um(layer);
    let first_in_reach = light.first_in_reach(layer);
    let mut rest = layer_below.unwrap_or_default();
    for (start, end, depth_um) in rows.parts(row) {
        if !is_through(depth_um, step_um) {
            push_joined(list, first, Below { start, end, layer: layer as u32 });
            continue;
        }
        if layer_below.is_none() {
            push_joined(list, first, Below { start, end, layer: DEEP });
            continue;
        }
        let in_reach = |below: u32| if below >= first_in_reach { below } else { DEEP };
        // Black right below is an underside at the plane between the layers.
        let between = in_reach(layer as u32 - 1);
        let mut column = start;
        while column < end {
            while rest.first().is_some_and(|below| below.end <= column) {
                rest = &rest[1..];
            }
            let (to, below) = match rest.first() {
                Some(below) if below.start <= column => (below.end, in_reach(below.layer)),
                Some(below) => (below.start, between),
                None => (end, between),
            };
            let to = to.min(end);
            push_joined(list, first, Below { start: column, end: to, layer: below });
            column = to;
        }
    }
}

/// Adds columns to a row that starts at `first`, joined with columns that they touch.
fn push_joined(list: &mut Vec<Below>, first: usize, below: Below) {
    match list[first..].last_mut() {
        Some(last) if last.end == below.start && last.layer == below.layer => last.end = below.end,
        _ => list.push(below),
    }
}
