//! Layers that rows were asked about.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use crate::swept_layer::SweptLayer;
use crate::table::HeightTable;

/// The step below some layers, and for each thickness in steps, rising, the layer.
pub(crate) type KnownLayers = BTreeMap<usize, Vec<(usize, SweptLayer)>>;

/// Keeps layers from one step; of two lists from the same step, the longer.
pub(crate) fn know(known: &mut KnownLayers, step: usize, layers: Vec<(usize, SweptLayer)>) {
    match known.entry(step) {
        Entry::Occupied(mut before) if before.get().len() < layers.len() => {
            before.insert(layers);
        }
        Entry::Occupied(_) => {}
        Entry::Vacant(place) => {
            place.insert(layers);
        }
    }
}

/// Guesses layers from one step: they lose and gain the table's values, less the table's excess
/// over known layers with the same top from the nearest step.
pub(crate) fn guessed(
    table: &HeightTable,
    known: &KnownLayers,
    step: usize,
    thicknesses: &[usize],
) -> Vec<SweptLayer> {
    let mut layers: Vec<SweptLayer> = table.layers(step, thicknesses).collect();
    let (below, above) = (known.range(..=step).next_back(), known.range(step..).next());
    let nearest = below.into_iter().chain(above).min_by_key(|(near, _)| near.abs_diff(step));
    let Some((&near, of_near)) = nearest else { return layers };
    let of_near_steps: Vec<usize> = of_near.iter().map(|(steps, _)| *steps).collect();
    let told = table.layers(near, &of_near_steps);
    let mut too_much = of_near.iter().zip(told).peekable();
    for (thickness, layer) in thicknesses.iter().zip(&mut layers) {
        let top = step + thickness;
        while too_much.next_if(|((steps, _), _)| near + steps < top).is_some() {}
        let same_top = too_much.peek().filter(|((steps, _), _)| near + steps == top);
        if let Some(((_, truly), told)) = same_top {
            layer.lost_mm3 = (layer.lost_mm3 - (told.lost_mm3 - truly.lost_mm3)).max(0.0);
            layer.gained_mm3 = (layer.gained_mm3 - (told.gained_mm3 - truly.gained_mm3)).max(0.0);
        }
    }
    layers
}
