//! Dots of a gray image that is moved, as copies on a build area are.

use lamp_grayscale::{DitherMethod, dither_image};
use lamp_stack::GrayMask;
use proptest::prelude::*;

use super::PERIOD;

/// An image's rows as runs.
type Rows = Vec<Vec<(u32, u8)>>;

fn rows() -> impl Strategy<Value = Rows> {
    let level = prop_oneof![Just(0), Just(255), any::<u8>()];
    let row = prop::collection::vec((0u32..40, level), 0..8);
    prop::collection::vec(row, 1..40)
}

const WIDTH: u32 = 320;

/// The rows with so many black pixels left of them and above them.
fn moved(rows: &Rows, right: u32, down: u32) -> GrayMask {
    let mut gray = GrayMask::new(WIDTH + right);
    (0..down).for_each(|_| gray.push_runs([]).unwrap());
    for row in rows {
        gray.push_runs(std::iter::once((right, 0)).chain(row.iter().copied())).unwrap();
    }
    gray
}

proptest! {
    /// So `dither | tile` and `tile | dither` differ by the pattern's phase
    /// alone.
    #[test]
    fn an_image_moved_by_the_period_has_its_dots_moved(
        rows in rows(), right in 0u32..3, down in 0u32..3, layer in any::<u32>(),
    ) {
        let (right, down) = (right * PERIOD, down * PERIOD);
        for method in DitherMethod::ALL {
            let here = dither_image(&moved(&rows, 0, 0), method, layer).unwrap();
            let there = dither_image(&moved(&rows, right, down), method, layer).unwrap();
            prop_assert_eq!(here.white_pixels(), there.white_pixels());
            for (row, transitions) in (down..).zip(here.rows()) {
                let moved: Vec<u32> = transitions.iter().map(|column| column + right).collect();
                prop_assert_eq!(there.row(row), moved);
            }
        }
    }
}
