//! Packs flat parts on a square of 584.2 mm, and prints how many fit in what time.
//!
//! ```sh
//! cargo run --release -p lamp-build --example builds [DPI [ANGLE]]
//! ```
//!
//! With an angle such as `15deg`, parts may also lie at its multiples.

use std::time::Instant;

use lamp_build::{FreeTurns, Layout, Pack, PackBy, PartStack, TileError, TurnedPlan, Turns};
use lamp_fixtures::Plate;
use lamp_stack::{Image, Layer, Length, PageInfo, Pitch};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let dpi: f64 = words.next().as_deref().unwrap_or("254").parse()?;
    let free: Option<FreeTurns> = words.next().map(|angle| angle.parse()).transpose()?;
    let area = "584.2x584.2mm".parse()?;
    for plate in Plate::ALL {
        let gap = Length::from_mm(if plate == Plate::Aerofoil { 4.0 } else { 1.0 });
        let part = [part(plate, dpi)?];
        let pack = |turns| Pack { by: PackBy::Outlines, turns, ..Pack::default() };
        if let Some(free) = free {
            let start = Instant::now();
            let pack = pack(Turns::Quarters);
            let plan = TurnedPlan::new(&part, &[[0.0; 2]], &[None], area, gap, pack, free)?;
            tell(plate, &free.to_string(), plan.layout(), start);
            continue;
        }
        for turns in [Turns::None, Turns::Half, Turns::Quarters] {
            let start = Instant::now();
            let layout = Layout::packed(part.to_vec(), &[None], area, gap, pack(turns))?;
            tell(plate, turns.name(), &layout, start);
        }
    }
    Ok(())
}

fn tell(plate: Plate, turns: &str, layout: &Layout, start: Instant) {
    let seconds = start.elapsed().as_secs_f64();
    let (name, copies, stacks) = (plate.name(), layout.placements().len(), layout.parts().len());
    println!("{name:9} --turns {turns:8} {copies:5} copies of {stacks} stacks {seconds:6.2} s");
}

/// Returns a plate as one layer.
fn part(plate: Plate, dpi: f64) -> Result<PartStack, TileError> {
    let image = Image::Mask(plate.mask(25.4 / dpi));
    let info = PageInfo { origin_mm: Some([0.0; 2]), ..PageInfo::default() };
    let layer = Layer { info, pitch: Pitch::of_dpi(dpi), image: image.into() };
    let outline = PartStack::of_outline(plate.name(), std::iter::once(Ok::<_, TileError>(layer)))?;
    Ok(outline.expect("a layer"))
}
