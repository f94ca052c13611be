//! Reads one layer of a stack as a picture of the crate `image`:
//! `cargo run --example layer_as_image -- blade.tif 600 layer.bmp`.

use std::env;
use std::error::Error;
use std::path::Path;

use image::{GrayImage, Luma};
use lamp_slicer::stack::{Image, Pages, gray_runs};

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<_> = env::args().collect();
    let [_, stack, index, to] = &words[..] else {
        return Err("name a stack, the index of a layer and a picture to write".into());
    };
    let layer = Pages::open(Path::new(stack))?.layers().nth(index.parse()?);
    let layer = layer.ok_or("the stack has fewer layers")??;
    let picture = match &*layer.image {
        Image::Mask(mask) => {
            let mut picture = GrayImage::new(mask.width(), mask.height());
            for (row, changes) in (0..).zip(mask.rows()) {
                // A row is the columns where black and white take turns.
                for run in changes.chunks(2) {
                    let end = run.get(1).copied().unwrap_or(mask.width());
                    (run[0]..end).for_each(|column| picture.put_pixel(column, row, Luma([255])));
                }
            }
            picture
        }
        Image::Gray(gray) => {
            let mut picture = GrayImage::new(gray.width(), gray.height());
            for (row, changes) in (0..).zip(gray.rows()) {
                for (start, end, level) in gray_runs(changes, gray.width()) {
                    (start..end).for_each(|column| picture.put_pixel(column, row, Luma([level])));
                }
            }
            picture
        }
    };
    picture.save(to)?;
    Ok(())
}
