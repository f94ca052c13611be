//! Layers of one thickness, to compare with.

use lamp_slicing::PLANE_TOLERANCE;
use lamp_stack::Length;

use crate::error::HeightsError;
use crate::layered_part::LayeredPart;
use crate::search::{Heights, MAX_LAYERS, too_high};
use crate::table::HeightTable;

/// Returns a part's layers of one thickness, as the slicer makes them.
///
/// # Errors
/// Returns an error if there would be too many layers, or they have no thickness.
pub fn uniform_heights(part: &LayeredPart, thickness: Length) -> Result<Heights, HeightsError> {
    let [bottom_um, top_um] = part.heights_um();
    let thickness_um = thickness.um();
    let height = Length::from_um(top_um - bottom_um);
    let count = part.side().whole_layers(height, thickness, PLANE_TOLERANCE);
    // Negated, so that a thickness of NaN fails, too.
    if !(thickness_um > 0.0 && count <= MAX_LAYERS) {
        return Err(too_high([bottom_um, top_um]));
    }
    let count = count as usize;
    let told = HeightTable::new(part, thickness_um, count).zip(part.overlaps(thickness_um));
    let at = |k: usize| bottom_um + k as f64 * thickness_um;
    let layer = |k: usize| match &told {
        Some((table, overlaps)) => overlaps.layers(table, k, &[1])[0],
        None => part.layers(at(k), &[at(k + 1)]).each[0],
    };
    Ok(Heights::of(part, (0..count).map(layer).collect()))
}
