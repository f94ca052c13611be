//! Dots over the layers: holes must not stack.

use lamp_grayscale::DitherMethod;

use super::{PERIOD, dots, pixels};

/// What a pixel of a flat image is over the layers.
struct Stacked {
    /// The fewest and the most layers in which a pixel is white, of any 16 that
    /// follow each other.
    white_of_16: [u32; 2],
    /// The most layers in a row in which a pixel is black, and white.
    most_in_a_row: [u32; 2],
}

fn stacked(method: DitherMethod, level: u8) -> Stacked {
    // All that blue noise and the ordered pattern ever do.
    let layers: Vec<_> =
        (0..256 + 16).map(|layer| pixels(&dots(method, level, PERIOD, layer))).collect();
    let mut stacked = Stacked { white_of_16: [16, 0], most_in_a_row: [0, 0] };
    for pixel in 0..layers[0].len() {
        let white: Vec<bool> = layers.iter().map(|layer| layer[pixel]).collect();
        for of_16 in white.windows(16) {
            let count = of_16.iter().filter(|white| **white).count() as u32;
            let [fewest, most] = stacked.white_of_16;
            stacked.white_of_16 = [fewest.min(count), most.max(count)];
        }
        for run in white.chunk_by(|a, b| a == b) {
            let most = &mut stacked.most_in_a_row[usize::from(run[0])];
            *most = run.len().max(*most as usize) as u32;
        }
    }
    stacked
}

#[track_caller]
fn check(method: DitherMethod, level: u8, white_of_16: [u32; 2], most_in_a_row: [u32; 2]) {
    let found = stacked(method, level);
    let both = (found.white_of_16, found.most_in_a_row);
    println!("{} {level}: {both:?}", method.name());
    assert!(
        found.white_of_16[0] >= white_of_16[0]
            && found.white_of_16[1] <= white_of_16[1]
            && found.most_in_a_row[0] <= most_in_a_row[0]
            && found.most_in_a_row[1] <= most_in_a_row[1],
        "{} {level}: {both:?}",
        method.name()
    );
}

#[test]
fn blue_noise_fills_its_holes_within_a_few_layers() {
    check(DitherMethod::BlueNoise, 128, [6, 10], [3, 3]);
    check(DitherMethod::BlueNoise, 64, [2, 6], [7, 2]);
    check(DitherMethod::BlueNoise, 191, [10, 15], [2, 9]);
}

#[test]
fn the_ordered_pattern_fills_its_holes_in_turn() {
    check(DitherMethod::Ordered, 128, [8, 9], [1, 3]);
    check(DitherMethod::Ordered, 64, [4, 4], [3, 1]);
    check(DitherMethod::Ordered, 191, [12, 12], [1, 3]);
}

/// Errors undo part of what the thresholds ask for.
#[test]
fn diffused_errors_fill_holes_less_regularly() {
    check(DitherMethod::FloydSteinberg, 128, [2, 14], [10, 10]);
    check(DitherMethod::FloydSteinberg, 64, [0, 9], [29, 3]);
    // Dots of layers that know nothing of each other.
    check(DitherMethod::SierraLite, 64, [0, 13], [58, 10]);
}

#[test]
fn the_next_layer_is_another_and_the_same_layer_is_the_same() {
    for method in super::DOTS {
        let layer = |index| dots(method, 100, 64, index);
        assert!(layer(7) == layer(7) && layer(7) != layer(8), "{}", method.name());
        // The last index there is.
        assert_ne!(layer(u32::MAX), layer(u32::MAX - 1));
    }
    assert_eq!(
        dots(DitherMethod::Threshold, 128, 64, 1),
        dots(DitherMethod::Threshold, 128, 64, 2)
    );
}
