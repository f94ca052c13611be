//! What dots must be, whatever the image: even in density, without clusters,
//! elsewhere in the next layer. 002 section 3.3.6 is why.

mod density;
mod layers;
mod ramp;
mod spectrum;
mod tiles;

use lamp_grayscale::{DitherMethod, dither_image};
use lamp_stack::{GrayMask, Mask, white_runs};

/// The methods that make dots.
const DOTS: [DitherMethod; 4] = [
    DitherMethod::BlueNoise,
    DitherMethod::Ordered,
    DitherMethod::FloydSteinberg,
    DitherMethod::SierraLite,
];

/// The period of every method's pattern, in pixels and in layers but for the
/// ordered one's 256 layers.
const PERIOD: u32 = 128;

/// Returns a square image of one level.
fn flat(level: u8, side: u32) -> GrayMask {
    let mut gray = GrayMask::new(side);
    for _ in 0..side {
        gray.push_runs([(side, level)]).unwrap();
    }
    gray
}

/// Returns the dots of a level in a layer.
fn dots(method: DitherMethod, level: u8, side: u32, layer: u32) -> Mask {
    dither_image(&flat(level, side), method, layer).unwrap()
}

/// Returns a mask's pixels, row by row.
fn pixels(mask: &Mask) -> Vec<bool> {
    let mut pixels = Vec::new();
    for row in mask.rows() {
        let start = pixels.len();
        pixels.resize(start + mask.width() as usize, false);
        for (from, to) in white_runs(row, mask.width()) {
            pixels[start + from as usize..start + to as usize].fill(true);
        }
    }
    pixels
}
