//! The faces of a part that look down on resin.

use std::collections::BTreeSet;

use crate::numeric::Random;
use crate::speed::TimedPart;

/// A place on a face: the layer, counted from the light, whose bottom is the face, and the pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FacePlace {
    pub(super) layer: usize,
    pub(super) pixel: [u32; 2],
}

/// Returns some of the pixels of all faces, each as likely as another, from the top face down. The
/// lowest layer has no such face: it stands on the platform.
pub(super) fn random_places(part: &TimedPart, count: usize, random: &mut Random) -> Vec<FacePlace> {
    let layers = part.layers().len() - 1;
    let of_layers: Vec<u64> =
        (0..layers).map(|layer| faces_of(part, layer).map(length).sum()).collect();
    let total: u64 = of_layers.iter().sum();
    let mut chosen = BTreeSet::new();
    // Floyd's sample: each set of places is as likely as another (Bentley and Floyd 1987).
    for last in total.saturating_sub(count as u64)..total {
        let number = random.below(last + 1);
        if !chosen.insert(number) {
            chosen.insert(last);
        }
    }
    let mut chosen = chosen.into_iter().peekable();
    let mut places = Vec::new();
    let mut passed = 0;
    for (layer, of_layer) in of_layers.into_iter().enumerate() {
        // Most layers have no face.
        if chosen.peek().is_none_or(|number| *number >= passed + of_layer) {
            passed += of_layer;
            continue;
        }
        for run in faces_of(part, layer) {
            while let Some(number) = chosen.next_if(|number| *number < passed + length(run)) {
                let [row, from, _] = run;
                places.push(FacePlace { layer, pixel: [from + (number - passed) as u32, row] });
            }
            passed += length(run);
        }
    }
    places
}

fn length([_, from, to]: [u32; 3]) -> u64 {
    u64::from(to - from)
}

/// Returns the runs of a layer's pixels that are of the part, above pixels that are not: each its
/// row, its first column and the column after its last.
fn faces_of(part: &TimedPart, layer: usize) -> impl Iterator<Item = [u32; 3]> {
    let height = part.size()[1];
    (0..height).flat_map(move |row| {
        let below = part.wanted_runs(layer + 1, row).collect::<Vec<_>>();
        let mut faces = Vec::new();
        for [mut from, to] in part.wanted_runs(layer, row) {
            let first = below.partition_point(|hidden| hidden[1] <= from);
            for hidden in below[first..].iter().take_while(|hidden| hidden[0] < to) {
                if from < hidden[0] {
                    faces.push([row, from, hidden[0]]);
                }
                from = hidden[1].min(to);
            }
            if from < to {
                faces.push([row, from, to]);
            }
        }
        faces
    })
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::cavity_staircase;

    use super::*;
    use crate::speed::testing::part;

    #[test]
    fn faces_are_the_wanted_pixels_above_others() {
        let part = part(&cavity_staircase(1));
        let [width, height] = part.size();
        let mut all = Vec::new();
        for layer in 0..part.layers().len() - 1 {
            for row in 0..height {
                let is_face = |column: &u32| {
                    let pixel = [*column, row];
                    part.is_wanted(layer, pixel) && !part.is_wanted(layer + 1, pixel)
                };
                all.extend(
                    (0..width)
                        .filter(is_face)
                        .map(|column| FacePlace { layer, pixel: [column, row] }),
                );
            }
        }
        // Three undersides of steps, 10 x 20 pixels each, and the roof of the cavity.
        assert_eq!(all.len(), 3 * 200 + 200);
        assert_eq!(random_places(&part, 10_000, &mut Random::new(1)), all);
        let some = random_places(&part, 37, &mut Random::new(1));
        assert_eq!(some.len(), 37);
        assert!(some.iter().all(|place| all.contains(place)));
        assert_ne!(some, random_places(&part, 37, &mut Random::new(2)));
    }
}
