//! Writes a binary STL with its facets in random order, always the same.
//!
//! ```sh
//! cargo run --release -p lamp-benches --example shuffle blade.stl shuffled.stl
//! ```

use lamp_fixtures::SplitMix;

const HEADER: usize = 84;
const FACET: usize = 50;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let paths: Vec<String> = std::env::args().skip(1).collect();
    let [from, to] = paths.as_slice() else {
        return Err("name an STL and the one to write".into());
    };
    let mut stl = std::fs::read(from)?;
    let facets = stl[HEADER..].as_chunks_mut::<FACET>().0;
    let mut random = SplitMix(1);
    for last in (1..facets.len()).rev() {
        facets.swap(last, random.below(last + 1));
    }
    Ok(std::fs::write(to, stl)?)
}
