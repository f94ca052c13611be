//! Lays copies of a stack out in a mesh, as many as fit, and writes the build; prints the CPU time
//! of each layer.
//!
//! ```sh
//! cargo run --release -p lamp-build --example mesh STACK AREA OUT [MOAT]
//! ```

use std::path::Path;

use lamp_build::{HeightOptions, Layout, MeshOptions, Moat, Pack, PartStack, TileError};
use lamp_stack::{Destination, Format, Pages, StackError, write_stack};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [stack, area, out, rest @ ..] = arguments.as_slice() else {
        return Err("write a stack, an area, and a file for the build".into());
    };
    let moat: Moat = rest.first().map_or(Ok(Moat::default()), |moat| moat.parse())?;
    let layers = || Ok::<_, StackError>(Pages::open(Path::new(stack))?.map(|page| page?.decode()));
    let part = PartStack::of_outline("part", layers()?.map(|layer| layer.map_err(Failure::Stack)))?
        .ok_or("an empty stack")?;
    let options = MeshOptions { moat, ..MeshOptions::default() };
    let layout =
        Layout::packed(vec![part], &[None], area.parse()?, options.gap(), Pack::default())?;
    eprintln!("{} copies", layout.placements().len());
    let layout = layout.with_mesh(&options)?;
    let stacks = vec![layers()?.map(|layer| layer.map_err(Failure::Stack))];
    let before = cpu_seconds();
    let mut count = 0;
    let build = layout.build(stacks, HeightOptions::default(), |_| {}).inspect(|_| count += 1);
    write_stack(build, Destination::File(out.into()), Format::Big)?;
    let cpu = cpu_seconds() - before;
    println!("{count} layers, {:.1} ms of CPU each", 1000.0 * cpu / f64::from(count));
    Ok(())
}

#[derive(Debug)]
enum Failure {
    Stack(StackError),
    Tile(TileError),
}

impl From<StackError> for Failure {
    fn from(error: StackError) -> Self {
        Self::Stack(error)
    }
}

impl From<TileError> for Failure {
    fn from(error: TileError) -> Self {
        Self::Tile(error)
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Stack(error) => error.fmt(f),
            Self::Tile(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for Failure {}

/// Returns the CPU time of all threads so far, in user and system.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split(' ').collect();
    let ticks: f64 = [12, 13].iter().filter_map(|&k| fields.get(k)?.parse::<f64>().ok()).sum();
    ticks / 100.0
}
