//! Opens a recipe, makes layers of it in a random order and then some in sequence, codes them, and
//! prints the times.
//!
//! ```sh
//! cargo run --release -p lamp-build --example compose RECIPE [RANDOM] [FROM..TO]
//! ```

use std::path::Path;
use std::time::Instant;

use lamp_build::{Composer, RecipeError};
use lamp_stack::{Destination, Format, Layer, StackError, write_stack};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [recipe, rest @ ..] = arguments.as_slice() else { return Err("write a recipe".into()) };
    let random: usize = rest.first().map_or(Ok(20), |count| count.parse())?;
    let start = Instant::now();
    let mut composer = Composer::open(Path::new(recipe))?;
    println!("opened in {:.3} s", start.elapsed().as_secs_f64());
    let indices = composer.indices().to_vec();
    let mut place = 1;
    for _ in 0..random {
        // A generator of Lehmer's.
        place = place * 48_271 % 2_147_483_647_usize;
        let index = indices[place % indices.len()];
        let start = Instant::now();
        let layer = composer.layer(index)?;
        let made = start.elapsed().as_secs_f64();
        let bytes = written(std::iter::once(Ok(layer)))?;
        let coded = start.elapsed().as_secs_f64();
        println!("layer {index}: {made:.3} s, with coding {coded:.3} s, {bytes} bytes");
    }
    if let Some((from, to)) = rest.get(1).and_then(|range| range.split_once("..")) {
        let start = Instant::now();
        let cpu = cpu_seconds();
        let mut count = 0;
        let layers = composer.range(from.parse()?..to.parse()?)?;
        written(layers.inspect(|_| count += 1))?;
        let [all, cpu] = [start.elapsed().as_secs_f64(), cpu_seconds() - cpu];
        let each = |seconds: f64| 1000.0 * seconds / f64::from(count);
        println!(
            "{count} layers in sequence: {:.1} ms each, {:.1} ms of CPU",
            each(all),
            each(cpu)
        );
    }
    Ok(())
}

/// Codes layers, and returns the bytes that they take.
fn written(
    layers: impl Iterator<Item = Result<Layer, RecipeError>>,
) -> Result<u64, Box<dyn std::error::Error>> {
    let file = tempfile::NamedTempFile::new()?;
    let layers = layers.map(|layer| layer.map_err(|error| Failure(error.to_string())));
    let written = write_stack(layers, Destination::File(file.path().to_owned()), Format::Big);
    written.map_err(|Failure(error)| error)?;
    Ok(file.path().metadata()?.len())
}

struct Failure(String);

impl From<StackError> for Failure {
    fn from(error: StackError) -> Self {
        Self(error.to_string())
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

/// Returns the CPU time of all threads so far, in user and system.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split(' ').collect();
    let ticks: f64 = [12, 13].iter().filter_map(|&k| fields.get(k)?.parse::<f64>().ok()).sum();
    ticks / 100.0
}
