//! Who exposes the columns that two swaths share.

use serde::{Deserialize, Deserializer, de};

/// How two swaths share the columns that both reach. Their exposures always add up to the layer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Seam {
    /// Each row goes over to the next swath at a column of its own, so each pixel belongs to one of
    /// them. Layers that are black and white stay so.
    #[default]
    Comb,
    /// Levels fall in one swath as they rise in the other.
    Gray,
}

lamp_stack::named!(Seam { Comb = "comb", Gray = "gray" | "grey" });

/// The fraction of the golden ratio, in 2^-32: its multiples fill a circle evenly, however many
/// follow each other.
const A_ROW: u32 = 0x9E37_79B9;
/// The fraction of the square root of 2. Its multiples are nearly as even, and never meet the
/// multiples of the golden ratio.
const A_LAYER: u32 = 0x6A09_E667;

/// Returns after how many of the shared columns a row goes over to the next swath: 0 to `overlap`,
/// all as often. So the next swath has the share `(c + 1) / (overlap + 1)` of column `c`.
///
/// Rows that follow each other are cut in places as far apart as their number allows, and so are
/// layers of a row.
#[inline]
pub(super) fn tooth(overlap: u32, row: u32, layer: u32) -> u32 {
    let place = row.wrapping_mul(A_ROW).wrapping_add(layer.wrapping_mul(A_LAYER));
    // The place is a fraction in 2^-32, below 1, so the product is below `overlap` + 1.
    ((u64::from(place) * (u64::from(overlap) + 1)) >> 32) as u32
}

impl Seam {
    /// Returns the seams of strips that do not name them: they were cut when there were no others.
    pub(super) fn unnamed() -> Self {
        Self::Gray
    }
}

impl<'de> Deserialize<'de> for Seam {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        String::deserialize(from)?.parse().map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the greatest distance between neighbors of some places on a circle of length 1.
    fn widest_gap(mut places: Vec<f64>) -> f64 {
        places.sort_by(f64::total_cmp);
        let around = places[0] + 1.0 - places[places.len() - 1];
        places.windows(2).map(|two| two[1] - two[0]).fold(around, f64::max)
    }

    #[test]
    fn rows_and_layers_that_follow_each_other_are_cut_far_apart() {
        let place = |row, layer| f64::from(tooth(999, row, layer)) / 1000.0;
        for first in 0..2000 {
            for count in [2, 4, 8, 16, 64] {
                let rows = (0..count).map(|k| place(first + k, 7)).collect();
                let layers = (0..count).map(|k| place(7, first + k)).collect();
                let limit = 2.0 / f64::from(count) + 0.002;
                assert!(widest_gap(rows) < limit, "{first} {count}");
                assert!(widest_gap(layers) < 1.25 * limit, "{first} {count}");
            }
        }
    }

    #[test]
    fn each_column_has_its_share_of_the_rows() {
        for overlap in [1, 2, 7, 64, 500] {
            let rows = 40_000;
            for column in 0..overlap {
                let second = (0..rows).filter(|&row| tooth(overlap, row, 3) <= column).count();
                let share = f64::from(column + 1) / f64::from(overlap + 1);
                assert!(
                    (second as f64 / f64::from(rows) - share).abs() < 0.001,
                    "{overlap} {column}"
                );
            }
        }
    }
}
