//! Packs flat parts on a square of 584.2 mm, and prints how many fit in what time.
//!
//! ```sh
//! cargo run --release -p lamp-postprocess --example builds [DPI]
//! ```

use std::time::Instant;

use lamp_fixtures::Plate;
use lamp_postprocess::{Layout, Pack, PackBy, PartStack, TileError, Turns};
use lamp_stack::{Dpi, Image, Layer, Length, PageInfo};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let dpi: f64 = std::env::args().nth(1).as_deref().unwrap_or("254").parse()?;
    for plate in Plate::ALL {
        let gap = Length::from_mm(if plate == Plate::Aerofoil { 4.0 } else { 1.0 });
        let part = [part(plate, dpi)?];
        for turns in [Turns::None, Turns::Half, Turns::Quarters] {
            let pack = Pack { by: PackBy::Outlines, turns, ..Pack::default() };
            let start = Instant::now();
            let layout =
                Layout::packed(part.to_vec(), &[None], "584.2x584.2mm".parse()?, gap, pack)?;
            let seconds = start.elapsed().as_secs_f64();
            let (name, copies) = (plate.name(), layout.placements().len());
            println!("{name:9} --turns {turns:8} {copies:5} copies {seconds:6.2} s");
        }
    }
    Ok(())
}

/// Returns a plate as one layer.
fn part(plate: Plate, dpi: f64) -> Result<PartStack, TileError> {
    let image = Image::Mask(plate.mask(25.4 / dpi));
    let layer = Layer { info: PageInfo::default(), dpi: Dpi::new(dpi), image: image.into() };
    let outline = PartStack::of_outline(plate.name(), std::iter::once(Ok::<_, TileError>(layer)))?;
    Ok(outline.expect("a layer"))
}
