//! A part's outline within the pixels of a section, and how much of it is cured.

use lamp_stack::Length;

/// A stretch of a pixel of a section, in which the part lies between two straight edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlinePiece {
    /// Where it begins and ends, in pixels from the pixel's first edge: within 0 to 1.
    pub along: [f64; 2],
    /// The height of the lower edge at both places, in micrometers.
    pub from_um: [f64; 2],
    /// The height of the upper edge at both places, in micrometers.
    pub to_um: [f64; 2],
}

impl OutlinePiece {
    /// Returns the heights between which the part is at a place of the pixel, if the piece holds
    /// it.
    pub fn at(&self, along: f64) -> Option<[f64; 2]> {
        let [start, end] = self.along;
        let share = (along - start) / (end - start);
        let height = |[a, b]: [f64; 2]| a + (b - a) * share;
        (start <= along && along < end).then(|| [height(self.from_um), height(self.to_um)])
    }
}

/// Returns how much of the heights that are cured over a whole pixel is within a part, on average
/// over the pixel. It is exact to rounding.
pub fn shared_height(cured: &[[f64; 2]], outline: &[OutlinePiece]) -> Length {
    let piece = |piece: &OutlinePiece| {
        let within = |&heights: &[f64; 2]| {
            // For two edges, the mean between them is the difference of the means below each.
            mean_within(piece.to_um, heights) - mean_within(piece.from_um, heights)
        };
        (piece.along[1] - piece.along[0]) * cured.iter().map(within).sum::<f64>()
    };
    Length::from_um(outline.iter().map(piece).sum())
}

/// Returns the mean of a height that goes straight from one end to the other, where it counts as
/// `low` below that and as `high` above that.
fn mean_within(ends: [f64; 2], [low, high]: [f64; 2]) -> f64 {
    let [least, most] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
    if least >= low && most <= high {
        return f64::midpoint(least, most);
    }
    if most <= low || least >= high {
        return least.clamp(low, high);
    }
    // A limit lies between the ends, so they differ.
    let below = (low - least).max(0.0) / (most - least);
    let above = (most - high).max(0.0) / (most - least);
    let between = f64::midpoint(least.max(low), most.min(high));
    below * low + above * high + (1.0 - below - above) * between
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_wedge_shares_triangles() {
        // From 0 up to 100 um across three quarters of a pixel.
        let outline =
            [OutlinePiece { along: [0.25, 1.0], from_um: [0.0, 0.0], to_um: [0.0, 100.0] }];
        let shared = |cured: &[[f64; 2]]| shared_height(cured, &outline).um();
        assert!((shared(&[[-10.0, 200.0]]) - 37.5).abs() < 1e-12);
        assert!((shared(&[[0.0, 50.0]]) - 0.75 * 37.5).abs() < 1e-12);
        assert!(
            (shared(&[[-5.0, 50.0], [75.0, 80.0]]) - 0.75 * (37.5 + 5.0 * 0.225)).abs() < 1e-12
        );
        assert_eq!(shared(&[[-5.0, 0.0], [100.0, 120.0]]), 0.0);
        assert_eq!(outline[0].at(0.1), None);
        assert_eq!(outline[0].at(0.625), Some([0.0, 50.0]));
    }

    proptest! {
        /// A thousand lines come to the same.
        #[test]
        fn it_is_the_mean_of_many_lines(
            from in prop::array::uniform2(-50.0..50.0f64),
            heights in prop::array::uniform2(0.0..80.0f64),
            cured in prop::array::uniform2(-80.0..80.0f64),
            along in prop::array::uniform2(0.0..1.0f64),
        ) {
            let sorted = |[a, b]: [f64; 2]| [a.min(b), a.max(b)];
            let (along, cured) = (sorted(along), sorted(cured));
            let to_um = [from[0] + heights[0], from[1] + heights[1]];
            let piece = OutlinePiece { along, from_um: from, to_um };
            let line = |k: u32| {
                let place = along[0] + (along[1] - along[0]) * (f64::from(k) + 0.5) / 1000.0;
                let [from, to] = piece.at(place).unwrap();
                (to.min(cured[1]) - from.max(cured[0])).max(0.0)
            };
            let lines = (0..1000).map(line).sum::<f64>() / 1000.0 * (along[1] - along[0]);
            let exact = shared_height(&[cured], &[piece]).um();
            prop_assert!((lines - exact).abs() < 1e-3 * (1.0 + exact), "{lines} {exact}");
        }
    }
}
