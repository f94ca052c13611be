//! Decodes the paint of slicers on facets, such as where no support may stand.
//!
//! PrusaSlicer, SuperSlicer, Bambu Studio and OrcaSlicer divide a painted triangle into smaller
//! ones, again and again, and write the tree as hexadecimal digits, the root last. The low two bits
//! of a digit are the number of sides that are divided in the middle: a triangle with n of them has
//! n + 1 children, the last one first. The high two bits of a divided triangle name the corner
//! opposite to the only side that is divided, or to the only one that is not; of a whole triangle,
//! they are its state. State 3 means that a further digit has the state less 3.
//!
//! Source: the files that `PrusaSlicer` 2.3 to 2.9 writes.

use lamp_brep::vector::{Vec3, middle};

/// The paint on a region of the surface, for supports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paint {
    /// Supports must stand there.
    Enforced,
    /// No support may stand there.
    Blocked,
}

lamp_stack::named!(Paint { Enforced = "enforced", Blocked = "blocked" });

impl Paint {
    fn of_state(state: u32) -> Option<Self> {
        match state {
            1 => Some(Self::Enforced),
            2 => Some(Self::Blocked),
            _ => None,
        }
    }
}

/// Calls `each` with the triangles that a facet with these corners is divided into, and their
/// paint. Returns `None` if the digits are not such a tree.
pub(crate) fn divided(
    digits: &str,
    corners: [Vec3; 3],
    mut each: impl FnMut(Option<Paint>, [Vec3; 3]),
) -> Option<()> {
    let mut digits = digits.chars().rev().map(|digit| digit.to_digit(16));
    // Each triangle takes a digit, so a tree ends with its text.
    let mut triangles = vec![corners];
    while let Some(triangle) = triangles.pop() {
        let digit = digits.next()??;
        let (divided, high) = (digit & 3, digit >> 2);
        if divided == 0 {
            let state = if high == 3 { digits.next()?? + 3 } else { high };
            each(Paint::of_state(state), triangle);
            continue;
        }
        if high == 3 {
            return None;
        }
        let [a, b, c] = [0, 1, 2].map(|k| triangle[(high as usize + k) % 3]);
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        match divided {
            1 => triangles.extend([[a, b, bc], [bc, c, a]]),
            2 => triangles.extend([[a, ab, ca], [ab, b, ca], [b, c, ca]]),
            _ => triangles.extend([[a, ab, ca], [ab, b, bc], [bc, c, ca], [ab, bc, ca]]),
        }
    }
    digits.next().is_none().then_some(())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const CORNERS: [Vec3; 3] = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 8.0, 0.0]];

    type Leaf = (Option<Paint>, [[f64; 2]; 3]);

    fn leaves(digits: &str) -> Option<Vec<Leaf>> {
        let mut leaves = Vec::new();
        let flat = |corners: [Vec3; 3]| corners.map(|[x, y, _]| [x, y]);
        divided(digits, CORNERS, |paint, corners| leaves.push((paint, flat(corners))))?;
        Some(leaves)
    }

    fn area(corners: &[[f64; 2]; 3]) -> f64 {
        let [a, b, c] = corners;
        ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])) / 2.0
    }

    #[test]
    fn divisions_are_the_ones_that_prusa_slicer_draws() {
        let [none, enforced, blocked] = [None, Some(Paint::Enforced), Some(Paint::Blocked)];
        let [a, b, c] = [[0.0, 0.0], [4.0, 0.0], [0.0, 8.0]];
        let [ab, bc, ca] = [[2.0, 0.0], [2.0, 4.0], [0.0, 4.0]];
        let cases = [
            ("8", vec![(blocked, [a, b, c])]),
            ("4", vec![(enforced, [a, b, c])]),
            ("0", vec![(none, [a, b, c])]),
            // The ninth extruder of another kind of paint does not count for supports.
            ("6C", vec![(none, [a, b, c])]),
            // One side: opposite to the first, the second and the third corner.
            ("481", vec![(blocked, [bc, c, a]), (enforced, [a, b, bc])]),
            ("485", vec![(blocked, [ca, a, b]), (enforced, [b, c, ca])]),
            ("489", vec![(blocked, [ab, b, c]), (enforced, [c, a, ab])]),
            // All sides but the one opposite to the first and to the third corner.
            ("0482", vec![(blocked, [b, c, ca]), (enforced, [ab, b, ca]), (none, [a, ab, ca])]),
            ("048A", vec![(blocked, [a, b, bc]), (enforced, [ca, a, bc]), (none, [c, ca, bc])]),
            (
                "80043",
                vec![
                    (enforced, [ab, bc, ca]),
                    (none, [bc, c, ca]),
                    (none, [ab, b, bc]),
                    (blocked, [a, ab, ca]),
                ],
            ),
        ];
        for (digits, expected) in cases {
            assert_eq!(leaves(digits), Some(expected), "{digits}");
        }
        // The middle one of four is divided again.
        let deep = leaves("000080033").unwrap();
        assert_eq!(deep.len(), 7);
        assert_eq!(deep.iter().filter(|(paint, _)| *paint == blocked).count(), 1);
    }

    #[test]
    fn other_texts_are_refused() {
        for wrong in ["", "G", "C", "3", "03", "00", "81", "8D", "44F", "ü", " 8", "+8", "000 3"] {
            assert_eq!(leaves(wrong), None, "{wrong}");
        }
        let chain = "1".repeat(1 << 20);
        assert_eq!(leaves(&chain), None);
        assert_eq!(
            leaves(&("8".repeat((1 << 10) + 1) + &"1".repeat(1 << 10))).unwrap().len(),
            1025
        );
    }

    /// Writes a random tree.
    fn tree() -> impl Strategy<Value = String> {
        let leaf = (0..3u32).prop_map(|state| format!("{:X}", state << 2));
        leaf.prop_recursive(6, 200, 4, |inner| {
            (1..4u32, 0..3u32, prop::collection::vec(inner, 4)).prop_map(
                |(sides, corner, parts)| {
                    let children = parts[..sides as usize + 1].concat();
                    format!("{children}{:X}", corner << 2 | sides)
                },
            )
        })
    }

    proptest! {
        #[test]
        fn parts_cover_the_triangle_and_face_its_way(digits in tree()) {
            let leaves = leaves(&digits).unwrap();
            prop_assert!(leaves.iter().all(|(_, corners)| area(corners) > 0.0));
            let sum: f64 = leaves.iter().map(|(_, corners)| area(corners)).sum();
            prop_assert!((sum - 16.0).abs() < 1e-9, "{sum}");
        }
    }
}
