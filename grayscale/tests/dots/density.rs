//! How many dots windows hold.

use lamp_grayscale::DitherMethod;
use lamp_stack::Mask;

use super::{DOTS, PERIOD, dots, pixels};

/// The side of the windows whose density is to be that of the level.
const WINDOW: usize = 16;

/// White pixels in every window of an image, by sums over its corners.
fn in_windows(mask: &Mask, window: usize) -> Vec<u32> {
    let (width, height) = (mask.width() as usize, mask.height() as usize);
    let mut sums = vec![0; (width + 1) * (height + 1)];
    for (at, white) in pixels(mask).into_iter().enumerate() {
        let here = (at / width + 1) * (width + 1) + at % width + 1;
        let above = here - width - 1;
        sums[here] = sums[above] + sums[here - 1] + u32::from(white) - sums[above - 1];
    }
    let sum = |column: usize, row: usize| sums[row * (width + 1) + column];
    let mut counts = Vec::new();
    for row in 0..=height - window {
        for column in 0..=width - window {
            let (right, bottom) = (column + window, row + window);
            let outside = sum(right, row) + sum(column, bottom);
            counts.push(sum(right, bottom) + sum(column, row) - outside);
        }
    }
    counts
}

/// Levels from one share of 255 to another, rounded.
fn levels(shares: std::ops::RangeInclusive<f64>) -> std::ops::RangeInclusive<u8> {
    (shares.start() * 255.0).round() as u8..=(shares.end() * 255.0).round() as u8
}

/// The largest root mean square and the largest error of any level.
fn errors_of(method: DitherMethod, side: u32, layer: u32) -> [f64; 2] {
    let mut errors = [0.0f64; 2];
    for level in levels(0.05..=0.95) {
        let share = f64::from(level) / 255.0;
        let counts = in_windows(&dots(method, level, side, layer), WINDOW);
        let pixels = (WINDOW * WINDOW) as f64;
        let off = counts.iter().map(|&count| (f64::from(count) / pixels - share).abs());
        let [squares, worst] =
            off.fold([0.0, 0.0], |[squares, worst], off| [squares + off * off, off.max(worst)]);
        let rms = (squares / counts.len() as f64).sqrt();
        errors = [errors[0].max(rms), errors[1].max(worst)];
    }
    errors
}

/// Every window of the mask, those across its seams too, lies in an image a
/// window larger than it.
const SIDE: u32 = PERIOD + WINDOW as u32;

#[test]
fn windows_of_blue_noise_have_the_density_of_the_level() {
    let [rms, worst] = errors_of(DitherMethod::BlueNoise, SIDE, 0);
    println!("blue-noise: {rms} rms, {worst} at worst");
    assert!(rms <= 0.01 && worst <= 0.03, "{rms} rms, {worst} at worst");
}

#[test]
fn windows_of_the_ordered_pattern_are_its_period() {
    let [_, worst] = errors_of(DitherMethod::Ordered, SIDE, 5);
    assert!(worst <= 0.5 / 256.0 + 1e-12, "{worst} at worst");
}

/// Those at the rim, too. An image that has no end is tried at its beginning,
/// and in several layers.
#[test]
fn windows_of_diffused_errors_have_the_density_of_the_level() {
    for (method, most) in [(DitherMethod::FloydSteinberg, 0.03), (DitherMethod::SierraLite, 0.035)]
    {
        for layer in [0, 1, 50, 127] {
            let [rms, worst] = errors_of(method, 300, layer);
            println!("{}, layer {layer}: {rms} rms, {worst} at worst", method.name());
            assert!(rms <= 0.01 && worst <= most, "{layer}: {rms} rms, {worst} at worst");
        }
    }
}

/// The side of the largest square of one color.
fn largest_square(mask: &Mask) -> usize {
    let solid = |&side: &usize| {
        let all = (side * side) as u32;
        in_windows(mask, side).into_iter().any(|count| count == 0 || count == all)
    };
    (1..).take_while(solid).last().unwrap_or(0)
}

/// Five pixels of 1500 dpi are the 85 um at which films were uneven.
#[test]
fn no_square_of_one_colour_is_as_wide_as_what_cured_unevenly() {
    for method in DOTS {
        for layer in [0, 1, 50, 127] {
            let squares =
                levels(0.25..=0.75).map(|level| largest_square(&dots(method, level, SIDE, layer)));
            let largest = squares.max().unwrap();
            println!("{}, layer {layer}: {largest}", method.name());
            assert!(largest < 5, "{}, layer {layer}: {largest}", method.name());
        }
    }
}
