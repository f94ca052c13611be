//! Plans the exposure of layers of several thicknesses: `cargo run --example exposure_plan`.

use std::error::Error;

use lamp_slicer::grayscale::exposure::Exposure;
use lamp_slicer::grayscale::material::Material;
use lamp_slicer::stack::{Catalogued, Length};

fn main() -> Result<(), Box<dyn Error>> {
    let material = Material::builtin("lamp-suspension").ok_or("there is no such resin")?;
    // White cures half as deep again as its layer, so that it bonds to the layer below.
    let exposure = Exposure::by_material(material, None, 1.5)?;
    for um in [50.0, 100.0, 150.0] {
        let thickness = Length::from_um(um);
        println!("{thickness}: {:.0} ms", exposure.time(thickness)?.ms());
    }
    Ok(())
}
