//! Slices a part and writes its layers: `cargo run --example slice_and_write -- blade.stl blade.tif`.

use std::env;
use std::error::Error;

use lamp_slicer::slicer::{OpenOptions, Part, SliceOptions, Slices};
use lamp_slicer::stack::{Destination, Format, Length, Pitch, write_stack};

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<_> = env::args().collect();
    let [_, part, to] = &words[..] else { return Err("name a part and a TIFF to write".into()) };
    let part = Part::open(part.as_ref(), &OpenOptions::default())?;
    let options = SliceOptions {
        pitch: Pitch::of_dpi(600.0).ok_or("a resolution is above zero")?,
        thickness: Length::from_um(100.0),
        ..SliceOptions::default()
    };
    // Layers are made and written one after the other: memory holds a few of them.
    let layers = Slices::new(part, &options)?.map(|layer| Ok::<_, lamp_slicer::Error>(layer?));
    write_stack(layers, Destination::File(to.into()), Format::Big)?;
    Ok(())
}
