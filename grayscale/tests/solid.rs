//! Checks the pixels that dithering must not change.

use std::error::Error;

use lamp_grayscale::{DitherMethod, dither, dither_image};
use lamp_stack::{GrayMask, Image, Layer, Mask, PageInfo};
use proptest::prelude::*;

fn gray_image() -> impl Strategy<Value = GrayMask> {
    let level = prop_oneof![Just(0), Just(255), any::<u8>()];
    let row = prop::collection::vec((0u32..9, level), 0..12);
    prop::collection::vec(row, 0..20).prop_map(|rows| {
        let mut gray = GrayMask::new(100);
        rows.into_iter().for_each(|row| gray.push_runs(row).unwrap());
        gray
    })
}

fn level_at(gray: &GrayMask, column: u32, row: usize) -> u8 {
    let changes = gray.rows().nth(row).unwrap();
    changes.iter().rev().find(|change| change.column <= column).map_or(0, |change| change.level)
}

proptest! {
    #[test]
    fn solid_pixels_keep_their_colour(gray in gray_image(), layer in any::<u32>()) {
        for method in DitherMethod::ALL {
            let dots = dither_image(&gray, method, layer).unwrap();
            prop_assert_eq!((dots.width(), dots.height()), (gray.width(), gray.height()));
            for pixel in 0..gray.width() * gray.height() {
                let (column, row) = (pixel % 100, pixel / 100);
                match level_at(&gray, column, row as usize) {
                    0 => prop_assert!(!dots.is_white(column, row)),
                    255 => prop_assert!(dots.is_white(column, row)),
                    _ => {}
                }
            }
        }
    }
}

#[test]
fn masks_pass_unchanged_and_gray_pages_name_the_method() {
    let info = PageInfo { index: 3, ..PageInfo::default() };
    let mask = Image::Mask(Mask::new(8, vec![0, 2], vec![1, 4]).unwrap());
    let masked = Layer { info: info.clone(), pitch: None, image: mask.into() };
    let gray = Layer { info, pitch: None, image: GrayMask::new(8).into() };
    let layers = [masked.clone(), gray].into_iter().map(Ok::<_, Box<dyn Error + Send + Sync>>);
    let dots = dither(layers, DitherMethod::FloydSteinberg);
    let out: Vec<_> = dots.map(|layer| layer.unwrap().decode().unwrap()).collect();
    assert_eq!(out[0], masked);
    assert!(matches!(*out[1].image, Image::Mask(_)));
    assert_eq!(out[1].info.other["dither"], "floyd-steinberg");
}

/// Half gray gives up to one run per pixel: such a page is refused before dithering.
#[test]
fn dots_that_no_reader_takes_are_refused() {
    let mut gray = GrayMask::new(1 << 26);
    for _ in 0..8 {
        gray.push_runs([(1 << 26, 128)]).unwrap();
    }
    let error = dither_image(&gray, DitherMethod::BlueNoise, 3).unwrap_err();
    assert!(error.to_string().starts_with("layer 3: its dots make more than 134217728 runs"));
}
