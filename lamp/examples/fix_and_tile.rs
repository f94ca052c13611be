//! Corrects stray rows of a stack and lays out four copies:
//! `cargo run --example fix_and_tile -- blade.tif build.tif`.

use std::env;
use std::error::Error;
use std::path::Path;

use lamp_slicer::build::{TileOptions, tile};
use lamp_slicer::fix::{FixOptions, fix};
use lamp_slicer::stack::{Destination, Format, Pages, write_stack};

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<_> = env::args().collect();
    let [_, from, to] = &words[..] else { return Err("name a stack and a TIFF to write".into()) };
    let layers = Pages::open(Path::new(from))?.layers();
    let layers = layers.map(|layer| Ok::<_, lamp_slicer::Error>(layer?));
    let fixed = fix(layers, FixOptions::default(), |fixed| {
        for band in fixed.bands {
            println!("layer {}: row {} is corrected", fixed.before.info.index, band.first_row);
        }
    });
    let fixed = fixed.map(|layer| Ok::<_, lamp_slicer::Error>(layer?.decode()?));
    let options = TileOptions { area: "300x300mm".parse()?, ..TileOptions::default() };
    write_stack(tile(fixed, options), Destination::File(to.into()), Format::Big)?;
    Ok(())
}
