//! Checks whether a mesh is closed without finding neighboring facets.

use lamp_slicing::PlacedFacet;

/// A sum over the edges of facets: zero if each edge is passed equally often in both directions.
/// Edges count by unrelated numbers, so about one in 2^64 meshes with gaps sums to zero.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EdgeSum(u64);

impl EdgeSum {
    /// Adds the edges of a facet. Edges of bodies with different names are never the same.
    pub(crate) fn add(&mut self, facet: &PlacedFacet, body: u32) {
        let corners = facet.map(|corner| number_of(corner, body));
        for k in 0..3 {
            let [from, to] = [corners[k], corners[(k + 1) % 3]];
            let edge = mixed(mixed(from.min(to)) ^ from.max(to));
            match from.cmp(&to) {
                std::cmp::Ordering::Less => self.0 = self.0.wrapping_add(edge),
                std::cmp::Ordering::Equal => {}
                std::cmp::Ordering::Greater => self.0 = self.0.wrapping_sub(edge),
            }
        }
    }

    /// Returns true if the mesh has no gap, no edge of a single facet and no edge where the
    /// orientation flips.
    pub(crate) fn is_closed(self) -> bool {
        self.0 == 0
    }
}

fn number_of(corner: [f64; 3], body: u32) -> u64 {
    // Adding zero makes -0 and 0 the same.
    corner.iter().fold(mixed(body.into()), |number, place| mixed(number ^ (place + 0.0).to_bits()))
}

/// Mixes all bits of a number into each other (the last steps of `SplitMix64`).
fn mixed(number: u64) -> u64 {
    let number = (number ^ (number >> 30)).wrapping_add(0x9e37_79b9_7f4a_7c15);
    let number = (number ^ (number >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let number = (number ^ (number >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    number ^ (number >> 31)
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::{Mesh, cube_with_hole, tower};

    use super::*;

    fn is_closed(mesh: &Mesh, body: impl Fn(usize) -> u32) -> bool {
        let mut sum = EdgeSum::default();
        for (k, facet) in mesh.facets.iter().enumerate() {
            sum.add(&facet.map(|corner| corner.map(f64::from)), body(k));
        }
        sum.is_closed()
    }

    #[test]
    fn closed_meshes_sum_to_nothing() {
        for mesh in [tower(3_000), cube_with_hole(8.0, 2.0, 400)] {
            let one = |_| 0;
            assert!(is_closed(&mesh, one));
            let mut gap = mesh.clone();
            let lost = gap.facets.pop().unwrap();
            assert!(!is_closed(&gap, one));
            gap.facets.push([lost[1], lost[0], lost[2]]);
            assert!(!is_closed(&gap, one));
            gap.facets[7][0][0] += 1e-3;
            assert!(!is_closed(&gap, one));
            // Halves of two bodies do not close each other.
            assert!(!is_closed(&mesh, |k| u32::from(k < 100)));
        }
    }
}
