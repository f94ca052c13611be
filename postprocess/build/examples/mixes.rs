//! Packs mixes of flat parts on a strip 200 mm wide, and prints what length of it they take, in
//! what time.
//!
//! ```sh
//! cargo run --release -p lamp-build --example mixes [DPI]
//! ```

use std::time::Instant;

use lamp_build::{Layout, Pack, PackBy, PartStack, TileError, Turns};
use lamp_fixtures::Plate;
use lamp_stack::{Image, Layer, Length, PageInfo, Pitch};

/// A plate, its scale and the number of its copies.
type Share = (Plate, f64, u32);

/// Five shapes that lock into each other.
const SHAPES: [Share; 5] = [
    (Plate::Triangle, 1.0, 8),
    (Plate::L, 1.0, 8),
    (Plate::T, 1.0, 8),
    (Plate::U, 1.0, 8),
    (Plate::Crescent, 1.0, 8),
];

/// Rings, and parts that fit into them.
const NESTED: [Share; 5] = [
    (Plate::Ring, 1.0, 12),
    (Plate::T, 0.5, 12),
    (Plate::Crescent, 0.5, 12),
    (Plate::U, 1.0, 6),
    (Plate::L, 1.0, 6),
];

/// Blades, with rings and small parts between them.
const BLADES: [Share; 3] =
    [(Plate::Aerofoil, 1.0, 24), (Plate::Ring, 1.0, 8), (Plate::Triangle, 0.5, 16)];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let dpi: f64 = std::env::args().nth(1).as_deref().unwrap_or("254").parse()?;
    let mixes = [("shapes", SHAPES.as_slice()), ("nested", &NESTED), ("blades", &BLADES)];
    for (name, mix) in mixes {
        let parts = mix.iter().map(|share| part(share, dpi)).collect::<Result<Vec<_>, _>>()?;
        let counts: Vec<Option<u32>> = mix.iter().map(|(_, _, count)| Some(*count)).collect();
        let pack = Pack { by: PackBy::Outlines, turns: Turns::Quarters, ..Pack::default() };
        let start = Instant::now();
        let layout =
            Layout::packed(parts, &counts, "200x400mm".parse()?, Length::from_mm(1.0), pack)?;
        let seconds = start.elapsed().as_secs_f64();
        println!("{name:8} {:6.1} mm {seconds:6.2} s", length_mm(&layout));
    }
    Ok(())
}

/// Returns a plate as one layer.
fn part((plate, scale, _): &Share, dpi: f64) -> Result<PartStack, TileError> {
    let image = Image::Mask(plate.mask(25.4 / dpi / scale));
    let layer = Layer { info: PageInfo::default(), pitch: Pitch::of_dpi(dpi), image: image.into() };
    let outline = PartStack::of_outline(plate.name(), std::iter::once(Ok::<_, TileError>(layer)))?;
    Ok(outline.expect("a layer"))
}

/// Returns how far the copies reach along the strip.
fn length_mm(layout: &Layout) -> f64 {
    let bottom =
        |at: &lamp_build::CopyPlacement| at.top + layout.parts()[at.part].size(at.turn).height;
    let ends = layout
        .placements()
        .iter()
        .map(bottom)
        .max()
        .zip(layout.placements().iter().map(|at| at.top).min());
    ends.map_or(0.0, |(bottom, top)| f64::from(bottom - top) * layout.pitch().mm()[1])
}
