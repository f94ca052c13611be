//! `fix`: its messages, pictures and corrections, and the rows that it leaves.

mod evidence;
mod fix_report;
mod no_metadata;
mod options;
mod strays;
mod strict;
mod thin;
mod untouched;

use lamp_fixtures::{Defect, Facet, inject};
use lamp_stack::Layer;
use lamp_tests::{Ran, Scratch, differing, tilted_ball};
use serde_json::Value;

/// The ball without some of its facets, sliced to `stray.tif`, and the facets.
fn broken_ball(count: usize, seed: u64, slicing: &str) -> (Scratch, Vec<Facet>) {
    let scratch = Scratch::new();
    let whole = tilted_ball();
    let mut mesh = whole.clone();
    let chosen = inject(&mut mesh, Defect::Drop, count, seed);
    scratch.mesh("ball.stl", &mesh);
    scratch.mesh("whole.stl", &whole);
    scratch.run(&format!("slice ball.stl {slicing} -o stray.tif")).succeeds();
    (scratch, chosen.into_iter().map(|facet| whole.facets[facet]).collect())
}

/// Images some 140 pixels wide, bands of up to 20 rows.
const COARSE: &str = "--dpi 300 --thickness 200um";

/// Corrects `stray.tif` to `fixed.tif`, and reads the report.
fn report(scratch: &Scratch, options: &str) -> (Value, Ran) {
    let ran = scratch.run(&format!("fix stray.tif {options} --report fix.json -o fixed.tif"));
    let report = serde_json::from_slice(&scratch.bytes("fix.json")).expect("JSON");
    (report, ran)
}

fn bands(report: &Value) -> &[Value] {
    report["bands"].as_array().expect("a list of bands")
}

fn number(value: &Value) -> u32 {
    value.as_u64().and_then(|number| number.try_into().ok()).expect("a whole number")
}

fn is_corrected(band: &Value) -> bool {
    band["outcome"] == "corrected"
}

fn layer_of<'a>(layers: &'a [Layer], band: &Value) -> &'a Layer {
    let index = number(&band["layer"]);
    layers.iter().find(|layer| layer.info.index == index).expect("such a layer")
}

/// How many pixels differ between two stacks.
fn pixels_off(a: &[Layer], b: &[Layer]) -> usize {
    let off = |(a, b): (&Layer, &Layer)| -> usize {
        (0..a.image.height()).map(|row| differing(&a.image, &b.image, row).len()).sum()
    };
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(off).sum()
}
