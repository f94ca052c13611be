//! Lists what floats in a stack: `cargo run --example check -- blade.tif`.

use std::env;
use std::error::Error;
use std::path::Path;

use lamp_slicer::stack::Pages;
use lamp_slicer::supports::{CheckOptions, check};

fn main() -> Result<(), Box<dyn Error>> {
    let stack = env::args().nth(1).ok_or("name a stack")?;
    let layers = Pages::open(Path::new(&stack))?.layers();
    let layers = layers.map(|layer| Ok::<_, lamp_slicer::Error>(layer?));
    let findings = check(layers, Ok, &CheckOptions::default())?;
    println!("{} islands", findings.islands.count());
    Ok(())
}
